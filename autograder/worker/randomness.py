"""The random generators that all of a program shares, `numpy.random.seed` and `random.seed`, as plain data."""

from __future__ import annotations

import random
from typing import Any

import numpy as np

DRAWN = -1  # the place of both among the arguments that a call has changed
LENGTH = 624  # words of a Mersenne Twister's state


def states() -> list[Any]:
    """Return the state of both: it can be compared, and crosses the border of the sandbox."""
    name, words, *rest = np.random.get_state()  # noqa: NPY002  (the shared one is what this is about)
    return [name, words.tobytes(), *rest, list(random.getstate()[1]), random.getstate()[2]]


def put(said: Any) -> None:
    """Set the state of both.

    Parameters
    ----------
    said : object
        From :func:`states`, or anything at all.

    Raises
    ------
    ValueError
        If it is no state: a place outside the buffer would be read, wherever that is.

    Examples
    --------
    >>> before = states()
    >>> first = random.random(), np.random.rand()
    >>> put(before)
    >>> (random.random(), np.random.rand()) == first
    True
    """
    kinds = (str, bytes, int, int, float, list)
    if (
        type(said) is not list
        or len(said) != 7
        or any(type(x) is not k for x, k in zip(said, kinds, strict=False))
    ):
        raise ValueError("expected the state of the shared generators")
    name, words, place, has_gauss, gauss, python, pending = said
    numbers = all(type(n) is int and 0 <= n < 2**32 for n in python[:-1])
    if (
        name != "MT19937"
        or len(words) != 4 * LENGTH
        or not 0 <= place <= LENGTH
        or has_gauss not in (0, 1)
        or not numbers
        or len(python) != LENGTH + 1
        or type(python[-1]) is not int
        or not 0 <= python[-1] <= LENGTH
        or not (pending is None or type(pending) is float)
    ):
        raise ValueError("expected the state of the shared generators")
    np.random.set_state((name, np.frombuffer(words, np.uint32), place, has_gauss, gauss))  # noqa: NPY002
    random.setstate((random.getstate()[0], tuple(python), pending))
