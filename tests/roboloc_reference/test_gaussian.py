import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import correction, prediction, read_only

from roboloc_reference.gaussian import measurement_update, transition_update

EPS = np.finfo(float).eps
law = settings(deadline=None, derandomize=True, max_examples=50)
seed = st.integers(0, 2**32 - 1)
size = st.integers(1, 9)


def covariance(rng, n, spread=1.0):
    """Draw a covariance with eigenvalues over `spread` powers of ten."""
    axes, _ = np.linalg.qr(rng.normal(size=(n, n)))
    Sigma = axes * 10.0 ** rng.uniform(-spread, spread, size=n) @ axes.T
    return (Sigma + Sigma.T) / 2


def floats(matrix):
    """Round an mpmath matrix to floats."""
    return np.array(matrix.tolist(), dtype=float)


@law
@given(seed, size)
def test_prediction_is_the_formula(seed, n):
    """On random inputs of any size the covariance equals the equation evaluated with 50 digits, to 1e-12."""
    rng = np.random.default_rng(seed)
    g, Gx, Gu = rng.normal(size=n), rng.normal(size=(n, n)), rng.normal(size=(n, 2))
    Sigma, R, dt = covariance(rng, n), covariance(rng, 2), rng.uniform(0, 2)
    x, got = transition_update(g, Gx, Gu, Sigma, R, dt)
    np.testing.assert_array_equal(x, g)
    exact = floats(prediction(Gx, Gu, Sigma, R, dt))
    assert np.abs(got - exact).max() <= 1e-12 * max(1.0, np.abs(exact).max())
    np.testing.assert_array_equal(got, got.T)


@law
@given(seed, size, st.integers(0, 5))
def test_correction_is_conditioning(seed, n, k):
    """Mean and covariance equal the information form evaluated with 100 digits, to 1e-9."""
    rng = np.random.default_rng(seed)
    x, Sigma = rng.normal(size=n), covariance(rng, n)
    z, Q, H = rng.normal(size=k), covariance(rng, k) if k else np.zeros((0, 0)), rng.normal(size=(k, n))
    got_x, got = measurement_update(x, Sigma, z, Q, H)
    if k == 0:
        np.testing.assert_array_equal(got_x, x)
        np.testing.assert_array_equal(got, Sigma)
        return
    exact_x, exact = correction(x, Sigma, z, Q, H)
    np.testing.assert_allclose(got_x, floats(exact_x).ravel(), atol=1e-9 * max(1, np.abs(got_x).max()))
    np.testing.assert_allclose(got, floats(exact), atol=1e-9 * np.abs(Sigma).max())
    np.testing.assert_array_equal(got, got.T)


def ill_conditioned(rng):
    """Draw a wide prior and two sharp observations of nearly the same thing."""
    n = 6
    Sigma = covariance(rng, n, spread=3.0)
    H = rng.normal(size=(1, n)) + 1e-5 * rng.normal(size=(2, n))
    return rng.normal(size=n), Sigma, rng.normal(size=2), 10.0 ** rng.uniform(-13, -11) * np.eye(2), H


def smallest_eigenvalue(Sigma):
    """Return the smallest eigenvalue of the symmetric part."""
    return np.linalg.eigvalsh((Sigma + Sigma.T) / 2)[0]


def test_audit_h8_only_josephs_form_stays_a_covariance():
    """ERRATA H8: of 2000 ill-conditioned updates none of ours is indefinite; the shorter forms often are."""
    rng = np.random.default_rng(8)
    indefinite = {"joseph": 0, "Sigma - K S K'": 0, "(I - K H) Sigma": 0}
    for _ in range(2000):
        x, Sigma, z, Q, H = ill_conditioned(rng)
        S = H @ Sigma @ H.T + Q
        K = np.linalg.solve(S, H @ Sigma).T
        forms = {
            "joseph": measurement_update(x, Sigma, z, Q, H)[1],
            "Sigma - K S K'": Sigma - K @ S @ K.T,
            "(I - K H) Sigma": (np.eye(len(x)) - K @ H) @ Sigma,
        }
        floor = -len(x) * EPS * np.linalg.norm(Sigma, 2)
        for name, form in forms.items():
            indefinite[name] += smallest_eigenvalue(form) < floor
        np.testing.assert_array_equal(forms["joseph"], forms["joseph"].T)
    assert indefinite["joseph"] == 0
    assert indefinite["Sigma - K S K'"] > 1500
    assert indefinite["(I - K H) Sigma"] > 800


@law
@given(seed)
def test_two_corrections_are_one(seed):
    """Independent observations may be used one after the other or stacked."""
    rng = np.random.default_rng(seed)
    x, Sigma, H, z = rng.normal(size=3), covariance(rng, 3), rng.normal(size=(2, 3)), rng.normal(size=2)
    Q = np.diag(rng.uniform(0.1, 1, size=2))
    at_once = measurement_update(x, Sigma, z, Q, H)
    one_x, one = measurement_update(x, Sigma, z[:1], Q[:1, :1], H[:1])
    # The second innovation is taken at the mean that the first correction has moved.
    left = z[1:] - H[1:] @ (one_x - x)
    two_x, two = measurement_update(one_x, one, left, Q[1:, 1:], H[1:])
    np.testing.assert_allclose(two_x, at_once[0], atol=1e-10)
    np.testing.assert_allclose(two, at_once[1], atol=1e-10)


def test_a_certain_state_is_not_moved():
    """A direction with no variance keeps its mean and its zero, as the fixed landmarks of SLAM do."""
    x, Sigma = measurement_update([1, 2], np.diag([1.0, 0.0]), [3.0], [[0.5]], [[1.0, 1.0]])
    np.testing.assert_allclose(x, [3, 2])
    np.testing.assert_allclose(Sigma, np.diag([1 / 3, 0]), atol=1e-15)


def test_audit_h1_the_noise_depends_on_how_time_is_cut():
    """ERRATA H1: by the handout's term a second of speed noise is .1 in 1 step, .025 in 2, 1e-5 in 100."""
    for steps, expected in ((1, 0.1), (2, 0.025), (10, 0.001), (100, 1e-5)):
        dt, Sigma = 1 / steps, np.zeros((3, 3))
        Gu = np.array([[dt, 0.0], [0, 0], [0, dt]])
        for _ in range(steps):
            _, Sigma = transition_update(np.zeros(3), np.eye(3), Gu, Sigma, 0.1 * np.eye(2), dt)
        assert Sigma[0, 0] == pytest.approx(expected)


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted, and the results share no memory with them."""
    g, Gx, Gu, Sigma, R = arguments = read_only(np.ones(3), np.eye(3), np.zeros((3, 2)), np.eye(3), np.eye(2))
    for result in transition_update(g, Gx, Gu, Sigma, R, 0.1):
        assert not any(np.shares_memory(result, argument) for argument in arguments)
    z, Q, H = read_only([0.1], [[1.0]], [[1, 0, 0]])
    empty = read_only(np.zeros(0), np.zeros((0, 0)), np.zeros((0, 3)))
    for observation in ((z, Q, H), empty):
        for result in measurement_update(g, Sigma, *observation):
            assert not any(np.shares_memory(result, argument) for argument in (g, Sigma, *observation))


I3, Z32, I2 = np.eye(3), np.zeros((3, 2)), np.eye(2)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ((None, I3, Z32, I3, I2, 0.1), "g"),
        ((np.zeros((3, 1)), I3, Z32, I3, I2, 0.1), "g"),
        ((np.zeros(3), I2, Z32, I3, I2, 0.1), "Gx"),
        ((np.zeros(3), I3, Z32.T, I3, I2, 0.1), "Gu"),
        ((np.zeros(3), I3, Z32, np.ones(3), I2, 0.1), "Sigma"),
        ((np.zeros(3), I3, Z32, np.nan * I3, I2, 0.1), "Sigma"),
        ((np.zeros(3), I3, Z32, I3, I3, 0.1), "R"),
        ((np.zeros(3), I3, Z32, I3, I2, -0.1), "dt"),
        ((np.zeros(3), I3, Z32, I3, I2, np.nan), "dt"),
    ],
)
def test_a_wrong_argument_of_the_prediction_is_named(arguments, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        transition_update(*arguments)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ((None, I3, [1], [[1]], [[1, 0, 0]]), "x"),
        ((np.zeros(3), I2, [1], [[1]], [[1, 0, 0]]), "Sigma"),
        ((np.zeros(3), I3, 1.0, [[1]], [[1, 0, 0]]), "z"),
        ((np.zeros(3), I3, [1], [1], [[1, 0, 0]]), "Q"),
        ((np.zeros(3), I3, [1], [[1]], [1, 0, 0]), "H"),
        ((np.zeros(3), I3, [1], [[1]], [[1, 0]]), "H"),
        ((np.zeros(3), 0 * I3, [1], [[0]], [[1, 0, 0]]), "Q"),
        ((np.zeros(3), I3, [], np.zeros((1, 0)), np.zeros((0, 3))), "Q"),
    ],
)
def test_a_wrong_argument_of_the_correction_is_named(arguments, name):
    """ValueError says which argument is wrong, what was expected and what came; a singular S is one."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        measurement_update(*arguments)
