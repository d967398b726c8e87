"""Wrong versions of `velocity.range_bearing`: the printed H of the source (ERRATA R2), and what people write."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.velocity import range_bearing

_STAGE = "velocity.range_bearing"


def divided_twice(x: np.ndarray, landmark: np.ndarray) -> tuple:
    """Divide the second row by the range once more."""
    z, H = range_bearing(x, landmark)
    return z, H / np.array([[1.0], [z[1]]])


def divided_once(x: np.ndarray, landmark: np.ndarray) -> tuple:
    """Divide the first row by the range instead of its square."""
    z, H = range_bearing(x, landmark)
    H[0, :2] *= z[1]
    return z, H


def not_wrapped(x: np.ndarray, landmark: np.ndarray) -> tuple:
    """Subtract the heading and leave it at that."""
    z, H = range_bearing(x, landmark)
    z[0] = np.arctan2(landmark[1] - x[1], landmark[0] - x[0]) - x[2]
    return z, H


def positive_turn(x: np.ndarray, landmark: np.ndarray) -> tuple:
    """Wrap to [0, 2 pi)."""
    z, H = range_bearing(x, landmark)
    z[0] %= 2 * np.pi
    return z, H


def in_the_world(x: np.ndarray, landmark: np.ndarray) -> tuple:
    """Return the direction in the world."""
    z, H = range_bearing(x, landmark)
    z[0] = np.arctan2(landmark[1] - x[1], landmark[0] - x[0])
    return z, H


def arguments_of_the_arctangent(x: np.ndarray, landmark: np.ndarray) -> tuple:
    """Exchange the arguments of the arctangent."""
    z, H = range_bearing(x, landmark)
    away = np.pi / 2 - z[0] - 2 * x[2]
    z[0] = np.arctan2(np.sin(away), np.cos(away))
    return z, H


def seen_from_the_landmark(x: np.ndarray, landmark: np.ndarray) -> tuple:
    """Take pose minus landmark."""
    z, H = range_bearing(x, landmark)
    z[0] -= np.pi if z[0] > 0 else -np.pi
    return z, H


def range_first(x: np.ndarray, landmark: np.ndarray) -> tuple:
    """Put range before bearing."""
    z, H = range_bearing(x, landmark)
    return z[::-1], H[::-1]


def by_the_landmark(x: np.ndarray, landmark: np.ndarray) -> tuple:
    """Differentiate by the place of the landmark."""
    z, H = range_bearing(x, landmark)
    return z, H * np.array([-1.0, -1.0, 1.0])


def heading_ignored(x: np.ndarray, landmark: np.ndarray) -> tuple:
    """Let the bearing not follow the heading."""
    z, H = range_bearing(x, landmark)
    return z, H * np.array([1.0, 1.0, 0.0])


_STEP = (
    "The landmark is straight ahead. The robot moves 1 cm towards it: which of z changes, and by how much?"
)
_TURN = "Turn the robot on the spot, a whole turn in eight steps, and print the bearing each time."
MISCONCEPTIONS = (
    Misconception(
        "second row of H divided twice",
        _STAGE,
        "The source prints both rows over the squared range. A metre towards the landmark takes a metre off the "
        "range, however far it is.",
        _STEP,
        divided_twice,
    ),
    Misconception(
        "first row of H divided once",
        _STAGE,
        "The row of the bearing is divided by the range and not by its square: the differences have a unit, which "
        "must go too.",
        "Move the robot 1 cm sideways, at 1 m from the landmark and at 2 m: by how much does the bearing change?",
        divided_once,
    ),
    Misconception(
        "bearing not wrapped",
        _STAGE,
        "A direction less a heading may be beyond half a turn, and it is left there. An innovation is then wrong by a "
        "whole turn.",
        _TURN,
        not_wrapped,
    ),
    Misconception(
        "bearing from 0 to 2 pi",
        _STAGE,
        "The bearing is wrapped to [0, 2 pi). The interval of this course is [-pi, pi).",
        _TURN,
        positive_turn,
    ),
    Misconception(
        "direction in the world",
        _STAGE,
        "The bearing is the direction of the landmark on the map. The robot measures from where it looks.",
        _TURN,
        in_the_world,
    ),
    Misconception(
        "arguments of the arctangent exchanged",
        _STAGE,
        "The arctangent gets x before y. It then measures from the y axis, and the other way round.",
        "What is np.arctan2(1, 0), and where is a landmark with this direction?",
        arguments_of_the_arctangent,
    ),
    Misconception(
        "robot seen from the landmark",
        _STAGE,
        "The difference is pose minus landmark: the direction in which the landmark would see the robot.",
        "A landmark straight ahead: which bearing do you get?",
        seen_from_the_landmark,
    ),
    Misconception(
        "range before bearing",
        _STAGE,
        "z and the rows of H begin with the range. In this course the bearing comes first.",
        "In which order does the notebook list z?",
        range_first,
    ),
    Misconception(
        "derivative by the landmark",
        _STAGE,
        "The first two columns are those by the place of the landmark, which have the opposite sign.",
        _STEP,
        by_the_landmark,
    ),
    Misconception(
        "bearing that does not follow the heading",
        _STAGE,
        "The column of the heading is 0. If it were, no landmark would ever correct a heading directly.",
        "The robot turns to the left by 0.1 rad: what happens to all bearings?",
        heading_ignored,
    ),
)
