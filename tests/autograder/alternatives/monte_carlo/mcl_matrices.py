"""Homogeneous matrices, `einsum` and SciPy; two formulas and `where` for the motion."""

import warnings

import numpy as np
from scipy.special import logsumexp
from scipy.stats import multivariate_normal


def transition_model(xs, us, dt):
    """Choose between arc and straight line for each particle."""
    x, y, theta = np.array(xs, dtype=float).T
    V, omega = us.T
    slow = np.abs(omega) < 1e-3
    safe = np.where(slow, 1.0, omega)
    end = theta + omega * dt
    dx = np.where(slow, V * dt * np.cos(theta), V / safe * (np.sin(end) - np.sin(theta)))
    dy = np.where(slow, V * dt * np.sin(theta), V / safe * (np.cos(theta) - np.cos(end)))
    return np.array([x + dx, y + dy, end]).T


def _matrices(poses):
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    T = np.zeros((len(poses), 3, 3))
    T[:, 0] = np.stack([c, -s, poses[:, 0]], axis=1)
    T[:, 1] = np.stack([s, c, poses[:, 1]], axis=1)
    T[:, 2, 2] = 1
    return T


def compute_predicted_measurements(xs, map_lines, tf_base_to_camera):
    """Bring lines, as rows of homogeneous coordinates, into the frames of the scanners."""
    scanners = _matrices(xs) @ _matrices(tf_base_to_camera[None])
    alpha, r = map_lines
    lines = np.stack([np.cos(alpha), np.sin(alpha), -r], axis=1)
    seen = np.einsum("ja,mab->mjb", lines, scanners)
    seen *= np.where(seen[..., 2:] > 0, -1.0, 1.0)
    return np.stack([np.arctan2(seen[..., 1], seen[..., 0]), -seen[..., 2]], axis=1)


def compute_innovations(z_raw, Q_raw, hs):
    """Go over the observations, never over particles."""
    columns = []
    for i in range(z_raw.shape[1]):
        v = z_raw[:, i, None] - hs
        v[:, 0] = np.mod(v[:, 0] + np.pi, 2 * np.pi) - np.pi
        d2 = np.einsum("maj,ab,mbj->mj", v, np.linalg.inv(Q_raw[i]), v)
        columns.append(v[np.arange(len(hs)), :, d2.argmin(axis=1)])
    return np.concatenate(columns, axis=1)


def measurement_weights(vs, Q_raw, ws):
    """Ask SciPy for the logarithms of the densities."""
    with np.errstate(all="ignore"):
        logs = np.log(ws)
        for i, Q in enumerate(Q_raw):
            logs = logs + multivariate_normal(np.zeros(2), Q).logpdf(vs[:, 2 * i : 2 * i + 2])
        total = logsumexp(logs)
    if not np.isfinite(total):
        warnings.warn("no particle is possible: all weights are 1/M", RuntimeWarning, stacklevel=2)
        return np.full(len(ws), 1 / len(ws))
    return np.exp(logs - total)
