"""The plane as complex numbers: the sum of the squared centred points has twice the direction of the wall."""

import numpy as np


def line_parameters(theta, rho):
    """Turn the wall's direction by a right angle; a distance is the real part of a product."""
    z = rho * np.exp(1j * theta)
    wall = np.sqrt(np.sum((z - z.mean()) ** 2))
    normal = 1j * wall / abs(wall)
    return np.angle(normal), (z.mean() * np.conj(normal)).real


def line_jacobians(theta, rho, alpha, r):
    """Differentiate twice the angle: an error dz of a point changes the sum of squares by 2 (z - mean) dz."""
    ray = np.exp(1j * theta)
    z = rho * ray
    centred = z - z.mean()
    total, normal = np.sum(centred**2), np.exp(1j * alpha)
    result = []
    for step in (1j * z, ray):
        turn = np.imag(centred * step / total)
        shift = np.real(step * np.conj(normal)) / len(z) + np.imag(z.mean() * np.conj(normal)) * turn
        result.append(np.stack([turn, shift]))
    return tuple(result)


def fit_line(theta, rho, var_theta, var_rho):
    """Take the angle of the foot of the perpendicular, which has no other name."""
    alpha, r = line_parameters(theta, rho)
    foot = r * np.exp(1j * alpha)
    alpha, r = np.angle(foot), abs(foot)
    J_theta, J_rho = line_jacobians(theta, rho, alpha, r)
    return alpha, r, var_theta * J_theta @ J_theta.T + var_rho * J_rho @ J_rho.T
