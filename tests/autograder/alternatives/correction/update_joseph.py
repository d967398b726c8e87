"""The update in Joseph's form with an inverse of S, not symmetrized."""

import numpy as np


def measurement_update(x, Sigma, z, Q, H):
    """Weigh prior and observation with I - K H and K."""
    K = Sigma @ H.T @ np.linalg.inv(H @ Sigma @ H.T + Q)
    rest = np.identity(len(x)) - K.dot(H)
    return x + K.dot(z), rest.dot(Sigma).dot(rest.T) + K.dot(Q).dot(K.T)
