"""Compare what a student's function returned with what is right.

Messages name the output and its entries and give the error with one digit, relative to the output's scale:
enough to know where to look, too little to work back to an input.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import CallError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from autograder.check import Case, Stage

_KINDS = {
    "b": "truth values",
    "c": "complex numbers",
    "O": "objects",
    "S": "bytes",
    "U": "text",
    "V": "records",
}
_MAX_NAMED = 4
_MAX_DIM = 9
_MAX_ITEMS = 100
_MAX_NESTING = 3
_PLAIN = (bool, int, float, complex, str, list, tuple, dict, set, np.ndarray)


def compare(function: Callable[..., Any], cases: Iterable[Case], *names: str) -> None:
    """Call the function on every case and assert that the named outputs (all, if none is named) are right.

    A fault does not end the series: the calls that follow show how regular it is.

    Raises
    ------
    AssertionError
        If a call fails or a named output is missing, of another shape or type, not finite, or off.
    """
    cases = tuple(cases)
    faults: list[str] = []
    for case in cases:
        try:
            returned = function(*case.fresh())
        except CallError as error:
            if error.final:
                raise
            faults.append(str(error))
            continue
        found = (fault(case, returned, name) for name in names or case.stage.outputs)
        if message := next(filter(None, found), ""):
            faults.append(message)
    if faults:
        count = (
            f" (wrong in {len(faults)} of {len(cases)} cases; this is the first)" if len(cases) > 1 else ""
        )
        raise AssertionError(faults[0] + count)


def right_outputs(case: Case, returned: Any) -> list[str]:
    """List the outputs of a call that are right."""
    return [name for name in case.stage.outputs if not fault(case, returned, name)]


def fault(case: Case, returned: Any, name: str) -> str:
    """Say what is wrong with one output of a call; "" if nothing is."""
    stage = case.stage
    index = stage.outputs.index(name)
    expected = np.asarray(case.expected[index], dtype=float)
    try:
        got = read(pick(stage, case.args, returned, name), name, expected.shape)
    except AssertionError as error:
        return str(error)
    if stage.aligned:
        got = _aligned(case, returned)[name]
    off = np.abs(got - expected)
    bad = off > case.tolerance[index]
    if not bad.any():
        return ""
    scale = max(float(np.abs(expected).max()), float(np.finfo(float).tiny))
    error = size(float(off[bad].max()) / scale)
    where = f": {entries(stage, name, bad)}" if bad.ndim else ""
    return f"{name} is off{where} by {error} the scale of {name}"


def _aligned(case: Case, returned: Any) -> dict[str, np.ndarray | None]:
    """Read all outputs of a call, and write them in the form that is nearest to the right one."""
    stage = case.stage
    right = {
        name: np.asarray(value, dtype=float) for name, value in zip(stage.outputs, case.expected, strict=True)
    }
    got: dict[str, np.ndarray | None] = {}
    for name, value in right.items():
        try:
            got[name] = read(pick(stage, case.args, returned, name), name, value.shape)
        except AssertionError:
            got[name] = None
    return stage.aligned(right, got)


def pick(stage: Stage, args: tuple, returned: Any, name: str) -> Any:
    """Take one output from what a call with some arguments returned.

    Raises
    ------
    AssertionError
        If the call returned nothing, or not as many values as the stage has outputs.
    """
    wanted = ", ".join(stage.outputs)
    if returned is None:
        raise AssertionError(f"the function returned None, expected {wanted}: is there a return at its end?")
    if stage.summary:
        with np.errstate(all="ignore"):  # of huge numbers; what comes out is judged, whatever it is
            return stage.each(stage.summary(args, returned))[stage.outputs.index(name)]
    if len(stage.outputs) == 1:
        return returned
    if type(returned) not in {tuple, list}:
        raise AssertionError(f"the function returned {kind(returned)}, expected a tuple {wanted}")
    if len(returned) != len(stage.outputs):
        count = str(len(returned)) if len(returned) <= _MAX_DIM else "many"
        raise AssertionError(f"the function returned {count} values, expected {len(stage.outputs)}: {wanted}")
    return returned[stage.outputs.index(name)]


def read(value: Any, name: str, shape: tuple[int, ...]) -> np.ndarray:
    """Read an output as an array of finite real numbers of the given shape.

    Raises
    ------
    AssertionError
        If it is not one; the message names the output and what is wrong with it.
    """
    if value is None:
        raise AssertionError(f"{name} is None, expected an array of shape {shape}")
    array = as_numbers(value)
    if array is None:
        raise AssertionError(f"{name} is {kind(value)}, not numbers of shape {shape}")
    if array.dtype.kind not in "fiu":
        held = _KINDS.get(array.dtype.kind, "something else")
        raise AssertionError(f"{name} holds {held}, expected real numbers")
    if array.shape != shape:
        raise AssertionError(f"{name} has {_shape(array)}, expected shape {shape}")
    array = array.astype(float)
    if not np.isfinite(array).all():
        found = "NaN" if np.isnan(array).any() else "an infinite value"
        raise AssertionError(f"{name} holds {found}")
    return array


def as_numbers(value: Any) -> np.ndarray | None:
    """Make an array of a number, an array, or lists of them; None of anything else.

    Only the exact types are looked at: an object that stayed in the sandbox cannot be asked what it is, and to a
    check it is simply not a number.
    """
    if not _numeric(value, _MAX_NESTING):
        return None
    try:
        return np.asarray(value)
    except (ValueError, TypeError, OverflowError):
        return None


def _numeric(value: Any, depth: int) -> bool:
    if type(value) in {list, tuple}:
        return depth > 0 and len(value) <= _MAX_ITEMS and all(_numeric(item, depth - 1) for item in value)
    return type(value) in {bool, int, float, complex, str, np.ndarray} or issubclass(type(value), np.generic)


def kind(value: Any) -> str:
    """Name the type of a value in plain words; a type of the student's own is not named."""
    found = next((plain for plain in _PLAIN if type(value) is plain), None)
    if found is None:
        return "an object of another type"
    return {"str": "text", "ndarray": "an array", "int": "an int"}.get(found.__name__, f"a {found.__name__}")


def _shape(array: np.ndarray) -> str:
    """Name a shape if it is one a mistake leads to; a large one could spell out an input."""
    if array.ndim <= 3 and all(length <= _MAX_DIM for length in array.shape):
        return f"shape {array.shape}"
    return "another shape"


def entries(stage: Stage, name: str, bad: np.ndarray) -> str:
    """Name the entries that are off, with the names of rows and columns where the stage has them."""
    if not bad.ndim:
        return "the value"
    where = [tuple(int(i) for i in index) for index in np.argwhere(bad)]
    if len(where) > _MAX_NAMED:
        return f"{len(where)} of {bad.size} entries"
    rows, columns = stage.rows.get(name, ()), stage.columns.get(name, ())

    def label(index: tuple[int, ...]) -> str:
        text = f"[{', '.join(map(str, index))}]"
        names = [names[i] for names, i in zip((rows, columns), index, strict=False) if i < len(names)]
        return f"{text} ({' by '.join(names)})" if names else text

    return ("entry " if len(where) == 1 else "entries ") + ", ".join(label(index) for index in where)


def size(relative: float) -> str:
    """Put a relative error into words, with one digit.

    Examples
    --------
    >>> size(0.03), size(3.2), size(25.0), size(3e-8)
    ('about 3 % of', 'about 3 times', 'more than ten times', 'about 1e-08 of')
    """
    if not relative <= 9.5:
        return "more than ten times"
    if relative >= 1.5:
        return f"about {relative:.0f} times"
    if relative >= 0.095:
        return f"about {10 * round(10 * relative):d} % of"
    if relative >= 0.00095:
        return f"about {100 * relative:.1g} % of"
    return f"about 1e{round(np.log10(max(relative, 1e-16))):03d} of"
