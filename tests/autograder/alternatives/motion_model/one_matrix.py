"""The prediction step as one product: [Gx Gu] diag(Sigma, dt R) [Gx Gu]^T."""

import numpy as np


def transition_update(g, Gx, Gu, Sigma, R, dt):
    """Put state and control into one vector with one covariance."""
    n = len(g)
    G = np.concatenate([Gx, Gu], axis=1)
    joint = np.zeros((n + 2, n + 2))
    joint[:n, :n] = Sigma
    joint[n:, n:] = dt * R
    return g.copy(), np.linalg.multi_dot([G, joint, G.T])
