"""One particle after the other, in plain Python."""

import math


def predict(xs, u, alphas, dt, rng):
    """Integrate the arc of each particle in closed form, or by its limit."""
    v2, w2 = float(u[0]) ** 2, float(u[1]) ** 2
    sigma = [math.sqrt(alphas[2 * i] * v2 + alphas[2 * i + 1] * w2) for i in range(3)]
    moved = xs.copy()
    for row in moved:
        v, omega, gamma = (float(u[i]) + sigma[i] * rng.standard_normal() for i in range(3))
        last = row[2] + omega * dt
        if abs(omega) > 1e-6:
            row[0] += v / omega * (math.sin(last) - math.sin(row[2]))
            row[1] += v / omega * (math.cos(row[2]) - math.cos(last))
        else:
            row[0] += v * dt * math.cos(row[2] + omega * dt / 2)
            row[1] += v * dt * math.sin(row[2] + omega * dt / 2)
        row[2] = last + gamma * dt
    return moved


def correct(xs, ws, z, landmarks, Q):
    """Add up logarithms, particle by particle and landmark by landmark."""
    (a, b), (_, c) = Q
    det = a * c - b * b
    logs = []
    for (x, y, theta), w in zip(xs, ws, strict=True):
        log = math.log(w) if w > 0 else -math.inf
        for j, (mx, my) in enumerate(landmarks):
            e = math.remainder(z[2 * j] - math.atan2(my - y, mx - x) + theta, 2 * math.pi)
            r = z[2 * j + 1] - math.dist((mx, my), (x, y))
            log -= (c * e * e - 2 * b * e * r + a * r * r) / det / 2
        logs.append(log)
    best = max(logs)
    if best == -math.inf:
        return [1 / len(logs)] * len(logs)
    likely = [math.exp(log - best) for log in logs]
    return [w / math.fsum(likely) for w in likely]


def effective_sample_size(ws):
    """Scale by the sum, then add the squares."""
    total = math.fsum(ws)
    return 1 / math.fsum((w / total) ** 2 for w in ws)
