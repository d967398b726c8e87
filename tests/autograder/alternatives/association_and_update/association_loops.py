"""Association as the handout describes it, pair by pair in plain loops with an inverse; results are lists."""

import math

import numpy as np


def compute_innovations(z_raw, Q_raw, hs, Hs, Sigma, g):
    """Try every wall for every observation; turn the difference by its sine and cosine."""
    v, Q, H = [], [], []
    for i in range(z_raw.shape[1]):
        best = g * g
        choice = None
        for j in range(hs.shape[1]):
            turn = z_raw[0, i] - hs[0, j]
            difference = np.array([math.atan2(math.sin(turn), math.cos(turn)), z_raw[1, i] - hs[1, j]])
            S = Hs[j] @ Sigma @ Hs[j].T + Q_raw[i]
            d2 = difference @ np.linalg.inv(S) @ difference
            if d2 < best:
                best, choice = d2, (difference, Q_raw[i], Hs[j])
        if choice is not None:
            for part, value in zip((v, Q, H), choice, strict=True):
                part.append(value)
    if not v:
        return np.empty((0, 2)), np.empty((0, 2, 2)), np.empty((0, 2, Sigma.shape[0]))
    return v, Q, H


def measurement_model(v, Q, H):
    """Fill a matrix of zeros block by block."""
    count = len(v)
    z, whole, rows = np.zeros(2 * count), np.zeros((2 * count, 2 * count)), np.zeros((2 * count, H.shape[2]))
    for k in range(count):
        part = slice(2 * k, 2 * k + 2)
        z[part], whole[part, part], rows[part] = v[k], Q[k], H[k]
    return z, whole, rows
