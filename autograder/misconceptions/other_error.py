"""Wrong versions of the symbolic answers of the notebook *invariant-ekf*."""

from __future__ import annotations

import numpy as np

from autograder.checks.other_error import antenna, carried, numbers
from autograder.misconceptions.model import Misconception


def _unchanged(_values: dict[str, float]) -> np.ndarray:
    return np.eye(3)


def _forwards(values: dict[str, float]) -> np.ndarray:
    return np.linalg.inv(carried(values))


def _pose_back(values: dict[str, float]) -> np.ndarray:
    c, s, p, q = np.cos(values["phi"]), np.sin(values["phi"]), values["p"], values["q"]
    return np.array([[c, s, -c * p - s * q], [-s, c, s * p - c * q], [0.0, 0.0, 1.0]])


def _turned_alone(values: dict[str, float]) -> np.ndarray:
    return carried(values | {"p": 0.0, "q": 0.0})


def _as_a_landmark(values: dict[str, float]) -> np.ndarray:
    return -antenna(values)


def _about_the_robot(values: dict[str, float]) -> np.ndarray:
    return antenna(values | {"x": 0.0, "y": 0.0})


def _at_the_centre(values: dict[str, float]) -> np.ndarray:
    return antenna(values | {"a": 0.0})


def _not_turned(values: dict[str, float]) -> np.ndarray:
    return antenna(values | {"theta": 0.0})


def _of_the_left(values: dict[str, float]) -> np.ndarray:
    a, c, s = values["a"], np.cos(values["theta"]), np.sin(values["theta"])
    return np.array([[c, -s, -a * s], [s, c, a * c]])


def _other_way(values: dict[str, float]) -> np.ndarray:
    return numbers(values).T


def _same_numbers(_values: dict[str, float]) -> np.ndarray:
    return np.eye(3)


_F, _H, _B = "other_error.F_left", "other_error.H_antenna", "other_error.B_left"
_SPOT = "An error of 1 cm ahead, and the robot turns by a quarter to the left on its spot. Where is the error now?"
_ORIGIN = "Turn the world a little about its origin. By how much does the antenna move, and which way?"
_AHEAD = "The robot faces up the page and is 1 cm too far ahead. Which of its three numbers is wrong?"

MISCONCEPTIONS = (
    Misconception(
        "left error taken for unchanged",
        _F,
        "That holds for the error of the chapter, which stands to the left of the pose. This one has the step "
        "between itself and the pose after it.",
        _SPOT,
        _unchanged,
    ),
    Misconception(
        "error carried forwards",
        _F,
        "The adjoint of the step stands here. It carries a twist of the robot's frame after the step into the frame "
        "before it: the wrong way round.",
        _SPOT,
        _forwards,
    ),
    Misconception(
        "matrix of the way back in the place of its adjoint",
        _F,
        "The matrix of a pose carries points. An error is a twist, and what carries twists has another last column.",
        "Put phi = 0 and drive 1 m ahead with an error of heading alone. Along which axis is the robot off then?",
        _pose_back,
    ),
    Misconception(
        "error turned and not shifted",
        _F,
        "The error is turned into the new frame, but one of heading leads aside while the robot drives, and that is "
        "left out.",
        "Put phi = 0 and drive 1 m ahead with an error of heading alone. Is the robot where it should be?",
        _turned_alone,
    ),
    Misconception(
        "antenna with the sign of a landmark",
        _H,
        "A landmark stands in front of the motion with the other sign, since it is seen from the robot. The antenna is "
        "moved along with the robot.",
        "The truth is 1 cm to the right of the estimate. Is the reported x larger or smaller than expected?",
        _as_a_landmark,
    ),
    Misconception(
        "antenna turned about the robot",
        _H,
        "The turn is one about the robot. Here it is one of the whole world, about its origin.",
        _ORIGIN,
        _about_the_robot,
    ),
    Misconception(
        "antenna at the centre of the robot",
        _H,
        "The position of the robot is taken for that of its antenna, which a turn moves by more, or by less.",
        "Where is the antenna of a robot at (2, 1) that faces up the page, with a = 1?",
        _at_the_centre,
    ),
    Misconception(
        "antenna ahead whichever way the robot faces",
        _H,
        "The antenna is put a to the right of the robot on the page. It turns with the robot.",
        "Where is the antenna of a robot at (2, 1) that faces up the page, with a = 1?",
        _not_turned,
    ),
    Misconception(
        "antenna for the left error",
        _H,
        "The motion stands on the right of the estimate here: that is the other error, in which the robot moves in its "
        "own frame.",
        "On which side of the estimate is exp(delta) in this task?",
        _of_the_left,
    ),
    Misconception(
        "axes of the robot turned the other way",
        _B,
        "The transpose carries the world's directions into the robot's frame. The error is given in the robot's frame "
        "already.",
        _AHEAD,
        _other_way,
    ),
    Misconception(
        "left error taken for one of the numbers",
        _B,
        "That is right for a robot that is not turned. An error ahead is one of x only for a robot that faces along x.",
        _AHEAD,
        _same_numbers,
    ),
)
