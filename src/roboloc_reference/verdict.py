r"""What recorded estimates allow one to say: how far off, how honest, and whether a difference is more than chance.

All functions take arrays of R runs (first axis) and, where time counts, N instants (second axis). Runs are
independent; instants of one run are not, since an error lives on for many steps. So whatever claims a precision takes
the runs apart.

Source: Michigan ROB530, homework 5, problem 2 and bonus, asks which of four filters is better; what it takes to
answer is from Y. Bar-Shalom, X. R. Li, T. Kirubarajan, *Estimation with Applications to Tracking and Navigation*,
section 5.4 and 11.6.
"""

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import wrap
from roboloc.validation import as_array, as_number


def rms_errors(poses: ArrayLike, truth: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Return the root mean square errors of position and heading over the runs, at each instant.

    Parameters
    ----------
    poses : (R, N, 3) array_like
        Estimates [m, m, rad]; headings in any turn.
    truth : (R, N, 3) array_like
        True poses, headings in any turn.

    Returns
    -------
    position : (N,) ndarray
        Root of the mean squared distance [m].
    heading : (N,) ndarray
        Root of the mean squared error of the heading, on the circle [rad].

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Examples
    --------
    Two runs of one instant, 3 m off to the east and 4 m to the north.

    >>> position, heading = rms_errors([[[3, 0, 0.1]], [[0, 4, 0.1]]], np.zeros((2, 1, 3)))
    >>> (position**2).round(9).tolist(), heading.round(9).tolist()
    ([12.5], [0.1])
    """
    poses = as_array("poses", poses, ("R", "N", 3))
    error = poses - as_array("truth", truth, poses.shape)
    squares = np.mean(np.stack([np.sum(error[..., :2] ** 2, axis=-1), wrap(error[..., 2]) ** 2]), axis=1)
    return np.sqrt(squares[0]), np.sqrt(squares[1])


def coverage(errors: ArrayLike, covs: ArrayLike, probability: float) -> np.ndarray:
    """Return the share of runs in which the truth is inside the region that the filter gives the probability.

    Parameters
    ----------
    errors : (R, N, n) array_like
        Estimate less truth, angles wrapped.
    covs : (R, N, n, n) array_like
        Covariances that the filter claims, positive definite.
    probability : float
        Of the region, between 0 and 1, both excluded.

    Returns
    -------
    (N,) ndarray
        Shares, between 0 and 1.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if the probability is not between 0 and 1.

    Examples
    --------
    One number, known to 1: of four errors one is beyond 1.96.

    >>> coverage([[[0.5]], [[-1.9]], [[2.0]], [[0.1]]], np.ones((4, 1, 1, 1)), 0.95).tolist()
    [0.75]
    """
    from scipy.special import chdtri  # noqa: PLC0415  (as in roboloc.metrics)

    errors = as_array("errors", errors, ("R", "N", "n"))
    covs = as_array("covs", covs, (*errors.shape, errors.shape[-1]))
    probability = _as_probability(probability)
    squares = np.sum(errors * np.linalg.solve(covs, errors[..., None])[..., 0], axis=-1)
    return np.mean(squares <= chdtri(errors.shape[-1], 1.0 - probability), axis=0)


def mean_and_error(values: ArrayLike) -> tuple[float, float]:
    """Return the mean over runs and instants, and its standard error, from the means of the runs.

    Parameters
    ----------
    values : (R, N) array_like
        One number for each run and instant; runs are independent, instants of a run are not. At least two runs.

    Returns
    -------
    mean, error : float
        Mean, and the standard deviation that it would have from one set of runs to the next.

    Raises
    ------
    ValueError
        If the argument has another shape or is not finite, or if there is one run alone.

    Examples
    --------
    Two runs, 2 and 4 at every instant: however many instants, they are two numbers.

    >>> mean_and_error(np.repeat([[2.0], [4.0]], 100, axis=1))
    (3.0, 1.0)
    """
    values = as_array("values", values, ("R", "N"))
    if len(values) < 2:
        raise ValueError("values: expected two runs at least, got one")
    means = values.mean(axis=1)
    return float(means.mean()), float(means.std(ddof=1) / np.sqrt(len(means)))


def paired_interval(a: ArrayLike, b: ArrayLike, picks: ArrayLike, probability: float) -> tuple[float, float]:
    """Return the bootstrap interval of the mean difference a - b of two filters that made the same runs.

    Parameters
    ----------
    a, b : (R,) array_like
        A number for each run, of one filter and of the other.
    picks : (B, R) array_like of int
        Numbers of runs: each row is a set of R runs, drawn with replacement.
    probability : float
        Of the interval, between 0 and 1, both excluded; as much is left out below as above.

    Returns
    -------
    low, high : float
        Quantiles of the B mean differences, between neighbours on a straight line.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if a pick is no run, or if the probability is not
        between 0 and 1.

    Examples
    --------
    A filter that is worse by 1 in every run is worse by 1, however much the runs differ.

    >>> a = np.array([5.0, 90.0, 1.0])
    >>> paired_interval(a, a - 1.0, [[0, 0, 1], [2, 1, 0], [2, 2, 2]], 0.9)
    (1.0, 1.0)
    """
    a = as_array("a", a, ("R",))
    b = as_array("b", b, a.shape)
    picks = as_array("picks", picks, ("B", a.size))
    if picks.size and not (np.all(picks == np.rint(picks)) and 0 <= picks.min() <= picks.max() < a.size):
        raise ValueError(f"picks: expected whole numbers from 0 to {a.size - 1}")
    outside = (1.0 - _as_probability(probability)) / 2.0
    means = (a - b)[picks.astype(np.int64)].mean(axis=1)
    low, high = np.quantile(means, [outside, 1.0 - outside])
    return float(low), float(high)


def _as_probability(probability: float) -> float:
    probability = as_number("probability", probability)
    if not 0.0 < probability < 1.0:
        raise ValueError(f"probability: expected a number between 0 and 1, got {probability}")
    return probability
