"""A power series in omega dt below a threshold, the closed form above it, in plain Python lists."""

import math


def compute_dynamics(xvec, u, dt):
    """Move along the arc; a and b are the mean cosine and sine of the turn, as series where it is slow."""
    x, y, theta = (float(value) for value in xvec)
    V, omega = (float(value) for value in u)
    q = omega * dt
    if abs(q) < 0.2:
        a = sum((-1) ** k * q ** (2 * k) / math.factorial(2 * k + 1) for k in range(8))
        b = sum((-1) ** k * q ** (2 * k + 1) / math.factorial(2 * k + 2) for k in range(8))
        da = sum((-1) ** k * 2 * k * q ** (2 * k - 1) / math.factorial(2 * k + 1) for k in range(1, 8))
        db = sum((-1) ** k * (2 * k + 1) * q ** (2 * k) / math.factorial(2 * k + 2) for k in range(8))
    else:
        a, b = math.sin(q) / q, (1 - math.cos(q)) / q
        da, db = (math.cos(q) - a) / q, (math.sin(q) - b) / q
    c, s = math.cos(theta), math.sin(theta)
    ahead, side = a * c - b * s, a * s + b * c
    dx, dy = V * dt * ahead, V * dt * side
    g = [x + dx, y + dy, theta + q]
    Gx = [[1, 0, -dy], [0, 1, dx], [0, 0, 1]]
    k = V * dt * dt
    Gu = [[dt * ahead, k * (da * c - db * s)], [dt * side, k * (da * s + db * c)], [0, dt]]
    return g, Gx, Gu
