"""No loop over impacts: their number by a logarithm, and the Jacobian by the chain rule."""

import math

import numpy as np


def predict(x, Sigma, dt, gravity, restitution, Q):
    """Write height and velocity at the end by the speed s and the time t1 of the first impact, and differentiate."""
    px, y, vx, vy = (float(number) for number in x)
    y, e = max(y, 0.0), restitution
    s = math.hypot(vy, math.sqrt(2 * gravity * y))
    t1 = (vy + s) / gravity
    J = np.eye(4)
    J[0, 2] = dt
    if dt <= t1:
        J[1, 3] = dt
        x = [px + vx * dt, y + vy * dt - gravity * dt**2 / 2, vx, vy - gravity * dt]
        return x, J @ Sigma @ J.T + Q
    q = (dt - t1) * gravity / (2 * s) if s else math.inf
    if (e < 1 and q * (1 - e) >= e) or q == math.inf:
        J[1, 1] = J[3, 3] = 0.0
        return [px + vx * dt, 0.0, vx, 0.0], J @ Sigma @ J.T + Q
    more = int(q) if e == 1 else int(math.log(1 - q * (1 - e) / e) / math.log(e))
    shares, start = sum(e**m for m in range(1, more + 1)), e ** (more + 1)
    tau = dt - t1 - 2 * s / gravity * shares
    v = start * s - gravity * tau
    ds = (gravity / s, vy / s)
    dt1 = (1 / s, t1 / s)
    for column, i in ((1, 0), (3, 1)):
        dtau = -dt1[i] - 2 * shares / gravity * ds[i]
        J[1, column] = start * tau * ds[i] + v * dtau
        J[3, column] = start * ds[i] - gravity * dtau
    x = np.array([px + vx * dt, (start * s + v) / 2 * tau, vx, v])
    return x, np.einsum("ij,jk,lk->il", J, Sigma, J) + Q


def correct(x, Sigma, z, R):
    """Add information: the inverse covariances, and each weighted by its mean."""
    H = np.array([[1, 0, 0, 0], [0, 1, 0, 0]])
    before, camera = np.linalg.inv(Sigma), np.linalg.inv(R)
    after = np.linalg.inv(before + H.T @ camera @ H)
    return after @ (before @ x + H.T @ camera @ z), after
