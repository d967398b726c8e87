"""Wrong versions of the symbolic answers of the notebook *split-and-merge*: one line through a wall with a step."""

from __future__ import annotations

import numpy as np

from autograder.checks.wall_with_a_step import tilt
from autograder.misconceptions.model import Misconception


def _regression(values: dict[str, float]) -> np.ndarray:
    return np.array(np.arctan(0.75 * values["s"] / values["L"]))


def _not_halved(values: dict[str, float]) -> np.ndarray:
    return np.array(2 * tilt(values))


def _chord(values: dict[str, float]) -> np.ndarray:
    return np.array(np.arctan(0.5 * values["s"] / values["L"]))


def _in_between(values: dict[str, float]) -> np.ndarray:
    return np.array(values["s"] / 2)


def _at_the_ends(values: dict[str, float]) -> np.ndarray:
    angle = tilt(values)
    return np.array(abs(values["L"] * np.sin(angle) - values["s"] / 2 * np.cos(angle)))


def _whole_step(values: dict[str, float]) -> np.ndarray:
    return np.array(values["s"] * np.cos(tilt(values)))


_TILT, _FAR = "wall_with_a_step.tilt", "wall_with_a_step.far"
MISCONCEPTIONS = (
    Misconception(
        "regression through the step",
        _TILT,
        "This is the slope of y = a + b x: the errors are measured at a right angle to the walls, not to the "
        "line. For a "
        "low step the two are nearly the same.",
        "Which scatter does the regression leave out?",
        _regression,
    ),
    Misconception(
        "double angle of the step",
        _TILT,
        "The arctangent gives twice the angle of the line, and twice the angle is returned.",
        "Of which angle are the sine and cosine that the fit finds?",
        _not_halved,
    ),
    Misconception(
        "from end to end",
        _TILT,
        "This is the direction from one end to the other. The line of least squares listens to all points, and most of "
        "them are not at the ends.",
        "Where is a point of the first wall, seen from the line through both ends? And are most of them on "
        "one side of it?",
        _chord,
    ),
    Misconception(
        "half the step",
        _FAR,
        "Half of the step would be right for a line in between that is parallel to both walls. The line of "
        "least squares "
        "leans, and distances are measured across it.",
        "Which angle lies between the step and the perpendicular of the line?",
        _in_between,
    ),
    Misconception(
        "distance of the ends",
        _FAR,
        "This is how far the two ends are from the line. The line leans towards them; others are farther.",
        "Draw the line through the middle of a low step: where is it nearest to the walls, and where farthest?",
        _at_the_ends,
    ),
    Misconception(
        "the whole step",
        _FAR,
        "This is how far the two sides of the step are from one another, across the line. The line goes between them.",
        "Through which point does the line go?",
        _whole_step,
    ),
)
