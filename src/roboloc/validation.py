"""Check arguments at a public border: name, expected, got.

Both packages use these functions, so every wrong argument is reported in the same words. A shape is a
tuple whose entries are sizes or letters: ``("n", 2)`` is any number of rows of two.
"""

from math import isfinite

import numpy as np
from numpy.typing import ArrayLike

_FLOAT64 = np.dtype(np.float64)

# Up to this many entries a loop over Python floats is faster than a call of NumPy.
_FEW = 12

# Beyond this many, BLAS sets threads to a sum of squares, and waits for them where the machine is busy.
_MANY = 10_000


def as_array(name: str, value: ArrayLike, shape: tuple[int | str, ...]) -> np.ndarray:
    """Return `value` as a float64 array of the given shape with finite entries.

    Parameters
    ----------
    name : str
        What the caller calls the argument.
    value : array_like
        The argument. It is not copied where it already is a float64 array: do not write to the result.
    shape : tuple of int or str
        Expected shape; a letter stands for any size.

    Returns
    -------
    ndarray
        The same numbers.

    Raises
    ------
    ValueError
        If `value` is not numeric, has another shape, or has an entry that is not finite.

    Examples
    --------
    A pose in the plane has three numbers, not two.

    >>> as_array("xvec", [1.0, 2.0], (3,))
    Traceback (most recent call last):
        ...
    ValueError: xvec: expected shape (3,), got shape (2,)
    """
    array = value
    if type(value) is not np.ndarray or value.dtype != _FLOAT64:
        array = _to_float(name, value, shape)
    if array.shape != shape and not _fits(array.shape, shape):
        raise ValueError(f"{name}: expected shape {_text(shape)}, got shape {_text(array.shape)}")
    if not _is_finite(array):
        raise ValueError(f"{name}: expected finite numbers, got {np.array2string(array, threshold=20)}")
    return array


def _is_finite(array: np.ndarray) -> bool:
    """Say whether all entries are finite.

    The sum of squares says yes in a third of the time of `np.isfinite`; it may be infinite for finite entries,
    so its no is looked at again.
    """
    if array.size <= _FEW:
        return all(map(isfinite, array.ravel().tolist()))
    if array.size <= _MANY:
        flat = array.ravel(order="K")  # whichever index runs fastest in memory, this copies nothing
        if isfinite(np.vdot(flat, flat)):
            return True
    return bool(np.isfinite(array).all())


def as_floats(name: str, value: ArrayLike, size: int) -> list[float]:
    """Return `value`, a vector of the given size, as a list of finite Python floats.

    The scalar formulas of the plane are faster on floats than on NumPy's scalars.

    Raises
    ------
    ValueError
        If `value` is no vector of that size, or has an entry that is not finite.

    Examples
    --------
    A control is a speed and a turning rate.

    >>> as_floats("u", [1, 0], 2)
    [1.0, 0.0]
    """
    if type(value) is np.ndarray and value.dtype == _FLOAT64 and value.shape == (size,):
        numbers = value.tolist()
        if all(map(isfinite, numbers)):
            return numbers
    return as_array(name, value, (size,)).tolist()


def as_number(name: str, value: ArrayLike, *, minimum: float | None = None) -> float:
    """Return `value` as a finite Python float, not below `minimum`.

    Raises
    ------
    ValueError
        If `value` is not one finite real number, or is too small.

    Examples
    --------
    Time does not run backwards.

    >>> as_number("dt", -0.1, minimum=0.0)
    Traceback (most recent call last):
        ...
    ValueError: dt: expected a number not below 0.0, got -0.1
    """
    number = value if type(value) is float else float(as_array(name, value, ()))
    if not isfinite(number):
        raise ValueError(f"{name}: expected a finite number, got {number}")
    if minimum is not None and number < minimum:
        raise ValueError(f"{name}: expected a number not below {minimum}, got {number}")
    return number


def as_covariance(name: str, value: ArrayLike, size: int) -> np.ndarray:
    """Return `value` as a symmetric, positive semidefinite float64 array of shape (size, size).

    Rounding is forgiven: an asymmetry or a negative eigenvalue of 1e-9 of the largest entry passes. The test
    costs an eigenvalue decomposition and is meant for what is set up once, not for every step.

    Raises
    ------
    ValueError
        If `value` is no such matrix.

    Examples
    --------
    A variance is not negative.

    >>> as_covariance("R", [[0.01, 0.0], [0.0, -0.01]], 2)
    Traceback (most recent call last):
        ...
    ValueError: R: expected no negative eigenvalue, got -0.01
    """
    matrix = as_array(name, value, (size, size))
    slack = 1e-9 * np.max(np.abs(matrix), initial=0.0)
    asymmetry = np.max(np.abs(matrix - matrix.T), initial=0.0)
    if asymmetry > slack:
        raise ValueError(f"{name}: expected a symmetric matrix, got entries that differ by {asymmetry:.3g}")
    smallest = np.min(np.linalg.eigvalsh(matrix), initial=0.0)
    if smallest < -slack:
        raise ValueError(f"{name}: expected no negative eigenvalue, got {smallest:.3g}")
    return matrix


def _to_float(name: str, value: ArrayLike, shape: tuple[int | str, ...]) -> np.ndarray:
    expected = f"numbers of shape {_text(shape)}" if shape else "one number"
    try:
        array = np.asarray(value)
    except Exception as error:  # an object may fail in any way while it is converted
        raise ValueError(f"{name}: expected {expected}, got {type(value).__name__}") from error
    if array.dtype.kind not in "biuf":
        raise ValueError(f"{name}: expected {expected}, got {type(value).__name__}")
    return array.astype(np.float64)


def _fits(got: tuple[int, ...], expected: tuple[int | str, ...]) -> bool:
    if len(got) != len(expected):
        return False
    for size, e in zip(got, expected, strict=True):  # noqa: SIM110 - every call of the library comes by here
        if size != e and not isinstance(e, str):
            return False
    return True


def _text(shape: tuple[int | str, ...]) -> str:
    return "(" + ", ".join(map(str, shape)) + ("," if len(shape) == 1 else "") + ")"
