"""Public checks of splitting and merging: scans of which everybody sees the walls, and laws of runs.

The lines of all runs are found by trying, as in the checks of the fit: no formula is used.
"""

from functools import cache

import numpy as np

from roboloc.checks.fit import _beams, _say_written
from roboloc.checks.report import Caller, Check, Wrong, text

_SCAN = ("theta", "rho", "lines", "params")
_RUNS = ("theta", "rho", "ranges", "lines", "params")
_PARAMS = {"min_segment_length": 0.3, "line_point_distance": 0.05, "max_point_gap": 0.7, "min_points": 3}

# Points as a scanner at the origin sees them, from right to left, each some millimetres off its wall.
_WALL = ((2.003, -0.9), (1.996, -0.5), (2.002, -0.2), (2.004, 0.1), (1.997, 0.5), (1.998, 0.9))
_DOOR = ((2.003, -1.3), (1.996, -1.0), (2.002, -0.7), (2.004, 0.3), (1.997, 0.6), (1.998, 0.9))
_CORNER = (
    *((2.003, -1.0), (1.997, -0.6), (1.998, -0.2), (2.004, 0.2), (1.996, 0.6)),
    *((1.7, 1.003), (1.3, 0.997), (0.9, 0.996), (0.5, 1.003)),
)
_POST = ((2.003, -0.9), (1.996, -0.5), (2.002, -0.2), (1.2, 0.1), (1.997, 0.5), (1.998, 0.9))
_DENT = ((2.003, -0.6), (1.996, -0.4), (2.002, -0.2), (1.92, 0.0), (1.997, 0.2), (1.998, 0.4), (2.001, 0.6))
_BEND = (
    *((2.004, -1.1), (1.996, -0.9), (2.004, -0.7), (1.996, -0.5), (2.004, -0.3), (1.996, -0.1)),
    *((2.044, 0.1), (2.076, 0.3), (2.124, 0.5), (2.156, 0.7), (2.204, 0.9), (2.236, 1.1)),
)
_ROOM = (
    *((-0.17, -2.0), (0.13, -1.92), (0.41, -1.83), (0.7, -1.77)),
    *((0.97, -1.67), (1.19, -1.46), (1.4, -1.27), (1.61, -1.07), (1.86, -0.85), (2.11, -0.6)),
    *((2.27, -0.29), (2.19, 0.06), (2.11, 0.38), (2.04, 0.71), (1.97, 1.04), (1.88, 1.4)),
    *((1.49, 1.51), (1.12, 1.55), (0.81, 1.59), (0.54, 1.62), (0.28, 1.66), (0.03, 1.69)),
)
_FOUR_WALLS = ((0, 4), (4, 10), (10, 16), (16, 22))


@cache
def _table(points: tuple) -> np.ndarray:
    """Return the line of every run of some points, found by trying; that of one point is at a right angle to it."""
    theta, rho = _beams(points)
    N = len(points)
    lines = np.full((N + 1, N + 1, 2), np.nan)
    i, j = np.triu_indices(N + 1, 1)
    share = (np.arange(N) >= i[:, None]) & (np.arange(N) < j[:, None])
    share = share / np.sum(share, axis=1, keepdims=True)
    alpha, r = _searched(share, rho * np.exp(1j * theta))
    alone = j - i == 1
    lines[i, j] = np.stack([np.where(alone, theta[i], alpha), np.where(alone, rho[i], r)], axis=1)
    return lines


def _searched(share: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Search the best line of each run, all at once: try both sides of the best angle with ever smaller steps."""

    def tried(alpha: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        depth = (z * np.exp(-1j * alpha)[:, None]).real
        r = np.sum(share * depth, axis=1)
        return np.sum(share * (depth - r[:, None]) ** 2, axis=1), r

    angles = np.linspace(-np.pi, np.pi, 97)
    costs = [cost + 9.0 * (r < 0) for cost, r in (tried(np.full(len(share), angle)) for angle in angles)]
    alpha, step = angles[np.argmin(costs, axis=0)], 0.05
    best, r = tried(alpha)
    while step > 1e-10:
        for angle in (alpha - step, alpha + step):
            cost, distance = tried(angle)
            better = cost < best
            alpha, r, best = (
                np.where(better, new, old) for new, old in ((angle, alpha), (distance, r), (cost, best))
            )
        step *= 0.7
    return alpha, r


def _runs(caller: Caller, points: tuple, count: int, ranges: tuple = (), **params: float) -> list:
    """Return the runs that come back, where there must be `count`."""
    given = (np.array(ranges),) if ranges else ()
    arguments = (*_beams(points), *given, _table(points).copy(), {**_PARAMS, **params})
    (found,) = caller(arguments, {"ranges": (count, 2)})
    return found.tolist()


def _worked(name: str, story: str, points: tuple, expected: tuple, ranges: tuple = ()) -> Check:
    """Make a check of one scan, or of the runs of one scan."""

    def check(caller: Caller) -> None:
        about = f"{story}, points {text(points)}" + (f",\nwith the runs {text(ranges)}" if ranges else "")
        try:
            found = _runs(caller, points, len(expected), ranges)
        except Wrong as fault:
            raise Wrong(f"{about}:\nexpected {text(expected)}. {fault}") from None
        if found != [list(run) for run in expected]:
            raise Wrong(f"{about}:\nexpected {text(expected)}, got {text(found)}")

    return Check(name, check)


def _untouched(points: tuple, count: int, ranges: tuple = ()) -> Check:
    def check(caller: Caller) -> None:
        _runs(caller, points, count, ranges)
        _say_written(caller, _RUNS if ranges else _SCAN)

    return Check("leaves its arguments as they were", check)


def _every_run_a_line(caller: Caller) -> None:
    """How many runs there are is not said, but whether each is a line."""
    for points in (_DENT, _ROOM):
        x, y = np.transpose(points)
        for i, j in _any_runs(caller, points):
            alpha, r = _table(points)[i, j] if 0 <= i < j <= len(points) else (0.0, 9.0)
            off = max(abs(x[i:j] * np.cos(alpha) + y[i:j] * np.sin(alpha) - r), default=9.0)
            if not off <= _PARAMS["line_point_distance"]:
                raise Wrong(
                    f"For the points {text(points)}\none of your runs is {[i, j]}: it has a point {text(off)} m from "
                    "its line, and line_point_distance is 0.05 m."
                )


def _any_runs(caller: Caller, points: tuple) -> list:
    """Return the runs that come back, however many."""
    for count in range(1, len(points) + 1):
        try:
            return np.array(_runs(caller, points, count), dtype=int).tolist()
        except Wrong as fault:
            last = fault
    raise Wrong(f"For the points {text(points)}: {last}")


SPLIT = (
    Check("returns ranges (S, 2)", lambda caller: _runs(caller, _WALL, 1) and None),
    _worked("one wall stays whole", "One wall", _WALL, ((0, 6),)),
    _worked("a doorway", "A wall with a doorway", _DOOR, ((0, 3), (3, 6))),
    _worked("a corner", "Two walls and their corner", _CORNER, ((0, 5), (5, 9))),
    _worked("a post", "A wall with a post in front of it", _POST, ((0, 3), (3, 4), (4, 6))),
    Check("every run is a line", _every_run_a_line),
    _untouched(_CORNER, 2),
)
"""Checks of ``split(theta, rho, lines, params) -> ranges``."""

_THREE = ((0, 2), (2, 4), (4, 6))
MERGE = (
    Check("returns ranges (M, 2)", lambda caller: _runs(caller, _WALL, 1, ((0, 6),)) and None),
    _worked("a wall in three pieces", "One wall", _WALL, ((0, 6),), _THREE),
    _worked("a corner stays", "Two walls", _CORNER, ((0, 5), (5, 9)), ((0, 3), (3, 5), (5, 9))),
    _worked("a doorway stays", "A wall with a doorway", _DOOR, ((0, 3), (3, 6)), ((0, 3), (3, 6))),
    _worked(
        "runs with beams between them", "Beams left out", _WALL, ((0, 2), (3, 6)), ((0, 2), (3, 4), (4, 6))
    ),
    _worked("a slight bend", "A bend of 11 degrees", _BEND, ((0, 6), (6, 12)), ((0, 6), (6, 12))),
    _worked(
        "the best pair first", "A bend of 11 degrees", _BEND, ((0, 6), (6, 12)), ((0, 6), (6, 7), (7, 12))
    ),
    _untouched(_WALL, 1, _THREE),
)
"""Checks of ``merge(theta, rho, ranges, lines, params) -> ranges``."""


def _segments(caller: Caller, points: tuple, ranges: tuple, count: int, **params: float) -> tuple:
    arguments = (*_beams(points), np.array(ranges), _table(points).copy(), {**_PARAMS, **params})
    return caller(arguments, {"ranges": (count, 2), "ends": (count, 4)})


_SIDES = ((0, 5), (5, 9))


def _on_the_line(caller: Caller) -> None:
    _, ends = _segments(caller, _CORNER, _SIDES, 2)
    for run, (alpha, r), end in zip(_SIDES, [_table(_CORNER)[run] for run in _SIDES], ends, strict=True):
        normal = np.array((np.cos(alpha), np.sin(alpha)))
        for point in (end[:2], end[2:]):
            if abs(point @ normal - r) > 1e-5:
                raise Wrong(
                    f"For the run {list(run)} of the points {text(_CORNER)}\nyour end {text(point)} is "
                    f"{text(abs(point @ normal - r))} m beside its line, {text((alpha, r))}."
                )


def _near_the_points(caller: Caller) -> None:
    _, ends = _segments(caller, _CORNER, _SIDES, 2)
    for (i, j), end in zip(_SIDES, ends, strict=True):
        for k, point in ((i, end[:2]), (j - 1, end[2:])):
            if np.hypot(*(point - _CORNER[k])) > 0.01:
                raise Wrong(
                    f"For the run {[i, j]} of the points {text(_CORNER)}\nthe end of beam {k} should be near "
                    f"{text(_CORNER[k])}, but it is {text(point)}."
                )


def _kept(name: str, story: str, expected: tuple, ranges: tuple = _SIDES, **params: float) -> Check:
    def check(caller: Caller) -> None:
        about = (
            f"{story}: of the runs {text(ranges)} {text(expected) if expected else 'none'} should be left."
        )
        try:
            found, _ = _segments(caller, _CORNER, ranges, len(expected), **params)
        except Wrong as fault:
            raise Wrong(f"{about}\n{fault}") from None
        if found.tolist() != [list(run) for run in expected]:
            raise Wrong(f"{about}\nLeft are {text(found)}.")

    return Check(name, check)


def _segments_untouched(caller: Caller) -> None:
    _segments(caller, _CORNER, _SIDES, 2)
    _say_written(caller, _RUNS)


SEGMENTS = (
    Check(
        "returns ranges (I, 2), ends (I, 4)", lambda caller: _segments(caller, _CORNER, _SIDES, 2) and None
    ),
    Check("both ends are on the line", _on_the_line),
    Check("the ends belong to the first and the last beam", _near_the_points),
    _kept(
        "as many points as are needed", "With min_points 4 and walls of 5 and 4 points", _SIDES, min_points=4
    ),
    _kept("a run with too few points", "With min_points 5", ((0, 5),), min_points=5),
    _kept(
        "a run that is too short",
        "With min_segment_length 1.4",
        ((0, 5),),
        min_segment_length=1.4,
        min_points=2,
    ),
    _kept("no run is left", "With min_segment_length 9", (), min_segment_length=9.0),
    Check("leaves its arguments as they were", _segments_untouched),
)
"""Checks of ``segments(theta, rho, ranges, lines, params) -> ranges, ends``."""


def _extract(caller: Caller, points: tuple, lost: tuple, expected: tuple) -> tuple:
    """Look for the lines in a scan in which beams were lost: before those that `lost` numbers."""
    theta, rho = (np.insert(part, lost, np.nan) for part in _beams(points))
    theta[np.isnan(rho)] = np.interp(
        *(np.flatnonzero(f(rho)) for f in (np.isnan, np.isfinite)), theta[~np.isnan(rho)]
    )
    count = len(expected)
    shapes = {"alpha": (count,), "r": (count,), "ends": (count, 4), "ranges": (count, 2)}
    return caller((theta, rho, _table(points).copy(), dict(_PARAMS)), shapes)


def _found(name: str, story: str, points: tuple, lost: tuple, walls: tuple, expected: tuple) -> Check:
    """Make a check of a scan: `walls` are runs of the points, `expected` runs of all beams."""

    def check(caller: Caller) -> None:
        try:
            alpha, r, _, ranges = _extract(caller, points, lost, expected)
        except Wrong as fault:
            raise Wrong(f"{story}: expected the beams {text(expected)}.\n{fault}") from None
        lines = np.array([_table(points)[wall] for wall in walls])
        if ranges.tolist() != [list(run) for run in expected]:
            raise Wrong(f"{story}: expected the beams {text(expected)}, got {text(ranges)}.")
        if np.abs(np.exp(1j * alpha) * r - np.exp(1j * lines[:, 0]) * lines[:, 1]).max() > 1e-9:
            raise Wrong(
                f"{story}: expected the lines {text(lines)}, got {text(np.stack([alpha, r], axis=1))}."
            )

    return Check(name, check)


def _dark(caller: Caller) -> None:
    shapes = {"alpha": (0,), "r": (0,), "ends": (0, 4), "ranges": (0, 2)}
    caller((np.linspace(-1, 1, 5), np.full(5, np.nan), np.full((1, 1, 2), np.nan), dict(_PARAMS)), shapes)


def _extract_untouched(caller: Caller) -> None:
    _extract(caller, _CORNER, (2, 5), _SIDES)
    _say_written(caller, _SCAN)


_FOUR = "Four walls, of which splitting cuts two into pieces"
EXTRACT = (
    Check(
        "returns alpha (I,), r (I,), ends (I, 4), ranges (I, 2)",
        lambda caller: _extract(caller, _CORNER, (), _SIDES) and None,
    ),
    _found("a corner", "Two walls", _CORNER, (), _SIDES, _SIDES),
    _found(
        "lost beams", "Two walls, the beams 2, 6 and 7 lost", _CORNER, (2, 5, 5), _SIDES, ((0, 6), (8, 12))
    ),
    _found("four walls", _FOUR, _ROOM, (), _FOUR_WALLS, _FOUR_WALLS),
    Check("a scan in which nothing was seen", _dark),
    Check("leaves its arguments as they were", _extract_untouched),
)
"""Checks of ``extract_lines(theta, rho, lines, params) -> alpha, r, ends, ranges``."""
