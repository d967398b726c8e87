"""The plane as complex numbers: the position is an integral of exp(i heading), taken by Gauss quadrature."""

import numpy as np


def compute_dynamics(xvec, u, dt):
    """Integrate the velocity and its derivative by omega at 20 nodes: exact for a few radians."""
    theta, (V, omega) = xvec[2], u
    nodes, weights = np.polynomial.legendre.leggauss(20)
    t, w = (nodes + 1) * dt / 2, weights * dt / 2
    direction = np.exp(1j * (theta + omega * t))
    by_V = w @ direction
    by_omega = V * (w @ (1j * t * direction))
    by_theta = 1j * V * by_V
    place = complex(xvec[0], xvec[1]) + V * by_V
    g = np.array([place.real, place.imag, theta + omega * dt])
    Gx = np.eye(3)
    Gx[:2, 2] = by_theta.real, by_theta.imag
    Gu = np.array([[by_V.real, by_omega.real], [by_V.imag, by_omega.imag], [0.0, dt]])
    return g, Gx, Gu
