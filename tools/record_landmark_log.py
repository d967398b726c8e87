"""Record the run among landmarks of the student's package: src/roboloc/data/landmarks.txt, and its truth beside it.

The robot is told to drive twice around an oval: four steps straight, five in a half circle to the left, and the same
again. Each step it takes is off by an error along, across and in heading, each bearing and range that it sees by
another, drawn with the covariances of `roboloc.landmark_logs`, and so is the place where it starts.

The same numbers come out on every machine, to rounding; a test records again and compares.

Usage: python tools/record_landmark_log.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

from roboloc import se2
from roboloc.angles import wrap
from roboloc.landmark_logs import CONTROL_COV, OBSERVATION_COV, START, START_COV, LandmarkLog, Truth

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "src" / "roboloc" / "data"

SEED = 1
LANDMARKS = np.array([[2.5, -3.0], [7.5, -1.0], [7.0, 4.5], [2.5, 5.5], [-3.0, 4.0], [-2.5, -2.0]])
STRAIGHT, CURVE = (1.0, 0.0), (0.8, np.pi / 5)
CONTROLS = np.array([*[STRAIGHT] * 4, *[CURVE] * 5] * 4)


def look(x: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Return bearing and range of each landmark as seen from a pose, with errors (k, 2)."""
    delta = LANDMARKS - x[:2]
    z = np.stack([np.arctan2(delta[:, 1], delta[:, 0]) - x[2], np.hypot(delta[:, 0], delta[:, 1])], axis=-1)
    z += errors
    z[:, 0] = wrap(z[:, 0])
    return z.ravel()


def record(noise: float = 1.0) -> tuple[LandmarkLog, Truth]:
    """Drive, look, and return log and truth; with `noise` 0 the robot does and sees exactly what it should."""
    rng = np.random.default_rng(SEED)
    std0, std_u, std_z = (noise * np.sqrt(np.diag(cov)) for cov in (START_COV, CONTROL_COV, OBSERVATION_COV))
    x = START + std0 * rng.standard_normal(3)
    poses, observations = [x], [look(x, std_z * rng.standard_normal(LANDMARKS.shape))]
    for d, alpha in CONTROLS:
        x = se2.compose(x, [d, 0.0, alpha] + std_u * rng.standard_normal(3))
        poses.append(x)
        observations.append(look(x, std_z * rng.standard_normal(LANDMARKS.shape)))
    return LandmarkLog(np.array(observations), CONTROLS), Truth(LANDMARKS.ravel(), np.array(poses))


def main(arguments: list[str]) -> None:
    """Record the run into a folder."""
    folder = Path(arguments[0]) if arguments else FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    for name, part in zip(("landmarks.txt", "landmarks-truth.txt"), record(), strict=True):
        path = folder / name
        part.write(path)
        print(f"{path.name}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main(sys.argv[1:])
