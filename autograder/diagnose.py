"""Say what a mistake is: by comparison with known wrong versions, else by where and how the numbers differ.

Works on the calls that the checks have made already; the student's function is not called again. Each output
is looked at on its own, so that two mistakes in two outputs are both found.
"""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import copied
from autograder.compare import as_numbers, entries, pick

if TYPE_CHECKING:
    from autograder.check import Call, Outcome, Stage
    from autograder.misconceptions.model import Misconception

ARGUMENTS = "arguments"
_FEWEST_CALLS = 3
_SAME_FACTOR = 2e-3  # the limits that may stand for the right numbers at small omega are this near
_TINY = 1e-7
_CLOSE = 1e-4
_NEARLY = (
    "close, but not to rounding. Is a derivative taken by a difference, a series cut early, a limit "
    "used too far from 0, or a number of lower precision used?"
)


@dataclass(frozen=True)
class Diagnosis:
    """What is wrong with some outputs: a known mistake with its explanation, or a plain observation."""

    title: str
    explanation: str
    hint: str
    outputs: tuple[str, ...]
    known: bool = True


@dataclass(frozen=True)
class _Numbers:
    """One call as numbers: each output's array, None where it is not one, and which arguments changed."""

    values: dict[str, np.ndarray | None]
    changed: tuple[bool, ...]


@dataclass(frozen=True)
class _Seen:
    """One call of the student's function beside the right result."""

    args: tuple
    right: dict[str, np.ndarray]
    tolerance: dict[str, np.ndarray]
    loosest: dict[str, float]
    got: _Numbers


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
        seen = [_beside(stage, call) for call in outcome.calls if call.error in {"", "ZeroDivisionError"}]
        wrong = {name for name in stage.outputs if any(_off(item, item.got, name) for item in seen)}
        if any(any(item.got.changed) for item in seen):
            wrong.add(ARGUMENTS)
        if len(seen) < _FEWEST_CALLS or not wrong:
            return ()
        found = _known(stage, seen, wrong, misconceptions)
        explained = {name for item in found for name in item.outputs}
        observed = (_observe(stage, seen, name) for name in stage.outputs if name in wrong - explained)
        return (*found, *filter(None, observed))


def _known(
    stage: Stage, seen: list[_Seen], wrong: set[str], misconceptions: tuple[Misconception, ...]
) -> list[Diagnosis]:
    """Choose the fewest wrong versions that account for the outputs that are wrong.

    A version that is wrong in an output where the student is right is not the mistake.
    """
    order = (*stage.outputs, ARGUMENTS)
    matches: list[tuple[Misconception, set[str]]] = []
    for item in misconceptions:
        matched, faulty = set(wrong), set()
        for one in seen:
            version = _run(stage, item, one)
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


def _matches(item: Misconception, one: _Seen, version: _Numbers, name: str) -> bool:
    """Whether an output is the wrong version's, up to the error that is allowed anyway."""
    if name == ARGUMENTS:
        return one.got.changed == version.changed
    if _off(one, version, name) and not _off(one, one.got, name):
        return False
    return not item.determined(*one.args) or _equal(one, version, name)


def _deviates(one: _Seen, version: _Numbers, name: str) -> bool:
    return any(version.changed) if name == ARGUMENTS else _off(one, version, name)


def _off(one: _Seen, numbers: _Numbers, name: str) -> bool:
    """Whether an output is not the right one."""
    value, right = numbers.values[name], one.right[name]
    if value is None or value.shape != right.shape:
        return True
    return not bool((np.abs(value - right) <= one.tolerance[name]).all())


def _equal(one: _Seen, version: _Numbers, name: str) -> bool:
    got, wanted = one.got.values[name], version.values[name]
    if got is None or wanted is None or got.shape != wanted.shape:
        return False
    if not wanted.size:
        return True
    if not np.isfinite(wanted).all():
        return not np.isfinite(got).all()  # where one program gets NaN, another gets infinity or an error
    scale = np.abs(wanted).max() / max(float(np.abs(one.right[name]).max(initial=0.0)), np.finfo(float).tiny)
    return bool((np.abs(got - wanted) <= 4 * one.loosest[name] * (1 + scale)).all())


def _beside(stage: Stage, call: Call) -> _Seen:
    right = {
        name: np.asarray(value, dtype=float) for name, value in _named(stage, stage.right(copied(call.args)))
    }
    allowed = dict(_named(stage, stage.allowed(copied(call.args))))
    tolerance = {name: np.broadcast_to(value, right[name].shape) for name, value in allowed.items()}
    loosest = {name: float(np.max(value, initial=0.0)) for name, value in allowed.items()}
    if call.error:  # a division by zero in plain Python is what NaN is in numpy
        got = _Numbers({name: np.full_like(value, np.nan) for name, value in right.items()}, _changed(call))
    else:
        values = {name: _array(_picked(stage, call, name)) for name in stage.outputs}
        got = _Numbers(_aligned(stage, right, values), _changed(call))
    return _Seen(call.args, right, tolerance, loosest, got)


def _picked(stage: Stage, call: Call, name: str) -> Any:
    try:
        return pick(stage, call.args, call.returned, name)
    except AssertionError:
        return None


def _run(stage: Stage, item: Misconception, one: _Seen) -> _Numbers:
    given = copied(one.args)
    returned = item.function(*given)
    outputs = stage.each(stage.summary(one.args, returned) if stage.summary else returned)
    values = {name: np.array(value, dtype=float) for name, value in _named(stage, outputs)}
    changed = tuple(not _same(now, was) for now, was in zip(given, one.args, strict=True))
    return _Numbers(_aligned(stage, one.right, values), changed)


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
    return stage.aligned(right, fitting)


def _named(stage: Stage, values: Any) -> list[tuple[str, Any]]:
    return list(zip(stage.outputs, values, strict=True))


def _changed(call: Call) -> tuple[bool, ...]:
    return tuple(not _same(now, was) for now, was in zip(call.after, call.args, strict=True))


def _same(now: Any, was: Any) -> bool:
    """Whether an argument is what it was; a generator is there to be drawn from."""
    if isinstance(was, np.random.Generator):
        return True
    return np.array_equal(now, was) if isinstance(was, np.ndarray) else now == was


def _array(value: Any) -> np.ndarray | None:
    """Read an output as numbers, finite or not, of any shape; None if it is not that."""
    array = as_numbers(value)
    return array.astype(float) if array is not None and array.dtype.kind in "fiu" else None


def _observe(stage: Stage, seen: list[_Seen], name: str) -> Diagnosis | None:  # noqa: PLR0911 (a list of cases)
    """Describe how an output differs that no known mistake explains."""
    pairs = [(one, one.got.values[name]) for one in seen if one.right[name].size]
    if not pairs or not all(_readable(one, value, name) for one, value in pairs):
        return None  # the message of the check says all there is to say
    got = np.array([value for _, value in pairs]) if len({v.shape for _, v in pairs}) == 1 else None
    if got is None:
        return _sizes_differ(pairs, name)
    seen = [one for one, _ in pairs]
    right = np.array([one.right[name] for one, _ in pairs])
    tolerance = np.array([one.tolerance[name] for one, _ in pairs])
    bad = (np.abs(got - right) > tolerance).any(axis=0)
    if not bad.any():
        return None  # wrong only in calls that return nothing, of which there is nothing to compare
    where = entries(stage, name, bad)
    loose = 4 * tolerance.max(axis=tuple(range(1, tolerance.ndim)), keepdims=True)
    if (
        right.ndim == 3
        and right.shape[1] == right.shape[2]
        and (np.abs(got - right.swapaxes(1, 2)) <= loose).all()
    ):
        return _observation(name, f"{name} is the transpose of the right matrix.")
    wrong_got, wrong_right, durations = got[:, bad], right[:, bad], _durations(stage, seen)
    if text := _factor(wrong_got, wrong_right, durations):
        return _observation(name, f"{where} of {name}: {text}.")
    scale = np.abs(right).max()
    if np.abs(got - right).max() <= _CLOSE * scale:
        return _observation(name, f"{where} of {name}: {_NEARLY}")
    if bad.all():
        return None
    verb = "is" if bad.sum() == 1 else "are"
    return _observation(
        name, f"In {name}, only {where} of {bad.size} {verb} off; the others are always right."
    )


def _readable(one: _Seen, value: np.ndarray | None, name: str) -> bool:
    """Whether an output can be compared entry by entry with the right one."""
    return value is not None and value.shape == one.right[name].shape and bool(np.isfinite(value).all())


def _sizes_differ(pairs: list[tuple[_Seen, np.ndarray]], name: str) -> Diagnosis | None:
    """Describe an output that comes in several sizes."""
    covariance = all(_symmetric(one.right[name]) for one, _ in pairs)
    if covariance and any(
        np.abs(value - value.T).max() > 4 * one.tolerance[name].max() for one, value in pairs
    ):
        return _observation(name, f"{name} is not symmetric, and a covariance is.")
    ratios = [value / one.right[name] for one, value in pairs]
    text = _factor_text(
        [float(np.median(ratio)) for ratio in ratios], [float(np.ptp(ratio)) for ratio in ratios]
    )
    return _observation(name, f"All entries of {name}: {text}.") if text else None


def _symmetric(array: np.ndarray) -> bool:
    """Whether a right output is a symmetric matrix, to rounding."""
    square = array.ndim == 2 and array.shape[0] == array.shape[1]
    return square and bool(np.abs(array - array.T).max() <= 1e-12 * np.abs(array).max())


def _durations(stage: Stage, seen: list[_Seen]) -> np.ndarray | None:
    """Return dt of every call: the last argument if that is its name, or the symbol of that name."""
    *_, name = inspect.signature(stage.reference).parameters
    if name not in {"dt", "values"}:
        return None
    last = [one.args[-1] for one in seen]
    found = [value.get("dt") if isinstance(value, dict) else value for value in last]
    return np.array(found) if all(isinstance(value, float) for value in found) else None


def _factor(got: np.ndarray, right: np.ndarray, durations: np.ndarray | None) -> str:
    """Find one factor between what was returned and what is right: a sign, a number, a power of dt."""
    usable = np.abs(right) > _TINY * np.abs(right).max()
    if not usable.any() or not (np.abs(got[~usable]) <= _CLOSE * np.abs(right).max()).all():
        return ""
    ratios = np.divide(got, right, out=np.full_like(got, np.nan), where=usable)
    for power in (0, 1, -1, 2, -2) if durations is not None else (0,):
        scaled = ratios if power == 0 else ratios / (durations**power)[:, None]
        values = scaled[usable]
        median, spread = float(np.median(values)), float(np.ptp(values))
        if power == 0 and (text := _factor_text([median], [spread])):
            return text
        if power and max(abs(median - 1), spread) < _SAME_FACTOR:
            return f"a factor dt{'' if power == 1 else f' to the power {power}'} too much"
    return ""


def _factor_text(medians: list[float], spreads: list[float]) -> str:
    """Name a factor that is the same everywhere."""
    factor = medians[0]
    if any(abs(value - factor) > _SAME_FACTOR * abs(factor) for value in medians):
        return ""
    if any(spread > _SAME_FACTOR * abs(factor) for spread in spreads) or abs(factor - 1) < _SAME_FACTOR:
        return ""
    if abs(factor + 1) < _SAME_FACTOR:
        return "the sign is wrong"
    if abs(factor) < _SAME_FACTOR:
        return "always 0"
    return f"off by the same factor everywhere, about {factor:.2g}"


def _observation(name: str, text: str) -> Diagnosis:
    return Diagnosis("What can be seen", text[0].upper() + text[1:], "", (name,), known=False)
