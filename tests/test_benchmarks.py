"""What the benchmarks share."""

import pytest

from benchmarks.harness import fitted_exponent


@pytest.mark.parametrize("exponent", [0.0, 1.0, 2.5, -1.0])
def test_the_exponent_of_a_power_is_found(exponent):
    """Times that are a power of the sizes, whatever the unit, give that power."""
    sizes = [10, 100, 250, 4000]
    assert fitted_exponent(sizes, [3e-6 * size**exponent for size in sizes]) == pytest.approx(exponent)


def test_the_exponent_is_that_of_least_squares():
    """One of three times wrong by a factor at the middle size moves the line, not its slope; at the end it turns it."""
    assert fitted_exponent([1, 10, 100], [1, 5 * 10, 100]) == pytest.approx(1.0)
    assert fitted_exponent([1, 10, 100], [1, 10, 1000]) == pytest.approx(1.5)
