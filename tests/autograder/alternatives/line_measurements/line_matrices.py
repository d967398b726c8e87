"""Lines as homogeneous vectors [cos alpha, sin alpha, -r], moved by the transpose of a homogeneous matrix."""

import numpy as np


def _frame(pose):
    x, y, theta = pose
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s, x], [s, c, y], [0, 0, 1]]), np.array([[-s, -c, 0], [c, -s, 0], [0, 0, 0]])


def transform_line_to_scanner_frame(line, x, tf_base_to_camera):
    """Move the vector through both frames; differentiate the matrix of the robot's frame entry by entry."""
    alpha, r = line
    vector = np.array([np.cos(alpha), np.sin(alpha), -r])
    robot, turning = _frame(x)
    scanner, _ = _frame(tf_base_to_camera)
    a, b, c = (robot @ scanner).T @ vector
    slopes = [np.zeros((3, 3)), np.zeros((3, 3)), turning]
    slopes[0][0, 2] = slopes[1][1, 2] = 1
    columns = []
    for slope in slopes:
        da, db, dc = (slope @ scanner).T @ vector
        columns.append([(a * db - b * da) / (a * a + b * b), -dc])
    return np.array([np.arctan2(b, a), -c]), np.array(columns).T


def normalize_line_parameters(h, Hx):
    """Change the side by a diagonal matrix, and take the angle from its sine and cosine."""
    side = 1 if h[1] >= 0 else -1
    alpha = np.arctan2(side * np.sin(h[0]), side * np.cos(h[0]))
    return np.array([alpha, side * h[1]]), np.diag([1, side]) @ Hx


def compute_predicted_measurements(x, map_lines, tf_base_to_camera):
    """Move all vectors of the map at once; an angle of pi comes out as +pi."""
    alpha, r = map_lines
    vectors = np.array([np.cos(alpha), np.sin(alpha), -r])
    robot, turning = _frame(x)
    scanner, _ = _frame(tf_base_to_camera)
    a, b, c = (robot @ scanner).T @ vectors
    side = np.where(c > 0, -1, 1)
    lever = ((turning @ scanner).T @ vectors)[2]
    zero = np.zeros_like(r)
    rows = [[zero, zero, zero - 1], -side * np.array([vectors[0], vectors[1], lever])]
    return np.array([np.arctan2(side * b, side * a), -side * c]), np.moveaxis(np.array(rows), 2, 0)
