"""Record the runs of the student's package that are driven by velocities: src/roboloc/data/{eight,unsure}.npz.

The truth is made by `roboloc_reference.velocity`, which a student has to write; so students get the arrays, rounded to
nine digits after the point, and not what makes them. The first set are runs of `roboloc_reference.scenarios`; in the
second the start is turned by a draw of half a radian, the robot is told two circles of six seconds, and of its first
sixteen steps the observations are left out.

The same numbers come out on every machine, to rounding; a test records again and compares.

Usage: python tools/record_velocity_logs.py [FOLDER]
"""

import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from roboloc.velocity_logs import VelocityLog
from roboloc_reference import scenarios
from roboloc_reference.velocity import motion, noise, range_bearings

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "src" / "roboloc" / "data"

RUNS, DIGITS = 20, 9
SEEDS = {"eight": 3, "unsure": 4}
UNSURE, BLIND, STEPS_A_CIRCLE = np.diag([0.1, 0.1, 0.5]) ** 2, 16, 24


def eight(rng: np.random.Generator | None) -> VelocityLog:
    """Drive the figure of eight once; with None nothing is drawn."""
    run = scenarios.simulate(rng)
    return replace(run, zs=run.zs.round(DIGITS), truth=run.truth.round(DIGITS))


def unsure(rng: np.random.Generator | None) -> VelocityLog:
    """Drive from a start with a heading that is hardly known, blindly at first; with None nothing is drawn."""
    told = eight(None)
    middle = len(told.us) // 2
    us = told.us[middle - STEPS_A_CIRCLE : middle + STEPS_A_CIRCLE]
    seen = told.seen[: len(us)].copy()
    seen[:BLIND] = -1

    def draw(variances: np.ndarray) -> np.ndarray:
        """Return independent normal numbers, or zeros."""
        return np.sqrt(variances) * (rng.normal(size=variances.size) if rng else 0.0)

    truth, zs = [told.x0 + draw(np.diag(UNSURE))], []
    for u, which in zip(us, seen, strict=True):
        truth.append(motion(truth[-1], u + draw(np.diag(noise(u, told.alphas))), told.dt))
        z = range_bearings(truth[-1][None], told.landmarks[which]).ravel()
        zs.append((z + draw(np.tile(np.diag(told.Q), 2))) * (which[0] >= 0))
    return VelocityLog(
        *(told.dt, us, told.alphas, told.landmarks, seen, np.round(zs, DIGITS), told.Q, told.x0, UNSURE),
        np.round(truth, DIGITS),
    )


SETS = {"eight": eight, "unsure": unsure}


def record(name: str) -> list[VelocityLog]:
    """Return the runs of a set."""
    rng = np.random.default_rng(SEEDS[name])
    return [SETS[name](rng) for _ in range(RUNS)]


def write(path: Path, logs: list[VelocityLog]) -> None:
    """Write runs that differ in observations and truth alone; the same runs give the same bytes."""
    arrays = {field.name: np.array(getattr(logs[0], field.name)) for field in fields(VelocityLog)}
    for name in ("zs", "truth"):
        arrays[name] = np.stack([getattr(log, name) for log in logs])
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)


def main(arguments: list[str]) -> None:
    """Record both sets into a folder."""
    folder = Path(arguments[0]) if arguments else FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    for name in SETS:
        path = folder / f"{name}.npz"
        write(path, record(name))
        print(f"{path.name}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main(sys.argv[1:])
