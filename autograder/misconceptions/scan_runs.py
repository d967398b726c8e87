"""What wrong versions of splitting and merging have in common: the right parts, written as in a student's cell."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable


def across(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, i: int, j: int) -> np.ndarray:
    """Return how far the points of a run are from its line."""
    alpha, r = lines[i, j]
    return np.abs(rho[i:j] * np.cos(theta[i:j] - alpha) - r)


def farthest(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, i: int, j: int) -> float:
    """Return how far the farthest point of a run is from its line."""
    return across(theta, rho, lines, i, j).max()


def root_mean_square(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, i: int, j: int) -> float:
    """Return how far the points of a run are from its line on the whole."""
    return np.sqrt(np.mean(across(theta, rho, lines, i, j) ** 2))


def steps(theta: np.ndarray, rho: np.ndarray) -> np.ndarray:
    """Return how far each point is from the next."""
    return np.abs(np.diff(rho * np.exp(1j * theta)))


def best_cut(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, i: int, j: int) -> int:
    """Return where two lines fit best."""
    costs = np.full(j, np.inf)
    for k in range(i + 1, j):
        left, right = across(theta, rho, lines, i, k), across(theta, rho, lines, k, j)
        costs[k] = left @ left + right @ right
    return int(costs.argmin())


def cut_all(
    scan: tuple,
    runs: list,
    limit: float,
    where: Callable[..., int],
    size: Callable[..., float],
    rounds: int,
) -> np.ndarray:
    """Cut the runs that are no lines, as often as `rounds` says."""
    for _ in range(rounds):
        parts = []
        for i, j in runs:
            if j - i < 2 or size(*scan, i, j) <= limit:
                parts.append((i, j))
            else:
                k = where(*scan, i, j)
                parts += [(i, k), (k, j)]
        if len(parts) == len(runs):
            break
        runs = parts
    return np.array(runs)


def between(cuts: np.ndarray, count: int) -> list:
    """Return the runs between places of cuts."""
    places = [0, *cuts.tolist(), count]
    return [(places[n], places[n + 1]) for n in range(len(places) - 1)]


def join_all(
    scan: tuple, ranges: np.ndarray, limit: float, may: np.ndarray, size: Callable[..., float], rounds: int
) -> np.ndarray:
    """Join neighbours, the best pair first, where the step before a beam allows it."""
    runs = [list(run) for run in np.array(ranges).tolist()]
    for _ in range(rounds):
        costs = np.full(len(runs), np.inf)
        for m in range(len(runs) - 1):
            (i, end), (begin, j) = runs[m], runs[m + 1]
            if end == begin and may[end - 1]:
                costs[m] = size(*scan, i, j)
        m = int(costs.argmin())
        if costs[m] > limit:
            break
        runs[m : m + 2] = [[runs[m][0], runs[m + 1][1]]]
    return np.array(runs)


def split_right(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> np.ndarray:
    """Cut at gaps, and where two lines fit best."""
    cuts = np.flatnonzero(steps(theta, rho) > params["max_point_gap"]) + 1
    runs = between(cuts, len(rho))
    return cut_all((theta, rho, lines), runs, params["line_point_distance"], best_cut, farthest, len(rho))


def merge_right(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> np.ndarray:
    """Join what touches and is one line."""
    may = steps(theta, rho) <= params["max_point_gap"]
    limit = params["line_point_distance"]
    return join_all((theta, rho, lines), ranges, limit, may, farthest, len(ranges))


def feet(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, share: float
) -> np.ndarray:
    """Return both ends of each run, moved by a share of the way to the line."""
    ends = np.zeros((len(ranges), 4))
    for n, (i, j) in enumerate(np.array(ranges, dtype=int).tolist()):
        alpha, r = lines[i, j]
        for m, k in ((0, i), (2, j - 1)):
            z = rho[k] * np.exp(1j * theta[k])
            z = z - share * ((z * np.exp(-1j * alpha)).real - r) * np.exp(1j * alpha)
            ends[n, m : m + 2] = z.real, z.imag
    return ends


def lengths(ends: np.ndarray) -> np.ndarray:
    """Return how long segments are."""
    return np.hypot(ends[:, 2] - ends[:, 0], ends[:, 3] - ends[:, 1])


def keep(ranges: np.ndarray, ends: np.ndarray, good: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what is good of runs and their ends."""
    return np.array(ranges).reshape(-1, 2)[good], ends[good]


def segments_right(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> tuple[np.ndarray, np.ndarray]:
    """Drop what has too few points or is too short."""
    ends = feet(theta, rho, ranges, lines, 1.0)
    size = ranges[:, 1] - ranges[:, 0]
    good = (size >= params["min_points"]) & (lengths(ends) >= params["min_segment_length"])
    return keep(ranges, ends, good)


def found_in(
    seen: np.ndarray, lines: np.ndarray, runs: np.ndarray, ends: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Return what is found, the beams counted in the scan."""
    runs = np.array(runs, dtype=int).reshape(-1, 2)
    alpha, r = lines[runs[:, 0], runs[:, 1]].reshape(-1, 2).T
    if len(seen) == 0:
        return alpha, r, ends, runs
    return alpha, r, ends, np.stack([seen[runs[:, 0]], seen[runs[:, 1] - 1] + 1], axis=1)
