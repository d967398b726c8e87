"""Hidden points of the symbolic answers of the notebook *split-and-merge*: one line through a wall with a step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.symbolic import Expression

if TYPE_CHECKING:
    from numpy.random import Generator


def tilt(values: dict[str, float]) -> float:
    """Return the angle between the walls and the line of least squares through both."""
    L, s = values["L"], values["s"]
    # Sums over evenly spaced points, in the limit: x from -L to L, y = +- s / 2.
    _, vectors = np.linalg.eigh([[L**2 / 3, s * L / 4], [s * L / 4, s**2 / 4]])
    along = vectors[:, 1]
    return float(np.arctan(along[1] / along[0]))


def _tilt(values: dict[str, float]) -> np.ndarray:
    return np.array(tilt(values))


def _far(values: dict[str, float]) -> np.ndarray:
    return np.array(values["s"] / 2 * np.cos(tilt(values)))


def _point(rng: Generator) -> dict[str, float]:
    """Draw a step that is lower than a wall is long."""
    L = float(rng.uniform(1.0, 3.0))
    return {"L": L, "s": float(L * rng.uniform(0.2, 0.9))}


EXPRESSIONS = (
    Expression(
        "wall_with_a_step.tilt",
        _tilt,
        _point,
        "Take the three scatters about the middle of the step first. Which of them does the step change?",
    ),
    Expression(
        "wall_with_a_step.far",
        _far,
        _point,
        "Through which point does the line go? Are the farthest points at the step or at the ends?",
    ),
)
