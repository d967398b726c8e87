"""Recursion and plain Python: points as pairs of numbers, lists of runs, one beam after the other."""

import math
from itertools import pairwise


def distances(theta, rho, lines, i, j):
    """Return how far each point of a run is from its line."""
    alpha, r = (float(value) for value in lines[i][j])
    return [abs(rho[k] * math.cos(theta[k] - alpha) - r) for k in range(i, j)]


def apart(theta, rho, k):
    """Return how far point k is from the one before it, by the law of cosines."""
    a, b = rho[k - 1], rho[k]
    return math.sqrt(max(a * a + b * b - 2 * a * b * math.cos(theta[k] - theta[k - 1]), 0.0))


def split(theta, rho, lines, params):
    """Call itself for both parts."""

    def parts(i, j):
        for k in range(i + 1, j):
            if apart(theta, rho, k) > params["max_point_gap"]:
                return [[i, k], *parts(k, j)] if alone(i, k) else parts(i, k) + parts(k, j)
        return lined(i, j)

    def alone(i, j):
        return max(distances(theta, rho, lines, i, j)) <= params["line_point_distance"]

    def lined(i, j):
        if alone(i, j):
            return [[i, j]]
        best = min(range(i + 1, j), key=lambda k: misfit(i, k) + misfit(k, j))
        return lined(i, best) + lined(best, j)

    def misfit(i, j):
        return math.fsum(d * d for d in distances(theta, rho, lines, i, j))

    return parts(0, len(rho))


def merge(theta, rho, ranges, lines, params):
    """Join the best pair, and call itself with what is left."""
    runs = [[int(i), int(j)] for i, j in ranges]
    best, where = params["line_point_distance"], None
    for m, ((i, a), (b, j)) in enumerate(pairwise(runs)):
        if a == b and apart(theta, rho, b) <= params["max_point_gap"]:
            far = max(distances(theta, rho, lines, i, j))
            if far < best or (far == best and where is None):
                best, where = far, m
    if where is None:
        return runs
    joined = [*runs[:where], [runs[where][0], runs[where + 1][1]], *runs[where + 2 :]]
    return merge(theta, rho, joined, lines, params)


def segments(theta, rho, ranges, lines, params):
    """Turn by alpha and back, with sines and cosines of one beam at a time."""
    runs, ends = [], []
    for i, j in ([int(end) for end in run] for run in ranges):
        if j - i < params["min_points"]:
            continue
        alpha, r = (float(value) for value in lines[i][j])
        t = [rho[k] * math.sin(theta[k] - alpha) for k in (i, j - 1)]
        if abs(t[1] - t[0]) < params["min_segment_length"]:
            continue
        c, s = math.cos(alpha), math.sin(alpha)
        runs.append([i, j])
        ends.append([r * c - t[0] * s, r * s + t[0] * c, r * c - t[1] * s, r * s + t[1] * c])
    if not runs:
        import numpy as np  # noqa: PLC0415 - for the shape of nothing

        return np.zeros((0, 2)), np.zeros((0, 4))
    return runs, ends


def extract_lines(theta, rho, lines, params):
    """Keep a list of the beams that saw something."""
    import numpy as np  # noqa: PLC0415 - for the shape of nothing

    seen = [k for k in range(len(rho)) if rho[k] == rho[k]]
    if not seen:
        return np.zeros(0), np.zeros(0), np.zeros((0, 4)), np.zeros((0, 2))
    beams = [theta[k] for k in seen], [rho[k] for k in seen]
    runs = merge(*beams, split(*beams, lines, params), lines, params)
    runs, ends = segments(*beams, runs, lines, params)
    found = [[seen[i], seen[j - 1] + 1] for i, j in runs]
    return [lines[i][j][0] for i, j in runs], [lines[i][j][1] for i, j in runs], ends, found
