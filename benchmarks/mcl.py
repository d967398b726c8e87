"""A step of Monte Carlo localization: move the cloud, and weigh it by a scan and the map.

Three baselines, each how somebody writes it who knows what he is doing in his manner: loops over particles, lines
and observations with small arrays, as the handout's equations read; the same loops over Python floats, where nothing
is an array and the covariances are inverted once; and whole arrays of the size particles x observations x lines with
einsum. The second is written to be read: with the wrapping inlined, squares as products and the sines of the map
taken out of the loop it is a third faster.

Ours is what the reference filter does: it needs the weights, and neither predictions nor innovations, which the
baselines do not keep either. Called one after the other, the graded stages return those too; how much longer that
takes is printed.

The cloud is about a pose, 0.3 m and 0.2 rad wide. Nothing depends on that: neither do we skip lines that are far off,
nor do the baselines.
"""

from math import cos, exp, inf, pi, sin

import numpy as np

from benchmarks.harness import Result, best_times, fitted_exponent
from roboloc_reference import mcl
from roboloc_reference.cloud_weights import weigh

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
) -> tuple[np.ndarray, np.ndarray]:
    """Make a step as the reference filter does."""
    xs = mcl.transition_model(xs, us, DT)
    return xs, weigh(xs, ws, z_raw, Q_raw, map_lines, TF)


def by_stages(
    xs: np.ndarray,
    us: np.ndarray,
    map_lines: np.ndarray,
    z_raw: np.ndarray,
    Q_raw: np.ndarray,
    ws: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Make a step with the graded stages one after the other."""
    xs = mcl.transition_model(xs, us, DT)
    vs = mcl.compute_innovations(z_raw, Q_raw, mcl.compute_predicted_measurements(xs, map_lines, TF))
    return xs, mcl.measurement_weights(vs, Q_raw, ws)


def array_loops(
    xs: np.ndarray,
    us: np.ndarray,
    map_lines: np.ndarray,
    z_raw: np.ndarray,
    Q_raw: np.ndarray,
    ws: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Make a step as the equations read: a vector for each line, a matrix for each observation."""
    tf = np.array(TF)
    moved, logs = np.empty_like(xs), np.log(ws)
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
        for z, Q in zip(z_raw.T, Q_raw, strict=True):
            nearest = np.inf
            for h in predicted:
                v = z - h
                v[0] = (v[0] + np.pi) % (2 * np.pi) - np.pi
                nearest = min(nearest, v @ np.linalg.solve(Q, v))
            logs[m] -= nearest / 2
    after = np.exp(logs - logs.max())
    return moved, after / after.sum()


def wrap(angle: float) -> float:
    """Wrap an angle to [-pi, pi)."""
    return (angle + pi) % (2 * pi) - pi


def scalar_loop(
    xs: np.ndarray,
    us: np.ndarray,
    map_lines: np.ndarray,
    z_raw: np.ndarray,
    Q_raw: np.ndarray,
    ws: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Make a step on Python floats: no array inside the loops, and no matrix inverted there."""
    x_cam, y_cam, theta_cam = TF
    walls, scan, inverses = map_lines.T.tolist(), z_raw.T.tolist(), np.linalg.inv(Q_raw).tolist()
    moved, d2s = [], []
    for (x, y, theta), (V, omega) in zip(xs.tolist(), us.tolist(), strict=True):
        end = theta + omega * DT
        x += V / omega * (sin(end) - sin(theta))  # noqa: PLW2901 - the pose moves
        y -= V / omega * (cos(end) - cos(theta))  # noqa: PLW2901
        moved.append((x, y, end))
        X = x + x_cam * cos(end) - y_cam * sin(end)
        Y = y + x_cam * sin(end) + y_cam * cos(end)
        predicted = []
        for alpha, r in walls:
            h_alpha, h_r = alpha - end - theta_cam, r - X * cos(alpha) - Y * sin(alpha)
            predicted.append((h_alpha, h_r) if h_r >= 0 else (h_alpha + pi, -h_r))
        total = 0.0
        for (alpha, r), ((a, b), (_, c)) in zip(scan, inverses, strict=True):
            nearest = inf
            for h_alpha, h_r in predicted:
                v_alpha, v_r = wrap(alpha - h_alpha), r - h_r
                d2 = a * v_alpha**2 + 2 * b * v_alpha * v_r + c * v_r**2
                if d2 < nearest:  # noqa: PLR1730 - a call of min() takes twice as long
                    nearest = d2
            total += nearest
        d2s.append(total)
    best = min(d2s)
    after = [w * exp((best - d2) / 2) for d2, w in zip(d2s, ws.tolist(), strict=True)]
    return np.array(moved), np.array(after) / sum(after)


def whole_arrays(
    xs: np.ndarray,
    us: np.ndarray,
    map_lines: np.ndarray,
    z_raw: np.ndarray,
    Q_raw: np.ndarray,
    ws: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
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
    logs = np.log(ws) - d2.min(axis=2).sum(axis=1) / 2
    after = np.exp(logs - logs.max())
    return np.stack([x, y, end], axis=1), after / after.sum()


def _compare(name: str, count: int, other, rounds: int, many: int, target: float, baseline: str) -> Result:  # noqa: ANN001
    """Assert that a baseline gives the same particles and weights, and compare the times of a step.

    So many steps of ours are timed in a row, as a filter makes them: what a step needs is in the cache. A large array
    is freed before, as in any process that has run for a while: until then the C library returns the memory of
    results at once, and a step of 1000 particles takes 0.3 ms longer, to be given zeroed pages again.
    """
    np.ones(2_000_000)
    args = scene(count)
    for mine, theirs in zip(ours(*args), other(*args), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=1e-8, atol=1e-11)
    mine, theirs = best_times([lambda: [ours(*args) for _ in range(many)], lambda: other(*args)], rounds)
    label = f"{name}: a step, {LINES} lines, {OBSERVATIONS} observations, arguments checked"
    return Result(label, many * theirs / mine, target, baseline)


def against_array_loops() -> Result:
    """Compare 1000 particles with loops over small arrays."""
    baseline = "loops over particles, lines and observations with small NumPy arrays, arguments not checked"
    return _compare("mcl-1000-vs-array-loops", 1000, array_loops, 5, 100, 1000.0, baseline)


def against_scalar_loop() -> Result:
    """Compare 1000 particles with a careful loop over floats."""
    baseline = "the same loops over Python floats, covariances inverted once, arguments not checked"
    return _compare("mcl-1000-vs-scalar-loop", 1000, scalar_loop, 60, 10, 50.0, baseline)


def against_einsum() -> Result:
    """Compare 100,000 particles with whole arrays."""
    baseline = "whole arrays (M, I, J, 2) and einsum, arguments not checked"
    return _compare("mcl-100000-vs-einsum", 100_000, whole_arrays, 12, 2, 12.0, baseline)


def scaling() -> Result:
    """Fit how the time of a step grows with the number of particles."""
    np.ones(2_000_000)  # freed for the reason given above
    sizes = (1_000, 4_000, 16_000, 64_000)
    clouds = [scene(M) for M in sizes]
    for mine, theirs in zip(ours(*clouds[0]), by_stages(*clouds[0]), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=1e-8, atol=1e-11)
    alone, staged = best_times([lambda step=step: step(*clouds[0]) for step in (ours, by_stages)], 200)
    print(f"        the graded stages one after the other take {staged / alone:.2f} times as long")
    exponent = fitted_exponent(sizes, best_times([lambda args=args: ours(*args) for args in clouds], 15))
    print(
        f"        a step of MCL takes a time that grows as M^{exponent:.2f}, M from {sizes[0]} to {sizes[-1]}"
    )
    return Result("mcl-scaling: 1 over the exponent of M in the time of a step", 1 / exponent, 0.9, "M^1")


BENCHMARKS = (against_array_loops, against_scalar_loop, against_einsum, scaling)
