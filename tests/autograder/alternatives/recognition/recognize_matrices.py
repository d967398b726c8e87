"""The lines are written the other way instead of the observation; Cholesky instead of an inverse."""

import numpy as np
from scipy.linalg import cho_factor, cho_solve


def recognize(z, Q, hs, Hs, Sigma, g, newness):
    """Write the lines the other way instead of the observation, and solve by Cholesky."""
    flip = np.diag([1, -1])
    d2 = [np.inf]
    for h, H in zip(hs.T, Hs, strict=True):
        for name, slope in ((h, H), (flip @ h + [np.pi, 0], flip @ H)):
            v = z - name
            v[0] = np.angle(np.exp(1j * v[0]))
            d2.append(v @ cho_solve(cho_factor(slope @ Sigma @ slope.T + Q), v))
    best = int(np.argmin(d2))
    if d2[best] < g**2:
        return (best - 1) // 2
    return -2 if d2[best] < newness**2 else -1
