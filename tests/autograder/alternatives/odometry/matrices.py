"""Poses as homogeneous matrices, angles as rotations, and the density of scipy."""

import numpy as np
from scipy.stats import norm


def _pose(x, y, theta):
    """Return a stack of 3 by 3 matrices."""
    c, s, zero, one = np.cos(theta), np.sin(theta), 0 * theta, 0 * theta + 1
    rows = [[c, -s, zero + x], [s, c, zero + y], [zero, zero, one]]
    return np.moveaxis(np.array(rows), -1, 0)


def sample_motion(xs, odometry, alphas, rng):
    """Multiply the pose by a turn, a way and a turn; the second turns are drawn first."""
    A = np.zeros((3, 3))
    A[[0, 0, 1, 1, 1, 2, 2], [0, 1, 0, 1, 2, 1, 2]] = np.take(alphas, [0, 1, 3, 2, 3, 1, 0])
    errors = np.diag(A @ np.abs(odometry)) @ rng.standard_normal((3, len(xs)))[::-1]
    one, way, two = np.asarray(odometry)[:, None] + errors
    T = _pose(*np.transpose(xs)) @ _pose(0, 0, one) @ _pose(way, 0, 0 * way) @ _pose(0, 0, two)
    return np.column_stack([T[:, 0, 2], T[:, 1, 2], np.arctan2(T[:, 1, 0], T[:, 0, 0])])


def bearing_likelihood(xs, landmark, bearing, sigma):
    """Turn the landmark into each particle's frame and then by the bearing: what is left is the innovation."""
    T = _pose(*np.transpose(xs)) @ _pose(0, 0, np.full(len(xs), bearing))
    local = np.linalg.solve(T, np.tile([[landmark[0]], [landmark[1]], [1.0]], (len(xs), 1, 1)))[..., 0]
    return norm.pdf(np.arctan2(local[:, 1], local[:, 0]), scale=sigma)
