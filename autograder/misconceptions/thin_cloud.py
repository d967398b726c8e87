"""Wrong versions of the symbolic answers of the notebook *particle-filter*."""

from __future__ import annotations

import numpy as np

from autograder.checks.thin_cloud import share
from autograder.misconceptions.model import Misconception

_TWO, _OFF = "thin_cloud.n_two", "thin_cloud.share_off"
_TRY = "Put numbers in: M = 4, k = 2, and a so large that the others do not matter."


def _kinds(values: dict[str, float]) -> tuple[float, float, float]:
    M, k, a = (values[name] for name in "Mka")
    return M, k, a


def large_alone(values: dict[str, float]) -> float:
    """Count the large weights."""
    return _kinds(values)[1]


def added_to_all(values: dict[str, float]) -> float:
    """Let all M weigh one, and k of them a beside that."""
    M, k, a = _kinds(values)
    return (M + k * a) ** 2 / (M + k * a * a)


def not_squared(values: dict[str, float]) -> float:
    """Leave the weight in the sum of squares unsquared."""
    M, k, a = _kinds(values)
    return (k * a + M - k) ** 2 / (k * a + M - k)


def in_the_middle(values: dict[str, float]) -> float:
    """Forget that the observation is off."""
    return float(share(values["s"] ** 2, values["q"] ** 2, 0.0))


def inverted(values: dict[str, float]) -> float:
    """Turn the quotient round."""
    return float(1.0 / share(values["s"] ** 2, values["q"] ** 2, values["z"]))


def weights_alone(values: dict[str, float]) -> float:
    """Return the mean weight."""
    s2, q2, z = values["s"] ** 2, values["q"] ** 2, values["z"]
    return float(np.sqrt(q2 / (s2 + q2)) * np.exp(-z * z / (2.0 * (s2 + q2))))


MISCONCEPTIONS = (
    Misconception(
        "large weights alone",
        _TWO,
        "Only the k large weights are counted. The others count for little "
        "each, but there may be many of them.",
        _TRY,
        large_alone,
    ),
    Misconception(
        "others counted twice",
        _TWO,
        "All M particles are given the weight 1, and k of them a in addition. "
        "The k are a times as heavy as the others, not a heavier.",
        _TRY,
        added_to_all,
    ),
    Misconception(
        "large weight not squared",
        _TWO,
        "In the sum of the squares a stands as it is. The squares are what "
        "makes the measure see uneven weights at all.",
        _TRY,
        not_squared,
    ),
    Misconception(
        "observation in the middle",
        _OFF,
        "The answer is that of an observation in the middle of the cloud. "
        "Off the middle, the weights come from the cloud's flank, and fewer particles carry them.",
        "Let z be ten times s: how many particles are near it?",
        in_the_middle,
    ),
    Misconception(
        "quotient turned round",
        _OFF,
        "The mean of the squares is divided by the square of the mean. A share is between 0 and 1.",
        "Can more than all particles be left?",
        inverted,
    ),
    Misconception(
        "mean weight alone",
        _OFF,
        "This is the mean of the weights, which says how well the cloud explains "
        "what is seen. How uneven they are is another question.",
        "If all weights are 0.1, how many particles are left in effect?",
        weights_alone,
    ),
)
