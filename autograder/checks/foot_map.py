"""Hidden points of the symbolic answers of the notebook *line-slam*: a map that holds the foot of each line."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from autograder.symbolic import Expression

if TYPE_CHECKING:
    from numpy.random import Generator

STATE = ("x", "y", "theta", "a", "b")


def by_line(values: dict[str, float]) -> np.ndarray:
    """Return the derivative of the line that is seen by its alpha and r, for a scanner at the robot's centre."""
    x, y, a, b = (values[name] for name in ("x", "y", "a", "b"))
    return np.array([[1.0, 0.0], [(x * b - y * a) / math.hypot(a, b), 1.0]])


def polar(values: dict[str, float]) -> np.ndarray:
    """Return the derivative of alpha and r by the foot."""
    a, b = values["a"], values["b"]
    r = math.hypot(a, b)
    return np.array([[-b / r**2, a / r**2], [a / r, b / r]])


def by_foot(values: dict[str, float]) -> np.ndarray:
    """Return the derivative of the line that is seen by its foot."""
    return by_line(values) @ polar(values)


def unseen(values: dict[str, float]) -> np.ndarray:
    """Return how pose and foot change with a shift of the world along x, along y, and with a turn of it."""
    x, y, a, b = (values[name] for name in ("x", "y", "a", "b"))
    along = np.outer([a, b], [a, b]) / (a * a + b * b)
    shifts = np.vstack([np.eye(2), np.zeros((1, 2)), along])
    return np.column_stack([shifts, [-y, x, 1.0, -b, a]])


def position(values: dict[str, float]) -> np.ndarray:
    """Return the covariance of a position that is known from two distances alone."""
    normals = np.array([[1.0, 0.0], [math.cos(values["phi"]), math.sin(values["phi"])]])
    return values["q"] * np.linalg.inv(normals.T @ normals)


def _map_point(rng: Generator) -> dict[str, float]:
    values = rng.uniform(0.5, 2.5, 4) * rng.choice([-1, 1], 4)
    return dict(zip(("x", "y", "a", "b"), map(float, values), strict=True)) | {
        "theta": float(rng.uniform(0.3, 1.2))
    }


def _angle_point(rng: Generator) -> dict[str, float]:
    return {
        "phi": float(rng.choice([rng.uniform(0.4, 1.2), rng.uniform(1.9, 2.7)])),
        "q": float(rng.uniform(0.3, 0.8)),
    }


EXPRESSIONS = (
    Expression(
        "foot_map.H_foot",
        by_foot,
        _map_point,
        "alpha and r are functions of the foot: what is each of their derivatives by a and by b?",
        rows=("alpha", "r"),
        columns=("a", "b"),
    ),
    Expression(
        "foot_map.N_foot",
        unseen,
        _map_point,
        "Multiply by your derivative of what is seen: what must come out, column by column?",
        rows=STATE,
        columns=("shift along x", "shift along y", "turn"),
    ),
    Expression(
        "foot_map.Sigma_xy",
        position,
        _angle_point,
        "Write both distances as rows times the position. What is the covariance if the rows are orthogonal?",
        rows=("x", "y"),
        columns=("x", "y"),
    ),
)
