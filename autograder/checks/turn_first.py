"""Hidden points of the symbolic answers of the notebook *ekf-and-ukf*: another order of turns, another sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.checks.motion_model import heading
from autograder.checks.velocity_model import CONTROL, POSE, SEEN
from autograder.symbolic import Expression
from roboloc_reference.velocity import jacobians, range_bearing

if TYPE_CHECKING:
    from numpy.random import Generator


def turned_first(values: dict[str, float]) -> np.ndarray:
    """Return W of a robot that turns by gamma dt before it drives: the arc starts from another heading."""
    v, omega, gamma, dt = (values[name] for name in ("v", "omega", "gamma", "dt"))
    F, W = jacobians([0.0, 0.0, values["theta"] + gamma * dt], [v, omega, 0.0], dt)
    W[:, 2] = dt * F[:, 2]
    return W


def from_ahead(values: dict[str, float]) -> np.ndarray:
    """Return H of a sensor that stands a before the middle of the robot, by the chain rule."""
    a, theta = values["a"], values["theta"]
    c, s = np.cos(theta), np.sin(theta)
    sensor = [values["x"] + a * c, values["y"] + a * s, theta]
    _, H = range_bearing(sensor, [values["m_x"], values["m_y"]])
    return H @ np.array([[1.0, 0.0, -a * s], [0.0, 1.0, a * c], [0.0, 0.0, 1.0]])


def _control(rng: Generator) -> dict[str, float]:
    signs = rng.choice([-1, 1], 3)
    v, omega, gamma = signs * rng.uniform([0.5, 0.4, 0.2], [1.5, 1.2, 0.8])
    dt = rng.uniform(0.4, 1.4)
    values = {"theta": heading(rng), "v": v, "omega": omega, "gamma": gamma, "dt": dt}
    return {name: float(value) for name, value in values.items()}


def _straight(rng: Generator) -> dict[str, float]:
    return _control(rng) | {"omega": 0.0}


def _sighting(rng: Generator) -> dict[str, float]:
    x, y = rng.uniform(-2, 2, 2)
    direction, r = heading(rng), rng.uniform(2, 4)
    values = {"x": x, "y": y, "theta": heading(rng), "a": rng.uniform(0.3, 0.9)}
    values |= {"m_x": x + r * np.cos(direction), "m_y": y + r * np.sin(direction)}
    return {name: float(value) for name, value in values.items()}


EXPRESSIONS = (
    Expression(
        "turn_first.W_first",
        turned_first,
        _control,
        "In which direction does the robot look when it starts to drive? What does gamma change besides the heading?",
        rows=POSE,
        columns=CONTROL,
    ),
    Expression(
        "turn_first.W_straight",
        turned_first,
        _straight,
        "First differentiate, then let omega go to 0: the other order loses a term.",
        rows=POSE,
        columns=CONTROL,
    ),
    Expression(
        "turn_first.H_ahead",
        from_ahead,
        _sighting,
        "Where does the sensor stand, and how does that change when the robot turns on the spot?",
        rows=SEEN,
        columns=POSE,
    ),
)
