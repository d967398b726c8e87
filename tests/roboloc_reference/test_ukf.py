import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import read_only

from roboloc.angles import wrap
from roboloc.metrics import chi2_band, nees
from roboloc_reference.gaussian import measurement_update
from roboloc_reference.ukf import correct, predict, sigma_points
from roboloc_reference.velocity import jacobians, motion, noise, range_bearing, range_bearings

law = settings(deadline=None, derandomize=True, max_examples=40)
seed = st.integers(0, 2**32 - 1)
ALPHAS = np.array([1e-3, 1e-4, 1e-4, 1e-3, 1e-4, 1e-4])
LANDMARKS = np.array([[4.0, 1.0], [-2.0, 5.0]])
Q = np.diag([0.02**2, 0.05**2])


def covariance(rng, n, scale=1.0):
    """Draw a covariance with eigenvalues between 0.1 and 10 times `scale` squared."""
    axes, _ = np.linalg.qr(rng.normal(size=(n, n)))
    Sigma = axes * (scale**2 * 10.0 ** rng.uniform(-1, 1, size=n)) @ axes.T
    return (Sigma + Sigma.T) / 2


def ekf_predict(mean, cov, u, M, dt):
    """Predict with the Jacobians instead of the points."""
    F, W = jacobians(mean, u, dt)
    return motion(mean, u, dt), F @ cov @ F.T + W @ M @ W.T


def ekf_correct(mean, cov, z, landmarks, R):
    """Correct with the Jacobians instead of the points."""
    pairs = [range_bearing(mean, landmark) for landmark in landmarks]
    v = z - np.concatenate([h for h, _ in pairs])
    v[::2] = wrap(v[::2])
    H = np.concatenate([H for _, H in pairs])
    return measurement_update(mean, cov, v, np.kron(np.eye(len(landmarks)), R), H)


@law
@given(seed, st.integers(1, 7), st.floats(-0.95, 5))
def test_points_have_the_moments(seed, n, kappa):
    """The weights sum to 1, and mean and covariance of the points are those asked for, any sign of kappa."""
    rng = np.random.default_rng(seed)
    mean, cov = rng.normal(size=n), covariance(rng, n)
    points, weights = sigma_points(mean, cov, kappa)
    assert weights.sum() == pytest.approx(1)
    d = points - mean
    np.testing.assert_allclose(weights @ d, 0, atol=1e-12)
    np.testing.assert_allclose(d.T * weights @ d, cov, atol=1e-12)


def test_a_singular_covariance_has_points_too():
    """A direction without variance gets points without spread; no variance at all is one place."""
    cov = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 2.0]])
    points, weights = sigma_points(np.zeros(3), cov, 1.0)
    np.testing.assert_allclose(points.T * weights @ points, cov, atol=1e-12)
    points, _ = sigma_points([1.0, 2.0], np.zeros((2, 2)), 1.0)
    np.testing.assert_array_equal(points, np.tile([1.0, 2.0], (5, 1)))


@pytest.mark.parametrize("kappa", [2.0, 0.0, -2.0])
def test_ukf_is_the_kalman_filter_where_the_motion_is_linear(kappa):
    """Standing still with certain v, the motion is linear in heading and turn: equal to the matrices, 1e-12."""
    rng = np.random.default_rng(4)
    mean, cov = rng.normal(size=3), covariance(rng, 3, 0.1)
    u, M, dt = np.array([0.0, 0.3, 0.1]), np.diag([0.0, 0.2, 0.1]), 0.5
    F, W = jacobians(mean, u, dt)
    got, Sigma = predict(mean, cov, u, M, dt, kappa)
    np.testing.assert_allclose(got, motion(mean, u, dt), atol=1e-12)
    np.testing.assert_allclose(Sigma, F @ cov @ F.T + W @ M @ W.T, atol=1e-12)


@pytest.mark.parametrize("kappa", [2.0, 0.0, -2.0])
def test_ukf_is_the_kalman_filter_where_the_observation_is_linear(kappa):
    """Certain of its place and uncertain of its heading alone, a robot is corrected as by a Kalman filter."""
    mean, cov = np.array([1.0, 2.0, 0.5]), np.diag([0.0, 0.0, 0.2])
    z = np.concatenate([range_bearing(mean, landmark)[0] for landmark in LANDMARKS])
    z[::2] += [0.3, 0.1]
    got, Sigma = correct(mean, cov, z, LANDMARKS, Q, kappa)
    exact, exact_Sigma = ekf_correct(mean, cov, z, LANDMARKS, Q)
    np.testing.assert_allclose(got, exact, atol=1e-12)
    np.testing.assert_allclose(Sigma, exact_Sigma, atol=1e-12)


@pytest.mark.parametrize("kappa", [2.0, -2.0])
def test_ukf_goes_to_the_ekf_with_the_noise(kappa):
    """A tenth of the standard deviations makes both filters differ by a hundredth, relative to the spread a tenth."""
    rng = np.random.default_rng(5)
    mean, cov0, u, dt = np.array([0.5, -1.0, 0.4]), covariance(rng, 3, 0.1), np.array([1.0, 0.5, 0.0]), 0.7
    error = rng.normal(size=4)
    gaps = []
    for scale in (1.0, 0.1, 0.01, 0.001):
        cov, M, R = scale**2 * cov0, scale**2 * noise(u, 10 * ALPHAS), scale**2 * Q
        ukf, ekf = predict(mean, cov, u, M, dt, kappa), ekf_predict(mean, cov, u, M, dt)
        z = np.concatenate([range_bearing(ekf[0], landmark)[0] for landmark in LANDMARKS])
        z += scale * 0.05 * error
        ukf, ekf = correct(*ukf, z, LANDMARKS, R, kappa), ekf_correct(*ekf, z, LANDMARKS, R)
        gaps.append([np.abs(ukf[0] - ekf[0]).max() / scale, np.abs(ukf[1] - ekf[1]).max() / scale**2])
    gaps = np.array(gaps)
    assert np.all(gaps[1:] < 0.2 * gaps[:-1])
    assert gaps[-1].max() < 1e-4


def test_prediction_has_the_second_order():
    """With kappa = 3 - n the mean is far closer than the EKF's to that of a million draws."""
    rng = np.random.default_rng(6)
    mean, cov = np.zeros(3), np.diag([0.0, 0.0, 0.5**2])
    u, M = np.array([2.0, 0.3, 0.0]), np.diag([0.01, 0.04, 0.01])
    theta, (v, omega, _) = rng.normal(0, 0.5, 10**6), rng.multivariate_normal(u, M, 10**6).T
    chord = v * np.sinc(omega / 2 / np.pi)
    truth = np.array([np.mean(chord * np.cos(theta + omega / 2)), np.mean(chord * np.sin(theta + omega / 2))])
    ukf, ekf = predict(mean, cov, u, M, 1.0, -3.0)[0], motion(mean, u, 1.0)
    assert np.linalg.norm(ukf[:2] - truth) < 0.05 * np.linalg.norm(ekf[:2] - truth)


@pytest.mark.parametrize("kappa", [2.0, 0.0, -2.9])
def test_a_landmark_straight_behind_is_no_trap(kappa):
    """Turning world and robot turns the correction: the cut of the circle at half a turn is nowhere special."""
    rng = np.random.default_rng(7)
    cov = covariance(rng, 3, 0.15)
    mean, landmark, z = np.zeros(3), np.array([[2.0, 0.3]]), np.array([0.25, 1.9])
    ahead, ahead_cov = correct(mean, cov, z, landmark, Q, kappa)
    for turn in (np.pi, -np.pi, np.pi - 0.14, 40.0):
        # The robot's frame turns under it: the bearings move by -turn, the heading by turn, nothing else does.
        turned = (np.array([0, 0, turn]), cov, np.array([wrap(z[0] - turn), z[1]]), landmark, Q, kappa)
        got, got_cov = correct(*turned)
        np.testing.assert_allclose(got - [0, 0, turn], ahead, atol=1e-12)
        np.testing.assert_allclose(got_cov, ahead_cov, atol=1e-12)


def test_headings_are_not_wrapped():
    """Two turns more or less of heading before are two turns more or less of heading after."""
    rng = np.random.default_rng(8)
    cov, u = covariance(rng, 3, 0.2), (1.0, 0.4, 0.0)
    once, once_cov = predict([0, 0, 3.0], cov, u, noise(u, ALPHAS), 0.5, 0.0)
    more, more_cov = predict([0, 0, 3.0 + 4 * np.pi], cov, u, noise(u, ALPHAS), 0.5, 0.0)
    np.testing.assert_allclose(more - once, [0, 0, 4 * np.pi], atol=1e-12)
    np.testing.assert_allclose(more_cov, once_cov, atol=1e-12)


def test_audit_r5_negative_weights_break_an_atan2_mean():
    """ERRATA R5: with a negative kappa the weighted vector sum points backwards; ours stays on the bearing."""
    cov, kappa, landmark = np.diag([1.0, 2.0, 2.0]), -2.7, [[1.0, 0.0]]
    points, weights = sigma_points(np.zeros(3), cov, kappa)
    bearings = range_bearings(points, landmark)[:, 0, 0]
    assert weights[0] < 0
    naive = np.arctan2(weights @ np.sin(bearings), weights @ np.cos(bearings))
    assert abs(naive) == pytest.approx(np.pi)
    mean, _ = correct(np.zeros(3), cov, [0.0, 1.0], landmark, np.eye(2), kappa)
    np.testing.assert_allclose(mean[1:], 0, atol=1e-12)


@law
@given(seed, st.floats(-2.9, 3))
def test_a_covariance_stays_one(seed, kappa):
    """However wide the belief and negative the kappa, both results are symmetric without negative eigenvalue."""
    rng = np.random.default_rng(seed)
    mean, cov, u = rng.normal(size=3), covariance(rng, 3), rng.normal(size=3)
    z = np.array([0.3, 2.0, -2.0, 3.0])
    for _, Sigma in (
        predict(mean, cov, u, covariance(rng, 3), 1.0, kappa),
        correct(mean, cov, z, LANDMARKS, 1e-8 * np.eye(2), kappa),
    ):
        np.testing.assert_array_equal(Sigma, Sigma.T)
        assert np.linalg.eigvalsh(Sigma)[0] >= -1e-13 * np.linalg.norm(cov, 2) - 1e-13 * np.trace(Sigma)


def test_nothing_seen_and_no_time():
    """Without landmark, and with dt = 0, the belief stays as it was."""
    rng = np.random.default_rng(9)
    mean, cov = rng.normal(size=3), covariance(rng, 3)
    for got, Sigma in (
        correct(mean, cov, [], [], Q, 0.0),
        predict(mean, cov, (1.0, 0.0, 0.0), np.eye(3), 0.0, -3.0),
    ):
        np.testing.assert_allclose(got, mean, atol=1e-13)
        np.testing.assert_allclose(Sigma, cov, atol=1e-13)


def simulate_errors(rng, runs, steps, *, broken=False):
    """Return the NEES of the last step of `runs` runs; a broken filter forgets the noise of the control."""
    values = np.empty(runs)
    for run in range(runs):
        mean, cov = np.array([0.0, 0.0, 0.3]), np.diag([0.05, 0.05, 0.02]) ** 2
        truth = rng.multivariate_normal(mean, cov)
        for step in range(steps):
            u = np.array([1.0, 0.5 if step % 2 else -0.3, 0.0])
            M = noise(u, ALPHAS)
            truth = motion(truth, u + np.sqrt(np.diag(M)) * rng.normal(size=3), 0.5)
            mean, cov = predict(mean, cov, u, np.zeros((3, 3)) if broken else M, 0.5, -3.0)
            seen = range_bearings(truth[None], LANDMARKS)[0] + rng.normal(size=(2, 2)) * np.sqrt(np.diag(Q))
            mean, cov = correct(mean, cov, seen.ravel(), LANDMARKS, Q, 0.0)
        error = mean - truth
        error[2] = wrap(error[2])
        values[run] = nees(error, cov)
    return values


def test_the_filter_is_honest():
    """Mean NEES of 200 seeded runs lies in the chi-square band of probability 0.999; a broken filter's does not."""
    low, high = chi2_band(3, 0.999, 200)
    assert low < simulate_errors(np.random.default_rng(10), 200, 10).mean() < high
    assert simulate_errors(np.random.default_rng(10), 200, 10, broken=True).mean() > high


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted, and the results share no memory with them."""
    mean, cov, u, M, z, landmarks, R = arguments = read_only(
        np.ones(3), np.eye(3), np.ones(3), np.eye(3), np.ones(4), LANDMARKS, Q
    )
    results = [*sigma_points(mean, cov, 0.0), *predict(mean, cov, u, M, 0.1, 0.0)]
    results += [*correct(mean, cov, z, landmarks, R, 0.0), *correct(mean, cov, z[:0], landmarks[:0], R, 0.0)]
    for result in results:
        assert not any(np.shares_memory(result, argument) for argument in arguments)


X, I3, Z = np.zeros(3), np.eye(3), np.ones(4)


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: sigma_points(None, I3, 0.0), "mean"),
        (lambda: sigma_points(X, np.eye(2), 0.0), "cov"),
        (lambda: sigma_points(X, -I3, 0.0), "cov"),
        (lambda: sigma_points(X, np.array([[1.0, 2, 0], [2, 1, 0], [0, 0, 1]]), 0.0), "cov"),
        (lambda: sigma_points(X, I3, -3.0), "kappa"),
        (lambda: sigma_points(X, I3, np.nan), "kappa"),
        (lambda: predict(X[:2], I3, X, I3, 0.1, 0.0), "mean"),
        (lambda: predict(X, np.eye(2), X, I3, 0.1, 0.0), "cov"),
        (lambda: predict(X, I3, X[:2], I3, 0.1, 0.0), "u"),
        (lambda: predict(X, I3, X, np.eye(2), 0.1, 0.0), "M"),
        (lambda: predict(X, I3, X, I3, -0.1, 0.0), "dt"),
        (lambda: predict(X, I3, X, I3, 0.1, -6.0), "kappa"),
        (lambda: correct(X[:2], I3, Z, LANDMARKS, Q, 0.0), "mean"),
        (lambda: correct(X, np.eye(2), Z, LANDMARKS, Q, 0.0), "cov"),
        (lambda: correct(X, I3, Z[:3], LANDMARKS, Q, 0.0), "z"),
        (lambda: correct(X, I3, Z, LANDMARKS.T[:1], Q, 0.0), "z"),
        (lambda: correct(X, I3, Z, LANDMARKS[0], Q, 0.0), "landmarks"),
        (lambda: correct(X, I3, Z, LANDMARKS, I3, 0.0), "Q"),
        (lambda: correct(X, I3, Z, LANDMARKS, -Q, 0.0), "Q"),
        (lambda: correct(X, 0 * I3, Z, LANDMARKS, 0 * Q, 0.0), "Q"),
    ],
)
def test_a_wrong_argument_of_the_unscented_filter_is_named(call, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        call()
