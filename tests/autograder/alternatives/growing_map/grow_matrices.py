"""Homogeneous lines and one large Jacobian: the new covariance is a single product."""

import numpy as np
from scipy.linalg import block_diag


def _frame(pose):
    px, py, heading = pose
    c, s = np.cos(heading), np.sin(heading)
    return np.array([[c, -s, px], [s, c, py], [0, 0, 1]])


def line_in_world(z, x, tf):
    """Move the vector [cos, sin, -r] by the transposed inverse of both frames, and differentiate it."""
    whole = np.linalg.inv(_frame(x[:3]) @ _frame(tf)).T
    c, s = np.cos(z[0]), np.sin(z[0])
    a, b, minus_r = whole @ [c, s, -z[1]]
    bend = whole[2] @ [-s, c, 0]
    side = -1.0 if minus_r > 0 else 1.0
    by_theta = (np.linalg.inv(_frame(tf)).T @ [-s, c, 0])[2] - bend  # the mounting turns along
    by_pose = np.array([[0, 0, 1], [side * a, side * b, side * by_theta]])
    by_z = np.array([[1, 0], [-side * bend, side]])
    return np.array([np.arctan2(side * b, side * a), -side * minus_r]), by_pose, by_z


def augment(x, Sigma, z, Q, tf):
    """Map the state and the observation together to the larger state."""
    line, by_pose, by_z = line_in_world(z, x, tf)
    n = len(x)
    F = np.block([[np.eye(n), np.zeros((n, 2))], [by_pose, np.zeros((2, n - 3)), by_z]])
    return np.append(x, line), F @ block_diag(Sigma, Q) @ F.T
