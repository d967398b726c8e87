r"""Which particles survive: systematic resampling, one random number for all of them.

The weights, laid end to end, are a ruler of length c_last. A comb of M teeth, evenly spaced and shifted by one
random offset, is laid on it, and every tooth takes the particle it points at:

.. math::

    c_i = \sum_{k \le i} w_k, \qquad u_m = \left(o + \frac{m}{M}\right) c_{last}, \qquad
    a_m = \min \{ i : c_i > u_m \}, \qquad 0 \le o < \frac{1}{M}.

A particle of weight w, of total 1, is taken at least floor(M w) and at most ceil(M w) times, and M w times on
average. Afterwards all weights are 1/M.

The length of the ruler is the last entry of the running sum, not `sum(w)`: the two differ by rounding, and a last
tooth beyond the last mark would point at nothing. For the same reason a tooth that rounding puts on the very end
is moved one digit back.

The comb is not searched for in the ruler, which costs M log M. Its teeth are even, so every mark c_i knows the
number of teeth before it; only where rounding decides, mark and tooth are compared. How many marks precede a tooth
is the running sum of their histogram.

Source: Stanford AA274A (2021), problem set 4, problem 3 (iii); Flinders University, Instrumentation, tutorial 6.
"""

import numpy as np
from numpy.typing import ArrayLike

from roboloc.validation import as_array, as_number

# Marks handled at a time, so that they stay in the cache.
_BLOCK = 16_384


def systematic_resample(ws: ArrayLike, offset: float) -> np.ndarray:
    """Choose for every place in the new set the particle that fills it.

    Parameters
    ----------
    ws : (M,) array_like
        Weights, not negative, of any positive total.
    offset : float
        Where the comb begins, in [0, 1/M): drawn uniformly, once for all particles.

    Returns
    -------
    ancestors : (M,) ndarray of int
        Indices of the particles taken, in ascending order; none of weight 0 is among them.

    Raises
    ------
    ValueError
        If the weights are no vector of at least one finite number, if one is negative, if their total is 0 or
        overflows, or if the offset is outside [0, 1/M).

    Notes
    -----
    Source: Stanford AA274A (2021), problem set 4, problem 3 (iii), and Flinders University, Instrumentation,
    tutorial 6.

    Examples
    --------
    Of four particles the one with three quarters of the weight takes three of the four places.

    >>> systematic_resample([0.0, 0.75, 0.25, 0.0], 0.1).tolist()
    [1, 1, 1, 2]
    """
    ws = as_array("ws", ws, ("M",))
    M = ws.size
    if not M:
        raise ValueError("ws: expected at least one weight, got none")
    if ws.min() < 0.0:
        raise ValueError(f"ws: expected no negative weight, got {ws.min()}")
    offset = as_number("offset", offset, minimum=0.0)
    if offset >= 1.0 / M:
        raise ValueError(f"offset: expected a number below 1/M = {1.0 / M}, got {offset}")
    with np.errstate(over="ignore"):
        c = np.cumsum(ws)
    total = float(c[-1])
    if not 0.0 < total < np.inf:
        raise ValueError(f"ws: expected a positive, finite total, got {total}")

    before = np.empty(M, np.intp)
    for start in range(0, M, _BLOCK):
        block = slice(start, start + _BLOCK)
        before[block] = _teeth_before(c[block], total, offset, M)
    return np.cumsum(np.bincount(before, minlength=M)[:M])


def _teeth_before(c: np.ndarray, total: float, offset: float, M: int) -> np.ndarray:
    """Count for each mark the teeth of the comb that lie before it."""
    share = c / total
    share *= M
    share -= offset * M
    before = np.ceil(share)
    # Where a mark is so close to a tooth that rounding decides, the two are compared.
    share -= before
    share += 0.5
    np.abs(share, out=share)
    close = np.flatnonzero(share > 0.5 - 8.0 * np.finfo(float).eps * M)
    if close.size:
        m = np.rint((c[close] / total - offset) * M)
        u = np.minimum((offset + m / M) * total, np.nextafter(total, 0.0))
        before[close] = m + (u < c[close])
    return np.clip(before, 0, M, out=before)
