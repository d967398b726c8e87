from math import atan2, inf, nan, pi

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from landmark_forms import covariance, exactly, floats, scene
from oracles import DIGITS, correction, read_only

from roboloc.angles import wrap
from roboloc_reference.gaussian import measurement_update
from roboloc_reference.landmarks import (
    evaluate,
    init_landmarks,
    innovation,
    measurement,
    predict,
    update,
)

EPS = np.finfo(float).eps
law = settings(deadline=None, derandomize=True, max_examples=40)
seed = st.integers(0, 2**32 - 1)
count = st.integers(0, 4)
Q = np.diag([0.02, 0.05]) ** 2


@law
@given(seed, st.integers(1, 4))
def test_the_measurement_is_its_derivation(seed, k):
    """Bearing, range and both Jacobians equal SymPy's with 50 digits, to 1e-12 of their size."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-5, 5, 3 + 2 * k)
    for j in range(k):
        values = (*x[:3], *x[3 + 2 * j : 5 + 2 * j])
        z, Hp, Hl = measurement(x, j)
        exact = floats(exactly("z", *values)).ravel()
        assert abs(wrap(z[0] - exact[0])) <= 1e-12
        assert z[1] == pytest.approx(exact[1], rel=1e-12)
        for got, name in ((Hp, "Hp"), (Hl, "Hl")):
            form = floats(exactly(name, *values))
            np.testing.assert_allclose(got, form, rtol=0, atol=1e-12 * np.abs(form).max())


@law
@given(seed, count)
def test_the_prediction_is_its_derivation(seed, k):
    """Mean and covariance equal G Sigma G^T + L R L^T of the whole state with 50 digits, to 1e-12."""
    rng = np.random.default_rng(seed)
    n = 3 + 2 * k
    x, Sigma, control, R = (
        rng.uniform(-5, 5, n),
        covariance(rng, n),
        rng.uniform(-2, 2, 2),
        covariance(rng, 3),
    )
    got_x, got = predict(x, Sigma, control, R)
    with mp.workdps(DIGITS):
        G, L = mp.eye(n), mp.zeros(n, 3)
        G[:3, :3] = exactly("G", *x[:3], *control)
        L[:3, :3] = exactly("L", *x[:3], *control)
        exact = floats(G * mp.matrix(Sigma.tolist()) * G.T + L * mp.matrix(R.tolist()) * L.T)
    np.testing.assert_allclose(got_x[:3], floats(exactly("g", *x[:3], *control)).ravel(), atol=1e-12)
    np.testing.assert_array_equal(got_x[3:], x[3:])
    np.testing.assert_allclose(got, exact, atol=1e-12 * np.abs(exact).max())
    np.testing.assert_array_equal(got[:3], got[:, :3].T)
    np.testing.assert_array_equal(got[3:, 3:], Sigma[3:, 3:])


@law
@given(seed, count)
def test_the_first_map_is_its_derivation(seed, k):
    """Landmarks and their covariances among each other and with the pose equal SymPy's, to 1e-12."""
    z, Q, pose, pose_cov = scene(np.random.default_rng(seed), k)
    n = 3 + 2 * k
    x, Sigma = init_landmarks(z, Q, pose, pose_cov)
    with mp.workdps(DIGITS):
        A, own = mp.zeros(n, 3), mp.zeros(n, n)
        A[:3, :3] = mp.eye(3)
        for j in range(k):
            values, at = (*pose, *z[2 * j : 2 * j + 2]), slice(3 + 2 * j, 5 + 2 * j)
            np.testing.assert_allclose(x[at], floats(exactly("l", *values)).ravel(), atol=1e-12)
            A[at, :3] = exactly("J_pose", *values)
            J_z = exactly("J_z", *values)
            own[at, at] = J_z * mp.matrix(Q.tolist()) * J_z.T
        exact = floats(A * mp.matrix(pose_cov.tolist()) * A.T + own)
    np.testing.assert_array_equal(x[:3], pose)
    np.testing.assert_allclose(Sigma, exact, atol=1e-12 * np.abs(exact).max())
    np.testing.assert_array_equal(Sigma, Sigma.T)


@law
@given(seed, st.integers(1, 4))
def test_a_first_look_and_the_prediction_of_it_are_inverse(seed, k):
    """The new map predicts the look it came from, and its derivatives undo the first ones."""
    z, Q, pose, pose_cov = scene(np.random.default_rng(seed), k)
    x, _ = init_landmarks(z, Q, pose, pose_cov)
    for j in range(k):
        h, Hp, Hl = measurement(x, j)
        assert abs(wrap(h[0] - z[2 * j])) <= 1e-12
        assert h[1] == pytest.approx(z[2 * j + 1], rel=1e-12)
        values = (*pose, *z[2 * j : 2 * j + 2])
        np.testing.assert_allclose(Hp + Hl @ floats(exactly("J_pose", *values)), 0, atol=1e-12)
        np.testing.assert_allclose(Hl @ floats(exactly("J_z", *values)), np.eye(2), atol=1e-12)


@law
@given(seed, count)
def test_the_update_is_conditioning(seed, k):
    """Mean and covariance equal the information form with 100 digits, to 1e-9, correlated noise included."""
    rng = np.random.default_rng(seed)
    z, Q, pose, pose_cov = scene(rng, k)
    x, Sigma = init_landmarks(z, Q, pose, pose_cov)
    look = z + 0.1 * rng.normal(size=2 * k)
    got_x, got = update(x, Sigma, look, Q)
    if not k:
        np.testing.assert_array_equal(got_x, x)
        np.testing.assert_array_equal(got, Sigma)
        return
    v, H = stacked(x, look)
    for mine, theirs in zip((v, H), innovation(x, look), strict=True):
        np.testing.assert_array_equal(mine, theirs)
    exact_x, exact = correction(x, Sigma, v, np.kron(np.eye(k), Q), H)
    np.testing.assert_allclose(got_x, floats(exact_x).ravel(), atol=1e-9)
    np.testing.assert_allclose(got, floats(exact), atol=1e-9)
    np.testing.assert_array_equal(got, got.T)


def stacked(x, z, which=None):
    """Stack what `measurement` says of some landmarks, all by default, about one x."""
    k = (len(x) - 3) // 2
    which = range(k) if which is None else which
    v, H = np.zeros((len(which), 2)), np.zeros((len(which), 2, len(x)))
    for row, j in enumerate(which):
        h, H[row, :, :3], H[row, :, 3 + 2 * j : 5 + 2 * j] = measurement(x, j)
        v[row] = z[2 * j : 2 * j + 2] - h
    v[:, 0] = wrap(v[:, 0])
    return v.ravel(), H.reshape(-1, len(x))


def one_after_another(x, Sigma, z, *, relinearize):
    """Use the landmarks in turn, linearized where the state is now or where it was at first."""
    first = x
    for j in range((len(x) - 3) // 2):
        v, H = stacked(x if relinearize else first, z, [j])
        x, Sigma = measurement_update(x, Sigma, v if relinearize else v - H @ (x - first), Q, H)
    return x, Sigma


def test_a_batch_is_the_landmarks_in_turn_about_one_point():
    """With one linearization, batch and sequence agree to 1e-12; linearized anew they agree only if z = h(x)."""
    rng = np.random.default_rng(11)
    z, _, pose, pose_cov = scene(rng, 4)
    x, Sigma = init_landmarks(z, Q, pose, pose_cov)
    x, Sigma = predict(x, Sigma, [0.0, 0.0], 0.05 * covariance(rng, 3))  # else the pose learns nothing
    look = z + 0.1 * rng.normal(size=8)
    batch = update(x, Sigma, look, Q)
    for got, expected in zip(one_after_another(x, Sigma, look, relinearize=False), batch, strict=True):
        np.testing.assert_allclose(got, expected, atol=1e-12)
    assert np.abs(one_after_another(x, Sigma, look, relinearize=True)[0] - batch[0]).max() > 1e-4
    batch = update(x, Sigma, z, Q)
    for got, expected in zip(one_after_another(x, Sigma, z, relinearize=True), batch, strict=True):
        np.testing.assert_allclose(got, expected, atol=1e-12)


def test_a_second_look_from_the_same_place_says_nothing_of_the_pose():
    """With the right cross-covariance the pose keeps mean and variance to 1e-12; with zeros it seems to learn."""
    rng = np.random.default_rng(16)
    z, _, pose, pose_cov = scene(rng, 4)
    x, Sigma = init_landmarks(z, Q, pose, pose_cov)
    look = z + 0.02 * rng.normal(size=8)
    got_x, got = update(x, Sigma, look, Q)
    np.testing.assert_allclose(got_x[:3], pose, atol=1e-12)
    np.testing.assert_allclose(got[:3, :3], pose_cov, atol=1e-12)
    Sigma[:3, 3:] = Sigma[3:, :3] = 0.0
    assert np.trace(update(x, Sigma, look, Q)[1][:3, :3]) < 0.9 * np.trace(pose_cov)


def test_with_a_certain_map_slam_is_localization():
    """Landmarks without variance are not moved, and the pose is corrected as by a filter of three numbers."""
    rng = np.random.default_rng(12)
    z, _, pose, pose_cov = scene(rng, 3)
    x, Sigma = init_landmarks(z, Q, pose, pose_cov)
    Sigma[3:], Sigma[:, 3:] = 0.0, 0.0
    look = z + 0.05 * rng.normal(size=6)
    v, H = stacked(x, look)
    alone_x, alone = measurement_update(x[:3], Sigma[:3, :3], v, np.kron(np.eye(3), Q), H[:, :3])
    got_x, got = update(x, Sigma, look, Q)
    np.testing.assert_allclose(got_x, [*alone_x, *x[3:]], atol=1e-12)
    np.testing.assert_allclose(got[:3, :3], alone, atol=1e-12)
    assert not got[3:].any()


def test_a_run_without_noise_has_no_error():
    """Two turns around six landmarks, seen without error from the true first pose, end with error 0 to 1e-10."""
    truth = np.array([3, 6, 3, 12, 7, 8, 7, 14, 11, 6, 11, 12], dtype=float)
    pose, P, R = np.array([4.0, 4.0, 0.1]), np.diag([0.02, 0.02, 0.1]) ** 2, np.diag([0.25, 0.1, 0.1]) ** 2

    def look():
        delta = truth.reshape(6, 2) - pose[:2]
        bearing = [wrap(atan2(dy, dx) - pose[2]) for dx, dy in delta]
        return np.stack([bearing, np.hypot(*delta.T)], axis=-1).ravel()

    x, Sigma = init_landmarks(look(), Q, pose, P)
    for _ in range(40):
        x, Sigma = predict(x, Sigma, [1.0, pi / 10], R)
        pose = pose + np.array([np.cos(pose[2]), np.sin(pose[2]), pi / 10])
        x, Sigma = update(x, Sigma, look(), Q)
    np.testing.assert_allclose(x, [*pose, *truth], atol=1e-10)
    for distance in evaluate(x, Sigma, truth):
        assert distance.max() < 1e-8
    assert np.linalg.eigvalsh(Sigma)[0] >= -15 * EPS * np.linalg.norm(Sigma, 2)


def test_edges_have_their_shapes_and_their_wrap():
    """No landmark, a landmark at range 0, one straight behind and one near enough to touch are no accident."""
    x, Sigma = init_landmarks([], Q, [1.0, 2.0, 3.0], np.eye(3))
    assert (x.shape, Sigma.shape) == ((3,), (3, 3))
    assert [part.shape for part in evaluate(x, Sigma, [])] == [(0,), (0,)]
    assert update(*predict(x, Sigma, [0.0, 0.0], np.zeros((3, 3))), [], Q)[1].shape == (3, 3)
    x, Sigma = init_landmarks([0.0, 0.0], Q, [1.0, 2.0, 3.0], np.eye(3))
    np.testing.assert_array_equal(x[3:], x[:2])
    assert np.isfinite(Sigma).all()
    assert measurement([0.0, 0.0, 0.0, -2.0, 0.0], 0)[0][0] == -pi
    behind = [0.0, 0.0, 0.0, -2.0, 1e-3]
    moved, _ = update(behind, np.eye(5), [-pi + 1e-3, 2.0], Q)
    np.testing.assert_allclose(moved, behind, atol=1e-2)
    near = measurement([0.0, 0.0, 0.0, 0.0, 1e-200], 0)
    assert near[0][1] == 1e-200
    assert all(np.isfinite(part).all() for part in near)


def test_a_robot_that_is_told_nothing_stays_as_it_is():
    """Control 0 without noise changes no bit of mean or covariance, control 0 with noise the pose's block alone."""
    z, Q, pose, pose_cov = scene(np.random.default_rng(17), 2)
    x, Sigma = init_landmarks(z, Q, pose, pose_cov)
    for got, expected in zip(predict(x, Sigma, [0.0, 0.0], np.zeros((3, 3))), (x, Sigma), strict=True):
        np.testing.assert_array_equal(got, expected)
    shaken_x, shaken = predict(x, Sigma, [0.0, 0.0], 0.04 * np.eye(3))
    Sigma[:3, :3] += 0.04 * np.eye(3)
    np.testing.assert_array_equal(shaken_x, x)
    np.testing.assert_allclose(shaken, Sigma, atol=1e-15)


def test_an_exact_range_leaves_no_doubt_of_it():
    """With a singular Q no range has a variance afterwards; an exact look at a certain range is refused."""
    z, _, pose, pose_cov = scene(np.random.default_rng(18), 2)
    exact = np.diag([0.01, 0.0])
    x, Sigma = init_landmarks(z, exact, pose, pose_cov)
    x, Sigma = predict(x, Sigma, [0.5, 0.1], 0.01 * np.eye(3))
    _, H = innovation(x, z)
    _, after = update(x, Sigma, z, exact)
    assert np.abs(H[1::2] @ after).max() <= 1e-15
    assert (np.diag(H[::2] @ after @ H[::2].T) > 1e-4).all()
    with pytest.raises(ValueError, match="singular"):
        update(np.array([0.0, 0.0, 0.0, 2.0, 0.0]), np.zeros((5, 5)), [0.0, 2.0], exact)


def test_a_certain_and_a_huge_prior_keep_their_sign():
    """Over 200 updates with variances from 1e-8 to 1e8 no eigenvalue is below rounding."""
    rng = np.random.default_rng(14)
    for _ in range(200):
        z, _, pose, _ = scene(rng, 3)
        prior = np.diag(10.0 ** rng.uniform(-8, 8, 3))
        x, Sigma = init_landmarks(z, Q, pose, prior)
        _, after = update(x, Sigma, z, np.diag(10.0 ** rng.uniform(-8, 0, 2)))
        assert np.linalg.eigvalsh(after)[0] >= -9 * EPS * np.linalg.norm(Sigma, 2)


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted everywhere, and no result shares memory with them."""
    z, Q, pose, pose_cov = first = read_only(*scene(np.random.default_rng(15), 2))
    x, Sigma = state = read_only(*init_landmarks(*first))
    control, R, truth = rest = read_only([1.0, 0.1], np.eye(3), np.ones(4))
    results = (
        *init_landmarks(z, Q, pose, pose_cov),
        *predict(x, Sigma, control, R),
        *measurement(x, 1),
        *innovation(x, z),
        *update(x, Sigma, z, Q),
        *evaluate(x, Sigma, truth),
        *predict(pose, pose_cov, control, R),
        *update(pose, pose_cov, [], Q),
    )
    for result in results:
        assert result.flags.writeable
        assert not any(np.shares_memory(result, argument) for argument in (*first, *state, *rest))


X, P, I2, I3 = np.array([0.0, 0.0, 0.0, 3.0, 1.0]), np.eye(5), np.eye(2), np.eye(3)


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        (init_landmarks, ([0.1], I2, np.zeros(3), I3), r"z: expected shape \(2k,\), got shape \(1,\)"),
        (init_landmarks, ([0.1, -2.0], I2, np.zeros(3), I3), "z: expected no negative range, got -2"),
        (init_landmarks, ([0.1, 2.0], I3, np.zeros(3), I3), "Q: expected shape"),
        (init_landmarks, ([0.1, 2.0], I2, np.zeros(2), I3), "pose: expected shape"),
        (init_landmarks, ([0.1, 2.0], I2, np.zeros(3), I2), "pose_cov: expected shape"),
        (init_landmarks, ([nan, 2.0], I2, np.zeros(3), I3), "z: expected finite"),
        (predict, (np.zeros(4), np.eye(4), [1, 0], I3), r"x: expected shape \(3 \+ 2k,\), got shape \(4,\)"),
        (predict, (np.zeros(1), np.eye(1), [1, 0], I3), r"x: expected shape \(3 \+ 2k,\)"),
        (predict, (X, I3, [1, 0], I3), "Sigma: expected shape"),
        (predict, (X, P, [1, 0, 0], I3), "control: expected shape"),
        (predict, (X, P, [1, inf], I3), "control: expected finite"),
        (predict, (X, P, [1, 0], I2), "control_cov: expected shape"),
        (measurement, (X, 1), "j: expected a landmark from 0 to k - 1 with k = 1, got 1"),
        (measurement, (X, -1), "j: expected a landmark"),
        (measurement, (X, 0.5), "j: expected a whole number, got float"),
        (measurement, (np.zeros(5), 0), "x: expected landmark 0 off the robot"),
        (innovation, (np.zeros(4), []), r"x: expected shape \(3 \+ 2k,\)"),
        (innovation, (X, [0.1]), "z: expected shape"),
        (update, (X, P, [0.1, 2.0, 0.3, 1.0], I2), "z: expected shape"),
        (update, (X, P, [0.1, 2.0], I3), "Q: expected shape"),
        (update, (X, np.zeros((5, 5)), [0.1, 2.0], np.zeros((2, 2))), "singular"),
        (update, (np.zeros(5), P, [0.1, 2.0], I2), "x: expected landmark 0 off the robot"),
    ],
)
def test_wrong_arguments_are_named(function, arguments, message):
    """A wrong argument is an error with its name, what was expected and what came."""
    with pytest.raises(ValueError, match=message):
        function(*arguments)
