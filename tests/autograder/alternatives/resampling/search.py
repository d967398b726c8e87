"""A search for every tooth among the marks."""

import numpy as np


def systematic_resample(ws, offset):
    """Keep the teeth below the end of the ruler."""
    marks = np.cumsum(ws, dtype=float)
    teeth = (offset + np.arange(len(ws)) / len(ws)) * marks[-1]
    return np.searchsorted(marks, np.minimum(teeth, np.nextafter(marks[-1], 0)), side="right")
