r"""A line through the beams of a scan, and how well they know it.

A scan is a list of beams, bearing theta and range rho. A line is alpha, r: the points with
x cos(alpha) + y sin(alpha) = r. In the frame of its nearest point, beam i has the coordinates

.. math:: n_i = \rho_i \cos(\theta_i - \alpha) - r, \qquad t_i = \rho_i \sin(\theta_i - \alpha),

across the line and along it. The fit makes the sum of the squared n_i as small as it gets. Its solution is where
sum n_i (t_i - tbar) = 0 and sum n_i = 0; differentiating these two equations gives how alpha and r follow an error
of each beam, and so their covariance, without a second fit.

All runs of a scan are fitted at once: their beams stand one run behind the other, and every sum is a sum over each.

Source: Stanford AA274A, problem set 3, line fitting. Derived in the book, *Fitting lines to a scan*.
"""

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import wrap
from roboloc.validation import as_array, as_number


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
    theta, rho = as_beams(theta, rho)
    var_theta = as_number("var_theta", var_theta, minimum=0.0)
    var_rho = as_number("var_rho", var_rho, minimum=0.0)
    if theta.size < 2:
        raise ValueError(f"theta: expected at least 2 beams, got {theta.size}")
    alpha, r, C = fit_runs(theta, rho, np.array([theta.size]), var_theta, var_rho)
    if np.isnan(C[0, 0, 0]):
        raise ValueError("rho: expected points with a direction, got one point or a round cloud")
    return float(alpha[0]), float(r[0]), C[0]


def fit_runs(
    theta: np.ndarray, rho: np.ndarray, counts: np.ndarray, var_theta: float, var_rho: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fit a line to each of several runs of beams: `fit_line` for all at once, its arguments checked before.

    Parameters
    ----------
    theta, rho : (N,) ndarray
        Bearings [rad] and ranges [m], one run behind the other.
    counts : (S,) ndarray of int
        How many beams each run has, at least 2.
    var_theta, var_rho : float
        Variance of a bearing [rad^2] and of a range [m^2].

    Returns
    -------
    alpha, r : (S,) ndarray
        The lines [rad, m].
    C : (S, 2, 2) ndarray
        Their covariances; NaN where the points of a run have no direction.
    """
    if not counts.size:
        return np.zeros(0), np.zeros(0), np.zeros((0, 2, 2))
    starts = np.cumsum(counts) - counts

    def total(each: np.ndarray) -> np.ndarray:
        return np.add.reduceat(each, starts, axis=-1)

    def of_run(value: np.ndarray) -> np.ndarray:
        return np.repeat(value, counts, axis=-1)

    points = rho * np.stack([np.cos(theta), np.sin(theta)])
    mean = total(points) / counts
    dx, dy = points - of_run(mean)
    # The direction across the line has the least scatter; twice its angle is free of square roots.
    cross, along = -2.0 * total(dx * dy), total(dy * dy - dx * dx)
    spread = np.hypot(cross, along)
    spread = np.where(spread > 1e-14 * total(rho * rho), spread, np.nan)
    alpha = 0.5 * np.arctan2(cross, along)
    r = mean[0] * np.cos(alpha) + mean[1] * np.sin(alpha)
    alpha, r = np.where(r < 0.0, alpha + np.pi, alpha), np.abs(r)

    phi = theta - of_run(alpha)
    c, s = np.cos(phi), np.sin(phi)
    n, t = rho * c - of_run(r), rho * s
    t_mean = total(t) / counts
    offset, shares = t - of_run(t_mean), of_run(1.0 / counts)
    # An error of beam i moves its point by (c, s) drho + (-t, rho c) dtheta across and along the line.
    by_alpha = np.stack([-(offset * c + n * s), offset * t - n * rho * c]) / of_run(spread)
    by_r = np.stack([c, -t]) * shares + of_run(t_mean) * by_alpha
    variances = np.array([[var_rho], [var_theta]])
    products = np.stack([by_alpha * by_alpha, by_alpha * by_r, by_r * by_r])
    aa, ar, rr = total((variances * products).sum(axis=1))
    return wrap(alpha), r, np.stack([aa, ar, ar, rr], axis=-1).reshape(-1, 2, 2)


def as_beams(theta: ArrayLike, rho: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Return bearings and ranges as arrays of one length."""
    theta = as_array("theta", theta, ("N",))
    rho = as_array("rho", rho, theta.shape)
    return theta, rho
