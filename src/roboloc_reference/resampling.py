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
number of teeth before it but for rounding; how many marks precede a tooth is the running sum of their histogram.

Source: Stanford AA274A (2021), problem set 4, problem 3 (iii); Flinders University, Instrumentation, tutorial 6.
"""

import numpy as np
from numpy.typing import ArrayLike

from roboloc.validation import as_array, as_number


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

    teeth = np.empty(M + 2)  # with one before the first and one behind the last
    teeth[0], teeth[-1] = -np.inf, np.inf
    u = teeth[1:-1]
    np.divide(np.arange(M), M, out=u)
    u += offset
    u *= total
    np.minimum(u, np.nextafter(total, 0.0), out=u)

    # before[i]: how many teeth lie before the mark c_i. Rounding can put the quotient off by one; two exact
    # comparisons put it right, so that the result is that of the definition to the last digit.
    c_share = c / total
    c_share -= offset
    c_share *= M
    before = np.clip(np.ceil(c_share, out=c_share), 0, M).astype(np.intp)
    before -= teeth[before] >= c
    before += teeth[before + 1] < c
    return np.cumsum(np.bincount(before, minlength=M)[:M])
