r"""Runs of a robot that is driven by velocities and sees known landmarks by bearing and range.

A run is what a filter is told, and the truth to judge it by. The control is u = (v, omega, gamma): the robot drives
with v and omega for a time dt and turns by gamma dt in the end. What it really does differs from u by noise of the
covariance M, drawn anew in every step, where M depends on u and on the six numbers `alphas`; each bearing and range
differs by noise of covariance `Q`; the start differs from `x0` by a draw of covariance `Sigma0`. Which landmarks are
seen depends on the step alone, so what is not seen says nothing.

The package holds two sets of runs, each of twenty drives with the same controls and other noise:

* ``load("eight")``: a figure of eight among six landmarks, two of them in sight after every step.
* ``load("unsure")``: the robot starts with a heading that is known to half a radian only, and sees nothing for its
  first four seconds.

One run shows what a filter does; twenty show whether it is honest. A set is a NumPy file, ``.npz``, of plain arrays.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from importlib import resources
from pathlib import Path
from typing import NamedTuple

import numpy as np

from roboloc.validation import as_array, as_covariance, as_number

_DATA = resources.files("roboloc") / "data"
NAMES = ("eight", "unsure")
"""What `load` knows."""


class Step(NamedTuple):
    """One step of a run.

    Parameters
    ----------
    u : (3,) ndarray
        Control v, omega, gamma that was asked for [m/s, rad/s, rad/s].
    z : (2k,) ndarray
        What was seen after it: bearing, range, bearing, range, ... [rad, m]; k may be 0.
    landmarks : (k, 2) ndarray
        Positions of the landmarks that were seen [m].
    truth : (3,) ndarray
        True pose after it, for judging only [m, m, rad].
    """

    u: np.ndarray
    z: np.ndarray
    landmarks: np.ndarray
    truth: np.ndarray


@dataclass(frozen=True, eq=False, repr=False)
class VelocityLog:
    """A run. The arrays are copies that cannot be written to.

    Parameters
    ----------
    dt : float
        Length of a step [s].
    us : (N, 3) array_like
        Controls v, omega, gamma that were asked for [m/s, rad/s, rad/s].
    alphas : (6,) array_like
        Noise of the controls: shares of v**2 and omega**2 in the variances of v, of omega and of gamma.
    landmarks : (L, 2) array_like
        The map [m].
    seen : (N, k) array_like of int
        Which landmarks were seen after each step; -1 where one less was.
    zs : (N, 2k) array_like
        How: bearing, range, bearing, range, ... [rad, m]; anything where `seen` is -1.
    Q : (2, 2) array_like
        Covariance of one bearing and range.
    x0 : (3,) array_like
        Pose at the start as far as it is known [m, m, rad].
    Sigma0 : (3, 3) array_like
        Covariance of its error.
    truth : (N + 1, 3) array_like
        True poses, the first at the start [m, m, rad]; the headings are not wrapped.

    Raises
    ------
    ValueError
        If an array has another shape or is not finite, or if a landmark is seen that there is not.

    Examples
    --------
    Half a minute around a figure of eight, four steps a second.

    >>> log = load("eight")[0]
    >>> log
    <VelocityLog: 126 steps of 0.25 s, 6 landmarks>
    >>> log.us[0].tolist(), log.seen[0].tolist()
    ([1.0, 0.4, 0.0], [0, 3])
    """

    dt: float
    us: np.ndarray
    alphas: np.ndarray
    landmarks: np.ndarray
    seen: np.ndarray
    zs: np.ndarray
    Q: np.ndarray
    x0: np.ndarray
    Sigma0: np.ndarray
    truth: np.ndarray

    def __post_init__(self) -> None:
        us = as_array("us", self.us, ("N", 3))
        landmarks = as_array("landmarks", self.landmarks, ("L", 2))
        seen = as_array("seen", self.seen, (len(us), "k"))
        if seen.size and not (
            np.all(seen == np.rint(seen)) and -1 <= seen.min() <= seen.max() < len(landmarks)
        ):
            raise ValueError(f"seen: expected whole numbers from -1 to {len(landmarks) - 1}, got {seen}")
        arrays = {
            "us": us,
            "alphas": as_array("alphas", self.alphas, (6,)),
            "landmarks": landmarks,
            "seen": seen.astype(np.int64),
            "zs": as_array("zs", self.zs, (len(us), 2 * seen.shape[1])),
            "Q": as_covariance("Q", self.Q, 2),
            "x0": as_array("x0", self.x0, (3,)),
            "Sigma0": as_covariance("Sigma0", self.Sigma0, 3),
            "truth": as_array("truth", self.truth, (len(us) + 1, 3)),
        }
        object.__setattr__(self, "dt", as_number("dt", self.dt))
        for name, array in arrays.items():
            kept = array.copy()
            kept.flags.writeable = False
            object.__setattr__(self, name, kept)

    def __repr__(self) -> str:
        return f"<VelocityLog: {len(self.us)} steps of {self.dt} s, {len(self.landmarks)} landmarks>"

    def steps(self) -> Iterator[Step]:
        """Yield the steps in their order.

        Yields
        ------
        Step
            Control, observations, the landmarks they are of, and the true pose after it.

        Examples
        --------
        A robot unsure of its heading drives for four seconds before it sees a landmark.

        >>> log = load("unsure")[0]
        >>> blind = [len(step.landmarks) for step in log.steps()].index(2)
        >>> blind * log.dt
        4.0
        """
        for u, which, z, truth in zip(self.us, self.seen, self.zs, self.truth[1:], strict=True):
            there = which >= 0
            yield Step(u, z[np.repeat(there, 2)], self.landmarks[which[there]], truth)


_FIELDS = tuple(field.name for field in fields(VelocityLog))
_DRAWN = ("zs", "truth")


def read(path: str | Path) -> tuple[VelocityLog, ...]:
    """Read a set of runs.

    The arrays of the file have the names of :class:`VelocityLog`; `zs` and `truth` have the runs in front.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    tuple of VelocityLog
        The runs.

    Raises
    ------
    ValueError
        If the file holds no such runs.
    """
    with Path(path).open("rb") as file:
        try:
            with np.load(file, allow_pickle=False) as arrays:
                found = {name: arrays[name] for name in _FIELDS}
        except (KeyError, TypeError, AttributeError, ValueError) as error:
            raise ValueError(f"path: expected runs, got {Path(path).name}: {error}") from error
    drawn = zip(*(found.pop(name) for name in _DRAWN), strict=True)
    return tuple(VelocityLog(**found, zs=zs, truth=truth) for zs, truth in drawn)


def load(name: str) -> tuple[VelocityLog, ...]:
    """Return the runs of a set that comes with the package.

    Parameters
    ----------
    name : str
        ``"eight"`` or ``"unsure"``.

    Returns
    -------
    tuple of VelocityLog
        Twenty runs with the same controls.

    Raises
    ------
    ValueError
        If there is no such set.

    Examples
    --------
    Told to come back to where it began, no robot does.

    >>> logs = load("eight")
    >>> off = [float(np.hypot(*(log.truth[-1] - log.truth[0])[:2])) for log in logs]
    >>> len(logs), min(off) > 0.1
    (20, True)
    """
    if name not in NAMES:
        raise ValueError(f"name: expected one of {', '.join(NAMES)}, got {name!r}")
    with resources.as_file(_DATA / f"{name}.npz") as path:
        return read(path)
