"""The prediction step in square-root form: a covariance as the square of a factor."""

import numpy as np


def _factor(matrix):
    values, vectors = np.linalg.eigh(matrix)
    return vectors * np.sqrt(np.clip(values, 0.0, None))


def transition_update(g, Gx, Gu, Sigma, R, dt):
    """Stack the factors of both terms and multiply the stack by its transpose."""
    A = np.hstack([Gx @ _factor(Sigma), np.sqrt(dt) * Gu @ _factor(R)])
    return np.array(g), A @ A.T
