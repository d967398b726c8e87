import math
from concurrent.futures import ThreadPoolExecutor
from math import inf, nan, nextafter, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import read_only

from roboloc_reference import association, gaussian, lines, mcl, motion

law = settings(deadline=None, derandomize=True, max_examples=60)
seed = st.integers(0, 2**32 - 1)
TF = (0.1, -0.05, 0.3)
EYE = np.diag([0.01, 0.01])


def wrapped(a):
    """Wrap one angle to [-pi, pi)."""
    return a - 2 * pi * math.floor((a + pi) / (2 * pi))


def predicted_slowly(xs, map_lines, tf):
    """Predict with one call of the single-robot stage for each particle."""
    return np.array([lines.compute_predicted_measurements(x, map_lines, tf)[0] for x in xs])


def innovations_slowly(z_raw, Q_raw, hs):
    """Associate one particle, one observation and one line at a time."""
    vs = np.zeros((len(hs), 2 * z_raw.shape[1]))
    for m, h in enumerate(hs):
        for i, Q in enumerate(Q_raw):
            best = inf
            for j in range(h.shape[1]):
                v = np.array([wrapped(z_raw[0, i] - h[0, j]), z_raw[1, i] - h[1, j]])
                d2 = v @ np.linalg.inv(Q) @ v
                if d2 < best:
                    best, vs[m, 2 * i : 2 * i + 2] = d2, v
    return vs


def weights_slowly(vs, Q_raw, ws):
    """Multiply densities, one particle and one observation at a time."""
    after = []
    for v, w in zip(vs, ws, strict=True):
        likelihood = 1.0
        for i, Q in enumerate(Q_raw):
            part = v[2 * i : 2 * i + 2]
            density = math.exp(-part @ np.linalg.inv(Q) @ part / 2)
            likelihood *= density / (2 * pi * math.sqrt(np.linalg.det(Q)))
        after.append(w * likelihood)
    return np.array(after) / sum(after)


def scene(rng, M, J, count):
    """Draw particles, a map, observations with correlated covariances, and weights."""
    xs = rng.normal(size=(M, 3)) * [2.0, 2.0, 4.0]
    map_lines = np.stack([rng.uniform(-pi, pi, J), rng.uniform(0, 5, J)])
    z_raw = np.stack([rng.uniform(-pi, pi, count), rng.uniform(0, 5, count)])
    A = rng.normal(size=(count, 2, 2))
    Q_raw = A @ A.swapaxes(1, 2) + 0.3 * np.eye(2)
    ws = rng.random(M)
    return xs, map_lines, z_raw, Q_raw, ws / ws.sum()


def on_circle(a, b):
    """Return how far angles are from each other on the circle."""
    return np.abs(np.angle(np.exp(1j * (np.asarray(a) - b))))


@law
@given(seed, st.integers(0, 20))
def test_every_particle_moves_as_the_single_robot_does(seed, M):
    """For turning rates of every size, 0 included, each row is compute_dynamics of that row, to 1e-14."""
    rng = np.random.default_rng(seed)
    xs, us = rng.normal(size=(M, 3)), rng.normal(size=(M, 2))
    us[:, 1] *= rng.choice([0.0, 1e-12, 1e-9, 1e-3, 1.0], size=M)
    for dt in (0.0, 0.1, 1.0):
        right = [motion.compute_dynamics(x, u, dt)[0] for x, u in zip(xs, us, strict=True)]
        got = mcl.transition_model(xs, us, dt)
        assert got.shape == (M, 3)
        np.testing.assert_allclose(got, np.reshape(right, (M, 3)), rtol=1e-14, atol=1e-14)


def test_no_time_and_no_control_move_nobody():
    """With dt = 0, or with both controls 0, every pose stays to the last digit, beyond a turn as well."""
    xs = np.array([[1.0, 2.0, 7.0], [-1.0, 0.5, -9.0]])
    np.testing.assert_array_equal(mcl.transition_model(xs, [[1.0, 3.0], [2.0, 0.0]], 0.0), xs)
    np.testing.assert_array_equal(mcl.transition_model(xs, np.zeros((2, 2)), 1.0), xs)


@law
@given(seed, st.integers(0, 8), st.integers(0, 6))
def test_predictions_are_those_of_the_single_robot(seed, M, J):
    """On random maps and scanners each particle's lines are the EKF's predictions at its pose, to 1e-12."""
    rng = np.random.default_rng(seed)
    xs, map_lines, *_ = scene(rng, M, J, 0)
    tf = rng.normal(size=3)
    hs = mcl.compute_predicted_measurements(xs, map_lines, tf)
    right = predicted_slowly(xs, map_lines, tf).reshape(M, 2, J)
    assert hs.shape == (M, 2, J)
    assert on_circle(hs[:, 0], right[:, 0]).max(initial=0) < 1e-12
    np.testing.assert_allclose(hs[:, 1], right[:, 1], atol=1e-12)
    assert ((hs[:, 0] >= -pi) & (hs[:, 0] < pi) & (hs[:, 1] >= 0)).all()


@law
@given(seed, st.integers(0, 6), st.integers(1, 6), st.integers(0, 5))
def test_innovations_are_the_plain_loops(seed, M, J, count):
    """On random scenes of any size the innovations are those of three nested loops, to 1e-12."""
    xs, map_lines, z_raw, Q_raw, _ = scene(np.random.default_rng(seed), M, J, count)
    hs = predicted_slowly(xs, map_lines, TF).reshape(M, 2, J)
    vs = mcl.compute_innovations(z_raw, Q_raw, hs)
    assert vs.shape == (M, 2 * count)
    np.testing.assert_allclose(vs, innovations_slowly(z_raw, Q_raw, hs), atol=1e-12)


@law
@given(seed, st.integers(1, 8), st.integers(0, 4))
def test_weights_are_the_product_of_densities(seed, M, count):
    """Where nothing underflows the weights are old weight times normal densities, over their total, to 1e-12."""
    rng = np.random.default_rng(seed)
    *_, Q_raw, ws = scene(rng, M, 1, count)
    vs = rng.normal(size=(M, 2 * count))
    after = mcl.measurement_weights(vs, Q_raw, ws)
    np.testing.assert_allclose(after, weights_slowly(vs, Q_raw, ws), rtol=1e-11, atol=1e-14)
    assert abs(after.sum() - 1) < 1e-12


@pytest.mark.parametrize("M", [1, 2047, 2048, 2049, 5000])
def test_the_cut_into_blocks_does_not_show(M):
    """Around the size of a block the result for all is the result for each alone, to the last digit."""
    xs, map_lines, z_raw, Q_raw, _ = scene(np.random.default_rng(M), M, 5, 3)
    hs = mcl.compute_predicted_measurements(xs, map_lines, TF)
    vs = mcl.compute_innovations(z_raw, Q_raw, hs)
    np.testing.assert_array_equal(mcl.compute_innovations(z_raw, Q_raw, hs.copy(order="C")), vs)
    for m in {0, M // 2, M - 1, min(M - 1, 2047), min(M - 1, 2048)}:
        h = mcl.compute_predicted_measurements(xs[m : m + 1], map_lines, TF)
        np.testing.assert_allclose(h[0], hs[m], rtol=0, atol=1e-14)
        np.testing.assert_allclose(mcl.compute_innovations(z_raw, Q_raw, h)[0], vs[m], rtol=0, atol=1e-13)


def test_the_first_call_of_a_thread_may_have_nothing_to_do():
    """In a thread that has computed nothing yet, no line in the map is no special case."""
    with ThreadPoolExecutor(1) as pool:
        hs = pool.submit(mcl.compute_predicted_measurements, np.zeros((3, 3)), np.zeros((2, 0)), TF).result()
    assert hs.shape == (3, 2, 0)


def test_many_lines_are_no_other_case():
    """With 300 lines and 20 observations the innovations are the plain loops', to 1e-12."""
    xs, map_lines, z_raw, Q_raw, _ = scene(np.random.default_rng(8), 4, 300, 20)
    hs = mcl.compute_predicted_measurements(xs, map_lines, TF)
    np.testing.assert_allclose(
        mcl.compute_innovations(z_raw, Q_raw, hs), innovations_slowly(z_raw, Q_raw, hs), atol=1e-12
    )


def test_the_true_particle_of_a_noiseless_scan_has_no_innovation():
    """A particle at the pose that made the scan explains all of it, and outweighs one a metre away."""
    rng = np.random.default_rng(9)
    xs, map_lines, *_ = scene(rng, 2, 6, 0)
    xs[1] = xs[0] + [1.0, 0.3, 0.1]
    z_raw = lines.compute_predicted_measurements(xs[0], map_lines, TF)[0]
    vs = mcl.compute_innovations(z_raw, [EYE] * 6, mcl.compute_predicted_measurements(xs, map_lines, TF))
    np.testing.assert_allclose(vs[0], np.zeros(12), atol=1e-14)
    assert mcl.measurement_weights(vs, [EYE] * 6, [0.5, 0.5])[0] > 0.999


def test_in_a_nearly_linear_case_the_cloud_is_the_ekf():
    """Mean and covariance of 200,000 particles after a step are the EKF's, with a false alarm of 1e-7."""
    # The mean to 6 standard errors, the covariance to 3 per cent, which is more than 6.
    rng, M = np.random.default_rng(10), 200_000
    x, Sigma = np.array([0.5, -0.2, 0.4]), np.diag([1e-4, 2e-4, 1e-4])
    R, u, dt = np.diag([1e-3, 1e-3]), np.array([0.5, 0.3]), 0.2
    map_lines = np.array([[0.0, pi / 2, pi, -pi / 2], [3.0, 2.0, 3.0, 2.5]])
    true = motion.compute_dynamics(x, u, dt)[0] + np.array([0.01, -0.005, 0.008])
    z_raw = lines.compute_predicted_measurements(true, map_lines, TF)[0]
    Q_raw = np.array([[[4e-4, 1e-4], [1e-4, 4e-4]]] * 4)

    xs = mcl.transition_model(rng.multivariate_normal(x, Sigma, M), rng.multivariate_normal(u, dt * R, M), dt)
    vs = mcl.compute_innovations(z_raw, Q_raw, mcl.compute_predicted_measurements(xs, map_lines, TF))
    ws = mcl.measurement_weights(vs, Q_raw, np.full(M, 1 / M))
    mean = ws @ xs
    covariance = (ws[:, None] * (xs - mean)).T @ (xs - mean)

    g, Gx, Gu = motion.compute_dynamics(x, u, dt)
    g, Sigma = gaussian.transition_update(g, Gx, Gu, Sigma, R, dt)
    hs, Hs = lines.compute_predicted_measurements(g, map_lines, TF)
    stack = association.measurement_model(*association.compute_innovations(z_raw, Q_raw, hs, Hs, Sigma, 10.0))
    right, after = gaussian.measurement_update(g, Sigma, *stack)
    standard_error = np.sqrt(np.diag(after) * (ws @ ws))
    assert (np.abs(mean - right) < 6 * standard_error + 2e-5).all()
    scale = np.sqrt(np.outer(np.diag(after), np.diag(after)))
    assert (np.abs(covariance - after) / scale).max() < 0.03


def test_angles_are_wrapped_before_they_are_judged():
    """A wall straight behind, seen from either side of the cut at pi, is two hundredths off and not a turn."""
    vs = mcl.compute_innovations([[-pi + 0.01], [2.0]], [EYE], [[[pi - 0.01, 2.0], [2.0, 2.0]]])
    np.testing.assert_allclose(vs, [[0.02, 0.0]], atol=1e-14)


def test_the_edge_of_the_circle_is_inside_on_one_side_only():
    """Half a turn is -pi, in predictions and in innovations, and one digit beyond it too."""
    up = nextafter(pi, 4.0)
    for angle in (pi, -pi, up, -up, 3 * pi):
        h = mcl.compute_predicted_measurements([[0.0, 0.0, 0.0]], [[angle], [2.0]], [0, 0, 0])
        v = mcl.compute_innovations([[angle], [2.0]], [EYE], [[[0.0], [2.0]]])
        for a in (h[0, 0, 0], v[0, 0]):
            assert -pi <= a < pi
            assert on_circle(a, angle) < 1e-14


def test_a_line_through_the_scanner_is_left_as_it_is():
    """At r = 0 both ways of writing the line are right, and r is 0 without a sign."""
    hs = mcl.compute_predicted_measurements([[1.0, 0.0, 0.0]], [[0.0], [1.0]], [0, 0, 0])
    assert hs[0, :, 0].tolist() == [0.0, 0.0]
    assert not np.signbit(hs[0, 1, 0])


def test_of_two_lines_equally_near_the_first_is_taken_and_two_observations_may_share_one():
    """A tie goes to the line that comes first, and nothing keeps a line from serving twice."""
    vs = mcl.compute_innovations([[0.0, 0.0], [2.0, 2.2]], [EYE, EYE], [[[0.0, 0.0], [1.0, 3.0]]])
    np.testing.assert_allclose(vs, [[0.0, 1.0, 0.0, -0.8]], atol=1e-15)


def test_the_correlation_of_an_observation_chooses_the_line():
    """An error along the long axis of Q is nearer than a smaller one across it."""
    Q = np.array([[0.01, 0.0095], [0.0095, 0.01]])
    vs = mcl.compute_innovations([[0.0], [2.0]], [Q], [[[-0.08, 0.1], [2.08, 1.7]]])
    right = innovations_slowly(np.array([[0.0], [2.0]]), [Q], np.array([[[-0.08, 0.1], [2.08, 1.7]]]))
    np.testing.assert_allclose(vs, right)
    vs = mcl.compute_innovations([[0.0], [2.0]], [Q], [[[-0.08, -0.2], [2.08, 1.8]]])
    np.testing.assert_allclose(vs, [[0.2, 0.2]])


def test_nothing_seen_or_nothing_in_the_map_keeps_the_weights():
    """Without an observation, or without a line to compare it with, the weights are only normalised."""
    ws = [1.0, 3.0]
    nothing = mcl.compute_innovations(np.zeros((2, 0)), [], np.zeros((2, 2, 3)))
    assert nothing.shape == (2, 0)
    np.testing.assert_allclose(mcl.measurement_weights(nothing, [], ws), [0.25, 0.75])
    hs = mcl.compute_predicted_measurements(np.zeros((2, 3)), np.zeros((2, 0)), TF)
    assert hs.shape == (2, 2, 0)
    blind = mcl.compute_innovations([[0.1], [2.0]], [EYE], hs)
    np.testing.assert_array_equal(blind, np.zeros((2, 2)))
    np.testing.assert_allclose(mcl.measurement_weights(blind, [EYE], ws), [0.25, 0.75])


def test_likelihoods_too_small_for_a_number_still_compare():
    """Two particles 100 and 101 standard deviations off keep their ratio, exp(-100.5)."""
    after = mcl.measurement_weights([[0.0, 10.0], [0.0, 10.1]], [EYE], [0.5, 0.5])
    np.testing.assert_allclose(after, [1.0, math.exp(-100.5)], rtol=1e-10)


def test_a_weight_of_zero_stays_zero():
    """A particle that was impossible stays so, however well it explains the scan."""
    after = mcl.measurement_weights([[0.0, 0.0], [0.0, 9.0]], [EYE], [0.0, 1e-300])
    assert after.tolist() == [0.0, 1.0]


@pytest.mark.parametrize(
    ("vs", "ws"),
    [
        ([[0.0, 0.0]] * 4, [0.0] * 4),
        ([[0.0, 1e200]] * 4, [0.25] * 4),
        ([[0.0, 0.0], *[[0.0, 1e200]] * 3], [0.0, 0.5, 0.5, 0.0]),
        ([[1e308, 1e308]] * 4, [0.25] * 4),
    ],
)
def test_if_all_are_impossible_all_are_equal_and_a_warning_says_so(vs, ws):
    """Weights all 0, or log likelihoods all minus infinity, give 1/M and a warning."""
    with pytest.warns(RuntimeWarning, match="no particle can explain"):
        after = mcl.measurement_weights(vs, [[[0.01, 0.005], [0.005, 0.01]]], ws)
    assert after.tolist() == [0.25] * 4


def test_one_particle_keeps_all_the_weight():
    """With M = 1 the weight is 1, whatever is seen; weights of type float32 are accepted."""
    after = mcl.measurement_weights([[0.3, 5.0]], [EYE], np.array([0.3], np.float32))
    assert (after.dtype, after.tolist()) == (np.float64, [1.0])


def test_arguments_are_only_read_and_results_are_the_callers_own():
    """Read-only arrays are accepted, and writing to a result changes no argument."""
    xs, map_lines, z_raw, Q_raw, ws = read_only(*scene(np.random.default_rng(11), 3, 4, 2))
    (us,) = read_only(np.ones((3, 2)))
    moved = mcl.transition_model(xs, us, 0.1)
    hs = mcl.compute_predicted_measurements(xs, map_lines, TF)
    vs = mcl.compute_innovations(z_raw, Q_raw, hs)
    after = mcl.measurement_weights(vs, Q_raw, ws)
    before = vs.copy()
    for result in (moved, hs, after):
        result[...] = 7.0
    np.testing.assert_array_equal(vs, before)


SCENE = scene(np.random.default_rng(12), 3, 4, 2)
GOOD = {
    mcl.transition_model: (SCENE[0], np.ones((3, 2)), 0.1),
    mcl.compute_predicted_measurements: (SCENE[0], SCENE[1], TF),
    mcl.compute_innovations: (SCENE[2], SCENE[3], np.ones((3, 2, 4))),
    mcl.measurement_weights: (np.ones((3, 4)), SCENE[3], SCENE[4]),
}


@pytest.mark.parametrize(
    ("function", "position", "value", "message"),
    [
        (mcl.transition_model, 0, np.ones((3, 2)), "xs: expected shape"),
        (mcl.transition_model, 1, np.ones((2, 2)), "us: expected shape"),
        (mcl.transition_model, 2, inf, "dt: expected a finite"),
        (mcl.compute_predicted_measurements, 0, np.full((3, 3), nan), "xs: expected finite"),
        (mcl.compute_predicted_measurements, 1, np.ones((3, 4)), "map_lines: expected shape"),
        (mcl.compute_predicted_measurements, 2, (0.0, 0.0), "tf_base_to_camera: expected shape"),
        (mcl.compute_innovations, 0, np.ones((3, 2)), "z_raw: expected shape"),
        (mcl.compute_innovations, 1, np.ones((3, 2, 2)), "Q_raw: expected shape"),
        (mcl.compute_innovations, 1, np.ones((2, 2, 2)), "Q_raw: expected positive definite"),
        (mcl.compute_innovations, 1, np.zeros((2, 2, 2)), "Q_raw: expected positive definite"),
        (mcl.compute_innovations, 2, np.ones((2, 4)), "hs: expected shape"),
        (mcl.measurement_weights, 0, np.ones((3, 3)), "vs: expected an even number"),
        (mcl.measurement_weights, 0, np.ones((2, 4)), "vs: expected shape"),
        (mcl.measurement_weights, 1, -np.ones((2, 2, 2)), "Q_raw: expected positive definite"),
        (mcl.measurement_weights, 2, [0.5, 0.6, -0.1], "ws: expected no negative weight"),
        (mcl.measurement_weights, 2, [], "ws: expected at least one"),
    ],
)
def test_wrong_arguments_are_named(function, position, value, message):
    """A wrong argument is an error with its name, what was expected and what came."""
    args = list(GOOD[function])
    args[position] = value
    with pytest.raises(ValueError, match=message):
        function(*args)


def test_a_difference_that_rounds_to_a_whole_turn_stays_below_pi():
    """A wall straight behind, seen by a robot that is turned by next to nothing, is at -pi or just below pi."""
    for theta in (0.0, 1e-17, -1e-17, 1e-16, -1e-16):
        (alpha, r) = mcl.compute_predicted_measurements(
            [[0.0, 0.0, theta]], [[-np.pi], [2.0]], [0.0, 0.0, 0.0]
        )[0]
        assert -np.pi <= alpha[0] < np.pi
        assert abs(alpha[0]) > np.pi - 1e-15
        assert r[0] == 2.0
