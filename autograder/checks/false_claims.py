"""Hidden points of the symbolic answers of the notebook *comparison*: what false claims and paired runs lead to."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.symbolic import Expression

if TYPE_CHECKING:
    from numpy.random import Generator


def nees(values: dict[str, float]) -> np.ndarray:
    """Return the expected squared error of a filter with a bias that claims independent deviations s, t."""
    a, c, b_x, b_y, s, t = (values[name] for name in ("a", "c", "b_x", "b_y", "s", "t"))
    return np.array((a**2 + b_x**2) / s**2 + (c**2 + b_y**2) / t**2)


def inside(values: dict[str, float]) -> np.ndarray:
    """Return the share inside an ellipse that is too small by k, from the tail of two squares."""
    return np.array(1.0 - (1.0 - values["p"]) ** (1.0 / values["k"] ** 2))


def variance(values: dict[str, float]) -> np.ndarray:
    """Return the variance of the mean difference over R runs."""
    s_1, s_2, rho, R = (values[name] for name in ("s_1", "s_2", "rho", "R"))
    return np.array((s_1**2 + s_2**2 - 2.0 * rho * s_1 * s_2) / R)


def _beliefs(rng: Generator) -> dict[str, float]:
    values = dict(zip(("a", "c", "s", "t", "b_x", "b_y"), rng.uniform(0.4, 2.0, 6), strict=True))
    return {name: float(value) for name, value in values.items()} | {"rho": float(rng.uniform(-0.8, 0.8))}


def _ellipse(rng: Generator) -> dict[str, float]:
    return {"p": float(rng.uniform(0.5, 0.99)), "k": float(rng.uniform(1.2, 3.0))}


def _runs(rng: Generator) -> dict[str, float]:
    s_1, s_2 = rng.uniform(0.4, 2.0, 2)
    return {
        "s_1": float(s_1),
        "s_2": float(s_2),
        "rho": float(rng.uniform(0.2, 0.9)),
        "R": float(rng.uniform(3, 9)),
    }


EXPRESSIONS = (
    Expression(
        "claims.E_nees", nees, _beliefs, "Write the square out as a sum, and take the mean of each term."
    ),
    Expression(
        "claims.p_inside",
        inside,
        _ellipse,
        "What does the squared distance exceed with probability 1 - p, and in which units?",
    ),
    Expression(
        "claims.var_difference",
        variance,
        _runs,
        "First the variance of the difference in one run. Which way does what is common act?",
    ),
)
