"""A filter taken through a recorded run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from roboloc import metrics
from roboloc.filters.ekf import Ekf

if TYPE_CHECKING:
    from roboloc.filters.localization import EkfLocalization
    from roboloc.filters.monte_carlo import MonteCarloLocalization
    from roboloc.filters.slam import EkfSlam
    from roboloc.logs import Log


@dataclass(frozen=True, eq=False)
class Run:
    """What a filter believed, and what surprised it.

    Parameters
    ----------
    times : (T,) ndarray
        The start, then the end of each interval between events [s].
    xs : (T, n) ndarray
        Means at these times, after a correction where there was one; n is the largest number of entries that the
        state had, and what is beyond those that it had at the time is NaN.
    Sigmas : (T, n, n) ndarray
        Covariances, likewise.
    scans : (K,) ndarray of int
        Where in `times` each scan is.
    observed : (K,) ndarray of int
        Number of lines in each scan.
    associated : (K,) ndarray of int
        Number of them that matched a line of the map; 0 for a cloud of particles, which has no gate and no one
        innovation.
    v : tuple of K (2k,) ndarray
        Stacked innovation of each scan, k being the number that matched.
    S : tuple of K (2k, 2k) ndarray
        Its covariance before the correction.
    """

    times: np.ndarray
    xs: np.ndarray
    Sigmas: np.ndarray
    scans: np.ndarray
    observed: np.ndarray
    associated: np.ndarray
    v: tuple[np.ndarray, ...]
    S: tuple[np.ndarray, ...]

    @property
    def nis(self) -> np.ndarray:
        """Normalized innovation squared of each scan, (K,); 0 where nothing matched."""
        return np.array([metrics.nis(v, S) for v, S in zip(self.v, self.S, strict=True)])


def run(ekf: EkfLocalization | EkfSlam | MonteCarloLocalization, log: Log, *, correct: bool = True) -> Run:
    """Take a filter through a recorded run, controls and scans in the order of time.

    A control holds until the next one; the interval in which it holds is cut where a scan was taken.

    Parameters
    ----------
    ekf : EkfLocalization, EkfSlam or MonteCarloLocalization
        The filter, at its start; it is moved along and ends where the run does.
    log : roboloc.logs.Log
        The run.
    correct : bool
        Whether to use the scans; without, the filter only predicts, and any `Ekf` or `ParticleFilter` will do.

    Returns
    -------
    Run
        The beliefs at all times, and the innovation of each scan.

    Raises
    ------
    MissingStageError
        If a stage is not supplied or not written yet.
    ValueError
        If a stage returns something unusable.
    """
    times, xs, Sigmas = [log.start_time], [ekf.x], [ekf.Sigma]
    scans, vs, Ss = [], [], []
    for event in log.events():
        if event.dt > 0.0:
            ekf.transition_update(event.u, event.dt)
        if event.scan is not None:
            z, Q, H = np.zeros(0), np.zeros((0, 0)), np.zeros((0, ekf.x.size))
            observed = log.z_raw[event.scan], log.Q_raw[event.scan]
            if correct and isinstance(ekf, Ekf):
                z, Q, H = ekf.measurement_model(*observed)
            scans.append(len(times))
            vs.append(z)
            Ss.append(H @ ekf.Sigma @ H.T + Q)
            if correct:
                ekf.measurement_update(*observed)
        times.append(event.time)
        xs.append(ekf.x)
        Sigmas.append(ekf.Sigma)
    return Run(
        times=np.array(times),
        xs=_padded(xs),
        Sigmas=_padded(Sigmas),
        scans=np.array(scans, dtype=int),
        observed=np.array([z.shape[1] for z in log.z_raw], dtype=int),
        associated=np.array([len(v) // 2 for v in vs], dtype=int),
        v=tuple(vs),
        S=tuple(Ss),
    )


def _padded(arrays: list[np.ndarray]) -> np.ndarray:
    """Return arrays of the same number of axes as one, NaN where an array has no entry."""
    largest = np.max([array.shape for array in arrays], axis=0)
    padded = np.full((len(arrays), *largest), np.nan)
    for row, array in zip(padded, arrays, strict=True):
        row[tuple(map(slice, array.shape))] = array
    return padded
