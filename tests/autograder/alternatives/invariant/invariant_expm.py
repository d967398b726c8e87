"""Homogeneous matrices: SciPy's exponential, the adjoint column by column, the information form."""

import numpy as np
from scipy.linalg import expm

GENERATORS = np.zeros((3, 3, 3))
GENERATORS[0, 0, 2] = GENERATORS[1, 1, 2] = GENERATORS[2, 1, 0] = 1
GENERATORS[2, 0, 1] = -1


def hat(xi):
    """Return the matrix of a twist."""
    return np.tensordot(xi, GENERATORS, axes=1)


def vee(matrix):
    """Return the twist of a matrix."""
    return np.array([matrix[0, 2], matrix[1, 2], matrix[1, 0]])


def predict(X, P, twist, W, dt):
    """Conjugate the three generators."""
    Ad = np.column_stack([vee(X @ G @ np.linalg.inv(X)) for G in GENERATORS])
    return X @ expm(hat(twist) * dt), P + np.einsum("ij,jk,lk->il", Ad, W, Ad)


def correct(X, P, Y, landmarks, N):
    """Add up informations, landmark by landmark."""
    information, gradient = np.linalg.inv(P), np.zeros(3)
    Nbar = np.linalg.inv(X[:2, :2] @ N @ X[:2, :2].T)
    for y, m in zip(Y, landmarks, strict=True):
        b = np.append(m, 1.0)
        H = -np.column_stack([G @ b for G in GENERATORS])[:2]
        information = information + H.T @ Nbar @ H
        gradient = gradient + H.T @ Nbar @ (X @ y - b)[:2]
    Sigma = np.linalg.inv(information)
    return expm(hat(Sigma @ gradient)) @ X, Sigma
