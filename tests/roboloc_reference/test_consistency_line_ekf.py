r"""The EKF with lines is as sure of itself as it may be.

A robot drives a figure of eight in the arena. Its controls are wrong by noise of covariance dt R a step, each
observed line by noise of covariance Q, and it knows which wall each line is. If the filter is right, its squared
error in units of its own covariance (NEES) is chi-square with 3 degrees of freedom, so the sum over N runs is
chi-square with 3 N. A block of N = 200 runs passes if that sum is between the quantiles at five named instants,
with a false alarm of 1e-3 for all five together.

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
from roboloc_reference.lines import compute_predicted_measurements
from roboloc_reference.motion import compute_dynamics

BLOCKS, RUNS, FALSE_ALARM = 20, 200, 1e-3
DT, STEPS = 0.1, 250
R = np.diag([0.004, 0.008])  # as drawn: 2 cm/s and 0.03 rad/s in a step of 0.1 s
SIGMA0 = np.diag([0.03, 0.03, np.radians(1.5)]) ** 2
Q = np.array([[0.01**2, 0.3 * 0.01 * 0.02], [0.3 * 0.01 * 0.02, 0.02**2]])
TF = np.array([0.12, -0.05, 0.2])
WORLD, START = arena(), np.array([0.2, 0.0, 0.0])
INSTANTS = {
    "first correction": 5,
    "end of the stretch along one wall": 60,
    "end of the blind stretch": 120,
    "first correction after it": 125,
    "end of the drive": 250,
}


def control(k):
    """Return the command of step k: a circle to the left, then one to the right."""
    return np.array([0.5, 0.5 if k < STEPS // 2 else -0.5])


def walls_seen(k):
    """Return the walls observed after step k: two in turn, one alone for five seconds, none for six."""
    if k % 5:
        return []
    if 10 < k <= 60:
        return [0]
    if 60 < k <= 120:
        return []
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


def predicted(x, walls):
    """Return h (B, 2 K) and H (B, 2 K, 3) of K walls; the robot is on the near side of them all."""
    (alpha, r), (x_cam, y_cam, theta_cam) = WORLD.map_lines[:, walls], TF
    beta = alpha - x[:, 2:]
    h = r - x[:, :1] * np.cos(alpha) - x[:, 1:2] * np.sin(alpha) - x_cam * np.cos(beta) - y_cam * np.sin(beta)
    H = np.zeros((len(x), len(walls), 2, 3))
    H[:, :, 0, 2] = -1.0
    H[:, :, 1, 0], H[:, :, 1, 1] = -np.cos(alpha), -np.sin(alpha)
    H[:, :, 1, 2] = y_cam * np.cos(beta) - x_cam * np.sin(beta)
    assert (h > 0.1).all()
    return np.stack([beta - theta_cam, h], axis=-1).reshape(len(x), -1), H.reshape(len(x), -1, 3)


def right(Gx, Sigma):
    """Push a covariance through the motion."""
    return Gx @ Sigma @ Gx.swapaxes(1, 2)


def transposed(Gx, Sigma):
    """Push a covariance through the motion the wrong way round."""
    return Gx.swapaxes(1, 2) @ Sigma @ Gx


def without_cross_covariance(Gx, Sigma):
    """Keep what position and heading know of themselves, and forget what they know of each other."""
    moved = right(Gx, Sigma)
    moved[:, :2, 2] = moved[:, 2, :2] = 0.0
    return moved


def correct(x, Sigma, z, walls):
    """Condition on the observed lines z (B, 2 K)."""
    h, H = predicted(x, walls)
    v = z - h
    v[:, ::2] = wrap(v[:, ::2])
    noise = np.kron(np.eye(len(walls)), Q)
    K = np.linalg.solve(H @ Sigma @ H.swapaxes(1, 2) + noise, H @ Sigma).swapaxes(1, 2)
    A = np.eye(3) - K @ H
    return x + (K @ v[..., None])[..., 0], right(A, Sigma) + right(K, noise)


def drive(rngs, runs=RUNS):
    """Draw the truth and what is observed of it: x0 (B, 3), poses (STEPS + 1, B, 3), {step: lines (B, 2 K)}."""

    def normal(covariance, count=1):
        roots = np.linalg.cholesky(covariance).T
        return np.concatenate([rng.normal(size=(runs, count, len(roots))) @ roots for rng in rngs])

    start = np.tile(START, (len(rngs) * runs, 1))
    poses, lines = [start], {}
    x0 = start + normal(SIGMA0)[:, 0]
    noise = normal(DT * R, STEPS)
    for k in range(1, STEPS + 1):
        poses.append(dynamics(poses[-1], control(k - 1) + noise[:, k - 1])[0])
        if walls := walls_seen(k):
            lines[k] = predicted(poses[-1], walls)[0] + normal(Q, len(walls)).reshape(len(start), -1)
    return x0, np.array(poses), lines


@cache
def the_drives():
    """Return the drives of all blocks."""
    return drive([np.random.default_rng(block) for block in range(BLOCKS)])


def estimate(push, drives, Sigma0=SIGMA0, R=R):
    """Return the NEES of all runs at the named instants, (5, B), of a filter with the given prediction."""
    x, poses, lines = drives
    Sigma, nees = np.tile(Sigma0, (len(x), 1, 1)), []
    for k in range(1, STEPS + 1):
        x, Gx, Gu = dynamics(x, np.tile(control(k - 1), (len(x), 1)))
        Sigma = push(Gx, Sigma) + DT * right(Gu, R)
        if k in lines:
            x, Sigma = correct(x, Sigma, lines[k], walls_seen(k))
        if k in INSTANTS.values():
            error = x - poses[k]
            error[:, 2] = wrap(error[:, 2])
            nees.append(np.sum(error * np.linalg.solve(Sigma, error[..., None])[..., 0], axis=1))
    return np.array(nees)


def passed(nees):
    """Tell for each block and instant whether the mean NEES is in its band, (5, BLOCKS)."""
    mean = nees.reshape(len(INSTANTS), -1, RUNS).mean(axis=2)
    tail = FALSE_ALARM / len(INSTANTS) / 2
    low, high = chi2.ppf([tail, 1 - tail], 3 * RUNS) / RUNS
    return (low < mean) & (mean < high)


# ---------------------------------------------------------------- the tests


def test_many_runs_at_once_are_the_reference_one_by_one():
    """Run by run, the stages of the reference give the same NEES at every instant, to 1e-8 of it."""
    x0, poses, lines = drives = drive([np.random.default_rng(99)], runs=6)
    many = estimate(right, drives)
    for run in range(6):
        x, Sigma, nees = x0[run], SIGMA0, []
        for k in range(1, STEPS + 1):
            g, Gx, Gu = compute_dynamics(x, control(k - 1), DT)
            x, Sigma = transition_update(g, Gx, Gu, Sigma, R, DT)
            if k in lines:
                walls = walls_seen(k)
                hs, Hs = compute_predicted_measurements(x, WORLD.map_lines, TF)
                v = lines[k][run].reshape(-1, 2) - hs[:, walls].T
                v[:, 0] = wrap(v[:, 0])
                z, Q_all, H = measurement_model(v, [Q] * len(walls), Hs[walls])
                x, Sigma = measurement_update(x, Sigma, z, Q_all, H)
            if k in INSTANTS.values():
                error = x - poses[k, run]
                error[2] = wrap(error[2])
                nees.append(error @ np.linalg.solve(Sigma, error))
        np.testing.assert_allclose(many[:, run], nees, rtol=1e-8)


def test_the_right_filter_is_honest():
    """At least 19 of 20 blocks pass at all five instants; a false alarm in two has a probability of 2e-4."""
    assert passed(estimate(right, the_drives())).all(axis=0).sum() >= 19


@pytest.mark.parametrize("push", [transposed, without_cross_covariance])
def test_a_wrong_prediction_is_found(push):
    """With Gx transposed, or the covariance of position and heading dropped, no block of 20 passes."""
    assert not passed(estimate(push, the_drives())).all(axis=0).any()


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_wrong_noise_is_found(factor):
    """A filter told half or twice the variance of the controls fails in all blocks: both edges of the band work."""
    assert not passed(estimate(right, the_drives(), R=factor * R)).all(axis=0).any()
