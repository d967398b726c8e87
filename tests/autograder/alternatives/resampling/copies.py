"""How many teeth lie before each mark, and from that how many copies of each particle."""

import numpy as np


def systematic_resample(ws, offset):
    """Compare every tooth with every mark, the last one aside, and repeat."""
    w = np.array(ws, dtype=np.float64)
    w = w / np.add.accumulate(w)[-1]
    size = len(w)
    marks = np.add.accumulate(w)
    marks[np.flatnonzero(w)[-1] :] = 2.0
    before = np.sum(offset + np.arange(size)[:, None] / size < marks, axis=0)
    return np.repeat(np.arange(size), np.diff(before, prepend=0))
