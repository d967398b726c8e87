import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import derive_motion, dynamics, finite_difference, read_only, relative_error

from roboloc import se2
from roboloc_reference.motion import EPSILON_OMEGA, compute_dynamics

law = settings(deadline=None, derandomize=True)
position = st.floats(-10, 10)
pose = st.tuples(position, position, st.floats(-np.pi, np.pi))
control = st.tuples(st.floats(-2, 2), st.floats(-3, 3))
duration = st.floats(0.001, 3)

# Accuracy is claimed for omega in +-[1e-12, 1] and 0, in the durations of DESIGN, section 6.
OMEGAS = np.concatenate([[0.0], *(s * np.geomspace(1e-12, 1.0, 61) for s in (1, -1))])
DURATIONS = (0.01, 0.1, 1.0)


def test_the_oracle_s_limits_are_the_handout_s():
    """SymPy's limits as omega goes to 0 are a straight line and a parabola sideways."""
    (x, y, theta, V, omega, dt), _, limits = derive_motion()
    half = V * dt**2 / 2
    ahead = sp.Matrix([V * dt * sp.cos(theta), V * dt * sp.sin(theta)])
    Gx = sp.Matrix([[1, 0, -ahead[1]], [0, 1, ahead[0]], [0, 0, 1]])
    Gu = sp.Matrix(
        [[dt * sp.cos(theta), -half * sp.sin(theta)], [dt * sp.sin(theta), half * sp.cos(theta)], [0, dt]]
    )
    assert (limits["g"] - sp.Matrix([x + ahead[0], y + ahead[1], theta])).expand() == sp.zeros(3, 1)
    assert (limits["Gx"] - Gx).expand() == sp.zeros(3, 3)
    assert (limits["Gu"] - Gu).expand() == sp.zeros(3, 2)
    assert omega not in limits["Gu"].free_symbols


@law
@given(pose, control, duration)
def test_code_is_the_derivation(xvec, u, dt):
    """On random inputs g, Gx and Gu equal SymPy's expressions evaluated with 50 digits, to 1e-12."""
    for got, exact in zip(compute_dynamics(xvec, u, dt), dynamics(xvec, u, dt), strict=True):
        assert np.abs(got.ravel() - np.array(exact.tolist(), dtype=float).ravel()).max() < 1e-12


@law
@given(pose, st.floats(-2, 2), duration)
def test_at_zero_the_code_is_the_limit(xvec, V, dt):
    """With omega exactly 0, of either sign, the result is SymPy's limit."""
    for zero in (0.0, -0.0):
        for got, exact in zip(
            compute_dynamics(xvec, (V, zero), dt), dynamics(xvec, (V, 0.0), dt), strict=True
        ):
            assert np.abs(got.ravel() - np.array(exact.tolist(), dtype=float).ravel()).max() < 1e-14


@pytest.mark.parametrize("dt", DURATIONS)
def test_no_digit_is_lost_for_any_omega(dt):
    """Displacement and Gu, whole and column by column, are right to 1e-15 norm-wise for every omega."""
    rng = np.random.default_rng(1)
    worst = 0.0
    for omega in OMEGAS:
        xvec = (0.0, 0.0, rng.uniform(-np.pi, np.pi))
        u = (rng.uniform(0.1, 2), omega)
        g, _, Gu = compute_dynamics(xvec, u, dt)
        exact_g, _, exact_Gu = dynamics(xvec, u, dt)
        pairs = [(g[:2], exact_g[:2, 0]), (g, exact_g), (Gu, exact_Gu)]
        pairs += [(Gu[:2, j], exact_Gu[:2, j]) for j in range(2)]
        worst = max(worst, *(relative_error(got, exact) for got, exact in pairs))
    assert worst <= 1e-15


@pytest.mark.parametrize("dt", DURATIONS)
def test_g_and_gx_are_accurate_anywhere_in_the_plane(dt):
    """Far from the origin and with any heading, g and Gx are right to 1e-15 norm-wise."""
    rng = np.random.default_rng(2)
    for omega in OMEGAS[::3]:
        xvec, u = rng.uniform(-10, 10, size=3), (rng.uniform(-2, 2), omega)
        g, Gx, _ = compute_dynamics(xvec, u, dt)
        exact_g, exact_Gx, _ = dynamics(xvec, u, dt)
        assert relative_error(g, exact_g) <= 1e-15
        assert relative_error(Gx, exact_Gx) <= 1e-15


def test_the_series_meets_the_closed_form():
    """On both sides of the switch, and at it, the derivative of the chord is right to 1e-15."""
    for h in (0.49, 0.4999999, 0.5, np.nextafter(0.5, 1), 0.5000001, 0.51, 2.0, 40.0):
        _, _, Gu = compute_dynamics((0, 0, 0.3), (1.0, 2 * h), 1.0)
        assert relative_error(Gu, dynamics((0, 0, 0.3), (1.0, 2 * h), 1.0)[2]) <= 1e-15


@pytest.mark.parametrize("dt", DURATIONS)
def test_the_limit_is_approached_from_both_sides(dt):
    """As omega shrinks, g and Gu come as close to their values at 0 as their slopes allow."""
    xvec, V = (0.4, -0.2, 1.1), 1.3
    at_zero = compute_dynamics(xvec, (V, 0.0), dt)
    for size in 10.0 ** -np.arange(2, 16):
        for omega in (size, -size):
            g, Gx, Gu = compute_dynamics(xvec, (V, omega), dt)
            assert np.abs(g - at_zero[0]).max() <= size * max(dt, V * dt**2 / 2) + 1e-15
            assert np.abs(Gx - at_zero[1]).max() <= size * V * dt**2 / 2 + 1e-15
            assert np.abs(Gu - at_zero[2]).max() <= size * max(dt**2 / 2, V * dt**3 / 3) + 1e-15
            assert g[2] == pytest.approx(xvec[2] + omega * dt, abs=1e-15)


@pytest.mark.parametrize("omega", [5e-324, -5e-324, 1e-300, 1e-160])
def test_the_smallest_numbers_do_no_harm(omega):
    """Down to the smallest float, omega gives the limit."""
    for got, limit in zip(
        compute_dynamics((1, 2, 3), (1, omega), 0.1), compute_dynamics((1, 2, 3), (1, 0), 0.1), strict=True
    ):
        np.testing.assert_allclose(got, limit, rtol=1e-15, atol=0)


@law
@given(pose, control, duration)
def test_jacobians_agree_with_finite_differences(xvec, u, dt):
    """Gx and Gu are the derivatives of g, through omega = 0 too."""
    _, Gx, Gu = compute_dynamics(xvec, u, dt)
    by_x = finite_difference(lambda x: compute_dynamics(x, u, dt)[0], xvec)
    by_u = finite_difference(lambda w: compute_dynamics(xvec, w, dt)[0], u)
    np.testing.assert_allclose(Gx, by_x, atol=1e-9)
    np.testing.assert_allclose(Gu, by_u, atol=1e-9)


@law
@given(pose, control, duration)
def test_motion_is_the_exponential_of_se2(xvec, u, dt):
    """The stage moves a pose as the group does."""
    moved = se2.compose(xvec, se2.exp([u[0] * dt, 0, u[1] * dt]))
    np.testing.assert_allclose(compute_dynamics(xvec, u, dt)[0], moved, atol=1e-13)


@law
@given(pose, control, duration)
def test_driving_back_undoes_driving(xvec, u, dt):
    """A negative duration is the way back."""
    g, _, _ = compute_dynamics(xvec, u, dt)
    np.testing.assert_allclose(compute_dynamics(g, u, -dt)[0], xvec, atol=1e-13)


def test_the_heading_is_never_wrapped():
    """A robot that turns on the spot three times has a heading of six pi."""
    assert compute_dynamics((0, 0, 0), (0, 2 * np.pi), 3.0)[0][2] == pytest.approx(6 * np.pi)


def test_no_time_is_no_motion():
    """A step of no length returns the pose, the identity and zero."""
    g, Gx, Gu = compute_dynamics((1, 2, 3), (1, 1), 0.0)
    np.testing.assert_array_equal(g, [1, 2, 3])
    np.testing.assert_array_equal(Gx, np.eye(3))
    np.testing.assert_array_equal(Gu, np.zeros((3, 2)))


def test_audit_r1_full_derivative_of_the_arc():
    """ERRATA R1: the column of Gu by omega is (-.1106, .1506, .5), not (-.5964, -.3865, .5)."""
    _, _, Gu = compute_dynamics((0, 0, 0.4), (1.5, 0.7), 0.5)
    np.testing.assert_allclose(Gu[:, 1], [-0.1106, 0.1506, 0.5], atol=5e-5)


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted, and the results share no memory with them."""
    xvec, u = read_only([1, 2, 3], [0, 0])
    results = compute_dynamics(xvec, u, 0.0)
    assert not any(np.shares_memory(result, argument) for result in results for argument in (xvec, u))
    assert [(result.shape, result.dtype) for result in results] == [
        ((3,), np.float64),
        ((3, 3), np.float64),
        ((3, 2), np.float64),
    ]


def test_lists_and_integers_are_numbers():
    """The result does not depend on how the numbers are given."""
    for a, b in zip(
        compute_dynamics([1, 2, 0], (1, 2), 1),
        compute_dynamics(*read_only([1, 2, 0], [1, 2], 1)),
        strict=True,
    ):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ((None, [1, 0], 0.1), "xvec"),
        (([1, 2], [1, 0], 0.1), "xvec"),
        (([[1, 2, 3]], [1, 0], 0.1), "xvec"),
        (([1, 2, np.nan], [1, 0], 0.1), "xvec"),
        (([1, 2, 3], 1.0, 0.1), "u"),
        (([1, 2, 3], [1, 0, 0], 0.1), "u"),
        (([1, 2, 3], ["a", "b"], 0.1), "u"),
        (([1, 2, 3], [1, np.inf], 0.1), "u"),
        (([1, 2, 3], [1, 0], None), "dt"),
        (([1, 2, 3], [1, 0], [0.1]), "dt"),
        (([1, 2, 3], [1, 0], np.inf), "dt"),
    ],
)
def test_a_wrong_argument_is_named(arguments, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        compute_dynamics(*arguments)


def test_the_handout_s_threshold_is_offered():
    """Students find the handout's constant beside the stage."""
    assert EPSILON_OMEGA == 1e-3


def test_the_oracle_sees_lost_digits():
    """The accuracy tests can fail: the naive formula at omega = 1e-8 misses the oracle by far."""
    theta, V, omega, dt = 0.3, 1.0, 1e-8, 0.1
    naive = (
        V * dt * np.cos(theta + omega * dt) / omega
        - V * (np.sin(theta + omega * dt) - np.sin(theta)) / omega**2
    )
    exact = dynamics((0, 0, theta), (V, omega), dt)[2][0, 1]
    with mp.workdps(30):
        assert abs(naive - exact) > 1e-2 * abs(exact)
