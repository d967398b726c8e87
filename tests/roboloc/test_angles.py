import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import read_only
from scipy import stats

from roboloc.angles import circular_mean, circular_std, difference, resultant_length, wrap

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


@law
@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.floats(0.01, 3.0))
def test_circular_statistics_are_those_of_scipy(seed, N, spread):
    """Direction, resultant length and deviation of unweighted angles anywhere on the circle are scipy's."""
    rng = np.random.default_rng(seed)
    (a,) = read_only(rng.uniform(-10, 10) + spread * rng.normal(size=N))
    R = resultant_length(a)
    assert pytest.approx(1 - stats.circvar(a), abs=1e-12) == R
    if R > 1e-3:
        assert abs(difference(circular_mean(a), stats.circmean(a))) < 1e-12 / R
        # Where R is nearly 1 scipy's deviation has lost digits, ours has not.
        assert circular_std(a) == pytest.approx(stats.circstd(a), rel=1e-6, abs=1e-7)


@law
@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.floats(1e-300, 1e300))
def test_a_weight_counts_as_copies(seed, N, scale):
    """Whole weights in any scale give what that many copies of each angle give."""
    rng = np.random.default_rng(seed)
    a, copies = rng.normal(2.5, 0.7, size=N), rng.integers(0, 4, size=N)
    copies[0] += 1
    ws = read_only(scale * copies)[0]
    repeated = np.repeat(a, copies)
    assert resultant_length(a, ws) == pytest.approx(resultant_length(repeated), abs=1e-12)
    assert abs(difference(circular_mean(a, ws), circular_mean(repeated))) < 1e-10
    assert circular_std(a, ws) == pytest.approx(circular_std(repeated), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("size", [1e-3, 1e-7, 1e-11])
def test_a_sharp_cloud_has_the_ordinary_deviation(size):
    """Of angles close together about any direction the deviation is the ordinary one, however close they are."""
    offsets = size * np.array([-1.5, -0.5, 0.0, 0.25, 1.75])
    assert circular_std(offsets) == pytest.approx(offsets.std(), rel=size**2 + 1e-12)
    assert circular_std(np.pi + offsets) == pytest.approx(offsets.std(), rel=size**2 + 1e-15 / size)


def test_a_wrapped_normal_has_its_deviation():
    """100,000 angles of a wrapped normal distribution of 0.8 rad spread by 0.8 rad; fixed seed, 5 sigma."""
    sigma, N = 0.8, 100_000
    a = wrap(3.0 + sigma * np.random.default_rng(1).normal(size=N))
    # The variance of R is (1 - exp(-s^2))^2 / (2 N); the delta method divides its root by s R for the deviation.
    error = np.exp(sigma**2 / 2) * (1 - np.exp(-(sigma**2))) / (2**0.5 * sigma * N**0.5)
    assert circular_std(a) == pytest.approx(sigma, abs=5 * error)
    assert resultant_length(a) == pytest.approx(np.exp(-(sigma**2) / 2), abs=5 * error)


def test_angles_that_cancel_have_no_mean():
    """Opposite directions, or thirds of a turn: the resultant is 0, the deviation infinite, a mean refused."""
    for a in ([0.3, 0.3 + np.pi], 1.0 + np.array([0, 2, 4]) * np.pi / 3, [-np.pi / 2, np.pi / 2]):
        assert resultant_length(a) == 0
        assert circular_std(a) == np.inf
        with pytest.raises(ValueError, match=r"^angles: expected angles with a mean direction, got "):
            circular_mean(a)


def test_one_angle_is_its_mean_on_the_circle():
    """A single angle has no spread, and its mean is itself in [-pi, pi), the edge included."""
    assert circular_mean([np.pi]) == -np.pi
    assert circular_mean([0.25, 1.0], [3.0, 0.0]) == pytest.approx(0.25)
    assert (resultant_length([7.0]), circular_std([7.0])) == (1.0, pytest.approx(0.0, abs=1e-15))


@pytest.mark.parametrize("function", [circular_mean, resultant_length, circular_std])
@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (([],), "angles"),
        ((0.5,), "angles"),
        (([np.nan],), "angles"),
        (([0.0, 1.0], [1.0]), "weights"),
        (([0.0, 1.0], [1.0, -1.0]), "weights"),
        (([0.0, 1.0], [0.0, 0.0]), "weights"),
        (([0.0], ["x"]), "weights"),
    ],
)
def test_wrong_angles_and_weights_are_named(function, arguments, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        function(*arguments)
