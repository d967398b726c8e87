"""One beam after the other in plain Python, with the sums in polar form: no point is ever computed."""

import math


def line_parameters(theta, rho):
    """Use sums over all pairs of beams; r may be negative."""
    theta, rho = [float(value) for value in theta], [float(value) for value in rho]
    size = len(theta)
    up = down = 0.0
    for p, phi in zip(rho, theta, strict=True):
        up += p * p * math.sin(2 * phi)
        down += p * p * math.cos(2 * phi)
        for q, psi in zip(rho, theta, strict=True):
            up -= p * q * math.sin(phi + psi) / size
            down -= p * q * math.cos(phi + psi) / size
    alpha = math.atan2(-up, -down) / 2
    return alpha, sum(p * math.cos(phi - alpha) for p, phi in zip(rho, theta, strict=True)) / size


def line_jacobians(theta, rho, alpha, r):
    """Fill lists entry by entry."""
    size = len(theta)
    across = [p * math.cos(phi - alpha) - r for p, phi in zip(rho, theta, strict=True)]
    along = [p * math.sin(phi - alpha) for p, phi in zip(rho, theta, strict=True)]
    middle = sum(along) / size
    scatter = sum((t - middle) ** 2 - n * n for t, n in zip(along, across, strict=True))
    J_theta, J_rho = [[], []], [[], []]
    for phi, n, t in zip(theta, across, along, strict=True):
        steps = ((J_theta, -t, n + r), (J_rho, math.cos(phi - alpha), math.sin(phi - alpha)))
        for J, dn, dt in steps:
            turn = -((t - middle) * dn + n * dt) / scatter
            J[0].append(turn)
            J[1].append(dn / size + middle * turn)
    return J_theta, J_rho


def fit_line(theta, rho, var_theta, var_rho):
    """Normalise first, then add up the covariance one beam after the other."""
    alpha, r = line_parameters(theta, rho)
    if r < 0:
        alpha, r = alpha + math.pi, -r
    if alpha >= math.pi:
        alpha -= 2 * math.pi
    C = [[0.0, 0.0], [0.0, 0.0]]
    for J, variance in zip(line_jacobians(theta, rho, alpha, r), (var_theta, var_rho), strict=True):
        for turn, shift in zip(*J, strict=True):
            C[0][0] += variance * turn * turn
            C[0][1] += variance * turn * shift
            C[1][1] += variance * shift * shift
    C[1][0] = C[0][1]
    return alpha, r, C
