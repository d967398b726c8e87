"""What a hidden check is, and how a stage's checks are run on a student's function.

A :class:`Check` is a plain function ``(function, rng) -> None`` that raises `AssertionError` with a name, a
weight and a hint; a :class:`Stage` is the ordered list of the checks of one function. :func:`run_stage` calls
the student's function through a :class:`Recorder`, turns whatever goes wrong in it into a failed check (never
into a pass, never into an error of the grader), and returns an :class:`Outcome`, whose share of the points is
derived from the results.

Two rules keep hidden inputs hidden. A message is made from words of ours: the text of an exception, the name
of a type or the size of an array is the student's, who could write an input into it, so of these only what is
known beforehand is repeated. And an error of a check itself is not caught here: it is the grader's fault, and
the cell must be looked at.
"""

from __future__ import annotations

import copy
import functools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from autograder.secret import generator

if TYPE_CHECKING:
    from collections.abc import Callable

# The errors of autograder.remote after which a further call would only cost the same time again.
_LAST_CALLS = {
    "LimitExceeded": "used more time than a call may use",
    "ProcessDied": "ended its own process",
    "MemoryExceeded": "used more memory than a notebook may",
}
# What honest mistakes raise. A student is told no other kind: a submission could choose one by a hidden input.
ORDINARY_ERRORS = frozenset(
    [
        "AssertionError",
        "AttributeError",
        "AxisError",
        "EOFError",
        "FileNotFoundError",
        "FloatingPointError",
        "ImportError",
        "IndexError",
        "KeyError",
        "LinAlgError",
        "MemoryError",
        "ModuleNotFoundError",
        "NameError",
        "NotImplementedError",
        "OSError",
        "OverflowError",
        "RecursionError",
        "RuntimeError",
        "StopIteration",
        "SympifyError",
        "SystemExit",
        "TypeError",
        "UnboundLocalError",
        "ValueError",
        "ZeroDivisionError",
    ]
)
_MAX_LINE = 200


@dataclass(frozen=True)
class Check:
    """One thing a stage must do, its weight within the stage, and what to think about when it does not."""

    name: str
    weight: float
    run: Callable[[Callable[..., Any], np.random.Generator], None]
    hint: str = ""


@dataclass(frozen=True)
class Stage:
    """A graded function: the names of what it returns, the trusted version, the allowed error and the checks.

    A stage of one output returns it, a stage of several returns a tuple of them; so do `reference` and `tolerance`,
    which gives the allowed error of each output, as an array or a number. `rows` and `columns` name the entries of an
    output in messages, `action` is what they call a call.

    Where one thing has several right names (an angle and the angle a turn on), `aligned(right, got)` rewrites the
    outputs that came back in the name nearest to the right one; both are arrays by output, None for one that is no
    array of the right shape.

    Of samples it is not the numbers that are right or wrong: `summary(args, returned)` makes the outputs (means,
    covariances) of what a call returned, and raises `AssertionError` where that is not what it should be;
    `truth(*args)` gives the right ones, exactly.

    Of a stage on particles `many(M)` makes the arguments for M of them: public ones, for counting loops; see
    :mod:`autograder.vectorised`.
    """

    name: str
    outputs: tuple[str, ...]
    reference: Callable[..., Any]
    tolerance: Callable[..., Any]
    checks: tuple[Check, ...]
    rows: dict[str, tuple[str, ...]] = field(default_factory=dict)
    columns: dict[str, tuple[str, ...]] = field(default_factory=dict)
    action: str = "the call"
    aligned: Callable[[dict[str, Any], dict[str, Any]], dict[str, Any]] | None = None
    summary: Callable[[tuple, Any], Any] | None = None
    truth: Callable[..., Any] | None = None
    many: Callable[[int], tuple] | None = None

    @property
    def function_name(self) -> str:
        """The name a student gives the function."""
        return self.name.rpartition(".")[2]

    def each(self, result: Any) -> tuple:
        """Return the outputs one by one, from a result of one or of several."""
        return (result,) if len(self.outputs) == 1 else tuple(result)

    def right(self, args: tuple) -> tuple:
        """Return the right outputs for some arguments."""
        return self.each((self.truth or self.reference)(*args))

    def allowed(self, args: tuple) -> tuple:
        """Return the allowed errors of the outputs for some arguments."""
        return self.each(self.tolerance(*args))

    def case(self, *args: Any) -> Case:
        """Return the case of some arguments."""
        return Case(self, args, self.right(copied(args)), self.allowed(copied(args)))


def copied(args: tuple) -> tuple:
    """Return copies of arguments that share nothing with them."""
    return tuple(
        value.copy() if isinstance(value, (np.ndarray, dict)) else copy.deepcopy(value) for value in args
    )


class Case(NamedTuple):
    """Arguments of one call, what must come back, and how far off each output may be."""

    stage: Stage
    args: tuple
    expected: tuple
    tolerance: tuple

    def fresh(self) -> tuple:
        """Return writable copies of the arguments: nothing a call does to them reaches another call."""
        return copied(self.args)


class Call(NamedTuple):
    """What one call of the student's function was given, gave back, and left of its arguments."""

    args: tuple
    returned: Any
    after: tuple
    error: str


class CallError(AssertionError):
    """The student's function raised instead of returning; the message is ours.

    `final` says that calling again would only cost the same limit again.
    """

    def __init__(self, message: str, *, final: bool = False) -> None:
        super().__init__(message)
        self.final = final


class Recorder:
    """Call the student's function and remember every call, for the diagnosis that follows a failure."""

    def __init__(self, function: Callable[..., Any], action: str = "the call") -> None:
        self.function = function
        self.action = action
        self.calls: list[Call] = []
        self.stopped = ""
        self._line = 0
        self._kind = ""

    def __call__(self, *args: Any) -> Any:
        """Call the function; whatever it raises becomes a :class:`CallError` with words of ours."""
        before = copied(args)
        try:
            returned = self.function(*args)
        except (Exception, SystemExit) as error:  # noqa: BLE001
            # Everything the student's code can raise counts against it alone; autograder.remote.GraderError
            # derives from BaseException and passes.
            kind, message = describe_error(error, self.action)
            line = line_of(error)
            self._line, self._kind = self._line or line, self._kind or kind
            # A kind or a line that changes with the input could be made to tell the input: the first one is said.
            if kind != self._kind and kind not in _LAST_CALLS:
                message = f"{self.action} raised another error than the first one"
            elif line and line == self._line:
                message += f" (line {line} of its cell)"
            self.calls.append(Call(before, None, args, kind))
            self.stopped = self.stopped or _LAST_CALLS.get(kind, "")
            raise CallError(message, final=kind in _LAST_CALLS) from None
        self.calls.append(Call(before, returned, args, ""))
        return returned


@dataclass(frozen=True)
class Result:
    """How one check ended, and the calls that it made; an empty message means that it passed."""

    check: Check
    message: str = ""
    ran: bool = True
    calls: tuple[Call, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether the check ran and found nothing."""
        return self.ran and not self.message


@dataclass(frozen=True)
class Outcome:
    """The results of one stage."""

    stage: Stage
    results: tuple[Result, ...]

    @property
    def calls(self) -> tuple[Call, ...]:
        """The calls that all checks made, in order."""
        return tuple(call for result in self.results for call in result.calls)

    @property
    def share(self) -> float:
        """The part of the points that is earned, 0 to 1: passed weight over all weight."""
        total = sum(result.check.weight for result in self.results)
        return sum(result.check.weight for result in self.results if result.passed) / total

    @property
    def failed(self) -> tuple[Result, ...]:
        """The checks that did not pass, in order."""
        return tuple(result for result in self.results if not result.passed)


def describe_error(error: BaseException, action: str = "the call") -> tuple[str, str]:
    """Name an error of the student's code, without any text that the student's code could have written.

    Returns
    -------
    kind, message : str
        The type's name where it is a known one ("" otherwise), and a sentence for the report.
    """
    for name, reason in _LAST_CALLS.items():
        if any(kind.__name__ == name for kind in type(error).__mro__):
            return name, f"{action} {reason}"
    kind = str(getattr(error, "ename", type(error).__name__))
    kind = kind if kind in ORDINARY_ERRORS else ""
    if kind == "NotImplementedError":
        return kind, "the function is not written yet: it raised NotImplementedError"
    if kind == "SystemExit":
        return kind, f"{action} asked Python to exit instead of returning"
    if not kind:
        return "an error", f"{action} raised an error of a type of its own"
    return kind, f"{action} raised {kind}"


def line_of(error: BaseException) -> int:
    """Return the line of the cell at which an error came up; 0 where no believable one is known."""
    line = getattr(error, "line", 0)
    return line if type(line) is int and 0 < line <= _MAX_LINE else 0


def run_stage(stage: Stage, function: Callable[..., Any], secret: str) -> Outcome:
    """Run all checks of a stage on a function.

    After a call that used up its limits or ended its process, no further check runs: the others are failed
    with that reason, so that one endless loop costs one time limit.

    Parameters
    ----------
    stage : Stage
        What to check.
    function : callable
        The student's function, or the proxy that stands for it.
    secret : str
        The course's secret; with the names of stage and check it fixes the hidden inputs.

    Returns
    -------
    Outcome
        One result for each check, in order.
    """
    recorder = Recorder(function, stage.action)
    results: list[Result] = []
    for check in stage.checks:
        if recorder.stopped:
            reason = f"not run, because an earlier call {recorder.stopped}"
            results.append(Result(check, reason, ran=False))
            continue
        before = len(recorder.calls)
        try:
            check.run(recorder, generator(secret, stage.name, check.name))
        except AssertionError as error:
            message = str(error) or "the check failed"
        else:
            message = ""
        results.append(Result(check, message, calls=tuple(recorder.calls[before:])))
    return Outcome(stage, tuple(results))


def remembered(
    make: Callable[[np.random.Generator], list[Case]],
) -> Callable[[np.random.Generator], tuple[Case, ...]]:
    """Keep the cases that belong to a seed: a whole class has the same ones, computed once a process."""
    kept: dict[int, tuple[Case, ...]] = {}

    @functools.wraps(make)
    def cases(rng: np.random.Generator) -> tuple[Case, ...]:
        seed = rng.bit_generator.seed_seq.entropy
        if seed not in kept:
            kept[seed] = tuple(make(rng))
        return kept[seed]

    return cases
