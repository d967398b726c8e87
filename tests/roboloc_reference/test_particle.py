import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import read_only

from roboloc.angles import wrap
from roboloc_reference.gaussian import measurement_update
from roboloc_reference.particle import correct, effective_sample_size, predict
from roboloc_reference.velocity import jacobians, motion, noise, range_bearing, range_bearings

law = settings(deadline=None, derandomize=True, max_examples=30)
seed = st.integers(0, 2**32 - 1)
ALPHAS = np.array([0.02, 0.01, 0.01, 0.02, 0.005, 0.005])
LANDMARKS = np.array([[4.0, 1.0], [-2.0, 5.0]])
Q = np.array([[4e-4, 3e-4], [3e-4, 25e-4]])


def exact_weights(xs, ws, z, landmarks, R):
    """Return old weight times normal density, divided by the sum, with 50 digits."""
    with mp.workdps(50):
        inverse = mp.matrix(R.tolist()) ** -1
        products = []
        for x, w in zip(xs, ws, strict=True):
            d2 = mp.mpf(0)
            for pair, landmark in zip(z.reshape(-1, 2), landmarks, strict=True):
                v = pair - range_bearings(x[None], landmark[None])[0, 0]
                v = mp.matrix([float(wrap(v[0])), float(v[1])])
                d2 += (v.T * inverse * v)[0]
            products.append(mp.mpf(float(w)) * mp.exp(-d2 / 2))
        total = mp.fsum(products)
        return np.array([float(p / total) for p in products])


@law
@given(seed, st.integers(1, 20), st.floats(0.01, 1e4))
def test_weights_are_the_densities(seed, M, scale):
    """Weights equal 50-digit products of old weight and density, to 1e-8, likely or far beyond underflow."""
    rng = np.random.default_rng(seed)
    xs, ws, z = scale * rng.normal(size=(M, 3)), rng.uniform(0, 1, size=M), rng.normal(size=4)
    got = correct(xs, ws, z, LANDMARKS, Q)
    np.testing.assert_allclose(got, exact_weights(xs, ws, z, LANDMARKS, Q), atol=1e-8)
    assert got.sum() == pytest.approx(1)


def test_prediction_has_the_moments():
    """Mean and covariance of 200,000 particles are f and W M W^T within 5 standard errors (false alarm 1e-5)."""
    x, u, dt, M = np.array([1.0, 2.0, 0.5]), np.array([1.0, 0.5, 0.0]), 0.4, 200_000
    alphas = 0.01 * ALPHAS
    xs = predict(np.tile(x, (M, 1)), u, alphas, dt, np.random.default_rng(1))
    _, W = jacobians(x, u, dt)
    exact = W @ noise(u, alphas) @ W.T
    sigma = np.sqrt(np.diag(exact))
    np.testing.assert_array_less(np.abs(xs.mean(axis=0) - motion(x, u, dt)), 5 * sigma / np.sqrt(M) + 2e-5)
    np.testing.assert_array_less(
        np.abs(np.cov(xs.T) - exact), 5 * np.sqrt(2 / M) * np.outer(sigma, sigma) + 1e-8
    )


def test_prediction_without_noise_is_the_motion():
    """With all alphas 0 each particle follows the motion exactly, and with dt = 0 none moves."""
    rng = np.random.default_rng(2)
    xs, u = rng.normal(size=(10, 3)), np.array([1.0, 0.0, 0.3])
    moved = predict(xs, u, np.zeros(6), 0.5, rng)
    np.testing.assert_allclose(moved, [motion(x, u, 0.5) for x in xs], rtol=1e-14)
    np.testing.assert_array_equal(predict(xs, u, ALPHAS, 0.0, rng), xs)


def test_the_cloud_goes_to_the_kalman_filter():
    """In a nearly linear case mean and spread of 100,000 weighted particles are the EKF's, within a twentieth."""
    rng = np.random.default_rng(3)
    mean, cov = np.array([0.5, -0.5, 0.2]), np.diag([0.02, 0.03, 0.01]) ** 2
    z = np.concatenate([range_bearing(mean, landmark)[0] for landmark in LANDMARKS])
    z += np.array([0.01, -0.02, 0.0, 0.03])
    xs = rng.multivariate_normal(mean, cov, size=100_000)
    ws = correct(xs, np.ones(len(xs)), z, LANDMARKS, Q)
    pairs = [range_bearing(mean, landmark) for landmark in LANDMARKS]
    v, H = z - np.concatenate([h for h, _ in pairs]), np.concatenate([H for _, H in pairs])
    exact, Sigma = measurement_update(mean, cov, v, np.kron(np.eye(2), Q), H)
    sigma = np.sqrt(np.diag(Sigma))
    np.testing.assert_array_less(np.abs(ws @ xs - exact), 0.05 * sigma)
    spread = np.sqrt(ws @ (xs - ws @ xs) ** 2)
    np.testing.assert_allclose(spread, sigma, rtol=0.05)


def test_a_bearing_across_the_cut_is_wrapped():
    """A landmark straight behind, seen a hair to either side of half a turn, weighs both particles alike."""
    xs = np.array([[0.0, 0.0, 0.01], [0.0, 0.0, -0.01]])
    for bearing in (np.pi, -np.pi):
        ws = correct(xs, [0.5, 0.5], [bearing, 1.0], [[-1.0, 0.0]], Q)
        np.testing.assert_allclose(ws, 0.5, atol=1e-12)


def test_edges_of_the_weights():
    """A particle of weight 0 stays dead, one alone has all, nothing seen normalizes, and M = 0 is empty."""
    rng = np.random.default_rng(4)
    xs, z = rng.normal(size=(3, 3)), np.zeros(4)
    ws = correct(xs, [1.0, 0.0, 1.0], z, LANDMARKS, Q)
    assert ws[1] == 0
    assert ws.sum() == pytest.approx(1)
    np.testing.assert_array_equal(correct(xs[:1], [1e-300], z, LANDMARKS, Q), [1.0])
    np.testing.assert_allclose(correct(xs, [1.0, 2.0, 1.0], [], [], Q), [0.25, 0.5, 0.25])
    np.testing.assert_allclose(
        correct(xs, np.array([1, 2, 1], dtype=np.float32), [], [], Q), [0.25, 0.5, 0.25]
    )
    assert correct(np.zeros((0, 3)), [], z, LANDMARKS, Q).shape == (0,)
    assert predict(np.zeros((0, 3)), [1.0, 0.0, 0.0], ALPHAS, 0.1, rng).shape == (0, 3)


def test_no_particle_possible_is_told():
    """All weights 0 give equal weights and a warning."""
    with pytest.warns(RuntimeWarning, match="no particle is possible"):
        ws = correct(np.zeros((4, 3)), np.zeros(4), np.zeros(4), LANDMARKS, Q)
    np.testing.assert_array_equal(ws, 0.25)


@law
@given(seed, st.integers(1, 100))
def test_effective_size_is_between_one_and_all(seed, M):
    """It is M for equal weights, 1 for a single one, between for others, and blind to the scale."""
    ws = np.random.default_rng(seed).uniform(0.01, 1, size=M)
    size = effective_sample_size(ws)
    assert 1 - 1e-12 <= size <= M * (1 + 1e-12)
    assert size == pytest.approx(ws.sum() ** 2 / np.sum(ws**2))
    for scale in (1e-300, 1e300):
        assert effective_sample_size(scale * ws) == pytest.approx(size)
    assert effective_sample_size(np.full(M, 0.3)) == pytest.approx(M)
    assert effective_sample_size(np.eye(M)[0]) == 1


def test_effective_size_counts_equal_weights():
    """Equal weights among zeros count as many as they are in any scale, and a geometric row has its closed form."""
    for k in range(1, 6):
        for scale in (1e-300, 1.0, 1e300):
            ws = np.zeros(8)
            ws[:k] = scale
            assert effective_sample_size(read_only(ws)[0]) == pytest.approx(k, rel=1e-14)
    # sum q^i = (1 - q^M) / (1 - q) and the same with q^2.
    q, M = 0.9, 30
    right = ((1 - q**M) / (1 - q)) ** 2 / ((1 - q ** (2 * M)) / (1 - q**2))
    assert effective_sample_size(q ** np.arange(M)) == pytest.approx(right)


@pytest.mark.parametrize("ws", [[0.0, 0.0], [], [-1.0, 2.0], np.eye(2)])
def test_weights_that_are_none_are_refused(ws):
    """Weights that are all 0, none, negative or no vector are named."""
    with pytest.raises(ValueError, match="ws"):
        effective_sample_size(ws)


def test_audit_r6_the_size_is_compared_with_a_threshold():
    """ERRATA R6: a sharp observation takes the size below half the particles; it is never below itself."""
    xs = np.random.default_rng(5).normal(size=(100, 3))
    ws = correct(xs, np.full(100, 0.01), [0.2, 4.0, 1.5, 5.0], LANDMARKS, Q)
    size = effective_sample_size(ws)
    assert 1 <= size < 50
    assert effective_sample_size(np.full(100, 0.01)) == pytest.approx(100)


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted, and the results share no memory with them."""
    xs, ws, u, alphas, z, landmarks, R = arguments = read_only(
        np.ones((2, 3)), np.ones(2), np.ones(3), ALPHAS, np.ones(4), LANDMARKS, Q
    )
    results = [predict(xs, u, alphas, 0.0, np.random.default_rng(0)), correct(xs, ws, z, landmarks, R)]
    results.append(correct(xs, ws, z[:0], landmarks[:0], R))
    assert effective_sample_size(ws) == 2
    for result in results:
        assert not any(np.shares_memory(result, argument) for argument in arguments)


XS, WS, U, Z = np.zeros((2, 3)), np.ones(2), np.ones(3), np.zeros(4)
RNG = np.random.default_rng(0)


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: predict(XS[0], U, ALPHAS, 0.1, RNG), "xs"),
        (lambda: predict(XS, U[:2], ALPHAS, 0.1, RNG), "u"),
        (lambda: predict(XS, U, -ALPHAS, 0.1, RNG), "alphas"),
        (lambda: predict(XS, U, ALPHAS, np.nan, RNG), "dt"),
        (lambda: correct(None, WS, Z, LANDMARKS, Q), "xs"),
        (lambda: correct(XS, WS[:1], Z, LANDMARKS, Q), "ws"),
        (lambda: correct(XS, -WS, Z, LANDMARKS, Q), "ws"),
        (lambda: correct(XS, WS * np.nan, Z, LANDMARKS, Q), "ws"),
        (lambda: correct(XS, WS, Z[:3], LANDMARKS, Q), "z"),
        (lambda: correct(XS, WS, Z, LANDMARKS[0], Q), "landmarks"),
        (lambda: correct(XS, WS, Z, LANDMARKS, np.eye(3)), "Q"),
        (lambda: correct(XS, WS, Z, LANDMARKS, 0 * Q), "Q"),
        (lambda: effective_sample_size(XS), "ws"),
        (lambda: effective_sample_size([-1.0, 2.0]), "ws"),
        (lambda: effective_sample_size([0.0, 0.0]), "ws"),
        (lambda: effective_sample_size([]), "ws"),
    ],
)
def test_a_wrong_argument_of_the_particle_filter_is_named(call, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        call()
