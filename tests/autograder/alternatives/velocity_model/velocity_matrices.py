"""Homogeneous matrices and the matrix exponential; derivatives by a block of a larger exponential."""

import numpy as np
from scipy.linalg import expm


def _rates(v, omega):
    return np.array([[0, -omega, v], [omega, 0, 0], [0, 0, 0]])


def _pose(x):
    c, s = np.cos(x[2]), np.sin(x[2])
    return np.array([[c, -s, x[0]], [s, c, x[1]], [0, 0, 1]])


def motion(x, u, dt):
    """Multiply the pose by the exponential of its rates."""
    end = _pose(x) @ expm(dt * _rates(u[0], u[1]))
    return [end[0, 2], end[1, 2], x[2] + dt * (u[1] + u[2])]


def jacobians(x, u, dt):
    """Read derivatives off the exponential of [[A, E], [0, A]], beside that of A."""
    A, X = _rates(u[0], u[1]), _pose(x)
    W, F = np.zeros((3, 3)), np.eye(3)
    for i, E in enumerate((_rates(1, 0), _rates(0, 1))):
        block = expm(dt * np.block([[A, E], [np.zeros((3, 3)), A]]))[:3, 3:]
        W[:2, i] = (X @ block)[:2, 2]
    W[2, 1:] = dt
    way = (X @ expm(dt * A) - X)[:2, 2]
    F[:2, 2] = -way[1], way[0]
    return F, W


def noise(u, alphas):
    """Entry by entry, in lists."""
    squares = [float(u[0]) ** 2, float(u[1]) ** 2]
    M = [[0.0] * 3 for _ in range(3)]
    for i in range(3):
        M[i][i] = sum(a * s for a, s in zip(alphas[2 * i : 2 * i + 2], squares, strict=True))
    return M


def range_bearing(x, landmark):
    """Turn the landmark into the frame of the robot first, and use the chain rule there."""
    p = np.linalg.solve(_pose(x), np.array([landmark[0], landmark[1], 1.0]))[:2]
    r = np.sqrt(p @ p)
    by_p = np.array([[-p[1] / r**2, p[0] / r**2], [p[0] / r, p[1] / r]])
    c, s = np.cos(x[2]), np.sin(x[2])
    p_by_pose = np.array([[-c, -s, p[1]], [s, -c, -p[0]]])
    return np.array([np.arctan2(p[1], p[0]), r]), by_p @ p_by_pose
