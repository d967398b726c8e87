import numpy as np
import pytest

from roboloc.validation import as_array, as_covariance, as_floats, as_number


@pytest.mark.parametrize(
    ("value", "got"),
    [
        (None, "NoneType"),
        ("12", "str"),
        ([1, [2, 3]], "list"),
        ([1 + 1j, 2], "list"),
        ([1, 2, 3], r"shape \(3,\)"),
        (3.0, r"shape \(\)"),
        ([[1, 2]], r"shape \(1, 2\)"),
        ([1, np.nan], r"\[ *1\. +nan\]"),
        ([1, np.inf], r"\[ *1\. +inf\]"),
        (np.full(100, np.nan), r"shape \(100,\)"),
    ],
)
def test_as_array_names_expected_and_got(value, got):
    """The message says which argument it is, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^u: expected .*, got .*{got}"):
        as_array("u", value, (2,))


def test_as_array_reads_letters_as_any_size():
    """A letter stands for any size, zero included, but not for another number of dimensions."""
    assert as_array("H", np.zeros((0, 3)), ("k", 3)).shape == (0, 3)
    with pytest.raises(ValueError, match=r"expected shape \(k, 3\), got shape \(2, 2\)"):
        as_array("H", np.zeros((2, 2)), ("k", 3))


def test_as_array_finds_one_nan_among_many():
    """Finiteness is looked at in large arrays as in small ones."""
    big = np.zeros((40, 40))
    big[7, 31] = np.nan
    with pytest.raises(ValueError, match="expected finite numbers"):
        as_array("Sigma", big, ("n", "n"))


@pytest.mark.parametrize("value", [[1, 2], (1.0, 2.0), np.array([1, 2]), np.array([1.0, 2.0], dtype=">f8")])
def test_as_floats_gives_python_floats(value):
    """Whatever holds two numbers becomes a list of two Python floats."""
    floats = as_floats("u", value, 2)
    assert floats == [1.0, 2.0]
    assert [type(number) for number in floats] == [float, float]


@pytest.mark.parametrize(
    "value", [None, [1.0], np.zeros(3), np.zeros((1, 2)), np.array([1.0, np.nan]), [np.inf, 0]]
)
def test_as_floats_refuses_other_vectors(value):
    """Another size, another shape and what is not finite raise ValueError."""
    with pytest.raises(ValueError, match=r"^u: expected .*, got "):
        as_floats("u", value, 2)


@pytest.mark.parametrize("value", [1, np.float64(1), np.array(1), np.int8(1), True])
def test_as_number_takes_any_real_scalar(value):
    """Integers, NumPy scalars and arrays of no dimension become a float."""
    assert as_number("dt", value) == 1.0
    assert type(as_number("dt", value)) is float


@pytest.mark.parametrize("value", [None, [0.1], "0.1", np.nan, float("inf"), 1j, 10**400])
def test_as_number_refuses_what_is_no_finite_real_number(value):
    """Everything else raises ValueError."""
    with pytest.raises(ValueError, match=r"^dt: expected "):
        as_number("dt", value)


def test_as_covariance_refuses_what_is_no_covariance():
    """An asymmetric matrix and one with a negative eigenvalue are refused, a singular one is not."""
    as_covariance("Sigma0", np.zeros((3, 3)), 3)
    as_covariance("R", [[1.0, 1.0], [1.0, 1.0]], 2)
    with pytest.raises(ValueError, match="R: expected a symmetric matrix"):
        as_covariance("R", [[1.0, 0.1], [0.0, 1.0]], 2)
    with pytest.raises(ValueError, match="R: expected no negative eigenvalue, got -1"):
        as_covariance("R", [[1.0, 2.0], [2.0, 1.0]], 2)
