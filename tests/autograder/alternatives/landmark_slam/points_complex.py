"""The plane as complex numbers; the whole covariance by one large derivative; the correction by information."""

import numpy as np


def init_landmarks(z, Q, pose, pose_cov):
    """Place landmarks by turning and stretching, and push all errors at once through one derivative."""
    k = len(z) // 2
    ray = z[1::2] * np.exp(1j * (z[0::2] + pose[2]))
    place = complex(pose[0], pose[1]) + ray
    J = np.zeros((3 + 2 * k, 3 + 2 * k))
    J[:3, :3] = np.eye(3)
    for j in range(k):
        rows = slice(3 + 2 * j, 5 + 2 * j)
        turned, stretched = 1j * ray[j], ray[j] / z[2 * j + 1]
        J[rows, :3] = [[1, 0, turned.real], [0, 1, turned.imag]]
        J[rows, rows] = [[turned.real, stretched.real], [turned.imag, stretched.imag]]
    errors = np.zeros_like(J)
    errors[:3, :3] = pose_cov
    errors[3:, 3:] = np.kron(np.eye(k), Q)
    return [*pose, *np.column_stack([place.real, place.imag]).ravel()], J @ errors @ J.T


def predict(x, Sigma, control, control_cov):
    """Move a complex place, with a derivative of the whole state by state and errors."""
    step = control[0] * np.exp(1j * x[2])
    after = np.array(x, dtype=float)
    after[:3] += [step.real, step.imag, control[1]]
    J = np.hstack([np.eye(len(x)), np.zeros((len(x), 3))])
    J[0, 2], J[1, 2] = -step.imag, step.real
    axis = np.exp(1j * x[2])
    J[0, -3:], J[1, -3:], J[2, -1] = [axis.real, -axis.imag, 0], [axis.imag, axis.real, 0], 1.0
    errors = np.zeros((len(x) + 3, len(x) + 3))
    errors[:-3, :-3], errors[-3:, -3:] = Sigma, control_cov
    return after, np.einsum("ij,jk,lk->il", J, errors, J)


def measurement(x, j):
    """Take bearing and range as the parts of a logarithm; its derivative is one over the difference."""
    delta = complex(x[3 + 2 * j] - x[0], x[4 + 2 * j] - x[1])
    bearing = np.angle(delta * np.exp(-1j * x[2]))
    slope, r = 1 / delta, abs(delta)
    Hl = np.array([[slope.imag, slope.real], [r * slope.real, -r * slope.imag]])
    return np.array([bearing, r]), np.hstack([-Hl, [[-1.0], [0.0]]]), Hl


def update(x, Sigma, z, Q):
    """Add what all looks say to the inverse covariance."""
    information = np.linalg.inv(Sigma)
    weight, pull = np.linalg.inv(Q), np.zeros(len(x))
    for j in range(len(z) // 2):
        delta = complex(x[3 + 2 * j] - x[0], x[4 + 2 * j] - x[1])
        slope, r = 1 / delta, abs(delta)
        H = np.zeros((2, len(x)))
        H[:, 3 + 2 * j : 5 + 2 * j] = [[slope.imag, slope.real], [r * slope.real, -r * slope.imag]]
        H[:, :2], H[0, 2] = -H[:, 3 + 2 * j : 5 + 2 * j], -1.0
        off = np.array([np.angle(np.exp(1j * (z[2 * j] + x[2])) / delta), z[2 * j + 1] - r])
        information, pull = information + H.T @ weight @ H, pull + H.T @ weight @ off
    after = np.linalg.inv(information)
    return x + after @ pull, (after + after.T) / 2


def evaluate(x, Sigma, truth):
    """Measure by complex errors and the formula of the inverse of a 2 by 2 matrix."""
    off = (x[3::2] - truth[::2]) + 1j * (x[4::2] - truth[1::2])
    a, b, c = (
        np.array([Sigma[i + p, i + q] for i in range(3, len(x), 2)]) for p, q in ((0, 0), (0, 1), (1, 1))
    )
    d2 = (c * off.real**2 - 2 * b * off.real * off.imag + a * off.imag**2) / (a * c - b * b)
    return abs(off), np.sqrt(d2)
