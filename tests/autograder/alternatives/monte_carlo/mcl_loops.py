"""Plain Python, one particle and one line after the other; limits as the handout has them."""

import math
import warnings


def transition_model(xs, us, dt):
    """Move one particle after the other."""
    moved = []
    for (x, y, theta), (V, omega) in zip(xs.tolist(), us.tolist(), strict=True):
        end = theta + omega * dt
        if abs(omega) < 1e-3:
            dx, dy = V * dt * math.cos(theta), V * dt * math.sin(theta)
        else:
            dx = V / omega * (math.sin(end) - math.sin(theta))
            dy = V / omega * (math.cos(theta) - math.cos(end))
        moved.append([x + dx, y + dy, end])
    return moved


def compute_predicted_measurements(xs, map_lines, tf_base_to_camera):
    """Fill the lists line by line."""
    x_cam, y_cam, theta_cam = tf_base_to_camera.tolist()
    hs = []
    for x, y, theta in xs.tolist():
        X = x + x_cam * math.cos(theta) - y_cam * math.sin(theta)
        Y = y + x_cam * math.sin(theta) + y_cam * math.cos(theta)
        alphas, rs = [], []
        for alpha, r in map_lines.T.tolist():
            h_alpha, h_r = alpha - theta - theta_cam, r - X * math.cos(alpha) - Y * math.sin(alpha)
            if h_r < 0:
                h_alpha, h_r = h_alpha + math.pi, -h_r
            alphas.append((h_alpha + math.pi) % (2 * math.pi) - math.pi)
            rs.append(h_r)
        hs.append([alphas, rs])
    return hs


def _form(v, Q):
    """Return v^T Q^-1 v of two numbers."""
    (a, b), (_, d) = Q.tolist()
    return (d * v[0] ** 2 - 2 * b * v[0] * v[1] + a * v[1] ** 2) / (a * d - b * b)


def compute_innovations(z_raw, Q_raw, hs):
    """Search the nearest line by comparing."""
    vs = []
    for h in hs:
        row = []
        for (alpha, r), Q in zip(z_raw.T.tolist(), Q_raw, strict=True):
            best = math.inf
            for h_alpha, h_r in h.T.tolist():
                v = ((alpha - h_alpha + math.pi) % (2 * math.pi) - math.pi, r - h_r)
                if _form(v, Q) < best:
                    best, nearest = _form(v, Q), v
            row += nearest
        vs.append(row)
    return vs


def measurement_weights(vs, Q_raw, ws):
    """Sum logarithms particle by particle."""
    logs = []
    for row, w in zip(vs.tolist(), ws.tolist(), strict=True):
        try:
            total = math.log(w) if w > 0 else -math.inf
            for i, Q in enumerate(Q_raw):
                total -= _form(row[2 * i : 2 * i + 2], Q) / 2
        except OverflowError:
            total = -math.inf
        logs.append(total)
    best = max(logs)
    if best == -math.inf:
        warnings.warn("no particle is possible: all weights are 1/M", RuntimeWarning, stacklevel=2)
        return [1 / len(logs)] * len(logs)
    parts = [math.exp(one - best) for one in logs]
    return [part / sum(parts) for part in parts]
