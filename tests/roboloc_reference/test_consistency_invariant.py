"""The right-invariant filter is as sure of itself as it may be, in the coordinates of its own error.

How the runs are drawn, and what a block of 200 has to pass, is told in `velocity_runs`. The error is the twist xi with
estimate = exp(xi) truth; the start is drawn about what the filter is told with SIGMA0 in the numbers of the pose, and
the noise of a step is that of its three controls, so both are turned into twists to first order. An observation is
drawn as bearing and range and fed as a position, with the covariance that this has to first order. The noise is
small enough for the second order of all three not to be seen by 200 runs.

The runs of all 20 blocks go through the filter at once; the first test says that this filter is the reference, run by
run.
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
    passed,
    seen,
    square,
    the_drives,
)

from roboloc import se2
from roboloc_reference.invariant import correct, predict
from roboloc_reference.velocity import jacobians, motion, noise


def matrices(x):
    """Return the matrices (B, 3, 3) of poses (B, 3)."""
    c, s, zero, one = np.cos(x[:, 2]), np.sin(x[:, 2]), np.zeros(len(x)), np.ones(len(x))
    rows = [[c, -s, x[:, 0]], [s, c, x[:, 1]], [zero, zero, one]]
    return np.moveaxis(np.array(rows), -1, 0)


def from_the_left(x):
    """Return what turns an error of the numbers of a pose into a twist from the left, to first order."""
    return np.array([[1.0, 0.0, x[1]], [0.0, 1.0, -x[0]], [0.0, 0.0, 1.0]])


def exponentials(xi):
    """Return the matrices (B, 3, 3) of twists (B, 3)."""
    h = xi[:, 2] / 2
    c, s = np.sinc(h / np.pi) * np.array([np.cos(h), np.sin(h)])
    return matrices(np.stack([c * xi[:, 0] - s * xi[:, 1], s * xi[:, 0] + c * xi[:, 1], xi[:, 2]], axis=1))


def logarithms(X):
    """Return the twists (B, 3) of matrices (B, 3, 3)."""
    omega = np.arctan2(X[:, 1, 0], X[:, 0, 0])
    h = omega / 2
    k = 1 / (np.sinc(h / np.pi) / np.cos(h))
    x, y = X[:, 0, 2], X[:, 1, 2]
    return np.stack([k * x + h * y, k * y - h * x, omega], axis=1)


def adjoints(X):
    """Return Ad (B, 3, 3) of matrices (B, 3, 3), for twists v1, v2, omega."""
    Ad = X.copy()
    Ad[:, 0, 2], Ad[:, 1, 2] = X[:, 1, 2], -X[:, 0, 2]
    return Ad


def untouched(X):
    """Return identities: the noise of the robot's frame taken for one of the world's."""
    return np.tile(np.eye(3), (len(X), 1, 1))


def sandwich(A, P):
    """Return A P A^T."""
    return A @ P @ A.swapaxes(-1, -2)


def of_the_robot(u):
    """Return the covariance of a step in the robot's frame."""
    AW = from_the_left(motion(np.zeros(3), u, DT)) @ jacobians(np.zeros(3), u, DT)[1]
    return sandwich(AW, noise(u, ALPHAS))


def position(z):
    """Return what is seen as positions (B, 2), and their covariances for Q, from bearings and ranges (B, 2)."""
    c, s, r = np.cos(z[:, 0]), np.sin(z[:, 0]), z[:, 1]
    J = np.moveaxis(np.array([[-r * s, c], [r * c, s]]), -1, 0)
    return np.stack([r * c, r * s], axis=1), sandwich(J, Q)


def corrected(X, P, z, landmark, sign=1.0, turn=True):
    """Condition on one landmark seen as z (B, 2); a wrong sign, or noise that is not turned, on request."""
    Y, N = position(z)
    R = X[:, :2, :2]
    v = np.einsum("bij,bj->bi", R, Y) + X[:, :2, 2] - landmark
    H = np.array([[-1.0, 0.0, sign * landmark[1]], [0.0, -1.0, -sign * landmark[0]]])
    Nbar = sandwich(R, N) if turn else N
    L = np.linalg.solve(H @ P @ H.T + Nbar, H @ P).swapaxes(1, 2)
    P = sandwich(np.eye(3) - L @ H, P) + sandwich(L, Nbar)
    return exponentials((L @ v[..., None])[..., 0]) @ X, P


def estimate(drives, W=1.0, adjoint=adjoints, **fault):
    """Return the NEES of all runs at the named instants, (5, B), for a factor of W and a way to be wrong."""
    poses, zs = drives
    count = poses.shape[1]
    X = matrices(np.tile(START, (count, 1)))
    P = np.tile(sandwich(from_the_left(START), SIGMA0), (count, 1, 1))
    nees = []
    for k in range(1, STEPS + 1):
        u = control(k)
        P = P + sandwich(adjoint(X), W * of_the_robot(u))
        X = X @ matrices(motion(np.zeros(3), u, DT)[None])
        for i, which in enumerate(seen(k)):
            X, P = corrected(X, P, zs[k][:, 2 * i : 2 * i + 2], LANDMARKS[which], **fault)
        if k in INSTANTS.values():
            nees.append(square(logarithms(X @ np.linalg.inv(matrices(poses[k]))), P))
    return np.array(nees)


def test_many_runs_at_once_are_the_reference_one_by_one():
    """Run by run, the stages of the reference give the same NEES at every instant, to 1e-6 of it."""
    poses, zs = drives = drive([np.random.default_rng(99)], runs=3)
    many = estimate(drives)
    for run in range(3):
        X, P, nees = matrices(START[None])[0], sandwich(from_the_left(START), SIGMA0), []
        for k in range(1, STEPS + 1):
            u = control(k)
            X, P = predict(X, P, [u[0], 0.0, u[1]], of_the_robot(u), DT)
            for i, which in enumerate(seen(k)):
                (Y,), (N,) = position(zs[k][None, run, 2 * i : 2 * i + 2])
                X, P = correct(X, P, [[*Y, 1.0]], LANDMARKS[which, None], N)
            if k in INSTANTS.values():
                E = X @ np.linalg.inv(matrices(poses[k, run, None])[0])
                xi = se2.log([E[0, 2], E[1, 2], np.arctan2(E[1, 0], E[0, 0])])
                nees.append(square(xi[None], P[None])[0])
        np.testing.assert_allclose(many[:, run], nees, rtol=1e-6)


def test_the_right_filter_is_honest():
    """At least 19 of 20 blocks pass at all five instants; a false alarm in two has a probability of 2e-4."""
    assert passed(estimate(the_drives())).all(axis=0).sum() >= 19


@pytest.mark.parametrize(
    "fault",
    [
        pytest.param({"W": 1e-9}, id="the noise of the motion forgotten"),
        pytest.param({"W": 0.5}, id="half the noise of the motion"),
        pytest.param({"W": 2.0}, id="twice the noise of the motion"),
        pytest.param({"adjoint": untouched}, id="the noise not brought into the world"),
        pytest.param({"adjoint": lambda X: adjoints(X).swapaxes(1, 2)}, id="Ad transposed"),
        pytest.param({"sign": -1.0}, id="H with the transpose of the hat (ERRATA R8)"),
        pytest.param({"turn": False}, id="the observation's noise not turned"),
    ],
)
def test_a_wrong_filter_is_found(fault):
    """None of the 20 blocks passes if the filter is wrong in one thing."""
    assert not passed(estimate(the_drives(), **fault)).all(axis=0).any()
