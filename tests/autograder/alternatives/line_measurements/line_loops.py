"""One line after the other in plain Python lists, with the scanner put into the world first."""

import math


def transform_line_to_scanner_frame(line, x, tf_base_to_camera):
    """Find the scanner in the world; the angle may come out in any turn."""
    alpha, r = (float(value) for value in line)
    px, py, theta = (float(value) for value in x)
    cx, cy, turn = (float(value) for value in tf_base_to_camera)
    c, s = math.cos(theta), math.sin(theta)
    lever = [c * cx - s * cy, s * cx + c * cy]
    distance = r - (px + lever[0]) * math.cos(alpha) - (py + lever[1]) * math.sin(alpha)
    by_heading = lever[1] * math.cos(alpha) - lever[0] * math.sin(alpha)
    Hx = [[0, 0, -1], [-math.cos(alpha), -math.sin(alpha), by_heading]]
    return [alpha - theta - turn + 4 * math.pi, distance], Hx


def normalize_line_parameters(h, Hx):
    """Take the other name at r = 0, and wrap by counting turns to (-pi, pi]."""
    alpha, r = float(h[0]), float(h[1])
    rows = [list(map(float, row)) for row in Hx]
    if r <= 0:
        alpha, r, rows[1] = alpha + math.pi, -r, [-value for value in rows[1]]
    while alpha > math.pi:
        alpha -= 2 * math.pi
    while alpha <= -math.pi:
        alpha += 2 * math.pi
    return [alpha, r], rows


def compute_predicted_measurements(x, map_lines, tf_base_to_camera):
    """Transform and normalise one line after the other."""
    hs, Hs = [[], []], []
    for j in range(map_lines.shape[1]):
        h, Hx = normalize_line_parameters(
            *transform_line_to_scanner_frame(map_lines[:, j], x, tf_base_to_camera)
        )
        hs[0].append(h[0])
        hs[1].append(h[1])
        Hs.append(Hx)
    return hs, Hs
