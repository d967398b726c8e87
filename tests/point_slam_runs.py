"""SLAM with points for many runs at once: a world, drives through it, and both filters with one axis more.

A robot drives a circle in steps of a metre inside a ring of six landmarks, and sees all of them at the start and
after each step. Arrays have the runs first: states (B, 15), looks (B, 12). Sigma is the covariance of estimate minus
truth, P of the motion of the world between them. The filters begin and move as they are told to, so that they can be
broken; test_consistency_point_slam.py holds them against the reference.
"""

from dataclasses import dataclass

import numpy as np

from roboloc.angles import wrap

STEPS, STEP = 30, np.array([1.0, np.pi / 10])
START = np.array([0.0, -10 / np.pi, 0.0])
QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])  # a quarter turn
AT_X = np.array([0, *range(3, 15, 2)])
AT_Y = AT_X + 1


@dataclass(frozen=True, eq=False)
class Case:
    """Covariances of the first pose, of a step and of a bearing and range; the radius of the ring of landmarks [m]."""

    pose_cov: np.ndarray
    R: np.ndarray
    Q: np.ndarray
    radius: float

    @property
    def points(self):
        """Return the landmarks, (6, 2)."""
        angle = (np.arange(6) + 0.3) * np.pi / 3
        return self.radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def rotations(theta):
    """Return the rotations (B, 2, 2) by angles (B,)."""
    c, s = np.cos(theta)[:, None, None], np.sin(theta)[:, None, None]
    return c * np.eye(2) + s * QUARTER


def stepped(x, noise=(0.0, 0.0, 0.0)):
    """Return states (B, n) after one step with an error along, across and in heading."""
    way = np.array([STEP[0], 0.0]) + np.array(noise)[..., :2] + np.zeros((len(x), 2))
    x = x.copy()
    x[:, :2] += (rotations(x[:, 2]) @ way[..., None])[..., 0]
    x[:, 2] += STEP[1] + np.array(noise)[..., 2]
    return x


def looks(x):
    """Return bearing and range of all landmarks (B, 12) and their derivative (B, 12, 15), for states (B, 15)."""
    delta = x[:, 3:].reshape(len(x), 6, 2) - x[:, None, :2]
    r = np.hypot(delta[..., 0], delta[..., 1])
    along = delta / r[..., None]
    h = np.stack([np.arctan2(delta[..., 1], delta[..., 0]) - x[:, 2:3], r], axis=-1)
    Hl = np.stack([along @ QUARTER.T / r[..., None], along], axis=-2)
    H = np.zeros((len(x), 6, 2, 15))
    H[..., :2], H[:, :, 0, 2] = -Hl, -1.0
    for j in range(6):
        H[:, j, :, 3 + 2 * j : 5 + 2 * j] = Hl[:, j]
    return h.reshape(-1, 12), H.reshape(-1, 12, 15)


def drive(case, rngs, runs):
    """Draw what happens: true states (STEPS + 1, B, 15) and looks (STEPS + 1, B, 12)."""

    def normal(covariance, *shape):
        root = np.linalg.cholesky(covariance).T
        return np.concatenate([rng.normal(size=(runs, *shape, len(root))) @ root for rng in rngs])

    pose = START + normal(case.pose_cov)
    x = np.hstack([pose, np.tile(case.points.ravel(), (len(pose), 1))])
    steps, errors = normal(case.R, STEPS), normal(case.Q, STEPS + 1, 6).reshape(len(x), STEPS + 1, 12)
    truth, zs = [], []
    for k in range(STEPS + 1):
        x = stepped(x, steps[:, k - 1]) if k else x
        truth.append(x)
        zs.append(looks(x)[0] + errors[:, k])
    return np.array(truth), np.array(zs)


def transposed(A):
    """Return A^T of each run."""
    return A.swapaxes(-1, -2)


def begun(case, z):
    """Return the first map and its covariance."""
    count = len(z)
    beta, r = z[:, ::2] + START[2], z[:, 1::2, None]
    along = np.stack([np.cos(beta), np.sin(beta)], axis=-1)
    across = along @ QUARTER.T
    A = np.zeros((count, 15, 3))
    A[:, :3], A[:, 3:, :2] = np.eye(3), np.tile(np.eye(2), (6, 1))
    A[:, 3:, 2] = (r * across).reshape(count, 12)
    Sigma = A @ case.pose_cov @ transposed(A)
    J_z = np.stack([r * across, along], axis=-1)
    own = J_z @ case.Q @ transposed(J_z)
    for j in range(6):
        Sigma[:, 3 + 2 * j : 5 + 2 * j, 3 + 2 * j : 5 + 2 * j] += own[:, j]
    return np.hstack([np.tile(START, (count, 1)), (START[:2] + r * along).reshape(count, 12)]), Sigma


def moved(Sigma, G):
    """Push a covariance through the motion of the pose beside an identity."""
    Sigma = Sigma.copy()
    Sigma[:, :3] = G @ Sigma[:, :3]
    Sigma[:, :, :3] = Sigma[:, :, :3] @ transposed(G)
    return Sigma


def conditioned(Sigma, v, H, Q):
    """Return correction and covariance after an innovation."""
    HSigma = H @ Sigma
    K = transposed(np.linalg.solve(HSigma @ transposed(H) + np.kron(np.eye(6), Q), HSigma))
    Sigma = Sigma - K @ HSigma
    return (K @ v[..., None])[..., 0], (Sigma + transposed(Sigma)) / 2


def innovations(x, z):
    """Return the wrapped innovation and its derivative."""
    h, H = looks(x)
    v = z - h
    v[:, ::2] = wrap(v[:, ::2])
    return v, H


def standard(case, zs, begin=begun, move=moved):
    """Yield mean and covariance of the standard filter after each look."""
    x, Sigma = begin(case, zs[0])
    yield x, Sigma
    for z in zs[1:]:
        L, G = np.tile(np.eye(3), (2, len(x), 1, 1))
        L[:, :2, :2] = rotations(x[:, 2])
        G[:, :2, 2] = STEP[0] * L[:, :2, 1]
        x, Sigma = stepped(x), move(Sigma, G)
        Sigma[:, :3, :3] += L @ case.R @ transposed(L)
        correction, Sigma = conditioned(Sigma, *innovations(x, z), case.Q)
        x = x + correction
        yield x, Sigma


def points(x):
    """Return robot and landmarks as complex numbers, (B, 7)."""
    return x[:, AT_X] + 1j * x[:, AT_Y]


def with_points(heading, numbers):
    """Return headings and complex places as states."""
    x = np.empty((len(numbers), 15))
    x[:, AT_X], x[:, AT_Y], x[:, 2] = numbers.real, numbers.imag, heading
    return x


def turn_of(x):
    """Return what an error of the heading alone is as a motion of the world, (B, 15), the heading included."""
    return with_points(np.ones(len(x)), -1j * points(x))


def chord(omega):
    """Return the mean of exp(i s omega) for s from 0 to 1, (B, 1)."""
    h = omega[:, None] / 2
    return np.exp(1j * h) * np.sinc(h / np.pi)


def right_invariant(case, zs):
    """Yield mean and covariance of the right-invariant filter after each look."""
    x, Sigma = begun(case, zs[0])
    M = np.tile(np.eye(15), (len(x), 1, 1))
    M[:, :, 2] = turn_of(x)
    P = M @ Sigma @ transposed(M)
    yield x, P
    for z in zs[1:]:
        N = np.zeros((len(x), 15, 3))
        N[:, :2, :2] = rotations(x[:, 2])
        x = stepped(x)
        N[:, :, 2] = turn_of(x)
        P = P + N @ case.R @ transposed(N)
        v, H = innovations(x, z)
        H[:, :, 2] = 0.0
        xi, P = conditioned(P, v, H, case.Q)
        turn = np.exp(1j * xi[:, 2:3])
        x = with_points(x[:, 2] + xi[:, 2], turn * points(x) + chord(xi[:, 2]) * points(xi))
        yield x, P


def ordinary_error(x, truth):
    """Return estimate minus truth."""
    error = x - truth
    error[:, 2] = wrap(error[:, 2])
    return error


def invariant_error(x, truth):
    """Return the motion of the world that carries the truth to the estimate."""
    omega = wrap(x[:, 2] - truth[:, 2])
    shifts = (points(x) - np.exp(1j * omega[:, None]) * points(truth)) / chord(omega)
    return with_points(omega, shifts)


def to_ordinary(x, P):
    """Return the covariance of estimate minus truth."""
    M = np.tile(np.eye(15), (len(x), 1, 1))
    M[:, :, 2] = -turn_of(x)
    M[:, 2, 2] = 1.0
    return M @ P @ transposed(M)
