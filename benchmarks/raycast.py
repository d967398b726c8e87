"""The ray caster: scans in the maze, as far as the scanner of the course sees, 3.5 m.

The baseline casts one ray at one wall at a time, in plain Python on floats, which for such small work is much
faster than a loop over NumPy's scalars.
"""

from math import cos, inf, nan, pi, sin

import numpy as np

from benchmarks.harness import Result, best_times
from roboloc.lidar import cast_rays
from roboloc.worlds import maze

BEAMS, MAX_RANGE, POSES, ROUNDS = 640, 3.5, 10, 80


def distance_to_wall(x: float, y: float, c: float, s: float, wall: list[float]) -> float:
    """Return how far a ray from (x, y) in the direction (c, s) is from a wall; infinity if it misses."""
    x1, y1, x2, y2 = wall
    ex, ey = x2 - x1, y2 - y1
    determinant = c * ey - s * ex
    if determinant == 0.0:
        return inf
    dx, dy = x1 - x, y1 - y
    rho = (dx * ey - dy * ex) / determinant
    along = (dx * s - dy * c) / determinant
    return rho if rho >= 0.0 and 0.0 <= along <= 1.0 else inf


def loop(segments: np.ndarray, pose: np.ndarray, bearings: np.ndarray, max_range: float) -> np.ndarray:
    """Return the distances to the nearest walls, one ray and one wall at a time."""
    x, y, theta = pose.tolist()
    walls = segments.tolist()
    found = []
    for bearing in bearings.tolist():
        c, s = cos(theta + bearing), sin(theta + bearing)
        nearest = min(distance_to_wall(x, y, c, s, wall) for wall in walls)
        found.append(nearest if nearest <= max_range else nan)
    return np.array(found)


def speed() -> Result:
    """Compare the times of scans from many poses."""
    segments = maze().segments
    bearings = np.linspace(-pi, pi, BEAMS, endpoint=False)
    rng = np.random.default_rng(0)
    poses = rng.uniform([-7.5, -5.5, -pi], [7.5, 5.5, pi], size=(POSES, 3))
    for pose in poses:
        ours, theirs = (function(segments, pose, bearings, MAX_RANGE) for function in (cast_rays, loop))
        np.testing.assert_allclose(ours, theirs, rtol=1e-10)

    def run(function) -> None:  # noqa: ANN001 - one of the two above
        for pose in poses:
            function(segments, pose, bearings, MAX_RANGE)

    ours, theirs = best_times([lambda: run(cast_rays), lambda: run(loop)], ROUNDS)
    baseline = "a loop over rays and walls in plain Python, arguments not checked"
    return Result("raycast-640-beams-vs-loop: 15 walls, arguments checked", theirs / ours, 50.0, baseline)


BENCHMARKS = (speed,)
