"""The normal as the last singular vector, and the derivatives by solving the linear system of both conditions."""

import numpy as np
from scipy.linalg import block_diag


def line_parameters(theta, rho):
    """Decompose the centred points; the sign of the normal, and so of r, is the decomposition's."""
    points = np.column_stack([rho * np.cos(theta), rho * np.sin(theta)])
    mean = points.mean(axis=0)
    normal = np.linalg.svd(points - mean)[2][-1]
    return np.arctan2(normal[1], normal[0]), normal @ mean


def line_jacobians(theta, rho, alpha, r):
    """Solve for the derivatives: by the line times them, plus by the beams, is 0."""
    c, s = np.cos(theta - alpha), np.sin(theta - alpha)
    n, t = rho * c - r, rho * s
    # The conditions are sum n t = 0 and sum n = 0.
    by_line = np.array([[np.sum(t * t - n * (n + r)), -t.sum()], [t.sum(), -len(t)]])
    by_theta = np.stack([-t * t + n * (n + r), -t])
    by_rho = np.stack([c * t + n * s, c])
    both = -np.linalg.solve(by_line, np.hstack([by_theta, by_rho]))
    return both[:, : len(t)], both[:, len(t) :]


def fit_line(theta, rho, var_theta, var_rho):
    """Propagate one covariance of all beams."""
    normal = np.array([np.cos(a := line_parameters(theta, rho)[0]), np.sin(a)])
    r = normal @ np.mean([rho * np.cos(theta), rho * np.sin(theta)], axis=1)
    normal, r = (normal, r) if r >= 0 else (-normal, -r)
    alpha = np.arctan2(normal[1], normal[0])
    J = np.hstack(line_jacobians(theta, rho, alpha, r))
    identity = np.eye(len(theta))
    return alpha, r, J @ block_diag(var_theta * identity, var_rho * identity) @ J.T
