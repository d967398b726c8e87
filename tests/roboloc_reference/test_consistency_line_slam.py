r"""SLAM with lines is as sure of itself as it may be, of the pose and of the map.

A robot that knows where it starts, and nothing else, drives a figure of eight in the arena. Its controls are wrong
by noise of covariance dt R a step, each observed line by noise of covariance Q, and it knows which wall each line
is. A wall enters the state when it is first seen; in the end there are six of them. If the filter is right, the
squared error of the whole state in units of its own covariance (NEES) is chi-square with 3 + 2 J degrees of freedom
for J walls, so the sum over N runs is chi-square with N (3 + 2 J). A block of N = 200 runs passes if that sum, and
that of the pose alone with 3 N, is between the quantiles at five named instants, with a false alarm of 1e-3 for all
ten together. The noise is small: with a heading that is wrong by much, no EKF with these errors is honest.

The runs of all 20 blocks go through the filter at once, as one more axis of every array. The first test says that
this filter is the reference, run by run; the seeds of block b are b.
"""

from functools import cache

import numpy as np
import pytest
from scipy.stats import chi2

from roboloc.angles import wrap
from roboloc.worlds import arena
from roboloc_reference.association import measurement_model
from roboloc_reference.gaussian import measurement_update, transition_update
from roboloc_reference.slam import augment, compute_predicted_measurements, transition_model

BLOCKS, RUNS, FALSE_ALARM = 20, 200, 1e-3
DT, STEPS = 0.1, 250
R = np.diag([0.001, 0.001])  # as drawn: 1 cm/s and 0.01 rad/s in a step of 0.1 s
Q = np.array([[0.01**2, 0.3 * 0.01 * 0.02], [0.3 * 0.01 * 0.02, 0.02**2]])
TF = np.array([0.12, -0.05, 0.2])
WORLD, START = arena(), np.array([0.2, 0.0, 0.0])
INSTANTS = {
    "first two walls": 35,
    "end of the stretch along one wall": 60,
    "end of the blind stretch": 120,
    "first correction after it": 125,
    "end of the drive": 250,
}


def control(k):
    """Return the command of step k: a circle to the left, then one to the right."""
    return np.array([0.5, 0.5 if k < STEPS // 2 else -0.5])


def walls_seen(k):
    """Return the walls observed after step k: none, two in turn, one alone, none for six seconds, two in turn."""
    if k % 5 or k <= 30 or 60 < k <= 120:
        return []
    if 40 < k <= 60:
        return [0]
    return [k // 5 % 6, (k // 5 + 2) % 6]


# ---------------------------------------------------------------- the reference, for many runs at once


def dynamics(x, u):
    """Return g (B, 3), Gx (B, 3, 3), Gu (B, 3, 2) for poses and controls of B runs; no control turns too little."""
    V, omega, theta = u[:, 0], u[:, 1], x[:, 2]
    end = theta + omega * DT
    dx, dy = V / omega * (np.sin(end) - np.sin(theta)), V / omega * (np.cos(theta) - np.cos(end))
    Gx = np.tile(np.eye(3), (len(x), 1, 1))
    Gx[:, 0, 2], Gx[:, 1, 2] = -dy, dx
    Gu = np.zeros((len(x), 3, 2))
    Gu[:, 0, 0], Gu[:, 1, 0], Gu[:, 2, 1] = dx / V, dy / V, DT
    Gu[:, 0, 1], Gu[:, 1, 1] = (V * DT * np.cos(end) - dx) / omega, (V * DT * np.sin(end) - dy) / omega
    return np.stack([x[:, 0] + dx, x[:, 1] + dy, end], axis=1), Gx, Gu


def predicted(x, slots):
    """Return h (B, 2 K) and H (B, 2 K, n) of the walls in K slots of the state, on whose near side the robot is."""
    count, slots = len(x), np.array(slots)
    pose, alpha, r = x[:, :3, None], x[:, 3 + 2 * slots], x[:, 4 + 2 * slots]
    beta = alpha - pose[:, 2]
    ahead, across = (
        a * np.cos(angle) + b * np.sin(angle)
        for a, b, angle in ((pose[:, 0], pose[:, 1], alpha), (TF[0], TF[1], beta))
    )
    turn_world = pose[:, 0] * np.sin(alpha) - pose[:, 1] * np.cos(alpha)
    turn_robot = TF[0] * np.sin(beta) - TF[1] * np.cos(beta)
    h, k = r - ahead - across, np.arange(len(slots))
    assert (h > 0.1).all()
    H = np.zeros((count, len(slots), 2, x.shape[1]))
    H[:, :, 0, 2] = -1.0
    H[:, :, 1, 0], H[:, :, 1, 1], H[:, :, 1, 2] = -np.cos(alpha), -np.sin(alpha), -turn_robot
    H[:, k, 0, 3 + 2 * slots] = H[:, k, 1, 4 + 2 * slots] = 1.0
    H[:, k, 1, 3 + 2 * slots] = turn_world + turn_robot
    z = np.stack([wrap(beta - TF[2]), h], axis=-1)
    return z.reshape(count, -1), H.reshape(count, -1, x.shape[1])


def grown(x, Sigma, z):
    """Let the walls seen as z (B, 2) enter."""
    (px, py, theta), (alpha, r) = x[:, :3].T, z.T
    beta = alpha + TF[2]
    alpha = beta + theta
    c, s = np.cos(alpha), np.sin(alpha)
    turn_world, turn_robot = py * c - px * s, TF[1] * np.cos(beta) - TF[0] * np.sin(beta)
    r = r + px * c + py * s + TF[0] * np.cos(beta) + TF[1] * np.sin(beta)
    assert (r > 0.1).all()
    by_pose, by_z = np.zeros((len(x), 2, 3)), np.tile(np.eye(2), (len(x), 1, 1))
    by_pose[:, 0, 2] = 1.0
    by_pose[:, 1] = np.stack([c, s, turn_world], axis=1)
    by_z[:, 1, 0] = turn_world + turn_robot
    cross = by_pose @ Sigma[:, :3]
    own = sandwich(by_pose, Sigma[:, :3, :3]) + sandwich(by_z, Q)
    left = np.concatenate([Sigma, cross], axis=1)
    right = np.concatenate([cross.swapaxes(1, 2), own], axis=1)
    return np.hstack([x, np.stack([wrap(alpha), r], axis=1)]), np.concatenate([left, right], axis=2)


def sandwich(A, Sigma):
    """Return A Sigma A^T."""
    return A @ Sigma @ A.swapaxes(1, 2)


def correct(x, Sigma, z, slots):
    """Condition on the observed lines z (B, 2 K) of the walls in K slots."""
    h, H = predicted(x, slots)
    v = z - h
    v[:, ::2] = wrap(v[:, ::2])
    noise = np.kron(np.eye(len(slots)), Q)
    HSigma = H @ Sigma
    K = np.linalg.solve(HSigma @ H.swapaxes(1, 2) + noise, HSigma).swapaxes(1, 2)
    Sigma = Sigma - K @ HSigma
    return x + (K @ v[..., None])[..., 0], (Sigma + Sigma.swapaxes(1, 2)) / 2


def moved(Sigma, Gx):
    """Push a covariance through the motion of the pose beside an identity."""
    Sigma = Sigma.copy()
    Sigma[:, :3] = Gx @ Sigma[:, :3]
    Sigma[:, :, :3] = Sigma[:, :, :3] @ Gx.swapaxes(1, 2)
    return Sigma


def moved_transposed(Sigma, Gx):
    """Push a covariance through the motion the wrong way round."""
    return moved(Sigma, Gx.swapaxes(1, 2))


def moved_without_map(Sigma, Gx):
    """Forget what pose and map know of each other."""
    Sigma = moved(Sigma, Gx)
    Sigma[:, :3, 3:] = Sigma[:, 3:, :3] = 0.0
    return Sigma


def grown_without_cross_covariance(x, Sigma, z):
    """Let walls enter as if their errors had nothing to do with that of the pose."""
    n = x.shape[1]
    x, Sigma = grown(x, Sigma, z)
    Sigma[:, :n, n:] = Sigma[:, n:, :n] = 0.0
    return x, Sigma


def grown_as_if_the_pose_were_certain(x, Sigma, z):
    """Let walls enter with the covariance of the observation alone."""
    n = x.shape[1]
    known = grown(x, np.zeros_like(Sigma), z)[1]
    x, Sigma = grown_without_cross_covariance(x, Sigma, z)
    Sigma[:, n:, n:] = known[:, n:, n:]
    return x, Sigma


def drive(rngs, runs=RUNS):
    """Draw the truth and what is observed of it: poses (STEPS + 1, B, 3), {step: lines (B, 2 K)}."""

    def normal(covariance, count):
        roots = np.linalg.cholesky(covariance).T
        return np.concatenate([rng.normal(size=(runs, count, len(roots))) @ roots for rng in rngs])

    start = np.tile(START, (len(rngs) * runs, 1))
    walls = np.tile(WORLD.map_lines.T.ravel(), (len(start), 1))
    poses, lines = [start], {}
    noise = normal(DT * R, STEPS)
    for k in range(1, STEPS + 1):
        poses.append(dynamics(poses[-1], control(k - 1) + noise[:, k - 1])[0])
        if seen := walls_seen(k):
            z, _ = predicted(np.hstack([poses[-1], walls]), seen)
            lines[k] = z + normal(Q, len(seen)).reshape(len(start), -1)
    return np.array(poses), lines


@cache
def the_drives():
    """Return the drives of all blocks."""
    return drive([np.random.default_rng(block) for block in range(BLOCKS)])


def split(k, z, walls):
    """Return slots and lines of the walls that are known, then the new walls and their lines."""
    seen = walls_seen(k)
    pairs = [z[..., 2 * i : 2 * i + 2] for i in range(len(seen))]
    known = [(walls.index(wall), line) for wall, line in zip(seen, pairs, strict=True) if wall in walls]
    new = [(wall, line) for wall, line in zip(seen, pairs, strict=True) if wall not in walls]
    return [slot for slot, _ in known], [line for _, line in known], new


def truth_of(poses, walls):
    """Return the true states (B, n) of poses (B, 3) and the walls in the state."""
    lines = WORLD.map_lines[:, walls].T.ravel()
    return np.hstack([poses, np.tile(lines, (len(poses), 1))])


def squares(x, Sigma, truth):
    """Return the NEES of the pose and of the whole state, (2, B)."""
    error = x - truth
    error[:, 2] = wrap(error[:, 2])
    error[:, 3::2] = wrap(error[:, 3::2])
    return np.array(
        [
            np.sum(error[:, :n] * np.linalg.solve(Sigma[:, :n, :n], error[:, :n, None])[..., 0], axis=1)
            for n in (3, x.shape[1])
        ]
    )


def estimate(drives, R=R, move=moved, grow=grown):
    """Return the NEES of all runs at the named instants, (5, 2, B), and the degrees of freedom, (5, 2)."""
    poses, lines = drives
    x, Sigma = poses[0], np.zeros((poses.shape[1], 3, 3))
    walls, nees, freedom = [], [], []
    for k in range(1, STEPS + 1):
        pose, Gx, Gu = dynamics(x[:, :3], np.tile(control(k - 1), (len(x), 1)))
        x, Sigma = np.hstack([pose, x[:, 3:]]), move(Sigma, Gx)
        Sigma[:, :3, :3] += DT * sandwich(Gu, R)
        if k in lines:
            slots, seen, new = split(k, lines[k], walls)
            if slots:
                x, Sigma = correct(x, Sigma, np.hstack(seen), slots)
            for wall, z in new:
                x, Sigma = grow(x, Sigma, z)
                walls.append(wall)
        if k in INSTANTS.values():
            nees.append(squares(x, Sigma, truth_of(poses[k], walls)))
            freedom.append((3, x.shape[1]))
    return np.array(nees), np.array(freedom)


def passed(nees, freedom):
    """Tell for each instant, for pose and state, and for each block whether the mean NEES is in its band."""
    mean = nees.reshape(*freedom.shape, -1, RUNS).mean(axis=-1)
    tail = FALSE_ALARM / freedom.size / 2
    low, high = (chi2.ppf(p, freedom * RUNS)[..., None] / RUNS for p in (tail, 1 - tail))
    return (low < mean) & (mean < high)


# ---------------------------------------------------------------- the tests


def test_many_runs_at_once_are_the_reference_one_by_one():
    """Run by run, the stages of the reference give the same NEES at every instant, to 1e-6 of it."""
    poses, lines = drives = drive([np.random.default_rng(99)], runs=3)
    many, freedom = estimate(drives)
    assert freedom[-1].tolist() == [3, 15]
    for run in range(3):
        x, Sigma, walls, nees = START, np.zeros((3, 3)), [], []
        for k in range(1, STEPS + 1):
            x, Sigma = transition_update(*transition_model(x, control(k - 1), DT), Sigma, R, DT)
            if k in lines:
                slots, seen, new = split(k, lines[k][run], walls)
                hs, Hs = compute_predicted_measurements(x, TF, fixed=0)
                v = np.array(seen).reshape(-1, 2) - hs[:, slots].T
                v[:, 0] = wrap(v[:, 0])
                z, noise, H = measurement_model(v, np.tile(Q, (len(v), 1, 1)), Hs[slots])
                x, Sigma = measurement_update(x, Sigma, z, noise, H)
                for wall, z in new:
                    x, Sigma = augment(x, Sigma, z, Q, TF)
                    walls.append(wall)
            if k in INSTANTS.values():
                nees.append(squares(x[None], Sigma[None], truth_of(poses[k, run : run + 1], walls))[:, 0])
        np.testing.assert_allclose(many[..., run], nees, rtol=1e-6)


def test_the_right_filter_is_honest():
    """At least 19 of 20 blocks pass at all five instants; a false alarm in two has a probability of 2e-4."""
    assert passed(*estimate(the_drives())).all(axis=(0, 1)).sum() >= 19


@pytest.mark.parametrize(
    "fault",
    [
        {"move": moved_transposed},
        {"move": moved_without_map},
        {"grow": grown_without_cross_covariance},
        {"grow": grown_as_if_the_pose_were_certain},
    ],
)
def test_a_wrong_covariance_is_found(fault):
    """With Gx transposed, or a cross-covariance of pose and map dropped, no block of 20 passes."""
    assert not passed(*estimate(the_drives(), **fault)).all(axis=(0, 1)).any()


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_wrong_noise_is_found(factor):
    """A filter told half or twice the variance of the controls fails in all blocks: both edges of the band work."""
    assert not passed(*estimate(the_drives(), R=factor * R)).all(axis=(0, 1)).any()
