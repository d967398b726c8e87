"""Record the runs that come with the student's package: src/roboloc/data/maze.npz and arena.npz.

A driver who sees the robot steers it along a route: 30 times a second, more or less, the robot is told a speed
and a turning rate towards a point of the route half a metre ahead of it; 6 times a second, more or less and at
times of its own, it scans. What it is told and what it does differ by the control noise of the handout, drawn
with covariance dt R in every interval between two events. A few steps are coarse as an instrument's are, so
that the files stay small: times 2**-14 s, commands 2**-8, ranges 2**-10 m.

The same numbers come out on every machine, to rounding; a test records again and compares.

Usage: python tools/record_logs.py [FOLDER]
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from roboloc import se2
from roboloc.lidar import Lidar
from roboloc.logs import Log
from roboloc.worlds import World, arena, maze
from roboloc_reference.extraction import Params, extract_lines

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "src" / "roboloc" / "data"

CONTROL_PERIOD, SCAN_PERIOD, JITTER = 1 / 30, 1 / 6, 0.05
TIME_STEP, COMMAND_STEP, RANGE_STEP = 2.0**-14, 2.0**-8, 2.0**-10
SPEED, AHEAD, FASTEST_TURN = 0.55, 0.5, 1.5
PARAMS = Params(min_segment_length=0.4, line_point_distance=0.05, max_point_gap=0.4, min_points=8)
SIGMA0 = np.diag([0.05, 0.05, 0.03]) ** 2
R = np.diag([0.5, 0.3])


@dataclass(frozen=True)
class Recording:
    """What to record: a world, a route through it [m], a scanner and a seed."""

    world: World
    route: tuple[tuple[float, float], ...]
    lidar: Lidar
    seed: int


RECORDINGS = {
    "maze": Recording(
        maze(),
        (
            *((-6.4, -4.6), (4.2, -4.6), (5.6, -3.9), (6.6, -2.6), (5.6, -1.3), (4.0, -0.6)),
            *((3.9, 0.4), (4.6, 1.6), (6.4, 2.0), (5.8, 3.6), (4.2, 4.6), (2.0, 4.8), (0.4, 4.2)),
            *((-0.4, 2.5), (-2.4, 2.4), (-3.4, 4.2), (-5.2, 4.0), (-6.6, 2.4), (-6.2, 0.7), (-4.6, 0.45)),
            *((-1.6, 0.45), (-0.4, 0.0), (-0.2, -1.4), (-1.4, -3.4), (-3.0, -4.4), (-6.0, -4.2)),
        ),
        Lidar(),
        seed=1,
    ),
    "arena": Recording(
        arena(),
        (
            *((-1.6, -1.2), (1.4, -1.2), (2.4, 0.2), (1.4, 1.4), (-0.8, 1.4), (-1.8, 0.2), (-0.4, -0.8)),
            *((1.2, 0.2), (0.2, 1.0), (-1.6, 0.6), (-2.0, -1.0), (0.4, -1.6)),
        ),
        Lidar(field_of_view=np.pi / 2, beams=91, max_range=8.0),
        seed=2,
    ),
}


def _whole(value: np.ndarray | float, step: float) -> np.ndarray | float:
    """Return the nearest whole number of steps."""
    return np.rint(np.asarray(value) / step) * step


def _later(period: float, rng: np.random.Generator) -> float:
    """Return the time to the next of something that comes about once a period [s]."""
    jitter = np.clip(rng.standard_normal(), -3.0, 3.0)
    return float(_whole(period * (1.0 + JITTER * jitter), TIME_STEP))


class Driver:
    """Steer towards a point of the route a little ahead of the robot."""

    def __init__(self, route: tuple[tuple[float, float], ...]) -> None:
        corners = np.array(route)
        lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
        along = np.arange(0.0, lengths[-1], 0.05)
        self.points = np.stack([np.interp(along, lengths, column) for column in corners.T], axis=1)
        self.passed = 0

    @property
    def arrived(self) -> bool:
        """Whether the whole route lies behind."""
        return self.passed >= len(self.points) - 1

    def command(self, x: np.ndarray) -> np.ndarray:
        """Return V, omega for a robot at a pose."""
        near = self.points[self.passed : self.passed + 20]
        self.passed += int(np.argmin(np.hypot(*(near - x[:2]).T)))
        tx, ty = self.points[min(self.passed + round(AHEAD / 0.05), len(self.points) - 1)]
        bx, by, _ = se2.compose(se2.inverse(x), [tx, ty, 0.0])
        curvature = 2.0 * by / (bx * bx + by * by)
        V = SPEED / (1.0 + 0.5 * abs(curvature))
        omega = np.clip(V * curvature, -FASTEST_TURN, FASTEST_TURN)
        return _whole(np.array([V, omega]), COMMAND_STEP)


def record(recording: Recording) -> Log:
    """Drive the route and return the log."""
    rng = np.random.default_rng(recording.seed)
    world, lidar = recording.world, recording.lidar
    std0, std_u = np.sqrt(np.diag(SIGMA0)), np.sqrt(np.diag(R))
    x = world.start
    x0 = x + std0 * rng.standard_normal(3)
    driver = Driver(recording.route)
    t, next_control, next_scan = 0.0, 0.0, float(_whole(0.1, TIME_STEP))
    u = np.zeros(2)
    control_times, controls, scan_times, scans, truth_times, truth = [], [], [], [], [0.0], [x]
    while not driver.arrived:
        end = min(next_control, next_scan)
        dt = end - t
        if dt > 0.0:
            V, omega = u + np.sqrt(dt) * std_u * rng.standard_normal(2)
            x = se2.compose(x, se2.exp([V * dt, 0.0, omega * dt]))
        t = end
        if t == next_scan:
            scan_times.append(t)
            scans.append(_whole(lidar.scan(world, x, rng), RANGE_STEP))
            truth_times.append(t)
            truth.append(x)
            next_scan = t + _later(SCAN_PERIOD, rng)
        if t == next_control:
            u = driver.command(x)
            control_times.append(t)
            controls.append(u)
            next_control = t + _later(CONTROL_PERIOD, rng)
    return Log(
        control_times, controls, scan_times, lidar.bearings, scans, *lines(lidar, scans),
        truth_times, truth, x0, SIGMA0, R, lidar.tf_base_to_camera, world.name,
    )  # fmt: skip


def lines(lidar: Lidar, scans: list[np.ndarray]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the lines in each scan, z_raw and Q_raw."""
    z_raw, Q_raw = [], []
    for rho in scans:
        alpha, r, C, _, _ = extract_lines(
            lidar.bearings, rho, PARAMS, lidar.sigma_bearing**2, lidar.sigma_range**2
        )
        z_raw.append(np.stack([alpha, r]))
        Q_raw.append(C)
    return z_raw, Q_raw


def main(arguments: list[str]) -> None:
    """Record all runs into a folder."""
    folder = Path(arguments[0]) if arguments else FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    for name, recording in RECORDINGS.items():
        log = record(recording)
        path = folder / f"{name}.npz"
        log.write(path)
        print(f"{path.name}: {log.scan_times[-1]:.1f} s, {path.stat().st_size} bytes")


if __name__ == "__main__":
    main(sys.argv[1:])
