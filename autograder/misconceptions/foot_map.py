"""Wrong versions of the symbolic answers of the notebook *line-slam*: a map that holds the foot of each line."""

from __future__ import annotations

import numpy as np

from autograder.checks.foot_map import by_line, polar, position, unseen
from autograder.misconceptions.model import Misconception


def _not_chained(values: dict[str, float]) -> np.ndarray:
    return by_line(values)


def _angle_not_divided(values: dict[str, float]) -> np.ndarray:
    r = np.hypot(values["a"], values["b"])
    return by_line(values) @ (polar(values) * [[r], [1.0]])


def _from_the_robot(values: dict[str, float]) -> np.ndarray:
    return polar(values)


def _wall_left_behind(values: dict[str, float]) -> np.ndarray:
    return unseen(values) * np.array([[1.0], [1.0], [1.0], [0.0], [0.0]])


def _foot_as_a_point(values: dict[str, float]) -> np.ndarray:
    N = unseen(values)
    N[3:, :2] = np.eye(2)
    return N


def _about_the_robot(values: dict[str, float]) -> np.ndarray:
    N = unseen(values)
    N[:2, 2] = 0.0
    return N


def _not_inverted(values: dict[str, float]) -> np.ndarray:
    return values["q"] ** 2 * np.linalg.inv(position(values))


def _independent(values: dict[str, float]) -> np.ndarray:
    return np.diag(np.diag(position(values)))


def _rows_inverted_alone(values: dict[str, float]) -> np.ndarray:
    c, s = np.cos(values["phi"]), np.sin(values["phi"])
    return values["q"] * np.linalg.inv(np.array([[1.0, 0.0], [c, s]]))


_H, _N, _S = "foot_map.H_foot", "foot_map.N_foot", "foot_map.Sigma_xy"
MISCONCEPTIONS = (
    Misconception(
        "derivative by alpha and r",
        _H,
        "This is the derivative by alpha and r. The state holds a and b, of which alpha and r are functions.",
        "Nudge a by a little: by how much does alpha change?",
        _not_chained,
    ),
    Misconception(
        "angle not divided by the distance",
        _H,
        "The angle is taken to change by as much as the foot moves across. A foot that is far away has to move farther "
        "for the same angle.",
        "Which unit must the derivative of alpha by a have?",
        _angle_not_divided,
    ),
    Misconception(
        "robot taken to be at the origin",
        _H,
        "This is what a robot at the origin of the world would see: the place of the robot is left out.",
        "Turn a wall about the origin by a little: does its distance from a robot elsewhere change?",
        _from_the_robot,
    ),
    Misconception(
        "wall left behind",
        _N,
        "The robot is shifted and turned, and the wall stays where it is. That can be seen: only if all of the world "
        "moves with the robot, nothing changes for its scanner.",
        "Multiply the derivative of what is seen, by pose and foot, by your columns: what comes out?",
        _wall_left_behind,
    ),
    Misconception(
        "foot shifted like a point",
        _N,
        "The foot is shifted by as much as the wall. A wall that is shifted along itself is the same wall, and its "
        "foot, the point nearest to the origin, has not moved.",
        "Draw a wall and its foot, and shift the wall along itself.",
        _foot_as_a_point,
    ),
    Misconception(
        "turn about the robot",
        _N,
        "The walls are turned about the origin of the world, and the robot about itself: that is not one motion.",
        "Where does a robot at (1, 0) go if the world is turned about its origin?",
        _about_the_robot,
    ),
    Misconception(
        "information in the place of a covariance",
        _S,
        "The matrix grows with what is known: it is an information matrix in units of q, not a covariance.",
        "What must happen to the covariance as the walls become parallel?",
        _not_inverted,
    ),
    Misconception(
        "x and y taken to be independent",
        _S,
        "The variances are right, and the covariance of x and y is taken to be 0. It is so at a right angle alone.",
        "Along which direction is the position known worst? Is that one of the axes?",
        _independent,
    ),
    Misconception(
        "rows inverted once",
        _S,
        "The rows are inverted, and the result multiplied by q. A linear function of errors has a covariance with the "
        "matrix on both sides.",
        "A covariance is symmetric: is yours?",
        _rows_inverted_alone,
    ),
)
