"""Wrong versions of `bearing_likelihood`: directions, wraps and densities, as people write them."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception

_STAGE = "odometry.bearing_likelihood"


def _wrapped(angle: np.ndarray) -> np.ndarray:
    """Return angles between -pi and pi."""
    return np.angle(np.exp(1j * angle))


def _density(v: np.ndarray, sigma: float) -> np.ndarray:
    """Return the normal density."""
    return np.exp(-0.5 * (v / sigma) ** 2) / (np.sqrt(2 * np.pi) * sigma)


def _seen(xs: np.ndarray, landmark: np.ndarray) -> np.ndarray:
    """Return the bearing of the landmark from each particle, not wrapped."""
    return np.arctan2(landmark[1] - xs[:, 1], landmark[0] - xs[:, 0]) - xs[:, 2]


def not_wrapped(xs: np.ndarray, landmark: np.ndarray, bearing: float, sigma: float) -> np.ndarray:
    """Use the difference as it is."""
    return _density(bearing - _seen(xs, landmark), sigma)


def wrapped_too_early(xs: np.ndarray, landmark: np.ndarray, bearing: float, sigma: float) -> np.ndarray:
    """Wrap the prediction, and not the difference."""
    return _density(_wrapped(bearing) - _wrapped(_seen(xs, landmark)), sigma)


def no_factor(xs: np.ndarray, landmark: np.ndarray, bearing: float, sigma: float) -> np.ndarray:
    """Leave the factor before the exponential out."""
    return np.exp(-0.5 * (_wrapped(bearing - _seen(xs, landmark)) / sigma) ** 2)


def sigma_as_variance(xs: np.ndarray, landmark: np.ndarray, bearing: float, sigma: float) -> np.ndarray:
    """Take sigma for the variance."""
    return _density(_wrapped(bearing - _seen(xs, landmark)), np.sqrt(sigma))


def no_half(xs: np.ndarray, landmark: np.ndarray, bearing: float, sigma: float) -> np.ndarray:
    """Forget the half in the exponent."""
    v = _wrapped(bearing - _seen(xs, landmark))
    return np.exp(-((v / sigma) ** 2)) / (np.sqrt(2 * np.pi) * sigma)


def heading_forgotten(xs: np.ndarray, landmark: np.ndarray, bearing: float, sigma: float) -> np.ndarray:
    """Count the bearing from the x axis."""
    return _density(_wrapped(bearing - _seen(xs, landmark) - xs[:, 2]), sigma)


def heading_added(xs: np.ndarray, landmark: np.ndarray, bearing: float, sigma: float) -> np.ndarray:
    """Add the heading."""
    return _density(_wrapped(bearing - _seen(xs, landmark) - 2 * xs[:, 2]), sigma)


def from_the_landmark(xs: np.ndarray, landmark: np.ndarray, bearing: float, sigma: float) -> np.ndarray:
    """Look from the landmark to the robot."""
    return _density(_wrapped(bearing - _seen(xs, landmark) + np.pi), sigma)


def arguments_exchanged(xs: np.ndarray, landmark: np.ndarray, bearing: float, sigma: float) -> np.ndarray:
    """Hand x and y to the arctangent in the order of the alphabet."""
    direction = np.arctan2(landmark[0] - xs[:, 0], landmark[1] - xs[:, 1])
    return _density(_wrapped(bearing - (direction - xs[:, 2])), sigma)


def quotient(xs: np.ndarray, landmark: np.ndarray, bearing: float, sigma: float) -> np.ndarray:
    """Take the arctangent of a quotient."""
    direction = np.arctan((landmark[1] - xs[:, 1]) / (landmark[0] - xs[:, 0]))
    return _density(_wrapped(bearing - (direction - xs[:, 2])), sigma)


def turned_in_place(xs: np.ndarray, landmark: np.ndarray, bearing: float, sigma: float) -> np.ndarray:
    """Wrap the caller's headings."""
    xs[:, 2] = _wrapped(xs[:, 2] + bearing) - bearing + 2 * np.pi
    return _density(_wrapped(bearing - _seen(xs, landmark)), sigma)


_DIRECTION = "Put a particle at the origin, facing along x, and the landmark at (1, 2). What is the bearing?"
_TABLE = (
    "Of a normal density one knows two numbers by heart: its height at 0, and what is left of it at sigma."
)
_BEHIND = "Take a bearing of 3.1 and a prediction of -3.1, and print every step."

MISCONCEPTIONS = (
    Misconception(
        "innovation not wrapped",
        _STAGE,
        "The difference of two bearings is used as it comes. Straight behind the robot, 3.1 and -3.1 are 5 "
        "degrees apart, and their difference is nearly a whole turn: the best particles get no support at all.",
        _BEHIND,
        not_wrapped,
    ),
    Misconception(
        "wrapped before the difference",
        _STAGE,
        "Bearing and prediction are each wrapped, and then subtracted. The difference of two wrapped angles "
        "can be nearly a whole turn again.",
        _BEHIND,
        wrapped_too_early,
    ),
    Misconception(
        "density without its factor",
        _STAGE,
        "The exponential stands alone. As weights the numbers would serve, since they are normalised later; "
        "as a density, in 1/rad, they do not, and two sensors of unlike sigma could not be compared.",
        _TABLE,
        no_factor,
    ),
    Misconception(
        "sigma taken for the variance",
        _STAGE,
        "The standard deviation stands where its square belongs. For a sigma below 1 the sensor then counts "
        "as worse than it is.",
        "Which unit has the number under the square of the innovation?",
        sigma_as_variance,
    ),
    Misconception(
        "exponent without its half",
        _STAGE,
        "The exponent lacks the factor 1/2, so that the sensor counts as better than it is by the root of 2.",
        _TABLE,
        no_half,
    ),
    Misconception(
        "heading forgotten",
        _STAGE,
        "The direction of the landmark is compared with the bearing, as if every particle looked along the x "
        "axis. A bearing counts from where the robot looks.",
        _DIRECTION,
        heading_forgotten,
    ),
    Misconception(
        "heading added",
        _STAGE,
        "The heading is added to the direction of the landmark. A robot that turns left sees the landmark "
        "move to the right.",
        "Turn the robot a little to the left: to which side does the landmark move?",
        heading_added,
    ),
    Misconception(
        "seen from the landmark",
        _STAGE,
        "The difference is taken as robot less landmark: the direction in which the landmark would see the "
        "robot, half a turn off.",
        _DIRECTION,
        from_the_landmark,
    ),
    Misconception(
        "arctangent of x and y exchanged",
        _STAGE,
        "The two numbers come in the order x, y. arctan2 wants the opposite side first, and the angle is then "
        "counted from the y axis.",
        _DIRECTION,
        arguments_exchanged,
    ),
    Misconception(
        "bearing by a quotient",
        _STAGE,
        "The arctangent of a quotient knows no difference between a landmark and its mirror image through the "
        "robot: of half the directions it is half a turn off.",
        "Put the landmark at (-1, -2), seen from the origin.",
        quotient,
    ),
    Misconception(
        "headings wrapped in place",
        _STAGE,
        "To wrap, the function writes to the headings of the particles that were handed over. The caller's "
        "cloud is changed by being looked at.",
        "Does your function write to xs, or to a new array?",
        turned_in_place,
    ),
)
