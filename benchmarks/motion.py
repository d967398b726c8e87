"""The motion model: accuracy near omega = 0, and the price of it.

The baseline is the textbook's formula in plain NumPy with the handout's switch to the limits below
EPSILON_OMEGA, as a careful student of AA274A would write it.
"""

import mpmath as mp
import numpy as np

from benchmarks.harness import Result, best_times
from roboloc_reference.motion import EPSILON_OMEGA, compute_dynamics


def textbook(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return g, Gx, Gu by the closed form, or by its limits where omega is small."""
    x, y, theta = xvec
    V, omega = u
    end = theta + omega * dt
    s, c = np.sin(theta), np.cos(theta)
    if abs(omega) < EPSILON_OMEGA:
        dx, dy = V * dt * c, V * dt * s
        Gu = np.array([[dt * c, -V * dt**2 * s / 2], [dt * s, V * dt**2 * c / 2], [0.0, dt]])
    else:
        s_end, c_end = np.sin(end), np.cos(end)
        a, b = (s_end - s) / omega, (c - c_end) / omega
        dx, dy = V * a, V * b
        Gu = np.array(
            [[a, V * (dt * c_end - a) / omega], [b, V * (dt * s_end - b) / omega], [0.0, dt]],
        )
    g = np.array([x + dx, y + dy, end])
    Gx = np.array([[1.0, 0.0, -dy], [0.0, 1.0, dx], [0.0, 0.0, 1.0]])
    return g, Gx, Gu


def exact(theta: float, V: float, omega: float, dt: float) -> tuple[mp.matrix, mp.matrix]:
    """Return displacement and Gu from the arc's integral, correct to more than 50 digits."""
    with mp.workdps(100):
        theta, V, omega, dt = (mp.mpf(float(value)) for value in (theta, V, omega, dt))
        s, c, end = mp.sin(theta), mp.cos(theta), theta + omega * dt
        if omega:
            a, b = (mp.sin(end) - s) / omega, (c - mp.cos(end)) / omega
            by_omega = V * (dt * mp.cos(end) - a) / omega, V * (dt * mp.sin(end) - b) / omega
        else:
            a, b = dt * c, dt * s
            by_omega = -V * dt**2 * s / 2, V * dt**2 * c / 2
        return mp.matrix([V * a, V * b]), mp.matrix([[a, by_omega[0]], [b, by_omega[1]], [0, dt]])


def _error(got: np.ndarray, right: mp.matrix) -> float:
    with mp.workdps(50):
        return float(mp.norm(mp.matrix(got.tolist()) - right) / mp.norm(right))


def accuracy() -> Result:
    """Compare the worst norm-wise relative errors of displacement and Gu over omega and dt."""
    rng = np.random.default_rng(0)
    omegas = [0.0, *np.geomspace(1e-12, 1.0, 121), *-np.geomspace(1e-12, 1.0, 121)]
    ours = theirs = 0.0
    for dt in (0.01, 0.1, 1.0):
        for omega in omegas:
            theta, V = rng.uniform(-np.pi, np.pi), rng.uniform(0.1, 2.0)
            displacement, right_Gu = exact(theta, V, omega, dt)
            errors = []
            for function in (compute_dynamics, textbook):
                g, _, Gu = function(np.array([0.0, 0.0, theta]), np.array([V, omega]), dt)
                errors.append(max(_error(g[:2], displacement), _error(Gu, right_Gu)))
            ours, theirs = max(ours, errors[0]), max(theirs, errors[1])
    if ours > 1e-15:
        raise ArithmeticError(f"expected errors up to 1e-15, got {ours:.2g}")
    name = "compute_dynamics: worst error for omega in +-[1e-12, 1] and 0, dt in {.01, .1, 1}"
    return Result(name, theirs / ours, 1e11, "closed form with the handout's switch at 1e-3 rad/s")


def speed() -> Result:
    """Compare the times of a thousand calls on turns well away from the switch."""
    rng = np.random.default_rng(1)
    poses = rng.uniform(-3, 3, size=(1000, 3))
    controls = rng.uniform(0.2, 1.0, size=(1000, 2)) * rng.choice([-1.0, 1.0], size=(1000, 2))
    cases = list(zip(poses, controls, strict=True))
    for xvec, u in cases:
        for ours, theirs in zip(compute_dynamics(xvec, u, 0.1), textbook(xvec, u, 0.1), strict=True):
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-13)

    def run(function) -> None:  # noqa: ANN001 - one of the two above
        for xvec, u in cases:
            function(xvec, u, 0.1)

    ours, theirs = best_times([lambda: run(compute_dynamics), lambda: run(textbook)])
    name = "compute_dynamics: time of a call, arguments checked"
    return Result(name, theirs / ours, 1.3, "closed form in plain NumPy, arguments not checked")


BENCHMARKS = (accuracy, speed)
