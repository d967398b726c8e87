r"""Lines in a range scan: split and merge to find them all, then fit each.

A scan is a list of beams, bearing theta and range rho, in the order in which they were taken. A line is alpha, r:
the points with x cos(alpha) + y sin(alpha) = r; how it is fitted is the matter of :mod:`roboloc_reference.line_fit`.

Runs of beams are half-open ranges [first, last + 1). `split` cuts a scan where neighbours are too far apart, and
then every run that is no line where two lines fit it best. `merge` joins neighbours that are one line after all.
`extract_lines` does both to the beams that saw something, drops what is too short, and moves each corner to where
its two lines agree best; then it looks again for what can be merged, or shared by two neighbours. Two walls on one
line with a gap between them stay two.

A full turn has no first beam. Where the last beam and the first are neighbours, a wall that lies across the two is
found as one, and its range goes on behind the last beam: [350, 365) of 360 beams ends with beam 4.

Source: Stanford AA274A, problem set 3, line extraction. Derived in the book, *Fitting lines to a scan*.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import TURN
from roboloc.validation import as_array, as_number
from roboloc_reference.line_fit import as_beams, fit_line, fit_runs
from roboloc_reference.scan_points import ScanPoints

__all__ = ["Params", "extract_lines", "fit_line", "merge", "split"]


@dataclass(frozen=True)
class Params:
    """What counts as a line; a mapping with the same names serves as well.

    Parameters
    ----------
    min_segment_length : float
        A shorter segment is dropped [m].
    line_point_distance : float
        How far a point may lie from the line of its run [m]; four or five standard deviations of a beam.
    max_point_gap : float
        Neighbours farther apart belong to different segments [m].
    min_points : int
        A segment with fewer points is dropped; at least 2.

    Raises
    ------
    ValueError
        If a number is negative or not finite, or if `min_points` is below 2.
    """

    min_segment_length: float
    line_point_distance: float
    max_point_gap: float
    min_points: int

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            as_number(name, value, minimum=2.0 if name == "min_points" else 0.0)


def split(theta: ArrayLike, rho: ArrayLike, params: Params | Mapping[str, float]) -> np.ndarray:
    """Cut a scan into runs of neighbours that lie on one line each.

    Parameters
    ----------
    theta, rho : (N,) array_like
        Bearings [rad] and ranges [m] of the beams that saw something, in order.
    params : Params or mapping
        Only `max_point_gap` and `line_point_distance` are used.

    Returns
    -------
    (S, 2) ndarray of int
        First beam and last beam + 1 of each run. The runs cover all beams in order; no run has a gap, and no
        point is farther than `line_point_distance` from the line fitted to its run.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if `params` is incomplete.

    Examples
    --------
    A corner: the wall 1 m ahead up to 45 degrees, then the wall 1 m to the left.

    >>> theta = np.radians([0, 15, 30, 44, 46, 60, 75, 90])
    >>> rho = 1.0 / np.maximum(np.cos(theta), np.sin(theta))
    >>> params = Params(0.3, 0.02, 0.5, 3)
    >>> split(theta, rho, params).tolist()
    [[0, 4], [4, 8]]
    """
    runs = _points(*as_beams(theta, rho), _params(params)).split()
    return np.array(runs, dtype=int).reshape(-1, 2)


def merge(
    theta: ArrayLike, rho: ArrayLike, ranges: ArrayLike, params: Params | Mapping[str, float]
) -> np.ndarray:
    """Join runs that touch and together are one line, the best pair first.

    Parameters
    ----------
    theta, rho : (N,) array_like
        Bearings [rad] and ranges [m] of the beams that saw something, in order.
    ranges : (S, 2) array_like
        First beam and last beam + 1 of each run, in order, as of `split`.
    params : Params or mapping
        Only `max_point_gap` and `line_point_distance` are used.

    Returns
    -------
    (M, 2) ndarray of int
        The runs that are left, in order; no two that touch fit one line.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if the ranges are empty, overlap or leave the scan,
        or if `params` is incomplete.

    Examples
    --------
    A wall 1 m ahead that was cut in the middle is one wall.

    >>> theta = np.radians([-40.0, -20.0, 0.0, 20.0, 40.0])
    >>> merge(theta, 1.0 / np.cos(theta), [[0, 2], [2, 5]], Params(0.3, 0.02, 0.5, 3)).tolist()
    [[0, 5]]
    """
    scan = _points(*as_beams(theta, rho), _params(params))
    runs = scan.merge(_ranges(ranges, scan.size))
    return np.array(runs, dtype=int).reshape(-1, 2)


def extract_lines(
    theta: ArrayLike,
    rho: ArrayLike,
    params: Params | Mapping[str, float],
    var_theta: float,
    var_rho: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Find the lines in a scan, with their covariances.

    Parameters
    ----------
    theta : (N,) array_like
        Bearings [rad], in order.
    rho : (N,) array_like
        Ranges [m]; NaN where nothing was seen.
    params : Params or mapping
        What counts as a line: `min_segment_length`, `line_point_distance`, `max_point_gap`, `min_points`.
    var_theta, var_rho : float
        Variance of a bearing [rad^2] and of a range [m^2].

    Returns
    -------
    alpha, r : (I,) ndarray
        The lines in the frame of the scanner, as of `fit_line` [rad, m].
    C : (I, 2, 2) ndarray
        Covariance of each.
    segments : (I, 4) ndarray
        Where each begins and ends, x1, y1, x2, y2: its first and last point, projected on the line [m].
    ranges : (I, 2) ndarray of int
        First beam and last beam + 1 of each, in ascending order, counted in the arguments; beams in between may
        have seen nothing. Of a full turn an end may be above N: beam N + i is beam i.

    Raises
    ------
    ValueError
        If an argument has another shape, if a bearing is not finite, if a range is infinite, or if
        `params` is incomplete.

    Notes
    -----
    Source: Stanford AA274A, problem set 3, line extraction.

    Examples
    --------
    In the corner of a room the walls are 2 m ahead to the right and 1 m to the left, though one beam was lost.

    >>> theta = np.linspace(-1.0, 2.0, 151)
    >>> rho = 1.0 / np.maximum(np.cos(theta + np.pi / 6) / 2.0, np.sin(theta + np.pi / 6))
    >>> rho[20] = np.nan
    >>> alpha, r, C, segments, ranges = extract_lines(theta, rho, Params(0.3, 0.02, 0.5, 3), 0.0, 0.01**2)
    >>> np.degrees(alpha).round(9).tolist(), r.round(9).tolist()
    ([-30.0, 60.0], [2.0, 1.0])

    A scanner that looks all around in steps of a degree has a wall 1 m behind it, 2 m wide: half of it is seen by the
    last beams and half by the first.

    >>> theta = np.radians(np.arange(-180.0, 180.0))
    >>> rho = np.where(np.abs(theta) > np.radians(134.5), -1.0 / np.cos(theta), np.nan)
    >>> *_, segments, ranges = extract_lines(theta, rho, Params(0.3, 0.02, 0.5, 3), 0.0, 0.01**2)
    >>> segments.round(1).tolist(), ranges.tolist()
    ([[-1.0, 1.0, -1.0, -1.0]], [[315, 406]])
    """
    theta = as_array("theta", theta, ("N",))
    beams = theta.size
    seen, rho = _seen(rho, theta.shape)
    var_theta = as_number("var_theta", var_theta, minimum=0.0)
    var_rho = as_number("var_rho", var_rho, minimum=0.0)
    params = _params(params)
    laps = 2 if _is_full_turn(theta) else 1
    theta, rho = np.tile(theta[seen], laps), np.tile(rho, laps)
    seen = np.concatenate([seen + beams * lap for lap in range(laps)])
    scan = _points(theta, rho, params)
    runs = (scan.walls_of_full_turn if laps == 2 and rho.size else scan.walls)(params.min_points)

    runs = np.array(runs, dtype=int).reshape(-1, 2)
    of_runs = np.concatenate([np.arange(i, j) for i, j in runs] or [np.zeros(0, dtype=int)])
    alpha, r, C = fit_runs(theta[of_runs], rho[of_runs], runs[:, 1] - runs[:, 0], var_theta, var_rho)
    normal = np.stack([np.cos(alpha), np.sin(alpha)], axis=1)[:, None]
    ends = scan.points.T[runs - [0, 1]]
    segments = (ends - (np.sum(ends * normal, axis=2) - r[:, None])[..., None] * normal).reshape(-1, 4)
    ranges = seen[runs - [0, 1]] + [0, 1]
    ranges[ranges[:, 0] >= beams] -= beams
    # What is all in one point or all around the scanner is no line, however generous the parameters are.
    good = np.isfinite(C[:, 0, 0])
    good &= np.hypot(*(segments[:, 2:] - segments[:, :2]).T) >= params.min_segment_length
    kept = np.argsort(ranges[:, 0])
    kept = kept[good[kept]]
    return alpha[kept], r[kept], C[kept], segments[kept], ranges[kept]


def _is_full_turn(theta: np.ndarray) -> bool:
    """Tell whether the last beam and the first are neighbours: no farther apart than 1.5 of the widest step."""
    steps = np.diff(theta)
    if steps.size < 2 or not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        return False
    left = TURN - abs(theta[-1] - theta[0])
    return -1e-9 <= left <= 1.5 * np.abs(steps).max()


def _points(theta: np.ndarray, rho: np.ndarray, params: Params) -> ScanPoints:
    return ScanPoints(theta, rho, params.line_point_distance, params.max_point_gap)


def _params(params: Params | Mapping[str, float]) -> Params:
    if isinstance(params, Params):
        return params
    names = list(Params.__dataclass_fields__)
    if not isinstance(params, Mapping) or set(params) != set(names):
        got = sorted(params) if isinstance(params, Mapping) else type(params).__name__
        raise ValueError(f"params: expected {names}, got {got}")
    return Params(**params)


def _seen(rho: ArrayLike, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return which beams saw something, and their ranges."""
    try:
        nothing = np.isnan(rho)
        filled = np.where(nothing, 1.0, rho)
    except (TypeError, ValueError):  # no numbers, or no array: as_array says so
        nothing, filled = False, rho
    rho = as_array("rho", filled, shape)
    seen = np.flatnonzero(~np.broadcast_to(nothing, shape))
    return seen, rho[seen]


def _ranges(ranges: ArrayLike, size: int) -> list[tuple[int, int]]:
    ranges = as_array("ranges", ranges, ("S", 2))
    ends = ranges.ravel()
    whole = np.array_equal(ends, np.round(ends)) and np.all((ends >= 0) & (ends <= size))
    if not whole or np.any(ranges[:, 1] <= ranges[:, 0]) or np.any(ranges[1:, 0] < ranges[:-1, 1]):
        raise ValueError(f"ranges: expected ordered runs of {size} beams, got {ranges.tolist()}")
    return [(int(i), int(j)) for i, j in ranges]
