"""Hidden points of the symbolic answers of *landmark-slam*: a robot that turns first, with its sensor on a mast ahead.

Bearings are drawn between -1.6 and 1.6 and headings so that no angle is near the seam of the arctangent: an answer that
subtracts the heading and one that turns the plane first are the same there. Landmarks lie on all sides of the mast.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.checks.landmark_inputs import LOOK, POSE
from autograder.symbolic import Expression
from roboloc_reference.landmarks import init_landmarks, measurement, predict

if TYPE_CHECKING:
    from numpy.random import Generator

PLACE = ("l_x", "l_y")


def pose(values: dict[str, float]) -> np.ndarray:
    """Return the pose of the robot."""
    return np.array([values["x"], values["y"], values["theta"]])


def mast(values: dict[str, float]) -> np.ndarray:
    """Return the pose of the sensor on its mast."""
    return pose(values) + values["a"] * np.array([np.cos(values["theta"]), np.sin(values["theta"]), 0.0])


def lever(values: dict[str, float]) -> np.ndarray:
    """Return the derivative of the sensor's pose by the robot's."""
    J = np.eye(3)
    J[:2, 2] = values["a"] * np.array([-np.sin(values["theta"]), np.cos(values["theta"])])
    return J


def pose_cov(values: dict[str, float]) -> np.ndarray:
    """Return the covariance of a pose whose three numbers err independently."""
    return np.diag([values[name] ** 2 for name in ("sigma_x", "sigma_y", "sigma_theta")])


def step_cov(values: dict[str, float]) -> np.ndarray:
    """Return the covariance of the errors of a step: along, across, in heading."""
    return np.diag([values[name] ** 2 for name in ("sigma_1", "sigma_2", "sigma_3")])


def turned(values: dict[str, float]) -> np.ndarray:
    """Return the pose after the turn, before the drive."""
    return pose(values) + np.array([0.0, 0.0, values["alpha"]])


def pose_next(values: dict[str, float]) -> np.ndarray:
    """Return the pose after a turn and a drive."""
    return predict(turned(values), np.zeros((3, 3)), [values["d"], 0.0], np.zeros((3, 3)))[0].reshape(3, 1)


def Sigma_next(values: dict[str, float]) -> np.ndarray:
    """Return the covariance after a turn and a drive, of a robot that doubted its heading alone."""
    before = np.diag([0.0, 0.0, values["sigma_theta"] ** 2])
    return predict(turned(values), before, [values["d"], 0.0], step_cov(values))[1]


def seen(values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return mast and landmark as one state, with the derivative of the landmark by the pose of the mast."""
    x, Sigma = init_landmarks([values["beta"], values["r"]], np.zeros((2, 2)), mast(values), np.eye(3))
    return x, Sigma[3:, :3]


def l_seen(values: dict[str, float]) -> np.ndarray:
    """Return where the landmark is that the sensor sees."""
    return seen(values)[0][3:].reshape(2, 1)


def cross(values: dict[str, float]) -> np.ndarray:
    """Return the covariance of that landmark with the pose of the robot."""
    return seen(values)[1] @ lever(values) @ pose_cov(values)


def look(values: dict[str, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return how the sensor sees a landmark, with the derivatives by its own pose and by the landmark."""
    return measurement([*mast(values), values["l_x"], values["l_y"]], 0)


def z_mast(values: dict[str, float]) -> np.ndarray:
    """Return bearing and range from the mast."""
    return look(values)[0].reshape(2, 1)


def Hp_mast(values: dict[str, float]) -> np.ndarray:
    """Return its derivative by the pose of the robot."""
    return look(values)[1] @ lever(values)


def Hl_mast(values: dict[str, float]) -> np.ndarray:
    """Return its derivative by the landmark."""
    return look(values)[2]


def point(rng: Generator) -> dict[str, float]:
    """Draw values of all symbols, the landmark where the sensor sees it at beta and r."""
    direction = float(rng.choice([0.7, 2.2, -0.7, -2.2, 2.4])) + rng.uniform(-0.3, 0.3)
    values = {
        "x": rng.uniform(0.5, 2.0),
        "y": rng.uniform(-2.0, -0.5),
        "beta": float(rng.choice([-1.0, 1.0])) * rng.uniform(0.4, 1.4),
        "r": rng.uniform(1.5, 4.0),
        "a": rng.uniform(0.4, 0.8),
        "d": rng.uniform(0.5, 2.0),
        "alpha": float(rng.choice([-1.0, 1.0])) * rng.uniform(0.3, 0.9),
    }
    values["theta"] = direction - values["beta"]
    names = ("sigma_x", "sigma_y", "sigma_theta", "sigma_1", "sigma_2", "sigma_3")
    values |= dict(zip(names, map(float, rng.uniform(0.2, 0.9, 6)), strict=True))
    place = l_seen(values).ravel()
    return values | {"l_x": float(place[0]), "l_y": float(place[1])}


EXPRESSIONS = (
    Expression(
        "mast.pose_next",
        pose_next,
        point,
        "In which direction does the robot drive, once it has turned?",
        rows=POSE,
    ),
    Expression(
        "mast.Sigma_next",
        Sigma_next,
        point,
        "Two parts: the doubt about the heading, carried by the step, and the errors of the step in the world.",
        rows=POSE,
        columns=POSE,
    ),
    Expression(
        "mast.l_seen", l_seen, point, "Where does the sensor stand, and which way does it look?", rows=PLACE
    ),
    Expression(
        "mast.cross",
        cross,
        point,
        "By how much does the place of the landmark move if the robot is a little elsewhere, or turned a little?",
        rows=PLACE,
        columns=POSE,
    ),
    Expression(
        "mast.z_mast",
        z_mast,
        point,
        "Begin with the difference of two places: which two, in which order?",
        rows=LOOK,
    ),
    Expression(
        "mast.Hp_mast",
        Hp_mast,
        point,
        "A turn of the robot does two things to what the sensor sees.",
        rows=LOOK,
        columns=POSE,
    ),
    Expression(
        "mast.Hl_mast",
        Hl_mast,
        point,
        "Differentiate by the landmark, not by the pose.",
        rows=LOOK,
        columns=PLACE,
    ),
)
