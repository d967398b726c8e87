"""Wrong versions of `slam.line_in_world`: of a line that is put into the world."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.new_lines import line_in_world

_STAGE = "slam.line_in_world"


def heading_not_added(z: np.ndarray, x: np.ndarray, tf: np.ndarray) -> tuple:
    """Leave the robot's heading out of everything."""
    return line_in_world(z, x * [1, 1, 0], tf)


def mounting_left_out(z: np.ndarray, x: np.ndarray, tf: np.ndarray) -> tuple:
    """Take the scanner to be at the robot's centre and to look ahead."""
    return line_in_world(z, x, 0 * tf)


def mounting_taken_for_world(z: np.ndarray, x: np.ndarray, tf: np.ndarray) -> tuple:
    """Add the mounting to the place of the robot without turning it."""
    where = np.array([x[0] + tf[0], x[1] + tf[1], x[2]])
    return line_in_world(z, where, tf * [0, 0, 1])


def left_negative(z: np.ndarray, x: np.ndarray, tf: np.ndarray) -> tuple:
    """Leave r negative where the origin is on the far side."""
    line, by_pose, by_z = line_in_world(z, x, tf)
    side = by_z[1, 1]
    alpha = (line[0] + (side < 0) * np.pi + np.pi) % (2 * np.pi) - np.pi
    flip = np.array([[1.0], [side]])
    return np.array([alpha, side * line[1]]), flip * by_pose, flip * by_z


def bare_absolute_value(z: np.ndarray, x: np.ndarray, tf: np.ndarray) -> tuple:
    """Take the absolute value of r, and leave the rest."""
    line, by_pose, by_z = line_in_world(z, x, tf)
    side = by_z[1, 1]
    alpha = (line[0] + (side < 0) * np.pi + np.pi) % (2 * np.pi) - np.pi
    flip = np.array([[1.0], [side]])
    return np.array([alpha, line[1]]), flip * by_pose, flip * by_z


def derivatives_not_flipped(z: np.ndarray, x: np.ndarray, tf: np.ndarray) -> tuple:
    """Normalise the line, and keep the derivatives from before."""
    line, by_pose, by_z = line_in_world(z, x, tf)
    flip = np.array([[1.0], [by_z[1, 1]]])
    return line, flip * by_pose, flip * by_z


def heading_without_lever(z: np.ndarray, x: np.ndarray, tf: np.ndarray) -> tuple:
    """Take r not to depend on the heading."""
    line, by_pose, by_z = line_in_world(z, x, tf)
    by_pose[1, 2] = 0.0
    return line, by_pose, by_z


def observation_without_lever(z: np.ndarray, x: np.ndarray, tf: np.ndarray) -> tuple:
    """Take the line to have the covariance of the observation."""
    line, by_pose, by_z = line_in_world(z, x, tf)
    by_z[1, 0] = 0.0
    return line, by_pose, by_z


def derivative_of_the_prediction(z: np.ndarray, x: np.ndarray, tf: np.ndarray) -> tuple:
    """Change the sign of the derivative by the pose, as it is in the prediction."""
    line, by_pose, by_z = line_in_world(z, x, tf)
    return line, -by_pose, by_z


def not_wrapped(z: np.ndarray, x: np.ndarray, tf: np.ndarray) -> tuple:
    """Leave alpha in whatever turn it comes."""
    line, by_pose, by_z = line_in_world(z, x, tf)
    alpha = z[0] + tf[2] + x[2] + np.pi * (by_z[1, 1] < 0)
    return np.array([alpha, line[1]]), by_pose, by_z


def observation_overwritten(z: np.ndarray, x: np.ndarray, tf: np.ndarray) -> tuple:
    """Write the line into the caller's observation."""
    line, by_pose, by_z = line_in_world(z, x, tf)
    z[:] = line
    return line, by_pose, by_z


_DRAW = "Draw the robot away from the origin, a wall, and the perpendiculars from both."
_SIDE = "Take one point of the wall and test it: is x cos(alpha) + y sin(alpha) equal to your r?"
_NUDGE = "Change one number a little, and compare how your own line moves with the column."
MISCONCEPTIONS = (
    Misconception(
        "heading left out",
        _STAGE,
        "The heading of the robot is not used: the line is placed as if the robot faced along the x axis.",
        _DRAW,
        heading_not_added,
    ),
    Misconception(
        "mounting left out",
        _STAGE,
        "The line is placed as if the scanner were at the robot's centre and looked ahead.",
        "Which of the arguments does your function not use?",
        mounting_left_out,
    ),
    Misconception(
        "mounting added in the frame of the world",
        _STAGE,
        "The place of the scanner is added to that of the robot without being turned. The mounting is given in the "
        "frame of the robot.",
        "The robot has turned by a quarter, and its scanner is in front: where is that in the world?",
        mounting_taken_for_world,
    ),
    Misconception(
        "new line with r below 0",
        _STAGE,
        "Where the origin of the world is on the far side of the wall, r comes out negative and is left so. The same "
        "wall would enter the map under two names.",
        _DRAW,
        left_negative,
    ),
    Misconception(
        "new line with the bare absolute value",
        _STAGE,
        "Where r comes out negative its sign is dropped, and nothing else is done. That is another line, on the "
        "opposite side of the origin.",
        _SIDE,
        bare_absolute_value,
    ),
    Misconception(
        "derivatives of the other name",
        _STAGE,
        "The line is normalised, and its derivatives are those of before.",
        "Where the sign of r changes, what becomes of the rate at which r changes?",
        derivatives_not_flipped,
    ),
    Misconception(
        "r taken not to follow the heading",
        _STAGE,
        "The derivative of r by the heading is 0. When the heading changes, the line that is seen turns about the "
        "robot, and its distance from the origin changes.",
        _NUDGE,
        heading_without_lever,
    ),
    Misconception(
        "r taken not to follow the angle that is seen",
        _STAGE,
        "The derivative by the observation is the identity, or nearly. An error of the angle turns the line about the "
        "scanner, not about the origin.",
        _NUDGE,
        observation_without_lever,
    ),
    Misconception(
        "sign of the prediction",
        _STAGE,
        "The derivative by the pose has the signs that it has in the prediction. There the wall is given and the robot "
        "moves away from it; here the observation is given and the wall moves with the robot.",
        _NUDGE,
        derivative_of_the_prediction,
    ),
    Misconception(
        "new angle not wrapped",
        _STAGE,
        "Angles are added, and the sum is left outside one turn. A map holds each line under one name.",
        "Print the sum of the angles for a robot that looks back.",
        not_wrapped,
    ),
    Misconception(
        "the caller's observation overwritten",
        _STAGE,
        "The line is written into z. The caller still needs the observation.",
        "An array that is handed over is not copied; which operation makes a new one?",
        observation_overwritten,
    ),
)
