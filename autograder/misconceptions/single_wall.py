"""Wrong versions of the symbolic answers of the notebook *association-and-update*: a single wall, and its gate."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception

if TYPE_CHECKING:
    from collections.abc import Callable

Values = dict[str, float]


def _normal(values: Values) -> np.ndarray:
    return np.array([[math.cos(values["a"])], [math.sin(values["a"])]])


def _answer(formula: Callable[[Values], np.ndarray | float]) -> Callable[[Values], np.ndarray]:
    return lambda values: np.array(formula(values))


_OBSERVED = (
    "The sum S has two parts, one for each thing that is in doubt. What if the observation is useless?"
)
MISCONCEPTIONS = (
    Misconception(
        "gain away from the wall",
        "single_wall.K",
        "The gain has the wrong sign: a wall that is nearer than expected moves the robot away from it.",
        "The robot takes a step towards the wall: which sign has the change of the distance?",
        _answer(lambda v: v["p"] / (v["p"] + v["q"]) * _normal(v)),
    ),
    Misconception(
        "noise of the observation left out of the gain",
        "single_wall.K",
        "The gain follows the observation all the way, as if the distance had no error of its own: the variance of "
        "the observation is missing from S.",
        _OBSERVED,
        _answer(lambda v: -_normal(v)),
    ),
    Misconception(
        "weights exchanged",
        "single_wall.K",
        "The gain is large where the observation is poor: the two variances have changed places.",
        "Let the observation get worse and worse: what must the gain do?",
        _answer(lambda v: -v["q"] / (v["p"] + v["q"]) * _normal(v)),
    ),
    Misconception(
        "position known along the wall too",
        "single_wall.Sigma",
        "The variance shrinks in every direction. One distance says how far the wall is, and nothing about where "
        "along it the robot stands.",
        "Slide the robot along the wall: what does its distance do?",
        _answer(lambda v: v["p"] * v["q"] / (v["p"] + v["q"]) * np.eye(2)),
    ),
    Misconception(
        "noise of the observation left out of the covariance",
        "single_wall.Sigma",
        "Across the wall the position is certain afterwards, as if the distance had no error of its own.",
        _OBSERVED,
        _answer(lambda v: v["p"] * (np.eye(2) - _normal(v) @ _normal(v).T)),
    ),
    Misconception(
        "variance grows across the wall",
        "single_wall.Sigma",
        "The variance across the wall is larger after the observation than before it. Knowing more never makes a "
        "Gaussian wider.",
        "With which sign does K S K^T enter?",
        _answer(lambda v: v["p"] * np.eye(2) + v["p"] ** 2 / (v["p"] + v["q"]) * _normal(v) @ _normal(v).T),
    ),
    Misconception(
        "share of two numbers",
        "single_wall.share",
        "This is the share for a line, whose innovation has two numbers. A distance is one number, and its square "
        "is chi-square with one degree of freedom.",
        "How many numbers does v have now, and over what does one integrate?",
        _answer(lambda v: 1 - math.exp(-(v["g"] ** 2) / 2)),
    ),
    Misconception(
        "one side of the gate",
        "single_wall.share",
        "Only one end of the gate is taken: everything below +g. An innovation may be too small as well as too "
        "large.",
        "What does the gate do with an innovation of minus ten standard deviations?",
        _answer(lambda v: (1 + math.erf(v["g"] / math.sqrt(2))) / 2),
    ),
    Misconception(
        "square compared with g",
        "single_wall.share",
        "The squared distance is compared with g, where it should be compared with the square of g.",
        "In what unit is g, and in what unit is d2?",
        _answer(lambda v: math.erf(math.sqrt(v["g"] / 2))),
    ),
)
