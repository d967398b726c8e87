"""What Monte Carlo localization computes with: blocks of particles, angles in place, the nearest of many lines.

All arrays have the particles last, so that every operation runs along contiguous rows. At a thousand particles a
call of NumPy costs as much as its work on one row, and beyond a megabyte memory costs more than arithmetic; so
everything is done for all lines of one observation at once, and for not more particles than stay in the cache.
"""

import threading
from math import pi

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import TURN
from roboloc.validation import as_array

# Particles handled at a time, at most; fewer where there is much to do for each.
_BLOCK = 1024
_PAIRS = 100_000

# Fresh memory costs more than what is written to it, so each thread keeps the memory of its last block.
_kept = threading.local()


def blocks(M: int, pairs: int = 1) -> list[slice]:
    """Return slices that cut M particles, each with so many numbers to find, into blocks."""
    size = min(_BLOCK, max(_PAIRS // max(pairs, 1), 64))
    return [slice(start, min(start + size, M)) for start in range(0, M, size)]


def _memory(size: int) -> np.ndarray:
    """Return so many numbers of unknown value, which are this thread's until the next call."""
    if getattr(_kept, "memory", np.empty(0)).size < size:
        _kept.memory = np.empty(size)
    return _kept.memory[:size]


def wrap_in_place(a: np.ndarray) -> None:
    """Wrap angles to [-pi, pi); faster than :func:`roboloc.angles.wrap`."""
    turns = a * (1.0 / TURN)
    np.rint(turns, out=turns)
    turns *= TURN
    a -= turns
    # What rint leaves outside is a digit beyond either edge; there is almost never any.
    if a.size and (a.max() >= pi or a.min() < -pi):
        a[a < -pi] += TURN
        a[a >= pi] -= TURN
        np.maximum(a, -pi, out=a)


def quadratic_forms(Q_raw: ArrayLike, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a, b, c, each (I,), with v^T Q^-1 v = a v_alpha^2 + c (v_r - b v_alpha)^2."""
    Q_raw = as_array("Q_raw", Q_raw if count else np.zeros((0, 2, 2)), (count, 2, 2))
    q_aa, q_ar, q_rr = Q_raw[:, 0, 0], Q_raw[:, 0, 1], Q_raw[:, 1, 1]
    with np.errstate(all="ignore"):
        slope = q_ar / q_aa
        rest = q_rr - slope * q_ar
    if not ((q_aa > 0.0) & (rest > 0.0)).all():
        raise ValueError(f"Q_raw: expected positive definite matrices, got {Q_raw.tolist()}")
    return 1.0 / q_aa, slope, 1.0 / rest


def nearest_lines(
    z_raw: np.ndarray, h_alpha: np.ndarray, h_r: np.ndarray, weights: np.ndarray, slopes: np.ndarray
) -> np.ndarray:
    """Find the line with the least w v_alpha^2 + (v_r - b v_alpha)^2, the first of several.

    Parameters
    ----------
    z_raw : (2, I) ndarray
        Observed lines alpha, r [rad, m].
    h_alpha, h_r : (J, B) ndarray
        Parameters of the lines that B particles predict, contiguous [rad, m].
    weights, slopes : (I,) ndarray
        The numbers w [m^2/rad^2] and b [m/rad] of each observation.

    Returns
    -------
    (I, B) ndarray of int
        Where the nearest line is in `h_alpha` and `h_r`, counted along their rows.
    """
    (J, B), count = h_r.shape, z_raw.shape[1]
    size = J * B
    memory = _memory((4 + count) * size)
    turns, t, work, rest = memory[: 4 * size].reshape(4, J, B)
    d2 = memory[4 * size :].reshape(J, count, B)

    np.multiply(h_alpha, 1.0 / TURN, out=turns)  # counted in turns, so that rint wraps them
    parameters = z_raw[0] / TURN, z_raw[1], TURN * TURN * weights, TURN * slopes
    for i, (z_alpha, z_r, weight, slope) in enumerate(zip(*parameters, strict=True)):
        np.subtract(z_alpha, turns, out=t)
        np.rint(t, out=work)
        t -= work
        np.subtract(z_r, h_r, out=rest)
        if slope:
            np.multiply(slope, t, out=work)
            rest -= work
        rest *= rest
        t *= t
        t *= weight
        np.add(t, rest, out=d2[:, i])

    # An argmin without a step from row to row: the earlier a line, the higher its rank among the equally near.
    least = d2.min(axis=0)
    is_least = np.empty(d2.shape, np.bool_)
    for j in range(J):
        np.equal(d2[j], least, out=is_least[j])
    ranks = np.arange(J, 0, -1, dtype=np.min_scalar_type(J))
    highest = (is_least.view(np.uint8) * ranks[:, None, None]).max(axis=0)
    return (J - highest.astype(np.intp)) * B + np.arange(B)
