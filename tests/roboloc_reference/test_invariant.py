import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import correction, finite_difference, read_only
from scipy.linalg import expm

from roboloc import se2
from roboloc.metrics import chi2_band, nees
from roboloc_reference.invariant import correct, predict

law = settings(deadline=None, derandomize=True, max_examples=50)
seed = st.integers(0, 2**32 - 1)
LANDMARKS = np.array([[4.0, 1.0], [-2.0, 5.0]])
N = np.diag([0.1, 0.05]) ** 2
W = np.diag([0.02, 0.01, 0.02]) ** 2
ZERO = np.zeros((3, 3))


def hat(xi):
    """Return the matrix of the Lie algebra of a twist v1, v2, omega."""
    return np.array([[0.0, -xi[2], xi[0]], [xi[2], 0.0, xi[1]], [0.0, 0.0, 0.0]])


def exp(xi):
    """Return the matrix exponential of a twist, by SciPy's general routine."""
    return expm(hat(xi))


def place(xi):
    """Return the matrix exponential of a twist, by the closed form; quick, for whole runs."""
    x, y, theta = se2.exp(xi)
    return np.array([[np.cos(theta), -np.sin(theta), x], [np.sin(theta), np.cos(theta), y], [0.0, 0.0, 1.0]])


def log(X):
    """Return the twist whose exponential is a pose matrix."""
    return se2.log([X[0, 2], X[1, 2], np.arctan2(X[1, 0], X[0, 0])])


def covariance(rng, n, scale=1.0):
    """Draw a covariance with eigenvalues between 0.1 and 10 times `scale` squared."""
    axes, _ = np.linalg.qr(rng.normal(size=(n, n)))
    Sigma = axes * (scale**2 * 10.0 ** rng.uniform(-1, 1, size=n)) @ axes.T
    return (Sigma + Sigma.T) / 2


def observe(X, landmarks):
    """Return what a robot at X sees of the landmarks, without noise: rows y1, y2, 1."""
    return np.column_stack([landmarks, np.ones(len(landmarks))]) @ np.linalg.inv(X).T


@law
@given(seed)
def test_prediction_is_the_group(seed):
    """X is multiplied by SciPy's matrix exponential, and P gains Ad W Ad^T with Ad x = X x^ X^-1, to 1e-12."""
    rng = np.random.default_rng(seed)
    X, P, twist, dt = exp(rng.normal(size=3)), covariance(rng, 3), rng.normal(size=3), rng.uniform(0, 2)
    got, got_P = predict(X, P, twist, W, dt)
    np.testing.assert_allclose(got, X @ exp(twist * dt), atol=1e-12)
    columns = [X @ hat(axis) @ np.linalg.inv(X) for axis in np.eye(3)]
    Ad = np.array([[c[0, 2], c[1, 2], c[1, 0]] for c in columns]).T
    np.testing.assert_allclose(got_P, P + Ad @ W @ Ad.T, atol=1e-12)
    np.testing.assert_array_equal(got_P, got_P.T)


@law
@given(seed)
def test_motion_obeys_the_axioms(seed):
    """Two half steps are one, a step and its reverse are none, no twist or no time is the identity."""
    rng = np.random.default_rng(seed)
    X, twist, dt = exp(rng.normal(size=3)), rng.normal(size=3), rng.uniform(0, 2)

    def move(X, twist, dt):
        return predict(X, ZERO, twist, ZERO, dt)[0]

    np.testing.assert_allclose(move(move(X, twist, dt / 2), twist, dt / 2), move(X, twist, dt), atol=1e-12)
    np.testing.assert_allclose(move(move(X, twist, dt), -twist, dt), X, atol=1e-12)
    np.testing.assert_allclose(move(X, np.zeros(3), dt), X, atol=1e-15)
    np.testing.assert_allclose(move(X, twist, 0.0), X, atol=1e-15)
    for placed in (move(X, twist, dt), move(np.eye(3), twist, dt)):
        np.testing.assert_allclose(placed[:2, :2] @ placed[:2, :2].T, np.eye(2), atol=1e-15)
    # A change of the world's frame from the left commutes with the motion.
    np.testing.assert_allclose(X @ move(np.eye(3), twist, dt), move(X, twist, dt), atol=1e-12)


@pytest.mark.parametrize("omega", [0.0, 1e-300, 1e-12, -1e-9, 1e-6, -1e-3])
def test_a_tiny_turn_is_exact(omega):
    """For tiny omega of either sign the step equals the series of the exponential to four terms, to 1e-15."""
    twist = np.array([1.0, 0.5, omega])
    A = hat(twist)
    series = np.eye(3) + A + A @ A / 2 + A @ A @ A / 6 + A @ A @ A @ A / 24
    np.testing.assert_allclose(predict(np.eye(3), ZERO, twist, ZERO, 1.0)[0], series, atol=1e-15)


@law
@given(seed)
def test_the_error_does_not_move(seed):
    """However large the error, estimate times truth inverse is the same before and after the same motion."""
    rng = np.random.default_rng(seed)
    truth, estimate = exp(3 * rng.normal(size=3)), exp(3 * rng.normal(size=3))
    before = estimate @ np.linalg.inv(truth)
    for twist in rng.normal(size=(5, 3)):
        truth = predict(truth, ZERO, twist, ZERO, 0.3)[0]
        estimate, P = predict(estimate, np.eye(3), twist, ZERO, 0.3)
        np.testing.assert_array_equal(P, np.eye(3))
    np.testing.assert_allclose(estimate @ np.linalg.inv(truth), before, atol=1e-11)


@law
@given(seed)
def test_correction_is_conditioning(seed):
    """The step in xi and P equal the information form with 100 digits, with H from finite differences."""
    rng = np.random.default_rng(seed)
    X, P, landmarks = exp(rng.normal(size=3)), covariance(rng, 3), rng.normal(size=(2, 2))
    Y = observe(X, landmarks)
    Y[:, :2] += 0.1 * rng.normal(size=(2, 2))

    def innovation(xi):
        """Return minus what an error xi of the estimate adds to X Y - b."""
        return -np.column_stack([(exp(xi) @ [*m, 1.0] - [*m, 1.0])[:2] for m in landmarks]).T.ravel()

    H = finite_difference(innovation, np.zeros(3))
    R = X[:2, :2]
    v = ((Y @ X.T)[:, :2] - landmarks).ravel()
    xi, exact = correction(np.zeros(3), P, v, np.kron(np.eye(2), R @ N @ R.T), H)
    got, got_P = correct(X, P, Y, landmarks, N)
    np.testing.assert_allclose(got, exp(np.array(xi.tolist(), dtype=float).ravel()) @ X, atol=1e-8)
    np.testing.assert_allclose(got_P, np.array(exact.tolist(), dtype=float), atol=1e-7)
    np.testing.assert_array_equal(got_P, got_P.T)


def test_audit_r8_h_is_minus_the_hat_times_the_landmark():
    """ERRATA R8: the product with xi's matrix, not its transpose, is what an error adds to the innovation."""
    m, xi = np.array([2.0, -1.0, 1.0]), np.array([0.3, 0.2, 0.1])
    H = np.array([[-1.0, 0.0, m[1]], [0.0, -1.0, -m[0]]])
    np.testing.assert_allclose(H @ xi, -(hat(xi) @ m)[:2], atol=1e-15)
    assert np.abs(H @ xi + (hat(xi).T @ m)[:2]).max() > 0.1
    small = 1e-6 * xi
    np.testing.assert_allclose(H @ small, -(exp(small) @ m - m)[:2], atol=1e-11)


def run(rng, steps, *, transposed=False, forgetful=False):
    """Return the right-invariant error and P after each step of a run, broken on request."""
    X, P = np.eye(3), np.diag([0.1, 0.1, 0.1]) ** 2
    truth = place(0.1 * rng.normal(size=3)) @ X
    errors, covariances = [], []
    for step in range(steps):
        twist = np.array([1.0, 0.1, 0.5 if step % 3 else -0.4])
        truth = truth @ place(np.sqrt(np.diag(W)) * rng.normal(size=3)) @ place(0.3 * twist)
        X, P = predict(X, P, twist, ZERO if forgetful else W, 0.3)
        Y = observe(truth, LANDMARKS)
        Y[:, :2] += rng.normal(size=(2, 2)) * np.sqrt(np.diag(N))
        if transposed:
            # The source's printed innovation, smuggled in as an observation: X Y' has the first two rows of X^T Y.
            Y[:, :2] = (Y[:, :2] @ X[:2, :2] - X[:2, 2]) @ X[:2, :2]
        X, P = correct(X, P, Y, LANDMARKS, N)
        errors.append(log(X @ np.linalg.inv(truth)))
        covariances.append(P)
    return np.array(errors), np.array(covariances)


def test_audit_r7_the_innovation_is_x_y():
    """ERRATA R7: with the transpose of X the mean error is more than ten times that with X itself."""
    right = np.mean([np.abs(run(np.random.default_rng(s), 30)[0]).mean() for s in range(10)])
    wrong = np.mean([np.abs(run(np.random.default_rng(s), 30, transposed=True)[0]).mean() for s in range(10)])
    assert right < 0.1
    assert wrong > 10 * right


def test_the_filter_is_honest():
    """Mean NEES of 200 seeded runs at two instants is in the chi-square band of .9995 each (false alarm 1e-3)."""
    low, high = chi2_band(3, 0.9995, 200)
    for forgetful in (False, True):
        rng = np.random.default_rng(11)
        values = np.array([nees(*run(rng, 10, forgetful=forgetful)) for _ in range(200)])
        for instant in (4, 9):
            inside = low < values[:, instant].mean() < high
            assert inside != forgetful


def test_without_noise_the_error_goes_to_zero():
    """From a wrong pose, a metre and a radian off, exact observations bring the filter to the truth, to 1e-9."""
    truth, X, P = np.eye(3), exp([1.0, -0.5, 1.0]), np.eye(3)
    for _ in range(40):
        twist = np.array([1.0, 0.0, 0.4])
        truth = truth @ exp(0.2 * twist)
        X, P = predict(X, P, twist, 1e-4 * np.eye(3), 0.2)
        X, P = correct(X, P, observe(truth, LANDMARKS), LANDMARKS, 1e-4 * np.eye(2))
    np.testing.assert_allclose(X, truth, atol=1e-9)


def test_nothing_seen_changes_nothing():
    """Without landmark the belief stays as it was; with the expected observation the pose does."""
    rng = np.random.default_rng(12)
    X, P = exp(rng.normal(size=3)), covariance(rng, 3)
    for Y, landmarks in (([], []), (np.zeros((0, 3)), np.zeros((0, 2)))):
        got, got_P = correct(X, P, Y, landmarks, N)
        np.testing.assert_allclose(got, X, atol=1e-15)
        np.testing.assert_allclose(got_P, P, atol=1e-15)
    np.testing.assert_allclose(correct(X, P, observe(X, LANDMARKS), LANDMARKS, N)[0], X, atol=1e-13)


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted, and the results share no memory with them."""
    X, P, twist, Wr, Y, landmarks, Nr = arguments = read_only(
        np.eye(3), np.eye(3), np.ones(3), W, np.ones((2, 3)), LANDMARKS, N
    )
    results = [*predict(X, P, twist, Wr, 0.0), *correct(X, P, Y, landmarks, Nr)]
    results += correct(X, P, Y[:0], landmarks[:0], Nr)
    for result in results:
        assert not any(np.shares_memory(result, argument) for argument in arguments)


I3, T, Y2 = np.eye(3), np.zeros(3), np.ones((2, 3))


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: predict(None, I3, T, I3, 0.1), "X"),
        (lambda: predict(2 * I3, I3, T, I3, 0.1), "X"),
        (lambda: predict(np.diag([1.0, -1.0, 1.0]), I3, T, I3, 0.1), "X"),
        (lambda: predict(I3 + np.outer([0, 0, 1], [1, 0, 0]), I3, T, I3, 0.1), "X"),
        (lambda: predict(I3, I3[:2], T, I3, 0.1), "P"),
        (lambda: predict(I3, I3, T[:2], I3, 0.1), "twist"),
        (lambda: predict(I3, I3, T, np.nan * I3, 0.1), "W"),
        (lambda: predict(I3, I3, T, I3, -0.1), "dt"),
        (lambda: correct(T, I3, Y2, LANDMARKS, N), "X"),
        (lambda: correct(I3, T, Y2, LANDMARKS, N), "P"),
        (lambda: correct(I3, I3, Y2[:1], LANDMARKS, N), "Y"),
        (lambda: correct(I3, I3, 2 * Y2, LANDMARKS, N), "Y"),
        (lambda: correct(I3, I3, Y2, [], N), "Y"),
        (lambda: correct(I3, I3, Y2, LANDMARKS[0], N), "landmarks"),
        (lambda: correct(I3, I3, Y2, LANDMARKS, I3), "N"),
        (lambda: correct(I3, 0 * I3, Y2, LANDMARKS, 0 * N), "N"),
    ],
)
def test_a_wrong_argument_of_the_invariant_filter_is_named(call, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        call()
