"""A step of the extended Kalman filter: a pose moves by the velocity model, then two landmarks are seen.

The baseline is filterpy as its documentation asks for: a subclass whose `predict_x` moves the mean, F and Q set
before each prediction, and one `update` with the stacked observation, its Jacobian, and a residual that wraps
bearings. The functions of the model, which filterpy's user writes, are there twice: in NumPy, over all landmarks at
once, as one writes them; and in Python floats, landmark by landmark, as one rewrites them for speed.
"""

from math import atan2, cos, hypot, pi, sin

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from benchmarks.harness import Result, best_times
from roboloc_reference.velocity import noise
from roboloc_reference.velocity_ekf import correct, predict

DT, STEPS, REPEAT = 0.2, 20, 300
ALPHAS = np.array([0.01, 0.002, 0.002, 0.01, 0.001, 0.001])
LANDMARKS = np.array([[4.0, 1.0], [-2.0, 5.0]])
Q = np.diag([0.02**2, 0.05**2])
START, SIGMA0 = np.array([0.5, -1.0, 0.4]), np.diag([0.05, 0.05, 0.02]) ** 2


def scene() -> tuple[np.ndarray, np.ndarray]:
    """Return the controls (N, 3) of a winding drive and what is seen on it (N, 4), noise included."""
    rng = np.random.default_rng(0)
    k = np.arange(STEPS)
    us = np.stack([np.full(STEPS, 0.8), 0.6 * np.sin(0.3 * k) + 0.1, np.zeros(STEPS)], axis=1)
    x, zs = START, []
    for u in us:
        x = InNumpy.moved(x, u + np.sqrt(np.diag(noise(u, ALPHAS))) * rng.normal(size=3))
        zs.append(InNumpy.seen(x, LANDMARKS) + rng.normal(size=(len(LANDMARKS), 2)).dot(np.sqrt(Q)).ravel())
    return us, np.array(zs)


def ours(us: np.ndarray, zs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Filter the drive with the reference library."""
    x, Sigma = START, SIGMA0
    for u, z in zip(us, zs, strict=True):
        x, Sigma = predict(x, Sigma, u, noise(u, ALPHAS), DT)
        x, Sigma = correct(x, Sigma, z, LANDMARKS, Q)
    return x, Sigma


class InNumpy:
    """The model in arrays."""

    @staticmethod
    def moved(x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the pose after a step."""
        v, omega, gamma = u
        theta, end = x[2], x[2] + omega * DT
        arc = v / omega * np.array([np.sin(end) - np.sin(theta), np.cos(theta) - np.cos(end)])
        return np.append(x[:2] + arc, end + gamma * DT)

    @staticmethod
    def slopes(x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of the motion by the pose and by the control."""
        v, omega, _ = u
        theta, end = x[2], x[2] + omega * DT
        s, c = np.sin(end) - np.sin(theta), np.cos(theta) - np.cos(end)
        F = np.array([[1.0, 0.0, -v / omega * c], [0.0, 1.0, v / omega * s], [0.0, 0.0, 1.0]])
        W = np.array(
            [
                [s / omega, v / omega * (DT * np.cos(end) - s / omega), 0.0],
                [c / omega, v / omega * (DT * np.sin(end) - c / omega), 0.0],
                [0.0, DT, DT],
            ]
        )
        return F, W

    @staticmethod
    def seen(x: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
        """Return bearing and range of each landmark, stacked."""
        dx, dy = (landmarks - x[:2]).T
        return np.column_stack([np.arctan2(dy, dx) - x[2], np.hypot(dx, dy)]).ravel()

    @staticmethod
    def seen_slope(x: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
        """Return the derivative of the stacked observation by the pose."""
        dx, dy = (landmarks - x[:2]).T
        r = np.hypot(dx, dy)
        H = np.zeros((2 * len(landmarks), 3))
        H[::2, 0], H[::2, 1], H[::2, 2] = dy / r**2, -dx / r**2, -1.0
        H[1::2, 0], H[1::2, 1] = -dx / r, -dy / r
        return H


class InFloats:
    """The model in Python floats."""

    @staticmethod
    def moved(x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the pose after a step."""
        v, omega, gamma = u.tolist()
        px, py, theta = x.tolist()
        end, r = theta + omega * DT, v / omega
        return np.array(
            [px + r * (sin(end) - sin(theta)), py + r * (cos(theta) - cos(end)), end + gamma * DT]
        )

    @staticmethod
    def slopes(x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of the motion by the pose and by the control."""
        v, omega, _ = u.tolist()
        theta = x[2].item()
        end, r = theta + omega * DT, v / omega
        s, c = sin(end) - sin(theta), cos(theta) - cos(end)
        F = np.array([[1.0, 0.0, -r * c], [0.0, 1.0, r * s], [0.0, 0.0, 1.0]])
        W = np.array(
            [
                [s / omega, r * (DT * cos(end) - s / omega), 0.0],
                [c / omega, r * (DT * sin(end) - c / omega), 0.0],
                [0.0, DT, DT],
            ]
        )
        return F, W

    @staticmethod
    def seen(x: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
        """Return bearing and range of each landmark, stacked."""
        px, py, theta = x.tolist()
        z = []
        for mx, my in landmarks.tolist():
            z += [atan2(my - py, mx - px) - theta, hypot(mx - px, my - py)]
        return np.array(z)

    @staticmethod
    def seen_slope(x: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
        """Return the derivative of the stacked observation by the pose."""
        px, py, _ = x.tolist()
        H = []
        for mx, my in landmarks.tolist():
            dx, dy = mx - px, my - py
            r = hypot(dx, dy)
            H += [[dy / r / r, -dx / r / r, -1.0], [-dx / r, -dy / r, 0.0]]
        return np.array(H)


def residual(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a - b with the bearings wrapped."""
    y = a - b
    y[::2] = (y[::2] + pi) % (2 * pi) - pi
    return y


class RobotFilter(ExtendedKalmanFilter):
    """filterpy's filter, told how this robot moves."""

    def __init__(self, model: type) -> None:
        super().__init__(dim_x=3, dim_z=2 * len(LANDMARKS))
        self.model = model
        self.x, self.P, self.R = START, SIGMA0, np.kron(np.eye(len(LANDMARKS)), Q)

    def predict_x(self, u: np.ndarray) -> None:
        """Move the mean; the base class does the covariance."""
        self.x = self.model.moved(self.x, u)


def filterpy(us: np.ndarray, zs: np.ndarray, model: type) -> tuple[np.ndarray, np.ndarray]:
    """Filter the drive with filterpy."""
    ekf = RobotFilter(model)
    for u, z in zip(us, zs, strict=True):
        v2, omega2 = u[:2] ** 2
        M = np.diag(ALPHAS[::2] * v2 + ALPHAS[1::2] * omega2)
        ekf.F, W = model.slopes(ekf.x, u)
        ekf.Q = W @ M @ W.T
        ekf.predict(u)
        ekf.update(
            z, model.seen_slope, model.seen, residual=residual, args=(LANDMARKS,), hx_args=(LANDMARKS,)
        )
    return ekf.x, ekf.P


def against(name: str, model: type, target: float, written: str) -> Result:
    """Time a drive with both filters; every step predicts and corrects."""
    drive = scene()
    for got, expected in zip(ours(*drive), filterpy(*drive, model), strict=True):
        np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-12)
    us, theirs = best_times([lambda: ours(*drive), lambda: filterpy(*drive, model)], rounds=REPEAT)
    return Result(name, theirs / us, target, f"filterpy 1.4.5, ExtendedKalmanFilter, the model in {written}")


def ekf_step_vs_filterpy() -> Result:
    """Compare with the model in NumPy."""
    return against("ekf-step-vs-filterpy", InNumpy, 1.8, "NumPy")


def ekf_step_vs_filterpy_in_floats() -> Result:
    """Compare with the model rewritten for speed."""
    return against("ekf-step-vs-filterpy-in-floats", InFloats, 1.3, "Python floats")


BENCHMARKS = (ekf_step_vs_filterpy, ekf_step_vs_filterpy_in_floats)
