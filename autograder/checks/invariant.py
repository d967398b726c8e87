"""Hidden checks of the right-invariant filter in the notebook *invariant-ekf*: prediction and correction.

The notebook fixes the error, estimate = exp(xi) truth, and the order v1, v2, omega. What it does not fix is left open:
how the exponential is computed, from which side the gain is solved for, and in which form the covariance is written.

Rounding is far below 1e-8 of the standard deviations. Poses are away from the origin and turned by angles with a sine
and a cosine of some size, W and N are correlated, so that no wrong side, transpose or order is right by chance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.association_inputs import covariance
from autograder.checks.kinds import each, repeatable, untouched
from autograder.checks.motion_model import heading
from roboloc_reference import invariant

if TYPE_CHECKING:
    from numpy.random import Generator

TWIST = ("v1", "v2", "omega")
_SHARE = 1e-8
_SLOW = (1e-12, 1e-9, 1e-6, 1e-4)


def predict_tolerance(*args: object) -> tuple[np.ndarray, np.ndarray]:
    """Bound the error of the pose by its size, that of the covariance by the standard deviations after."""
    X, P = invariant.predict(*args)
    size = np.sqrt(np.diag(P))
    return np.full((3, 3), _SHARE * (1 + np.abs(X).max())), _SHARE * np.outer(size, size)


def correct_tolerance(*args: object) -> tuple[np.ndarray, np.ndarray]:
    """Bound the error of the pose by its size, that of the covariance by the standard deviations before."""
    size = np.sqrt(np.diag(args[1]))
    return np.full((3, 3), _SHARE * (1 + np.abs(args[0]).max())), _SHARE * np.outer(size, size)


def _pose(rng: Generator) -> np.ndarray:
    """Draw a pose away from the origin, turned by an angle with a sine and a cosine of some size."""
    x, y = rng.uniform(1.0, 3.0, 2) * rng.choice([-1, 1], 2)
    c, s = np.cos(theta := heading(rng)), np.sin(theta)
    return np.array([[c, -s, x], [s, c, y], [0.0, 0.0, 1.0]])


def _spread(rng: Generator, sizes: tuple[float, ...]) -> np.ndarray:
    """Draw a correlated covariance with standard deviations near the given ones."""
    cov = covariance(rng, len(sizes))
    scale = np.array(sizes) * rng.uniform(0.8, 1.25, len(sizes)) / np.sqrt(np.diag(cov))
    return cov * np.outer(scale, scale)


def _steps(rng: Generator, omegas: np.ndarray) -> list[Case]:
    """Make one prediction for each omega, forwards and backwards and also sideways."""
    cases = []
    for omega in omegas:
        twist = np.array([*rng.uniform(0.5, 1.5, 2) * rng.choice([-1, 1], 2), omega])
        P, W = _spread(rng, (0.3, 0.4, 0.2)), _spread(rng, (0.3, 0.2, 0.25))
        dt = float(rng.choice([0.4, 1.6]) * rng.uniform(0.9, 1.1))
        cases.append(PREDICT.case(_pose(rng), P, twist, W, dt))
    return cases


@remembered
def moved(rng: Generator) -> list[Case]:
    """Make predictions of robots that turn to both sides."""
    return _steps(rng, rng.uniform(0.5, 1.2, 5) * np.array([1, -1, 1, -1, 1]))


@remembered
def straight(rng: Generator) -> list[Case]:
    """Make predictions of robots that do not turn, or almost not."""
    return _steps(rng, np.array([0.0, 0.0, *_SLOW, *(-w for w in _SLOW)]))


@remembered
def silent(rng: Generator) -> list[Case]:
    """Make predictions of motions without any noise."""
    cases = _steps(rng, rng.uniform(0.5, 1.2, 3) * rng.choice([-1, 1], 3))
    return [PREDICT.case(*case.args[:3], np.zeros((3, 3)), case.args[4]) for case in cases]


def _sightings(rng: Generator, counts: tuple[int, ...]) -> list[Case]:
    """Make corrections by some landmarks each, seen a little off from where they are expected."""
    cases = []
    for k in counts:
        X, P = _pose(rng), _spread(rng, (0.4, 0.3, 0.3))
        landmarks = rng.uniform(1.0, 4.0, (k, 2)) * rng.choice([-1, 1], (k, 2))
        off = rng.uniform(0.1, 0.3, (k, 2)) * rng.choice([-1, 1], (k, 2))
        Y = np.column_stack([(landmarks - X[:2, 2]) @ X[:2, :2] + off, np.ones(k)])
        cases.append(CORRECT.case(X, P, Y, landmarks, _spread(rng, (0.15, 0.3))))
    return cases


@remembered
def seen(rng: Generator) -> list[Case]:
    """Make corrections by two landmarks."""
    return _sightings(rng, (2, 2, 2, 2))


@remembered
def counts(rng: Generator) -> list[Case]:
    """Make corrections by one landmark and by three."""
    return _sightings(rng, (1, 3, 1, 3))


@remembered
def nothing(rng: Generator) -> list[Case]:
    """Make corrections by nothing at all."""
    return _sightings(rng, (0, 0))


_HINT_X = "The twist is one of the robot: on which side of X does its motion stand?"
_HINT_P = (
    "The noise is in the robot's frame, the error is one of the whole world. What carries one to the other?"
)
_HINT_SLOW = "What does the exponential do where omega is 0, or nearly so?"
_HINT_SILENT = "Which error does a robot have that moves without noise, and has it changed?"
_HINT_SEEN = (
    "X Y is where the landmark would be if the estimate were right. In whose frame are innovation and noise?"
)
_HINT_COPY = "Work on copies, or on new names."
_HINT_GLOBAL = "Use the arguments alone, nothing global."
_BELIEF = frozenset({"X", "P"})

PREDICT = Stage(
    name="invariant.predict",
    outputs=("X", "P"),
    reference=invariant.predict,
    tolerance=predict_tolerance,
    rows={"P": TWIST},
    columns={"P": TWIST},
    checks=(
        Check("X of a robot that turns", 5, each(moved, "X"), _HINT_X),
        Check("P of a robot that turns", 6, each(moved, "P"), _HINT_P),
        Check("no turn, and turns that are nearly none", 3, each(straight), _HINT_SLOW),
        Check("a motion without noise", 3, each(silent, "P"), _HINT_SILENT),
        Check(
            "arguments untouched", 2, untouched(moved, ("X", "P", "twist", "W", "dt"), _BELIEF), _HINT_COPY
        ),
        Check("same call, same result", 1, repeatable(moved, _BELIEF), _HINT_GLOBAL),
    ),
)
CORRECT = Stage(
    name="invariant.correct",
    outputs=("X", "P"),
    reference=invariant.correct,
    tolerance=correct_tolerance,
    rows={"P": TWIST},
    columns={"P": TWIST},
    checks=(
        Check("X, two landmarks", 6, each(seen, "X"), _HINT_SEEN),
        Check("P, two landmarks", 6, each(seen, "P"), _HINT_SEEN),
        Check(
            "one landmark, and three", 3, each(counts), "How many rows has Y? Let nothing else depend on it."
        ),
        Check("no landmark", 2, each(nothing), "What is known if nothing is seen?"),
        Check(
            "arguments untouched",
            2,
            untouched(seen, ("X", "P", "Y", "landmarks", "N"), _BELIEF),
            _HINT_COPY,
        ),
        Check("same call, same result", 1, repeatable(seen, _BELIEF), _HINT_GLOBAL),
    ),
)
STAGES = (PREDICT, CORRECT)
