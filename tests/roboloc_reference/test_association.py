from math import exp, inf, pi

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import read_only

from roboloc_reference.association import compute_innovations, measurement_model
from roboloc_reference.gaussian import measurement_update

law = settings(deadline=None, derandomize=True, max_examples=50)
seed = st.integers(0, 2**32 - 1)
EYE = np.diag([0.01, 0.01])


def covariance(rng, n):
    """Draw a correlated covariance."""
    A = rng.normal(size=(n, n))
    return A @ A.T + 0.1 * np.eye(n)


def scene(rng, count, walls, n=3):
    """Draw observations and predictions at random, angles all around the circle."""
    z_raw = np.stack([rng.uniform(-pi, pi, count), rng.uniform(0, 4, count)])
    hs = np.stack([rng.uniform(-pi, pi, walls), rng.uniform(0, 4, walls)])
    Q_raw = np.array([0.05 * covariance(rng, 2) for _ in range(count)]).reshape(count, 2, 2)
    return z_raw, Q_raw, hs, rng.normal(size=(walls, 2, n)), 0.05 * covariance(rng, n)


def slowly(z_raw, Q_raw, hs, Hs, Sigma, g):
    """Associate with loops and 50 digits: the handout read line by line."""
    kept = []
    for i in range(z_raw.shape[1]):
        best, choice = mp.inf, None
        for j in range(hs.shape[1]):
            with mp.workdps(50):
                turns = mp.mpf(z_raw[0, i]) - mp.mpf(hs[0, j])
                turns -= 2 * mp.pi * mp.floor((turns + mp.pi) / (2 * mp.pi))
                v = mp.matrix([turns, mp.mpf(z_raw[1, i]) - mp.mpf(hs[1, j])])
                H, P, Q = (mp.matrix(a.tolist()) for a in (Hs[j], Sigma, Q_raw[i]))
                d2 = (v.T * (H * P * H.T + Q) ** -1 * v)[0]
            if d2 < best:
                best, choice = d2, ([float(v[0]), float(v[1])], Q_raw[i], Hs[j])
        if best < g * g:
            kept.append(choice)
    n = len(Sigma)
    v, Q, H = zip(*kept, strict=True) if kept else ((), (), ())
    return np.reshape(v, (-1, 2)), np.reshape(Q, (-1, 2, 2)), np.reshape(H, (-1, 2, n))


@law
@given(seed, st.integers(0, 6), st.integers(0, 6), st.integers(1, 7))
def test_association_is_the_handouts_read_line_by_line(seed, count, walls, n):
    """On random scenes of any size the result equals loops with 50 digits, to 1e-12, in their order."""
    rng = np.random.default_rng(seed)
    args = (*scene(rng, count, walls, n), rng.uniform(0, 3))
    for got, exact in zip(compute_innovations(*args), slowly(*args), strict=True):
        assert got.shape == exact.shape
        np.testing.assert_allclose(got, exact, atol=1e-12)


def test_two_observations_may_share_a_wall():
    """A wall seen on both sides of a door is two lines, and both are kept."""
    v, _, H = compute_innovations(
        [[0.0, 0.01], [2.0, 2.1]],
        [EYE, EYE],
        [[0.0, 1.5], [2.0, 2.0]],
        np.ones((2, 2, 3)),
        np.zeros((3, 3)),
        3.0,
    )
    np.testing.assert_allclose(v, [[0.0, 0.0], [0.01, 0.1]], atol=1e-15)
    assert H.shape == (2, 2, 3)


def test_of_two_walls_equally_near_the_first_is_taken():
    """A tie goes to the wall that comes first in the map."""
    Hs = np.stack([np.full((2, 3), 1.0), np.full((2, 3), 2.0)])
    hs = [[0.0, 0.0], [1.0, 3.0]]
    v, _, H = compute_innovations([[0.0], [2.0]], [EYE], hs, Hs, np.zeros((3, 3)), 1e3)
    np.testing.assert_array_equal(v, [[0.0, 1.0]])
    np.testing.assert_array_equal(H, Hs[:1])


def test_the_gate_is_compared_with_the_distance_and_its_edge_is_outside():
    """With d = 2 a gate of 2 drops the observation and one a little larger keeps it: d2 < g squared."""
    args = ([[0.0], [2.0]], [np.diag([1.0, 0.25])], [[0.0], [1.0]], np.zeros((1, 2, 3)), np.zeros((3, 3)))
    assert len(compute_innovations(*args, 2.0)[0]) == 0
    assert len(compute_innovations(*args, np.nextafter(2.0, 3.0))[0]) == 1
    assert len(compute_innovations(*args, 0.0)[0]) == 0


def test_the_angle_is_wrapped_before_it_is_judged():
    """A wall straight behind, seen from either side of the cut at pi, is two hundredths off and not a turn."""
    v, _, _ = compute_innovations(
        [[-pi + 0.01], [2.0]], [EYE], [[pi - 0.01], [2.0]], np.zeros((1, 2, 3)), np.zeros((3, 3)), 1.0
    )
    np.testing.assert_allclose(v, [[0.02, 0.0]], atol=1e-14)


def test_the_doubt_about_the_pose_chooses_between_walls():
    """With a doubtful x the wall that a move in x explains is nearer than one that only a turn explains."""
    hs, Hs = [[0.0, 0.3], [2.5, 2.0]], np.zeros((2, 2, 3))
    Hs[:, 1, 0] = -1.0
    sure = compute_innovations([[0.0], [2.0]], [EYE], hs, Hs, np.diag([1e-6, 0.0, 0.0]), 10.0)[0]
    doubtful = compute_innovations([[0.0], [2.0]], [EYE], hs, Hs, np.diag([1.0, 0.0, 0.0]), 10.0)[0]
    np.testing.assert_allclose(sure, [[-0.3, 0.0]], atol=1e-15)
    np.testing.assert_allclose(doubtful, [[0.0, -0.5]], atol=1e-15)


def test_right_pairs_pass_the_gate_as_often_as_chi_square_says():
    """Of 4000 right pairs a share 1 - exp(-g^2 / 2) passes; false alarm 1e-6 (5 standard deviations), fixed seed."""
    rng = np.random.default_rng(5)
    Sigma, H, Q = covariance(rng, 3), rng.normal(size=(1, 2, 3)), covariance(rng, 2) * 0.1
    S = H[0] @ Sigma @ H[0].T + Q
    v = np.linalg.cholesky(1e-4 * S) @ rng.normal(size=(2, 4000))  # small, so that no angle wraps
    z_raw = np.array([[0.3], [2.0]]) + v
    for g in (1.0, 2.0, 3.0):
        kept = compute_innovations(z_raw, [1e-4 * Q] * 4000, [[0.3], [2.0]], H, 1e-4 * Sigma, g)[0]
        p = 1 - exp(-g * g / 2)
        assert abs(len(kept) - 4000 * p) < 5 * np.sqrt(4000 * p * (1 - p))


def test_nothing_seen_or_nothing_in_the_map_has_the_right_shapes():
    """No line, no wall, or nothing inside the gate gives no rows, of the right width, all the way through."""
    z_raw, Q_raw, hs, Hs, Sigma = scene(np.random.default_rng(1), 4, 3, n=5)
    for args in (
        (np.zeros((2, 0)), [], hs, Hs, Sigma, 3.0),
        (z_raw, Q_raw, np.zeros((2, 0)), np.zeros((0, 2, 5)), Sigma, 3.0),
        (z_raw, Q_raw, hs, Hs, Sigma, 0.0),
    ):
        v, Q, H = compute_innovations(*args)
        assert (v.shape, Q.shape, H.shape) == ((0, 2), (0, 2, 2), (0, 2, 5))
        z, Q, H = measurement_model(v, Q, H)
        assert (z.shape, Q.shape, H.shape) == ((0,), (0, 0), (0, 5))
        x, after = measurement_update(np.ones(5), Sigma, z, Q, H)
        np.testing.assert_array_equal(x, np.ones(5))
        np.testing.assert_allclose(after, Sigma, atol=1e-15)


def test_the_stacked_measurement_is_the_lines_one_after_another():
    """One update with the stack equals one update after another with each line, to 1e-12."""
    rng = np.random.default_rng(6)
    v, H = rng.normal(size=(3, 2)), rng.normal(size=(3, 2, 3))
    Q = np.array([covariance(rng, 2) for _ in range(3)])
    x = one_x = rng.normal(size=3)
    Sigma = one_Sigma = covariance(rng, 3)
    for k in range(3):
        rest = v[k] - H[k] @ (one_x - x)  # the linear model, about where the stack is linearized
        one_x, one_Sigma = measurement_update(one_x, one_Sigma, rest, Q[k], H[k])
    all_x, all_Sigma = measurement_update(x, Sigma, *measurement_model(v, Q, H))
    np.testing.assert_allclose(all_x, one_x, atol=1e-12)
    np.testing.assert_allclose(all_Sigma, one_Sigma, atol=1e-12)


def test_arguments_are_only_read_and_results_are_the_callers_own():
    """Read-only arrays are accepted, and writing to a result changes no argument."""
    rng = np.random.default_rng(7)
    args = read_only(*scene(rng, 4, 3))
    results = compute_innovations(*args, 50.0)
    for part in results:
        part[...] = 7.0
    before = [np.array(a) for a in results]
    for part in measurement_model(*results):
        part[...] = 0.0
    for now, was in zip(results, before, strict=True):
        np.testing.assert_array_equal(now, was)


SCENE = scene(np.random.default_rng(2), 4, 3)


@pytest.mark.parametrize(
    ("position", "value", "message"),
    [
        (0, np.zeros((3, 2)), "z_raw: expected shape"),
        (0, np.full((2, 4), np.nan), "z_raw: expected finite"),
        (1, np.zeros((3, 2, 2)), "Q_raw: expected shape"),
        (2, np.zeros(2), "hs: expected shape"),
        (3, np.zeros((2, 2, 3)), "Hs: expected shape"),
        (4, np.eye(2), "Sigma: expected shape"),
        (5, -1.0, "g: expected a number not below"),
        (5, inf, "g: expected a finite number"),
    ],
)
def test_wrong_arguments_are_named(position, value, message):
    """A wrong argument is an error with its name, what was expected and what came."""
    args = [*SCENE, 3.0]
    args[position] = value
    with pytest.raises(ValueError, match=message):
        compute_innovations(*args)


def test_a_singular_innovation_covariance_is_named():
    """Two certainties that contradict each other have no distance."""
    with pytest.raises(ValueError, match="singular"):
        compute_innovations(
            [[0.0], [1.0]], [np.zeros((2, 2))], [[0.0], [2.0]], np.zeros((1, 2, 3)), np.eye(3), 1
        )


@pytest.mark.parametrize(
    ("position", "value", "message"),
    [(0, np.zeros((2, 3)), "v: "), (1, np.zeros((2, 3, 3)), "Q: "), (2, np.zeros((3, 2, 3)), "H: ")],
)
def test_wrong_parts_of_a_stack_are_named(position, value, message):
    """Parts that do not fit together are an error with a name."""
    args = [np.zeros((2, 2)), np.zeros((2, 2, 2)), np.zeros((2, 2, 3))]
    args[position] = value
    with pytest.raises(ValueError, match=message):
        measurement_model(*args)
