"""The handout's way: the closed form, and below EPSILON_OMEGA its limits."""

import numpy as np

EPSILON_OMEGA = 1e-3


def compute_dynamics(xvec, u, dt):
    """Move by the closed form, or by its limits if omega is small."""
    x, y, theta = xvec
    V, omega = u
    new = theta + omega * dt
    if abs(omega) < EPSILON_OMEGA:
        g = np.array([x + V * dt * np.cos(theta), y + V * dt * np.sin(theta), new])
        by_theta = [-V * dt * np.sin(theta), V * dt * np.cos(theta)]
        by_V = [dt * np.cos(theta), dt * np.sin(theta)]
        by_omega = [-V * dt**2 / 2 * np.sin(theta), V * dt**2 / 2 * np.cos(theta)]
    else:
        sines, cosines = np.sin(new) - np.sin(theta), np.cos(new) - np.cos(theta)
        g = np.array([x + V / omega * sines, y - V / omega * cosines, new])
        by_theta = [V / omega * cosines, V / omega * sines]
        by_V = [sines / omega, -cosines / omega]
        by_omega = [
            V / omega**2 * (-sines + omega * dt * np.cos(new)),
            V / omega**2 * (cosines + omega * dt * np.sin(new)),
        ]
    Gx = np.array([[1, 0, by_theta[0]], [0, 1, by_theta[1]], [0, 0, 1]])
    Gu = np.array([[by_V[0], by_omega[0]], [by_V[1], by_omega[1]], [0, dt]])
    return g, Gx, Gu
