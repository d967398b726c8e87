"""Wrong versions of `invariant.predict`, as people write them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc import se2
from roboloc_reference.invariant import predict

if TYPE_CHECKING:
    from collections.abc import Callable

_STAGE = "invariant.predict"


def matrix(pose: np.ndarray) -> np.ndarray:
    """Return the matrix of a pose."""
    x, y, theta = pose
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s, x], [s, c, y], [0.0, 0.0, 1.0]])


def adjoint(X: np.ndarray) -> np.ndarray:
    """Return the adjoint of a pose."""
    Ad = np.eye(3)
    Ad[:2, :2], Ad[:2, 2] = X[:2, :2], [X[1, 2], -X[0, 2]]
    return Ad


def _noise(carried: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Callable[..., tuple]:
    """Make a prediction of which the carrier of the noise is another; it sees X before and after."""

    def function(X, P, twist, W, dt) -> tuple:  # noqa: ANN001
        after, _ = predict(X, P, twist, W, dt)
        A = carried(X, after)
        return after, P + A @ W @ A.T

    return function


def _pose(moved: Callable[..., np.ndarray]) -> Callable[..., tuple]:
    """Make a prediction of which the motion is another."""

    def function(X, P, twist, W, dt) -> tuple:  # noqa: ANN001
        return moved(X, twist, dt), predict(X, P, twist, W, dt)[1]

    return function


def _first_heading(X: np.ndarray, twist: np.ndarray, dt: float) -> np.ndarray:
    turn = matrix(np.array([0.0, 0.0, twist[2] * dt]))
    turn[:2, 2] = twist[:2] * dt
    return X @ turn


def _other_signs(X: np.ndarray, _after: np.ndarray) -> np.ndarray:
    Ad = adjoint(X)
    Ad[:2, 2] *= -1
    return Ad


def _omega_first(X: np.ndarray, _after: np.ndarray) -> np.ndarray:
    return adjoint(X)[[2, 0, 1]][:, [2, 0, 1]]


def _left(X, P, twist, W, dt) -> tuple:  # noqa: ANN001
    back = adjoint(np.linalg.inv(matrix(se2.exp(twist * dt))))
    return predict(X, P, twist, W, dt)[0], back @ P @ back.T + W


def _carried(X, P, twist, W, dt) -> tuple:  # noqa: ANN001
    after, _ = predict(X, P, twist, W, dt)
    A, F = adjoint(X), np.eye(3)
    F[:2, 2] = X[1, 2] - after[1, 2], after[0, 2] - X[0, 2]
    return after, F @ P @ F.T + A @ W @ A.T


def _times_dt(X, P, twist, W, dt) -> tuple:  # noqa: ANN001
    return predict(X, P, twist, W * dt, dt)


def _overwritten(X, P, twist, W, dt) -> tuple:  # noqa: ANN001
    after, Sigma = predict(X, P, twist, W, dt)
    X[...] = after
    return X, Sigma


_WHOSE = "In whose frame is W given, and of whose motion is P the covariance?"
_ORIGIN = "A robot at (2, 0) turns on its spot: if all turns with it, what does the origin do?"
MISCONCEPTIONS = (
    Misconception(
        "noise left in the robot's frame",
        _STAGE,
        "W is added as it is. It is an error in the robot's frame, and P one of the whole world: only at the origin, "
        "and not turned, are the two alike.",
        _WHOSE,
        _noise(lambda X, _after: np.eye(len(X))),
    ),
    Misconception(
        "noise turned and not shifted",
        _STAGE,
        "The noise is turned into the world, but a turn of the robot is not made one about the origin: the last column "
        "of the adjoint is 0.",
        _ORIGIN,
        _noise(lambda X, _after: matrix(np.array([0.0, 0.0, np.arctan2(X[1, 0], X[0, 0])]))),
    ),
    Misconception(
        "pose in the place of its adjoint",
        _STAGE,
        "The matrix of the pose carries the noise. It carries points; twists are carried by its adjoint, whose last "
        "column is another.",
        _ORIGIN,
        _noise(lambda X, _after: X),
    ),
    Misconception(
        "adjoint transposed",
        _STAGE,
        "The transpose stands in front of W and the adjoint behind. Both forms look alike on paper; only one carries "
        "what it should.",
        "What stands next to a twist, if A carries it: A or its transpose? And in the covariance of that?",
        _noise(lambda X, _after: adjoint(X).T),
    ),
    Misconception(
        "adjoint of the pose after the step",
        _STAGE,
        "The noise is carried by the adjoint of the predicted pose. In this notebook it is an error of the step "
        "as seen from where the step begins.",
        "Which pose do you have when the step begins?",
        _noise(lambda _X, after: adjoint(after)),
    ),
    Misconception(
        "last column of the adjoint with the other sign",
        _STAGE,
        "The last column is that of a turn to the other side: the noise of the heading shifts the robot the wrong way.",
        _ORIGIN,
        _noise(_other_signs),
    ),
    Misconception(
        "adjoint with omega first",
        _STAGE,
        "The adjoint is written for twists with omega first, as many books have them. Here the order is v1, v2, omega.",
        "In which row and column of your adjoint is the 1 that stands alone?",
        _noise(_omega_first),
    ),
    Misconception(
        "prediction of the left-invariant error",
        _STAGE,
        "The covariance is carried along with the motion, and the noise is added as it is: that is right for an error "
        "in the robot's frame, truth exp(xi).",
        "On which side of the truth does the exponential of this notebook stand?",
        _left,
    ),
    Misconception(
        "covariance carried as in the extended filter",
        _STAGE,
        "The Jacobian of the motion in x, y, theta is applied to P. In these coordinates the motion does nothing "
        "to the error.",
        "All of the world is moved by exp(xi), the robot with it. Then the robot drives. By what is it off?",
        _carried,
    ),
    Misconception(
        "motion on the left of the pose",
        _STAGE,
        "The motion is applied in the world's frame: exp(zeta dt) X. The robot then turns about the origin of the "
        "world and not about itself.",
        "A robot that faces left drives ahead: which coordinate of it changes?",
        _pose(lambda X, twist, dt: matrix(se2.exp(twist * dt)) @ X),
    ),
    Misconception(
        "way along the first heading",
        _STAGE,
        "The shift is v dt along the heading at the start, and the turn is made at the end. The robot turns while it "
        "drives.",
        "A quarter circle of radius 1: where does it end?",
        _pose(_first_heading),
    ),
    Misconception(
        "twist not multiplied by dt",
        _STAGE,
        "The twist is followed for one second, however long the step is.",
        "Which unit must the argument of the exponential have?",
        _pose(lambda X, twist, _dt: X @ matrix(se2.exp(twist))),
    ),
    Misconception(
        "noise multiplied by dt",
        _STAGE,
        "W is multiplied by dt. Here it is the covariance of the whole step already.",
        "What does the docstring say about the units of W?",
        _times_dt,
    ),
    Misconception(
        "the caller's pose overwritten",
        _STAGE,
        "The pose that was given is moved in place. The caller's old estimate is gone.",
        "Which operations make a new array, and which write into the old one?",
        _overwritten,
    ),
)
