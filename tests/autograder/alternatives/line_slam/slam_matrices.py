"""Matrices: a projection carries the pose's motion into the state, and lines are homogeneous vectors."""

import numpy as np
from scipy.linalg import block_diag, expm


def transition_model(x, u, dt):
    """Move by the exponential of a twist, differentiate it by a larger exponential, and project."""
    V, omega = u
    twist = np.array([[0, -omega, V], [omega, 0, 0], [0, 0, 0]]) * dt
    steps = [
        np.array([[0, 0, 1], [0, 0, 0], [0, 0, 0]]) * dt,
        np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0]]) * dt,
    ]
    turn = np.array([[np.cos(x[2]), -np.sin(x[2])], [np.sin(x[2]), np.cos(x[2])]])
    move = turn @ expm(twist)[:2, 2]
    by_u = [turn @ expm(np.block([[twist, step], [np.zeros((3, 3)), twist]]))[:2, 5] for step in steps]
    F = np.eye(3, len(x))
    Gx = np.eye(len(x)) + F.T @ np.array([[0, 0, -move[1]], [0, 0, move[0]], [0, 0, 0]]) @ F
    Gu = F.T @ np.vstack([np.transpose(by_u), [0, dt]])
    return x + F.T @ [*move, omega * dt], Gx, Gu


def _frame(pose):
    x, y, theta = pose
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s, x], [s, c, y], [0, 0, 1]])


def compute_predicted_measurements(x, tf, fixed=2):
    """Carry the vectors [cos alpha, sin alpha, -r] and their derivatives; the blocks stand on a diagonal."""
    J = (len(x) - 3) // 2
    alpha, r = x[3:].reshape(J, 2).T
    vectors = np.array([np.cos(alpha), np.sin(alpha), -r])
    whole = _frame(x[:3]) @ _frame(tf)
    a, b, c = whole.T @ vectors
    side = np.where(c > 0, -1, 1)
    by_alpha = (whole.T @ np.array([-vectors[1], vectors[0], 0 * r]))[2]
    heading = np.array([[-np.sin(x[2]), -np.cos(x[2]), 0], [np.cos(x[2]), -np.sin(x[2]), 0], [0, 0, 0]])
    lever = ((heading @ _frame(tf)).T @ vectors)[2]
    pose = [[0 * r, 0 * r, 0 * r - 1], [-side * vectors[0], -side * vectors[1], -side * lever]]
    blocks = [
        np.array([[1, 0], [-s * d, s]]) * (j >= fixed)
        for j, (s, d) in enumerate(zip(side, by_alpha, strict=True))
    ]
    H = np.hstack([np.reshape(np.moveaxis(pose, 2, 0), (2 * J, 3)), block_diag(*blocks)])
    return np.array([np.arctan2(side * b, side * a), -side * c]), H.reshape(J, 2, len(x))
