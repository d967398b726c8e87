"""Wrong versions of `systematic_resample`: combs, rulers and pointers, as people write them."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception

_STAGE = "resampling.systematic_resample"


def _taken(marks: np.ndarray, teeth: np.ndarray) -> np.ndarray:
    """Return under which mark each tooth lies; none lies beyond the last one or in a weight of 0."""
    return np.searchsorted(marks, np.minimum(teeth, np.nextafter(marks[-1], 0.0)), side="right")


def _right(ws: np.ndarray, offset: float) -> np.ndarray:
    """Return the right ancestors."""
    marks, m = np.cumsum(ws, dtype=float), len(ws)
    return _taken(marks, (offset + np.arange(m) / m) * marks[-1])


def overwritten(ws: np.ndarray, offset: float) -> np.ndarray:
    """Copy particles over others that are still to be copied."""
    found = np.arange(len(ws))
    for j, i in enumerate(_right(ws, offset)):
        found[j] = found[i]
    return found


def standing_comb(ws: np.ndarray, offset: float) -> np.ndarray:
    """Compare every tooth with the offset."""
    marks = np.cumsum(ws, dtype=float)
    return _taken(marks, np.full(len(ws), offset) * marks[-1])


def one_step_a_tooth(ws: np.ndarray, offset: float) -> np.ndarray:
    """Move the pointer by one place a tooth at most."""
    marks, m = np.cumsum(ws, dtype=float), len(ws)
    i, found = 0, []
    for j in range(m):
        if (offset + j / m) * marks[-1] >= marks[i] and i < m - 1:
            i += 1
        found.append(i)
    return np.array(found)


def from_one(ws: np.ndarray, offset: float) -> np.ndarray:
    """Count the particles from 1."""
    return _right(ws, offset) + 1


def ruler_of_length_one(ws: np.ndarray, offset: float) -> np.ndarray:
    """Take the sum of the weights for 1."""
    m = len(ws)
    marks = np.cumsum(ws, dtype=float)
    return np.minimum(np.searchsorted(marks, offset + np.arange(m) / m, side="right"), m - 1)


def past_the_end(ws: np.ndarray, offset: float) -> np.ndarray:
    """Let the last tooth lie where rounding puts it."""
    m = len(ws)
    return np.searchsorted(np.cumsum(ws), (offset + np.arange(m) / m) * ws.sum(), side="right")


def weight_of_zero(ws: np.ndarray, offset: float) -> np.ndarray:
    """Take the particle before the mark for a tooth on it."""
    marks, m = np.cumsum(ws, dtype=float), len(ws)
    teeth = np.minimum((offset + np.arange(m) / m) * marks[-1], np.nextafter(marks[-1], 0.0))
    return np.searchsorted(marks, teeth, side="left")


def copies(ws: np.ndarray, offset: float) -> np.ndarray:
    """Return how often each particle is taken."""
    return np.bincount(_right(ws, offset), minlength=len(ws))


def offset_divided(ws: np.ndarray, offset: float) -> np.ndarray:
    """Divide the offset by M once more."""
    return _right(ws, offset / len(ws))


def normalised_in_place(ws: np.ndarray, offset: float) -> np.ndarray:
    """Scale the caller's weights, so that the teeth are 1 apart."""
    found = _right(ws, offset)
    ws *= len(ws) / ws.sum()
    return found


def sorted_first(ws: np.ndarray, offset: float) -> np.ndarray:
    """Sort the weights before they are laid end to end."""
    return _right(np.sort(ws), offset)


_WORKED = "Take the weights .5, .3, .2 and the offset .1, and go through your function tooth by tooth."
_LAST = "What does your function return for the last tooth, if it and the last mark are equal?"

MISCONCEPTIONS = (
    Misconception(
        "particles overwritten while copying",
        _STAGE,
        "The copies are written into the list that is copied from. A place that has been filled already no "
        "longer holds its old particle, and a later tooth that wants it gets a copy of another one.",
        _WORKED,
        overwritten,
    ),
    Misconception(
        "comb that stands still",
        _STAGE,
        "Every tooth is compared with the offset itself: u is never moved on. All places are filled with the "
        "one particle under the first tooth.",
        _WORKED,
        standing_comb,
    ),
    Misconception(
        "one step for each tooth",
        _STAGE,
        "The pointer moves on once where it should move on until it has reached the tooth: if in the place of "
        "while. Behind a run of small weights it lags, and particles of little weight are taken.",
        "Can a particle be passed over without being taken? Can two in a row?",
        one_step_a_tooth,
    ),
    Misconception(
        "particles counted from 1",
        _STAGE,
        "The first particle has the number 1, as in the source's pseudo-code. In Python it has the number 0, "
        "and the last number points at nothing.",
        "Which number has the first particle in xs[number]?",
        from_one,
    ),
    Misconception(
        "sum of the weights taken for 1",
        _STAGE,
        "The comb has the length 1, whatever the weights add up to. If they add up to less, all teeth behind "
        "the end go to the last particle; if to more, the last particles are never taken.",
        "Multiply all weights by 3: who is taken now?",
        ruler_of_length_one,
    ),
    Misconception(
        "run past the end",
        _STAGE,
        "With the largest offset rounding puts the last tooth on the end of the ruler, or a digit beyond it "
        "where the sum was taken in another order. The search then returns a particle that does not exist. It "
        "happens once in a billion steps, in the middle of a demonstration.",
        _LAST,
        past_the_end,
    ),
    Misconception(
        "weight of 0 taken",
        _STAGE,
        "A tooth on a mark takes the particle that ends there. With an offset of exactly 0, which a generator "
        "may draw, that is the first particle, even if it weighs nothing.",
        "Who is taken for the weights 0, 1 and an offset of 0?",
        weight_of_zero,
    ),
    Misconception(
        "copies in the place of indices",
        _STAGE,
        "What is returned says how often each particle is taken. Asked for is which particle fills each place.",
        "What does xs[ancestors] do with your numbers?",
        copies,
    ),
    Misconception(
        "offset divided once more",
        _STAGE,
        "The offset comes as a number below 1/M already, and is divided by M again. All teeth then stand near "
        "the beginning of their interval, and the first particles are taken too often.",
        "In which interval is the offset that your function gets?",
        offset_divided,
    ),
    Misconception(
        "weights normalised in place",
        _STAGE,
        "The weights that were handed over are divided by their sum. The caller's array changes, and with it "
        "whatever else is computed from it.",
        "What does ws *= ... or ws /= ... do to the array of the caller?",
        normalised_in_place,
    ),
    Misconception(
        "weights sorted first",
        _STAGE,
        "The weights are sorted before they are added up, and the indices are then places in the sorted list: "
        "they belong to other particles.",
        "Which particle has the index 0 after sorting?",
        sorted_first,
    ),
)
