"""Lines in the state: the code is the derivation, a certain map is localization, and a new line knows the rest."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from line_states import (
    DT,
    MAP,
    TF,
    a_line,
    controls,
    few,
    law,
    minus,
    mountings,
    poses,
    random_covariance,
    random_state,
    seeds,
    with_map,
)
from oracles import DIGITS, dynamics, finite_difference, read_only

from roboloc.angles import difference
from roboloc.simulation import figure_eight, simulate_motion
from roboloc_reference import lines
from roboloc_reference.association import compute_innovations, measurement_model
from roboloc_reference.gaussian import measurement_update, transition_update
from roboloc_reference.motion import compute_dynamics
from roboloc_reference.slam import augment, compute_predicted_measurements, transition_model

# ---------------------------------------------------------------- 50 digits


def into_frame(p, x, y, theta):
    """Return a point, a complex number, as a frame at (x, y, theta) sees it."""
    return (p - mp.mpc(x, y)) * mp.expj(-theta)


def out_of_frame(p, x, y, theta):
    """Return a point that a frame at (x, y, theta) sees, as it is outside."""
    return p * mp.expj(theta) + mp.mpc(x, y)


def carried(values, outwards):
    """Carry two points of a line between world and scanner; return normal (complex) and signed distance.

    Nothing is shared with the code, nor with the derivation: no formula for the angle or the distance, but the
    line through two points.
    """
    alpha, r, *frames = values
    pose, mounting = frames[:3], frames[3:]
    points = [mp.mpc(r, k) * mp.expj(alpha) for k in (0, 1)]
    if outwards:
        p, q = (out_of_frame(out_of_frame(point, *mounting), *pose) for point in points)
    else:
        p, q = (into_frame(into_frame(point, *pose), *mounting) for point in points)
    normal = -1j * (q - p)
    return normal, (p * mp.conj(normal)).real


def exact(line, x, tf, *, outwards):
    """Return the normalised line (2,), and its derivative by line and pose (2, 5), from 50 digits."""
    with mp.workdps(DIGITS):
        values = [mp.mpf(float(value)) for value in (*line, *x, *tf)]
        normal, r = carried(values, outwards)
        sign = -1 if r < 0 else 1
        h = float(mp.arg(sign * normal)), float(sign * r)

        def slope(i, entry):
            def moved(t):
                n, r = carried([*values[:i], t, *values[i + 1 :]], outwards)
                return mp.arg(n * mp.conj(normal)) if entry == 0 else sign * r

            return float(mp.diff(moved, values[i]))

        return np.array(h), np.array([[slope(i, entry) for i in range(5)] for entry in (0, 1)])


@few
@given(a_line, poses, mountings)
def test_prediction_is_the_derivation(line, x, tf):
    """On random inputs h and its derivatives by pose and line equal those of mpmath at 50 digits, to 1e-12."""
    h, slopes = exact(line, x, tf, outwards=False)
    assume(h[1] > 1e-9)  # on the line itself, the sign of r is that of a rounding
    hs, Hs = compute_predicted_measurements([*x, *line], tf, fixed=0)
    assert np.abs(minus(hs[:, 0], h)).max() < 1e-12
    assert np.abs(Hs[0, :, :3] - slopes[:, 2:]).max() < 1e-12
    assert np.abs(Hs[0, :, 3:] - slopes[:, :2]).max() < 1e-12


@few
@given(a_line, poses, mountings)
def test_a_new_line_is_the_derivation(z, x, tf):
    """The line that enters and its derivatives by pose and observation equal those of mpmath, to 1e-12."""
    # The derivatives are read from the covariances: a unit covariance of the pose gives J and J J^T.
    line, slopes = exact(z, x, tf, outwards=True)
    assume(line[1] > 1e-9)
    zero = np.zeros((2, 2))
    grown, Sigma = augment(x, np.eye(3), z, zero, tf)
    assert np.abs(minus(grown[3:], line)).max() < 1e-12
    assert np.abs(Sigma[3:, :3] - slopes[:, 2:]).max() < 1e-12
    assert np.abs(Sigma[3:, 3:] - slopes[:, 2:] @ slopes[:, 2:].T).max() < 1e-11  # entries up to some hundred
    _, Sigma = augment(x, np.zeros((3, 3)), z, np.eye(2), tf)
    assert np.abs(Sigma[3:, 3:] - slopes[:, :2] @ slopes[:, :2].T).max() < 1e-11
    np.testing.assert_array_equal(Sigma[3:, :3], 0.0)


@few
@given(poses, controls, st.floats(0.001, 3), st.integers(0, 4), seeds)
def test_motion_is_the_derivation_beside_an_identity(pose, u, dt, J, seed):
    """The block of the pose equals SymPy's expressions at 50 digits, to 1e-12; the rest is exactly I and 0."""
    x = np.concatenate([pose, random_state(np.random.default_rng(seed), J)[3:]])
    g, Gx, Gu = transition_model(x, u, dt)
    for got, form in zip((g[:3], Gx[:3, :3], Gu[:3]), dynamics(pose, u, dt), strict=True):
        assert np.abs(got.ravel() - np.array(form.tolist(), dtype=float).ravel()).max() < 1e-12
    np.testing.assert_array_equal(g[3:], x[3:])
    np.testing.assert_array_equal(Gx[3:], np.eye(3 + 2 * J)[3:])
    np.testing.assert_array_equal(Gx[:3, 3:], 0.0)
    np.testing.assert_array_equal(Gu[3:], 0.0)


# ---------------------------------------------------------------- derivatives and structure


@few
@given(st.integers(1, 6), mountings, seeds)
def test_derivatives_agree_with_finite_differences(J, tf, seed):
    """Gx, Gu and Hs are the slopes of what they are derivatives of."""
    rng = np.random.default_rng(seed)
    x, u = random_state(rng, J), rng.uniform(-1, 1, 2)
    _, Gx, Gu = transition_model(x, u, 0.7)
    slope = finite_difference(lambda x: transition_model(x, u, 0.7)[0], x)
    np.testing.assert_allclose(Gx, slope, atol=1e-9)
    slope = finite_difference(lambda u: transition_model(x, u, 0.7)[0], u)
    np.testing.assert_allclose(Gu, slope, atol=1e-9)
    hs, Hs = compute_predicted_measurements(x, tf, fixed=0)
    assume(hs[1].min() > 0.05)  # a step must not cross a line

    def moved(y):
        new, _ = compute_predicted_measurements(y, tf, fixed=0)
        return np.array([difference(new[0], hs[0]), new[1]]).T

    np.testing.assert_allclose(Hs, finite_difference(moved, x), atol=1e-8)


@law
@given(st.integers(0, 8), st.integers(0, 10), mountings, seeds)
def test_the_jacobian_has_its_blocks(J, fixed, tf, seed):
    """By the pose it is that of localization; by the lines only block j of line j, and none of a fixed line."""
    x = random_state(np.random.default_rng(seed), J)
    hs, Hs = compute_predicted_measurements(x, tf, fixed)
    same_hs, by_pose = lines.compute_predicted_measurements(x[:3], x[3:].reshape(J, 2).T, tf)
    np.testing.assert_array_equal(hs, same_hs)
    np.testing.assert_array_equal(Hs[:, :, :3], by_pose)
    assert Hs.shape == (J, 2, 3 + 2 * J)
    blocks = Hs[:, :, 3:].reshape(J, 2, J, 2)
    for j in range(J):
        for k in range(J):
            if j != k or j < fixed:
                np.testing.assert_array_equal(blocks[j, :, k], 0.0)
            else:
                assert blocks[j, 0, j].tolist() == [1.0, 0.0]
                assert abs(blocks[j, 1, j, 1]) == 1.0


def test_two_lines_are_fixed_unless_told_otherwise():
    """The default is the handout's."""
    x = with_map([0.3, 0.2, 0.1])
    for default, told in zip(
        compute_predicted_measurements(x, TF), compute_predicted_measurements(x, TF, 2), strict=True
    ):
        np.testing.assert_array_equal(default, told)


def test_columns_of_certain_lines_do_not_matter():
    """With covariance 0 of the first two lines, setting their columns to 0 changes no correction (ERRATA H9)."""
    rng = np.random.default_rng(5)
    x = random_state(rng, 5)
    Sigma = random_covariance(rng, x.size, 0.1)
    Sigma[3:7] = 0.0
    Sigma[:, 3:7] = 0.0
    z, results = rng.normal(0, 0.01, 10), []
    for fixed in (0, 2):
        H = compute_predicted_measurements(x, TF, fixed)[1].reshape(10, -1)
        results.append(measurement_update(x, Sigma, z, 1e-4 * np.eye(10), H))
    for one, other in zip(*results, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-14)
    np.testing.assert_array_equal(results[1][0][3:7], x[3:7])


# ---------------------------------------------------------------- localization is the special case


def test_a_certain_map_is_localization():
    """With covariance 0 of all lines, every step of a noisy drive is that of localization, to 1e-12."""
    # All six lines pass through association and stacking; whether their columns are set to 0 is of no matter.
    R, Q = np.diag([0.004, 0.008]), np.diag([0.01, 0.02]) ** 2
    for fixed in (0, 2, MAP.shape[1]):
        rng = np.random.default_rng(7)
        us = figure_eight()
        truth = simulate_motion([0.2, 0.0, 0.0], us, DT, R, rng)
        x, Sigma = np.array([0.25, -0.03, 0.01]), np.diag([0.05, 0.05, 0.02]) ** 2
        whole, Whole = with_map(x), np.zeros((15, 15))
        Whole[:3, :3] = Sigma
        for u, pose in zip(us[:80], truth[1:81], strict=True):
            x, Sigma = transition_update(*compute_dynamics(x, u, DT), Sigma, R, DT)
            whole, Whole = transition_update(*transition_model(whole, u, DT), Whole, R, DT)
            z_raw = lines.compute_predicted_measurements(pose, MAP, TF)[0]
            z_raw = z_raw + rng.normal(size=z_raw.shape) * [[0.01], [0.02]]
            known = lines.compute_predicted_measurements(x, MAP, TF)
            mapped = compute_predicted_measurements(whole, TF, fixed)
            v, Qs, H = compute_innovations(z_raw, [Q] * 6, *known, Sigma, 4.0)
            w, _, G = compute_innovations(z_raw, [Q] * 6, *mapped, Whole, 4.0)
            assert len(v) == len(w) > 0
            x, Sigma = measurement_update(x, Sigma, *measurement_model(v, Qs, H))
            whole, Whole = measurement_update(whole, Whole, *measurement_model(w, Qs, G))
            np.testing.assert_allclose(whole, with_map(x), atol=1e-12)
            np.testing.assert_allclose(Whole[:3, :3], Sigma, atol=1e-14)
        np.testing.assert_array_equal(whole[3:], MAP.T.ravel())
        np.testing.assert_array_equal(Whole[3:], 0.0)


def test_without_a_map_the_motion_is_that_of_a_pose():
    """J = 0: the motion is that of localization bit by bit, nothing is predicted, nothing observed changes nothing."""
    x, Sigma = np.array([1.0, 2.0, 0.3]), np.diag([0.1, 0.2, 0.3])
    for got, expected in zip(
        transition_model(x, [0.5, 0.2], DT), compute_dynamics(x, [0.5, 0.2], DT), strict=True
    ):
        np.testing.assert_array_equal(got, expected)
    hs, Hs = compute_predicted_measurements(x, TF)
    assert (hs.shape, Hs.shape) == ((2, 0), (0, 2, 3))
    v, Q, H = compute_innovations([[0.1], [2.0]], [np.eye(2)], hs, Hs, Sigma, 3.0)
    x_new, Sigma_new = measurement_update(x, Sigma, *measurement_model(v, Q, H))
    np.testing.assert_array_equal(x_new, x)
    np.testing.assert_array_equal(Sigma_new, Sigma)


@pytest.mark.parametrize("omega", [0.0, -0.0, 5e-324, -1e-300, 1e-12, -1e-12, 1e-4, -1e-3])
@pytest.mark.parametrize("dt", [0.0, 0.1])
def test_little_turning_and_no_time(omega, dt):
    """For omega tiny or 0 and for dt = 0 every digit of the pose's block stays; without time nothing moves."""
    x = with_map([1.0, 2.0, 0.3])
    g, Gx, Gu = transition_model(x, [0.5, omega], dt)
    for got, form in zip((g[:3], Gx[:3, :3], Gu[:3]), dynamics(x[:3], (0.5, omega), dt), strict=True):
        np.testing.assert_allclose(got.ravel(), np.array(form.tolist(), dtype=float).ravel(), atol=1e-15)
    if dt == 0.0:
        np.testing.assert_array_equal(g, x)
        np.testing.assert_array_equal(Gx, np.eye(x.size))
        np.testing.assert_array_equal(Gu, 0.0)


# ---------------------------------------------------------------- border


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted, and the results share no memory with them."""
    x, u, tf, Sigma, z, Q = read_only(with_map([1, 2, 3]), [0.5, 0.1], TF, np.eye(15), [0.1, 2], np.eye(2))
    calls = (
        (transition_model, (x, u, 0.1), [(15,), (15, 15), (15, 2)]),
        (compute_predicted_measurements, (x, tf), [(2, 6), (6, 2, 15)]),
        (augment, (x, Sigma, z, Q, tf), [(17,), (17, 17)]),
    )
    for function, arguments, shapes in calls:
        results = function(*arguments)
        assert not any(np.shares_memory(result, argument) for result in results for argument in arguments)
        assert [(result.shape, result.dtype) for result in results] == [
            (shape, np.float64) for shape in shapes
        ]


I3, I2, ZERO = np.eye(3), np.eye(2), [0, 0, 0]


@pytest.mark.parametrize(
    ("function", "arguments", "name"),
    [
        (transition_model, ([0, 0], [1, 0], 0.1), "x"),
        (transition_model, ([0, 0, 0, 1], [1, 0], 0.1), "x"),
        (transition_model, ([1], [1, 0], 0.1), "x"),
        (transition_model, ([0, 0, 0, np.nan, 1], [1, 0], 0.1), "x"),
        (transition_model, ([[0, 0, 0]], [1, 0], 0.1), "x"),
        (transition_model, (ZERO, [1], 0.1), "u"),
        (transition_model, (ZERO, [1, 0], np.inf), "dt"),
        (compute_predicted_measurements, ([0, 0, 0, 1], ZERO), "x"),
        (compute_predicted_measurements, (None, ZERO), "x"),
        (compute_predicted_measurements, (ZERO, [0, 0]), "tf_base_to_camera"),
        (compute_predicted_measurements, (ZERO, ZERO, -1), "fixed"),
        (compute_predicted_measurements, (ZERO, ZERO, 1.5), "fixed"),
        (compute_predicted_measurements, (ZERO, ZERO, "two"), "fixed"),
        (augment, ([0, 0, 0, 1], np.eye(4), [0, 1], I2, ZERO), "x"),
        (augment, (ZERO, np.eye(5), [0, 1], I2, ZERO), "Sigma"),
        (augment, (ZERO, I3, [0, 1, 2], I2, ZERO), "z"),
        (augment, (ZERO, I3, [0, np.inf], I2, ZERO), "z"),
        (augment, (ZERO, I3, [0, 1], [1, 1], ZERO), "Q"),
        (augment, (ZERO, I3, [0, 1], I2, [0, 0, "a"]), "tf_base_to_camera"),
    ],
)
def test_a_wrong_argument_is_named(function, arguments, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        function(*arguments)


def test_the_oracle_sees_a_lost_sign():
    """The tests against 50 digits can fail: a line that has been crossed, with the slope of one that has not."""
    line, x = (0.0, 1.0), (3.0, 0.5, 0.2)
    h, slopes = exact(line, x, TF, outwards=False)
    assert h[1] > 0
    assert slopes[1, 1] == pytest.approx(-1.0)
    _, Hs = compute_predicted_measurements([*x, *line], TF, fixed=0)
    assert Hs[0, 1, 4] == -1.0
