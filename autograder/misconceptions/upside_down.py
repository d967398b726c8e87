"""Wrong versions of the symbolic answers of the notebook *line-measurements*: a scanner mounted upside down."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.checks.upside_down import arguments, by_mounting
from autograder.misconceptions.model import Misconception
from roboloc_reference.lines import transform_line_to_scanner_frame

if TYPE_CHECKING:
    from collections.abc import Callable

_ANSWERS = ("h", "H_x", "H_mount")
_MIRROR = np.diag([-1.0, 1.0])
_WALL = (
    "Imagine a wall to the left of the robot: in which direction, and how far away, does this scanner see it?"
)


def _answer(
    which: int, fault: Callable[[dict[str, float], np.ndarray], np.ndarray]
) -> Callable[[dict[str, float]], np.ndarray]:
    """Return the answer number `which` (h, H_x, H_mount), `fault` applied to that of an upright scanner."""

    def function(values: dict[str, float]) -> np.ndarray:
        h, H_x = transform_line_to_scanner_frame(*arguments(values))
        return fault(values, (h.reshape(2, 1), H_x, by_mounting(values))[which])

    return function


def _mounting_in_the_world(values: dict[str, float], _upright: np.ndarray) -> np.ndarray:
    """Differentiate as if x_cam and y_cam were counted along the axes of the world."""
    alpha = values["alpha"]
    return np.array([[0.0, 0.0, 1.0], [-np.cos(alpha), -np.sin(alpha), 0.0]])


def _by_pose(values: dict[str, float], _upright: np.ndarray) -> np.ndarray:
    """Differentiate by the pose of the robot."""
    return _MIRROR @ transform_line_to_scanner_frame(*arguments(values))[1]


_UPRIGHT = (
    "The answer is that of an upright scanner, on which left and right are not exchanged. Upside down, its y axis "
    "points to the right of the robot."
)
_WHOLE = (
    "The derivative of the distance has changed its sign together with that of the angle. A wall is no farther away "
    "from a scanner that hangs upside down."
)
MISCONCEPTIONS = (
    *(
        Misconception(
            "scanner taken for upright",
            f"upside_down.{answer}",
            _UPRIGHT,
            _WALL,
            _answer(which, lambda _values, upright: upright),
        )
        for which, answer in enumerate(_ANSWERS)
    ),
    *(
        Misconception(
            "distance mirrored too",
            f"upside_down.{answer}",
            _WHOLE,
            _WALL,
            _answer(which, lambda _values, upright: -upright),
        )
        for which, answer in enumerate(_ANSWERS)
    ),
    Misconception(
        "front and back exchanged",
        "upside_down.h",
        "The scanner's x axis is reversed in the place of its y axis: it looks backwards. Upside down, it still looks "
        "ahead; left and right have changed places.",
        _WALL,
        _answer(0, lambda _values, upright: np.array([np.pi - upright[0], upright[1]])),
    ),
    Misconception(
        "mounting in the frame of the world",
        "upside_down.H_mount",
        "x_cam and y_cam are differentiated as if they were counted along the axes of the world. They are counted "
        "along those of the robot, which has turned.",
        "Move the scanner 1 cm forward on a robot that faces along y: which coordinate of the world changes?",
        _answer(2, _mounting_in_the_world),
    ),
    Misconception(
        "derivative by the pose",
        "upside_down.H_mount",
        "The derivative is by x, y and theta, not by the scanner's place and heading on the robot.",
        "By which three symbols does the question ask you to differentiate?",
        _answer(2, _by_pose),
    ),
)
