"""Say where and how numbers differ that no known mistake explains: what can be seen without knowing the cause.

Each function takes what the calls of a function returned beside what is right, and returns a sentence or "". The first
that has something to say is heard: that the numbers depend on something besides the arguments, that they stand in
another shape or are transposed, that they are in another unit, have a sign or a factor, are whole turns off or nearly
right, are no covariance; else which entries are off.

A sentence says what is off and never by which number, but for a factor that is the same everywhere.
"""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.compare import entries

if TYPE_CHECKING:
    from autograder.check import Stage
    from autograder.diagnose import Seen

_SAME_FACTOR = 2e-3  # the limits that may stand for the right numbers at small omega are this near
_SAME_UNIT = 1e-4
_TINY = 1e-7
_CLOSE = 1e-4
_NEARLY = (
    "close, but not to rounding. Is a derivative taken by a difference, a series cut early, a limit "
    "used too far from 0, or a number of lower precision used?"
)
UNITS = (
    (180 / np.pi, "in degrees, where radians are meant"),
    (np.pi / 180, "as if an angle in radians had been taken for degrees"),
    (1e3, "in millimetres, where metres are meant"),
    (1e-3, "as if a length in metres had been taken for millimetres"),
)


def observe(stage: Stage, seen: list[Seen], name: str) -> str:
    """Describe how an output differs that is wrong in some of the calls.

    Parameters
    ----------
    stage : Stage
        What was checked.
    seen : list of Seen
        The calls, each beside the right result.
    name : str
        The output.

    Returns
    -------
    str
        A sentence; "" if the message of the check says all there is to say.
    """
    pairs = [(one, one.got.values[name], one.right[name]) for one in seen if one.right[name].size]
    if not pairs or not all(value is not None and np.isfinite(value).all() for _, value, _ in pairs):
        return ""
    if _depends_on_more(pairs, name):
        return (
            f"The same arguments gave two different results for {name}. Something else goes in: a global, what an "
            "earlier call left behind, or random numbers that are not drawn from the given generator"
        )
    if text := _rearranged(pairs, name):
        return text
    if any(value.shape != right.shape for _, value, right in pairs):
        return ""
    if len({right.shape for *_, right in pairs}) > 1:
        return _no_covariance(pairs, name) or _factor_of_all(pairs, name)
    return _entry_by_entry(stage, pairs, name)


def _entry_by_entry(stage: Stage, pairs: list[tuple], name: str) -> str:
    """Describe an output that always has one size."""
    seen = [one for one, *_ in pairs]
    got, right = (np.array([pair[k] for pair in pairs]) for k in (1, 2))
    tolerance = np.array([one.tolerance[name] for one in seen])
    bad = (np.abs(got - right) > tolerance).any(axis=0)
    if not bad.any():
        return ""  # wrong only in calls that return nothing, of which there is nothing to compare
    where = entries(stage, name, bad)
    wrong, wanted = got[:, bad], right[:, bad]
    said = (
        _unit(wrong, wanted)
        or _factor(wrong, wanted, _durations(stage, seen))
        or _whole_turns(wrong, wanted, tolerance[:, bad])
        or (_NEARLY if np.abs(got - right).max() <= _CLOSE * np.abs(right).max() else "")
    )
    if said:
        return f"{where} of {name}: {said}"
    if (text := _no_covariance(pairs, name)) or bad.all():
        return text
    verb = "is" if bad.sum() == 1 else "are"
    return f"In {name}, only {where} of {bad.size} {verb} off; the others are always right"


# ---------------------------------------------------------------- whatever the size


def _loose(one: Seen, name: str) -> float:
    return 4 * one.loosest[name]


def _depends_on_more(pairs: list[tuple], name: str) -> bool:
    """Tell whether two calls with the same arguments differ."""
    for k, (one, value, _) in enumerate(pairs):
        for other, again, _ in pairs[:k]:
            if _alike(one.args, other.args) and (
                value.shape != again.shape or (np.abs(value - again) > _loose(one, name)).any()
            ):
                return True
    return False


def _alike(some: Any, others: Any) -> bool:
    """Tell whether arguments are equal, the states of generators too."""
    if isinstance(some, (tuple, list)):
        return len(some) == len(others) and all(map(_alike, some, others))
    if isinstance(some, np.random.Generator):
        return _alike(some.bit_generator.state, others.bit_generator.state)
    if isinstance(some, dict):
        return some.keys() == others.keys() and all(_alike(value, others[key]) for key, value in some.items())
    return np.array_equal(some, others)


def _rearranged(pairs: list[tuple], name: str) -> str:
    """Find the right numbers in another shape, or transposed."""

    def all_near(change: Any) -> bool:
        changed = [(one, change(value, right), right) for one, value, right in pairs]
        return all(
            value is not None
            and value.shape == right.shape
            and (np.abs(value - right) <= _loose(one, name)).all()
            for one, value, right in changed
        )

    if all_near(lambda value, _: value):
        return ""
    if all(right.ndim == 2 for *_, right in pairs) and all_near(lambda value, _: value.T):
        return f"{name} is the transpose of the right matrix"
    if all_near(lambda value, right: value.reshape(right.shape) if value.size == right.size else None):
        return f"The numbers of {name} are right, but not their shape"
    return ""


def _no_covariance(pairs: list[tuple], name: str) -> str:
    """Find what no covariance has, in an output that is one."""
    if not all(_is_covariance(right) for *_, right in pairs):
        return ""
    if any(np.abs(value - value.T).max() > _loose(one, name) for one, value, _ in pairs):
        return f"{name} is not symmetric, and a covariance is"
    lowest = [(np.linalg.eigvalsh(value)[0], _loose(one, name) * len(value)) for one, value, _ in pairs]
    if any(least < -allowed for least, allowed in lowest):
        return f"{name} has a negative eigenvalue, and no covariance has: along some direction its variance is negative"
    return ""


def _is_covariance(array: np.ndarray) -> bool:
    """Tell whether a right output is symmetric and has no negative eigenvalue, to rounding."""
    if array.ndim != 2 or array.shape[0] != array.shape[1]:
        return False
    slack = 1e-12 * np.abs(array).max()
    return bool(
        np.abs(array - array.T).max() <= slack and np.linalg.eigvalsh(array)[0] >= -len(array) * slack
    )


def _factor_of_all(pairs: list[tuple], name: str) -> str:
    """Find one factor in all entries of an output that comes in several sizes."""
    ratios = [value / right for _, value, right in pairs]
    text = _factor_text(
        [float(np.median(ratio)) for ratio in ratios], [float(np.ptp(ratio)) for ratio in ratios]
    )
    return f"All entries of {name}: {text}" if text else ""


# ---------------------------------------------------------------- entries that are off


def _unit(got: np.ndarray, right: np.ndarray) -> str:
    """Find a unit: every entry has one power of the same factor, as in a covariance of angles and lengths."""
    if not (np.abs(right) > _TINY * np.abs(right).max()).all():
        return ""
    ratios = got / right
    for factor, text in UNITS:
        powers = np.log(np.abs(ratios)) / np.log(factor)
        power = np.rint(powers[0])
        same = np.abs(ratios - factor**power) <= _SAME_UNIT * np.abs(factor**power)
        if same.all() and ((power == 1) | (power == 2)).all():
            return text
    return ""


def _whole_turns(got: np.ndarray, right: np.ndarray, tolerance: np.ndarray) -> str:
    """Find angles that are off by whole turns, those that are off at all."""
    off = np.abs(got - right) > 4 * tolerance
    turns = (got - right)[off] / (2 * np.pi)
    whole = np.abs(turns - np.rint(turns)) <= np.maximum(4 * tolerance[off], 1e-9)
    if not turns.size or not (whole & (np.rint(turns) != 0)).all():
        return ""
    return "off by whole turns. Is an angle wrapped that should not be, or not wrapped that should be?"


def _durations(stage: Stage, seen: list[Seen]) -> np.ndarray | None:
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
    if not np.isfinite([*medians, *spreads]).all():
        return ""  # of numbers that should be 0 there is no factor
    if any(abs(value - factor) > _SAME_FACTOR * abs(factor) for value in medians):
        return ""
    if any(spread > _SAME_FACTOR * abs(factor) for spread in spreads) or abs(factor - 1) < _SAME_FACTOR:
        return ""
    if abs(factor + 1) < _SAME_FACTOR:
        return "the sign is wrong"
    if abs(factor) < _SAME_FACTOR:
        return "always 0"
    return f"off by the same factor everywhere, about {factor:.2g}"
