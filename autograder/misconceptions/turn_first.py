"""Wrong versions of the symbolic answers of the notebook *ekf-and-ukf*."""

from __future__ import annotations

import numpy as np

from autograder.checks.turn_first import from_ahead, turned_first
from autograder.misconceptions.model import Misconception
from roboloc_reference.velocity import jacobians, range_bearing


def _of_the_page(values: dict[str, float]) -> np.ndarray:
    pose = [0.0, 0.0, values["theta"]]
    return jacobians(pose, [values["v"], values["omega"], values["gamma"]], values["dt"])[1]


def _start_not_turned(values: dict[str, float]) -> np.ndarray:
    W = turned_first(values)
    W[:, :2] = _of_the_page(values)[:, :2]
    return W


def _heading_alone(values: dict[str, float]) -> np.ndarray:
    return turned_first(values) * np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0]])


def _printed(values: dict[str, float]) -> np.ndarray:
    W = turned_first(values)
    W[:2, 1] = -W[:2, 0] / values["omega"]
    return W


def _limit_first(values: dict[str, float]) -> np.ndarray:
    W = turned_first(values)
    W[:2, 1] = 0.0
    return W


def _limit_of_the_page(values: dict[str, float]) -> np.ndarray:
    return _of_the_page(values)


def _gamma_at_rest(values: dict[str, float]) -> np.ndarray:
    return _heading_alone(values)


def _sensor_in_the_middle(values: dict[str, float]) -> np.ndarray:
    return range_bearing([values[name] for name in ("x", "y", "theta")], [values["m_x"], values["m_y"]])[1]


def _arm_forgotten(values: dict[str, float]) -> np.ndarray:
    H = from_ahead(values)
    H[:, 2] = -1.0, 0.0
    return H


def _divided_twice(values: dict[str, float]) -> np.ndarray:
    a, theta = values["a"], values["theta"]
    d = np.hypot(
        values["m_x"] - values["x"] - a * np.cos(theta), values["m_y"] - values["y"] - a * np.sin(theta)
    )
    return from_ahead(values) / np.array([[1.0], [d]])


_W, _W0, _H = "turn_first.W_first", "turn_first.W_straight", "turn_first.H_ahead"
MISCONCEPTIONS = (
    Misconception(
        "turn at the end after all",
        _W,
        "This is W of the robot that turns at the end of its arc. Here it turns first.",
        "With omega = 0 and a quarter turn by gamma: to which side does the robot drive?",
        _of_the_page,
    ),
    Misconception(
        "columns of v and omega from the old heading",
        _W,
        "The column of gamma is right; the other two start from the heading before the turn.",
        "In which direction does the robot look when its arc begins?",
        _start_not_turned,
    ),
    Misconception(
        "gamma changes the heading alone",
        _W,
        "The column of gamma has only its last entry. If the robot turns first, all of its way turns with it.",
        "Turn 0.1 rad more before a drive of 1 m: where does it end?",
        _heading_alone,
    ),
    Misconception(
        "second column of W as with a fixed end",
        _W,
        "omega stands in two places of the motion, and only one was differentiated; v is lost besides.",
        "Let SymPy differentiate the motion, and compare.",
        _printed,
    ),
    Misconception(
        "limit before the derivative",
        _W0,
        "omega was set to 0 first, and the derivative by it taken then. The limit of the derivative is not 0.",
        "Which of the two comes first, limit or derivative?",
        _limit_first,
    ),
    Misconception(
        "limit of the robot that turns last",
        _W0,
        "This is the limit for the robot that turns at the end of its way.",
        "In which direction does the robot drive, if it turns first?",
        _limit_of_the_page,
    ),
    Misconception(
        "limit without the way that turns with gamma",
        _W0,
        "The column of gamma has only its last entry. The straight way turns with the robot.",
        "Turn 0.1 rad more before a drive of 1 m: where does it end?",
        _gamma_at_rest,
    ),
    Misconception(
        "sensor in the middle of the robot",
        _H,
        "This is H of a sensor in the middle of the robot, and not of one that stands in front of it.",
        "Where does the sensor stand, and where the robot?",
        _sensor_in_the_middle,
    ),
    Misconception(
        "arm of the sensor left out of the derivative",
        _H,
        "The place of the sensor is right, but its way on a circle is missing when the robot turns: the last column is "
        "that of a sensor which turns on the spot.",
        "The robot turns on the spot: does the sensor stay where it is?",
        _arm_forgotten,
    ),
    Misconception(
        "row of the range divided twice",
        _H,
        "The row of the range is divided by the squared distance. A metre towards the landmark takes a metre off.",
        "Which unit does each entry of the second row have?",
        _divided_twice,
    ),
)
