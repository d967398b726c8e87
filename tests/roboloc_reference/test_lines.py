"""Lines seen from a robot: the code is SymPy's derivation, and a wall stays where it is."""

from functools import cache

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles import DIGITS, finite_difference, read_only

from roboloc import se2
from roboloc.angles import difference
from roboloc_reference.lines import (
    compute_predicted_measurements,
    normalize_line_parameters,
    transform_line_to_scanner_frame,
)

law = settings(deadline=None, derandomize=True)
position = st.floats(-10, 10)
lines = st.tuples(st.floats(-np.pi, np.pi), st.floats(0, 10))
poses = st.tuples(position, position, st.floats(-7, 7))
mountings = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-np.pi, np.pi))


@cache
def derivation():
    """Solve for the line in the scanner's frame from two of its points; return evaluators of h and Hx.

    The points are carried over by the inverse of the frames, and the line through them is made anew: nothing is
    shared with the code, nor with the derivation in the book, which puts the frames into the wall's equation.
    """
    symbols = alpha, r, x, y, theta, xc, yc, tc = sp.symbols("alpha r x y theta xc yc tc", real=True)

    def undo(p, pose):
        c, s = sp.cos(pose[2]), sp.sin(pose[2])
        dx, dy = p[0] - pose[0], p[1] - pose[1]
        return sp.Matrix([c * dx + s * dy, -s * dx + c * dy])

    n, t = sp.Matrix([sp.cos(alpha), sp.sin(alpha)]), sp.Matrix([-sp.sin(alpha), sp.cos(alpha)])
    p, q = (undo(undo(r * n + k * t, (x, y, theta)), (xc, yc, tc)) for k in (0, 1))
    along = (q - p).applyfunc(sp.simplify)
    normal = sp.Matrix([along[1], -along[0]])
    angle = sp.atan2(normal[1], normal[0])
    h = sp.Matrix([angle, normal.dot(p)])
    return [sp.lambdify(symbols, form, "mpmath") for form in (h, h.jacobian([x, y, theta]))]


def exact(line, x, tf):
    """Return h and Hx with 50 digits, as arrays of doubles."""
    with mp.workdps(DIGITS):
        values = [mp.mpf(float(value)) for value in (*line, *x, *tf)]
        h, Hx = (np.array(form(*values).tolist(), dtype=float) for form in derivation())
    return h.ravel(), Hx


def minus(a, b):
    """Return a - b of two lines, the angle on the circle."""
    return np.array([difference(a[0], b[0]), a[1] - b[1]])


def foot(line):
    """Return the point of a line that is nearest to the origin."""
    return line[1] * np.array([np.cos(line[0]), np.sin(line[0])])


@law
@given(lines, poses, mountings)
def test_code_is_the_derivation(line, x, tf):
    """On random inputs h and Hx equal SymPy's expressions evaluated with 50 digits, to 1e-12."""
    h, Hx = transform_line_to_scanner_frame(line, x, tf)
    exact_h, exact_Hx = exact(line, x, tf)
    assert np.abs(minus(h, exact_h)).max() < 1e-12
    assert np.abs(Hx - exact_Hx).max() < 1e-12


@law
@given(lines, poses, mountings)
def test_the_angle_is_the_difference_and_is_not_wrapped(line, x, tf):
    """The angle of h is alpha less both headings, in whatever turn that is."""
    h, _ = transform_line_to_scanner_frame(line, x, tf)
    assert h[0] == pytest.approx(line[0] - x[2] - tf[2], abs=1e-14)


@law
@given(lines, poses, mountings)
def test_jacobian_agrees_with_finite_differences(line, x, tf):
    """Hx is the derivative of h by the pose, and stays it when both are normalised."""
    _, Hx = transform_line_to_scanner_frame(line, x, tf)
    slope = finite_difference(lambda x: transform_line_to_scanner_frame(line, x, tf)[0], x)
    np.testing.assert_allclose(Hx, slope, atol=1e-9)
    (_, r), Hx = normalize_line_parameters(*transform_line_to_scanner_frame(line, x, tf))
    assume(r > 0.01)  # a step must not cross the line

    def normalized(pose):
        h, _ = normalize_line_parameters(*transform_line_to_scanner_frame(line, pose, tf))
        return foot(h)

    (alpha, r), (row, slope_r) = (
        normalize_line_parameters(*transform_line_to_scanner_frame(line, x, tf))[0],
        Hx,
    )
    across = np.array([-np.sin(alpha), np.cos(alpha)])
    by_pose = np.outer(foot((alpha, 1.0)), slope_r) + r * np.outer(across, row)
    np.testing.assert_allclose(by_pose, finite_difference(normalized, x, 1e-4), atol=1e-8)


@law
@given(lines, poses, mountings, st.floats(-5, 5))
def test_a_point_of_the_wall_is_on_the_line_that_is_seen(line, x, tf, along):
    """A point of the wall, carried to the scanner by SE(2), satisfies the equation of h and of its normal form."""
    normal = np.array([np.cos(line[0]), np.sin(line[0])])
    point = line[1] * normal + along * np.array([-normal[1], normal[0]])
    seen = se2.compose(se2.inverse(se2.compose(x, tf)), [*point, 0.0])[:2]
    h, Hx = transform_line_to_scanner_frame(line, x, tf)
    for alpha, r in (h, normalize_line_parameters(h, Hx)[0]):
        assert seen @ [np.cos(alpha), np.sin(alpha)] == pytest.approx(r, abs=1e-12)


@law
@given(lines, poses, mountings)
def test_a_scanner_at_the_centre_is_the_robot(line, x, tf):
    """A mounting is a pose like another: a robot at the scanner's place with a scanner at its centre sees the same."""
    h, _ = transform_line_to_scanner_frame(line, x, tf)
    again, _ = transform_line_to_scanner_frame(line, se2.compose(x, tf), np.zeros(3))
    np.testing.assert_allclose(again, h, atol=1e-12)


@law
@given(st.floats(-40, 40), st.floats(-5, 5), st.integers(1, 6))
def test_normalised_lines_are_normal_and_the_same(alpha, r, n):
    """The distance is not negative, alpha in [-pi, pi), the foot stays, row 1 stays, and row 2 changes sign with r."""
    Hx = np.random.default_rng(n).normal(size=(2, n))
    h, slope = normalize_line_parameters((alpha, r), Hx)
    assert -np.pi <= h[0] < np.pi
    assert h[1] == abs(r)
    assert not np.signbit(h[1])
    np.testing.assert_allclose(foot(h), foot((alpha, r)), atol=1e-13)
    np.testing.assert_array_equal(slope, [Hx[0], -Hx[1] if r < 0 else Hx[1]])


@law
@given(st.floats(-40, 40), st.floats(-5, 5))
def test_normalising_twice_changes_nothing(alpha, r):
    """A normalised line is its own normal form, bit by bit."""
    once = normalize_line_parameters((alpha, r), [[1.0, 2.0], [3.0, 4.0]])
    for first, second in zip(once, normalize_line_parameters(*once), strict=True):
        np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("zero", [0.0, -0.0])
def test_a_line_through_the_scanner_keeps_its_name(zero):
    """At r exactly 0, of either sign, the angle and the derivative stay as they are."""
    h, Hx = normalize_line_parameters((0.5, zero), [[0.0, 0.0, -1.0], [-1.0, 0.5, 0.2]])
    assert h.tolist() == [0.5, 0.0]
    assert not np.signbit(h[1])
    assert Hx.tolist() == [[0.0, 0.0, -1.0], [-1.0, 0.5, 0.2]]


@pytest.mark.parametrize("tiny", [5e-324, 1e-300, 1e-17, 1e-9])
def test_both_sides_of_zero_are_one_line(tiny):
    """However near r is to 0, its sign alone decides, and the two sides are the same line with the same slopes."""
    row = np.array([[0.0, 0.0, -1.0], [-1.0, 0.5, 0.2]])
    (a, r), Hx = normalize_line_parameters((0.5, tiny), row)
    (b, s), flipped = normalize_line_parameters((0.5, -tiny), row)
    assert (a, r, s) == (0.5, tiny, tiny)
    assert difference(b, a + np.pi) == pytest.approx(0.0, abs=1e-15)
    np.testing.assert_array_equal(flipped, np.diag([1, -1]) @ Hx)


@pytest.mark.parametrize("alpha", [np.pi, -np.pi, 3 * np.pi, np.nextafter(np.pi, 0), np.nextafter(np.pi, 4)])
def test_the_edge_of_the_turn_is_minus_pi(alpha):
    """At and next to pi the angle stays inside the half-open turn."""
    (a, _), _ = normalize_line_parameters((alpha, 1.0), np.zeros((2, 3)))
    assert -np.pi <= a < np.pi
    assert abs(difference(a, alpha)) < 1e-15


@law
@given(poses, mountings, st.integers(0, 20), st.integers(0, 99))
def test_the_whole_map_is_its_lines(x, tf, count, seed):
    """All lines at once give what one line after the other gives."""
    rng = np.random.default_rng(seed)
    map_lines = np.array([rng.uniform(-np.pi, np.pi, count), rng.uniform(0, 10, count)])
    hs, Hs = compute_predicted_measurements(x, map_lines, tf)
    assert (hs.shape, Hs.shape) == ((2, count), (count, 2, 3))
    for j, line in enumerate(map_lines.T):
        h, Hx = normalize_line_parameters(*transform_line_to_scanner_frame(line, x, tf))
        assert np.abs(minus(hs[:, j], h)).max() < 1e-13
        np.testing.assert_allclose(Hs[j], Hx, atol=1e-14)


def test_lines_on_both_sides_of_r_zero_in_one_map():
    """Of three lines, in front of, through and behind the scanner, the last alone is flipped."""
    hs, Hs = compute_predicted_measurements((1, 0, 0), [[0.0, 0.0, 0.0], [2.0, 1.0, 0.5]], (0, 0, 0))
    np.testing.assert_allclose(hs, [[0.0, 0.0, -np.pi], [1.0, 0.0, 0.5]], atol=1e-15)
    assert Hs[:, 1, 0].tolist() == [-1.0, -1.0, 1.0]
    assert not np.signbit(hs[1]).any()


def test_audit_a4_the_absolute_value_does_not_go_away():
    """ERRATA A4: the flipped line is (2.9416, 1.8746) and holds a point of the wall; the bare one is 3.749 m off."""
    line, x, tf = (0.0, 1.0), (3.0, 0.5, 0.2), (-0.128, 0.0, 0.0)
    raw, raw_Hx = transform_line_to_scanner_frame(line, x, tf)
    h, Hx = normalize_line_parameters(raw, raw_Hx)
    assert h.round(4).tolist() == [2.9416, 1.8746]
    seen = se2.compose(se2.inverse(se2.compose(x, tf)), [1.0, 0.0, 0.0])[:2]
    residuals = [seen @ foot((alpha, 1.0)) - r for alpha, r in (h, (raw[0], abs(raw[1])))]
    assert residuals[0] == pytest.approx(0.0, abs=1e-14)
    assert round(residuals[1], 3) == -3.749
    assert (Hx[1] == -raw_Hx[1]).all()


def test_audit_a5_the_scanner_stays_on_its_circle():
    """ERRATA A5: turning on the spot keeps the scanner's distance from the robot, so a wall around it is as far."""
    reach = np.hypot(0.3, 0.1)
    for theta in np.linspace(-3, 3, 7):
        towards = theta + np.arctan2(0.1, 0.3)  # a wall at right angles to the lever
        h, _ = transform_line_to_scanner_frame((towards, 2.0), (0, 0, theta), (0.3, 0.1, 0.0))
        assert h[1] == pytest.approx(2.0 - reach, abs=1e-14)


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted, and the results share no memory with them."""
    line, x, tf, Hx, map_lines = read_only([0.4, 2], [1, 2, 3], [0.1, 0, 0], np.ones((2, 3)), np.ones((2, 4)))
    calls = (
        (transform_line_to_scanner_frame, (line, x, tf), [(2,), (2, 3)]),
        (normalize_line_parameters, (line, Hx), [(2,), (2, 3)]),
        (compute_predicted_measurements, (x, map_lines, tf), [(2, 4), (4, 2, 3)]),
    )
    for function, arguments, shapes in calls:
        results = function(*arguments)
        assert not any(np.shares_memory(result, argument) for result in results for argument in arguments)
        assert [(result.shape, result.dtype) for result in results] == [
            (shape, np.float64) for shape in shapes
        ]


@pytest.mark.parametrize(
    ("function", "arguments", "name"),
    [
        (transform_line_to_scanner_frame, ([1, 2, 3], [0, 0, 0], [0, 0, 0]), "line"),
        (transform_line_to_scanner_frame, ([1, np.nan], [0, 0, 0], [0, 0, 0]), "line"),
        (transform_line_to_scanner_frame, ([1, 2], [0, 0], [0, 0, 0]), "x"),
        (transform_line_to_scanner_frame, ([1, 2], [0, 0, 0], None), "tf_base_to_camera"),
        (normalize_line_parameters, ([1], [[0, 0], [0, 0]]), "h"),
        (normalize_line_parameters, ([1, 2], [[0, 0]]), "Hx"),
        (normalize_line_parameters, ([1, 2], [0, 0]), "Hx"),
        (normalize_line_parameters, ([1, 2], [[0, np.inf], [0, 0]]), "Hx"),
        (compute_predicted_measurements, ([0, 0], [[1], [2]], [0, 0, 0]), "x"),
        (compute_predicted_measurements, ([0, 0, 0], [[1, 2, 3]], [0, 0, 0]), "map_lines"),
        (compute_predicted_measurements, ([0, 0, 0], [[1], [2], [3]], [0, 0, 0]), "map_lines"),
        (compute_predicted_measurements, ([0, 0, 0], [[1], [2]], [0, 0, "a"]), "tf_base_to_camera"),
    ],
)
def test_a_wrong_argument_is_named(function, arguments, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        function(*arguments)


def test_the_oracle_sees_a_wrong_letter():
    """The test against the derivation can fail: x_cam in the row of y is off by far more than 1e-12."""
    line, x, tf = (0.4, 2.0), (1.0, 2.0, 0.3), (0.3, 0.1, 0.0)
    misprint = line[1] - (x[0] + 0.3 * np.cos(0.3) - 0.1 * np.sin(0.3)) * np.cos(0.4)
    misprint -= (x[1] + 0.3 * np.sin(0.3) + 0.3 * np.cos(0.3)) * np.sin(0.4)
    assert abs(misprint - exact(line, x, tf)[0][1]) > 1e-2
