"""One particle after the other in plain Python, with the standard library's own mathematics."""

import math

import numpy as np


def sample_motion(xs, odometry, alphas, rng):
    """Draw with `rng.normal`, three numbers a particle; headings end in one turn."""
    rot1, trans, rot2 = (float(value) for value in odometry)
    a1, a2, a3, a4 = (float(value) for value in alphas)
    moved = []
    for x, y, theta in xs:
        one = rng.normal(rot1, a1 * abs(rot1) + a2 * abs(trans))
        way = rng.normal(trans, a3 * abs(trans) + a4 * (abs(rot1) + abs(rot2)))
        two = rng.normal(rot2, a1 * abs(rot2) + a2 * abs(trans))
        heading = math.remainder(theta + one + two, 2 * math.pi)
        moved.append([x + way * math.cos(theta + one), y + way * math.sin(theta + one), heading])
    return np.array(moved)


def bearing_likelihood(xs, landmark, bearing, sigma):
    """Wrap with a remainder."""
    found = []
    for x, y, theta in xs:
        v = math.remainder(bearing - math.atan2(landmark[1] - y, landmark[0] - x) + theta, 2 * math.pi)
        found.append(math.exp(-v * v / (2 * sigma * sigma)) / math.sqrt(2 * math.pi * sigma * sigma))
    return found
