"""The edges of the velocity model, for all filters that are built on it."""

import numpy as np
import pytest

from roboloc_reference import invariant, particle, ukf, velocity_ekf
from roboloc_reference.velocity import noise, range_bearing

ALPHAS = np.array([1e-3, 1e-4, 1e-4, 1e-3, 1e-4, 1e-4])
LANDMARKS = np.array([[4.0, 1.0], [-2.0, 5.0]])
Q = np.diag([0.02, 0.05]) ** 2
X = np.array([0.5, -1.0, 0.4])
SIGMA = np.array([[0.04, 0.01, 0.005], [0.01, 0.03, -0.004], [0.005, -0.004, 0.01]])
KAPPAS = [2.0, 0.0, -2.9]
NO_NOISE, SHIFT = np.zeros((3, 3)), np.array([0.01, 0.1, -0.01, 0.1])


def predictions(u, dt, M=None):
    """Return the beliefs that the EKF and the UKF with each kappa predict."""
    M = noise(u, ALPHAS) if M is None else M
    return [
        velocity_ekf.predict(X, SIGMA, u, M, dt),
        *(ukf.predict(X, SIGMA, u, M, dt, kappa) for kappa in KAPPAS),
    ]


@pytest.mark.parametrize("omega", [1e-300, 1e-12, -1e-12, 1e-7, -1e-7])
def test_a_tiny_turn_is_none(omega):
    """A tiny omega of either sign predicts what omega = 0 does, to the size of its effect, in every filter."""
    for turning, straight in zip(
        predictions([1.2, omega, 0.0], 0.5), predictions([1.2, 0.0, 0.0], 0.5), strict=True
    ):
        for got, expected in zip(turning, straight, strict=True):
            np.testing.assert_allclose(got, expected, rtol=0, atol=1e-15 + abs(omega))
    cloud = [
        particle.predict(np.tile(X, (5, 1)), [1.2, w, 0.0], ALPHAS, 0.5, np.random.default_rng(0))
        for w in (omega, 0.0)
    ]
    np.testing.assert_allclose(*cloud, atol=1e-15 + abs(omega))


def test_a_robot_at_rest_is_where_it_was():
    """With no speed, no turn and so no noise, nothing changes but rounding."""
    for x, Sigma in predictions([0.0, 0.0, 0.0], 0.5):
        np.testing.assert_allclose(x, X, atol=1e-15)
        np.testing.assert_allclose(Sigma, SIGMA, atol=1e-15)
    xs = particle.predict(np.tile(X, (5, 1)), np.zeros(3), ALPHAS, 0.5, np.random.default_rng(0))
    np.testing.assert_array_equal(xs, np.tile(X, (5, 1)))


def test_a_robot_that_turns_on_the_spot_stays():
    """With v = 0 and a certain speed the place and its covariance stay, and the heading turns."""
    M = np.diag([0.0, 0.02, 0.01])
    for x, Sigma in predictions([0.0, 0.8, 0.1], 0.5, M):
        np.testing.assert_allclose(x, X + np.array([0.0, 0.0, 0.45]), atol=1e-14)
        np.testing.assert_allclose(Sigma[:2], SIGMA[:2], atol=1e-14)
        assert Sigma[2, 2] == pytest.approx(SIGMA[2, 2] + 0.25 * 0.03)


def test_ekf_is_the_kalman_filter_where_all_is_linear():
    """A robot that turns on a known spot is a linear system: twenty steps of the EKF are the textbook's scalars."""
    rng = np.random.default_rng(1)
    x, Sigma = np.array([0.0, 0.0, 0.2]), np.diag([0.0, 0.0, 0.05])
    theta, p, dt, M = 0.2, 0.05, 0.3, np.diag([0.0, 0.02, 0.01])
    for _ in range(20):
        x, Sigma = velocity_ekf.predict(x, Sigma, [0.0, 0.1, 0.05], M, dt)
        theta, p = theta + 0.15 * dt, p + dt**2 * 0.03
        bearing = range_bearing(x, LANDMARKS[0])[0][0] + 0.1 * rng.normal()
        expected = range_bearing([0.0, 0.0, theta], LANDMARKS[0])[0]
        x, Sigma = velocity_ekf.correct(x, Sigma, [bearing, expected[1]], LANDMARKS[:1], Q)
        gain = -p / (p + Q[0, 0])
        theta, p = theta + gain * (bearing - expected[0]), (1 + gain) * p
        np.testing.assert_allclose(x, [0.0, 0.0, theta], atol=1e-12)
        np.testing.assert_allclose(Sigma, np.diag([0.0, 0.0, p]), atol=1e-12)


@pytest.mark.parametrize("bearing", [np.pi, -np.pi, np.nextafter(np.pi, 0)])
def test_half_a_turn_is_one_bearing(bearing):
    """A landmark straight behind, seen at plus or minus pi, leaves the place of every filter as it was."""
    x, landmark, z = np.zeros(3), np.array([[-2.0, 0.0]]), np.array([bearing, 2.0])
    Sigma = 1e-6 * np.eye(3)
    for got, _ in (
        velocity_ekf.correct(x, Sigma, z, landmark, Q),
        *(ukf.correct(x, Sigma, z, landmark, Q, kappa) for kappa in KAPPAS),
    ):
        np.testing.assert_allclose(got, 0, atol=1e-7)
    Y = [[2 * np.cos(bearing), 2 * np.sin(bearing), 1.0]]
    got, _ = invariant.correct(np.eye(3), Sigma, Y, landmark, Q)
    np.testing.assert_allclose(got, np.eye(3), atol=1e-12)
    ws = particle.correct([[0.0, 0.0, 0.01], [0.0, 0.0, -0.01]], [0.5, 0.5], z, landmark, Q)
    np.testing.assert_allclose(ws, 0.5, atol=1e-12)


@pytest.mark.parametrize("singular", [np.zeros((3, 3)), np.diag([0.04, 0.0, 0.01]), np.ones((3, 3))])
def test_a_singular_covariance_is_one_too(singular):
    """Certain directions stay certain through correction, and prediction keeps a covariance one."""
    z = np.concatenate([range_bearing(X, landmark)[0] for landmark in LANDMARKS]) + SHIFT
    u = np.array([1.0, 0.3, 0.0])
    steps = [
        (
            velocity_ekf.correct(X, singular, z, LANDMARKS, Q),
            velocity_ekf.predict(X, singular, u, NO_NOISE, 0.5),
        ),
        *(
            (ukf.correct(X, singular, z, LANDMARKS, Q, k), ukf.predict(X, singular, u, NO_NOISE, 0.5, k))
            for k in KAPPAS
        ),
    ]
    null = np.linalg.svd(singular)[2][np.linalg.matrix_rank(singular) :]
    for (x, corrected), (_, predicted) in steps:
        for Sigma in (corrected, predicted):
            assert np.linalg.eigvalsh(Sigma)[0] > -1e-12
        np.testing.assert_allclose(null @ corrected, 0, atol=1e-9)
        np.testing.assert_allclose(null @ (x - X), 0, atol=1e-9)


def test_a_singular_observation_is_exact():
    """An exact range and an ordinary bearing: the EKF and the UKF are certain of the range, and stay covariances."""
    R = np.diag([0.02**2, 0.0])
    z, H = range_bearing(X, LANDMARKS[0])
    for _, Sigma in (
        velocity_ekf.correct(X, 1e-4 * SIGMA, z, LANDMARKS[:1], R),
        *(ukf.correct(X, 1e-4 * SIGMA, z, LANDMARKS[:1], R, kappa) for kappa in KAPPAS),
    ):
        assert H[1] @ Sigma @ H[1] < 1e-3 * (H[1] @ (1e-4 * SIGMA) @ H[1])
        assert np.linalg.eigvalsh(Sigma)[0] > -1e-15


def test_nothing_seen_changes_nothing():
    """Without landmark every filter returns its belief."""
    for x, Sigma in (
        velocity_ekf.correct(X, SIGMA, [], [], Q),
        *(ukf.correct(X, SIGMA, [], [], Q, kappa) for kappa in KAPPAS),
    ):
        np.testing.assert_array_equal(x, X)
        np.testing.assert_array_equal(Sigma, SIGMA)
    np.testing.assert_allclose(particle.correct([X, X], [1.0, 3.0], [], [], Q), [0.25, 0.75])
    got, P = invariant.correct(np.eye(3), SIGMA, [], [], Q)
    np.testing.assert_allclose(got, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(P, SIGMA, atol=1e-15)
