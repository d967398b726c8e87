"""Wrong versions of `normalize_line_parameters`: a fault of the sources (ERRATA A4), and what people write."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.lines import normalize_line_parameters

_STAGE = "lines.normalize_line_parameters"


def bare_absolute_value(h: np.ndarray, Hx: np.ndarray) -> tuple:
    """Take the absolute value of r and leave the rest (ERRATA A4)."""
    kept, slope = normalize_line_parameters(np.array([h[0], abs(h[1])]), Hx)
    return kept, slope


def angle_not_shifted(h: np.ndarray, Hx: np.ndarray) -> tuple:
    """Flip r and its derivative, and keep the angle."""
    _, slope = normalize_line_parameters(h, Hx)
    return normalize_line_parameters(np.array([h[0], abs(h[1])]), Hx)[0], slope


def row_not_flipped(h: np.ndarray, Hx: np.ndarray) -> tuple:
    """Flip the line, and keep its derivative."""
    return normalize_line_parameters(h, Hx)[0], np.array(Hx)


def both_rows_flipped(h: np.ndarray, Hx: np.ndarray) -> tuple:
    """Change the sign of the whole derivative."""
    return normalize_line_parameters(h, Hx)[0], -Hx if h[1] < 0 else np.array(Hx)


def wrong_row_flipped(h: np.ndarray, Hx: np.ndarray) -> tuple:
    """Change the sign of the derivative of alpha."""
    slope = np.array(Hx)
    if h[1] < 0:
        slope[0] = -slope[0]
    return normalize_line_parameters(h, Hx)[0], slope


def not_wrapped(h: np.ndarray, Hx: np.ndarray) -> tuple:
    """Flip the line, and leave its angle in whatever turn it is."""
    line, slope = normalize_line_parameters(h, Hx)
    return np.array([h[0] + np.pi if h[1] < 0 else h[0], line[1]]), slope


def wrapped_once(h: np.ndarray, Hx: np.ndarray) -> tuple:
    """Take off or add one turn at most."""
    line, slope = normalize_line_parameters(h, Hx)
    alpha = h[0] + np.pi if h[1] < 0 else h[0]
    if alpha >= np.pi:
        alpha = alpha - 2 * np.pi
    elif alpha < -np.pi:
        alpha = alpha + 2 * np.pi
    return np.array([alpha, line[1]]), slope


def wrapped_to_positive(h: np.ndarray, Hx: np.ndarray) -> tuple:
    """Wrap to [0, 2 pi)."""
    line, slope = normalize_line_parameters(h, Hx)
    return np.array([line[0] % (2 * np.pi), line[1]]), slope


def only_wrapped(h: np.ndarray, Hx: np.ndarray) -> tuple:
    """Wrap the angle, and let r be negative."""
    line, _ = normalize_line_parameters(np.array([h[0], abs(h[1])]), Hx)
    return np.array([line[0], h[1]]), np.array(Hx)


def multiplied_by_sign(h: np.ndarray, Hx: np.ndarray) -> tuple:
    """Multiply row 2 by the sign of r, which is 0 at r = 0."""
    line, slope = normalize_line_parameters(h, Hx)
    slope[1] = np.sign(h[1]) * Hx[1]
    return line, slope


def derivative_overwritten(h: np.ndarray, Hx: np.ndarray) -> tuple:
    """Change the sign in the caller's matrix."""
    line, slope = normalize_line_parameters(h, Hx)
    Hx[...] = slope
    return line, Hx


_SIDE = "Take one point of the wall and test it: is x cos(alpha) + y sin(alpha) equal to r, before and after?"
_RANGE = "Print alpha for a line that is far outside one turn, on either side."
_ARRAYS = "An array that is handed over is not copied; which operation makes a new one?"
MISCONCEPTIONS = (
    Misconception(
        "bare absolute value",
        _STAGE,
        "For r < 0 the sign of r is dropped and nothing else is done. That is another line, at the same "
        "distance on the opposite side of the scanner. A worked solution that is passed around says just "
        "this.",
        _SIDE,
        bare_absolute_value,
    ),
    Misconception(
        "angle not shifted",
        _STAGE,
        "r and its derivative change sign where r < 0, but the angle stays: the line jumps to the other side "
        "of the scanner.",
        _SIDE,
        angle_not_shifted,
    ),
    Misconception(
        "derivative of r not flipped",
        _STAGE,
        "The line is turned to its other side, and its derivative is that of before. The filter then "
        "corrects the pose in the wrong direction at every line that the robot has crossed.",
        "By how much does the new r change when the old one grows by 0.01?",
        row_not_flipped,
    ),
    Misconception(
        "whole derivative flipped",
        _STAGE,
        "Both rows of Hx change sign where r < 0. The angle only gains a constant.",
        "What is the derivative of a constant?",
        both_rows_flipped,
    ),
    Misconception(
        "derivative of alpha flipped",
        _STAGE,
        "The row of alpha changes sign where r < 0, and the row of r does not: the wrong row of the two.",
        "Row 1 of Hx belongs to component 1 of h, row 2 to component 2.",
        wrong_row_flipped,
    ),
    Misconception(
        "angle not wrapped",
        _STAGE,
        "The angle is left in whatever turn it comes. Predictions are compared with observations in [-pi, "
        "pi), and a difference of a whole turn would be taken for an error.",
        _RANGE,
        not_wrapped,
    ),
    Misconception(
        "angle wrapped by one turn at most",
        _STAGE,
        "One turn is taken off or added. A heading is never wrapped in this course, so that a robot that has "
        "turned often leaves several turns in the angle.",
        _RANGE,
        wrapped_once,
    ),
    Misconception(
        "angle from 0 to 2 pi",
        _STAGE,
        "The angle is wrapped to [0, 2 pi). The interval of this course is [-pi, pi), as the observations "
        "have it.",
        _RANGE,
        wrapped_to_positive,
    ),
    Misconception(
        "r left negative",
        _STAGE,
        "The angle is wrapped, and r stays negative. A scan reports a line with r >= 0, so the prediction of "
        "a line that the robot has crossed never meets its observation.",
        "Which of the two names of a line does a scan report?",
        only_wrapped,
    ),
    Misconception(
        "sign of 0",
        _STAGE,
        "The derivative of r is multiplied by the sign of r, which is 0 where r is exactly 0: the row "
        "vanishes, and a line through the scanner tells the filter nothing about the distance.",
        "What does np.sign return at 0, and what should be left of Hx there?",
        multiplied_by_sign,
    ),
    Misconception(
        "the caller's derivative overwritten",
        _STAGE,
        "The function changes the sign in the matrix it was given. In Python an array that is handed over is "
        "not copied: called twice with the same matrix, it flips it back.",
        _ARRAYS,
        derivative_overwritten,
    ),
)
