"""Derivatives by central differences of the models; the correction by a least-squares problem."""

import numpy as np
from scipy.linalg import block_diag, cholesky, solve_triangular
from scipy.spatial.distance import mahalanobis as scipy_mahalanobis


def _slope(function, at, step=1e-6):
    nudges = step * np.eye(len(at))
    return np.transpose([(function(at + nudge) - function(at - nudge)) / (2 * step) for nudge in nudges])


def _start(errors, k):
    """Pose and landmarks of a pose and k looks in one vector."""
    px, py, theta = errors[:3]
    beta, r = errors[3::2], errors[4::2]
    return np.concatenate(
        [errors[:3], np.stack([px + r * np.cos(theta + beta), py + r * np.sin(theta + beta)], axis=1).ravel()]
    )


def init_landmarks(z, Q, pose, pose_cov):
    """Differentiate the first map by pose and looks."""
    k = len(z) // 2
    at = np.concatenate([pose, z])
    J = _slope(lambda e: _start(e, k), at)
    cov = block_diag(pose_cov, *[Q] * k)
    return _start(at, k), J @ cov @ J.T


def predict(x, Sigma, control, control_cov):
    """Differentiate the step by state and by its three errors."""

    def moved(everything):
        state, (along, across, turn) = everything[:-3].copy(), everything[-3:]
        ahead, theta = control[0] + along, state[2]
        state[0] += ahead * np.cos(theta) - across * np.sin(theta)
        state[1] += ahead * np.sin(theta) + across * np.cos(theta)
        state[2] = theta + control[1] + turn
        return state

    at = np.concatenate([x, np.zeros(3)])
    J = _slope(moved, at)
    return moved(at), J @ block_diag(Sigma, control_cov) @ J.T


def _look(state):
    """Bearing and range of the one landmark behind a pose, as a difference that is small near the state."""
    dx, dy = state[3] - state[0], state[4] - state[1]
    return np.array([np.arctan2(dy, dx) - state[2], np.hypot(dx, dy)])


def measurement(x, j):
    """Differentiate a look by the five numbers that it depends on."""
    five = np.concatenate([x[:3], x[3 + 2 * j : 5 + 2 * j]])
    z = _look(five)
    J = _slope(_look, five)
    return np.array([np.mod(z[0] + np.pi, 2 * np.pi) - np.pi, z[1]]), J[:, :3], J[:, 3:]


def update(x, Sigma, z, Q):
    """Whiten prior and looks, and let least squares find the correction."""
    k, n = len(z) // 2, len(x)
    H, v = np.zeros((2 * k, n)), np.zeros(2 * k)
    for j in range(k):
        five = [0, 1, 2, 3 + 2 * j, 4 + 2 * j]
        H[np.ix_([2 * j, 2 * j + 1], five)] = _slope(_look, x[five])
        off = z[2 * j : 2 * j + 2] - _look(x[five])
        v[2 * j], v[2 * j + 1] = np.angle(np.exp(1j * off[0])), off[1]
    prior = solve_triangular(cholesky(Sigma, lower=True), np.eye(n), lower=True)
    weigh = np.kron(np.eye(k), solve_triangular(cholesky(Q, lower=True), np.eye(2), lower=True))
    A, b = np.vstack([prior, weigh @ H]), np.concatenate([np.zeros(n), weigh @ v])
    _, R = np.linalg.qr(A)
    root = np.linalg.inv(R)
    return x + np.linalg.lstsq(A, b, rcond=None)[0], root @ root.T


def evaluate(x, Sigma, truth):
    """Let SciPy measure."""
    euclidean, distances = [], []
    for j in range(len(truth) // 2):
        at = slice(3 + 2 * j, 5 + 2 * j)
        place = truth[2 * j : 2 * j + 2]
        euclidean.append(np.linalg.norm(x[at] - place))
        distances.append(scipy_mahalanobis(x[at], place, np.linalg.inv(Sigma[at, at])))
    return euclidean, distances
