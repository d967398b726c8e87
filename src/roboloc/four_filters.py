r"""What four filters made of the recorded drives: estimates, and what each claims of them.

The extended, the unscented, the particle and the right-invariant Kalman filter went through the runs of
:mod:`roboloc.velocity_logs`; they are those of the reference, so that whoever compares them needs none of their own. A
covariance is that of the numbers x, y, theta. The invariant filter states another one, about the matrix of the pose;
its claim is brought to these numbers by a derivative, and `nees` is judged in the coordinates of the filter's own.
"""

from dataclasses import dataclass
from importlib import resources

import numpy as np

_DATA = resources.files("roboloc") / "data"
FILTERS = ("EKF", "UKF", "PF", "InEKF")
"""The filters, in their order."""
SETS = ("eight", "unsure")
"""What `load` knows."""


@dataclass(frozen=True, eq=False, repr=False)
class Estimates:
    """What a filter made of the R runs of a set, at N instants. The arrays cannot be written to.

    Parameters
    ----------
    name : str
        The filter.
    times : (N,) ndarray
        Instants [s].
    poses : (R, N, 3) ndarray
        Means [m, m, rad]; the headings may be in any turn.
    covs : (R, N, 3, 3) ndarray
        Covariances of the pose.
    nees : (R, N) ndarray
        Normalized squared errors, in the coordinates of the filter's own.
    truth : (R, N, 3) ndarray
        True poses [m, m, rad], in any turn.
    """

    name: str
    times: np.ndarray
    poses: np.ndarray
    covs: np.ndarray
    nees: np.ndarray
    truth: np.ndarray

    def __post_init__(self) -> None:
        for name in ("times", "poses", "covs", "nees", "truth"):
            getattr(self, name).flags.writeable = False

    def __repr__(self) -> str:
        runs, instants = self.nees.shape
        return f"<Estimates of {self.name}: {runs} runs, {instants} instants>"


def load(name: str) -> dict[str, Estimates]:
    """Return what the filters made of a set of runs.

    Parameters
    ----------
    name : str
        ``"eight"`` or ``"unsure"``, as in :func:`roboloc.velocity_logs.load`.

    Returns
    -------
    dict of str to Estimates
        By filter.

    Raises
    ------
    ValueError
        If there is no such set.

    Examples
    --------
    >>> found = load("unsure")
    >>> found["PF"]
    <Estimates of PF: 20 runs, 48 instants>
    >>> list(found)
    ['EKF', 'UKF', 'PF', 'InEKF']
    """
    from roboloc import velocity_logs  # noqa: PLC0415  (the truth is there)

    if name not in SETS:
        raise ValueError(f"name: expected one of {', '.join(SETS)}, got {name!r}")
    with resources.as_file(_DATA / "four-filters.npz") as path, np.load(path, allow_pickle=False) as arrays:
        times, poses, upper, nees = (
            arrays[f"{name}_{part}"].astype(float) for part in ("times", "poses", "covs", "nees")
        )
    covs = np.empty((*upper.shape[:-1], 3, 3))
    i, j = np.triu_indices(3)
    covs[..., i, j] = covs[..., j, i] = upper
    logs = velocity_logs.load(name)
    steps = np.rint(times / logs[0].dt).astype(int)
    truth = np.stack([log.truth[steps] for log in logs])
    return {
        key: Estimates(key, times.copy(), poses[k], covs[k], nees[k], truth.copy())
        for k, key in enumerate(FILTERS)
    }
