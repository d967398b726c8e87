"""Many bouncing balls at once, for the tests of honesty: one more axis of every array, one loop over impacts.

The state is px, py, vx, vy, e; where e is known its variance is 0. Each run starts at a state drawn from N(START,
the covariance given), and at the end of every step the motion gains a draw from N(0, Q); after it the position is
seen, with a draw from N(0, R), except at the end of the last step. The steps end where no ball of any run is near an
impact: a ball that has bounced and one that has not differ by more than a filter of tangents can say. The runs of
block b are drawn by the seed b.

If a filter is right, its normalized squared error (NEES) is chi-square with n degrees of freedom, so the sum over N
runs is chi-square with n N. A block of N = 200 runs passes if that sum is between the quantiles at all five named
instants, with a false alarm of 1e-3 for the five together.
"""

import numpy as np
from scipy.stats import chi2

BLOCKS, RUNS, FALSE_ALARM = 20, 200, 1e-3
GRAVITY, E = 9.81, 0.8
# Ends of the steps, and at which of them a filter is judged: before and after the first two impacts, and after one
# or two more that are not followed by an observation. With E known the impacts are at 0.64, 1.66, 2.48, 3.13 and
# 3.65 s; with E open to SIGMA_E the third is between 2.3 and 2.65 s.
TIMES = np.array([0.2, 0.4, 0.5, 0.8, 1.0, 1.2, 1.4, 1.55, 1.8, 2.0, 2.2, 2.35, 2.6, 2.8, 3.0, 3.85])
INSTANTS = (0.5, 0.8, 1.55, 1.8, 3.85)
TIMES_UNKNOWN = np.array([0.2, 0.4, 0.5, 0.8, 1.0, 1.2, 1.4, 1.5, 1.8, 1.95, 2.1, 2.2, 2.75])
INSTANTS_UNKNOWN = (0.5, 0.8, 1.5, 1.8, 2.75)
SIGMA_E = 0.01
MOST_IMPACTS = 4  # within a step
START = np.array([0.0, 2.0, 1.0, 0.0, E])
SIGMA0 = np.diag([0.01, 0.01, 0.02, 0.02, 0.0]) ** 2
Q, R = np.diag([2e-3, 2e-3, 1e-2, 1e-2, 0.0]) ** 2, np.diag([0.02, 0.02]) ** 2


def saltation(v, e):
    """Return what an impact at speed v < 0 does to errors of height, speed and restitution, (B, 3, 3)."""
    S = np.zeros((len(v), 3, 3))
    S[:, 0, 0] = S[:, 1, 1] = -e
    S[:, 1, 0], S[:, 1, 2], S[:, 2, 2] = -(1 + e) * GRAVITY / v, -v, 1.0
    return S


def jump_alone(v, e):
    """Return the derivative of the jump itself, as if all impacts were at one time."""
    S = saltation(v, e)
    S[:, 0, 0], S[:, 1, 0] = 1.0, 0.0
    return S


def no_jump(v, e):
    """Return an identity: the covariance of a ball that never meets the ground."""
    return np.tile(np.eye(3), (len(v), 1, 1))


def flown(t):
    """Return what a flight of times t (B,) does to errors of height, speed and restitution."""
    F = np.tile(np.eye(3), (len(t), 1, 1))
    F[:, 0, 1] = t
    return F


def moved(x, dt, impact=saltation):
    """Return states (B, 5) after dt, and the Jacobians (B, 5, 5): from impact to impact."""
    (px, y, vx, v, e), left = x.T.copy(), np.full(len(x), dt)
    slope = flown(np.zeros(len(x)))
    for _ in range(MOST_IMPACTS + 1):
        fall = (v + np.sqrt(v * v + 2 * GRAVITY * y)) / GRAVITY
        hits = fall < left
        t = np.minimum(fall, left)
        slope = flown(t) @ slope
        y, v, left = y + (v - GRAVITY * t / 2) * t, v - GRAVITY * t, left - t
        slope[hits] = impact(v[hits], e[hits]) @ slope[hits]
        y, v = np.where(hits, 0.0, y), np.where(hits, -e * v, v)
    assert not left.any()
    G = np.tile(np.eye(5), (len(x), 1, 1))
    G[:, 0, 2] = dt
    G[np.ix_(range(len(x)), [1, 3, 4], [1, 3, 4])] = slope
    return np.stack([px + vx * dt, y, vx, v, e], axis=1), G


def throw(rngs, Sigma0, times, runs=RUNS):
    """Draw the truth and what is seen of it: states (steps, B, 5) and positions (steps, B, 2)."""

    def normal(covariance):
        root = np.sqrt(covariance)  # all of them are diagonal
        return np.concatenate([rng.normal(size=(runs, len(root))) @ root for rng in rngs])

    x, states, zs = START + normal(Sigma0), [], []
    for dt in np.diff(times, prepend=0.0):
        x = moved(x, dt)[0] + normal(Q)
        states.append(x)
        zs.append(x[:, :2] + normal(R))
    return np.array(states), np.array(zs)


def estimate(throws, Sigma0, times, instants, n, Q=Q, impact=saltation, turned=False):
    """Return the NEES of the first n numbers at the named instants, (5, B); with a wrong Q or Jacobian on request."""
    states, zs = throws
    x, Sigma = np.tile(START, (states.shape[1], 1)), np.tile(Sigma0, (states.shape[1], 1, 1))
    nees = []
    for time, dt, truth, z in zip(times, np.diff(times, prepend=0.0), states, zs, strict=True):
        x, G = moved(x, dt, impact)
        if turned:
            G = G.swapaxes(1, 2)
        Sigma = G @ Sigma @ G.swapaxes(1, 2) + Q
        if time != times[-1]:
            S = Sigma[:, :2, :2] + R
            K = np.linalg.solve(S, Sigma[:, :2]).swapaxes(1, 2)
            x = x + (K @ (z - x[:, :2])[..., None])[..., 0]
            Sigma = Sigma - K @ Sigma[:, :2]
            Sigma = (Sigma + Sigma.swapaxes(1, 2)) / 2
        if time in instants:
            error = (x - truth)[:, :n]
            nees.append(np.sum(error * np.linalg.solve(Sigma[:, :n, :n], error[..., None])[..., 0], axis=1))
    return np.array(nees)


def passed(nees, n):
    """Tell for each instant and block whether the mean NEES (5, B) is in its band."""
    mean = nees.reshape(len(nees), -1, RUNS).mean(axis=-1)
    tail = FALSE_ALARM / len(nees) / 2
    low, high = (chi2.ppf(p, n * RUNS) / RUNS for p in (tail, 1 - tail))
    return (low < mean) & (mean < high)
