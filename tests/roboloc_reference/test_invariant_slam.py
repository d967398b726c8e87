from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from landmark_forms import covariance, scene
from oracles import finite_difference, read_only
from scipy.linalg import expm

from roboloc_reference import invariant_slam, landmarks
from roboloc_reference.invariant_slam import (
    init_landmarks,
    invariant_error,
    predict,
    to_invariant,
    to_ordinary,
    update,
)

EPS = np.finfo(float).eps
law = settings(deadline=None, derandomize=True, max_examples=40)
seed = st.integers(0, 2**32 - 1)
count = st.integers(0, 4)
Q = np.diag([0.02, 0.05]) ** 2
R = np.diag([0.1, 0.05, 0.1]) ** 2
TRUTH = np.array([4.0, 4.0, 0.1, 3, 6, 3, 12, 7, 8, 7, 14, 11, 6, 11, 12])
STEP = np.array([1.0, pi / 10])


def hat(xi):
    """Return the matrix of the Lie algebra: a turn, then one column for each point."""
    shifts = np.concatenate([xi[:2], xi[3:]]).reshape(-1, 2).T
    matrix = np.zeros((2 + shifts.shape[1],) * 2)
    matrix[0, 1], matrix[1, 0] = -xi[2], xi[2]
    matrix[:2, 2:] = shifts
    return matrix


def group(x):
    """Return the state as a matrix of the group: rotation, then one column for each point."""
    X = np.eye(2 + (x.size - 1) // 2)
    X[:2, :2] = [[np.cos(x[2]), -np.sin(x[2])], [np.sin(x[2]), np.cos(x[2])]]
    X[:2, 2:] = np.concatenate([x[:2], x[3:]]).reshape(-1, 2).T
    return X


def carried(xi, x):
    """Return exp(xi) x as a state, by SciPy's matrix exponential."""
    X = expm(hat(xi)) @ group(x)
    points = X[:2, 2:].T.ravel()
    return np.array([*points[:2], x[2] + xi[2], *points[2:]])


def state(rng, k):
    """Draw a state with landmarks around the robot and a covariance."""
    z, Q, pose, pose_cov = scene(rng, k)
    x, Sigma = landmarks.init_landmarks(z, Q, pose, pose_cov)
    return x, Sigma + 0.001 * covariance(rng, x.size), z


@law
@given(seed, count)
def test_the_error_is_the_logarithm_of_the_group(seed, k):
    """Carried by SciPy's exponential of any xi with a turn below pi, a state is off by that xi, to 1e-9."""
    rng = np.random.default_rng(seed)
    x = state(rng, k)[0]
    xi = rng.normal(size=x.size)
    xi[2] = rng.uniform(-3, 3)
    np.testing.assert_allclose(invariant_error(carried(xi, x), x), xi, atol=1e-9)


@law
@given(seed, count)
def test_covariances_are_carried_by_the_derivative(seed, k):
    """To the invariant error and back is by its finite-difference Jacobian, to 1e-6, and undoes itself to 1e-12."""
    x, Sigma, _ = state(np.random.default_rng(seed), k)
    M = finite_difference(lambda y: invariant_error(y, x), x)
    P = to_invariant(x, Sigma)
    np.testing.assert_allclose(P, M @ Sigma @ M.T, atol=1e-6 * np.abs(P).max())
    np.testing.assert_allclose(to_ordinary(x, P), Sigma, atol=1e-12 * np.abs(P).max())
    np.testing.assert_array_equal(P, P.T)


@law
@given(seed, count)
def test_driving_leaves_the_error_as_it_was(seed, k):
    """However wrong the estimate, the same control moves it and the truth so that xi stays, to 1e-9."""
    rng = np.random.default_rng(seed)
    x = state(rng, k)[0]
    xi = rng.normal(size=x.size)
    xi[2] = rng.uniform(-3, 3)
    control, none = rng.normal(size=2), np.zeros((x.size, x.size))
    truth, _ = landmarks.predict(x, none, control, np.zeros((3, 3)))
    estimate, P = predict(carried(xi, x), none, control, np.zeros((3, 3)))
    np.testing.assert_allclose(invariant_error(estimate, truth), xi, atol=1e-9)
    assert not P.any()


@law
@given(seed, count)
def test_the_prediction_is_that_of_the_standard_filter(seed, k):
    """The mean is the same; the covariance is, in ordinary terms, G Sigma G^T + L R L^T, to 1e-12 of its size."""
    rng = np.random.default_rng(seed)
    x, Sigma, _ = state(rng, k)
    control = rng.normal(size=2)
    expected_x, expected = landmarks.predict(x, Sigma, control, R)
    got_x, P = predict(x, to_invariant(x, Sigma), control, R)
    np.testing.assert_array_equal(got_x, expected_x)
    np.testing.assert_allclose(to_ordinary(got_x, P), expected, atol=1e-12 * np.abs(P).max())
    np.testing.assert_array_equal(P, P.T)


@law
@given(seed, count)
def test_one_update_is_that_of_the_standard_filter_to_first_order(seed, k):
    """One look corrects both covariances alike, to 1e-9; the means differ by the square of the correction."""
    rng = np.random.default_rng(seed)
    x, Sigma, z = state(rng, k)
    noise = rng.normal(size=2 * k)
    apart = []
    for size in (1e-3, 1e-4):
        look = z + size * noise
        expected_x, expected = landmarks.update(x, Sigma, look, Q)
        got_x, P = update(x, to_invariant(x, Sigma), look, Q)
        np.testing.assert_allclose(to_ordinary(x, P), expected, atol=1e-9)
        np.testing.assert_array_equal(P, P.T)
        apart.append(np.abs(got_x - expected_x).max())
    if k:
        assert apart[0] <= 1e-4
        assert apart[1] <= 0.02 * apart[0] + 1e-12


def test_a_first_map_knows_no_heading():
    """Whatever the doubt of the heading, the landmarks have the covariance of a robot sure of it, and no other."""
    z, _, pose, pose_cov = scene(np.random.default_rng(3), 3)
    pose[:2] = 0.0
    pose_cov = np.diag(np.diag(pose_cov))
    _, sure = landmarks.init_landmarks(z, Q, pose, np.diag([*np.diag(pose_cov)[:2], 0.0]))
    x, P = init_landmarks(z, Q, pose, pose_cov)
    np.testing.assert_allclose(P[3:, 3:], sure[3:, 3:], atol=1e-14)
    np.testing.assert_allclose(P[2], [0.0, 0.0, pose_cov[2, 2], *np.zeros(6)], atol=1e-14)
    np.testing.assert_allclose(
        to_ordinary(x, P), landmarks.init_landmarks(z, Q, pose, pose_cov)[1], atol=1e-14
    )


@law
@given(seed, st.integers(1, 4))
def test_what_cannot_be_seen_is_not_learnt(seed, k):
    """Ten looks from ten places tell nothing of a turn or shift of the world, to 1e-6 of what they tell of the rest."""
    rng = np.random.default_rng(seed)
    z, _, pose, _ = scene(rng, k)
    x, P = init_landmarks(z, Q, pose, np.zeros((3, 3)))
    unseen = np.zeros((x.size, 3))
    unseen[2, 2] = 1.0
    unseen[:2, :2] = np.eye(2)
    unseen[3:, :2] = np.tile(np.eye(2), (k, 1))
    P = P + unseen @ np.diag([0.2, 0.3, 0.1]) @ unseen.T
    for _ in range(10):
        x, P = predict(x, P, rng.normal(size=2), R)
        before = P
        x, P = update(x, P, z + rng.normal(size=2 * k), Q)
        information = np.linalg.inv(P) - np.linalg.inv(before)
        assert np.abs(information @ unseen).max() <= 1e-6 * np.abs(information).max()


def circle(rng, steps):
    """Return what is seen on a noisy drive past six landmarks, at the start and after each of `steps` steps."""
    truth, zs = TRUTH, []
    for k in range(steps + 1):
        if k:
            truth, _ = landmarks.predict(truth, np.zeros((15, 15)), STEP, np.zeros((3, 3)))
            truth[:3] += 0.1 * rng.normal(size=3)
        look = np.concatenate([landmarks.measurement(truth, j)[0] for j in range(6)])
        zs.append(look + (rng.normal(size=(6, 2)) * np.sqrt(np.diag(Q))).ravel())
    return zs


def doubt_of_the_map(x, Sigma):
    """Return the standard deviation of the direction from the first landmark to the second."""
    dx, dy = x[5:7] - x[3:5]
    g = np.zeros(x.size)
    g[5:7] = np.array([-dy, dx]) / (dx**2 + dy**2)
    g[3:5] = -g[5:7]
    return np.sqrt(g @ Sigma @ g)


def claims(stages, ordinary, zs):
    """Return the doubt of the map after each look, of a robot that doubts its heading by 0.1 rad at the start."""
    x, P = stages.init_landmarks(zs[0], Q, TRUTH[:3], np.diag([0.0, 0.0, 0.01]))
    found = []
    for z in zs[1:]:
        x, P = stages.predict(x, P, STEP, 0.01 * np.eye(3))
        x, P = stages.update(x, P, z, Q)
        found.append(doubt_of_the_map(x, ordinary(x, P)))
    return found


def test_the_standard_filter_learns_what_cannot_be_seen():
    """A map that a robot draws is as doubtful as its first heading: the standard filter claims a third of that."""
    zs = circle(np.random.default_rng(5), 60)
    assert claims(landmarks, lambda _, Sigma: Sigma, zs)[-1] < 0.035
    assert min(claims(invariant_slam, to_ordinary, zs)) >= 0.1


def test_a_run_without_noise_has_no_error():
    """Two turns around six landmarks, seen without error from the true first pose, end with error 0 to 1e-10."""
    truth = TRUTH
    for k in range(41):
        z = np.concatenate([landmarks.measurement(truth, j)[0] for j in range(6)])
        if not k:
            x, P = init_landmarks(z, Q, truth[:3], np.diag([0.02, 0.02, 0.1]) ** 2)
        x, P = update(x, P, z, Q)
        np.testing.assert_allclose(x, truth, atol=1e-10)
        x, P = predict(x, P, STEP, R)
        truth, _ = landmarks.predict(truth, np.zeros((15, 15)), STEP, np.zeros((3, 3)))
    assert np.abs(invariant_error(x, truth)).max() < 1e-10
    assert np.linalg.eigvalsh(P)[0] >= -15 * EPS * np.linalg.norm(P, 2)


def test_a_certain_and_a_huge_prior_keep_their_sign():
    """Over 200 updates with variances from 1e-8 to 1e8 no eigenvalue is below rounding."""
    rng = np.random.default_rng(14)
    for _ in range(200):
        z, _, pose, _ = scene(rng, 3)
        x, P = init_landmarks(z, Q, pose, np.diag(10.0 ** rng.uniform(-8, 8, 3)))
        _, after = update(x, P, z, np.diag(10.0 ** rng.uniform(-8, 0, 2)))
        assert np.linalg.eigvalsh(after)[0] >= -9 * EPS * np.linalg.norm(P, 2)


def test_edges_have_their_shapes_and_their_wrap():
    """No landmark, control 0, a landmark straight behind, one on the robot and an exact range are no accident."""
    x, P = init_landmarks([], Q, [1.0, 2.0, 3.0], np.eye(3))
    assert (x.shape, P.shape) == ((3,), (3, 3))
    for got, expected in zip(update(x, P, [], Q), (x, P), strict=True):
        np.testing.assert_allclose(got, expected, atol=1e-15)
    for got, expected in zip(predict(x, P, [0.0, 0.0], np.zeros((3, 3))), (x, P), strict=True):
        np.testing.assert_array_equal(got, expected)
    behind = np.array([0.0, 0.0, 0.0, -2.0, 1e-3])
    moved, _ = update(behind, np.eye(5), [-pi + 1e-3, 2.0], Q)
    np.testing.assert_allclose(moved, behind, atol=1e-2)
    assert invariant_error([0.0, 0.0, pi], np.zeros(3))[2] == -pi
    x, P = init_landmarks([0.0, 0.0], Q, [1.0, 2.0, 3.0], np.eye(3))
    with pytest.raises(ValueError, match="x: expected landmark 0 off the robot"):
        update(x, P, [0.0, 0.0], Q)
    _, after = update(behind, np.eye(5), [pi, 2.0], np.diag([0.01, 0.0]))
    H = landmarks.innovation(behind, [pi, 2.0])[1]
    assert np.abs((H @ to_ordinary(behind, after))[1]).max() <= 1e-14


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted everywhere, and no result shares memory with them."""
    first = read_only(*scene(np.random.default_rng(15), 2))
    x, P = belief = read_only(*init_landmarks(*first))
    control, noise, truth = rest = read_only([1.0, 0.1], np.eye(3), np.ones(7))
    results = (
        *init_landmarks(*first),
        *predict(x, P, control, noise),
        *update(x, P, first[0], first[1]),
        invariant_error(x, truth),
        to_invariant(x, P),
        to_ordinary(x, P),
        *update(first[2], first[3], [], Q),
    )
    for result in results:
        assert result.flags.writeable
        assert not any(np.shares_memory(result, argument) for argument in (*first, *belief, *rest))


X, I5, I2, I3 = np.array([0.0, 0.0, 0.0, 3.0, 1.0]), np.eye(5), np.eye(2), np.eye(3)


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        (init_landmarks, ([0.1], I2, np.zeros(3), I3), r"z: expected shape \(2k,\), got shape \(1,\)"),
        (init_landmarks, ([0.1, 2.0], I2, np.zeros(3), I2), "pose_cov: expected shape"),
        (predict, (np.zeros(4), np.eye(4), [1, 0], I3), r"x: expected shape \(3 \+ 2k,\)"),
        (predict, (X, I3, [1, 0], I3), "P: expected shape"),
        (predict, (X, I5, [1, np.inf], I3), "control: expected finite"),
        (predict, (X, I5, [1, 0], I2), "control_cov: expected shape"),
        (update, (X, I3, [0.1, 2.0], I2), "P: expected shape"),
        (update, (X, I5, [0.1], I2), "z: expected shape"),
        (update, (X, I5, [0.1, 2.0], I3), "Q: expected shape"),
        (update, (X, np.zeros((5, 5)), [0.1, 2.0], np.zeros((2, 2))), "singular"),
        (invariant_error, (X, np.zeros(3)), "truth: expected shape"),
        (to_invariant, (X, I3), "Sigma: expected shape"),
        (to_ordinary, (X, I3), "P: expected shape"),
    ],
)
def test_wrong_arguments_are_named(function, arguments, message):
    """A wrong argument is an error with its name, what was expected and what came."""
    with pytest.raises(ValueError, match=message):
        function(*arguments)
