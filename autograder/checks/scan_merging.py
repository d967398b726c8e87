"""Hidden checks of `merge`, a stage of the notebook *split-and-merge*: which runs are joined, and in which order."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.kinds import each, repeatable, untouched
from autograder.checks.scan_scenes import (
    LIMIT,
    bend,
    beside,
    both_sides,
    decided,
    differ,
    drawn,
    one_sided,
    pieces,
    small_things,
    table,
    wall,
)
from autograder.checks.scan_stages import merge
from roboloc_reference import extraction

if TYPE_CHECKING:
    from numpy.random import Generator

HINT_COPY = "Work on copies, or on new names."
HINT_GLOBAL = "Use the arguments alone, nothing global."
RANGES = frozenset({"ranges"})
RUNS = ("theta", "rho", "ranges", "lines", "params")


def _merge(scene: tuple, ranges: list) -> Case:
    theta, rho, params = scene
    return MERGE.case(theta, rho, np.array(ranges), table(theta, rho), params)


def _cut(rng: Generator, walls: int, extra: int) -> Case | None:
    """Cut the walls of a room at their corners, and `extra` times more each."""
    scene, corners = pieces(rng, walls)
    cuts = set(corners)
    for i, j in pairwise(corners):
        cuts |= set(rng.choice(np.arange(i + 4, j - 3), extra, replace=False).tolist())
    ranges, lines = list(pairwise(sorted(cuts))), table(*scene[:2])
    begins = {i: max(corner for corner in corners if corner <= i) for i, _ in ranges}
    good = any(differ(lines, begins[i], k, j) for (i, k), (_, j) in pairwise(ranges) if k not in corners)
    return _merge(scene, ranges) if good and decided(*scene[:2], ranges, scene[2]) else None


@remembered
def one_wall(rng: Generator) -> list[Case]:
    """Make a wall in two pieces, and one in four."""
    return [*drawn(2, lambda: _cut(rng, 1, 1)), *drawn(2, lambda: _cut(rng, 1, 3))]


@remembered
def walls_and_corners(rng: Generator) -> list[Case]:
    """Make rooms of which each wall is in two or three pieces, and walls with one beam beside them."""
    rooms = [*drawn(2, lambda: _cut(rng, 2, 1)), *drawn(3, lambda: _cut(rng, 3, 2))]
    return [
        *rooms,
        *(case for scene in both_sides(rng, beside) for case in drawn(1, lambda s=scene: _alone(s()))),
    ]


def _alone(scene: tuple) -> Case | None:
    """Cut out the one beam that is beside a wall."""
    theta, rho, _ = scene
    alpha, r = table(theta, rho)[0, -1]
    k = int(np.abs(rho * np.cos(theta - alpha) - r).argmax())
    ranges = [[0, k], [k, k + 1], [k + 1, theta.size]]
    good = one_sided(scene, 0, k + 1) and one_sided(scene, k, theta.size)
    return _merge(scene, ranges) if good and decided(theta, rho, ranges, scene[2]) else None


@remembered
def doorways(rng: Generator) -> list[Case]:
    """Make walls with doorways, cut there and in one more place, and things of two and three beams between them."""

    def make() -> Case | None:
        scene = wall(rng, doors=2)
        runs = extraction.split(*scene[:2], scene[2]).tolist()
        i, j = runs[-1]
        ranges = [*runs[:-1], [i, i + 2], [i + 2, j]]
        good = len(runs) == 3 and decided(*scene[:2], ranges, scene[2])
        good = good and differ(table(*scene[:2]), i, i + 2, j)
        return _merge(scene, ranges) if good else None

    def few() -> Case | None:
        scene, k = small_things(rng), int(rng.integers(13, 15))
        ranges = [[0, 10], [10, 11], [11, 12], [12, k], [k, 15]]
        return _merge(scene, ranges) if decided(*scene[:2], ranges, scene[2]) else None

    return [*drawn(4, make), *drawn(2, few)]


@remembered
def left_out(rng: Generator) -> list[Case]:
    """Make a wall in pieces of which some in the middle are left out."""

    def make() -> Case | None:
        scene, (first, last) = pieces(rng, 1)
        a, b, c = np.sort(rng.choice(np.arange(first + 4, last - 3), 3, replace=False)).tolist()
        ranges = [[first, a], [a, b], [c, last]]
        good = b - a > 2 and c - b > 1 and differ(table(*scene[:2]), first, a, b)
        good = good and decided(*scene[:2], ranges, scene[2])
        return _merge(scene, ranges) if good else None

    return drawn(3, make)


@remembered
def best_first(rng: Generator) -> list[Case]:
    """Make a slight bend with a small piece at it, which would fit either wall but belongs to one."""

    def make() -> Case | None:
        theta, rho, params = bend(rng, 1.5, middle=True)
        k = theta.size // 2
        ranges = [[0, k], [k, k + int(rng.integers(3, 6))], [0, theta.size]]
        ranges[2][0] = ranges[1][1]
        scan = extraction._points(theta, rho, extraction._params(params))  # noqa: SLF001 - the same project
        first, second = scan.distance(0, ranges[1][1]), scan.distance(k, theta.size)
        good = second < 0.8 * first < 0.8 * LIMIT < 0.7 * scan.distance(0, theta.size)
        good = good and decided(theta, rho, ranges, params)
        return _merge((theta, rho, params), ranges) if good else None

    return drawn(4, make)


_HINT_JOIN = "Two pieces of one wall: how far is the farthest of all their points from the line of both?"
_HINT_STAY = "A pair that is no line together stays two, and what was joined may be joined again."
_HINT_TOUCH = "When does one run begin where another ends, and how wide is the step between them?"
_HINT_BEST = "Of all the pairs that may be joined, which is joined first? What is left for the others then?"

MERGE = Stage(
    name="extraction.merge",
    outputs=("ranges",),
    reference=merge,
    tolerance=lambda *_: 1e-6,
    checks=(
        Check("pieces of one wall", 4, each(one_wall), _HINT_JOIN),
        Check("walls and corners", 4, each(walls_and_corners), _HINT_STAY),
        Check("doorways", 3, each(doorways), _HINT_TOUCH),
        Check("runs left out", 2, each(left_out), _HINT_TOUCH),
        Check("the best pair first", 4, each(best_first), _HINT_BEST),
        Check("arguments untouched", 2, untouched(one_wall, RUNS, RANGES), HINT_COPY),
        Check("same call, same result", 1, repeatable(one_wall, RANGES), HINT_GLOBAL),
    ),
)
