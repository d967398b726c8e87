r"""Lines in a range scan: fit one, then split and merge to find them all.

A scan is a list of beams, bearing theta and range rho, in the order in which they were taken. A line is alpha, r:
the points with x cos(alpha) + y sin(alpha) = r. In the frame of its nearest point, beam i has the coordinates

.. math:: n_i = \rho_i \cos(\theta_i - \alpha) - r, \qquad t_i = \rho_i \sin(\theta_i - \alpha),

across the line and along it. The fit makes the sum of the squared n_i as small as it gets. Its solution is where
sum n_i (t_i - tbar) = 0 and sum n_i = 0; differentiating these two equations gives how alpha and r follow an error
of each beam, and so their covariance, without a second fit.

Runs of beams are half-open ranges [first, last + 1). `split` cuts a scan where neighbours are too far apart, and
then every run that is no line where two lines fit it best. `merge` joins neighbours that are one line after all.
`extract_lines` does both to the beams that saw something, drops what is too short, and moves each corner to where
its two lines agree best. A wall that lies across the first and the last beam of a full turn is found as two.

Source: Stanford AA274A, problem set 3, line extraction. Derived in the book, *Fitting lines to a scan*.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import wrap
from roboloc.validation import as_array, as_number
from roboloc_reference.scan_points import ScanPoints


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


def fit_line(
    theta: ArrayLike, rho: ArrayLike, var_theta: float, var_rho: float
) -> tuple[float, float, np.ndarray]:
    """Fit a line to beams by least squares of the perpendicular distance.

    Parameters
    ----------
    theta : (N,) array_like
        Bearings [rad].
    rho : (N,) array_like
        Ranges [m], N at least 2.
    var_theta : float
        Variance of a bearing [rad^2].
    var_rho : float
        Variance of a range [m^2].

    Returns
    -------
    alpha : float
        Direction from the origin to the line, in [-pi, pi) [rad].
    r : float
        Distance of the line, not negative [m].
    C : (2, 2) ndarray
        Covariance of alpha, r when the errors of all beams are independent, to first order.

    Raises
    ------
    ValueError
        If an argument has another shape, is negative or is not finite, if there are fewer than two points, or if
        the points have no direction, as when all are one.

    Notes
    -----
    Source: Stanford AA274A, problem set 3, line fitting.

    Examples
    --------
    A wall 2 m to the left, seen by three beams, and how well: with ranges good to 3 cm its distance is known to
    2 cm and its direction to 1 degree.

    >>> theta = np.pi / 2 + np.array([-0.5, 0.0, 0.5])
    >>> alpha, r, C = fit_line(theta, 2.0 / np.sin(theta), 0.0, 0.03**2)
    >>> round(float(np.degrees(alpha)), 9), round(r, 9)
    (90.0, 2.0)
    >>> f"{np.degrees(C[0, 0] ** 0.5):.0f} degree, {C[1, 1] ** 0.5:.2f} m"
    '1 degree, 0.02 m'
    """
    theta, rho = _beams(theta, rho)
    var_theta = as_number("var_theta", var_theta, minimum=0.0)
    var_rho = as_number("var_rho", var_rho, minimum=0.0)
    N = theta.size
    if N < 2:
        raise ValueError(f"theta: expected at least 2 beams, got {N}")
    x, y = rho * np.cos(theta), rho * np.sin(theta)
    x_mean, y_mean = x.mean(), y.mean()
    dx, dy = x - x_mean, y - y_mean
    # The direction across the line has the least scatter; twice its angle is free of square roots.
    cross, along = -2.0 * (dx @ dy), dy @ dy - dx @ dx
    spread = np.hypot(cross, along)
    if spread <= 1e-14 * (rho @ rho):
        raise ValueError("rho: expected points with a direction, got one point or a round cloud")
    alpha = 0.5 * np.arctan2(cross, along)
    r = x_mean * np.cos(alpha) + y_mean * np.sin(alpha)
    if r < 0.0:
        alpha, r = alpha + np.pi, -r

    c, s = np.cos(theta - alpha), np.sin(theta - alpha)
    n, t = rho * c - r, rho * s
    offset = t - t.mean()
    # An error of beam i moves its point by (c, s) drho + (-t, rho c) dtheta across and along the line.
    alpha_rho = -(offset * c + n * s) / spread
    alpha_theta = -(-offset * t + n * rho * c) / spread
    r_rho = c / N + t.mean() * alpha_rho
    r_theta = -t / N + t.mean() * alpha_theta
    by_rho, by_theta = np.stack([alpha_rho, r_rho]), np.stack([alpha_theta, r_theta])
    C = var_rho * (by_rho @ by_rho.T) + var_theta * (by_theta @ by_theta.T)
    return float(wrap(alpha)), float(r), C


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
    params = _params(params)
    scan = ScanPoints(*_beams(theta, rho), params.line_point_distance, params.max_point_gap)
    todo, done = scan.runs()[::-1], []
    while todo:
        i, j = todo.pop()
        if scan.is_line(i, j):
            done.append((i, j))
        else:
            k = scan.corner(i, j, 1)
            todo += [(k, j), (i, k)]
    return np.array(done, dtype=int).reshape(-1, 2)


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
    params = _params(params)
    scan = ScanPoints(*_beams(theta, rho), params.line_point_distance, params.max_point_gap)
    runs = _ranges(ranges, scan.size)
    cost = [scan.joint_distance(a, b) for a, b in pairwise(runs)]
    while cost and min(cost) <= scan.line_point_distance:
        k = int(np.argmin(cost))
        runs[k : k + 2] = [(runs[k][0], runs[k + 1][1])]
        del cost[k]
        for m in (k - 1, k):
            if 0 <= m < len(cost):
                cost[m] = scan.joint_distance(runs[m], runs[m + 1])
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
        First beam and last beam + 1 of each, counted in the arguments; beams in between may have seen nothing.

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
    """
    theta = as_array("theta", theta, ("N",))
    seen, rho = _seen(rho, theta.shape)
    var_theta = as_number("var_theta", var_theta, minimum=0.0)
    var_rho = as_number("var_rho", var_rho, minimum=0.0)
    params = _params(params)
    theta = theta[seen]
    runs = merge(theta, rho, split(theta, rho, params), params)

    scan = ScanPoints(theta, rho, params.line_point_distance, params.max_point_gap)
    many = runs[:, 1] - runs[:, 0] >= params.min_points
    runs = scan.with_sharp_corners(runs[many].tolist(), params.min_points)

    alpha, r = np.empty(len(runs)), np.empty(len(runs))
    C, segments = np.empty((len(runs), 2, 2)), np.empty((len(runs), 4))
    for m, (i, j) in enumerate(runs):
        alpha[m], r[m], C[m] = fit_line(theta[i:j], rho[i:j], var_theta, var_rho)
        normal = np.array([np.cos(alpha[m]), np.sin(alpha[m])])
        ends = scan.points[:, [i, j - 1]].T
        segments[m] = (ends - np.outer(ends @ normal - r[m], normal)).ravel()
    ranges = np.array([(seen[i], seen[j - 1] + 1) for i, j in runs], dtype=int).reshape(-1, 2)
    long = np.hypot(*(segments[:, 2:] - segments[:, :2]).T) >= params.min_segment_length
    return alpha[long], r[long], C[long], segments[long], ranges[long]


def _params(params: Params | Mapping[str, float]) -> Params:
    if isinstance(params, Params):
        return params
    names = list(Params.__dataclass_fields__)
    if not isinstance(params, Mapping) or set(params) != set(names):
        got = sorted(params) if isinstance(params, Mapping) else type(params).__name__
        raise ValueError(f"params: expected {names}, got {got}")
    return Params(**params)


def _beams(theta: ArrayLike, rho: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    theta = as_array("theta", theta, ("N",))
    rho = as_array("rho", rho, theta.shape)
    return theta, rho


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
