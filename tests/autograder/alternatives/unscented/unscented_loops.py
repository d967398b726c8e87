"""One point after the other in plain Python, as a textbook lists it."""

import math

import numpy as np


def sigma_points(mean, cov, kappa):
    """Write the root of Cholesky out."""
    n = len(mean)
    L = [[0.0] * n for _ in range(n)]
    for j in range(n):
        for i in range(j, n):
            left = (n + kappa) * cov[i][j] - sum(L[i][k] * L[j][k] for k in range(j))
            L[i][j] = math.sqrt(left) if i == j else left / L[j][j]
    points = [list(mean)]
    for sign in (1, -1):
        points += [[mean[i] + sign * L[i][j] for i in range(n)] for j in range(n)]
    return points, [kappa / (n + kappa)] + [1 / (2 * (n + kappa))] * (2 * n)


def _moved(x, y, theta, v, omega, gamma, dt):
    if abs(omega * dt) < 1e-7:
        middle = theta + omega * dt / 2
        return [x + v * dt * math.cos(middle), y + v * dt * math.sin(middle), theta + (omega + gamma) * dt]
    end = theta + omega * dt
    r = v / omega
    return [
        x + r * (math.sin(end) - math.sin(theta)),
        y + r * (math.cos(theta) - math.cos(end)),
        end + gamma * dt,
    ]


def predict(mean, cov, u, M, dt, kappa):
    """Add up mean and covariance point by point."""
    joint = np.zeros((6, 6))
    joint[:3, :3], joint[3:, 3:] = cov, M
    points, weights = sigma_points([*mean, *u], joint, kappa)
    ends = [_moved(*point, dt) for point in points]
    after = [sum(w * end[i] for w, end in zip(weights, ends, strict=True)) for i in range(3)]
    about = ends[0] if kappa < 0 else after
    Sigma = [[0.0] * 3 for _ in range(3)]
    for w, end in zip(weights, ends, strict=True):
        for i in range(3):
            for j in range(3):
                Sigma[i][j] += w * (end[i] - about[i]) * (end[j] - about[j])
    return after, Sigma


def correct(mean, cov, z, landmarks, Q, kappa):
    """Take residuals from what is seen, and subtract K S K^T."""
    points, weights = sigma_points(mean, cov, kappa)
    size = len(z)
    if not size:
        return np.array(mean), np.array(cov)
    off = []
    for px, py, theta in points:
        row = []
        for i, (mx, my) in enumerate(landmarks):
            bearing = math.atan2(my - py, mx - px) - theta
            first = math.atan2(my - points[0][1], mx - points[0][0]) - points[0][2]
            row.append(math.remainder(bearing - first, 2 * math.pi))
            row.append(math.hypot(my - py, mx - px) - math.hypot(my - points[0][1], mx - points[0][0]))
            if len(off) == 0:
                row[2 * i : 2 * i + 2] = [0.0, 0.0]
        off.append(row)
    middle = [sum(w * row[i] for w, row in zip(weights, off, strict=True)) for i in range(size)]
    v = []
    for i, (mx, my) in enumerate(landmarks):
        bearing = math.atan2(my - mean[1], mx - mean[0]) - mean[2]
        v.append(math.remainder(z[2 * i] - bearing - middle[2 * i], 2 * math.pi))
        v.append(z[2 * i + 1] - math.hypot(my - mean[1], mx - mean[0]) - middle[2 * i + 1])
    S, C = np.zeros((size, size)), np.zeros((3, size))
    for i in range(0, size, 2):
        S[i : i + 2, i : i + 2] = Q
    for w, row, point in zip(weights, off, points, strict=True):
        e = np.array(row) - (0 if kappa < 0 else np.array(middle))
        S += w * np.outer(e, e)
        C += w * np.outer(np.array(point) - mean, e)
    K = C @ np.linalg.inv(S)
    return mean + K @ v, cov - K @ S @ K.T
