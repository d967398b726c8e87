"""Hidden points of the symbolic answers of the notebook *motion-model*: a robot driven by its wheel speeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.checks.motion_model import POSE, heading
from autograder.symbolic import Expression
from roboloc_reference.motion import compute_dynamics

if TYPE_CHECKING:
    from numpy.random import Generator


def _wheels(values: dict[str, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return g, G_x and G_u of a robot driven by its wheel speeds, from the unicycle by the chain rule."""
    left, right, b = values["v_left"], values["v_right"], values["b"]
    pose = np.array([values["x"], values["y"], values["theta"]])
    g, Gx, Gu = compute_dynamics(pose, np.array([(left + right) / 2, (right - left) / b]), values["dt"])
    return g, Gx, Gu @ np.array([[0.5, 0.5], [-1 / b, 1 / b]])


def _wheel_point(rng: Generator) -> dict[str, float]:
    """Draw unequal wheel speeds, forwards and backwards, for a robot that is not 1 m wide."""
    speeds = rng.permutation([rng.uniform(0.3, 0.8), rng.uniform(1.1, 1.9)]) * rng.choice([-1, 1], 2)
    x, y = rng.uniform(-3, 3, 2)
    values = {"x": x, "y": y, "theta": heading(rng), "v_left": speeds[0], "v_right": speeds[1]}
    values |= {"b": rng.uniform(0.2, 0.7), "dt": rng.uniform(0.2, 1.5)}
    return {name: float(value) for name, value in values.items()}


def _equal_point(rng: Generator) -> dict[str, float]:
    """Draw equal wheel speeds: a limit may be written with either of the two symbols."""
    values = _wheel_point(rng)
    return values | {"v_right": values["v_left"]}


_WHEELS = ("v_left", "v_right")
EXPRESSIONS = (
    Expression(
        "differential_drive.g",
        lambda values: _wheels(values)[0].reshape(3, 1),
        _wheel_point,
        "What are V and omega of a robot whose wheels run at v_left and v_right, a distance b apart?",
        rows=POSE,
    ),
    Expression(
        "differential_drive.G_x",
        lambda values: _wheels(values)[1],
        _wheel_point,
        "Differentiate the new pose by x, y and theta, in that order.",
        rows=POSE,
        columns=POSE,
    ),
    Expression(
        "differential_drive.G_u",
        lambda values: _wheels(values)[2],
        _wheel_point,
        "Differentiate the new pose by v_left and v_right, in that order: both speeds change V and omega.",
        rows=POSE,
        columns=_WHEELS,
    ),
    Expression(
        "differential_drive.G_u0",
        lambda values: _wheels(values)[2],
        _equal_point,
        "First differentiate, then let the speeds become equal: the other order loses a term.",
        rows=POSE,
        columns=_WHEELS,
    ),
)
