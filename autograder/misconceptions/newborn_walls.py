"""Wrong versions of the symbolic answers of the notebook *growing-the-map*: two walls that enter in one scan."""

from __future__ import annotations

from typing import TYPE_CHECKING

from autograder.checks.newborn_walls import by_pose, foot, of_two, prior, with_pose
from autograder.misconceptions.model import Misconception

if TYPE_CHECKING:
    import numpy as np


def _in_the_robots_frame(values: dict[str, float]) -> np.ndarray:
    return foot({**values, "x": 0.0, "y": 0.0, "theta": 0.0})


def _from_the_robot(values: dict[str, float]) -> np.ndarray:
    point = foot({**values, "x": 0.0, "y": 0.0})
    point[:, 0] += values["x"], values["y"]
    return point


def _heading_forgotten(values: dict[str, float]) -> np.ndarray:
    return foot({**values, "theta": 0.0})


def _jacobian_alone(values: dict[str, float]) -> np.ndarray:
    return by_pose(values, values["alpha"])


def _place_alone(values: dict[str, float]) -> np.ndarray:
    return with_pose({**values, "x": 0.0, "y": 0.0})


def _nothing(values: dict[str, float]) -> np.ndarray:
    return 0 * of_two(values)


def _not_turned_with_it(values: dict[str, float]) -> np.ndarray:
    return of_two({**values, "x": 0.0, "y": 0.0})


def _of_one(values: dict[str, float]) -> np.ndarray:
    first = by_pose(values, values["alpha"])
    return first @ prior(values) @ first.T


_F, _C, _T = "newborn_walls.foot_new", "newborn_walls.Sigma_cross", "newborn_walls.Sigma_12"
MISCONCEPTIONS = (
    Misconception(
        "foot in the frame of the robot",
        _F,
        "This is the point of the wall that is nearest to the robot, in the frame of the robot.",
        "Nearest to which point, and in which frame?",
        _in_the_robots_frame,
    ),
    Misconception(
        "point nearest to the robot",
        _F,
        "This is the point of the wall that is nearest to the robot. The foot is the one that is nearest to the origin "
        "of the world.",
        "Draw a wall, a robot that is not at the origin, and both perpendiculars.",
        _from_the_robot,
    ),
    Misconception(
        "heading of the robot forgotten",
        _F,
        "The normal is taken to have the direction in the world that it has for the robot.",
        "The robot has turned to the left, and sees a wall straight ahead: where is its normal in the world?",
        _heading_forgotten,
    ),
    Misconception(
        "derivative for a covariance",
        _C,
        "This is the derivative of the line by the pose. The covariance is what comes out if the pose is uncertain by "
        "p and s, and has to depend on them.",
        "What must the covariance be if the pose is certain?",
        _jacobian_alone,
    ),
    Misconception(
        "turn of the heading without a lever",
        _C,
        "The distance is taken not to depend on the heading. It does not for a robot at the origin; elsewhere an error "
        "of the heading turns the wall about the robot, and its distance from the origin changes.",
        "Turn a wall about a robot far from the origin.",
        _place_alone,
    ),
    Misconception(
        "newborn walls independent",
        _T,
        "The two walls are taken to have nothing to do with each other. But both were placed from the same uncertain "
        "pose: if that is off, both are.",
        "The heading is off by 0.1 rad: by how much is each of the two angles off?",
        _nothing,
    ),
    Misconception(
        "two walls without levers",
        _T,
        "The levers are left out: the distances are taken not to depend on the heading.",
        "Turn both walls about the robot: do their distances from the origin change?",
        _not_turned_with_it,
    ),
    Misconception(
        "covariance of the first wall",
        _T,
        "This is what the pose contributes to the covariance of the first wall with itself.",
        "Which of your entries depends on the direction of the second wall?",
        _of_one,
    ),
)
