"""Hidden points of the symbolic answers of the notebook *growing-the-map*: two walls that enter in one scan."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from autograder.symbolic import Expression
from roboloc_reference.new_lines import line_in_world

if TYPE_CHECKING:
    from numpy.random import Generator

POSE, LINE = ("x", "y", "theta"), ("alpha", "r")


def foot(values: dict[str, float]) -> np.ndarray:
    """Return the foot of a line that a scanner at the robot's centre sees."""
    alpha = values["alpha_z"] + values["theta"]
    n = np.array([math.cos(alpha), math.sin(alpha)])
    return ((values["r_z"] + n @ [values["x"], values["y"]]) * n).reshape(2, 1)


def by_pose(values: dict[str, float], alpha: float) -> np.ndarray:
    """Return the derivative by the pose of a line with the angle alpha in the world, r not negative."""
    x = np.array([values["x"], values["y"], 0.0])
    return line_in_world(np.array([alpha, 100.0]), x, np.zeros(3))[1]


def prior(values: dict[str, float]) -> np.ndarray:
    """Return the covariance of the pose."""
    return np.diag([values["p"], values["p"], values["s"]])


def with_pose(values: dict[str, float]) -> np.ndarray:
    """Return the covariance of the new line with the pose."""
    return by_pose(values, values["alpha"]) @ prior(values)


def of_two(values: dict[str, float]) -> np.ndarray:
    """Return the covariance of two lines that enter in one scan."""
    first, second = (by_pose(values, values[name]) for name in ("alpha", "gamma"))
    return first @ prior(values) @ second.T


def _foot_point(rng: Generator) -> dict[str, float]:
    names = ("x", "y", "theta", "alpha_z", "r_z")
    low, high = (0.5, 0.5, 0.2, 0.3, 1.0), (2.0, 2.0, 0.6, 0.7, 3.0)
    return dict(zip(names, map(float, rng.uniform(low, high)), strict=True))


def _two_point(rng: Generator) -> dict[str, float]:
    names = ("x", "y", "alpha", "gamma", "p", "s")
    low, high = (0.5, 0.5, 0.2, 1.8, 0.2, 1.2), (2.0, 2.0, 1.2, 2.8, 0.8, 2.0)
    return dict(zip(names, map(float, rng.uniform(low, high)), strict=True))


EXPRESSIONS = (
    Expression(
        "newborn_walls.foot_new",
        foot,
        _foot_point,
        "In which direction of the world is the normal? How far along it is the robot already?",
        rows=("a", "b"),
    ),
    Expression(
        "newborn_walls.Sigma_cross",
        with_pose,
        _two_point,
        "Write the error of the line as a product with the error of the pose; then take the covariance with it.",
        rows=LINE,
        columns=POSE,
    ),
    Expression(
        "newborn_walls.Sigma_12",
        of_two,
        _two_point,
        "Both lines have an error that comes from the pose. What have the errors of the scan to do with each other?",
        rows=("alpha of the first", "r of the first"),
        columns=("alpha of the second", "r of the second"),
    ),
)
