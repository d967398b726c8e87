"""What Monte Carlo localization computes with: blocks of particles, angles in place, the nearest of many lines.

All arrays have the particles last, so that every operation runs along contiguous rows. At a thousand particles a
call of NumPy costs as much as its work on one row, and beyond a megabyte memory costs more than arithmetic; so
everything is done for all lines of one observation at once, and for not more particles than stay in the cache.
"""

import threading
import warnings
from math import nan, pi, prod, sqrt

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import TURN
from roboloc.validation import as_array

# Particles handled at a time, at most; fewer where there is much to do for each.
_BLOCK = 2048
_PAIRS = 150_000


class _Kept(threading.local):
    """The memory of a thread's last block: fresh memory costs more than what is written to it."""

    memory = np.empty(0)


_kept = _Kept()


def blocks(M: int, pairs: int = 1) -> list[slice]:
    """Return slices that cut M particles, each with so many numbers to find, into blocks."""
    size = min(_BLOCK, max(_PAIRS // max(pairs, 1), 64))
    return [slice(start, min(start + size, M)) for start in range(0, M, size)]


def scratch(*shape: int) -> np.ndarray:
    """Return an array of unknown content, which is this thread's until the next call; wrapping is one, too."""
    size = prod(shape)
    if _kept.memory.size < size:
        _kept.memory = np.empty(size)
    return _kept.memory[:size].reshape(shape)


def wrap_in_place(a: np.ndarray) -> None:
    """Wrap angles to [-pi, pi); faster than :func:`roboloc.angles.wrap`."""
    turns = np.multiply(a, 1.0 / TURN, out=scratch(*a.shape))
    np.rint(turns, out=turns)
    turns *= TURN
    a -= turns
    # What rint leaves outside is a digit beyond either edge; there is almost never any.
    if a.size and (a.max() >= pi or a.min() < -pi):
        a[a < -pi] += TURN
        a[a >= pi] -= TURN
        np.maximum(a, -pi, out=a)


def whitening(Q_raw: ArrayLike, count: int) -> np.ndarray:
    """Return lower triangular W, (I, 2, 2), with v^T Q^-1 v = |W v|^2: the inverse of Cholesky's factor of Q."""
    Q_raw = as_array("Q_raw", Q_raw if count else np.zeros((0, 2, 2)), (count, 2, 2))
    W = []
    for (q_aa, q_ar), (_, q_rr) in Q_raw.tolist():
        slope = q_ar / q_aa if q_aa > 0.0 else nan
        rest = q_rr - slope * q_ar  # the variance of r where alpha is known
        if not rest > 0.0:
            raise ValueError(f"Q_raw: expected positive definite matrices, got {Q_raw.tolist()}")
        sigma = sqrt(rest)
        W.append(((1.0 / sqrt(q_aa), 0.0), (-slope / sigma, 1.0 / sigma)))
    return np.array(W).reshape(count, 2, 2)


def as_weights(ws: ArrayLike) -> np.ndarray:
    """Return weights as an array, (M,): at least one, none negative."""
    ws = as_array("ws", ws, ("M",))
    if not ws.size:
        raise ValueError("ws: expected at least one weight, got none")
    if ws.min() < 0.0:
        raise ValueError(f"ws: expected no negative weight, got {ws.min()}")
    return ws


def posterior(ws: np.ndarray, d2: np.ndarray) -> np.ndarray:
    """Return weights times exp(-d2 / 2), of total 1; if none is left, all alike, and the stage's caller is warned."""
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.log(ws) - d2 / 2
    logs[np.isnan(logs)] = -np.inf  # inf - inf, where the processor has no fused product and sum
    best = logs.max()
    if best == -np.inf:
        message = "no particle can explain what is seen: all weights are set to 1/M"
        warnings.warn(message, RuntimeWarning, stacklevel=3)
        return np.full(ws.size, 1.0 / ws.size)
    logs -= best
    after = np.exp(logs, out=logs)
    after /= after.sum()
    return after


def nearest_lines(z_raw: np.ndarray, h_alpha: np.ndarray, h_r: np.ndarray, W: np.ndarray) -> np.ndarray:
    """Find for each observation and particle the line with the least |W v|^2, the first of several.

    The part of r is left without a factor: with w = (W_aa / W_rr)^2 and b = -W_ra / W_rr what is compared is
    w v_alpha^2 + (v_r - b v_alpha)^2.

    Parameters
    ----------
    z_raw : (2, I) ndarray
        Observed lines alpha, r [rad, m].
    h_alpha, h_r : (J, B) ndarray
        Parameters of the lines that B particles predict, contiguous [rad, m].
    W : (I, 2, 2) ndarray
        What whitens the innovation of each observation.

    Returns
    -------
    (I, B) ndarray of int
        Where the nearest line is in `h_alpha` and `h_r`, counted along their rows.
    """
    (J, B), count = h_r.shape, z_raw.shape[1]
    size = J * B
    memory = scratch(4 * size + count * size // 8 + 1)
    turns, t, work, rest = memory[: 4 * size].reshape(4, J, B)
    is_least = memory[4 * size :].view(np.bool_)[: count * size].reshape(count, J, B)

    np.multiply(h_alpha, 1.0 / TURN, out=turns)  # counted in turns, so that rint wraps them
    w = (TURN * W[:, 0, 0] / W[:, 1, 1]) ** 2
    b = -TURN * W[:, 1, 0] / W[:, 1, 1]
    for i, (z_alpha, z_r, weight, slope) in enumerate(zip(z_raw[0] / TURN, z_raw[1], w, b, strict=True)):
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
        t += rest
        np.equal(t, t.min(axis=0), out=is_least[i])

    # An argmin without a step from row to row: the earlier a line, the higher its rank among the equally near.
    ranks = np.arange(J, 0, -1, dtype=np.min_scalar_type(J))
    ranked = is_least.view(np.uint8).astype(ranks.dtype, copy=False)
    ranked *= ranks[:, None]
    nearest = J - ranked.max(axis=1).astype(np.intp)
    nearest *= B
    nearest += np.arange(B)
    return nearest
