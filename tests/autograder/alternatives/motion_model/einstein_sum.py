"""The prediction step with every index written out."""

import numpy as np


def transition_update(g, Gx, Gu, Sigma, R, dt):
    """Sum over the indices; return the caller's own g, which is allowed."""
    old = np.einsum("ij,jk,lk->il", Gx, Sigma, Gx)
    new = np.einsum("ij,jk,lk->il", Gu, R, Gu)
    return g, old + new * dt
