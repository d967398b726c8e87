"""A step of SLAM on a large map: the robot moves, then a few lines are seen again.

The baseline is how a competent user writes it down from the handout: the transition model and the derivatives as full
matrices, and the three products of the prediction and the correction in NumPy, with a solve where the handout has
an inverse. Both have one thread: on a machine that does other things as well, threads of BLAS that wait for each other
measure the other things.
"""

import multiprocessing
import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.harness import Result, best_times, fitted_exponent
from roboloc_reference.slam_blocks import BlockEkfSlam

SEEN, DT = 4, 0.1
MANY = 10  # of our steps are timed in a row, as a filter makes them: what a step needs is in the cache
U, R, TF = np.array([0.5, 0.3]), np.diag([0.01, 0.02]), np.array([0.1, -0.05, 0.3])
Q = np.diag([0.01, 0.02]) ** 2


def scene(J: int) -> tuple[np.ndarray, ...]:
    """Return a state of J lines and its covariance, the lines that are seen, and how."""
    rng = np.random.default_rng(0)
    map_lines = np.stack([rng.uniform(-np.pi, np.pi, J), rng.uniform(1.0, 50.0, J)], axis=1)
    x = np.concatenate([[0.5, -0.3, 2.0], map_lines.ravel()])
    root = 0.01 * rng.normal(size=(x.size, 8))
    Sigma = root @ root.T + 1e-4 * np.eye(x.size)  # everything has to do with everything
    seen = rng.choice(J, SEEN, replace=False)
    z_raw, _ = predicted(x, seen)
    return x, Sigma, seen, z_raw.T + rng.multivariate_normal(np.zeros(2), Q, SEEN).T


def predicted(x: np.ndarray, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the seen lines (K, 2) as the scanner sees them, and the full H (2K, n)."""
    px, py, theta = x[:3]
    h, H = np.empty((len(seen), 2)), np.zeros((2 * len(seen), x.size))
    for k, j in enumerate(seen):
        alpha, r = x[3 + 2 * j : 5 + 2 * j]
        beta = alpha - theta
        c, s, c_beta, s_beta = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
        turn = TF[0] * s_beta - TF[1] * c_beta
        h[k] = beta - TF[2], r - px * c - py * s - TF[0] * c_beta - TF[1] * s_beta
        H[2 * k, [2, 3 + 2 * j]] = -1.0, 1.0
        H[2 * k + 1, [0, 1, 2, 3 + 2 * j, 4 + 2 * j]] = -c, -s, -turn, px * s - py * c + turn, 1.0
        if h[k, 1] < 0:
            h[k] = h[k, 0] + np.pi, -h[k, 1]
            H[2 * k + 1] *= -1.0
    return h, H


def dense(
    x: np.ndarray, Sigma: np.ndarray, seen: np.ndarray, z_raw: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Make a step with full matrices."""
    n, (V, omega), theta = x.size, U, x[2]
    end = theta + omega * DT
    a, b = (np.sin(end) - np.sin(theta)) / omega, (np.cos(theta) - np.cos(end)) / omega
    g = x.copy()
    g[:3] += V * a, V * b, omega * DT
    Gx, Gu = np.eye(n), np.zeros((n, 2))
    Gx[0, 2], Gx[1, 2] = -V * b, V * a
    Gu[:3, 0] = a, b, 0.0
    Gu[:3, 1] = V * (DT * np.cos(end) - a) / omega, V * (DT * np.sin(end) - b) / omega, DT
    Sigma = Gx @ Sigma @ Gx.T + DT * (Gu @ R @ Gu.T)

    h, H = predicted(g, seen)
    v = z_raw.T - h
    v[:, 0] = (v[:, 0] + np.pi) % (2 * np.pi) - np.pi
    S = H @ Sigma @ H.T + np.kron(np.eye(len(seen)), Q)
    K = np.linalg.solve(S, H @ Sigma).T
    return g + K @ v.ravel(), Sigma - K @ S @ K.T


def steps(ekf: BlockEkfSlam, seen: np.ndarray, z_raw: np.ndarray, count: int = 1) -> None:
    """Make steps with the filter of the reference library."""
    for _ in range(count):
        ekf.transition_update(U, DT)
        ekf.correct(seen, z_raw, [Q] * len(seen))


def times(J: int, rounds: int) -> tuple[float, float]:
    """Return the times of our step and of the baseline's, after they were found equal."""
    x, Sigma, seen, z_raw = scene(J)
    ekf = BlockEkfSlam(x, Sigma, R, TF)
    steps(ekf, seen, z_raw)
    for mine, theirs in zip((ekf.x, ekf.Sigma), dense(x, Sigma, seen, z_raw), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=1e-9, atol=1e-12)
    variants = [lambda: steps(ekf, seen, z_raw, MANY), lambda: dense(x, Sigma, seen, z_raw)]
    ours, theirs = best_times(variants, rounds)
    return ours / MANY, theirs


def our_time(J: int) -> float:
    """Return the time of our step alone."""
    x, Sigma, seen, z_raw = scene(J)
    ekf = BlockEkfSlam(x, Sigma, R, TF)
    return best_times([lambda: steps(ekf, seen, z_raw, MANY)], 5)[0] / MANY


def on_one_thread(function: Callable, *arguments: Any) -> Any:
    """Return the result of a function from a new process, in which BLAS has one thread."""
    threads = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
    spawn = multiprocessing.get_context("spawn")
    with patch.dict(os.environ, threads), ProcessPoolExecutor(1, mp_context=spawn) as process:
        return process.submit(function, *arguments).result()


def against_dense() -> Result:
    """Compare a step on a thousand lines with full matrices."""
    ours, theirs = on_one_thread(times, 1000, 6)
    name = f"slam-1000-vs-dense: a step, 1000 lines, {SEEN} seen and known, arguments checked"
    return Result(name, theirs / ours, 50.0, "full matrices Gx and H in plain NumPy, arguments not checked")


def scaling() -> Result:
    """Compare the exponents with which the time of a step grows with the number of lines."""
    small, large = [60, 125, 250, 500], [250, 500, 1000, 2000]
    ours = fitted_exponent(large, [on_one_thread(our_time, J) for J in large])
    theirs = fitted_exponent(small, [on_one_thread(times, J, 6)[1] for J in small])
    baseline = f"full matrices, J^{theirs:.2f} from 60 to 500 lines; ours J^{ours:.2f} from 250 to 2000"
    return Result(
        "slam-scaling: exponent of the time of a step in the number of lines", theirs / ours, 1.2, baseline
    )


BENCHMARKS = (against_dense, scaling)
