"""Wrong versions of the symbolic answers of the notebook *tracking*: a ball that falls on a slope."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from autograder.checks.ball_on_a_slope import bounced, normal, saltation
from autograder.misconceptions.model import Misconception

if TYPE_CHECKING:
    from collections.abc import Callable

Values = dict[str, float]


def _answer(formula: Callable[[Values], np.ndarray | float]) -> Callable[[Values], np.ndarray]:
    return lambda values: np.array(formula(values))


def _fall(speed: float, pull: float, height: float) -> float:
    """Return when a ball is down, from its speed upwards, what pulls it, and its height."""
    return (speed + math.sqrt(max(speed**2 + 2 * pull * height, 0.0))) / pull


def _across(v: Values) -> tuple[float, float]:
    """Return speed and distance across the slope."""
    n = normal(v)
    return float(n @ [v["vx"], v["vy"]]), float(n @ [v["px"], v["py"]])


def _full_gravity(v: Values) -> float:
    speed, away = _across(v)
    return _fall(speed, v["g"], away)


def _earlier_root(v: Values) -> float:
    speed, away = _across(v)
    pull = v["g"] * math.cos(v["alpha"])
    return (speed - math.sqrt(speed**2 + 2 * pull * away)) / pull


def _parts(v: Values) -> tuple[np.ndarray, np.ndarray]:
    """Return the velocity, and the part of it across the slope."""
    n, velocity = normal(v), np.array([v["vx"], v["vy"]])
    return velocity, (n @ velocity) * n


def _stuck(v: Values) -> np.ndarray:
    velocity, across = _parts(v)
    return (velocity - v["e"] * across).reshape(2, 1)


def _jump_on_the_slope(v: Values) -> np.ndarray:
    n = normal(v)
    D = np.eye(4)
    D[2:, 2:] -= (1 + v["e"]) * np.outer(n, n)
    return D


def _full_gravity_in_the_matrix(v: Values) -> np.ndarray:
    Xi = saltation(v)
    Xi[2:, :2] /= math.cos(v["alpha"])
    return Xi


def _flat(v: Values) -> Values:
    return v | {"alpha": 0.0}


_LEVEL = (
    "The ground is taken to be level. The slope rises with x, and the direction of a bounce turns with it."
)
_TURN = "Turn the picture until the slope is level: what are place, velocity and gravity then?"
MISCONCEPTIONS = (
    Misconception(
        "time to a level ground",
        "slope.t_hit",
        _LEVEL,
        _TURN,
        _answer(lambda v: _fall(v["vy"], v["g"], v["py"]) if v["py"] > 0 else math.nan),
        lambda v: v["py"] > 0,
    ),
    Misconception(
        "ground under the start",
        "slope.t_hit",
        "The height over the slope is taken where the ball starts. While it falls it goes sideways, and the ground "
        "under it rises or sinks.",
        "Throw the ball up the slope: which comes to meet it?",
        _answer(lambda v: _fall(v["vy"], v["g"], v["py"] - v["px"] * math.tan(v["alpha"]))),
    ),
    Misconception(
        "all of gravity across the slope",
        "slope.t_hit",
        "Distance and velocity are taken across the slope, gravity is not: only a part of it pulls towards the slope.",
        _TURN,
        _answer(_full_gravity),
    ),
    Misconception(
        "earlier root",
        "slope.t_hit",
        "The quadratic equation has two roots, and this is the one in the past, where the ball would have come out of "
        "the slope.",
        "Which sign has your time for a ball at rest above the slope?",
        _answer(_earlier_root),
    ),
    Misconception(
        "bounce of a level ground",
        "slope.v_after",
        _LEVEL,
        _TURN,
        _answer(lambda v: bounced(_flat(v))),
    ),
    Misconception(
        "whole velocity reversed",
        "slope.v_after",
        "All of the velocity is reversed, as for a ball that comes straight at a wall. Along a smooth slope nothing "
        "acts on it.",
        "Let the ball slide along the slope: what does your answer do to it?",
        _answer(lambda v: -v["e"] * np.array([[v["vx"]], [v["vy"]]])),
    ),
    Misconception(
        "part across the slope only reduced",
        "slope.v_after",
        "The part across the slope is made smaller by the share e of it, and goes on into the ground. It must be taken "
        "away and then reversed.",
        "With e = 1, which way does the ball go after your impact?",
        _answer(_stuck),
    ),
    Misconception(
        "slope to the other side",
        "slope.v_after",
        "The normal leans the wrong way: for a slope that rises to the right it points to the left.",
        "A ball falls straight down on a slope that rises to the right. To which side does it bounce?",
        _answer(lambda v: bounced(v | {"alpha": -v["alpha"]})),
    ),
    Misconception(
        "derivative of the jump on the slope",
        "slope.Xi_slope",
        "This is the derivative of the jump itself. An error of the place shifts the time of the impact, and between "
        "the two impacts one ball is still coming while the other is on its way back.",
        "Two balls, one a little farther from the slope: when both have bounced, which one is farther?",
        _answer(_jump_on_the_slope),
    ),
    Misconception(
        "saltation of a level ground",
        "slope.Xi_slope",
        _LEVEL,
        _TURN,
        _answer(lambda v: saltation(_flat(v))),
    ),
    Misconception(
        "all of gravity in the saltation",
        "slope.Xi_slope",
        "The entries that make velocity out of place hold all of gravity. Only the part across the slope changes its "
        "effect at an impact.",
        _TURN,
        _answer(_full_gravity_in_the_matrix),
    ),
)
