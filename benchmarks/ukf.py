"""A step of the unscented Kalman filter: a pose moves by the velocity model, then two landmarks are seen.

The baseline is filterpy with its Julier points, and with the functions for means and residuals on the circle that
its documentation asks for. Pose and control have an error together, so the prediction is that of a filter with
six numbers; the correction draws its points anew, as filterpy's method for corrections behind each other does.
"""

from math import atan2, cos, hypot, pi, sin

import numpy as np
from filterpy.kalman import JulierSigmaPoints, UnscentedKalmanFilter

from benchmarks.ekf import ALPHAS, DT, LANDMARKS, SIGMA0, START, Q, residual, scene
from benchmarks.harness import Result, best_times
from roboloc_reference.ukf import correct, predict
from roboloc_reference.velocity import noise

STEPS, REPEAT = 10, 100
KAPPA = 1.0


def ours(us: np.ndarray, zs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Filter the drive with the reference library."""
    mean, cov = START, SIGMA0
    for u, z in zip(us, zs, strict=True):
        mean, cov = predict(mean, cov, u, noise(u, ALPHAS), DT, KAPPA)
        mean, cov = correct(mean, cov, z, LANDMARKS, Q, KAPPA)
    return mean, cov


def moved(point: np.ndarray, dt: float) -> np.ndarray:
    """Return pose and control after a step."""
    px, py, theta, v, omega, gamma = point
    end, r = theta + omega * dt, v / omega
    x, y = px + r * (sin(end) - sin(theta)), py + r * (cos(theta) - cos(end))
    return np.array([x, y, end + gamma * dt, v, omega, gamma])


def unmoved(point: np.ndarray, _: float) -> np.ndarray:
    """Return a point as it is."""
    return point


def seen(point: np.ndarray) -> np.ndarray:
    """Return bearing and range of each landmark, stacked."""
    px, py, theta = point
    z = []
    for mx, my in LANDMARKS:
        z += [atan2(my - py, mx - px) - theta, hypot(mx - px, my - py)]
    return np.array(z)


def seen_mean(points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the mean of observations: the direction of the vector sum, then the residuals' mean about it."""
    z = weights @ points
    z[::2] = np.arctan2(weights @ np.sin(points[:, ::2]), weights @ np.cos(points[:, ::2]))
    away = (points[:, ::2] - z[::2] + pi) % (2 * pi) - pi
    z[::2] += weights @ away
    return z


def pose_residual(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a - b with the heading wrapped."""
    d = a - b
    d[2] = (d[2] + pi) % (2 * pi) - pi
    return d


def filterpy(us: np.ndarray, zs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Filter the drive with filterpy."""
    mover = UnscentedKalmanFilter(
        6, 4, DT, None, moved, JulierSigmaPoints(6, KAPPA), residual_x=pose_residual
    )
    mover.Q = np.zeros((6, 6))
    looker = UnscentedKalmanFilter(
        *(3, 2 * len(LANDMARKS), DT, seen, unmoved, JulierSigmaPoints(3, KAPPA)),
        z_mean_fn=seen_mean,
        residual_x=pose_residual,
        residual_z=residual,
    )
    looker.x, looker.P, looker.R = START, SIGMA0, np.kron(np.eye(len(LANDMARKS)), Q)
    for u, z in zip(us, zs, strict=True):
        v2, omega2 = u[:2] ** 2
        mover.x = np.concatenate([looker.x, u])
        mover.P = np.zeros((6, 6))
        mover.P[:3, :3] = looker.P
        mover.P[3:, 3:] = np.diag(ALPHAS[::2] * v2 + ALPHAS[1::2] * omega2)
        mover.predict()
        looker.x, looker.P = mover.x[:3], mover.P[:3, :3]
        looker.compute_process_sigmas(DT)
        looker.update(z)
    return looker.x, looker.P


def ukf_step_vs_filterpy() -> Result:
    """Time a drive with both filters; every step predicts and corrects."""
    us, zs = (part[:STEPS] for part in scene())
    for got, expected in zip(ours(us, zs), filterpy(us, zs), strict=True):
        np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-12)
    mine, theirs = best_times([lambda: ours(us, zs), lambda: filterpy(us, zs)], rounds=REPEAT)
    return Result(
        "ukf-step-vs-filterpy", theirs / mine, 2.5, "filterpy 1.4.5, UnscentedKalmanFilter, Julier points"
    )


BENCHMARKS = (ukf_step_vs_filterpy,)
