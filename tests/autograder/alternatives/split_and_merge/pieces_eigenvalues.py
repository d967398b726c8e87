"""No line of the table for the cut: the misfit of a run is the smaller eigenvalue of its scatter; arrays throughout."""

from itertools import pairwise

import numpy as np


def points(theta, rho):
    """Return the points as rows."""
    return rho[:, None] * np.column_stack([np.cos(theta), np.sin(theta)])


def misfit(p):
    """Return the sum of the squared distances from the best line."""
    d = p - p.mean(axis=0)
    return np.linalg.eigvalsh(d.T @ d)[0]


def farthest(p, line):
    """Return the largest distance from a line."""
    return np.max(np.abs(p @ [np.cos(line[0]), np.sin(line[0])] - line[1]))


def split(theta, rho, lines, params):
    """Work off a stack of runs, the last one first."""
    p = points(theta, rho)
    wide = np.linalg.norm(p[1:] - p[:-1], axis=1) > params["max_point_gap"]
    number = np.concatenate([[0], np.cumsum(wide)])
    stack = [(group[0], group[-1] + 1) for group in (np.flatnonzero(number == n) for n in np.unique(number))]
    done = []
    while stack:
        i, j = stack.pop()
        if farthest(p[i:j], lines[i, j]) <= params["line_point_distance"]:
            done.append((i, j))
        else:
            sums = [misfit(p[i:k]) + misfit(p[k:j]) for k in range(i + 1, j)]
            k = i + 1 + int(np.argmin(sums))
            stack += [(i, k), (k, j)]
    return np.array(sorted(done))


def merge(theta, rho, ranges, lines, params):
    """Keep the borders between runs, and take the best one away as long as one may go."""
    p = points(theta, rho)
    runs = [tuple(run) for run in np.array(ranges, dtype=int)]
    while True:
        pairs = [
            (farthest(p[a[0] : b[1]], lines[a[0], b[1]]), n)
            for n, (a, b) in enumerate(pairwise(runs))
            if a[1] == b[0] and np.linalg.norm(p[b[0]] - p[a[1] - 1]) <= params["max_point_gap"]
        ]
        if not pairs or min(pairs)[0] > params["line_point_distance"]:
            return np.array(runs)
        n = min(pairs)[1]
        runs[n : n + 2] = [(runs[n][0], runs[n + 1][1])]


def segments(theta, rho, ranges, lines, params):
    """Take from each point what is across its line."""
    ranges = np.array(ranges, dtype=int).reshape(-1, 2)
    p = points(theta, rho)[np.stack([ranges[:, 0], ranges[:, 1] - 1], axis=1)]
    alpha, r = lines[ranges[:, 0], ranges[:, 1]].T
    normal = np.stack([np.cos(alpha), np.sin(alpha)], axis=1)
    off = np.einsum("snk,sk->sn", p, normal) - r[:, None]
    ends = p - np.einsum("sn,sk->snk", off, normal)
    long = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) >= params["min_segment_length"]
    good = long & (ranges[:, 1] - ranges[:, 0] >= params["min_points"])
    return ranges[good].astype(float), ends[good].reshape(-1, 4)


def extract_lines(theta, rho, lines, params):
    """Compress the scan by a mask, and count with its running sum."""
    mask = np.isfinite(rho)
    if not mask.any():
        return np.zeros(0), np.zeros(0), np.zeros((0, 4)), np.zeros((0, 2), dtype=int)
    theta, rho, place = theta[mask], rho[mask], np.where(mask)[0]
    runs = merge(theta, rho, split(theta, rho, lines, params), lines, params)
    runs, ends = segments(theta, rho, runs, lines, params)
    i, j = runs.astype(int).T
    alpha, r = lines[i, j].T
    return np.mod(alpha, 2 * np.pi), r, ends, np.column_stack([place[i], place[j - 1] + 1])
