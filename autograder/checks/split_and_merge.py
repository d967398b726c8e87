r"""Hidden checks of the notebook *split-and-merge*: cutting, joining, measuring the pieces, and all of it on one scan.

How a line is fitted is the matter of another notebook, so each function is given the fits of all runs: `lines[i, j]` is
alpha, r of the line through the beams i to j - 1. The rule is exact: a run that is no line is cut where the squared
distances of both parts from their own lines add up to the least. All scans have errors, so that no two cuts are alike,
and :func:`~autograder.checks.scan_scenes.clear` turns away what would be decided by less than a millionth.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.kinds import each, repeatable, untouched
from autograder.checks.scan_merging import HINT_COPY, HINT_GLOBAL, MERGE, RANGES, RUNS
from autograder.checks.scan_scenes import (
    LIMIT,
    bend,
    both_sides,
    clear,
    drawn,
    ends_alone,
    in_any_turn,
    lip,
    misfit,
    pieces,
    room,
    table,
    visited,
    wall,
)
from autograder.checks.scan_stages import extract_lines, segments, split
from roboloc_reference import extraction

if TYPE_CHECKING:
    from numpy.random import Generator


def _split(scene: tuple) -> Case | None:
    theta, rho, params = scene
    return SPLIT.case(theta, rho, table(theta, rho), params) if clear(theta, rho, params) else None


def _elsewhere(case: Case | None) -> Case | None:
    """Pass on a scan that is cut once, neither in its middle nor at the point farthest from its line."""
    if not case or len(case.expected[0]) != 2:
        return None
    theta, rho, lines, _ = case.args
    cut, (alpha, r) = case.expected[0][0, 1], lines[0, -1]
    farthest = np.abs(rho * np.cos(theta - alpha) - r).argmax()
    return case if abs(cut - theta.size / 2) > 1 and farthest != cut else None


@remembered
def one_corner(rng: Generator) -> list[Case]:
    """Make two walls that meet, the corner before or behind the middle of the beams."""
    return drawn(5, lambda: _elsewhere(_split(room(rng, 2))))


@remembered
def several_corners(rng: Generator) -> list[Case]:
    """Make three or four walls, and one run that is no line though most of its points are near one."""

    def mild() -> Case | None:
        theta, rho, params = scene = room(rng, 3)
        mean_squares = (misfit(theta, rho, i, j) / (j - i) for i, j in visited(theta, rho, params))
        return _split(scene) if any(square < (0.9 * LIMIT) ** 2 for square in mean_squares) else None

    return [*drawn(2, lambda: _split(room(rng, 3))), *drawn(1, mild), *drawn(3, lambda: _split(room(rng, 4)))]


@remembered
def with_gaps(rng: Generator) -> list[Case]:
    """Make walls with doorways, some before the last beam, and walls that hide others: cut at the gaps alone."""
    behind = drawn(3, lambda: _split(wall(rng, step=True)))
    return [
        *drawn(3, lambda: _split(wall(rng, doors=2))),
        *behind,
        *drawn(2, lambda: _split(ends_alone(rng))),
    ]


@remembered
def nothing_to_cut(rng: Generator) -> list[Case]:
    """Make one wall, whole, and one with a single beam on a post in front of it."""
    return [*drawn(2, lambda: _split(wall(rng))), *drawn(2, lambda: _split(wall(rng, post=True)))]


@remembered
def slight_bends(rng: Generator) -> list[Case]:
    """Make walls with a bend that is just within the limit, or just beyond, or beyond to one side only."""
    within = drawn(3, lambda: _split(bend(rng, 0.7)))
    beyond = drawn(3, lambda: _elsewhere(_split(bend(rng, 1.4))))
    aside = [
        case for scene in both_sides(rng, lip) for case in drawn(1, lambda s=scene: _elsewhere(_split(s())))
    ]
    return [*within, *beyond, *aside]


_HINT_CUT = "Print the sum of both misfits for every cut of one run: where is it smallest, before which beam?"
_HINT_AGAIN = "Both parts of a run may have a corner of their own."
_HINT_GAP = "How far apart are two points? Which is the first beam behind the gap?"
_HINT_WHOLE = "A run whose points are all near its line stays as it is, also one of one beam."
_HINT_LIMIT = "One point beyond line_point_distance is enough to cut, none is not."
_SCAN = ("theta", "rho", "lines", "params")

SPLIT = Stage(
    name="extraction.split",
    outputs=("ranges",),
    reference=split,
    tolerance=lambda *_: 1e-6,
    checks=(
        Check("one corner", 5, each(one_corner), _HINT_CUT),
        Check("several corners", 4, each(several_corners), _HINT_AGAIN),
        Check("gaps", 4, each(with_gaps), _HINT_GAP),
        Check("nothing to cut", 2, each(nothing_to_cut), _HINT_WHOLE),
        Check("slight bends", 2, each(slight_bends), _HINT_LIMIT),
        Check("arguments untouched", 2, untouched(one_corner, _SCAN, RANGES), HINT_COPY),
        Check("same call, same result", 1, repeatable(one_corner, RANGES), HINT_GLOBAL),
    ),
)


def _segments(rng: Generator, *, points: int = 0, length: float = 0.0) -> Case | None:
    """Cut a room at its corners; `points` and `length` say what is just short of enough, and what just is."""
    (theta, rho, params), corners = pieces(rng, 3)
    ranges = np.array(list(pairwise(corners)))
    lines = table(theta, rho)
    if points:
        a, b, c = (int(i) for i in ranges[:, 0])
        ranges = np.array([[a, a + points], [b, b + points - 1], [c, c + points + 1]])
        params = {**params, "min_points": points, "min_segment_length": 0.0}
    _, ends = segments(theta, rho, ranges, lines, {**params, "min_points": 2, "min_segment_length": 0.0})
    sizes = np.hypot(*(ends[:, 2:] - ends[:, :2]).T)
    if length:
        order = np.sort(sizes)
        if np.diff(order).min() < 0.05:
            return None
        params = {**params, "min_points": 3, "min_segment_length": float(order[:2].mean() * length)}
    good = np.abs(sizes - params["min_segment_length"]).min() > 1e-3
    return SEGMENTS.case(theta, rho, ranges, lines, params) if good else None


@remembered
def all_kept(rng: Generator) -> list[Case]:
    """Make rooms of which every run is long enough."""
    return drawn(4, lambda: _segments(rng, points=0))


@remembered
def few_points(rng: Generator) -> list[Case]:
    """Make runs of as many points as are needed, and of one more and one less."""
    return [case for points in (5, 6, 7) for case in drawn(1, lambda n=points: _segments(rng, points=n))]


@remembered
def short(rng: Generator) -> list[Case]:
    """Make rooms with one run that has points enough, and is too short."""
    return drawn(4, lambda: _segments(rng, length=1.0))


@remembered
def none_left(rng: Generator) -> list[Case]:
    """Make rooms of which no run is long enough."""
    return drawn(2, lambda: _segments(rng, length=50.0))


_HINT_ENDS = (
    "Is the end on the line? Put it into x cos(alpha) + y sin(alpha). Which beam is the last of a run?"
)
_HINT_POINTS = "A segment with fewer points is dropped; what of one with exactly as many?"
_HINT_SHORT = "How long is a segment, from one end to the other?"
_HINT_NONE = "Of no segments there are 0 rows, still of 2 and of 4 numbers."
_KEPT = frozenset({"ranges", "ends"})

SEGMENTS = Stage(
    name="extraction.segments",
    outputs=("ranges", "ends"),
    reference=segments,
    tolerance=lambda *_: (1e-6, 1e-7),
    checks=(
        Check("ends of the segments", 5, each(all_kept, "ends"), _HINT_ENDS),
        Check("all long enough", 2, each(all_kept, "ranges"), _HINT_POINTS),
        Check("too few points", 4, each(few_points, "ranges"), _HINT_POINTS),
        Check("too short", 4, each(short), _HINT_SHORT),
        Check("none left", 1, each(none_left), _HINT_NONE),
        Check("arguments untouched", 2, untouched(all_kept, RUNS, _KEPT), HINT_COPY),
        Check("same call, same result", 2, repeatable(all_kept, _KEPT), HINT_GLOBAL),
    ),
)


def _whole(
    rng: Generator, walls: int, *, lost: float = 0.0, trap: bool = False, shrinking: bool | None = None
) -> Case | None:
    """Make a scan of a room with lost beams, of which the reference finds the same with its corners sharpened."""
    theta, rho, params = room(rng, walls)
    rho[rng.uniform(size=rho.size) < lost] = np.nan
    if lost and np.isnan(rho[3:-3]).sum() < 4:
        return None
    seen = ~np.isnan(rho)
    lines = table(theta[seen], rho[seen])
    wide = np.abs(np.diff(rho[seen] * np.exp(1j * theta[seen]))).max() > 0.9 * params["max_point_gap"]
    if wide or not clear(theta[seen], rho[seen], params):
        return None
    runs = extraction.split(theta[seen], rho[seen], params)
    small = bool((np.ptp(runs, axis=1) < params["min_points"]).any())
    if trap != small or (walls > 2 and len(runs) == walls):
        return None  # of three walls or more, one is always cut too often
    alpha, r, ends, ranges = extract_lines(theta, rho, lines, params)
    alpha_too, r_too, _, ends_too, ranges_too = extraction.extract_lines(theta, rho, params, 0.0, 1e-4)
    if len(alpha) != walls or not np.array_equal(ranges, ranges_too):
        return None
    sizes = np.hypot(*(ends[:, 2:] - ends[:, :2]).T)
    behind = not lost or np.isnan(rho[ranges[:-1, 1]]).any()  # a beam was lost behind the end of a wall
    if not behind or shrinking not in {None, bool((np.diff(sizes) < 0).all())}:
        return None
    same = np.allclose([alpha, r], [alpha_too, r_too], atol=1e-9) and np.allclose(ends, ends_too, atol=1e-9)
    return EXTRACT.case(theta, rho, lines, params) if same else None


def _both_orders(rng: Generator, lost: float) -> list[Case]:
    """Make rooms of two walls, the longer one before and behind the other, and of three."""
    kinds = ((2, True), (2, False), (3, False), (3, False))
    return [
        case
        for walls, order in kinds
        for case in drawn(1, lambda n=walls, o=order: _whole(rng, n, lost=lost, shrinking=o))
    ]


@remembered
def rooms(rng: Generator) -> list[Case]:
    """Make rooms of which every beam saw something."""
    return _both_orders(rng, 0.0)


@remembered
def rooms_with_lost_beams(rng: Generator) -> list[Case]:
    """Make rooms of which one beam in ten saw nothing."""
    return _both_orders(rng, 0.1)


@remembered
def rooms_cut_too_often(rng: Generator) -> list[Case]:
    """Make rooms in which a wall is cut into pieces that are too small before they are joined."""
    return drawn(4, lambda: _whole(rng, 4, trap=True))


@remembered
def nothing_seen(rng: Generator) -> list[Case]:
    """Make scans of which no beam saw anything."""
    theta, rho, params = room(rng, 2)
    return [EXTRACT.case(theta, np.full_like(rho, np.nan), np.full((1, 1, 2), np.nan), params)]


_HINT_ROOM = "Draw the lines over the points of a scan. Which step is missing, or in the wrong place?"
_HINT_LOST = (
    "lines counts the beams that saw something; the ranges that are returned count all beams of the scan."
)
_HINT_ORDER = "A piece that is too small may be part of a wall that is not."
_HINT_DARK = "Call it with a scan that is NaN all over: how many lines, and of which shape are the results?"
_FOUND = frozenset({"alpha", "r", "ends", "ranges"})

EXTRACT = Stage(
    name="extraction.extract_lines",
    outputs=("alpha", "r", "ends", "ranges"),
    reference=extract_lines,
    tolerance=lambda *_: (1e-7, 1e-7, 1e-7, 1e-6),
    aligned=in_any_turn,
    checks=(
        Check("rooms", 5, each(rooms), _HINT_ROOM),
        Check("lines, with lost beams", 3, each(rooms_with_lost_beams, "alpha", "r", "ends"), _HINT_LOST),
        Check("beams, with lost beams", 3, each(rooms_with_lost_beams, "ranges"), _HINT_LOST),
        Check("walls cut too often", 5, each(rooms_cut_too_often), _HINT_ORDER),
        Check("nothing seen", 1, each(nothing_seen), _HINT_DARK),
        Check("arguments untouched", 2, untouched(rooms_with_lost_beams, _SCAN, _FOUND), HINT_COPY),
        Check("same call, same result", 1, repeatable(rooms, _FOUND), HINT_GLOBAL),
    ),
)

STAGES = (SPLIT, MERGE, SEGMENTS, EXTRACT)
