"""Wrong versions of `merge`: joining the pieces of a wall as people write it."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from autograder.misconceptions.scan_runs import farthest, join_all, merge_right, root_mean_square, steps

_STAGE = "extraction.merge"


def first_pair_first(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> np.ndarray:
    """Go through the runs once, and join each to what is before it."""
    gaps, done = steps(theta, rho), []
    for i, j in np.array(ranges).tolist():
        touch = bool(done) and done[-1][1] == i and gaps[i - 1] <= params["max_point_gap"]
        if touch and farthest(theta, rho, lines, done[-1][0], j) <= params["line_point_distance"]:
            done[-1][1] = j
        else:
            done.append([i, j])
    return np.array(done)


def over_gaps(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> np.ndarray:
    """Join what is on one line, gap or no gap."""
    anywhere = np.ones(len(rho), dtype=bool)
    return join_all(
        (theta, rho, lines), ranges, params["line_point_distance"], anywhere, farthest, len(ranges)
    )


def over_what_is_left_out(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> np.ndarray:
    """Join neighbours in the list, whether or not beams lie between them."""
    filled = np.array(ranges)
    gaps = steps(theta, rho)
    for m in range(len(filled) - 1):
        if gaps[filled[m, 1] - 1 : filled[m + 1, 0]].max() <= params["max_point_gap"]:
            filled[m, 1] = filled[m + 1, 0]
    runs = merge_right(theta, rho, filled, lines, params)
    original = dict(zip(filled[:, 1].tolist(), np.array(ranges)[:, 1].tolist(), strict=True))
    for run in runs:
        run[1] = original[int(run[1])]
    return runs


def similar_parameters(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> np.ndarray:
    """Join neighbours whose lines have nearly the same alpha and r."""
    gaps, done = steps(theta, rho), []
    for i, j in np.array(ranges).tolist():
        if done and done[-1][1] == i and gaps[i - 1] <= params["max_point_gap"]:
            turn, shift = lines[i, j] - lines[done[-1][0], i]
            if np.cos(turn) > np.cos(0.05) and abs(shift) < params["line_point_distance"]:
                done[-1][1] = j
                continue
        done.append([i, j])
    return np.array(done)


def each_run_once(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> np.ndarray:
    """Join the best pair, and stop."""
    may = steps(theta, rho) <= params["max_point_gap"]
    return join_all((theta, rho, lines), ranges, params["line_point_distance"], may, farthest, 1)


def mean_distance(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> np.ndarray:
    """Compare the root of the mean square with the limit."""
    may, limit = steps(theta, rho) <= params["max_point_gap"], params["line_point_distance"]
    return join_all((theta, rho, lines), ranges, limit, may, root_mean_square, len(ranges))


def runs_overwritten(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> np.ndarray:
    """Let the runs that were handed over grow in place."""
    runs = merge_right(theta, rho, ranges, lines, params)
    ranges[: len(runs)] = runs
    return runs


MISCONCEPTIONS = (
    Misconception(
        "joined from the left",
        _STAGE,
        "The runs are gone through from the first to the last, and each is joined to what is before it if the two are "
        "one line. A small piece at a bend fits either wall; the first one takes it, and spoils the end of the other.",
        "Three runs, of which the middle one fits either neighbour: with which does it leave the smaller distance?",
        first_pair_first,
    ),
    Misconception(
        "joined over a gap",
        _STAGE,
        "Runs on one line are joined although there is a gap between them. Two walls with a doorway in "
        "between have one "
        "line, and are two walls still: a segment across the doorway would be a wall where one can pass.",
        "Which of the four parameters does your function not use?",
        over_gaps,
    ),
    Misconception(
        "joined over beams left out",
        _STAGE,
        "Neighbours in the list are joined although beams lie between them that belong to neither. The joint run takes "
        "all of those in.",
        "What do two runs that touch have in common?",
        over_what_is_left_out,
    ),
    Misconception(
        "lines compared by their numbers",
        _STAGE,
        "Two runs are joined if their alpha and r are nearly the same. How well these numbers are known depends on the "
        "length of the run: of a short piece alpha is hardly known at all, so pieces of one wall look like two.",
        "How far are the points of both from one line? That has a unit that the parameters know.",
        similar_parameters,
    ),
    Misconception(
        "one pair joined",
        _STAGE,
        "One pair is joined and the function returns. What was joined may touch a further piece of the same wall.",
        "What if a wall is in four pieces?",
        each_run_once,
    ),
    Misconception(
        "mean distance of the joint run",
        _STAGE,
        "The root of the mean square is compared with the limit, and not the largest distance. Two walls that meet at "
        "a flat angle then become one.",
        "How many points beyond line_point_distance may a line have?",
        mean_distance,
    ),
    Misconception(
        "the caller's runs overwritten",
        _STAGE,
        "The runs are joined in the caller's own array, which afterwards holds neither the old runs nor the new ones.",
        "An array that is handed over is not copied; which operation makes a new one?",
        runs_overwritten,
    ),
)
