"""Hidden points of the symbolic answers of the notebook *line-measurements*: a scanner mounted upside down."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.checks.line_inputs import line_seen_from, mounting, pose
from autograder.symbolic import Expression
from roboloc_reference.lines import transform_line_to_scanner_frame

if TYPE_CHECKING:
    from numpy.random import Generator

LINE, POSE, MOUNTING = ("alpha", "r"), ("x", "y", "theta"), ("x_cam", "y_cam", "theta_cam")
_UPSIDE_DOWN = np.diag([-1.0, 1.0])


def arguments(values: dict[str, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return line, pose and mounting of the values of the symbols."""
    return tuple(np.array([values[name] for name in names]) for names in (LINE, POSE, MOUNTING))


def by_mounting(values: dict[str, float]) -> np.ndarray:
    """Return the derivative of an upright scanner's line by its place and heading on the robot."""
    beta = values["alpha"] - values["theta"]
    return np.array([[0.0, 0.0, -1.0], [-np.cos(beta), -np.sin(beta), 0.0]])


def _h(values: dict[str, float]) -> np.ndarray:
    return _UPSIDE_DOWN @ transform_line_to_scanner_frame(*arguments(values))[0].reshape(2, 1)


def _point(rng: Generator) -> dict[str, float]:
    """Draw a line, a pose and a mounting; the scanner has not crossed the line, and sees it inside one turn."""
    x, tf = pose(rng), mounting(rng)
    numbers = [*line_seen_from(rng, x, tf), *x, *tf]
    return {name: float(number) for name, number in zip(LINE + POSE + MOUNTING, numbers, strict=True)}


EXPRESSIONS = (
    Expression(
        "upside_down.h",
        _h,
        _point,
        "A point to the left of the robot is to the right of this scanner. On which side is the wall's normal?",
        rows=LINE,
    ),
    Expression(
        "upside_down.H_x",
        lambda values: _UPSIDE_DOWN @ transform_line_to_scanner_frame(*arguments(values))[1],
        _point,
        "Differentiate your h by x, y and theta, in that order.",
        rows=LINE,
        columns=POSE,
    ),
    Expression(
        "upside_down.H_mount",
        lambda values: _UPSIDE_DOWN @ by_mounting(values),
        _point,
        "Differentiate your h by x_cam, y_cam and theta_cam, in that order.",
        rows=LINE,
        columns=MOUNTING,
    ),
)
