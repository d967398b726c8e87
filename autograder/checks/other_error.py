"""Hidden points of the symbolic answers of the notebook *invariant-ekf*: the left error, and another sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.symbolic import Expression

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

TWIST = ("v1", "v2", "omega")


def carried(values: dict[str, float]) -> np.ndarray:
    """Return what a step to p, q, phi does to an error in the robot's frame: the adjoint of the way back."""
    p, q = values["p"], values["q"]
    c, s = np.cos(values["phi"]), np.sin(values["phi"])
    return np.array([[c, s, s * p - c * q], [-s, c, c * p + s * q], [0.0, 0.0, 1.0]])


def antenna(values: dict[str, float]) -> np.ndarray:
    """Return how a position reported from a ahead of the robot changes with a motion of the world."""
    east = values["x"] + values["a"] * np.cos(values["theta"])
    north = values["y"] + values["a"] * np.sin(values["theta"])
    return np.array([[1.0, 0.0, -north], [0.0, 1.0, east]])


def numbers(values: dict[str, float]) -> np.ndarray:
    """Return what an error in the robot's frame is in x, y and theta."""
    c, s = np.cos(values["theta"]), np.sin(values["theta"])
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _values(names: str) -> Callable[[Generator], dict[str, float]]:
    """Return what draws values away from 0, and angles with a sine and a cosine of some size."""

    def point(rng: Generator) -> dict[str, float]:
        lengths = rng.choice([-1, 1], 4) * rng.uniform(0.6, 3.0, 4)
        drawn = dict(zip("xypq", map(float, lengths), strict=True)) | {"a": float(rng.uniform(0.5, 1.5))}
        for angle in ("theta", "phi"):
            drawn[angle] = float(rng.uniform(0.4, 1.1) + rng.integers(4) * np.pi / 2)
        return {name: drawn[name] for name in names.split()}

    return point


EXPRESSIONS = (
    Expression(
        "other_error.F_left",
        carried,
        _values("p q phi"),
        "Write the error after the step by the one before: what stands to the left of it, and what to the right?",
        rows=TWIST,
        columns=TWIST,
    ),
    Expression(
        "other_error.H_antenna",
        antenna,
        _values("x y theta a"),
        "Where in the world is the antenna, and where does a small motion of the world take it?",
        rows=("x", "y"),
        columns=TWIST,
    ),
    Expression(
        "other_error.B_left",
        numbers,
        _values("theta"),
        "A small step ahead, to the left, or on the spot: what does it do to x, y and theta?",
        rows=("x", "y", "theta"),
        columns=TWIST,
    ),
)
