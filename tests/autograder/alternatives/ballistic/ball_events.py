"""A list of events: how long each flight lasts, and a general saltation formula between two of them."""

import numpy as np


def predict(x, Sigma, dt, gravity, restitution, Q):
    """Carry the covariance itself from event to event, instead of a Jacobian."""
    pull, normal = np.array([0, 0, 0, -gravity]), np.array([0, 1, 0, 0])
    state, left = np.array([x[0], max(x[1], 0), x[2], x[3]], dtype=float), dt
    Sigma = np.array(Sigma, dtype=float)
    while True:
        roots = np.roots([-gravity / 2, state[3], state[1]])
        fall = max(0.0, *np.real(roots))
        t = min(fall, left)
        F = np.array([[1, 0, t, 0], [0, 1, 0, t], [0, 0, 1, 0], [0, 0, 0, 1]])
        state = F @ state + pull * t + t**2 / 2 * np.array([0, -gravity, 0, 0])
        Sigma, left = F @ Sigma @ F.T, left - t
        if left <= 0:
            return state, Sigma + Q
        if left * (1 - restitution) >= 2 * restitution * abs(state[3]) / gravity:
            keep = np.diag([1.0, 0, 1, 0]) + left * np.eye(4, k=2) * [0, 0, 1, 0]
            return keep @ (state * [1, 0, 1, 0]), keep @ Sigma @ keep.T + Q
        D = np.diag([1, 1, 1, -restitution])
        before = np.array([*state[2:], 0, -gravity])
        state = np.array([state[0], 0.0, state[2], -restitution * state[3]])
        after = np.array([*state[2:], 0, -gravity])
        Xi = D + np.outer(after - D @ before, normal) / (normal @ before)
        Sigma = Xi @ Sigma @ Xi.T


def correct(x, Sigma, z, R):
    """Condition by Cholesky: half of the gain for the covariance, all of it for the mean."""
    L = np.linalg.cholesky(Sigma[:2, :2] + R)
    W = np.linalg.solve(L, Sigma[:2])
    return [float(number) for number in x + W.T @ np.linalg.solve(L, z - x[:2])], Sigma - W.T @ W
