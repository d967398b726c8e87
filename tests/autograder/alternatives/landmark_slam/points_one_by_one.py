"""Homogeneous matrices for the motion, loops over landmarks, and one number of a look after the other."""

import math

import numpy as np


def _matrix(pose):
    """Return a pose as a homogeneous matrix."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return np.array([[c, -s, pose[0]], [s, c, pose[1]], [0.0, 0.0, 1.0]])


def init_landmarks(z, Q, pose, pose_cov):
    """Append one landmark after the other to a belief about the pose."""
    x, Sigma = np.array(pose, dtype=float), np.array(pose_cov, dtype=float)
    for beta, r in np.reshape(z, (-1, 2)):
        local = np.array([r * math.cos(beta), r * math.sin(beta), 1.0])
        place = (_matrix(pose) @ local)[:2]
        F = np.zeros((2, len(x)))
        F[:, :2] = np.eye(2)
        F[:, 2] = [pose[1] - place[1], place[0] - pose[0]]
        rotation = _matrix(pose)[:2, :2]
        N = rotation @ np.array([[-local[1], math.cos(beta)], [local[0], math.sin(beta)]])
        cross = F @ Sigma
        Sigma = np.block([[Sigma, cross.T], [cross, F @ Sigma @ F.T + N @ Q @ N.T]])
        x = np.concatenate([x, place])
    return x, Sigma


def predict(x, Sigma, control, control_cov):
    """Multiply poses as matrices, and wrap the heading that comes out of them."""
    end = _matrix(x[:3]) @ _matrix([control[0], 0.0, control[1]])
    after = x.copy()
    after[:3] = end[0, 2], end[1, 2], math.atan2(end[1, 0], end[0, 0])
    G = np.eye(len(x))
    G[0, 2], G[1, 2] = x[1] - after[1], after[0] - x[0]
    L = np.zeros((len(x), 3))
    L[:2, :2], L[2, 2] = _matrix(x[:3])[:2, :2], 1.0
    return after, G @ Sigma @ G.T + L @ control_cov @ L.T


def measurement(x, j):
    """Look at the landmark in the frame of the robot, and use the chain rule."""
    c, s = math.cos(x[2]), math.sin(x[2])
    dx, dy = x[3 + 2 * j] - x[0], x[4 + 2 * j] - x[1]
    ahead, left = c * dx + s * dy, c * dy - s * dx
    r = math.hypot(ahead, left)
    by_local = np.array([[-left / r**2, ahead / r**2], [ahead / r, left / r]])
    by_place = by_local @ np.array([[c, s], [-s, c]])
    by_heading = by_local @ np.array([left, -ahead])
    return (math.atan2(left, ahead), r), np.column_stack([-by_place, by_heading]), by_place


def update(x, Sigma, z, Q):
    """Use one whitened number after the other, all linearized about the given x."""
    white = np.linalg.inv(np.linalg.cholesky(Q))
    mean, cov = np.array(x, dtype=float), np.array(Sigma, dtype=float)
    for j in range(len(z) // 2):
        (bearing, r), Hp, Hl = measurement(x, j)
        off = np.array([math.remainder(z[2 * j] - bearing, 2 * math.pi), z[2 * j + 1] - r])
        H = np.zeros((2, len(x)))
        H[:, :3], H[:, 3 + 2 * j : 5 + 2 * j] = Hp, Hl
        for row, value in zip(white @ H, white @ off, strict=True):
            gain = cov @ row / (row @ cov @ row + 1.0)
            mean = mean + gain * (value - row @ (mean - x))
            cov = cov - np.outer(gain, row @ cov)
    return mean, cov


def evaluate(x, Sigma, truth):
    """Turn each error into the axes of its ellipse."""
    far, distances = [], []
    for j, place in enumerate(np.reshape(truth, (-1, 2))):
        at = slice(3 + 2 * j, 5 + 2 * j)
        variances, axes = np.linalg.eigh(Sigma[at, at])
        along = axes.T @ (x[at] - place)
        far.append(math.hypot(*(x[at] - place)))
        distances.append(math.sqrt(sum(along**2 / variances)))
    return np.array(far), np.array(distances)
