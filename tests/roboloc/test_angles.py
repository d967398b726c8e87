import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboloc.angles import difference, wrap

law = settings(deadline=None, derandomize=True)
angle = st.floats(-1e6, 1e6)


@law
@given(angle)
def test_wrap_keeps_the_direction_and_lands_in_the_interval(a):
    """A wrapped angle is in [-pi, pi) and has the sine and cosine of the angle."""
    b = wrap(a)
    assert -np.pi <= b < np.pi
    assert abs(np.exp(1j * a) - np.exp(1j * b)) < 1e-9


@law
@given(st.floats(-np.pi, np.pi, exclude_max=True))
def test_wrap_leaves_what_is_inside_bit_by_bit(a):
    """An angle in [-pi, pi) is returned unchanged, however small."""
    assert wrap(a) == a


@pytest.mark.parametrize("edge", [np.pi, -np.pi, 3 * np.pi, -3 * np.pi])
def test_wrap_takes_the_edge_to_minus_pi(edge):
    """The open end of the interval is the closed one."""
    assert wrap(edge) == pytest.approx(-np.pi, abs=1e-15)


@pytest.mark.parametrize(
    "neighbour", [np.nextafter(np.pi, 0), np.nextafter(-np.pi, -4), np.nextafter(np.pi, 4)]
)
def test_wrap_is_half_open_at_the_neighbours_of_the_edge(neighbour):
    """The floats next to the edge stay in the half-open interval."""
    assert -np.pi <= wrap(neighbour) < np.pi


def test_wrap_keeps_the_shape_and_never_writes():
    """Arrays of any shape, read-only ones too, come back in their shape; a number comes back as a number."""
    a = np.linspace(-9, 9, 6).reshape(2, 3)
    a.flags.writeable = False
    assert wrap(a).shape == (2, 3)
    assert wrap(np.zeros((0, 2))).shape == (0, 2)
    assert type(wrap(7)) is float


def test_difference_takes_the_short_way():
    """The difference of two headings across the edge is small and has the right sign."""
    assert difference(-3.1, 3.1) == pytest.approx(2 * np.pi - 6.2)
    assert difference(3.1, -3.1) == pytest.approx(6.2 - 2 * np.pi)
    np.testing.assert_allclose(difference([0.1, 4.0], 0.0), [0.1, 4.0 - 2 * np.pi])
