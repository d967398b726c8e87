"""Wrong versions of `split`: cutting a scan as people write it."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from autograder.misconceptions.scan_runs import (
    across,
    best_cut,
    between,
    cut_all,
    farthest,
    root_mean_square,
    split_right,
    steps,
)

_STAGE = "extraction.split"


def _at_gaps(theta: np.ndarray, rho: np.ndarray, params: dict) -> list:
    return between(np.flatnonzero(steps(theta, rho) > params["max_point_gap"]) + 1, len(rho))


def _farthest_beam(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, i: int, j: int) -> int:
    return min(max(i + int(across(theta, rho, lines, i, j).argmax()), i + 1), j - 1)


def _middle(_theta: np.ndarray, _rho: np.ndarray, _lines: np.ndarray, i: int, j: int) -> int:
    return (i + j) // 2


def _first_part_best(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, i: int, j: int) -> int:
    costs = np.full(j, np.inf)
    for k in range(i + 3, j):
        costs[k] = np.sum(across(theta, rho, lines, i, k) ** 2)
    return int(costs.argmin()) if j > i + 3 else j - 1


def at_the_farthest(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> np.ndarray:
    """Cut at the point farthest from the line of the run."""
    runs, limit = _at_gaps(theta, rho, params), params["line_point_distance"]
    return cut_all((theta, rho, lines), runs, limit, _farthest_beam, farthest, len(rho))


def in_the_middle(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> np.ndarray:
    """Cut in halves."""
    runs, limit = _at_gaps(theta, rho, params), params["line_point_distance"]
    return cut_all((theta, rho, lines), runs, limit, _middle, farthest, len(rho))


def first_part_alone(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> np.ndarray:
    """Cut where the first part is a line best."""
    runs, limit = _at_gaps(theta, rho, params), params["line_point_distance"]
    return cut_all((theta, rho, lines), runs, limit, _first_part_best, farthest, len(rho))


def gaps_ignored(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> np.ndarray:
    """Begin with one run of all beams."""
    runs, limit = [(0, len(rho))], params["line_point_distance"]
    return cut_all((theta, rho, lines), runs, limit, best_cut, farthest, len(rho))


def gaps_of_ranges(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> np.ndarray:
    """Take the difference of two ranges for the gap."""
    runs = between(np.flatnonzero(np.abs(np.diff(rho)) > params["max_point_gap"]) + 1, len(rho))
    limit = params["line_point_distance"]
    return cut_all((theta, rho, lines), runs, limit, best_cut, farthest, len(rho))


def gaps_one_early(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> np.ndarray:
    """Cut before the last beam in front of a gap."""
    cuts = np.flatnonzero(steps(theta, rho) > params["max_point_gap"])
    runs, limit = between(cuts[cuts > 0], len(rho)), params["line_point_distance"]
    return cut_all((theta, rho, lines), runs, limit, best_cut, farthest, len(rho))


def cut_once(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> np.ndarray:
    """Cut each run once, and leave both parts as they are."""
    runs, limit = _at_gaps(theta, rho, params), params["line_point_distance"]
    return cut_all((theta, rho, lines), runs, limit, best_cut, farthest, 1)


def mean_distance(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> np.ndarray:
    """Compare the root of the mean square with the limit."""
    runs, limit = _at_gaps(theta, rho, params), params["line_point_distance"]
    return cut_all((theta, rho, lines), runs, limit, best_cut, root_mean_square, len(rho))


def last_beam(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> np.ndarray:
    """Return the last beam of each run."""
    return split_right(theta, rho, lines, params) - np.array([0, 1])


def ranges_overwritten(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> np.ndarray:
    """Compute the points in the caller's arrays."""
    runs = split_right(theta, rho, lines, params)
    rho *= np.cos(theta)
    return runs


_CUT = "Plot the sum of both misfits over the place of the cut, for one run with one corner."
_GAP = "Draw two neighbours with a doorway between them, seen at a flat angle."
MISCONCEPTIONS = (
    Misconception(
        "cut at the farthest point",
        _STAGE,
        "The run is cut at the point that is farthest from its line. That is another rule, cheaper and in "
        "wide use, but "
        "from the line fitted to a corner an end of the run is as far as the corner itself, and the noise of one point "
        "decides between them.",
        _CUT,
        at_the_farthest,
    ),
    Misconception(
        "cut in halves",
        _STAGE,
        "The run is cut in the middle, as in a binary search. Walls do not end in the middle of what is left "
        "of a scan, "
        "so each of them falls to pieces before its ends are found.",
        _CUT,
        in_the_middle,
    ),
    Misconception(
        "misfit of the first part alone",
        _STAGE,
        "The cut is where the first part is a line best, whatever the second is. The first few beams of any wall are "
        "a line nearly without misfit, so the cut comes far too early.",
        "Which two numbers must be small together?",
        first_part_alone,
    ),
    Misconception(
        "gaps not looked for",
        _STAGE,
        "The scan is never cut at a gap. Two walls with a doorway between them lie on one line, and no distance from "
        "that line tells them apart.",
        _GAP,
        gaps_ignored,
    ),
    Misconception(
        "cut once",
        _STAGE,
        "A run that is no line is cut once, and its two parts are taken for lines. A room has more than one corner.",
        "After the cut, which question must be asked of each part?",
        cut_once,
    ),
    Misconception(
        "mean distance in the place of the largest",
        _STAGE,
        "The root of the mean square is compared with the limit. It is about half of the largest distance where a "
        "wall bends, and a post in front of a long wall hardly changes it.",
        "How many points beyond line_point_distance may a line have?",
        mean_distance,
    ),
    Misconception(
        "last beam for last beam + 1",
        _STAGE,
        "The second number of each run is its last beam. Runs are half-open here, as slices are: the second number is "
        "where the next run may begin.",
        "How many beams has the run [3, 5)?",
        last_beam,
    ),
    Misconception(
        "ranges overwritten by points",
        _STAGE,
        "The points are computed in the caller's array of ranges, which then holds ranges no longer. In Python an "
        "array that is handed over is not copied.",
        "An array that is handed over is not copied; which operation makes a new one?",
        ranges_overwritten,
    ),
    Misconception(
        "gap as a difference of ranges",
        _STAGE,
        "The gap is taken as the difference of two ranges. Two points can be as far from the scanner as one "
        "another and "
        "a doorway apart.",
        _GAP,
        gaps_of_ranges,
    ),
    Misconception(
        "gap one beam early",
        _STAGE,
        "The run ends a beam before the gap. Difference number i lies between the beams i and i + 1, and a run begins "
        "with the first beam behind the gap.",
        "For three beams with a gap behind the first: which two runs are there?",
        gaps_one_early,
    ),
)
