from functools import cache

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import dynamics, finite_difference, read_only

from roboloc_reference.velocity import jacobians, motion, motions, noise, range_bearing, range_bearings

law = settings(deadline=None, derandomize=True, max_examples=50)
pose = st.tuples(st.floats(-10, 10), st.floats(-10, 10), st.floats(-7, 7))
control = st.tuples(st.floats(-2, 2), st.floats(-3, 3), st.floats(-1, 1))
duration = st.floats(0.001, 3)


@cache
def derive():
    """Derive the motion of the source and the measurement, and their Jacobians, by SymPy."""
    x, y, theta, v, omega, gamma, dt, mx, my = sp.symbols("x y theta v omega gamma dt m_x m_y", real=True)
    r = v / omega
    turned = theta + omega * dt
    f = sp.Matrix(
        [
            x + r * (sp.sin(turned) - sp.sin(theta)),
            y + r * (sp.cos(theta) - sp.cos(turned)),
            turned + gamma * dt,
        ]
    )
    h = sp.Matrix([sp.atan2(my - y, mx - x) - theta, sp.sqrt((mx - x) ** 2 + (my - y) ** 2)])
    state = [x, y, theta]
    moved = (f, f.jacobian(state), f.jacobian([v, omega, gamma]))
    return (x, y, theta, v, omega, gamma, dt), moved, (x, y, theta, mx, my), (h, h.jacobian(state))


def evaluate(form, symbols, values):
    """Evaluate a SymPy matrix with 50 digits at the floats given, and round."""
    at = dict(zip(symbols, (sp.Float(value, 50) for value in values), strict=True))
    return np.array(form.evalf(50, subs=at).tolist(), dtype=float)


def test_motion_and_jacobians_are_the_derivation():
    """On random inputs f, F and W equal SymPy's derivatives of the source's motion, 50 digits, to 1e-12."""
    rng = np.random.default_rng(1)
    symbols, forms, _, _ = derive()
    for _ in range(15):
        x, u, dt = rng.uniform(-5, 5, size=3), rng.uniform(-2, 2, size=3), rng.uniform(0.05, 2)
        exact = [evaluate(form, symbols, (*x, *u, dt)) for form in forms]
        for got, expected in zip((motion(x, u, dt), *jacobians(x, u, dt)), exact, strict=True):
            np.testing.assert_allclose(got, expected.reshape(got.shape), atol=1e-12)


def test_measurement_is_the_derivation():
    """On random inputs z and H equal SymPy's, evaluated with 50 digits, to 1e-12; the bearing on the circle."""
    rng = np.random.default_rng(2)
    _, _, symbols, (h, H) = derive()
    for _ in range(15):
        x, landmark = rng.uniform(-5, 5, size=3), rng.uniform(-5, 5, size=2)
        z, got = range_bearing(x, landmark)
        exact = evaluate(h, symbols, (*x, *landmark)).ravel()
        assert abs(np.exp(1j * z[0]) - np.exp(1j * exact[0])) < 1e-12
        assert -np.pi <= z[0] < np.pi
        assert z[1] == pytest.approx(exact[1], abs=1e-12)
        np.testing.assert_allclose(got, evaluate(H, symbols, (*x, *landmark)), atol=1e-12)


@pytest.mark.parametrize("omega", [0.0, -0.0, 1e-300, 1e-12, -1e-12, 1e-6, -1e-3, 0.5])
def test_any_turning_rate_is_exact(omega):
    """For tiny omega of either sign, and for 0, motion and W equal the oracle's exact value or limit."""
    x, v, dt = (1.0, -2.0, 0.7), 1.3, 0.5
    g, Gx, Gu = (
        np.array(m.tolist(), dtype=float) for m in dynamics(x, (v, omega if abs(omega) > 1e-100 else 0.0), dt)
    )
    F, W = jacobians(x, (v, omega, 0.0), dt)
    np.testing.assert_allclose(motion(x, (v, omega, 0.0), dt), g.ravel(), atol=1e-15)
    np.testing.assert_allclose(F, Gx, atol=1e-15)
    np.testing.assert_allclose(W[:, :2], Gu, atol=1e-15)


@law
@given(pose, control, duration)
def test_jacobians_are_the_slopes(x, u, dt):
    """F and W agree with finite differences of the motion."""
    F, W = jacobians(x, u, dt)
    np.testing.assert_allclose(F, finite_difference(lambda a: motion(a, u, dt), x), atol=1e-8)
    np.testing.assert_allclose(W, finite_difference(lambda a: motion(x, a, dt), u), atol=1e-8)


def test_no_time_no_motion():
    """With dt = 0 the pose stays, F is the identity and W is zero."""
    x, u = (1.0, 2.0, 3.0), (1.0, 0.5, 0.2)
    F, W = jacobians(x, u, 0.0)
    np.testing.assert_array_equal(motion(x, u, 0.0), x)
    np.testing.assert_array_equal(F, np.eye(3))
    np.testing.assert_array_equal(W, np.zeros((3, 3)))


def test_many_are_one_at_a_time():
    """The row-wise forms give what the single ones give, also for no row at all."""
    rng = np.random.default_rng(3)
    xs, us, landmarks = rng.normal(size=(20, 3)), rng.normal(size=(20, 3)), rng.normal(size=(4, 2))
    us[3, 1] = 0.0
    many = motions(xs, us, 0.3)
    seen = range_bearings(xs, landmarks)
    for m in range(20):
        np.testing.assert_allclose(many[m], motion(xs[m], us[m], 0.3), rtol=1e-13)
        for k in range(4):
            np.testing.assert_allclose(seen[m, k], range_bearing(xs[m], landmarks[k])[0], rtol=1e-14)
    assert motions(np.zeros((0, 3)), np.zeros((0, 3)), 0.1).shape == (0, 3)
    assert range_bearings(xs, np.zeros((0, 2))).shape == (20, 0, 2)
    np.testing.assert_array_equal(range_bearings([[1.0, 2.0, 0.0]], [[1.0, 2.0]]), [[[0.0, 0.0]]])


def test_audit_r1_second_column_of_w():
    """ERRATA R1: the source's numbers for column 2; the printed formula gives something else."""
    v, omega, theta, dt = 1.5, 0.7, 0.4, 0.5
    _, W = jacobians((0.0, 0.0, theta), (v, omega, 0.0), dt)
    np.testing.assert_allclose(W[:, 1], [-0.1106, 0.1506, 0.5], atol=5e-5)
    turned = theta + omega * dt
    printed = np.array([np.sin(theta) - np.sin(turned), np.cos(turned) - np.cos(theta)]) / omega**2
    np.testing.assert_allclose(printed, [-0.5964, -0.3865], atol=5e-5)


def test_audit_r2_second_row_of_h():
    """ERRATA R2: at range 5 the range's slope is (-.6, -.8), a unit vector, and not that over 5 again."""
    z, H = range_bearing((0.0, 0.0, 0.0), (3.0, 4.0))
    np.testing.assert_allclose(H[1], [-0.6, -0.8, 0.0], atol=1e-15)
    np.testing.assert_allclose(H[1, :2] / z[1], [-0.12, -0.16], atol=1e-15)


def test_noise_is_the_source_s():
    """The three variances mix v squared and omega squared by pairs of alphas; gamma adds none."""
    M = noise((2.0, -3.0, 5.0), (1.0, 0.1, 0.2, 2.0, 0.3, 0.4))
    np.testing.assert_allclose(M, np.diag([4.9, 18.8, 4.8]))


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted, and the results share no memory with them."""
    x, u, alphas, landmark, xs, us, landmarks = arguments = read_only(
        np.ones(3), np.ones(3), np.ones(6), np.zeros(2), np.ones((2, 3)), np.ones((2, 3)), np.zeros((1, 2))
    )
    results = [motion(x, u, 0.0), motions(xs, us, 0.0), *jacobians(x, u, 0.1), noise(u, alphas)]
    results += [*range_bearing(x, landmark), range_bearings(xs, landmarks)]
    for result in results:
        assert not any(np.shares_memory(result, argument) for argument in arguments)


X, U, A = np.zeros(3), np.ones(3), np.ones(6)


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: motion(None, U, 0.1), "x"),
        (lambda: motion(X, np.ones(2), 0.1), "u"),
        (lambda: motion(X, U, np.nan), "dt"),
        (lambda: motions(X, U, 0.1), "xs"),
        (lambda: motions(np.zeros((2, 3)), np.ones((1, 3)), 0.1), "us"),
        (lambda: jacobians(X[:2], U, 0.1), "x"),
        (lambda: jacobians(X, [1.0, np.inf, 0.0], 0.1), "u"),
        (lambda: jacobians(X, U, [0.1]), "dt"),
        (lambda: noise(U[:2], A), "u"),
        (lambda: noise(U, A[:4]), "alphas"),
        (lambda: noise(U, -A), "alphas"),
        (lambda: range_bearing(X[:2], [1.0, 0.0]), "x"),
        (lambda: range_bearing(X, [1.0]), "landmark"),
        (lambda: range_bearing(X, [0.0, 0.0]), "landmark"),
        (lambda: range_bearings(X, [[1.0, 0.0]]), "xs"),
        (lambda: range_bearings([X], [1.0, 0.0]), "landmarks"),
    ],
)
def test_a_wrong_argument_of_the_velocity_model_is_named(call, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        call()
