"""Numbers out of a SymPy expression.

An expression is asked for at several points, so it is made a function of mpmath's numbers, once. Where that fails, or
its value is not finite, SymPy's own `evalf` has the last word: it takes longer, and more digits where they cancel.
"""

from __future__ import annotations

import functools
from numbers import Number
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

DIGITS = 30
SPARE = 15  # more digits in mpmath, which unlike `evalf` does not add digits where they cancel


def evaluate(expression: Any, values: dict[str, float]) -> Any:
    """Evaluate a SymPy expression or matrix at a point.

    Parameters
    ----------
    expression : sympy.Basic, sympy matrix, list, or number
        What to evaluate.
    values : dict of str to float
        A number for each symbol, by the symbol's name: two symbols of one name with other assumptions are one.

    Returns
    -------
    float, complex or numpy.ndarray
        The value; a matrix or a nested list gives an array of its shape. Real numbers where all entries are real.

    Raises
    ------
    ValueError
        If a symbol has no number, or an entry has no finite value there.
    TypeError
        If it is not something SymPy can evaluate; text is not, whatever it says.

    Examples
    --------
    A wheel of radius r that turns by phi rolls r phi:

    >>> import sympy as sp
    >>> r, phi = sp.symbols("r phi")
    >>> evaluate(r * phi, {"r": 0.5, "phi": 2.0})
    1.0
    """
    import sympy  # noqa: PLC0415  (a sandbox for a course without SymPy must be able to load this module)

    _refuse_text(expression)
    expression = sympy.sympify(expression)
    shape, entries = (), [expression]
    single = not isinstance(expression, (sympy.MatrixBase, sympy.NDimArray, list, tuple, sympy.Tuple))
    if not single:
        array = np.array(
            expression.tolist() if hasattr(expression, "tolist") else list(expression), dtype=object
        )
        shape, entries = array.shape, [sympy.sympify(entry) for entry in array.ravel()]
    missing = sorted({str(symbol) for entry in entries for symbol in entry.free_symbols} - set(values))
    if missing:
        raise ValueError(f"the expression contains {', '.join(missing)}, which is not one of its arguments")
    numbers = _quickly(tuple(entries), values)
    if numbers is None:
        numbers = [_number(entry, values) for entry in entries]
    return numbers[0] if single else np.array(numbers).reshape(shape)


def _refuse_text(value: Any) -> None:
    """Refuse what SymPy would read as text: it evaluates text as Python, and this runs in the grader's process, too."""
    import sympy  # noqa: PLC0415

    if isinstance(value, (list, tuple)):
        for entry in value:
            _refuse_text(entry)
    elif isinstance(value, np.ndarray) and value.dtype.kind == "O":
        _refuse_text(value.ravel().tolist())
    elif not (
        isinstance(value, (sympy.Basic, sympy.MatrixBase, sympy.NDimArray, Number))
        or (isinstance(value, (np.ndarray, np.generic)) and value.dtype.kind in "biufc")
    ):
        raise TypeError(f"expected an expression of SymPy, got {type(value).__name__}")


def _quickly(entries: tuple, values: dict[str, float]) -> list[float | complex] | None:
    """Return the entries' values, or None where they cannot be had as finite numbers."""
    import mpmath  # noqa: PLC0415

    try:
        names, function = _function(entries)
        with mpmath.workdps(DIGITS + SPARE):
            found = [complex(entry) for entry in function(*(mpmath.mpf(values[name]) for name in names))]
    except Exception:  # noqa: BLE001  (whatever a printer or a function of a submission's raises: `evalf` says more)
        return None
    if not np.isfinite(found).all():
        return None
    return [number.real if number.imag == 0 else number for number in found]


@functools.lru_cache(maxsize=64)
def _function(entries: tuple) -> tuple[list[str], Callable[..., list]]:
    """Return names of symbols, and a function of their values."""
    import sympy  # noqa: PLC0415

    symbols = sorted(set().union(*(entry.free_symbols for entry in entries)), key=str)
    function = sympy.lambdify(
        symbols, list(entries), modules="mpmath", dummify=True, cse=True, docstring_limit=0
    )
    return [str(symbol) for symbol in symbols], function


def _number(entry: Any, values: dict[str, float]) -> float | complex:
    """Return one entry's value as `evalf` finds it."""
    point = {symbol: values[str(symbol)] for symbol in entry.free_symbols}
    try:
        number = complex(entry.evalf(DIGITS, subs=point))
    except ZeroDivisionError:
        number = complex("nan")
    if not np.isfinite(number):
        raise ValueError("the expression has no finite value at the point")
    return number.real if number.imag == 0 else number
