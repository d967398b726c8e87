"""Wrong versions of `line_parameters`: the line through the points of a scan as people write it."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception

_STAGE = "extraction.line_parameters"


def _sums(theta: np.ndarray, rho: np.ndarray) -> tuple:
    """Return the mean point, and the sums of squares and products about it."""
    x, y = rho * np.cos(theta), rho * np.sin(theta)
    dx, dy = x - x.mean(), y - y.mean()
    return x.mean(), y.mean(), dx @ dx, dx @ dy, dy @ dy


def _through(alpha: float, x: float, y: float) -> tuple:
    """Return the line with the normal alpha through a point."""
    return alpha, x * np.cos(alpha) + y * np.sin(alpha)


def regression_of_y(theta: np.ndarray, rho: np.ndarray) -> tuple:
    """Fit y = a x + b, and turn it into polar form."""
    x, y, xx, xy, _ = _sums(theta, rho)
    return _through(np.arctan2(xx, -xy), x, y)


def regression_of_x(theta: np.ndarray, rho: np.ndarray) -> tuple:
    """Fit x = a y + b, and turn it into polar form."""
    x, y, _, xy, yy = _sums(theta, rho)
    return _through(np.arctan2(-xy, yy), x, y)


def along_the_wall(theta: np.ndarray, rho: np.ndarray) -> tuple:
    """Take the direction in which the points scatter most."""
    x, y, xx, xy, yy = _sums(theta, rho)
    return _through(0.5 * np.arctan2(2 * xy, xx - yy), x, y)


def not_centred(theta: np.ndarray, rho: np.ndarray) -> tuple:
    """Sum squares and products about the scanner."""
    x, y = rho * np.cos(theta), rho * np.sin(theta)
    alpha = 0.5 * np.arctan2(-2 * (x @ y), y @ y - x @ x)
    return _through(alpha, x.mean(), y.mean())


def not_halved(theta: np.ndarray, rho: np.ndarray) -> tuple:
    """Take the double angle for the angle."""
    x, y, xx, xy, yy = _sums(theta, rho)
    return _through(np.arctan2(-2 * xy, yy - xx), x, y)


def quotient(theta: np.ndarray, rho: np.ndarray) -> tuple:
    """Take the arctangent of a quotient, which does not know in which half of the turn it is."""
    x, y, xx, xy, yy = _sums(theta, rho)
    gap = yy - xx
    return _through(0.5 * np.arctan(-2 * xy / (gap or 1e-300)), x, y)


def mixed_sign(theta: np.ndarray, rho: np.ndarray) -> tuple:
    """Take the sum of products with the wrong sign."""
    x, y, xx, xy, yy = _sums(theta, rho)
    return _through(0.5 * np.arctan2(2 * xy, yy - xx), x, y)


def mean_bearing(theta: np.ndarray, rho: np.ndarray) -> tuple:
    """Take the mean direction of the beams for that of the normal."""
    x, y, *_ = _sums(theta, rho)
    return _through(np.angle(np.exp(1j * theta).sum()), x, y)


def mean_range(theta: np.ndarray, rho: np.ndarray) -> tuple:
    """Take the mean range for the distance."""
    x, y, xx, xy, yy = _sums(theta, rho)
    alpha = 0.5 * np.arctan2(-2 * xy, yy - xx)
    return alpha + np.pi * (x * np.cos(alpha) + y * np.sin(alpha) < 0), rho.mean()


def shortest_range(theta: np.ndarray, rho: np.ndarray) -> tuple:
    """Take the shortest range for the distance."""
    x, y, xx, xy, yy = _sums(theta, rho)
    alpha = 0.5 * np.arctan2(-2 * xy, yy - xx)
    return alpha + np.pi * (x * np.cos(alpha) + y * np.sin(alpha) < 0), rho.min()


def ranges_overwritten(theta: np.ndarray, rho: np.ndarray) -> tuple:
    """Compute the points in the caller's arrays."""
    x, y, xx, xy, yy = _sums(theta, rho)
    rho *= np.cos(theta)
    return _through(0.5 * np.arctan2(-2 * xy, yy - xx), x, y)


_CROSS = "Draw the points and the normal for a wall that leans a little: does the normal cross it at a right angle?"
_FOOT = "Compare with a short piece of wall far to the side of the foot of its perpendicular."
MISCONCEPTIONS = (
    Misconception(
        "errors measured along y",
        _STAGE,
        "This is the regression y = a x + b: it makes the sum of the squared errors along y small, not across the "
        "wall, and a wall straight ahead has no such form. The two agree only for points without any error.",
        "Which distance do the two conditions of the derivation hold small?",
        regression_of_y,
    ),
    Misconception(
        "errors measured along x",
        _STAGE,
        "This is the regression x = a y + b: it makes the sum of the squared errors along x small, not across the "
        "wall, and a wall beside the robot has no such form. The two agree only for points without any error.",
        "Which distance do the two conditions of the derivation hold small?",
        regression_of_x,
    ),
    Misconception(
        "direction along the wall",
        _STAGE,
        "alpha is the direction in which the points scatter most: that of the wall. A line of this course is named "
        "by the direction of its normal. The cost is as large as it can be there, not as small.",
        _CROSS,
        along_the_wall,
    ),
    Misconception(
        "sums about the scanner",
        _STAGE,
        "The squares and products are summed about the origin, where the scanner is, and not about the mean point. "
        "How far away the wall is then changes its direction.",
        "What does the scatter look like once the best r for the direction has been put into the cost?",
        not_centred,
    ),
    Misconception(
        "angle not halved",
        _STAGE,
        "The arctangent gives twice the angle, and twice the angle is returned.",
        "Of which angle are the sine and cosine that the derivation finds?",
        not_halved,
    ),
    Misconception(
        "arctangent of a quotient",
        _STAGE,
        "arctan of a quotient cannot tell both signs changed from neither: half of all walls get the direction in "
        "which the scatter is largest, and a wall at 45 degrees divides by zero.",
        "Try a wall ahead and a wall to the left. Which function takes the two numbers apart?",
        quotient,
    ),
    Misconception(
        "sign of the mixed sum",
        _STAGE,
        "The sum of the products has the wrong sign: the line leans to the wrong side, as in a mirror.",
        _CROSS,
        mixed_sign,
    ),
    Misconception(
        "mean of the bearings",
        _STAGE,
        "alpha is the mean direction of the beams. That is where the wall was looked at, not where its normal points; "
        "the two agree only where the foot of the perpendicular is in the middle of the beams.",
        _FOOT,
        mean_bearing,
    ),
    Misconception(
        "mean of the ranges",
        _STAGE,
        "r is the mean of the ranges. A beam that meets the wall at an angle is longer than the perpendicular, all "
        "of them are, and so is their mean.",
        _FOOT,
        mean_range,
    ),
    Misconception(
        "shortest range",
        _STAGE,
        "r is the shortest range. The foot of the perpendicular need not be among the points that were seen, and a "
        "single beam has the error of a single beam.",
        _FOOT,
        shortest_range,
    ),
    Misconception(
        "ranges turned into x in place",
        _STAGE,
        "The points are computed in the caller's array of ranges, which then holds ranges no longer. In Python an "
        "array that is handed over is not copied.",
        "An array that is handed over is not copied; which operation makes a new one?",
        ranges_overwritten,
    ),
)
