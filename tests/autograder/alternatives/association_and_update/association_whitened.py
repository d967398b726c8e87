"""Association of all pairs at once, each innovation divided by the Cholesky factor of its covariance."""

import numpy as np


def compute_innovations(z_raw, Q_raw, hs, Hs, Sigma, g):
    """Whiten the innovations and compare plain lengths; the sum of squares of two numbers by hand."""
    n = Sigma.shape[0]
    if z_raw.shape[1] == 0:
        return np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros((0, 2, n))
    v = (z_raw[:, :, None] - hs[:, None, :]).transpose(1, 2, 0)
    v[..., 0] = (v[..., 0] + np.pi) % (2 * np.pi) - np.pi
    S = np.einsum("jab,bc,jdc->jad", Hs, Sigma, Hs)[None] + Q_raw[:, None]
    first = np.sqrt(S[..., 0, 0])
    below = S[..., 1, 0] / first
    second = np.sqrt(S[..., 1, 1] - below**2)
    a = v[..., 0] / first
    distance = np.hypot(a, (v[..., 1] - below * a) / second)
    j = distance.argmin(axis=1)
    i = np.flatnonzero(distance.min(axis=1) < g)
    return v[i, j[i]], Q_raw[i], Hs[j[i]]


def measurement_model(v, Q, H):
    """Spread the blocks with an identity over the lines."""
    count = len(v)
    whole = np.einsum("kl,kab->kalb", np.eye(count), Q).reshape(2 * count, 2 * count)
    return np.ravel(v), whole, np.reshape(H, (2 * count, H.shape[2]))
