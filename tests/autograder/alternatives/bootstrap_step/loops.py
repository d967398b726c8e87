"""The whole step one particle after the other, with weights as logarithms."""

import math

import numpy as np


def bootstrap_step(xs, ws, odometry, alphas, landmark, bearing, sigma, rng):
    """Draw the offset before the errors; copy with a pointer."""
    size = len(xs)
    offset = rng.random() / size
    one, way, two = (abs(float(value)) for value in odometry)
    a1, a2, a3, a4 = (float(value) for value in alphas)
    spread = (a1 * one + a2 * way, a3 * way + a4 * (one + two), a1 * two + a2 * way)
    moved, logs = [], []
    for (x, y, theta), w in zip(xs, ws, strict=True):
        rot1, trans, rot2 = (
            value + s * rng.standard_normal() for value, s in zip(odometry, spread, strict=True)
        )
        ahead = theta + rot1
        place = (x + trans * math.cos(ahead), y + trans * math.sin(ahead), ahead + rot2)
        v = bearing - math.atan2(landmark[1] - place[1], landmark[0] - place[0]) + place[2]
        v = math.remainder(v, 2 * math.pi)
        moved.append(place)
        logs.append(-v * v / (2 * sigma * sigma) + math.log(w) if w > 0 else -math.inf)
    best = max(logs)
    weights = [math.exp(value - best) for value in logs]
    total, copies, i, mark = sum(weights), [], 0, weights[0]
    for j in range(size):
        while mark <= (offset + j / size) * total and i < size - 1:
            i += 1
            mark += weights[i]
        copies.append(moved[i])
    return np.array(copies), np.array([1 / size] * size)
