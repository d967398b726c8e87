"""The motion as an exponential of a matrix of SE(2), and its derivatives from a block matrix."""

import numpy as np
from scipy.linalg import expm


def compute_dynamics(xvec, u, dt):
    """Move by expm(A); the upper right block of expm([[A, E], [0, A]]) is its derivative along E."""
    x, y, theta = xvec
    V, omega = u
    along = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    around = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    pose = np.array([[np.cos(theta), -np.sin(theta), x], [np.sin(theta), np.cos(theta), y], [0.0, 0.0, 1.0]])
    A = dt * (V * along + omega * around)

    def derivative(E):
        return (pose @ expm(np.block([[A, dt * E], [np.zeros((3, 3)), A]]))[:3, 3:])[:2, 2]

    place = (pose @ expm(A))[:2, 2]
    dx, dy = place - [x, y]
    Gx = np.array([[1.0, 0.0, -dy], [0.0, 1.0, dx], [0.0, 0.0, 1.0]])
    Gu = np.vstack([np.column_stack([derivative(along), derivative(around)]), [0.0, dt]])
    return np.array([*place, theta + omega * dt]), Gx, Gu
