"""Hidden checks of systematic resampling: which particles a comb of even teeth takes.

The answer is a list of indices, and every way that is right gives the same ones: inputs keep every tooth away from
every mark, by 1e-4 of the ruler (1e-5 where the weights have single precision). Where tooth and mark do meet, at the
two ends, there is one answer that makes sense: a weight of 0 is not taken, and no tooth points beyond the last mark.

The stage is part of two notebooks: *bootstrap-filter* and *monte-carlo-localization*.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.kinds import each, repeatable, untouched
from roboloc_reference.resampling import systematic_resample

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

COUNT = 10


def clear(ws: np.ndarray, offset: float, margin: float = 1e-4) -> bool:
    """Whether no tooth is near a mark, the ends of the ruler aside."""
    marks = np.cumsum(ws, dtype=float)
    marks = marks[(marks > 0.0) & (marks < (1.0 - 1e-6) * marks[-1])] / marks[-1]
    teeth = offset + np.arange(ws.size) / ws.size
    return not marks.size or bool(np.abs(marks[:, None] - teeth).min() > margin)


def largest_offset(count: int) -> float:
    """Return the largest number below 1 / count."""
    return float(np.nextafter(1.0 / count, 0.0))


def _case(
    draw: Callable[[], tuple[np.ndarray, float]],
    margin: float = 1e-4,
    wanted: Callable[[np.ndarray], bool] = lambda _: True,
) -> Case:
    """Draw weights and an offset until the answer is clear, not made in place, and the weights are as wanted."""
    while True:
        ws, offset = draw()
        if wanted(ws) and clear(ws, offset, margin) and _overlaps(ws, offset):
            return RESAMPLE.case(ws, offset)


def _overlaps(ws: np.ndarray, offset: float) -> bool:
    """Whether copies that are written over particles still to be copied change the answer."""
    ancestors = systematic_resample(ws, offset)
    places = np.arange(ws.size)
    for j, i in enumerate(ancestors):
        places[j] = places[i]
    return not np.array_equal(places, ancestors)


def _uneven(rng: Generator, count: int = COUNT) -> np.ndarray:
    """Draw weights of sum 1 of which the last is neither small nor the largest, and no two neighbours are alike."""
    ws = rng.permutation(np.geomspace(1.0, 30.0, count) * rng.uniform(0.95, 1.05, count))
    return ws / ws.sum()


def _offset(rng: Generator, count: int = COUNT) -> float:
    return float(rng.uniform(0.1, 0.9) / count)


@remembered
def sum_one(rng: Generator) -> list[Case]:
    """Make weights of sum 1."""
    return [_case(lambda: (_uneven(rng), _offset(rng))) for _ in range(5)]


@remembered
def any_total(rng: Generator) -> list[Case]:
    """Make weights of some other sum, large and small."""
    scales = (0.02, 7.0, 300.0, 0.4)
    return [
        _case(lambda scale=scale: (scale * rng.uniform(0.8, 1.2) * _uneven(rng), _offset(rng)))
        for scale in scales
    ]


@remembered
def one_has_all(rng: Generator) -> list[Case]:
    """Make weights of which one is 1: the first, one between, the last."""
    places = (0, int(rng.integers(2, COUNT - 2)), COUNT - 1)
    return [RESAMPLE.case(np.eye(COUNT)[i], _offset(rng)) for i in places]


@remembered
def mixed(rng: Generator) -> list[Case]:
    """Make weights of all these kinds."""
    return [case for make in (one_has_all, any_total) for case in make.__wrapped__(rng)]


@remembered
def zeros(rng: Generator) -> list[Case]:
    """Make weights with zeros, at the beginning too, and an offset of 0."""
    found = []
    for first in (1, 3, 0):
        keep = np.ones(COUNT)
        keep[:first] = 0.0
        keep[[4, 5, 7]] = 0.0
        found.append(_case(lambda keep=keep: (keep * _uneven(rng), 0.0)))
    return found


def _adds_up(ws: np.ndarray) -> bool:
    """Whether the pairwise sum is the last mark at least."""
    return bool(ws.sum() >= np.cumsum(ws)[-1])


def _falls_short(ws: np.ndarray) -> bool:
    """Whether the weights add up to less than 1, in either precision."""
    return bool(max(np.cumsum(ws)[-1], np.cumsum(ws, dtype=float)[-1]) < 1.0 - 1e-8)


@remembered
def at_the_end(rng: Generator) -> list[Case]:
    """Make combs of the largest offset, whose last tooth rounding would put on the end of the ruler."""
    return [
        _case(lambda count=count: (_uneven(rng, count), largest_offset(count)), 1e-6, _adds_up)
        for count in (COUNT, 7, 90)
    ]


@remembered
def single_precision(rng: Generator) -> list[Case]:
    """Make weights in single precision, whose sum is a little below 1."""
    return [
        _case(
            lambda count=count: (_uneven(rng, count).astype(np.float32), largest_offset(count)),
            1e-5,
            _falls_short,
        )
        for count in (40, 60, 80)
    ]


_HINT_COMB = (
    "Lay the weights end to end on paper, and the comb beside them: which particle is under each tooth?"
)
_HINT_TOTAL = (
    "How long is the ruler when the weights do not add up to 1, and how far apart are the teeth then?"
)
_HINT_ALL = "If one particle has all the weight, who else could be taken?"
_HINT_ZERO = "A weight of 0 has no length. Can a tooth be on it?"
_HINT_END = "Print the last tooth and the last mark with all their digits. What is taken if they are equal?"
_HINT_SINGLE = "What is the sum of these weights, exactly? Rounding must never lead past the last particle."
_HINT_COPY = "The caller still needs the weights: work on a copy."
_HINT_GLOBAL = "Use the arguments alone, nothing global, and draw nothing."
_ANCESTORS = frozenset({"ancestors"})

RESAMPLE = Stage(
    name="resampling.systematic_resample",
    outputs=("ancestors",),
    reference=systematic_resample,
    tolerance=lambda _ws, _offset: 1e-6,
    checks=(
        Check("weights of sum 1", 5, each(sum_one, "ancestors"), _HINT_COMB),
        Check("weights of any sum", 4, each(any_total, "ancestors"), _HINT_TOTAL),
        Check("one particle has all", 2, each(one_has_all, "ancestors"), _HINT_ALL),
        Check("weights of 0", 2, each(zeros, "ancestors"), _HINT_ZERO),
        Check("largest offset", 2, each(at_the_end, "ancestors"), _HINT_END),
        Check("single precision", 1, each(single_precision, "ancestors"), _HINT_SINGLE),
        Check("arguments untouched", 2, untouched(mixed, ("ws", "offset"), _ANCESTORS), _HINT_COPY),
        Check("same call, same result", 2, repeatable(mixed, _ANCESTORS), _HINT_GLOBAL),
    ),
)

STAGES = (RESAMPLE,)
