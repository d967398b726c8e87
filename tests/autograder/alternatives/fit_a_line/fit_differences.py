"""Without a derivative by hand: Newton's steps on the cost from the best of many starts, and central differences."""

import numpy as np


def line_parameters(theta, rho):
    """Minimise the cost over the direction; for each direction the best r is a mean."""
    starts = np.linspace(-np.pi / 2, np.pi / 2, 45)
    alpha = starts[np.argmin(np.var(rho * np.cos(theta - starts[:, None]), axis=1))]
    for _ in range(4):
        across, along = rho * np.cos(theta - alpha), rho * np.sin(theta - alpha)
        slope = np.mean((across - np.mean(across)) * along)
        alpha -= slope / (np.var(along) - np.var(across))
    return alpha, np.mean(rho * np.cos(theta - alpha))


def line_jacobians(theta, rho, alpha, r):
    """Fit again with one beam changed, from both sides, and give the change the sign of the line's name."""
    mine = line_parameters(theta, rho)
    side = np.cos(alpha - mine[0])
    result = []
    for which in range(2):
        columns = []
        for i in range(len(theta)):
            ends = []
            for step in (2e-5, -2e-5):
                beams = [np.array(theta, dtype=float), np.array(rho, dtype=float)]
                beams[which][i] += step
                line = line_parameters(*beams)
                near = (line[0] - mine[0] + np.pi / 2) % np.pi - np.pi / 2
                sign = np.cos(line[0] - mine[0] - near)
                ends.append([near, side * sign * line[1]])
            columns.append((np.array(ends[0]) - ends[1]) / 4e-5)
        result.append(np.array(columns).T)
    return tuple(result)


def fit_line(theta, rho, var_theta, var_rho):
    """Square the differences and add them up."""
    alpha, r = line_parameters(theta, rho)
    if r < 0:
        alpha, r = (alpha + 2 * np.pi) % (2 * np.pi) - np.pi, -r
    J_theta, J_rho = line_jacobians(theta, rho, alpha, r)
    C = np.einsum("ai,bi->ab", J_theta, J_theta) * var_theta + np.einsum("ai,bi->ab", J_rho, J_rho) * var_rho
    return (alpha + np.pi) % (2 * np.pi) - np.pi, r, C
