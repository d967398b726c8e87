r"""Logs of a robot among landmarks: what it saw, then what it was told, in turn.

The log is a text file of the format of CMU 16-833. Its rows hold numbers with tabs between them: first what is seen
from the start, bearing and range of each landmark, ``beta1 r1 ... beta6 r6`` [rad, m]; then a control ``d alpha``, the
way ahead and the turn after it [m, rad]; then what is seen after that; and so on. How many landmarks there are is for
the first row to say, and every row of observations has all of them, in the same order. Blanks do for tabs, a tab at
the end of a row does no harm, empty rows are passed over, and the last control may be one that nothing is seen after.

A log says nothing of the truth. For a simulated run it stands in another file of the same kind: the landmarks in the
first row, ``x1 y1 ... x6 y6`` [m], then the pose ``x y theta`` at each observation [m, m, rad].

The package holds one run and its truth: a robot is told to drive twice around an oval, with six landmarks in sight. It
was drawn with the noise that `START_COV`, `CONTROL_COV` and `OBSERVATION_COV` say.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from importlib import resources
from math import isfinite
from pathlib import Path

import numpy as np

from roboloc.validation import as_array

_DATA = resources.files("roboloc") / "data"


def _constant(values: list[float]) -> np.ndarray:
    """Return the covariance with these standard deviations, for reading only."""
    return _frozen(np.diag(values) ** 2)


def _frozen(array: np.ndarray) -> np.ndarray:
    array = array.copy()
    array.flags.writeable = False
    return array


START = _frozen(np.zeros(3))
"""Where the robot of the run in the package believes to start [m, m, rad]."""

START_COV = _constant([0.02, 0.02, 0.05])
"""Covariance of the pose at the start: 2 cm each way, and 0.05 rad."""

CONTROL_COV = _constant([0.1, 0.05, 0.03])
"""Covariance of the error of a step in the frame of the robot: 10 cm along, 5 cm across, 0.03 rad."""

OBSERVATION_COV = _constant([0.01, 0.05])
"""Covariance of one bearing and range: 0.01 rad and 5 cm."""


@dataclass(frozen=True, eq=False, repr=False)
class LandmarkLog:
    """A run among landmarks. The arrays are copies that cannot be written to.

    Parameters
    ----------
    observations : (T + 1, 2k) array_like
        Bearing and range of each of k landmarks, at the start and after each control [rad, m, rad, m, ...]; there
        may be one row less, if nothing was seen after the last control.
    controls : (T, 2) array_like
        Way ahead d and turn alpha [m, rad].

    Raises
    ------
    ValueError
        If an array has another shape or is not finite, if there is no landmark, or if a range is negative.

    Examples
    --------
    In the run of the package a robot makes 36 steps and sees six landmarks 37 times.

    >>> log = load()
    >>> log.observations.shape, log.controls.shape
    ((37, 12), (36, 2))
    """

    observations: np.ndarray
    controls: np.ndarray

    def __post_init__(self) -> None:
        observations = as_array("observations", self.observations, ("T + 1", "2k"))
        controls = as_array("controls", self.controls, ("T", 2))
        rows, size = observations.shape
        if not size or size % 2:
            raise ValueError(
                f"observations: expected shape (T + 1, 2k) with k > 0, got shape ({rows}, {size})"
            )
        if not rows:
            raise ValueError("observations: expected a first row, got none")
        if not rows - 1 <= len(controls) <= rows:
            expected = f"{rows - 1} or {rows}, one before each further observation and perhaps one more"
            raise ValueError(f"controls: expected {expected}, got {len(controls)}")
        if (observations[:, 1::2] < 0.0).any():
            raise ValueError(f"observations: expected no negative range, got {observations[:, 1::2].min()}")
        object.__setattr__(self, "observations", _frozen(observations))
        object.__setattr__(self, "controls", _frozen(controls))

    def __repr__(self) -> str:
        landmarks = self.observations.shape[1] // 2
        return f"<LandmarkLog: {landmarks} landmarks, {len(self.controls)} controls>"

    def write(self, path: str | Path) -> None:
        """Write the log to a text file, six digits after the point.

        Parameters
        ----------
        path : str or Path
            Where to.
        """
        rows = [self.observations[0]]
        for k, control in enumerate(self.controls):
            rows += [control, *self.observations[k + 1 : k + 2]]
        _write(path, rows)


@dataclass(frozen=True, eq=False)
class Truth:
    """What a simulated run was really like. The arrays are copies that cannot be written to.

    Parameters
    ----------
    landmarks : (2k,) array_like
        Places of the landmarks, in the order of the log [m].
    poses : (T + 1, 3) array_like
        Pose of the robot at each observation, the heading not wrapped [m, m, rad].

    Raises
    ------
    ValueError
        If an array has another shape or is not finite.
    """

    landmarks: np.ndarray
    poses: np.ndarray

    def __post_init__(self) -> None:
        landmarks = as_array("landmarks", self.landmarks, ("2k",))
        if landmarks.size % 2:
            raise ValueError(f"landmarks: expected shape (2k,), got shape ({landmarks.size},)")
        object.__setattr__(self, "landmarks", _frozen(landmarks))
        object.__setattr__(self, "poses", _frozen(as_array("poses", self.poses, ("T + 1", 3))))

    def write(self, path: str | Path) -> None:
        """Write the truth to a text file, six digits after the point.

        Parameters
        ----------
        path : str or Path
            Where to.
        """
        _write(path, [self.landmarks, *self.poses])


def read(path: str | Path) -> LandmarkLog:
    r"""Read a log.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    LandmarkLog
        The run.

    Raises
    ------
    ValueError
        If the file is no such log; the message names the line.

    Examples
    --------
    A robot sees a landmark 2 m ahead, drives 1 m towards it, and sees it 1 m ahead.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "log.txt"
    ...     _ = path.write_text("0\t2\n1\t0\n0\t1\n")
    ...     log = read(path)
    >>> log.observations.tolist(), log.controls.tolist()
    ([[0.0, 2.0], [0.0, 1.0]], [[1.0, 0.0]])
    """
    where, rows = Path(path).name, _rows(path)
    if not rows:
        raise ValueError(f"path: expected observations in the first row of {where}, got an empty file")
    size = len(rows[0][1])
    for row, (line, numbers) in enumerate(rows):
        what, expected = ("a control", 2) if row % 2 else ("observations", size)
        if len(numbers) != expected or len(numbers) % 2:
            wanted = f"{expected} numbers" if row else "pairs of bearing and range"
            raise ValueError(
                f"path: expected {what} of {wanted} in line {line} of {where}, got {len(numbers)}"
            )
        if not row % 2 and min(numbers[1::2]) < 0.0:
            raise ValueError(
                f"path: expected no negative range in line {line} of {where}, got {min(numbers[1::2])}"
            )
    observations, controls = ([numbers for _, numbers in rows[first::2]] for first in (0, 1))
    return LandmarkLog(np.array(observations), np.array(controls).reshape(-1, 2))


def read_truth(path: str | Path) -> Truth:
    """Read the truth of a simulated run.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    Truth
        Landmarks and poses.

    Raises
    ------
    ValueError
        If the file holds no such truth; the message names the line.
    """
    where, rows = Path(path).name, _rows(path)
    for row, (line, numbers) in enumerate(rows):
        if len(numbers) % 2 if not row else len(numbers) != 3:
            wanted = "a pose of 3 numbers" if row else "landmarks of pairs x and y"
            raise ValueError(f"path: expected {wanted} in line {line} of {where}, got {len(numbers)}")
    if not rows:
        raise ValueError(f"path: expected landmarks in the first row of {where}, got an empty file")
    return Truth(np.array(rows[0][1]), np.array([numbers for _, numbers in rows[1:]]).reshape(-1, 3))


def load() -> LandmarkLog:
    """Return the run that comes with the package.

    Returns
    -------
    LandmarkLog
        A robot told to drive twice around an oval, with six landmarks in sight.
    """
    with resources.as_file(_DATA / "landmarks.txt") as path:
        return read(path)


def load_truth() -> Truth:
    """Return the truth of the run that comes with the package.

    Returns
    -------
    Truth
        Landmarks and poses.

    Examples
    --------
    Told to end where it began, the robot ends almost 2 m away.

    >>> start, end = load_truth().poses[[0, -1], :2]
    >>> round(float(np.hypot(*(end - start))), 1)
    1.9
    """
    with resources.as_file(_DATA / "landmarks-truth.txt") as path:
        return read_truth(path)


def _rows(path: str | Path) -> list[tuple[int, list[float]]]:
    """Return the rows of a text file that are not empty, with the numbers of their lines."""
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise ValueError(f"path: expected a text file, got {path.name}, which is none") from error
    rows = []
    for number, line in enumerate(lines, start=1):
        fields = line.split()
        for field in fields:
            if not _is_number(field):
                raise ValueError(
                    f"path: expected finite numbers in line {number} of {path.name}, got {field!r}"
                )
        if fields:
            rows.append((number, [float(field) for field in fields]))
    return rows


def _is_number(field: str) -> bool:
    try:
        return isfinite(float(field))
    except ValueError:
        return False


def _write(path: str | Path, rows: Iterable[np.ndarray]) -> None:
    text = "".join("\t".join(f"{number:.6f}" for number in row) + "\n" for row in rows)
    Path(path).write_text(text, encoding="utf-8", newline="\n")
