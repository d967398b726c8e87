"""Wrong versions of the symbolic answers of the notebook *comparison*."""

from __future__ import annotations

import numpy as np

from autograder.checks.false_claims import inside, nees, variance
from autograder.misconceptions.model import Misconception


def _no_bias(values: dict[str, float]) -> np.ndarray:
    return nees(values | {"b_x": 0.0, "b_y": 0.0})


def _bias_not_squared(values: dict[str, float]) -> np.ndarray:
    return _no_bias(values) + values["b_x"] / values["s"] ** 2 + values["b_y"] / values["t"] ** 2


def _truth_by_itself(_values: dict[str, float]) -> np.ndarray:
    return np.array(2.0)


def _upside_down(values: dict[str, float]) -> np.ndarray:
    a, c, b_x, b_y, s, t = (values[name] for name in ("a", "c", "b_x", "b_y", "s", "t"))
    return np.array(s**2 / (a**2 + b_x**2) + t**2 / (c**2 + b_y**2))


def _cross_term(values: dict[str, float]) -> np.ndarray:
    return nees(values) - 2 * values["rho"] * values["a"] * values["c"] / (values["s"] * values["t"])


def _factor_not_squared(values: dict[str, float]) -> np.ndarray:
    return inside(values | {"k": values["k"] ** 0.5})


def _too_large(values: dict[str, float]) -> np.ndarray:
    return inside(values | {"k": 1.0 / values["k"]})


def _area(values: dict[str, float]) -> np.ndarray:
    return np.array(values["p"] / values["k"] ** 2)


def _outside(values: dict[str, float]) -> np.ndarray:
    return 1.0 - inside(values)


def _independent(values: dict[str, float]) -> np.ndarray:
    return variance(values | {"rho": 0.0})


def _sum(values: dict[str, float]) -> np.ndarray:
    return variance(values | {"rho": -values["rho"]})


def _one_run(values: dict[str, float]) -> np.ndarray:
    return variance(values | {"R": 1.0})


def _deviation(values: dict[str, float]) -> np.ndarray:
    return variance(values) ** 0.5


_NEES, _INSIDE, _VARIANCE = "claims.E_nees", "claims.p_inside", "claims.var_difference"
_MEANS = "What is the mean of the square of a number with mean b and deviation a?"
_LIMITS = "Put k = 1, and let k grow without bound. What should come out?"
_EQUAL = "Let both filters make the same errors in every run. What is the variance of the difference?"

MISCONCEPTIONS = (
    Misconception(
        "bias left out of the mean square",
        _NEES,
        "Only the scatter counts here. A filter that is wrong by the same in every run is wrong all the "
        "same.",
        _MEANS,
        _no_bias,
    ),
    Misconception(
        "bias not squared",
        _NEES,
        "The bias is added as it is, in another unit than the variance beside it.",
        _MEANS,
        _bias_not_squared,
    ),
    Misconception(
        "expected square of an honest filter",
        _NEES,
        "The number of coordinates is what an honest filter gets. This one claims something else than is "
        "true.",
        "Whose covariance is inverted, and whose is the scatter?",
        _truth_by_itself,
    ),
    Misconception(
        "claim divided by truth",
        _NEES,
        "Truth and claim are exchanged, so that a cautious filter seems overconfident.",
        "Is your answer larger or smaller for a filter that claims too little?",
        _upside_down,
    ),
    Misconception(
        "correlation of the errors counted",
        _NEES,
        "The errors are correlated, but the claim is not. The product of both errors has to have a factor "
        "in the square for it to count.",
        "Which terms does the square have if the claimed covariance is diagonal?",
        _cross_term,
    ),
    Misconception(
        "factor of the ellipse not squared",
        _INSIDE,
        "The factor is one of lengths; the distance in the exponent is a square.",
        _LIMITS,
        _factor_not_squared,
    ),
    Misconception(
        "ellipse too large instead of too small",
        _INSIDE,
        "The factor acts the wrong way round: more would be inside an ellipse that is too small.",
        _LIMITS,
        _too_large,
    ),
    Misconception(
        "probability in proportion to the area",
        _INSIDE,
        "The density is not the same everywhere: what lies near the middle is denser.",
        "Is that right for a k slightly below 1 and p = 0.99?",
        _area,
    ),
    Misconception(
        "probability of the outside",
        _INSIDE,
        "That is the share of the misses: what lies beyond the ellipse, and not within it.",
        _LIMITS,
        _outside,
    ),
    Misconception(
        "pairs taken for independent",
        _VARIANCE,
        "The correlation is left out, so that the pairing gains nothing.",
        _EQUAL,
        _independent,
    ),
    Misconception(
        "variance of the sum",
        _VARIANCE,
        "What is common to both is counted twice instead of cancelled.",
        _EQUAL,
        _sum,
    ),
    Misconception(
        "one run alone",
        _VARIANCE,
        "That is how the difference scatters from one run to the next. The mean of R of them scatters less.",
        "What happens to your answer as R grows?",
        _one_run,
    ),
    Misconception(
        "deviation for variance",
        _VARIANCE,
        "A root has been taken of it. Deviations do not add up, so what is compared is a variance.",
        "In which unit is your answer, if the scores are in metres?",
        _deviation,
    ),
)
