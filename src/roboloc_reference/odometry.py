r"""The bootstrap particle filter: odometry that is drawn, a bearing that is weighed, one comb that resamples.

Between two poses the wheels report a turn, a way ahead and a turn. Each of the three is corrupted on its own, for
each particle anew, by a normal error whose standard deviation grows with what was commanded:

.. math::

    \sigma_{rot1} &= \alpha_1 |rot_1| + \alpha_2 |trans|, \qquad
    \sigma_{rot2} = \alpha_1 |rot_2| + \alpha_2 |trans|, \\
    \sigma_{trans} &= \alpha_3 |trans| + \alpha_4 (|rot_1| + |rot_2|).

These are standard deviations, not variances, and the turns count by their sizes: a turn to the left and one back
are twice the reason to doubt, where the size of their sum would be none. Anticlockwise is positive.

A bearing of a known landmark then weighs every particle by the normal density of its innovation, wrapped: a
landmark straight behind is as near to -pi as to +pi. The weights are kept as logarithms until the largest is 1,
so that a set of particles which all are far off still has a best one.

Source: Flinders University, Instrumentation, tutorial 6.
"""

import warnings
from math import pi, sqrt

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import wrap
from roboloc.validation import as_array, as_floats, as_number
from roboloc_reference.resampling import systematic_resample


def sample_motion(
    xs: ArrayLike, odometry: ArrayLike, alphas: ArrayLike, rng: np.random.Generator
) -> np.ndarray:
    """Move every particle by the odometry and an error of its own.

    Parameters
    ----------
    xs : (M, 3) array_like
        Particles x, y, theta [m, m, rad].
    odometry : (3,) array_like
        First turn, way ahead and second turn [rad, m, rad].
    alphas : (4,) array_like
        Error per turn, of a turn per way, per way, and of the way per turn [1, rad/m, 1, m/rad]; none is negative.
    rng : numpy.random.Generator
        What the errors are drawn from: three standard normal numbers per particle, in the order of the odometry.

    Returns
    -------
    xs : (M, 3) ndarray
        Particles after the motion; headings are not wrapped.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if an alpha is negative, or if rng is no Generator.

    Notes
    -----
    Source: Flinders University, Instrumentation, tutorial 6, question 1 (b).

    Examples
    --------
    Without error, a quarter turn to the left, 2 m ahead and the turn back end 2 m to the left, facing ahead.

    >>> turn = np.pi / 2
    >>> xs = sample_motion([[0.0, 0.0, 0.0]], [turn, 2.0, -turn], np.zeros(4), np.random.default_rng(1))
    >>> xs.round(12).tolist()
    [[0.0, 2.0, 0.0]]
    """
    xs = as_array("xs", xs, ("M", 3))
    odometry = as_array("odometry", odometry, (3,))
    alphas = as_array("alphas", alphas, (4,))
    if alphas.min() < 0.0:
        raise ValueError(f"alphas: expected no negative number, got {alphas.min()}")
    if not isinstance(rng, np.random.Generator):
        raise ValueError(f"rng: expected a numpy.random.Generator, got {type(rng).__name__}")  # noqa: TRY004

    a1, a2, a3, a4 = alphas
    rot1, trans, rot2 = np.abs(odometry)
    spread = [a1 * rot1 + a2 * trans, a3 * trans + a4 * (rot1 + rot2), a1 * rot2 + a2 * trans]
    rot1, trans, rot2 = (odometry + spread * rng.standard_normal((len(xs), 3))).T
    direction = xs[:, 2] + rot1
    return np.stack(
        [xs[:, 0] + trans * np.cos(direction), xs[:, 1] + trans * np.sin(direction), direction + rot2],
        axis=-1,
    )


def bearing_likelihood(xs: ArrayLike, landmark: ArrayLike, bearing: float, sigma: float) -> np.ndarray:
    """Say how well an observed bearing agrees with every particle.

    Parameters
    ----------
    xs : (M, 3) array_like
        Particles x, y, theta [m, m, rad].
    landmark : (2,) array_like
        Place of the landmark x, y [m].
    bearing : float
        Where it is seen, from the heading, anticlockwise positive [rad].
    sigma : float
        Standard deviation of the bearing, positive [rad].

    Returns
    -------
    support : (M,) ndarray
        Normal density of the wrapped innovation [1/rad]. It is 0 where the number is too small for a float.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if sigma is not positive.

    Notes
    -----
    A particle on the landmark itself has no bearing of it; it is taken to see the landmark along the x axis of
    the world. Source: Flinders University, Instrumentation, tutorial 6, question 1 (c).

    Examples
    --------
    A landmark is seen straight ahead, give or take 0.1 rad. A particle that looks 0.1 rad past it explains that
    exp(-1/2) times as well as one that faces it.

    >>> ahead, past = bearing_likelihood([[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]], [5.0, 0.0], 0.0, 0.1)
    >>> round(float(past / ahead), 4)
    0.6065
    """
    support, peak = _log_support(xs, landmark, bearing, sigma)
    return peak * np.exp(support)


def bootstrap_step(
    xs: ArrayLike,
    ws: ArrayLike,
    odometry: ArrayLike,
    alphas: ArrayLike,
    landmark: ArrayLike,
    bearing: float,
    sigma: float,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """Make one step of the bootstrap filter: draw the motion, weigh the bearing, resample.

    Parameters
    ----------
    xs : (M, 3) array_like
        Particles x, y, theta [m, m, rad], at least one.
    ws : (M,) array_like
        Their weights, not negative, of any total.
    odometry : (3,) array_like
        First turn, way ahead and second turn [rad, m, rad].
    alphas : (4,) array_like
        Error of the odometry, as for `sample_motion`.
    landmark : (2,) array_like
        Place of the landmark x, y [m].
    bearing : float
        Where it is seen after the motion, from the heading [rad].
    sigma : float
        Standard deviation of the bearing, positive [rad].
    rng : numpy.random.Generator
        What the errors of the motion, and after them the offset of the resampling, are drawn from.

    Returns
    -------
    xs : (M, 3) ndarray
        Particles after resampling.
    ws : (M,) ndarray
        Their weights, all 1/M.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if there is no particle, if a weight or an alpha is
        negative, if sigma is not positive, or if rng is no Generator.

    Warns
    -----
    RuntimeWarning
        If no particle can explain what is seen: all weights are 1/M before the resampling, then.

    Notes
    -----
    Source: Flinders University, Instrumentation, tutorial 6, question 2.

    Examples
    --------
    Two particles stand still, one facing the landmark, one with its back to it. A landmark seen ahead leaves the
    first one, twice.

    >>> xs, still = [[0.0, 0.0, 0.0], [0.0, 0.0, np.pi]], np.zeros(3)
    >>> rng = np.random.default_rng(1)
    >>> xs, ws = bootstrap_step(xs, [0.5, 0.5], still, np.zeros(4), [5.0, 0.0], 0.0, 0.1, rng)
    >>> xs.tolist(), ws.tolist()
    ([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], [0.5, 0.5])
    """
    xs = as_array("xs", xs, ("M", 3))
    M = len(xs)
    if not M:
        raise ValueError("xs: expected at least one particle, got none")
    ws = as_array("ws", ws, (M,))
    if ws.min() < 0.0:
        raise ValueError(f"ws: expected no negative weight, got {ws.min()}")

    xs = sample_motion(xs, odometry, alphas, rng)
    with np.errstate(divide="ignore"):
        logs = np.log(ws) + _log_support(xs, landmark, bearing, sigma)[0]
    best = logs.max()
    if best == -np.inf:
        message = "no particle can explain what is seen: all weights are set to 1/M"
        warnings.warn(message, RuntimeWarning, stacklevel=2)
        logs, best = np.zeros(M), 0.0
    return xs[systematic_resample(np.exp(logs - best), rng.uniform(0.0, 1.0 / M))], np.full(M, 1.0 / M)


def _log_support(
    xs: ArrayLike, landmark: ArrayLike, bearing: float, sigma: float
) -> tuple[np.ndarray, float]:
    """Return the logarithm of each particle's density over the peak's, and the peak."""
    xs = as_array("xs", xs, ("M", 3))
    mx, my = as_floats("landmark", landmark, 2)
    bearing = as_number("bearing", bearing)
    sigma = as_number("sigma", sigma)
    if sigma <= 0.0:
        raise ValueError(f"sigma: expected a positive number, got {sigma}")
    v = wrap(bearing - (np.arctan2(my - xs[:, 1], mx - xs[:, 0]) - xs[:, 2]))
    with np.errstate(over="ignore"):
        return -0.5 * np.square(v / sigma), 1.0 / (sqrt(2.0 * pi) * sigma)
