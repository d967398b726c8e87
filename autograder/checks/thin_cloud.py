"""Hidden points of the symbolic answers of the notebook *particle-filter*: how many of a cloud are left in effect."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.symbolic import Expression

if TYPE_CHECKING:
    from numpy.random import Generator


def of_two_kinds(values: dict[str, float]) -> np.ndarray:
    """Return the effective sample size of M weights, k of which are a times as large as the others."""
    M, k, a = (values[name] for name in "Mka")
    return np.array((k * a + M - k) ** 2 / (k * a * a + M - k))


def share(s2: float, q2: float, z: float) -> np.ndarray:
    """Return the share of a normal cloud of variance s2 that a normal observation at z of variance q2 leaves."""
    narrow, wide = q2 + s2, q2 + 2.0 * s2
    return np.array(np.sqrt(q2 * wide) / narrow * np.exp(-z * z * s2 / (narrow * wide)))


def _kinds(rng: Generator) -> dict[str, float]:
    M = int(rng.integers(20, 60))
    return {"M": float(M), "k": float(rng.integers(3, M // 2)), "a": float(rng.uniform(2.0, 9.0))}


def _off(rng: Generator) -> dict[str, float]:
    s, q = rng.uniform([0.6, 0.3], [1.2, 0.9])
    return {"s": float(s), "q": float(q), "z": float(rng.choice([-1.0, 1.0]) * rng.uniform(0.8, 1.8))}


EXPRESSIONS = (
    Expression(
        "thin_cloud.n_two",
        of_two_kinds,
        _kinds,
        "What is the sum of the M weights, and what that of their squares?",
    ),
    Expression(
        "thin_cloud.share_off",
        lambda values: share(values["s"] ** 2, values["q"] ** 2, values["z"]),
        _off,
        "Complete the squares: where are the two bells, of the weights and of their squares, and how high?",
    ),
)
