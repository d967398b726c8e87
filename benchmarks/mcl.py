"""A step of Monte Carlo localization: move, predict the map, associate the scan, weigh.

Three baselines, each how somebody writes it who knows what he is doing in his manner: loops over particles, lines
and observations with small arrays, as the handout's equations read; the same loops over Python floats, with
everything taken out of them that need not be inside; and whole arrays of the size particles x observations x
lines with einsum.
"""

from math import cos, exp, floor, inf, pi, sin

import numpy as np

from benchmarks.harness import Result, best_times
from roboloc_reference import mcl

LINES, OBSERVATIONS, DT = 12, 6, 0.1
TF = (0.1, -0.05, 0.3)


def scene(count: int) -> tuple[np.ndarray, ...]:
    """Return particles around a pose, their controls, a map, a noisy scan of it, covariances and weights."""
    rng = np.random.default_rng(0)
    true = np.array([0.5, -0.3, 2.0])
    xs = true + rng.normal(size=(count, 3)) * [0.3, 0.3, 0.2]
    us = [0.4, 0.5] + 0.1 * rng.normal(size=(count, 2))
    map_lines = np.stack([rng.uniform(-pi, pi, LINES), rng.uniform(1.0, 5.0, LINES)])
    seen = mcl.compute_predicted_measurements(true[None], map_lines, TF)[0, :, :OBSERVATIONS]
    A = 0.1 * rng.normal(size=(OBSERVATIONS, 2, 2))
    Q_raw = A @ A.swapaxes(1, 2) + 0.02 * np.eye(2)
    return xs, us, map_lines, seen + 0.05 * rng.normal(size=seen.shape), Q_raw, np.full(count, 1.0 / count)


def ours(
    xs: np.ndarray,
    us: np.ndarray,
    map_lines: np.ndarray,
    z_raw: np.ndarray,
    Q_raw: np.ndarray,
    ws: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Make a step with the stages of the reference library."""
    xs = mcl.transition_model(xs, us, DT)
    vs = mcl.compute_innovations(z_raw, Q_raw, mcl.compute_predicted_measurements(xs, map_lines, TF))
    return xs, vs, mcl.measurement_weights(vs, Q_raw, ws)


def array_loops(
    xs: np.ndarray,
    us: np.ndarray,
    map_lines: np.ndarray,
    z_raw: np.ndarray,
    Q_raw: np.ndarray,
    ws: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Make a step as the equations read: a vector for each line, a matrix for each observation."""
    tf = np.array(TF)
    moved, logs = np.empty_like(xs), np.log(ws)
    vs = np.empty((len(xs), 2 * len(Q_raw)))
    for m, (x, u) in enumerate(zip(xs, us, strict=True)):
        V, omega = u
        theta, end = x[2], x[2] + omega * DT
        arc = np.array([np.sin(end) - np.sin(theta), np.cos(theta) - np.cos(end)])
        moved[m] = np.append(x[:2] + V / omega * arc, end)
        c, s = np.cos(end), np.sin(end)
        rotation = np.array([[c, -s], [s, c]])
        scanner = moved[m, :2] + rotation @ tf[:2]
        predicted = []
        for alpha, r in map_lines.T:
            h = np.array([alpha - end - tf[2], r - np.array([np.cos(alpha), np.sin(alpha)]) @ scanner])
            if h[1] < 0:
                h = np.array([h[0] + np.pi, -h[1]])
            predicted.append(h)
        for i, (z, Q) in enumerate(zip(z_raw.T, Q_raw, strict=True)):
            nearest = np.inf
            for h in predicted:
                v = z - h
                v[0] = (v[0] + np.pi) % (2 * np.pi) - np.pi
                d2 = v @ np.linalg.solve(Q, v)
                if d2 < nearest:
                    nearest, vs[m, 2 * i : 2 * i + 2] = d2, v
            logs[m] -= nearest / 2
    after = np.exp(logs - logs.max())
    return moved, vs, after / after.sum()


def scalar_loop(
    xs: np.ndarray,
    us: np.ndarray,
    map_lines: np.ndarray,
    z_raw: np.ndarray,
    Q_raw: np.ndarray,
    ws: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Make a step on Python floats: sines of the map and inverse covariances once, local names, no calls."""
    x_cam, y_cam, theta_cam = TF
    walls = [(alpha, r, cos(alpha), sin(alpha)) for alpha, r in map_lines.T.tolist()]
    scan = []
    for (alpha, r), Q in zip(z_raw.T.tolist(), np.linalg.inv(Q_raw).tolist(), strict=True):
        scan.append((alpha, r, Q[0][0], 2 * Q[0][1], Q[1][1]))
    moved, innovations, d2s = [], [], []
    turn = 2 * pi
    for (x, y, theta), (V, omega) in zip(xs.tolist(), us.tolist(), strict=True):
        end = theta + omega * DT
        c, s = cos(end), sin(end)
        x += V / omega * (s - sin(theta))  # noqa: PLW2901 - the pose moves
        y -= V / omega * (c - cos(theta))  # noqa: PLW2901
        moved.append((x, y, end))
        X, Y, heading = x + c * x_cam - s * y_cam, y + s * x_cam + c * y_cam, end + theta_cam
        predicted = []
        for alpha, r, c_alpha, s_alpha in walls:
            h_r = r - X * c_alpha - Y * s_alpha
            predicted.append((alpha - heading, h_r) if h_r >= 0.0 else (alpha - heading + pi, -h_r))
        total, vs = 0.0, []
        for alpha, r, q_aa, q_ar, q_rr in scan:
            nearest = inf
            for h_alpha, h_r in predicted:
                v_alpha, v_r = alpha - h_alpha, r - h_r
                v_alpha -= turn * floor((v_alpha + pi) / turn)
                d2 = v_alpha * (q_aa * v_alpha + q_ar * v_r) + q_rr * v_r * v_r
                if d2 < nearest:
                    nearest, a, b = d2, v_alpha, v_r
            vs += (a, b)
            total += nearest
        innovations.append(vs)
        d2s.append(total)
    best = min(d2s)
    after = [w * exp((best - d2) / 2) for d2, w in zip(d2s, ws.tolist(), strict=True)]
    return np.array(moved), np.array(innovations), np.array(after) / sum(after)


def whole_arrays(
    xs: np.ndarray,
    us: np.ndarray,
    map_lines: np.ndarray,
    z_raw: np.ndarray,
    Q_raw: np.ndarray,
    ws: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Make a step with whole arrays, the innovations of all pairs (M, I, J, 2) at once, and einsum."""
    (x, y, theta), (V, omega) = xs.T, us.T
    end = theta + omega * DT
    x = x + V / omega * (np.sin(end) - np.sin(theta))
    y = y - V / omega * (np.cos(end) - np.cos(theta))
    c, s = np.cos(end), np.sin(end)
    X, Y = x + c * TF[0] - s * TF[1], y + s * TF[0] + c * TF[1]
    alpha, r = map_lines
    h_alpha = alpha - (end + TF[2])[:, None]
    h_r = r - X[:, None] * np.cos(alpha) - Y[:, None] * np.sin(alpha)
    h = np.stack([np.where(h_r < 0, h_alpha + np.pi, h_alpha), np.abs(h_r)], axis=-1)
    v = z_raw.T[None, :, None, :] - h[:, None]
    v[..., 0] = (v[..., 0] + np.pi) % (2 * np.pi) - np.pi
    d2 = np.einsum("mija,iab,mijb->mij", v, np.linalg.inv(Q_raw), v)
    nearest = d2.argmin(axis=2)[:, :, None]
    vs = np.take_along_axis(v, nearest[..., None], axis=2).reshape(len(x), -1)
    logs = np.log(ws) - np.take_along_axis(d2, nearest, axis=2).sum(axis=(1, 2)) / 2
    after = np.exp(logs - logs.max())
    return np.stack([x, y, end], axis=1), vs, after / after.sum()


def _compare(name: str, count: int, other, rounds: int, target: float, baseline: str) -> Result:  # noqa: ANN001
    """Assert that a baseline gives the same particles, innovations and weights, and compare the times of a step."""
    args = scene(count)
    for mine, theirs in zip(ours(*args), other(*args), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=1e-8, atol=1e-11)
    mine, theirs = best_times([lambda: ours(*args), lambda: other(*args)], rounds)
    label = f"{name}: a step, {LINES} lines, {OBSERVATIONS} observations, arguments checked"
    return Result(label, theirs / mine, target, baseline)


def against_array_loops() -> Result:
    """Compare 1000 particles with loops over small arrays."""
    baseline = "loops over particles, lines and observations with small NumPy arrays, arguments not checked"
    return _compare("mcl-1000-vs-array-loops", 1000, array_loops, 5, 1000.0, baseline)


def against_scalar_loop() -> Result:
    """Compare 1000 particles with a careful loop over floats."""
    baseline = "the same loops over Python floats, hoisted and inlined, arguments not checked"
    return _compare("mcl-1000-vs-scalar-loop", 1000, scalar_loop, 100, 50.0, baseline)


def against_einsum() -> Result:
    """Compare 100,000 particles with whole arrays."""
    baseline = "whole arrays (M, I, J, 2) and einsum, arguments not checked"
    return _compare("mcl-100000-vs-einsum", 100_000, whole_arrays, 6, 12.0, baseline)


BENCHMARKS = (against_array_loops, against_scalar_loop, against_einsum)
