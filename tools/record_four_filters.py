"""Record what four filters make of the recorded runs: src/roboloc/data/four-filters.npz.

The filters are stages that students write, so students get their estimates and not the filters. For each set of
runs of `roboloc.velocity_logs` and each filter: the mean and the covariance of the pose at some instants of every run,
and the normalized squared error in the coordinates in which the filter states its covariance. The covariance of the
invariant filter is brought to numbers of the pose by its derivative, which is right for small errors alone.

The same numbers come out on every machine, to rounding; a test records again and compares.

Usage: python tools/record_four_filters.py [FOLDER]
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from roboloc.angles import wrap
from roboloc.velocity_logs import NAMES, VelocityLog, load
from roboloc_reference import contenders

ROOT = Path(__file__).resolve().parents[1]
FILE = "four-filters.npz"
FOLDER = ROOT / "src" / "roboloc" / "data"
COUNT = 500
RUNS = 20
EVERY = {"eight": 3, "unsure": 1}
FILTERS: dict[str, Callable[[VelocityLog, int], contenders.Filter]] = {
    "EKF": lambda log, _: contenders.Extended(log),
    "UKF": lambda log, _: contenders.Unscented(log),
    "PF": lambda log, run: contenders.Particles(log, np.random.default_rng([run, 530]), COUNT),
    "InEKF": lambda log, _: contenders.Invariant(log),
}


def covariance(estimator: contenders.Filter) -> np.ndarray:
    """Return the covariance (3, 3) that a filter claims for the numbers of the pose."""
    if isinstance(estimator, contenders.Particles):
        away = estimator.xs - estimator.pose()
        away[:, 2] = wrap(away[:, 2])
        return away.T * estimator.ws @ away
    if isinstance(estimator, contenders.Invariant):
        x, y, _ = estimator.pose()
        back = np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])
        return back @ estimator.P @ back.T
    return estimator.Sigma


def follow(log: VelocityLog, estimator: contenders.Filter, every: int) -> tuple[np.ndarray, ...]:
    """Take a filter through a run; return poses, covariances and squared errors."""
    poses, covs, squares = [], [], []
    for k, step in enumerate(log.steps(), start=1):
        estimator.predict(step.u)
        if len(step.landmarks):
            estimator.correct(step.z, step.landmarks)
        if k % every == 0:
            poses.append(estimator.pose())
            covs.append(covariance(estimator))
            squares.append(estimator.nees(step.truth))
    return tuple(np.array(part) for part in (poses, covs, squares))


def record(name: str) -> dict[str, np.ndarray]:
    """Return the arrays of a set of runs: filters, runs and instants in front."""
    logs, every = load(name)[:RUNS], EVERY[name]
    tracks = [[follow(log, make(log, i), every) for i, log in enumerate(logs)] for make in FILTERS.values()]
    poses, covs, squares = (np.array([[track[part] for track in row] for row in tracks]) for part in range(3))
    upper = covs[..., *np.triu_indices(3)]
    return {
        f"{name}_times": logs[0].dt * every * np.arange(1, poses.shape[2] + 1),
        f"{name}_poses": poses.astype(np.float32),
        f"{name}_covs": upper.astype(np.float32),
        f"{name}_nees": squares.astype(np.float32),
    }


def main(arguments: list[str]) -> None:
    """Record all sets into a folder."""
    folder = Path(arguments[0]) if arguments else FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    arrays = {key: array for name in NAMES for key, array in record(name).items()}
    with (folder / FILE).open("wb") as file:
        np.savez_compressed(file, **arrays)
    print(f"{FILE}: {(folder / FILE).stat().st_size} bytes")


if __name__ == "__main__":
    main(sys.argv[1:])
