r"""Angles on the circle.

Two headings that differ by a whole turn are the same heading. The motion stages let a heading grow without
bound, so that it stays differentiable; what compares headings or bearings wraps the difference. The interval
is [-pi, pi): the edge pi itself becomes -pi.

For the same reason angles have no sum, and their mean is not the mean of numbers. A heading a is the unit vector
(cos a, sin a), and a cloud of headings with weights w of sum 1 has a resultant

.. math:: R\, (\cos\bar a, \sin\bar a) = \sum_i w_i\, (\cos a_i, \sin a_i)

whose direction is the circular mean and whose length R, between 0 and 1, says how well they agree:
1 - R = sum w_i 2 sin^2((a_i - mean) / 2), which keeps its digits where 1 minus a length of nearly 1 has none.
"""

from math import inf, pi

import numpy as np
from numpy.typing import ArrayLike

from roboloc.validation import as_array

TURN = 2.0 * pi


def wrap(a: ArrayLike) -> float | np.ndarray:
    """Wrap angles to [-pi, pi).

    Parameters
    ----------
    a : array_like
        Angles [rad].

    Returns
    -------
    float or ndarray
        The same directions [rad], in the shape of `a`.

    Examples
    --------
    Three quarters of a turn to the left look where one quarter to the right looks.

    >>> round(wrap(1.5 * np.pi) / np.pi, 12)
    -0.5
    >>> wrap(np.pi) == wrap(-np.pi) == -np.pi
    True
    """
    a = np.asarray(a, dtype=np.float64)
    # Angles already inside pass bit by bit, most often all of them; the rest loses a multiple of the turn.
    # Rounding can land on the open end, so it is folded over once more.
    inside = (a >= -pi) & (a < pi)
    if inside.all():
        return a.copy() if a.ndim else float(a)
    wrapped = np.where(inside, a, a - TURN * np.floor((a + pi) / TURN))
    wrapped = np.where(wrapped >= pi, wrapped - TURN, wrapped)
    wrapped = np.where(wrapped < -pi, -pi, wrapped)
    return wrapped[()] if wrapped.ndim else float(wrapped)


def difference(a: ArrayLike, b: ArrayLike) -> float | np.ndarray:
    """Return the signed angle that turns `b` into `a`, in [-pi, pi).

    Parameters
    ----------
    a, b : array_like
        Angles [rad], of shapes that broadcast.

    Returns
    -------
    float or ndarray
        a - b on the circle [rad].

    Examples
    --------
    From 1 degree left of straight back to 1 degree right of it is a turn of 2 degrees, not of 358.

    >>> round(float(np.degrees(difference(np.radians(-179), np.radians(179)))), 9)
    2.0
    """
    return wrap(np.subtract(a, b, dtype=np.float64))


def circular_mean(angles: ArrayLike, weights: ArrayLike | None = None) -> float:
    """Return the direction of the sum of unit vectors that point along the angles.

    Parameters
    ----------
    angles : (N,) array_like
        Angles [rad], N at least 1.
    weights : (N,) array_like, optional
        Weights, none negative and not all 0; their sum does not matter. All the same if left out.

    Returns
    -------
    float
        Mean direction, in [-pi, pi) [rad].

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if a weight is negative or all are 0, or if the unit
        vectors cancel, so that there is no mean.

    Examples
    --------
    Headings of 350 and 20 degrees are 5 degrees on average, not 185.

    >>> round(float(np.degrees(circular_mean(np.radians([350.0, 20.0])))), 9)
    5.0
    """
    a, w = _weighted(angles, weights)
    mean, length = _resultant(a, w)
    if length <= a.size * np.finfo(float).eps:
        raise ValueError("angles: expected angles with a mean direction, got angles that cancel")
    return float(wrap(mean))


def resultant_length(angles: ArrayLike, weights: ArrayLike | None = None) -> float:
    """Return how long the mean of the unit vectors along the angles is.

    Parameters
    ----------
    angles : (N,) array_like
        Angles [rad], N at least 1.
    weights : (N,) array_like, optional
        Weights, none negative and not all 0; their sum does not matter. All the same if left out.

    Returns
    -------
    float
        1 if all angles are one direction, 0 if they cancel.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if a weight is negative or all are 0.

    Examples
    --------
    Two headings a right angle apart: the mean of their unit vectors ends half way between, on the chord.

    >>> round(resultant_length([0.0, np.pi / 2]), 4)
    0.7071
    """
    return 1.0 - _shortfall(*_weighted(angles, weights))


def circular_std(angles: ArrayLike, weights: ArrayLike | None = None) -> float:
    """Return the standard deviation of the normal distribution that, wrapped, has the same resultant length.

    Parameters
    ----------
    angles : (N,) array_like
        Angles [rad], N at least 1.
    weights : (N,) array_like, optional
        Weights, none negative and not all 0; their sum does not matter. All the same if left out.

    Returns
    -------
    float
        The root of -2 log R with the resultant length R [rad]: infinite for R = 0, and the ordinary standard
        deviation, without Bessel's correction, for angles close together.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if a weight is negative or all are 0.

    Notes
    -----
    Source: K. V. Mardia and P. E. Jupp, *Directional Statistics*, section 2.3.

    Examples
    --------
    Half the headings 1 degree left of straight back and half 1 degree right of it: they spread by 1 degree.

    >>> f"{np.degrees(circular_std(np.radians([179.0, -179.0]))):.4f}"
    '1.0000'
    """
    shortfall = _shortfall(*_weighted(angles, weights))
    return float(np.sqrt(-2.0 * np.log1p(-shortfall))) if shortfall < 1.0 else inf


def _weighted(angles: ArrayLike, weights: ArrayLike | None) -> tuple[np.ndarray, np.ndarray]:
    """Return angles and weights of sum 1."""
    a = as_array("angles", angles, ("N",))
    if not a.size:
        raise ValueError("angles: expected at least one angle, got none")
    w = np.ones(a.size) if weights is None else as_array("weights", weights, a.shape)
    if np.any(w < 0.0) or not np.any(w):
        raise ValueError(f"weights: expected none negative and not all 0, got {w}")
    w = w / w.max()
    return a, w / w.sum()


def _resultant(a: np.ndarray, w: np.ndarray) -> tuple[float, float]:
    """Return direction and length of the weighted sum of unit vectors."""
    s, c = w @ np.sin(a), w @ np.cos(a)
    return float(np.arctan2(s, c)), float(np.hypot(s, c))


def _shortfall(a: np.ndarray, w: np.ndarray) -> float:
    """Return what the resultant length lacks to 1, with all digits however close together the angles are."""
    mean, length = _resultant(a, w)
    if length <= a.size * np.finfo(float).eps:
        return 1.0
    return min(float(w @ (2.0 * np.sin((a - mean) / 2.0) ** 2)), 1.0)
