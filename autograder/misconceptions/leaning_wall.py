"""Wrong versions of the symbolic answers of the notebook *fit-a-line*: three beams on a wall straight ahead."""

from __future__ import annotations

import numpy as np

from autograder.checks.leaning_wall import by_left, fan, fan_covariance
from autograder.misconceptions.model import Misconception


def _numbers(values: dict[str, float]) -> tuple[float, float, float, float]:
    """Return h, and the sums of squares and products of the bent wall about its mean point."""
    h, b, e = (values[name] for name in "hbe")
    return h, 2 * e * e / 3, e * b, 2 * b * b


def _line(alpha: float, x: float) -> np.ndarray:
    return np.array([[alpha], [x * np.cos(alpha)]])


def _not_halved(values: dict[str, float]) -> np.ndarray:
    h, xx, xy, yy = _numbers(values)
    return _line(np.arctan2(-2 * xy, yy - xx), h + values["e"] / 3)


def _regression(values: dict[str, float]) -> np.ndarray:
    h, _, xy, yy = _numbers(values)
    return _line(np.arctan2(-xy, yy), h + values["e"] / 3)


def _middle(values: dict[str, float]) -> np.ndarray:
    h, xx, xy, yy = _numbers(values)
    return _line(0.5 * np.arctan2(-2 * xy, yy - xx), h)


def _one_arctangent(values: dict[str, float]) -> np.ndarray:
    h, xx, xy, yy = _numbers(values)
    return _line(0.5 * np.arctan(-2 * xy / (yy - xx)), h + values["e"] / 3)


def _whole_length(values: dict[str, float]) -> np.ndarray:
    return by_left(values) / np.cos(values["beta"])


def _to_the_left(values: dict[str, float]) -> np.ndarray:
    return by_left(values) * np.array([[-1.0], [1.0]])


def _as_bearing(values: dict[str, float]) -> np.ndarray:
    return -by_left(values) * values["h"] * np.tan(values["beta"]) / np.cos(values["beta"])


def _not_squared(values: dict[str, float]) -> np.ndarray:
    return fan_covariance({**values, **{k: values[k] ** 0.5 for k in ("sigma_rho", "sigma_theta")}})


def _ranges_alone(values: dict[str, float]) -> np.ndarray:
    return fan_covariance({**values, "sigma_theta": 0.0})


def _outer_beams_alone(values: dict[str, float]) -> np.ndarray:
    middle = np.zeros((2, 2))
    middle[1, 1] = values["sigma_rho"] ** 2 / len(fan(values)[0]) ** 2
    return fan_covariance(values) - middle


_ONE, _TWO, _THREE = "leaning_wall.line_e", "leaning_wall.by_left", "leaning_wall.C_fan"
MISCONCEPTIONS = (
    Misconception(
        "double angle of the bent wall",
        _ONE,
        "The two sums give twice the angle, and twice the angle is returned.",
        "For a small e, by how much does the wall lean? Compare with a wall through the outer points.",
        _not_halved,
    ),
    Misconception(
        "regression through the bent wall",
        _ONE,
        "This is the line x = a y + b with the least squared errors along x. For a small e it is nearly the best "
        "line, for a large one it is not.",
        "Which distance is to be small?",
        _regression,
    ),
    Misconception(
        "bent wall through its middle point",
        _ONE,
        "The direction is right, and the line is led through the middle one of the three points. The best line goes "
        "through their mean, which has moved with e.",
        "Where is the mean of the three points?",
        _middle,
    ),
    Misconception(
        "one arctangent for the bent wall",
        _ONE,
        "The arctangent of a quotient does not know both signs. When e grows so large that the points are deeper "
        "than wide, it gives the direction of the wall for that of its normal.",
        "Put in a large e: where does the normal point?",
        _one_arctangent,
    ),
    Misconception(
        "beam taken to meet the wall straight",
        _TWO,
        "The error of the range is taken to go across the wall in full length. It goes along the beam, which meets "
        "the wall at an angle.",
        "The left beam is 1 cm longer: how far behind the wall does it end?",
        _whole_length,
    ),
    Misconception(
        "wall leans to the wrong side",
        _TWO,
        "The sign of the derivative of alpha is the wrong one: with its left end farther away, the wall is taken to "
        "lean the other way.",
        "The left end of a wall ahead is a little farther away: to which side does its normal point?",
        _to_the_left,
    ),
    Misconception(
        "derivative by the bearing",
        _TWO,
        "This is the derivative by the bearing of the left beam, not by its range.",
        "By which of the six numbers does the question ask you to differentiate?",
        _as_bearing,
    ),
    Misconception(
        "standard deviations not squared",
        _THREE,
        "sigma_rho and sigma_theta stand in C as they are. They are standard deviations, and a covariance is made "
        "of variances.",
        "Which unit must the entry of r have?",
        _not_squared,
    ),
    Misconception(
        "fan with certain bearings",
        _THREE,
        "The errors of the bearings are left out. Those of the outer beams move their points across the wall.",
        "Three ranges and three bearings have errors: how many terms are there?",
        _ranges_alone,
    ),
    Misconception(
        "middle beam left out",
        _THREE,
        "The middle beam is left out. It has no lever, so that the direction does not depend on it, but the distance "
        "does.",
        "The middle range is 3 cm too long: where does the best line go?",
        _outer_beams_alone,
    ),
)
