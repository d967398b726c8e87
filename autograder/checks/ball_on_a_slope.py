"""Hidden points of the symbolic answers of the notebook *tracking*: a ball that falls on a slope."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from autograder.symbolic import Expression

if TYPE_CHECKING:
    from numpy.random import Generator

Values = dict[str, float]
STATE = ("px", "py", "vx", "vy")


def normal(values: Values) -> np.ndarray:
    """Return the unit normal of the slope, upwards."""
    return np.array([-math.sin(values["alpha"]), math.cos(values["alpha"])])


def hit(values: Values) -> np.ndarray:
    """Return the time after which the ball touches the slope: a fall across it."""
    n = normal(values)
    away = float(n @ [values["px"], values["py"]])
    speed = float(n @ [values["vx"], values["vy"]])
    pull = values["g"] * math.cos(values["alpha"])
    return np.array((speed + math.sqrt(speed**2 + 2 * pull * away)) / pull)


def bounced(values: Values) -> np.ndarray:
    """Return the velocity after the impact, (2, 1)."""
    n, v = normal(values), np.array([values["vx"], values["vy"]])
    return (v - (1 + values["e"]) * (n @ v) * n).reshape(2, 1)


def saltation(values: Values) -> np.ndarray:
    """Return the saltation matrix in axes along and across the slope, turned back."""
    c, s = math.cos(values["alpha"]), math.sin(values["alpha"])
    turn = np.kron(np.eye(2), [[c, s], [-s, c]])
    across = float(normal(values) @ [values["vx"], values["vy"]])
    e = values["e"]
    flat = np.diag([1, -e, 1, -e])
    flat[3, 1] = -(1 + e) * values["g"] * c / across
    return turn.T @ flat @ turn


def _point(rng: Generator, down: float = 0.0) -> Values:
    """Draw a slope to either side and a ball over it; with `down`, one that comes down on it at least that fast."""
    alpha = rng.choice([-1, 1]) * rng.uniform(0.2, 0.6)
    n = normal({"alpha": alpha})
    along = np.array([n[1], -n[0]])
    place = rng.uniform(0.5, 2) * n + rng.choice([-1, 1]) * rng.uniform(0.5, 2) * along
    across = -rng.uniform(down, down + 3) if down else rng.choice([-1, 1]) * rng.uniform(0.4, 2)
    velocity = across * n + rng.choice([-1, 1]) * rng.uniform(0.5, 2) * along
    numbers = [*place, *velocity, alpha, rng.uniform(6, 15), rng.uniform(0.3, 0.9)]
    return dict(zip((*STATE, "alpha", "g", "e"), map(float, numbers), strict=True))


EXPRESSIONS = (
    Expression(
        "slope.t_hit",
        hit,
        _point,
        "How far is the ball from the slope, straight across, and what pulls it there?",
    ),
    Expression(
        "slope.v_after",
        bounced,
        lambda rng: _point(rng, 1.0),
        "Which part of the velocity does a smooth slope reverse, and which does it leave?",
        rows=("vx", "vy"),
    ),
    Expression(
        "slope.Xi_slope",
        saltation,
        lambda rng: _point(rng, 1.0),
        "The formula of the saltation matrix holds for any ground: its normal and the derivative of the jump are new.",
        rows=STATE,
        columns=STATE,
    ),
)
