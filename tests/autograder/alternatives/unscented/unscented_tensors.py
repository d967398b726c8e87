"""Sums by einsum, the root from LDL, views as complex numbers, and a square root of the weights' signs."""

import numpy as np
from scipy.linalg import block_diag, ldl


def sigma_points(mean, cov, kappa):
    """Take the root from an LDL decomposition, which needs no pivots here."""
    n = np.size(mean)
    lower, D, order = ldl(np.asarray(cov), lower=True)
    if not np.array_equal(order, np.arange(n)) or (np.diag(D, 1) != 0).any():
        lower, D = np.linalg.cholesky(cov), np.eye(n)
    columns = np.sqrt(n + kappa) * lower @ np.sqrt(D)
    signs = np.concatenate([np.zeros((n, 1)), np.eye(n), -np.eye(n)], axis=1)
    weights = np.where(np.arange(2 * n + 1) == 0, kappa, 0.5) / (n + kappa)
    return (np.asarray(mean)[:, None] + columns @ signs).T, weights


def _moved(points, dt):
    z, theta, v, omega, gamma = points[:, 0] + 1j * points[:, 1], *points[:, 2:].T
    half = omega * dt / 2
    z = z + v * dt * np.sinc(half / np.pi) * np.exp(1j * (theta + half))
    return np.stack([z.real, z.imag, theta + dt * omega + dt * gamma], axis=1)


def predict(mean, cov, u, M, dt, kappa):
    """Second moment less product of means, both about the image of the centre."""
    points, w = sigma_points(np.append(mean, u), block_diag(cov, M), kappa)
    ends = _moved(points, dt)
    d = ends - ends[0]
    shift = np.einsum("i,ij->j", w, d)
    spread = np.einsum("i,ij,ik->jk", w, d, d)
    return ends[0] + shift, spread - (kappa >= 0) * np.multiply.outer(shift, shift)


def correct(mean, cov, z, landmarks, Q, kappa):
    """Residuals from what is seen; the information of a regression of the pose on the views."""
    landmarks = np.reshape(landmarks, (-1, 2))
    k = len(landmarks)
    points, w = sigma_points(mean, cov, kappa)
    there = (landmarks @ [1, 1j]) - (points[:, :2] @ [1, 1j])[:, None]
    views = np.log(there) - 1j * points[:, 2:]
    seen = np.reshape(z, (k, 2))
    turn = np.angle(np.exp(1j * (seen[:, 0] - views.imag)))
    off = np.stack([turn, seen[:, 1] - np.exp(views.real)], axis=2).reshape(len(w), 2 * k)  # seen less view
    v = np.einsum("i,ij->j", w, off)
    d, e = points - mean, (v if kappa >= 0 else off[0]) - off
    S = np.einsum("i,ij,ik->jk", w, e, e) + block_diag(*[Q] * k).reshape(2 * k, 2 * k)
    C = np.einsum("i,ij,ik->jk", w, d, e)
    gain = np.linalg.lstsq(S, C.T, rcond=None)[0].T
    return mean + gain @ v, cov - gain @ C.T
