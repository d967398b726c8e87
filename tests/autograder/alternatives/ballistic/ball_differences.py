"""The time of the impact by a root finder, and the Jacobian by central differences; the update number by number."""

import numpy as np
from scipy.optimize import brentq


def _end(x, dt, gravity, e):
    """Fall until the height, seen as a function of time, is 0; one impact after the other."""
    px, y, vx, vy = (float(number) for number in x)
    y, left = max(y, 0.0), dt
    while True:
        top = max(vy, 0.0) / gravity  # after this time the ball falls
        height = y + max(vy, 0.0) ** 2 / (2 * gravity)
        late = top + abs(min(vy, 0.0)) / gravity + np.sqrt(2 * height / gravity) + 1e-9
        path = [-gravity / 2, vy, y]
        t = brentq(lambda t, path=path: np.polyval(path, t), top, late, xtol=1e-15) if height else 0.0
        if t >= left:
            return np.array([px + vx * dt, np.polyval(path, left), vx, vy - gravity * left])
        fast = gravity * t - vy
        if (left - t) * (1 - e) >= 2 * e * fast / gravity:
            return np.array([px + vx * dt, 0.0, vx, 0.0])
        y, vy, left = 0.0, e * fast, left - t


def predict(x, Sigma, dt, gravity, restitution, Q):
    """Move the mean, and four small steps to either side of it."""
    step = 1e-5
    x = np.array([x[0], max(x[1], 0.0), x[2], x[3]])
    columns = []
    for nudge in step * np.eye(4):
        there = _end(x + nudge, dt, gravity, restitution)
        back = _end(x - nudge, dt, gravity, restitution)
        columns.append((there - back) / (2 * step))
    J = np.transpose(columns)
    return _end(x, dt, gravity, restitution), J @ Sigma @ J.T + Q


def correct(x, Sigma, z, R):
    """Turn the camera's errors until they are independent, and use one number after the other."""
    L = np.linalg.cholesky(R)
    H, z = np.linalg.solve(L, np.eye(2, 4)), np.linalg.solve(L, z)
    for row, seen in zip(H, z, strict=True):
        gain = Sigma @ row / (row @ Sigma @ row + 1)
        x, Sigma = x + gain * (seen - row @ x), Sigma - np.outer(gain, row @ Sigma)
    return x, Sigma
