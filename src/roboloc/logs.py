"""Recorded runs: what a robot was told, what it saw, and where it really was.

Controls and scans come each at their own times, which are not those of the other. A control holds from its
time until the next control's; a filter that goes through a log moves by the control that holds, up to the time
of a scan, looks, and moves on. :meth:`Log.events` cuts the intervals.

The lines in the scans are there already (`z_raw`, `Q_raw`), as a separate program of a robot would supply
them; the scans are there for whoever wants to find the lines, or to look.

The package holds two runs, ``load("maze")`` and ``load("arena")``. They are simulated: the control that was
driven in an interval of length dt differs from the one in the log by noise of covariance dt R, the starting
pose from `x0` by noise of covariance `Sigma0`.

A log is a NumPy file, ``.npz``, of plain arrays.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from roboloc.validation import as_array, as_covariance, as_number

_DATA = resources.files("roboloc") / "data"
NAMES = ("arena", "maze")
"""The recorded runs of robots among walls."""


class Event(NamedTuple):
    """The end of an interval in which one control held, and perhaps a scan.

    Parameters
    ----------
    time : float
        When the interval ends [s].
    dt : float
        How long it was [s]; 0 only for a scan at the very start.
    u : (2,) ndarray
        Control V, omega that held in it [m/s, rad/s].
    scan : int or None
        Number of the scan taken at its end, if there was one.
    """

    time: float
    dt: float
    u: np.ndarray
    scan: int | None


@dataclass(frozen=True, eq=False, repr=False)
class Log:
    """A recorded run. The arrays are copies that cannot be written to.

    Parameters
    ----------
    control_times : (N,) array_like
        When each control began to hold [s], increasing; the first not after the first scan.
    controls : (N, 2) array_like
        Controls V, omega [m/s, rad/s].
    scan_times : (K,) array_like
        When each scan was taken [s], increasing.
    bearings : (B,) array_like
        Directions of the beams in the frame of the scanner [rad].
    scans : (K, B) array_like
        Ranges [m], NaN where nothing was seen.
    z_raw : sequence of K (2, I_k) array_like
        Lines alpha, r found in each scan, in the frame of the scanner [rad, m].
    Q_raw : sequence of K (I_k, 2, 2) array_like
        Their covariances.
    truth_times : (T,) array_like
        Times of the true poses [s], increasing.
    truth : (T, 3) array_like
        True poses [m, m, rad], the headings not wrapped.
    x0 : (3,) array_like
        Pose at the start as far as it is known [m, m, rad].
    Sigma0 : (3, 3) array_like
        Covariance of the error of `x0`.
    R : (2, 2) array_like
        Covariance of the control.
    tf_base_to_camera : (3,) array_like
        Pose of the scanner in the frame of the robot [m, m, rad].
    world : str
        Name of the world.

    Raises
    ------
    ValueError
        If an array has another shape, if something is not finite that has to be, if times do not increase, or
        if a scan comes before the first control.

    Examples
    --------
    The maze takes a robot about a minute and a half, at 30 controls and 6 scans a second.

    >>> log = load("maze")
    >>> seconds = log.scan_times[-1] - log.start_time
    >>> bool(60 < seconds < 120), round(len(log.controls) / seconds), round(len(log.scans) / seconds)
    (True, 30, 6)
    """

    control_times: np.ndarray
    controls: np.ndarray
    scan_times: np.ndarray
    bearings: np.ndarray
    scans: np.ndarray
    z_raw: tuple[np.ndarray, ...]
    Q_raw: tuple[np.ndarray, ...]
    truth_times: np.ndarray
    truth: np.ndarray
    x0: np.ndarray
    Sigma0: np.ndarray
    R: np.ndarray
    tf_base_to_camera: np.ndarray
    world: str

    def __post_init__(self) -> None:
        N, K = len(self.control_times), len(self.scan_times)
        shapes = {
            "control_times": (N,),
            "controls": (N, 2),
            "scan_times": (K,),
            "bearings": ("B",),
            "truth_times": ("T",),
            "truth": (len(self.truth_times), 3),
            "x0": (3,),
            "tf_base_to_camera": (3,),
        }
        for name, shape in shapes.items():
            self._set(name, as_array(name, getattr(self, name), shape))
        for name, size in (("Sigma0", 3), ("R", 2)):
            self._set(name, as_covariance(name, getattr(self, name), size))
        scans = np.asarray(self.scans, dtype=np.float64)
        as_array("scans", np.where(np.isnan(scans), 0.0, scans), (K, self.bearings.size))
        self._set("scans", scans)
        for name in ("z_raw", "Q_raw"):
            if len(getattr(self, name)) != K:
                raise ValueError(f"{name}: expected {K} entries, one a scan, got {len(getattr(self, name))}")
        z_raw = tuple(_frozen(as_array(f"z_raw[{k}]", z, (2, "I"))) for k, z in enumerate(self.z_raw))
        Q_raw = tuple(
            _frozen(as_array(f"Q_raw[{k}]", Q, (z.shape[1], 2, 2)))
            for k, (z, Q) in enumerate(zip(z_raw, self.Q_raw, strict=True))
        )
        object.__setattr__(self, "z_raw", z_raw)
        object.__setattr__(self, "Q_raw", Q_raw)
        for name in ("control_times", "scan_times", "truth_times"):
            steps = np.diff(getattr(self, name))
            if steps.size and steps.min() <= 0.0:
                raise ValueError(f"{name}: expected increasing times, got a step of {steps.min()}")
        if not N or (K and self.control_times[0] > self.scan_times[0]):
            got = self.control_times[0] if N else "no control"
            raise ValueError(f"control_times: expected a control by the first scan, got {got}")

    def _set(self, name: str, array: np.ndarray) -> None:
        object.__setattr__(self, name, _frozen(array))

    def __repr__(self) -> str:
        return f"<Log of {self.world}: {len(self.controls)} controls, {len(self.scans)} scans>"

    @property
    def start_time(self) -> float:
        """When the first control begins to hold [s]."""
        return float(self.control_times[0])

    def events(self) -> Iterator[Event]:
        """Yield controls and scans in the order of time.

        Yields
        ------
        Event
            One for each interval between two neighbouring times, of whichever kind. The last control holds
            until the last scan; one after the last scan only ends the interval before it.

        Examples
        --------
        Between two scans the robot of the maze is told something else about five times.

        >>> log = load("maze")
        >>> scans = [k for k, event in enumerate(log.events()) if event.scan is not None]
        >>> round(float(np.mean(np.diff(scans))) - 1)
        5
        """
        scan_at = {time: k for k, time in enumerate(self.scan_times.tolist())}
        times = np.unique(np.concatenate([self.control_times, self.scan_times])).tolist()
        if times[0] in scan_at:
            yield Event(times[0], 0.0, self.controls[0], scan_at[times[0]])
        holding = np.searchsorted(self.control_times, times, side="right") - 1
        for begin, end, k in zip(times, times[1:], holding.tolist(), strict=False):
            yield Event(end, end - begin, self.controls[k], scan_at.get(end))

    def truth_at(self, times: ArrayLike) -> np.ndarray:
        """Return the true pose at some times, between those recorded by linear interpolation.

        Parameters
        ----------
        times : (M,) array_like
            Times [s], within the recorded ones.

        Returns
        -------
        (M, 3) ndarray
            True poses [m, m, rad], the headings not wrapped.

        Raises
        ------
        ValueError
            If a time is outside the recorded ones.
        """
        times = as_array("times", times, ("M",))
        first, last = self.truth_times[[0, -1]]
        if times.size and not first <= times.min() <= times.max() <= last:
            raise ValueError(f"times: expected within {first} and {last}, got {times.min()} to {times.max()}")
        return np.stack([np.interp(times, self.truth_times, column) for column in self.truth.T], axis=1)

    def until(self, time: float) -> "Log":
        """Return the run up to a time: the controls and scans before it, and the truth as it is.

        Parameters
        ----------
        time : float
            Where to cut [s], after the first control.

        Returns
        -------
        Log
            The beginning of the run.

        Examples
        --------
        Ten seconds of the maze hold about sixty scans.

        >>> len(load("maze").until(10.0).scans)
        60
        """
        time = as_number("time", time)
        n, k = (int(np.searchsorted(times, time)) for times in (self.control_times, self.scan_times))
        names = ("scan_times", "scans", "z_raw", "Q_raw")
        kept = {name: getattr(self, name)[:k] for name in names}
        return self.changed(control_times=self.control_times[:n], controls=self.controls[:n], **kept)

    def changed(self, **arrays: Any) -> "Log":
        """Return the same run with some arrays replaced, to see what a filter makes of it.

        Parameters
        ----------
        **arrays
            New arrays by the names of their attributes.

        Returns
        -------
        Log
            The other run.

        Raises
        ------
        ValueError
            If an array has another shape or is not finite.

        Examples
        --------
        A robot whose wheels slip drives less far than its controls say.

        >>> log = load("maze")
        >>> slips = log.changed(controls=1.1 * log.controls)
        >>> bool(slips.controls[0, 0] > log.controls[0, 0])
        True
        """
        return replace(self, **arrays)

    def write(self, path: str | Path) -> None:
        """Write the log to a file, compressed; the same log gives the same bytes.

        Parameters
        ----------
        path : str or Path
            Where to; the name should end in ``.npz``.
        """
        arrays = {name: getattr(self, name) for name in _ARRAYS}
        arrays["world"] = np.array(self.world)
        arrays["lines"] = np.array([z.shape[1] for z in self.z_raw], dtype=np.int64)
        arrays["z_raw"] = np.concatenate([np.zeros((2, 0)), *self.z_raw], axis=1)
        arrays["Q_raw"] = np.concatenate([np.zeros((0, 2, 2)), *self.Q_raw])
        with Path(path).open("wb") as file:
            np.savez_compressed(file, **arrays)


_ARRAYS = (
    *("control_times", "controls", "scan_times", "bearings", "scans", "truth_times", "truth"),
    *("x0", "Sigma0", "R", "tf_base_to_camera"),
)


def read(path: str | Path) -> Log:
    """Read a log that `Log.write` wrote.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    Log
        The run.

    Raises
    ------
    ValueError
        If the file is no log.
    """
    with Path(path).open("rb") as file:
        try:
            with np.load(file, allow_pickle=False) as arrays:
                found = {name: arrays[name] for name in (*_ARRAYS, "world", "lines", "z_raw", "Q_raw")}
        except (KeyError, TypeError, AttributeError, ValueError) as error:
            raise ValueError(f"path: expected a log, got {Path(path).name}: {error}") from error
    ends = np.cumsum(found.pop("lines"))[:-1]
    found["world"] = str(found["world"])
    found["z_raw"] = tuple(np.split(found["z_raw"], ends, axis=1))
    found["Q_raw"] = tuple(np.split(found["Q_raw"], ends))
    return Log(**found)


def load(name: str) -> Log:
    """Return a recorded run that comes with the package.

    Parameters
    ----------
    name : str
        ``"maze"`` or ``"arena"``.

    Returns
    -------
    Log
        The run.

    Raises
    ------
    ValueError
        If there is no run of that name.
    """
    if name not in NAMES:
        raise ValueError(f"name: expected one of {', '.join(NAMES)}, got {name}")
    with resources.as_file(_DATA / f"{name}.npz") as path:
        return read(path)


def _frozen(array: np.ndarray) -> np.ndarray:
    array = array.copy()
    array.flags.writeable = False
    return array
