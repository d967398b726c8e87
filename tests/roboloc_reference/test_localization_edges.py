import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rooms import draw_room

from benchmarks.extraction import LIDAR, PARAMS, VAR_RHO, VAR_THETA, scalar
from roboloc.angles import difference
from roboloc.worlds import maze
from roboloc_reference.ekf import EkfLocalization
from roboloc_reference.extraction import extract_lines, fit_line
from roboloc_reference.gaussian import measurement_update
from roboloc_reference.line_fit import fit_runs
from roboloc_reference.lines import compute_predicted_measurements

law = settings(deadline=None, derandomize=True, max_examples=50)
seed = st.integers(0, 2**32 - 1)

POSE, TF = np.array([-6.0, -4.0, 0.4]), np.array([0.1, 0.02, 0.05])
SIGMA0, R, Q = np.diag([0.02, 0.03, 0.01]), np.diag([0.01, 0.02]), np.diag([1e-4, 4e-4])


def filter_in(map_lines, x0=POSE, Sigma0=SIGMA0, tf=TF, g=3.0, R=R):
    """Return the filter of problem 1 with the reference stages."""
    return EkfLocalization(x0, Sigma0, R, map_lines, tf, g)


def eigenvalues_left(before, after):
    """Return the eigenvalues of what a correction has taken from the covariance."""
    return np.linalg.eigvalsh(before - after)


# ---------------------------------------------------------------- edges of a run


@pytest.mark.parametrize("seen", ["nothing", "far off"])
def test_no_observation_that_counts_changes_nothing(seen):
    """A scan without lines, and one whose lines are all outside the gate, leave mean and covariance to the last bit."""
    ekf = filter_in(maze().map_lines)
    z = np.zeros((2, 0)) if seen == "nothing" else np.array([[0.5, -2.0], [40.0, 50.0]])
    ekf.measurement_update(z, [Q] * z.shape[1])
    np.testing.assert_array_equal(ekf.x, POSE)
    np.testing.assert_allclose(ekf.Sigma, SIGMA0, atol=1e-17)


def test_two_observations_of_one_wall_are_one_of_half_the_covariance():
    """A wall seen in two pieces with equal covariances counts as their mean with half of it."""
    h, _ = compute_predicted_measurements(POSE, maze().map_lines, TF)
    a, b = h[:, 0] + [0.01, -0.02], h[:, 0] + [-0.004, 0.03]
    twice, once = filter_in(maze().map_lines), filter_in(maze().map_lines)
    twice.measurement_update(np.stack([a, b], axis=1), [Q, Q])
    once.measurement_update(((a + b) / 2)[:, None], [Q / 2])
    np.testing.assert_allclose(twice.x, once.x, atol=1e-12)
    np.testing.assert_allclose(twice.Sigma, once.Sigma, atol=1e-14)
    assert abs(once.x - POSE).max() > 1e-3


@pytest.mark.parametrize("turns", [-1, 0, 1])
@pytest.mark.parametrize("beyond", [-1e-3, 0.0, 1e-3])
def test_a_wall_straight_behind_is_no_edge(beyond, turns):
    """A wall seen at alpha just below pi and predicted just above -pi is an innovation of a little, not of a turn."""
    ahead = filter_in([[0.0], [2.0]], np.zeros(3), tf=np.zeros(3))
    behind = filter_in([[-np.pi], [2.0]], [0.0, 0.0, 2 * np.pi * turns], tf=np.zeros(3))
    ahead.measurement_update([[beyond], [1.9]], [Q])
    behind.measurement_update([[difference(np.pi + beyond, 0.0)], [1.9]], [Q])
    assert behind.x[2] - 2 * np.pi * turns == pytest.approx(ahead.x[2], abs=1e-12)
    np.testing.assert_allclose(behind.x[:2], -ahead.x[:2], atol=1e-12)
    np.testing.assert_allclose(np.diag(behind.Sigma), np.diag(ahead.Sigma), atol=1e-12)


def test_a_wall_through_the_scanner_helps_or_is_left_out():
    """With r = 0 a wall named as predicted corrects; named from its other side it is dropped, not misused."""
    for alpha, sign in ((0.3, 1), (0.3 + np.pi, -1)):
        ekf = filter_in([[0.3], [0.0]], np.zeros(3), tf=np.zeros(3))
        ekf.measurement_update([[alpha], [0.01]], [Q])
        if sign > 0:
            np.testing.assert_allclose(ekf.x[:2] @ [np.cos(0.3), np.sin(0.3)], -0.01, atol=5e-4)
            assert eigenvalues_left(SIGMA0, ekf.Sigma)[-1] > 1e-3
        else:
            np.testing.assert_array_equal(ekf.x, np.zeros(3))
            np.testing.assert_allclose(ekf.Sigma, SIGMA0, atol=1e-17)


@pytest.mark.parametrize("omega", [1e-12, -1e-12, 1e-9, -1e-9, 5e-324])
def test_a_tiny_turn_is_hardly_a_turn(omega):
    """Ten steps with a tiny omega end where straight ones end, with the same covariance, on both sides of 0."""
    straight, turning = filter_in(maze().map_lines), filter_in(maze().map_lines)
    for _ in range(10):
        straight.transition_update([0.5, 0.0], 0.1)
        turning.transition_update([0.5, omega], 0.1)
    np.testing.assert_allclose(turning.x, straight.x, atol=2 * abs(omega) + 1e-15)
    np.testing.assert_allclose(turning.Sigma, straight.Sigma, atol=2 * abs(omega) + 1e-15)


def test_no_time_no_doubt():
    """A step of no length moves nothing and adds no covariance."""
    ekf = filter_in(maze().map_lines)
    ekf.transition_update([0.5, 0.3], 0.0)
    np.testing.assert_array_equal(ekf.x, POSE)
    np.testing.assert_array_equal(ekf.Sigma, SIGMA0)


def test_an_exact_observation_is_believed_and_two_that_differ_are_refused():
    """A singular Q: what is seen without error is certain afterwards; the same thing seen twice so is a ValueError."""
    H = np.array([[1.0, 2.0, 0.0], [0.0, 0.0, 1.0]])
    x, Sigma = measurement_update(np.zeros(3), SIGMA0, [0.3, 0.1], np.diag([0.0, 0.01]), H)
    assert H[0] @ x == pytest.approx(0.3, abs=1e-15)
    assert H[0] @ Sigma @ H[0] == pytest.approx(0.0, abs=1e-16)
    assert Sigma[2, 2] == pytest.approx(0.005)
    with pytest.raises(ValueError, match=r"^Q: expected .*, got "):
        measurement_update(np.zeros(3), SIGMA0, [0.3, 0.3], np.zeros((2, 2)), H[[0, 0]])


# ---------------------------------------------------------------- one thing computed two ways


def test_on_a_straight_drive_it_is_the_kalman_filter():
    """With a known heading the problem is linear: 12 steps end where conditioning on all observations at once ends."""
    # The oracle knows no recursion: the errors of start, controls and observations are one Gaussian vector, poses and
    # observations are linear in it, and the last pose is conditioned on all that was seen.
    rng, steps, dt, theta = np.random.default_rng(3), 12, 0.2, 0.7
    walls = np.array([[0.2, 1.9, -2.5], [4.0, 3.0, 5.0]])
    normals = np.stack([np.cos(walls[0]), np.sin(walls[0])], axis=1)
    x0, Sigma0, speed = np.array([0.5, -0.4, theta]), np.diag([0.04, 0.09, 0.0]), 0.01
    ekf = filter_in(walls, x0, Sigma0, np.zeros(3), g=50.0, R=np.diag([speed, 0.0]))

    heading = np.array([np.cos(theta), np.sin(theta)])
    prior = np.diag([*np.diag(Sigma0)[:2], *[dt * speed] * steps])
    position, rows, residuals = np.hstack([np.eye(2), np.zeros((2, steps))]), [], []
    mean = x0[:2].copy()
    for k in range(steps):
        ekf.transition_update([0.4, 0.0], dt)
        mean = mean + 0.4 * dt * heading
        position = position.copy()
        position[:, 2 + k] = dt * heading
        z = np.stack([walls[0] - theta, walls[1] - normals @ mean]) + 0.05 * rng.normal(size=(2, 3)) * [
            [0],
            [1],
        ]
        ekf.measurement_update(z, [Q] * 3)
        rows.append(-normals @ position)
        residuals.append(z[1] - (walls[1] - normals @ mean))
    H, v = np.vstack(rows), np.concatenate(residuals)
    gain = prior @ H.T @ np.linalg.inv(H @ prior @ H.T + Q[1, 1] * np.eye(v.size))
    errors, left = gain @ v, prior - gain @ H @ prior
    np.testing.assert_allclose(ekf.x[:2], mean + position @ errors, atol=1e-12)
    np.testing.assert_allclose(ekf.Sigma[:2, :2], position @ left @ position.T, atol=1e-14)
    assert ekf.x[2] == theta


@law
@given(seed, st.integers(1, 8))
def test_all_lines_at_once_are_the_lines_one_by_one(seed, S):
    """The fit of many runs in one go is the fit of each, to rounding."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(2, 30, size=S)
    theta, rho = rng.uniform(-3, 3, counts.sum()), rng.uniform(0.5, 4, counts.sum())
    alpha, r, C = fit_runs(theta, rho, counts, 1e-5, 1e-3)
    for m, (i, j) in enumerate(zip(np.cumsum(counts) - counts, np.cumsum(counts), strict=True)):
        one = fit_line(theta[i:j], rho[i:j], 1e-5, 1e-3)
        assert abs(difference(alpha[m], one[0])) < 1e-11
        assert r[m] == pytest.approx(one[1], abs=1e-11)
        np.testing.assert_allclose(C[m], one[2], rtol=1e-9, atol=1e-9 * np.abs(one[2]).max())


def test_the_extraction_is_its_plain_twin():
    """In 25 random rooms the lines, covariances and beams are those of the loops over floats of the benchmark."""
    for k in range(25):
        rng = np.random.default_rng(k)
        rho = LIDAR.scan(draw_room(rng), np.append(rng.uniform(-0.3, 0.3, 2), rng.uniform(-3, 3)), rng)
        alpha, r, C, _, ranges = extract_lines(LIDAR.bearings, rho, PARAMS, VAR_THETA, VAR_RHO)
        plain = scalar(LIDAR.bearings.tolist(), rho.tolist())
        np.testing.assert_array_equal(ranges, plain[3])
        np.testing.assert_allclose(difference(alpha, plain[0]), 0.0, atol=1e-11)
        np.testing.assert_allclose(r, plain[1], atol=1e-11)
        np.testing.assert_allclose(C, plain[2], rtol=1e-6, atol=1e-15)
