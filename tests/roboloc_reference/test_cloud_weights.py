"""The weights of a cloud in one go: the same as the stages one after the other, at the edges too."""

from concurrent.futures import ThreadPoolExecutor
from math import inf, nan, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import read_only

from roboloc_reference import mcl
from roboloc_reference.cloud_weights import weigh

TF = (0.1, -0.05, 0.3)
EYE = np.diag([0.01, 0.01])
TILTED = np.array([[0.01, 0.006], [0.006, 0.02]])


def by_stages(xs, ws, z_raw, Q_raw, map_lines, tf):
    """Weigh with the graded stages."""
    hs = mcl.compute_predicted_measurements(xs, map_lines, tf)
    return mcl.measurement_weights(mcl.compute_innovations(z_raw, Q_raw, hs), Q_raw, ws)


def scene(rng, M, J, count):
    """Draw particles, weights, observations with correlated covariances, and a map; headings of several turns."""
    A = 0.3 * rng.normal(size=(count, 2, 2))
    return (
        rng.normal(size=(M, 3)) * [2.0, 2.0, 4.0],
        rng.random(M),
        np.stack([rng.uniform(-4, 4, count), rng.uniform(0, 5, count)]),
        A @ A.swapaxes(1, 2) + 0.05 * np.eye(2),
        np.stack([rng.uniform(-pi, pi, J), rng.uniform(0, 5, J)]),
    )


@settings(deadline=None, derandomize=True, max_examples=100)
@given(st.integers(0, 2**32 - 1), st.integers(1, 8), st.integers(0, 6), st.integers(0, 5))
def test_all_at_once_is_one_after_the_other(seed, M, J, count):
    """On random scenes of any size, with nothing seen and with no map, the weights are those of the stages, to 1e-9."""
    args = (*scene(np.random.default_rng(seed), M, J, count), TF)
    np.testing.assert_allclose(weigh(*args), by_stages(*args), rtol=1e-9, atol=1e-300)


@pytest.mark.parametrize("M", [2047, 2048, 2049, 5000])
def test_the_cut_into_blocks_does_not_show(M):
    """Around the size of a block, and in a thread that has computed nothing yet, nothing changes."""
    args = (*scene(np.random.default_rng(M), M, 5, 3), TF)
    with ThreadPoolExecutor(1) as pool:
        np.testing.assert_allclose(pool.submit(weigh, *args).result(), by_stages(*args), rtol=1e-9)


@pytest.mark.parametrize("z_alpha", [pi, -pi, 0.0, 3 * pi])
@pytest.mark.parametrize("theta", [0.0, pi, -pi, 5 * pi])
def test_half_a_turn_has_the_sign_of_the_stages(z_alpha, theta):
    """An innovation of half a turn is -pi, which matters where the errors of angle and distance are correlated."""
    xs = [[0.0, 0.0, theta], [0.3, 0.0, theta]]
    args = xs, [0.5, 0.5], [[z_alpha], [2.0]], [TILTED], [[0.0], [2.1]], (0.0, 0.0, 0.0)
    np.testing.assert_allclose(weigh(*args), by_stages(*args), rtol=1e-6)


def test_a_line_behind_is_seen_from_its_other_side():
    """A robot that has crossed a wall sees it at the opposite angle, and at r = 0 in the map's."""
    xs = [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
    args = xs, [0.2, 0.3, 0.5], [[-pi + 0.1], [1.0]], [EYE], [[0.0], [2.0]], (0.0, 0.0, 0.0)
    assert weigh(*args).argmax() == 1
    np.testing.assert_allclose(weigh(*args), by_stages(*args), rtol=1e-9, atol=1e-300)


@pytest.mark.parametrize(("r", "ws"), [(2.0, [0.0] * 4), (1e200, [0.25] * 4), (1e308, [0.0, 0.5, 0.5, 0.0])])
def test_if_all_are_impossible_all_are_equal_and_the_caller_is_warned(r, ws):
    """Weights all 0, or log likelihoods all minus infinity, give 1/M and a warning that points here."""
    with pytest.warns(RuntimeWarning, match="no particle can explain") as caught:
        after = weigh(np.zeros((4, 3)), ws, [[0.1], [r]], [TILTED], [[0.0, 1.0], [2.0, 2.0]], TF)
    assert after.tolist() == [0.25] * 4
    assert caught[0].filename == __file__


def test_one_particle_keeps_all_the_weight():
    """With M = 1 the weight is 1; weights of type float32 and read-only arguments are accepted."""
    xs, _, z_raw, Q_raw, map_lines = read_only(*scene(np.random.default_rng(3), 1, 4, 2))
    after = weigh(xs, np.array([0.3], np.float32), z_raw, Q_raw, map_lines, TF)
    assert (after.dtype, after.tolist()) == (np.float64, [1.0])


@pytest.mark.parametrize("options", [{}, {"threshold": 0.5}, {"share": 0.2}])
def test_the_filter_weighs_as_its_stages_do(options):
    """The filter with the reference stages, which weighs at once, goes the way of one that calls them."""
    rng = np.random.default_rng(4)
    xs, _, z_raw, Q_raw, map_lines = scene(rng, 300, 6, 3)
    if "share" in options:
        options = options | {"fresh": lambda count, rng: rng.normal(size=(count, 3))}
    quick, slow = (
        mcl.MonteCarloLocalization(
            xs, np.eye(2), map_lines, TF, 3.0, np.random.default_rng(5), stages=stages, **options
        )
        for stages in (mcl.STAGES, dict(mcl.STAGES))
    )
    for _ in range(4):
        for one in (quick, slow):
            one.transition_update([0.5, 0.2], 0.1)
            one.measurement_update(z_raw, list(Q_raw))
        np.testing.assert_array_equal(quick.xs, slow.xs)
        np.testing.assert_allclose(quick.ws, slow.ws, rtol=1e-9)


GOOD = (*scene(np.random.default_rng(12), 3, 4, 2), TF)


@pytest.mark.parametrize(
    ("position", "value", "message"),
    [
        (0, np.ones((3, 2)), "xs: expected shape"),
        (0, np.full((3, 3), nan), "xs: expected finite"),
        (1, [0.5, 0.6, -0.1], "ws: expected no negative weight"),
        (1, [], "ws: expected at least one"),
        (1, [0.5, 0.5], "xs: expected shape"),
        (2, np.ones((3, 2)), "z_raw: expected shape"),
        (2, [[0.0, inf], [1.0, 1.0]], "z_raw: expected finite"),
        (3, np.ones((3, 2, 2)), "Q_raw: expected shape"),
        (3, np.ones((2, 2, 2)), "Q_raw: expected positive definite"),
        (4, np.ones((3, 4)), "map_lines: expected shape"),
        (5, (0.0, 0.0), "tf_base_to_camera: expected shape"),
    ],
)
def test_wrong_arguments_are_named(position, value, message):
    """A wrong argument is an error with its name, what was expected and what came."""
    args = list(GOOD)
    args[position] = value
    with pytest.raises(ValueError, match=message):
        weigh(*args)
