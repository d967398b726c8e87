import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import read_only
from scipy.linalg import expm

from roboloc import se2
from roboloc.angles import difference, wrap

law = settings(deadline=None, derandomize=True)
length = st.floats(-10, 10)
pose = st.tuples(length, length, st.floats(-7, 7))
small = st.sampled_from([0.0, 1e-300, -1e-300, 1e-15, -1e-12, 1e-8, -1e-8, 1e-4, -1e-3])
twist = st.tuples(length, length, st.one_of(st.floats(-3.1, 3.1), small))


def matrix(a):
    """Write a pose as a homogeneous matrix."""
    c, s = np.cos(a[2]), np.sin(a[2])
    return np.array([[c, -s, a[0]], [s, c, a[1]], [0, 0, 1]])


def hat(t):
    """Write a twist as an element of the Lie algebra."""
    return np.array([[0, -t[2], t[0]], [t[2], 0, t[1]], [0, 0, 0]])


@law
@given(pose, pose)
def test_compose_multiplies_matrices(a, b):
    """The composition of poses is the product of their matrices, and headings add."""
    c = se2.compose(a, b)
    np.testing.assert_allclose(matrix(c), matrix(a) @ matrix(b), atol=1e-12)
    assert c[2] == a[2] + b[2]


@law
@given(pose, pose, pose)
def test_group_laws(a, b, c):
    """Composition is associative, zero is its identity, and the inverse undoes from both sides."""
    left, right = se2.compose(se2.compose(a, b), c), se2.compose(a, se2.compose(b, c))
    np.testing.assert_allclose(left, right, atol=1e-12)
    np.testing.assert_array_equal(se2.compose(a, np.zeros(3)), a)
    np.testing.assert_array_equal(se2.compose(np.zeros(3), a), a)
    np.testing.assert_allclose(se2.compose(a, se2.inverse(a)), 0, atol=1e-12)
    np.testing.assert_allclose(se2.compose(se2.inverse(a), a), 0, atol=1e-12)


@law
@given(twist)
def test_exp_is_the_matrix_exponential(t):
    """The exponential agrees with the matrix exponential of the algebra, at and near omega = 0 too."""
    np.testing.assert_allclose(matrix(se2.exp(t)), expm(hat(t)), atol=1e-12)


@law
@given(twist)
def test_log_undoes_exp(t):
    """Within half a turn the twist is recovered."""
    np.testing.assert_allclose(se2.log(se2.exp(t)), t, atol=1e-12)


@law
@given(pose)
def test_exp_undoes_log(a):
    """The twist of a pose leads to the pose, the heading up to whole turns."""
    b = se2.exp(se2.log(a))
    np.testing.assert_allclose(b[:2], a[:2], atol=1e-12)
    assert abs(difference(b[2], a[2])) < 1e-12


@pytest.mark.parametrize("theta", [np.pi, -np.pi, np.nextafter(np.pi, 0)])
def test_log_at_the_half_turn(theta):
    """At the edge of the principal value log is finite and still inverted by exp."""
    t = se2.log([1.0, 2.0, theta])
    assert -np.pi <= t[2] < np.pi
    np.testing.assert_allclose(se2.exp(t), [1.0, 2.0, wrap(theta)], atol=1e-14)


@law
@given(pose, twist)
def test_adjoint_carries_a_twist_through_the_exponential(a, t):
    """It holds exp(Ad_a t) = a exp(t) a^-1, which also settles the tangent order v1, v2, omega."""
    left = se2.exp(se2.adjoint(a) @ t)
    right = se2.compose(se2.compose(a, se2.exp(t)), se2.inverse(a))
    np.testing.assert_allclose(left, right, atol=1e-9)


@law
@given(pose, pose)
def test_adjoint_is_a_homomorphism(a, b):
    """The adjoint of a composition is the product of the adjoints."""
    product = se2.adjoint(a) @ se2.adjoint(b)
    np.testing.assert_allclose(se2.adjoint(se2.compose(a, b)), product, atol=1e-11)


@pytest.mark.parametrize("size", [1.0, 0.3, 1e-3, 1e-6, 1e-9, 1e-12, 1e-16])
@pytest.mark.parametrize("sign", [1, -1])
def test_exp_and_log_lose_no_digits_near_zero(size, sign):
    """Against 60 digits of mpmath both maps are right to 1e-15 norm-wise for every small omega."""
    t = np.array([0.7, -0.4, sign * size])
    with mp.workdps(60):
        v1, v2, omega = (mp.mpf(float(value)) for value in t)
        s, c = mp.sin(omega) / omega, (1 - mp.cos(omega)) / omega
        exact = np.array([float(s * v1 - c * v2), float(c * v1 + s * v2)])
        determinant = s * s + c * c
        back = np.array([float((s * v1 + c * v2) / determinant), float((s * v2 - c * v1) / determinant)])
    assert np.linalg.norm(se2.exp(t)[:2] - exact) < 1e-15 * np.linalg.norm(exact)
    assert np.linalg.norm(se2.log(t)[:2] - back) < 1e-15 * np.linalg.norm(back)


@pytest.mark.parametrize("function", [se2.inverse, se2.exp, se2.log, se2.adjoint])
@pytest.mark.parametrize("bad", [None, [1.0, 2.0], [1.0, 2.0, np.nan], "abc", [[1.0, 2.0, 3.0]]])
def test_a_wrong_argument_is_named(function, bad):
    """What is not three finite numbers raises ValueError with expected and got."""
    with pytest.raises(ValueError, match=r"(a|twist): expected .*, got "):
        function(bad)


def test_read_only_arguments_are_accepted():
    """No function writes to its arguments."""
    a, b = read_only([1, 2, 3], [4, 5, 6])
    se2.compose(a, b)
    for function in (se2.inverse, se2.exp, se2.log, se2.adjoint):
        function(a)
