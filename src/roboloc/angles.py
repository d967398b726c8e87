"""Angles on the circle.

Two headings that differ by a whole turn are the same heading. The motion stages let a heading grow without
bound, so that it stays differentiable; what compares headings or bearings wraps the difference. The interval
is [-pi, pi): the edge pi itself becomes -pi.
"""

from math import pi

import numpy as np
from numpy.typing import ArrayLike

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
    # Angles already inside pass bit by bit; the rest loses a multiple of the turn. Rounding can land on the
    # open end, so it is folded over once more.
    wrapped = np.where((a >= -pi) & (a < pi), a, a - TURN * np.floor((a + pi) / TURN))
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
