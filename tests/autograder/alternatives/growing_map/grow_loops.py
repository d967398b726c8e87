"""Plain Python: sines and cosines of one line, and sums over entries."""

import math


def line_in_world(z, x, tf):
    """Add the angles, and add up what lies between the origin and the line."""
    px, py, theta = (float(value) for value in x[:3])
    cx, cy, turn = (float(value) for value in tf)
    beta = float(z[0]) + turn
    alpha = beta + theta
    r = float(z[1]) + px * math.cos(alpha) + py * math.sin(alpha) + cx * math.cos(beta) + cy * math.sin(beta)
    by_theta = py * math.cos(alpha) - px * math.sin(alpha)
    by_alpha = by_theta + cy * math.cos(beta) - cx * math.sin(beta)
    sign = 1.0
    if r < 0:
        alpha, r, sign = alpha + math.pi, -r, -1.0
        by_theta, by_alpha = -by_theta, -by_alpha
    by_pose = [[0.0, 0.0, 1.0], [math.cos(alpha), math.sin(alpha), by_theta]]
    while alpha >= math.pi:
        alpha -= 2 * math.pi
    while alpha < -math.pi:
        alpha += 2 * math.pi
    return [alpha, r], by_pose, [[1.0, 0.0], [by_alpha, sign]]


def augment(x, Sigma, z, Q, tf):
    """Fill in the covariance entry by entry."""
    line, by_pose, by_z = line_in_world(z, x, tf)
    n = len(x)
    grown = [[0.0] * (n + 2) for _ in range(n + 2)]
    for i in range(n):
        for k in range(n):
            grown[i][k] = float(Sigma[i, k])
    for i in range(2):
        for k in range(n):
            grown[n + i][k] = grown[k][n + i] = sum(by_pose[i][m] * float(Sigma[m, k]) for m in range(3))
    for i in range(2):
        for k in range(2):
            own = sum(by_z[i][a] * float(Q[a, b]) * by_z[k][b] for a in range(2) for b in range(2))
            grown[n + i][n + k] = own + sum(grown[n + i][m] * by_pose[k][m] for m in range(3))
    return [*map(float, x), *line], grown
