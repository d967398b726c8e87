"""What an assistant needs to answer an appeal: of each check its points and calls, of a failed one the call at fault.

It shows what is hidden, the inputs and the right results, so it is made only where it is asked for, and never goes into
feedback: :class:`autograder.feedback.LeakFreeFeedback` takes it out.
"""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.diagnose import beside, is_off

if TYPE_CHECKING:
    from autograder.check import Call, Outcome, Result, Stage

_MOST = 600  # characters of a value
_ARRAYS = {"threshold": 60, "edgeitems": 4, "separator": ", ", "formatter": {"float_kind": "{:.6g}".format}}


def details(outcome: Outcome, result: Result, points: float) -> list[str]:
    """Say of a check what it is worth and how often it called; of a failed one, which call is at fault.

    Parameters
    ----------
    outcome : Outcome
        What the result is part of.
    result : Result
        Of one check.
    points : float
        What all checks are worth together.

    Returns
    -------
    list of str
        Lines.
    """
    whole = sum(one.check.weight for one in outcome.results)
    lines = [f"{_count(points * result.check.weight / whole, 'point')}, {_count(len(result.calls), 'call')}"]
    if result.passed or not result.ran:
        return lines
    for number, call in enumerate(result.calls, 1):
        if found := _at_fault(outcome.stage, call):
            where = f"Call {number} of {len(result.calls)}, the first at fault:"
            return [*lines, where, *(f"  {line}" for line in found)]
    return [*lines, "No single call is at fault: it is how they differ, or what they leave undone."]


def _count(number: float, what: str) -> str:
    return f"{number:.4g} {what}{'' if number == 1 else 's'}"


def _at_fault(stage: Stage, call: Call) -> list[str]:
    """Describe a call that raised, returned something that is off, or changed an argument; nothing for any other."""
    names = _arguments(stage, call)
    given = [f"{name} = {_text(value)}" for name, value in zip(names, call.args, strict=True)]
    if call.error:
        return [*given, f"raised {call.error}"]
    with np.errstate(all="ignore"):
        seen = beside(stage, call)
    off = [name for name in stage.outputs if is_off(seen, seen.got, name)]
    lines = []
    for name in off:
        got = seen.got.values[name]
        lines += [f"{name} expected {_text(seen.right[name])}"]
        lines += [f"{name} got      {_text(got if got is not None else call.returned)}"]
    changed = [name for name, was in zip(names, seen.got.changed, strict=True) if was]
    lines += [f"changed its argument {', '.join(changed)}"] if changed else []
    return [*given, *lines] if lines else []


def _arguments(stage: Stage, call: Call) -> list[str]:
    """Return the names of a call's arguments."""
    names = list(inspect.signature(stage.reference).parameters)
    return [*names, *(f"argument {n}" for n in range(len(names) + 1, len(call.args) + 1))][: len(call.args)]


def _text(value: Any) -> str:
    """Write a value on one line."""
    if isinstance(value, np.random.Generator):
        return "a generator"
    text = np.array2string(value, **_ARRAYS) if isinstance(value, np.ndarray) else repr(value)
    text = " ".join(text.split())
    return text if len(text) <= _MOST else f"{text[:_MOST]} ..."
