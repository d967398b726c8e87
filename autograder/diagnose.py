"""Say what a mistake is: by comparison with known wrong versions, else by what :mod:`autograder.observe` sees.

Works on the calls that the checks have made already; the student's function is not called again. Each output
is looked at on its own, so that two mistakes in two outputs are both found. A class has the same hidden inputs, so
what the right and the wrong versions make of them is worked out once in a process.
"""

from __future__ import annotations

import hashlib
import pickle
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import copied
from autograder.compare import as_numbers, pick
from autograder.observe import observe

if TYPE_CHECKING:
    from collections.abc import Callable

    from autograder.check import Call, Outcome, Stage
    from autograder.misconceptions.model import Misconception

ARGUMENTS = "arguments"
_FEWEST_CALLS = 3
# Results of one call each, a few hundred bytes to some kilobytes; a class needs some thousand.
_MOST_KEPT = 10_000
_kept: dict[tuple, Any] = {}


@dataclass(frozen=True)
class Diagnosis:
    """What is wrong with some outputs: a known mistake with its explanation, or a plain observation."""

    title: str
    explanation: str
    hint: str
    outputs: tuple[str, ...]
    known: bool = True


@dataclass(frozen=True)
class Numbers:
    """One call as numbers: each output's array, None where it is not one, and which arguments changed."""

    values: dict[str, np.ndarray | None]
    changed: tuple[bool, ...]


@dataclass(frozen=True)
class Seen:
    """One call of the student's function beside the right result."""

    args: tuple
    key: bytes
    right: dict[str, np.ndarray]
    tolerance: dict[str, np.ndarray]
    loosest: dict[str, float]
    got: Numbers


def diagnose(outcome: Outcome, misconceptions: tuple[Misconception, ...]) -> tuple[Diagnosis, ...]:
    """Explain a failed stage.

    Parameters
    ----------
    outcome : Outcome
        The results of the stage and its calls.
    misconceptions : tuple of Misconception
        The wrong versions of this stage.

    Returns
    -------
    tuple of Diagnosis
        Known mistakes first, then observations on outputs that no known mistake explains. Empty if all passed
        or too little was returned to say anything.
    """
    if not outcome.failed:
        return ()
    stage = outcome.stage
    with np.errstate(all="ignore"):
        seen = [beside(stage, call) for call in outcome.calls if call.error in {"", "ZeroDivisionError"}]
        wrong = {name for name in stage.outputs if any(is_off(item, item.got, name) for item in seen)}
        if any(any(item.got.changed) for item in seen):
            wrong.add(ARGUMENTS)
        if len(seen) < _FEWEST_CALLS or not wrong:
            return ()
        found = _known(stage, seen, wrong, misconceptions)
        explained = {name for item in found for name in item.outputs}
        left = [name for name in stage.outputs if name in wrong - explained]
        observed = (_observation(name, observe(stage, seen, name)) for name in left)
        return (*found, *filter(None, observed))


def _known(
    stage: Stage, seen: list[Seen], wrong: set[str], misconceptions: tuple[Misconception, ...]
) -> list[Diagnosis]:
    """Choose the fewest wrong versions that account for the outputs that are wrong.

    A version that is wrong in an output where the student is right is not the mistake.
    """
    order = (*stage.outputs, ARGUMENTS)
    matches: list[tuple[Misconception, set[str]]] = []
    for item in misconceptions:
        matched, faulty = set(wrong), set()
        for one in seen:
            version = _once(
                (stage.reference, stage.truth, item.function, one.key),
                lambda item=item, one=one: _run(stage, item, one),
            )
            matched = {name for name in matched if _matches(item, one, version, name)}
            if not matched:
                break
            faulty |= {name for name in order if _deviates(one, version, name)}
        if faulty <= wrong:
            matches.append((item, matched & faulty))
    found: list[Diagnosis] = []
    while matches and wrong:
        item, matched = max(matches, key=lambda entry: len(entry[1] & wrong))
        if not matched & wrong:
            break
        outputs = tuple(name for name in order if name in matched & wrong)
        found.append(Diagnosis(item.name, item.explanation, item.hint, outputs))
        wrong = wrong - matched
    return sorted(found, key=lambda entry: order.index(entry.outputs[0]))


def _matches(item: Misconception, one: Seen, version: Numbers, name: str) -> bool:
    """Whether an output is the wrong version's, up to the error that is allowed anyway."""
    if name == ARGUMENTS:
        return one.got.changed == version.changed
    if is_off(one, version, name) and not is_off(one, one.got, name):
        return False
    return not item.determined(*one.args) or _equal(one, version, name)


def _deviates(one: Seen, version: Numbers, name: str) -> bool:
    return any(version.changed) if name == ARGUMENTS else is_off(one, version, name)


def is_off(one: Seen, numbers: Numbers, name: str) -> bool:
    """Return whether an output of a call is not the right one."""
    value, right = numbers.values[name], one.right[name]
    if value is None or value.shape != right.shape:
        return True
    return not bool((np.abs(value - right) <= one.tolerance[name]).all())


def _equal(one: Seen, version: Numbers, name: str) -> bool:
    got, wanted = one.got.values[name], version.values[name]
    if got is None or wanted is None or got.shape != wanted.shape:
        return False
    if not wanted.size:
        return True
    if not np.isfinite(wanted).all():
        return not np.isfinite(got).all()  # where one program gets NaN, another gets infinity or an error
    scale = np.abs(wanted).max() / max(float(np.abs(one.right[name]).max(initial=0.0)), np.finfo(float).tiny)
    return bool((np.abs(got - wanted) <= 4 * one.loosest[name] * (1 + scale)).all())


def _once(key: tuple, make: Callable[[], Any]) -> Any:
    """Return what belongs to a key, made the first time."""
    if key not in _kept:
        if len(_kept) >= _MOST_KEPT:
            del _kept[next(iter(_kept))]
        _kept[key] = make()
    return _kept[key]


def _wanted(
    stage: Stage, args: tuple
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray], dict[str, float]]:
    """Return the right outputs of a call, the error that each entry may have, and the largest of each output."""
    right = {name: np.asarray(value, dtype=float) for name, value in _named(stage, stage.right(copied(args)))}
    allowed = dict(_named(stage, stage.allowed(copied(args))))
    tolerance = {name: np.broadcast_to(value, right[name].shape) for name, value in allowed.items()}
    return right, tolerance, {name: float(np.max(value, initial=0.0)) for name, value in allowed.items()}


def beside(stage: Stage, call: Call) -> Seen:
    """Return a call beside the right result."""
    key = hashlib.blake2b(pickle.dumps(call.args)).digest()
    right, tolerance, loosest = _once(
        (stage.reference, stage.truth, stage.tolerance, key), lambda: _wanted(stage, call.args)
    )
    if call.error:  # a division by zero in plain Python is what NaN is in numpy
        got = Numbers({name: np.full_like(value, np.nan) for name, value in right.items()}, _changed(call))
    else:
        values = {name: _array(_picked(stage, call, name)) for name in stage.outputs}
        got = Numbers(_aligned(stage, right, values), _changed(call))
    return Seen(call.args, key, right, tolerance, loosest, got)


def _picked(stage: Stage, call: Call, name: str) -> Any:
    try:
        return pick(stage, call.args, call.returned, name)
    except AssertionError:
        return None


def _run(stage: Stage, item: Misconception, one: Seen) -> Numbers:
    given = copied(one.args)
    returned = item.function(*given)
    outputs = stage.each(stage.summary(one.args, returned) if stage.summary else returned)
    values = {name: np.array(value, dtype=float) for name, value in _named(stage, outputs)}
    changed = tuple(not _same(now, was) for now, was in zip(given, one.args, strict=True))
    return Numbers(_aligned(stage, one.right, values), changed)


def _aligned(
    stage: Stage, right: dict[str, np.ndarray], values: dict[str, np.ndarray | None]
) -> dict[str, np.ndarray | None]:
    """Write outputs in the form nearest to the right one, where the stage has several."""
    if not stage.aligned:
        return values
    fitting = {
        name: value if value is not None and value.shape == right[name].shape else None
        for name, value in values.items()
    }
    aligned = stage.aligned(right, fitting)
    return {name: value if fitting[name] is None else aligned[name] for name, value in values.items()}


def _named(stage: Stage, values: Any) -> list[tuple[str, Any]]:
    return list(zip(stage.outputs, values, strict=True))


def _changed(call: Call) -> tuple[bool, ...]:
    return tuple(not _same(now, was) for now, was in zip(call.after, call.args, strict=True))


def _same(now: Any, was: Any) -> bool:
    """Whether an argument is what it was; a generator is there to be drawn from."""
    if isinstance(was, np.random.Generator):
        return True
    if isinstance(was, np.ndarray):
        return np.array_equal(now, was, equal_nan=was.dtype.kind in "fc")
    return now == was


def _array(value: Any) -> np.ndarray | None:
    """Read an output as numbers, finite or not, of any shape; None if it is not that."""
    array = as_numbers(value)
    return array.astype(float) if array is not None and array.dtype.kind in "fiu" else None


def _observation(name: str, text: str) -> Diagnosis | None:
    """Put a sentence into the form of a diagnosis."""
    if not text:
        return None
    end = "" if text.endswith((".", "?")) else "."
    return Diagnosis("What can be seen", f"{text[0].upper()}{text[1:]}{end}", "", (name,), known=False)
