"""The unscented filter is as sure of itself as it may be.

How the runs are drawn, and what a block of 200 has to pass, is told in `velocity_runs`. The runs of all 20 blocks go
through the filter at once; the first test says that this filter is the reference, run by run.
"""

import numpy as np
import pytest
from velocity_runs import (
    ALPHAS,
    DT,
    INSTANTS,
    LANDMARKS,
    SIGMA0,
    START,
    STEPS,
    Q,
    control,
    drive,
    moved,
    passed,
    seen,
    sighted,
    square,
    the_drives,
)

from roboloc.angles import wrap
from roboloc_reference.ukf import correct, predict
from roboloc_reference.velocity import noise

KAPPAS = {"predict": -3.0, "correct": 0.0}


def points_of(mean, cov, kappa):
    """Return points (B, 2n + 1, n) and their weights (2n + 1,)."""
    n = mean.shape[1]
    spread = np.sqrt(n + kappa) * np.linalg.cholesky(cov).swapaxes(1, 2)
    centre = mean[:, None]
    weights = np.full(2 * n + 1, 0.5 / (n + kappa))
    weights[0] = kappa / (n + kappa)
    return np.concatenate([centre, centre + spread, centre - spread], axis=1), weights


def moments(d, weights):
    """Return mean (B, n) and covariance of deviations (B, m, n) about the centre, as the sign of kappa asks for."""
    mean = np.einsum("m,bmi->bi", weights, d)
    if weights[0] >= 0:
        d = d - mean[:, None]
    return mean, d, np.einsum("m,bmi,bmj->bij", weights, d, d)


def predicted(x, Sigma, u, M):
    """Push beliefs through the motion, points of pose and control together."""
    joint = np.zeros((len(x), 6, 6))
    joint[:, :3, :3], joint[:, 3:, 3:] = Sigma, M
    points, weights = points_of(np.hstack([x, np.tile(u, (len(x), 1))]), joint, KAPPAS["predict"])
    ends = moved(points[..., :3], points[..., 3:])
    mean, _, cov = moments(ends - ends[:, :1], weights)
    return ends[:, 0] + mean, cov


def corrected(x, Sigma, z, which, Q, wrapped=wrap):
    """Condition beliefs on observations (B, 2 k)."""
    points, weights = points_of(x, Sigma, KAPPAS["correct"])
    h = sighted(points, which)
    # The directions of the vector sums of the bearings say where to cut the circle.
    origin = h[:, 0].copy()
    origin[:, ::2] = np.arctan2(*(np.abs(weights) @ f(h[..., ::2]) for f in (np.sin, np.cos)))
    e = h - origin[:, None]
    e[..., ::2] = wrap(e[..., ::2])
    mean, e, S = moments(e, weights)
    v = z - origin - mean
    v[:, ::2] = wrapped(v[:, ::2])
    S = S + np.kron(np.eye(len(which)), Q)
    cross = np.einsum("m,bmi,bmj->bij", weights, e, points - x[:, None])
    K = np.linalg.solve(S, cross).swapaxes(1, 2)
    return x + (K @ v[..., None])[..., 0], Sigma - K @ S @ K.swapaxes(1, 2)


def estimate(drives, M=1.0, Q=Q, **fault):
    """Return the NEES of all runs at the named instants, (5, B), for a factor of M, a Q and a way to be wrong."""
    poses, zs = drives
    x, Sigma = np.tile(START, (poses.shape[1], 1)), np.tile(SIGMA0, (poses.shape[1], 1, 1))
    nees = []
    for k in range(1, STEPS + 1):
        u = control(k)
        x, Sigma = predicted(x, Sigma, u, M * noise(u, ALPHAS))
        if k in zs:
            x, Sigma = corrected(x, Sigma, zs[k], seen(k), Q, **fault)
        if k in INSTANTS.values():
            error = x - poses[k]
            error[:, 2] = wrap(error[:, 2])
            nees.append(square(error, Sigma))
    return np.array(nees)


def test_many_runs_at_once_are_the_reference_one_by_one():
    """Run by run, the stages of the reference give the same NEES at every instant, to 1e-6 of it."""
    poses, zs = drives = drive([np.random.default_rng(99)], runs=3)
    many = estimate(drives)
    for run in range(3):
        x, Sigma, nees = START, SIGMA0, []
        for k in range(1, STEPS + 1):
            u = control(k)
            x, Sigma = predict(x, Sigma, u, noise(u, ALPHAS), DT, KAPPAS["predict"])
            if k in zs:
                x, Sigma = correct(x, Sigma, zs[k][run], LANDMARKS[seen(k)], Q, KAPPAS["correct"])
            if k in INSTANTS.values():
                error = x - poses[k, run]
                error[2] = wrap(error[2])
                nees.append(square(error[None], Sigma[None])[0])
        np.testing.assert_allclose(many[:, run], nees, rtol=1e-6)


def test_the_right_filter_is_honest():
    """At least 19 of 20 blocks pass at all five instants; a false alarm in two has a probability of 2e-4."""
    assert passed(estimate(the_drives())).all(axis=0).sum() >= 19


@pytest.mark.parametrize(
    "fault",
    [
        pytest.param({"M": 1e-9}, id="the noise of the control forgotten"),
        pytest.param({"M": 0.5}, id="half the noise of the control"),
        pytest.param({"M": 2.0}, id="twice the noise of the control"),
        pytest.param({"Q": Q / 2}, id="half the noise of the observation"),
        pytest.param({"wrapped": lambda v: v}, id="innovation not wrapped"),
    ],
)
def test_a_wrong_filter_is_found(fault):
    """None of the 20 blocks passes if the filter is wrong in one thing."""
    assert not passed(estimate(the_drives(), **fault)).all(axis=0).any()
