"""Plain Python lists, one line after the other; limits as the handout has them."""

import math


def transition_model(x, u, dt):
    """Fill the matrices entry by entry."""
    n = len(x)
    V, omega = float(u[0]), float(u[1])
    theta, end = float(x[2]), float(x[2]) + omega * dt
    c, s = math.cos(theta), math.sin(theta)
    if abs(omega) < 1e-3:
        dx, dy = V * dt * c, V * dt * s
        by_V, by_omega = [dt * c, dt * s], [-V * dt**2 * s / 2, V * dt**2 * c / 2]
    else:
        by_V = [(math.sin(end) - s) / omega, (c - math.cos(end)) / omega]
        dx, dy = V * by_V[0], V * by_V[1]
        by_omega = [(V * dt * math.cos(end) - dx) / omega, (V * dt * math.sin(end) - dy) / omega]
    g = [float(value) for value in x]
    g[0], g[1], g[2] = g[0] + dx, g[1] + dy, end
    Gx = [[1.0 if i == j else 0.0 for j in range(n)] for i in range(n)]
    Gx[0][2], Gx[1][2] = -dy, dx
    Gu = [[0.0, 0.0] for _ in range(n)]
    Gu[0], Gu[1], Gu[2] = [by_V[0], by_omega[0]], [by_V[1], by_omega[1]], [0.0, dt]
    return g, Gx, Gu


def compute_predicted_measurements(x, tf, fixed=2):
    """Find the scanner in the world once, and then one line after the other."""
    theta = float(x[2])
    c, s = math.cos(theta), math.sin(theta)
    lever = [c * tf[0] - s * tf[1], s * tf[0] + c * tf[1]]
    X, Y = x[0] + lever[0], x[1] + lever[1]
    hs, Hs = [[], []], []
    for j in range((len(x) - 3) // 2):
        alpha, r = float(x[3 + 2 * j]), float(x[4 + 2 * j])
        ca, sa = math.cos(alpha), math.sin(alpha)
        seen, distance = alpha - theta - tf[2], r - X * ca - Y * sa
        top = [0.0] * len(x)
        row = [0.0] * len(x)
        top[2] = -1.0
        row[:3] = [-ca, -sa, lever[1] * ca - lever[0] * sa]
        if j >= fixed:
            top[3 + 2 * j] = 1.0
            row[3 + 2 * j], row[4 + 2 * j] = X * sa - Y * ca, 1.0
        if distance < 0:
            seen, distance, row = seen + math.pi, -distance, [-value for value in row]
        while seen > math.pi:
            seen -= 2 * math.pi
        while seen < -math.pi:
            seen += 2 * math.pi
        hs[0].append(seen)
        hs[1].append(distance)
        Hs.append([top, row])
    return hs, Hs
