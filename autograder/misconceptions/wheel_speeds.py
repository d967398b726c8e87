"""Wrong versions of the symbolic answers of the notebook *motion-model*: a robot driven by its wheel speeds.

Each is a wrong relation between the wheel speeds and V, omega; the same mistake then shows in all four
answers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.motion import compute_dynamics

if TYPE_CHECKING:
    from collections.abc import Callable

_STANDING = (
    "Let the left wheel stand still. About which point does the robot turn, how far is the other wheel?"
)
_ANSWERS = ("g", "G_x", "G_u", "G_u0")


def _answer(
    which: int, relation: Callable[[float], list[list[float]]]
) -> Callable[[dict[str, float]], np.ndarray]:
    """Return the answer number `which` (g, G_x, G_u) with [V, omega] = relation(b) @ [v_left, v_right]."""

    def function(values: dict[str, float]) -> np.ndarray:
        by_wheels = np.array(relation(values["b"]))
        pose = np.array([values[name] for name in ("x", "y", "theta")])
        u = by_wheels @ [values["v_left"], values["v_right"]]
        g, Gx, Gu = compute_dynamics(pose, u, values["dt"])
        return (g.reshape(3, 1), Gx, Gu @ by_wheels)[which]

    return function


_RELATIONS = (
    (
        "wheels exchanged",
        "The turning rate has the wrong sign: the robot turns towards its faster wheel.",
        "Which way does a robot turn whose right wheel is the faster one?",
        lambda b: [[0.5, 0.5], [1 / b, -1 / b]],
    ),
    (
        "distance to the middle taken for the track width",
        "The turning rate is halved: b is the distance between the wheels, not from a wheel to the middle.",
        _STANDING,
        lambda b: [[0.5, 0.5], [-0.5 / b, 0.5 / b]],
    ),
    (
        "half the track width",
        "The turning rate is doubled, as if each wheel stood a quarter of b from the middle.",
        _STANDING,
        lambda b: [[0.5, 0.5], [-2 / b, 2 / b]],
    ),
    (
        "speeds added",
        "The forward speed is the sum of the wheel speeds: with both at 1 m/s the robot would drive 2 m/s.",
        "How fast is the point half way between two wheels that run equally fast?",
        lambda b: [[1.0, 1.0], [-1 / b, 1 / b]],
    ),
)


def _turning_ignored(values: dict[str, float]) -> np.ndarray:
    """Let the speeds become equal before differentiating: only the forward speed depends on them."""
    matrix = _answer(2, lambda b: [[0.5, 0.5], [-1 / b, 1 / b]])(values)
    mean = matrix.mean(axis=1, keepdims=True)
    return np.hstack([mean, mean])


MISCONCEPTIONS = (
    *(
        Misconception(
            name, f"differential_drive.{answer}", explanation, hint, _answer(min(index, 2), relation)
        )
        for index, answer in enumerate(_ANSWERS)
        for name, explanation, hint, relation in _RELATIONS
    ),
    Misconception(
        "limit before derivative",
        "differential_drive.G_u0",
        "The speeds were made equal first and the result was differentiated. The pose of a robot that "
        "drives straight no longer depends on the difference of its wheel speeds, and that derivative is "
        "lost.",
        "Differentiate by each wheel speed while they still differ.",
        _turning_ignored,
    ),
)
