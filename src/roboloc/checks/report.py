"""Run checks on a function that may do anything, and report in plain words.

A check is a name and a function of one argument: a :class:`Caller`, which calls the student's function on
copies and insists on numbers of the right shape. A check that finds a fault raises :class:`Wrong`. When the
first check of a list fails, nothing usable came back and the others are not tried.
"""

import html
import io
import sys
import traceback
import warnings
from collections.abc import Callable
from contextlib import redirect_stdout
from copy import deepcopy
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np


class Wrong(Exception):  # noqa: N818 - it is a verdict, not an error of ours
    """What a check found, in words for the student."""


class Check(NamedTuple):
    """A name, for what is right when it passes, and a function that raises `Wrong` otherwise."""

    name: str
    function: Callable


@dataclass(frozen=True)
class Item:
    """One line of a report: `passed` is None for what was not tried."""

    name: str
    passed: bool | None
    message: str = ""


@dataclass
class Report:
    """What is right about a stage and what is not; true as a condition when all of it is right.

    Parameters
    ----------
    stage : str
        Name of the stage.
    items : tuple of Item
        What was looked at, in order.
    """

    stage: str
    items: tuple[Item, ...]
    _shown_in: int | None = field(default=None, repr=False, compare=False)

    def __bool__(self) -> bool:
        return all(item.passed for item in self.items)

    @property
    def summary(self) -> str:
        """One line: how many items are right."""
        return f"{self.stage}: {sum(item.passed is True for item in self.items)} of {len(self.items)} right"

    def __repr__(self) -> str:
        return f"<Report {self.summary}>"

    def __str__(self) -> str:
        lines = [self.summary]
        for item in self.items:
            lines.append(f"  {'[' + _WORDS[item.passed] + ']':9} {item.name}")
            lines += [f"{'':12}{line}" for line in item.message.splitlines()]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        rows = []
        for item in self.items:
            message = "<br>".join(html.escape(line) for line in item.message.splitlines())
            message = f"<br>{message}" if message else ""
            rows.append(
                f'<tr><td style="text-align:left;vertical-align:top;white-space:nowrap">'
                f"{_SIGNS[item.passed]} {_WORDS[item.passed]}</td>"
                f'<td style="text-align:left"><strong>{html.escape(item.name)}</strong>{message}</td></tr>'
            )
        return f"<p>{html.escape(self.summary)}</p><table>{''.join(rows)}</table>"

    def _ipython_display_(self) -> None:
        """Display the report, unless the cell that is running has displayed it already."""
        if self._shown_in is not None and self._shown_in == _shell().execution_count:
            self._shown_in = None
        else:
            _display(self)


# A call that takes more characters than this is not written out.
_LONG = 240

_WORDS = {True: "right", False: "not yet", None: "skipped"}
_SIGNS = {True: "&#10003;", False: "&#10007;", None: "&#8211;"}


def show(report: Report) -> None:
    """Display a report in Jupyter, or write it to standard output elsewhere."""
    shell = _shell()
    if shell is None:
        sys.stdout.write(f"{report}\n")
    else:
        _display(report)
        report._shown_in = shell.execution_count  # noqa: SLF001 - module and class are one


def run(stage: str, function: Callable, checks: tuple[Check, ...]) -> Report:
    """Make all checks of a stage on a function and return the report."""
    items = []
    for check in checks:
        if items and not items[0].passed:
            items.append(Item(check.name, None))
            continue
        try:
            check.function(Caller(stage, function))
        except Wrong as fault:
            items.append(Item(check.name, passed=False, message=str(fault)))
        else:
            items.append(Item(check.name, passed=True))
    return Report(stage, tuple(items))


class Caller:
    """Call a student's function on copies of the arguments and return float arrays of the right shape.

    Parameters
    ----------
    stage : str
        Name of the stage, for messages.
    function : callable
        The student's function.

    Attributes
    ----------
    written_to : list of int
        Positions of the arguments that the last call changed.
    """

    def __init__(self, stage: str, function: Callable) -> None:
        self.stage = stage
        self.function = function
        self.written_to: list[int] = []

    def __call__(self, arguments: tuple, results: dict[str, tuple[int, ...]]) -> tuple[np.ndarray, ...]:
        """Return what the function gives for `arguments`: one array for each name and shape in `results`.

        Raises
        ------
        Wrong
            If it raises, or returns anything else.
        """

        def call() -> str:
            text_of_call = f"{self.stage}({', '.join(map(text, arguments))})"
            long = len(text_of_call) > _LONG
            return f"{self.stage}, called on arrays of many digits," if long else text_of_call

        given = deepcopy(arguments)
        try:
            with warnings.catch_warnings(), redirect_stdout(io.StringIO()):
                warnings.simplefilter("ignore")
                values = self.function(*given)
        except NotImplementedError:
            raise Wrong("The function is not written yet: it raises NotImplementedError.") from None
        except (Exception, SystemExit) as error:  # noqa: BLE001 - a student's function may raise anything
            raise Wrong(f"{call()}\nraises {type(error).__name__}: {error}{_line(error)}") from None
        self.written_to = [
            i for i, (a, b) in enumerate(zip(arguments, given, strict=True)) if not _same(a, b)
        ]
        names = ", ".join(results)
        if values is None:
            raise Wrong(f"The function returns None. Does it end with: return {names}?")
        if len(results) == 1:
            values = (values,)
        elif not isinstance(values, tuple | list) or len(values) != len(results):
            got = f"{len(values)} values" if isinstance(values, tuple | list) else type(values).__name__
            raise Wrong(f"Expected {len(results)} values, {names}, got {got}.")
        pairs = zip(results.items(), values, strict=True)
        return tuple(_numbers(name, shape, value, call) for (name, shape), value in pairs)


def text(value: Any) -> str:
    """Return a number or an array as short text."""
    array = np.asarray(value)
    if array.dtype.kind not in "biuf":
        return str(value)
    numbers = {"all": lambda number: f"{number + 0.0:.6g}"}
    return np.array2string(array, separator=", ", formatter=numbers, threshold=50).replace("\n", "")


def _numbers(name: str, shape: tuple[int, ...], value: Any, call: Callable[[], str]) -> np.ndarray:
    try:
        array = np.asarray(value)
    except Exception:  # noqa: BLE001 - a list of unequal lists, or an object that refuses
        raise Wrong(f"{name} is not an array of numbers: it is a {type(value).__name__}.") from None
    if array.dtype.kind not in "iuf":
        kind = "None" if value is None else f"a {type(value).__name__} of dtype {array.dtype}"
        raise Wrong(f"{name} should hold real numbers, but it is {kind}.")
    if array.shape != shape:
        raise Wrong(f"{name} should have shape {shape}, but it has shape {array.shape}.")
    if not np.isfinite(array).all():
        raise Wrong(f"{call()}\nreturns a number that is not finite in {name}: {text(array)}")
    return array.astype(np.float64)


def _same(a: Any, b: Any) -> bool:
    nan = isinstance(a, np.ndarray) and a.dtype.kind in "fc" and isinstance(b, np.ndarray)
    return np.array_equal(a, b, equal_nan=nan) and np.shape(a) == np.shape(b)


def _line(error: BaseException) -> str:
    frames = traceback.extract_tb(error.__traceback__)[1:]
    return f" (line {frames[0].lineno} of your cell: {frames[0].line})" if frames and frames[0].line else ""


def _shell() -> Any:
    """Return the IPython shell that this runs in, or None; IPython is not loaded for the question."""
    ipython = sys.modules.get("IPython")
    return ipython.get_ipython() if ipython is not None else None


def _display(report: Report) -> None:
    from IPython.display import display  # noqa: PLC0415 - only where IPython is at work already

    display({"text/plain": str(report), "text/html": report._repr_html_()}, raw=True)
