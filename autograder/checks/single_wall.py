"""Hidden points of the symbolic answers of the notebook *association-and-update*: the distance to a single wall."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from autograder.symbolic import Expression

if TYPE_CHECKING:
    from numpy.random import Generator


def _wall(values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return gain and covariance of a position after one distance, by information matrices."""
    p, q, a = values["p"], values["q"], values["a"]
    H = -np.array([[math.cos(a), math.sin(a)]])
    Sigma = np.linalg.inv(np.eye(2) / p + H.T @ H / q)
    return Sigma @ H.T / q, Sigma


def _wall_point(rng: Generator) -> dict[str, float]:
    """Draw unequal variances, neither 1, and a wall that faces no axis."""
    p, q = rng.permutation([rng.uniform(0.2, 0.7), rng.uniform(1.4, 3.0)])
    return {
        "p": float(p),
        "q": float(q),
        "a": float(rng.uniform(0.3, 1.2) + rng.integers(-2, 2) * math.pi / 2),
    }


EXPRESSIONS = (
    Expression(
        "single_wall.K",
        lambda values: _wall(values)[0],
        _wall_point,
        "What does the distance do when the robot moves towards the wall? That is H.",
        rows=("x", "y"),
    ),
    Expression(
        "single_wall.Sigma",
        lambda values: _wall(values)[1],
        _wall_point,
        "Along the wall nothing was measured, and across it two opinions met.",
        rows=("x", "y"),
        columns=("x", "y"),
    ),
    Expression(
        "single_wall.share",
        lambda values: np.array(math.erf(values["g"] / math.sqrt(2))),
        lambda rng: {"g": float(rng.uniform(0.4, 2.5))},
        "One standard normal number now, where the two of a line were: between which ends is it in the gate?",
    ),
)
