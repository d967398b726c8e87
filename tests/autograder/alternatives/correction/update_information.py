"""The update in information form: precisions add."""

import numpy as np


def measurement_update(x, Sigma, z, Q, H):
    """Add what the observation knows to what the prior knows."""
    knows = H.T @ np.linalg.inv(Q)
    Sigma = np.linalg.inv(np.linalg.inv(Sigma) + knows @ H)
    Sigma = (Sigma + Sigma.T) / 2
    return x + Sigma @ knows @ z, Sigma
