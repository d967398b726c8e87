"""Wrong versions of `fit_line`: the names of a line and its covariance, as people write them."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.extraction import fit_line

_STAGE = "extraction.fit_line"


def _half(alpha: float) -> float:
    """Return the name of a direction that half an arctangent gives, without the half turn."""
    return (alpha + np.pi / 2) % np.pi - np.pi / 2


def negative_distance(theta: np.ndarray, rho: np.ndarray, var_theta: float, var_rho: float) -> tuple:
    """Return the line as half the arctangent gives it, with its own covariance."""
    alpha, r, C = fit_line(theta, rho, var_theta, var_rho)
    side = 1.0 if np.cos(alpha) > 0 else -1.0
    return _half(alpha), side * r, C * np.array([[1.0, side], [side, 1.0]])


def absolute_distance(theta: np.ndarray, rho: np.ndarray, var_theta: float, var_rho: float) -> tuple:
    """Take the absolute value of r, and keep the angle."""
    alpha, r, C = fit_line(theta, rho, var_theta, var_rho)
    return _half(alpha), r, C


def covariance_of_the_other_name(
    theta: np.ndarray, rho: np.ndarray, var_theta: float, var_rho: float
) -> tuple:
    """Give the line its other name, and keep the covariance of the first."""
    alpha, r, C = fit_line(theta, rho, var_theta, var_rho)
    side = 1.0 if np.cos(alpha) > 0 else -1.0
    return alpha, r, C * np.array([[1.0, side], [side, 1.0]])


def beyond_the_turn(theta: np.ndarray, rho: np.ndarray, var_theta: float, var_rho: float) -> tuple:
    """Add half a turn where r was negative, and leave it at that."""
    alpha, r, C = fit_line(theta, rho, var_theta, var_rho)
    return (alpha + 2 * np.pi if alpha < -np.pi / 2 else alpha), r, C


def positive_turn(theta: np.ndarray, rho: np.ndarray, var_theta: float, var_rho: float) -> tuple:
    """Wrap to [0, 2 pi)."""
    alpha, r, C = fit_line(theta, rho, var_theta, var_rho)
    return alpha % (2 * np.pi), r, C


def variances_exchanged(theta: np.ndarray, rho: np.ndarray, var_theta: float, var_rho: float) -> tuple:
    """Use the variance of a range for the bearings, and the other way round."""
    return fit_line(theta, rho, var_rho, var_theta)


def variances_squared(theta: np.ndarray, rho: np.ndarray, var_theta: float, var_rho: float) -> tuple:
    """Square the variances as if they were standard deviations."""
    return fit_line(theta, rho, var_theta**2, var_rho**2)


def bearings_certain(theta: np.ndarray, rho: np.ndarray, var_theta: float, var_rho: float) -> tuple:
    """Leave the errors of the bearings out."""
    return fit_line(theta, rho, 0 * var_theta, var_rho)


def correlation_dropped(theta: np.ndarray, rho: np.ndarray, var_theta: float, var_rho: float) -> tuple:
    """Keep the two variances alone."""
    alpha, r, C = fit_line(theta, rho, var_theta, var_rho)
    return alpha, r, C * np.eye(2)


def divided_once_more(theta: np.ndarray, rho: np.ndarray, var_theta: float, var_rho: float) -> tuple:
    """Divide the sum over the beams by their number."""
    alpha, r, C = fit_line(theta, rho, var_theta, var_rho)
    return alpha, r, C / len(theta)


def distance_first(theta: np.ndarray, rho: np.ndarray, var_theta: float, var_rho: float) -> tuple:
    """Put the variance of r before that of alpha."""
    alpha, r, C = fit_line(theta, rho, var_theta, var_rho)
    return alpha, r, C[::-1, ::-1]


def bearings_sorted(theta: np.ndarray, rho: np.ndarray, var_theta: float, var_rho: float) -> tuple:
    """Sort the caller's bearings."""
    result = fit_line(theta, rho, var_theta, var_rho)
    theta.sort()
    return result


_SIDE = "Take one point of the wall and test it: is x cos(alpha) + y sin(alpha) equal to r?"
_RANGE = "Print alpha for walls all around the scanner: from where to where does it go?"
_UNITS = "Which unit does each entry of C have, and which the numbers it is made of?"
MISCONCEPTIONS = (
    Misconception(
        "fit with r below 0",
        _STAGE,
        "Half the arctangent gives a normal that points ahead, whatever the wall: of a wall behind the scanner r "
        "comes out negative. No scan reports such a line, and no prediction meets it.",
        "Which of the two names of a line has r >= 0?",
        negative_distance,
    ),
    Misconception(
        "fit with the bare absolute value",
        _STAGE,
        "r is made positive and the angle stays. That is another line, at the same distance on the opposite side of "
        "the scanner.",
        _SIDE,
        absolute_distance,
    ),
    Misconception(
        "covariance of the other name",
        _STAGE,
        "The line is given its name with r >= 0, and C is that of the name before. A larger old r is a smaller new "
        "one, so one of the numbers in C changes its sign; both variances stay.",
        "alpha and the old r grow together. What do alpha and the new r do?",
        covariance_of_the_other_name,
    ),
    Misconception(
        "half a turn beyond the turn",
        _STAGE,
        "Half a turn is added where r was negative, and alpha is left where that leads, beyond pi. Compared with a "
        "prediction in [-pi, pi) the difference is a whole turn.",
        _RANGE,
        beyond_the_turn,
    ),
    Misconception(
        "fit with angles from 0 to 2 pi",
        _STAGE,
        "alpha is wrapped to [0, 2 pi). The interval of this course is [-pi, pi).",
        _RANGE,
        positive_turn,
    ),
    Misconception(
        "variances exchanged",
        _STAGE,
        "The variance of a range is used for the bearings, and that of a bearing for the ranges. Both are small "
        "positive numbers, so nothing else looks wrong.",
        "In which order do the two variances come among the arguments?",
        variances_exchanged,
    ),
    Misconception(
        "variances squared",
        _STAGE,
        "var_theta and var_rho are squared as if they were standard deviations. They are variances already; the "
        "filter would be far too sure of every line.",
        _UNITS,
        variances_squared,
    ),
    Misconception(
        "bearings without error",
        _STAGE,
        "The errors of the bearings are left out of C. Over a beam of several metres a tenth of a degree is as much "
        "as the error of the range, wherever the beam meets the wall at an angle.",
        "Which of the four arguments does your function not use?",
        bearings_certain,
    ),
    Misconception(
        "correlation dropped",
        _STAGE,
        "C has the two variances and zeros beside them. A line that is turned a little is also, at the foot of its "
        "perpendicular, nearer or farther; the filter needs to know that the two errors are one.",
        "Fit a wall far to one side a hundred times and plot r over alpha.",
        correlation_dropped,
    ),
    Misconception(
        "divided by N once more",
        _STAGE,
        "The sum over the beams is divided by their number, as in a mean of squares. That more beams help is in "
        "their derivatives already, each of which is small.",
        "What is the variance of a sum of independent numbers?",
        divided_once_more,
    ),
    Misconception(
        "variance of r first",
        _STAGE,
        "C has the variance of r before that of alpha. A line of this course is alpha, r, in this order.",
        _UNITS,
        distance_first,
    ),
    Misconception(
        "the caller's bearings sorted",
        _STAGE,
        "The function sorts the bearings that it was given, in place. The caller's ranges are in the old order and "
        "belong to other beams then.",
        "An array that is handed over is not copied; which operation makes a new one?",
        bearings_sorted,
    ),
)
