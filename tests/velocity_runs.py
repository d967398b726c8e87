"""Many runs of the velocity model at once, for the tests of honesty: one more axis of every array.

Each run starts at a pose drawn from N(START, SIGMA0). In every step the control that is driven differs from the one
asked for by a draw from N(0, M), M of the control that was asked for, and each bearing and range by a draw from N(0,
Q); which landmarks are seen depends on the step alone. The runs of block b are drawn by the seed b.

If a filter is right, its normalized squared error (NEES) is chi-square with 3 degrees of freedom, so the sum over N
runs is chi-square with 3 N. A block passes if that sum is between the quantiles at all five named instants, with a
false alarm of 1e-3 for the five together.
"""

from functools import cache

import numpy as np
from scipy.stats import chi2

from roboloc.angles import wrap
from roboloc_reference.velocity import noise

BLOCKS, RUNS, FALSE_ALARM = 20, 200, 1e-3
DT, STEPS = 0.25, 48
ALPHAS = np.array([2.5e-3, 5e-4, 5e-4, 2.5e-3, 1.25e-4, 1.25e-4])
Q = np.array([[0.03**2, 0.3 * 0.03 * 0.06], [0.3 * 0.03 * 0.06, 0.06**2]])
START, SIGMA0 = np.array([0.0, 0.0, 0.2]), np.diag([0.08, 0.08, 0.04]) ** 2
# The first is straight behind the robot as it starts: its bearing is on either side of the cut.
LANDMARKS = np.array([[-4.0, -0.8], [3.0, 6.0], [4.0, -4.0]])
INSTANTS = {
    "first sightings": 3,
    "before the blind stretch": 15,
    "end of the blind stretch": 27,
    "first correction after it": 28,
    "end of the drive": 48,
}


def control(k):
    """Return the command of step k: an arc to the left, then one to the right."""
    return np.array([1.0, 0.4 if k <= STEPS // 2 else -0.4, 0.0])


def seen(k):
    """Return the landmarks observed after step k: two in turn, none for three seconds."""
    return [] if 15 < k <= 27 else [k % 3, (k + 1) % 3]


def moved(x, u):
    """Return the ends (..., 3) of poses (..., 3) under controls (..., 3); no control turns too little."""
    v, omega, gamma = np.moveaxis(u, -1, 0)
    theta = x[..., 2]
    end, r = theta + omega * DT, v / omega
    way = [r * (np.sin(end) - np.sin(theta)), r * (np.cos(theta) - np.cos(end)), (omega + gamma) * DT]
    return x + np.stack(way, axis=-1)


def sighted(x, which):
    """Return bearings and ranges (..., 2 k) of landmarks from poses (..., 3); the bearings are not wrapped."""
    d = LANDMARKS[which] - x[..., None, :2]
    bearings = np.arctan2(d[..., 1], d[..., 0]) - x[..., 2:]
    z = np.stack([bearings, np.hypot(d[..., 0], d[..., 1])], axis=-1)
    return z.reshape(*x.shape[:-1], 2 * len(which))


def drive(rngs, runs=RUNS):
    """Draw the truth and what is seen of it: poses (STEPS + 1, B, 3), {step: observations (B, 2 k)}."""

    def normal(root, *shape):
        return np.concatenate([rng.normal(size=(runs, *shape, len(root))) @ root.T for rng in rngs])

    poses, zs = [START + normal(np.sqrt(SIGMA0))], {}
    for k in range(1, STEPS + 1):
        u = control(k)
        poses.append(moved(poses[-1], u + normal(np.sqrt(noise(u, ALPHAS)))))
        if which := seen(k):
            z = sighted(poses[-1], which)
            z += normal(np.linalg.cholesky(Q), len(which)).reshape(z.shape)
            z[:, ::2] = wrap(z[:, ::2])
            zs[k] = z
    return np.array(poses), zs


@cache
def the_drives():
    """Return the drives of all blocks."""
    return drive([np.random.default_rng(block) for block in range(BLOCKS)])


def square(error, Sigma):
    """Return the normalized squares (B,) of errors (B, n)."""
    return np.sum(error * np.linalg.solve(Sigma, error[..., None])[..., 0], axis=-1)


def passed(nees, dof=3):
    """Tell for each instant and block whether the mean NEES (instants, B) is in its band."""
    mean = nees.reshape(len(nees), -1, RUNS).mean(axis=-1)
    tail = FALSE_ALARM / len(nees) / 2
    low, high = (chi2.ppf(p, dof * RUNS) / RUNS for p in (tail, 1 - tail))
    return (low < mean) & (mean < high)
