"""The update by an orthogonal triangularization of the factors of both covariances."""

import numpy as np


def measurement_update(x, Sigma, z, Q, H):
    """Triangularize one array, and read gain and new factor off it."""
    n, k = len(x), len(z)
    values, vectors = np.linalg.eigh(Sigma)
    L = vectors * np.sqrt(np.clip(values, 0.0, None))
    array = np.block([[np.linalg.cholesky(Q).T, np.zeros((k, n))], [(H @ L).T, L.T]])
    R = np.linalg.qr(array, mode="r")
    gain = np.linalg.solve(R[:k, :k], R[:k, k:]).T
    return x + gain @ z, R[k:, k:].T @ R[k:, k:]
