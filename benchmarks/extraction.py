"""Finding the lines of a scan: split, merge, sharpen, fit.

The baseline is the same algorithm as somebody writes it who knows that Python is slow at arrays of a few entries:
floats and lists throughout, sines taken once, running sums of the whole scan so that no run is summed twice, and
the one search that matters, for the best place to cut, as a loop with everything inlined. It is given the same
full turns and returns the same lines, covariances and ranges.
"""

from itertools import pairwise
from math import atan2, cos, hypot, inf, isnan, pi, sin

import numpy as np

from benchmarks.harness import Result, best_times
from roboloc.lidar import Lidar
from roboloc.simulation import figure_eight, simulate_motion
from roboloc.worlds import arena
from roboloc_reference.extraction import Params, extract_lines

PARAMS = Params(min_segment_length=0.3, line_point_distance=0.05, max_point_gap=0.5, min_points=8)
LIDAR = Lidar(beams=720, field_of_view=2 * pi, max_range=8.0)
VAR_THETA, VAR_RHO = LIDAR.sigma_bearing**2, LIDAR.sigma_range**2

Run = tuple[int, int]


class _Scalar:
    """The points of a scan as lists, with running sums; the manner of `ScanPoints` in loops over floats."""

    def __init__(self, theta: list[float], rho: list[float]) -> None:
        self.size = len(rho)
        self.x = x = [d * cos(a) for d, a in zip(rho, theta, strict=True)]
        self.y = y = [d * sin(a) for d, a in zip(rho, theta, strict=True)]
        self.steps = [hypot(x[i + 1] - x[i], y[i + 1] - y[i]) for i in range(self.size - 1)]
        self.gap = [step > PARAMS.max_point_gap for step in self.steps]
        self.x_mean, self.y_mean = x_mean, y_mean = sum(x) / self.size, sum(y) / self.size
        self.sums = [(0.0, 0.0, 0.0, 0.0, 0.0)]
        sx = sy = sxx = sxy = syy = 0.0
        for a, b in zip(x, y, strict=True):
            a -= x_mean  # noqa: PLW2901 - about the mean, as in ScanPoints
            b -= y_mean  # noqa: PLW2901
            sx, sy, sxx, sxy, syy = sx + a, sy + b, sxx + a * a, sxy + a * b, syy + b * b
            self.sums.append((sx, sy, sxx, sxy, syy))
        self.distances: dict[Run, float] = {}
        self.corners: dict[tuple[int, int, int], int] = {}

    def distance(self, i: int, j: int) -> float:
        if j - i <= 2:
            return 0.0
        if (i, j) not in self.distances:
            n, (ax, ay, axx, axy, ayy), (bx, by, bxx, bxy, byy) = j - i, self.sums[i], self.sums[j]
            x, y = (bx - ax) / n, (by - ay) / n
            xx, xy, yy = bxx - axx - x * x * n, bxy - axy - x * y * n, byy - ayy - y * y * n
            alpha = 0.5 * atan2(-2.0 * xy, yy - xx)
            c, s = cos(alpha), sin(alpha)
            r = c * (x + self.x_mean) + s * (y + self.y_mean)
            n = [c * a + s * b - r for a, b in zip(self.x[i:j], self.y[i:j], strict=True)]
            self.distances[i, j] = max(map(abs, n))
        return self.distances[i, j]

    def touch(self, a: Run, b: Run) -> bool:
        return a[1] == b[0] and not self.gap[a[1] - 1]

    def joint_distance(self, a: Run, b: Run) -> float:
        return self.distance(a[0], b[1]) if self.touch(a, b) else inf

    def corner(self, i: int, j: int, least: int) -> int:
        if (i, j, least) not in self.corners:
            self.corners[i, j, least] = self.cut(i, j, least)
        return self.corners[i, j, least]

    def cut(self, i: int, j: int, least: int) -> int:
        sums = self.sums
        ax, ay, axx, axy, ayy = sums[i]
        bx, by, bxx, bxy, byy = sums[j]
        best, where = inf, i + least
        for k in range(i + least, j - least + 1):
            sx, sy, sxx, sxy, syy = sums[k]
            n, x, y = k - i, sx - ax, sy - ay
            xx, xy, yy = sxx - axx - x * x / n, sxy - axy - x * y / n, syy - ayy - y * y / n
            misfit = xx + yy - hypot(xx - yy, 2.0 * xy)
            n, x, y = j - k, bx - sx, by - sy
            xx, xy, yy = bxx - sxx - x * x / n, bxy - sxy - x * y / n, byy - syy - y * y / n
            misfit += xx + yy - hypot(xx - yy, 2.0 * xy)
            if misfit < best:
                best, where = misfit, k
        return where

    def split(self, begin: int, end: int) -> list[Run]:
        cuts = [begin, *(i + 1 for i in range(begin, end - 1) if self.gap[i]), end]
        todo, done = list(pairwise(cuts))[::-1], []
        while todo:
            i, j = todo.pop()
            if self.distance(i, j) <= PARAMS.line_point_distance:
                done.append((i, j))
            else:
                k = self.corner(i, j, 1)
                todo += [(k, j), (i, k)]
        return done

    def merge(self, runs: list[Run]) -> list[Run]:
        runs = list(runs)
        cost = [self.joint_distance(runs[m], runs[m + 1]) for m in range(len(runs) - 1)]
        while cost and min(cost) <= PARAMS.line_point_distance:
            k = cost.index(min(cost))
            runs[k : k + 2] = [(runs[k][0], runs[k + 1][1])]
            del cost[k]
            for m in (k - 1, k):
                if 0 <= m < len(cost):
                    cost[m] = self.joint_distance(runs[m], runs[m + 1])
        return runs

    def sharpened(self, runs: list[Run], least: int) -> list[Run]:
        runs = list(runs)
        for _ in range(2):
            for m in range(len(runs) - 1):
                a, b = runs[m], runs[m + 1]
                if self.touch(a, b):
                    k = self.corner(a[0], b[1], least)
                    runs[m], runs[m + 1] = (a[0], k), (k, b[1])
        return runs

    def without_shared(self, runs: list[Run], least: int) -> list[Run]:
        runs, m, far = list(runs), 1, PARAMS.line_point_distance
        while m < len(runs) - 1:
            a, b, c = runs[m - 1 : m + 2]
            if self.touch(a, b) and self.touch(b, c):
                k = self.corner(a[0], c[1], least)
                if self.distance(a[0], k) <= far and self.distance(k, c[1]) <= far:
                    runs[m - 1 : m + 2] = [(a[0], k), (k, c[1])]
                    continue
            m += 1
        return runs

    def walls(self, begin: int, end: int) -> list[Run]:
        least = PARAMS.min_points
        runs = [run for run in self.merge(self.split(begin, end)) if run[1] - run[0] >= least]
        while True:
            runs = self.sharpened(runs, least)
            fewer = self.without_shared(self.merge(runs), least)
            if len(fewer) == len(runs):
                return runs
            runs = fewer

    def walls_of_full_turn(self) -> list[Run]:
        N, least = self.size // 2, PARAMS.min_points
        widest = max(self.steps[:N])
        begin = self.steps.index(widest) + 1
        if widest > PARAMS.max_point_gap:
            return self.walls(begin, begin + N)
        best, w = -inf, 2 * least
        for k in range(N):
            (ax, ay, axx, axy, ayy), (bx, by, bxx, bxy, byy) = self.sums[k], self.sums[k + w]
            x, y = bx - ax, by - ay
            xx, xy, yy = bxx - axx - x * x / w, bxy - axy - x * y / w, byy - ayy - y * y / w
            misfit = xx + yy - hypot(xx - yy, 2.0 * xy)
            if misfit > best:
                best, begin = misfit, (k + least) % N
        runs = self.walls(begin, begin + N)
        if len(runs) > 1:
            (i, a), (b, j) = runs[-1], runs[0]
            turn = N if j <= N else 0
            last, first = (i - N + turn, a - N + turn), (b + turn, j + turn)
            if self.touch(last, first):
                runs = [*runs[1:-1], *self.merge(self.sharpened([last, first], least))]
        return runs


def fit(theta: list[float], rho: list[float]) -> tuple[float, float, list[list[float]]]:
    """Fit a line and its covariance, beam by beam."""
    N = len(rho)
    x, y = (
        [d * cos(a) for d, a in zip(rho, theta, strict=True)],
        [d * sin(a) for d, a in zip(rho, theta, strict=True)],
    )
    x_mean, y_mean = sum(x) / N, sum(y) / N
    cross = -2.0 * sum((a - x_mean) * (b - y_mean) for a, b in zip(x, y, strict=True))
    along = sum((b - y_mean) ** 2 - (a - x_mean) ** 2 for a, b in zip(x, y, strict=True))
    spread, alpha = hypot(cross, along), 0.5 * atan2(cross, along)
    r = x_mean * cos(alpha) + y_mean * sin(alpha)
    if r < 0.0:
        alpha, r = alpha + pi, -r
    c, s = [cos(a - alpha) for a in theta], [sin(a - alpha) for a in theta]
    t_mean = sum(d * b for d, b in zip(rho, s, strict=True)) / N
    caa = car = crr = 0.0
    for d, a, b in zip(rho, c, s, strict=True):
        n, t = d * a - r, d * b
        alpha_rho, alpha_theta = -((t - t_mean) * a + n * b) / spread, ((t - t_mean) * t - n * d * a) / spread
        r_rho, r_theta = a / N + t_mean * alpha_rho, -t / N + t_mean * alpha_theta
        caa += VAR_RHO * alpha_rho * alpha_rho + VAR_THETA * alpha_theta * alpha_theta
        car += VAR_RHO * alpha_rho * r_rho + VAR_THETA * alpha_theta * r_theta
        crr += VAR_RHO * r_rho * r_rho + VAR_THETA * r_theta * r_theta
    return (alpha + pi) % (2 * pi) - pi, r, [[caa, car], [car, crr]]


def scalar(theta: list[float], rho: list[float]) -> tuple[list, list, list, list]:
    """Find the lines of a full turn; return alpha, r, C and ranges as lists."""
    beams = len(theta)
    seen = [i for i, d in enumerate(rho) if not isnan(d)]
    theta, rho = 2 * [theta[i] for i in seen], 2 * [rho[i] for i in seen]
    seen += [i + beams for i in seen]
    scan, lines = _Scalar(theta, rho), []
    for i, j in scan.walls_of_full_turn():
        alpha, r, C = fit(theta[i:j], rho[i:j])
        (x1, y1), (x2, y2) = (scan.x[i], scan.y[i]), (scan.x[j - 1], scan.y[j - 1])
        if abs((y2 - y1) * cos(alpha) - (x2 - x1) * sin(alpha)) < PARAMS.min_segment_length:
            continue
        first, end = seen[i], seen[j - 1] + 1
        lines.append(((first - beams, end - beams) if first >= beams else (first, end), alpha, r, C))
    lines.sort(key=lambda line: line[0])
    ranges, alpha, r, C = zip(*lines, strict=True)
    return list(alpha), list(r), list(C), list(ranges)


def against_scalar() -> Result:
    """Compare the extraction from eight full turns in the arena with loops over floats."""
    rng = np.random.default_rng(0)
    poses = simulate_motion([-0.3, 0.0, 0.3], figure_eight(), 0.1)[:: len(figure_eight()) // 8][:8]
    world, theta = arena(), LIDAR.bearings
    scans = [LIDAR.scan(world, pose, rng) for pose in poses]
    lists = [scan.tolist() for scan in scans]
    bearings = theta.tolist()
    for rho, plain in zip(scans, lists, strict=True):
        alpha, r, C, _, ranges = extract_lines(theta, rho, PARAMS, VAR_THETA, VAR_RHO)
        theirs = scalar(bearings, plain)
        np.testing.assert_array_equal(ranges, theirs[3])
        for mine, other in zip((alpha, r, C), theirs[:3], strict=True):
            np.testing.assert_allclose(mine, other, rtol=1e-6, atol=1e-12)

    def ours() -> None:
        for rho in scans:
            extract_lines(theta, rho, PARAMS, VAR_THETA, VAR_RHO)

    def loops() -> None:
        for rho in lists:
            scalar(bearings, rho)

    mine, theirs = best_times([ours, loops], 10)
    name = f"extract-lines-vs-scalar: full turns of {LIDAR.beams} beams in the arena, arguments checked"
    return Result(
        name, theirs / mine, 3.0, "the same algorithm in loops over Python floats, running sums, inlined"
    )


BENCHMARKS = (against_scalar,)
