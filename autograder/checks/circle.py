"""Angles whose turn does not matter: bring one that came back into the turn of the right one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

# Of an angle beyond so many turns, whole turns cannot be taken off: too few of its digits are within the turn, and
# of a huge one none, so that it would equal whatever is asked for.
_TURNS = 1000.0


def nearest_turn(
    got: ArrayLike, right: ArrayLike, before: float = np.pi, period: float = 2.0 * np.pi
) -> np.ndarray:
    """Take whole turns off angles.

    Parameters
    ----------
    got : array_like
        Angles that came back [rad].
    right : array_like
        What they are to be near to [rad].
    before : float
        The result is within [right - before, right - before + period).
    period : float
        A whole turn, or half of one [rad].

    Returns
    -------
    numpy.ndarray
        The angles; one beyond a thousand turns, or not finite, is returned as it is.

    Examples
    --------
    >>> nearest_turn([6.5, -6.0, 1e17], 0.2).round(4).tolist()
    [0.2168, 0.2832, 1e+17]
    """
    got, right = np.asarray(got, dtype=float), np.asarray(right, dtype=float)
    off = got - right
    with np.errstate(invalid="ignore"):
        turns = np.where(np.abs(off) < period * _TURNS, np.floor((off + before) / period), 0.0)
    return got - period * turns
