import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import correction, finite_difference, read_only

from roboloc.angles import wrap
from roboloc_reference.gaussian import measurement_update
from roboloc_reference.velocity import jacobians, motion, noise, range_bearing, sightings, wrap_float
from roboloc_reference.velocity_ekf import correct, predict

law = settings(deadline=None, derandomize=True, max_examples=40)
seed = st.integers(0, 2**32 - 1)
ALPHAS = np.array([1e-3, 1e-4, 1e-4, 1e-3, 1e-4, 1e-4])
LANDMARKS = np.array([[4.0, 1.0], [-2.0, 5.0]])
Q = np.array([[4e-4, 3e-4], [3e-4, 25e-4]])


def covariance(rng, n, scale=1.0):
    """Draw a covariance with eigenvalues between 0.1 and 10 times `scale` squared."""
    axes, _ = np.linalg.qr(rng.normal(size=(n, n)))
    Sigma = axes * (scale**2 * 10.0 ** rng.uniform(-1, 1, size=n)) @ axes.T
    return (Sigma + Sigma.T) / 2


@law
@given(seed, st.sampled_from([0.0, 1e-300, 1e-12, -1e-12, 1e-6, -0.7]), st.sampled_from([0.0, 1.2]))
def test_prediction_is_the_tangent(seed, omega, v):
    """Mean and covariance are f and F Sigma F^T + W M W^T, with slopes by finite differences, at any omega and v."""
    rng = np.random.default_rng(seed)
    x, Sigma, M, dt = rng.normal(size=3), covariance(rng, 3), covariance(rng, 3), rng.uniform(0, 1)
    u = np.array([v, omega, rng.normal()])
    F = finite_difference(lambda a: motion(a, u, dt), x)
    W = finite_difference(lambda a: motion(x, a, dt), u)
    got, got_Sigma = predict(x, Sigma, u, M, dt)
    np.testing.assert_allclose(got, motion(x, u, dt), atol=1e-14)
    np.testing.assert_allclose(got_Sigma, F @ Sigma @ F.T + W @ M @ W.T, atol=1e-8)
    np.testing.assert_array_equal(got_Sigma, got_Sigma.T)


@law
@given(seed)
def test_correction_is_conditioning(seed):
    """Mean and covariance equal the information form with 100 digits, with the stacked H of both landmarks."""
    rng = np.random.default_rng(seed)
    x, Sigma = rng.normal(size=3), covariance(rng, 3, 0.2)
    pairs = [range_bearing(x, landmark) for landmark in LANDMARKS]
    v = 0.1 * rng.normal(size=4)
    z = np.concatenate([h for h, _ in pairs]) + v
    exact = correction(x, Sigma, v, np.kron(np.eye(2), Q), np.concatenate([H for _, H in pairs]))
    for got, expected in zip(correct(x, Sigma, z, LANDMARKS, Q), exact, strict=True):
        np.testing.assert_allclose(
            got, np.array(expected.tolist(), dtype=float).reshape(got.shape), atol=1e-9
        )


def test_all_landmarks_at_once_are_one_after_the_other_with_the_same_slopes():
    """Batch and sequential update agree to 1e-12 when the second takes its tangent where the first did."""
    rng = np.random.default_rng(1)
    x, Sigma = rng.normal(size=3), covariance(rng, 3, 0.2)
    z = np.concatenate([range_bearing(x, landmark)[0] for landmark in LANDMARKS]) + 0.1 * rng.normal(size=4)
    mean, cov = x, Sigma
    for i, landmark in enumerate(LANDMARKS):
        h, H = range_bearing(x, landmark)
        mean, cov = measurement_update(mean, cov, z[2 * i : 2 * i + 2] - h - H @ (mean - x), Q, H)
    got, got_Sigma = correct(x, Sigma, z, LANDMARKS, Q)
    np.testing.assert_allclose(got, mean, atol=1e-12)
    np.testing.assert_allclose(got_Sigma, cov, atol=1e-12)


def test_without_noise_the_error_is_zero():
    """From the true pose, exact controls and observations leave the filter at the truth, to 1e-12."""
    truth = x = np.array([0.5, -1.0, 3.0])
    Sigma = 0.01 * np.eye(3)
    for k in range(60):
        u = np.array([1.0, 0.8 * np.sin(0.2 * k), 0.1])
        truth = motion(truth, u, 0.3)
        x, Sigma = predict(x, Sigma, u, noise(u, ALPHAS), 0.3)
        z = np.concatenate([range_bearing(truth, landmark)[0] for landmark in LANDMARKS])
        x, Sigma = correct(x, Sigma, z, LANDMARKS, Q)
    np.testing.assert_allclose(x, truth, atol=1e-12)


@pytest.mark.parametrize("bearing", [np.pi, -np.pi])
def test_a_landmark_straight_behind_is_no_trap(bearing):
    """Half a turn to the left and to the right are one bearing, and the robot that expects it stays."""
    x, _ = correct([0, 0, 0], 0.1 * np.eye(3), [bearing, 1.0], [[-1.0, 0.0]], Q)
    np.testing.assert_allclose(x, 0, atol=1e-12)


def test_edges_of_a_step():
    """With dt = 0, with nothing seen, and with a certain belief, the belief stays as it was."""
    rng = np.random.default_rng(2)
    x, Sigma, u = rng.normal(size=3), covariance(rng, 3), rng.normal(size=3)
    for got, got_Sigma in (predict(x, Sigma, u, np.eye(3), 0.0), correct(x, Sigma, [], [], Q)):
        np.testing.assert_array_equal(got, x)
        np.testing.assert_array_equal(got_Sigma, Sigma)
    got, got_Sigma = correct(x, np.zeros((3, 3)), np.ones(4), LANDMARKS, Q)
    np.testing.assert_array_equal(got, x)
    np.testing.assert_array_equal(got_Sigma, 0)
    # A singular Q is no obstacle where the belief has an opinion.
    got, got_Sigma = correct(x, Sigma, range_bearing(x, LANDMARKS[0])[0], LANDMARKS[:1], np.diag([0.0, 1e-4]))
    np.testing.assert_allclose(got, x, atol=1e-12)
    assert np.linalg.eigvalsh(got_Sigma)[0] >= -3 * np.finfo(float).eps * np.linalg.norm(Sigma, 2)


def test_floats_and_arrays_are_wrapped_alike():
    """One float is wrapped as an array is, both edges of the interval included, and far away too."""
    angles = [0.0, 1e-300, -1e-9, 3.1, np.pi, -np.pi, np.nextafter(np.pi, 0), 4.0, -4.0, 3 * np.pi, 1e6]
    for a in angles:
        got = wrap_float(a)
        assert -np.pi <= got < np.pi
        assert got == pytest.approx(wrap(a), abs=1e-9)
    z, H = sightings([0.1, 0.2, 7.0], LANDMARKS.tolist())
    pairs = [range_bearing([0.1, 0.2, 7.0], landmark) for landmark in LANDMARKS]
    np.testing.assert_array_equal(z, np.concatenate([h for h, _ in pairs]))
    np.testing.assert_array_equal(H, np.concatenate([H for _, H in pairs]))


def test_jacobians_are_those_of_the_stages():
    """The one product of prediction is F Sigma F^T + W M W^T with the stage's F and W, to 1e-14."""
    rng = np.random.default_rng(3)
    x, Sigma, M, u = rng.normal(size=3), covariance(rng, 3), covariance(rng, 3), rng.normal(size=3)
    F, W = jacobians(x, u, 0.4)
    np.testing.assert_allclose(predict(x, Sigma, u, M, 0.4)[1], F @ Sigma @ F.T + W @ M @ W.T, atol=1e-14)


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted, and the results share no memory with them."""
    x, Sigma, u, M, z, landmarks, R = arguments = read_only(
        np.ones(3), np.eye(3), np.ones(3), np.eye(3), np.ones(4), LANDMARKS, Q
    )
    results = [*predict(x, Sigma, u, M, 0.0), *correct(x, Sigma, z, landmarks, R)]
    results += correct(x, Sigma, z[:0], landmarks[:0], R)
    for result in results:
        assert not any(np.shares_memory(result, argument) for argument in arguments)


X, I3, Z = np.zeros(3), np.eye(3), np.ones(4)


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: predict(None, I3, X, I3, 0.1), "x"),
        (lambda: predict(X, I3[:2], X, I3, 0.1), "Sigma"),
        (lambda: predict(X, I3, X[:2], I3, 0.1), "u"),
        (lambda: predict(X, I3, X, np.nan * I3, 0.1), "M"),
        (lambda: predict(X, I3, X, I3, -0.1), "dt"),
        (lambda: correct(X[:2], I3, Z, LANDMARKS, Q), "x"),
        (lambda: correct(X, np.eye(2), Z, LANDMARKS, Q), "Sigma"),
        (lambda: correct(X, I3, Z[:3], LANDMARKS, Q), "z"),
        (lambda: correct(X, I3, Z, LANDMARKS[0], Q), "landmarks"),
        (lambda: correct(X, I3, Z[:2], [[0.0, 0.0]], Q), "landmark"),
        (lambda: correct(X, I3, Z, LANDMARKS, I3), "Q"),
        (lambda: correct(X, 0 * I3, Z, LANDMARKS, 0 * Q), "Q"),
    ],
)
def test_a_wrong_argument_of_the_velocity_filter_is_named(call, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        call()
