"""Hidden points of the symbolic answers of the notebook *fit-a-line*: three beams on a wall straight ahead."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.checks.fit_a_line import line_jacobians
from autograder.symbolic import Expression
from roboloc_reference.extraction import fit_line

if TYPE_CHECKING:
    from numpy.random import Generator

LINE = ("alpha", "r")


def fan(values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return bearings and ranges of three beams, right, middle and left, that end on the wall."""
    theta = values["beta"] * np.array([-1.0, 0.0, 1.0])
    return theta, values["h"] / np.cos(theta)


def bent(values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return bearings and ranges of three points of a wall, of which the left one is `e` too far away."""
    h, b, e = (values[name] for name in "hbe")
    points = np.array([h - 1j * b, h, h + e + 1j * b])
    return np.angle(points), np.abs(points)


def _bent_line(values: dict[str, float]) -> np.ndarray:
    return np.reshape(fit_line(*bent(values), 0.0, 0.0)[:2], (2, 1))


def by_left(values: dict[str, float]) -> np.ndarray:
    """Return the derivative of the line of the fan by the range of its left beam."""
    return line_jacobians(*fan(values), 0.0, values["h"])[1][:, 2:]


def fan_covariance(values: dict[str, float]) -> np.ndarray:
    """Return the covariance of the line of the fan."""
    return fit_line(*fan(values), values["sigma_theta"] ** 2, values["sigma_rho"] ** 2)[2]


def _bent_point(rng: Generator) -> dict[str, float]:
    """Draw a bent wall; nearly always bent so far that the points are deeper than wide."""
    b = rng.uniform(0.4, 1.2)
    return {
        "h": rng.uniform(1.0, 3.0),
        "b": b,
        "e": b * float(rng.choice([0.6, 2.1, 2.3, 2.5, 2.7, 2.9, 3.1, 3.3])),
    }


def _fan_point(rng: Generator) -> dict[str, float]:
    names = ("h", "beta", "sigma_rho", "sigma_theta")
    low, high = (1.0, 0.3, 0.3, 0.2), (3.0, 1.1, 0.9, 0.7)
    return dict(zip(names, map(float, rng.uniform(low, high)), strict=True))


EXPRESSIONS = (
    Expression(
        "leaning_wall.line_e",
        _bent_line,
        _bent_point,
        "Take the three sums about the mean point first. What does the line do as e grows beyond b?",
        rows=LINE,
    ),
    Expression(
        "leaning_wall.by_left",
        by_left,
        _fan_point,
        "How far does the point move across the wall, and what is its lever?",
        rows=LINE,
    ),
    Expression(
        "leaning_wall.C_fan",
        fan_covariance,
        _fan_point,
        "Write down what each of the six numbers does to alpha and r. The errors are independent.",
        rows=LINE,
        columns=LINE,
    ),
)
