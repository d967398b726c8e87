"""Numbers out of a SymPy expression."""

from __future__ import annotations

from typing import Any

import numpy as np

DIGITS = 30


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
        If it is not something SymPy can evaluate.

    Examples
    --------
    A wheel of radius r that turns by phi rolls r phi:

    >>> import sympy as sp
    >>> r, phi = sp.symbols("r phi")
    >>> evaluate(r * phi, {"r": 0.5, "phi": 2.0})
    1.0
    """
    import sympy  # noqa: PLC0415  (a sandbox for a course without SymPy must be able to load this module)

    expression = sympy.sympify(expression)
    if isinstance(expression, (sympy.MatrixBase, sympy.NDimArray, list, tuple, sympy.Tuple)):
        array = np.array(
            expression.tolist() if hasattr(expression, "tolist") else list(expression), dtype=object
        )
        numbers = np.array([_number(entry, values) for entry in array.ravel()])
        return numbers.reshape(array.shape)
    return _number(expression, values)


def _number(entry: Any, values: dict[str, float]) -> float | complex:
    import sympy  # noqa: PLC0415

    entry = sympy.sympify(entry)
    missing = sorted({str(symbol) for symbol in entry.free_symbols} - set(values))
    if missing:
        raise ValueError(f"the expression contains {', '.join(missing)}, which is not one of its arguments")
    point = {symbol: values[str(symbol)] for symbol in entry.free_symbols}
    try:
        number = complex(entry.evalf(DIGITS, subs=point))
    except ZeroDivisionError:
        number = complex("nan")
    if not np.isfinite(number):
        raise ValueError("the expression has no finite value at the point")
    return number.real if number.imag == 0 else number
