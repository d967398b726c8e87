"""Wrong versions of `ballistic.correct`: what people write when a camera sees positions alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.ballistic import correct

if TYPE_CHECKING:
    from collections.abc import Callable

_STAGE = "ballistic.correct"


def _joseph(Sigma: np.ndarray, K: np.ndarray, H: np.ndarray, R: np.ndarray) -> np.ndarray:
    A = np.eye(4) - K @ H
    return A @ Sigma @ A.T + K @ R @ K.T


def _gain(wrong: Callable) -> Callable:
    """Make a correction with another gain, whose covariance is computed as if the gain were right."""

    def function(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, R: np.ndarray) -> tuple:
        K = wrong(Sigma, R)
        return x + K @ (z - x[:2]), _joseph(Sigma, K, np.eye(2, 4), R)

    return function


def _mean(wrong: Callable) -> Callable:
    """Make a correction whose covariance is right and whose mean is not."""

    def function(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, R: np.ndarray) -> tuple:
        K = np.linalg.solve(Sigma[:2, :2] + R, Sigma[:2]).T
        return wrong(x, K, z), correct(x, Sigma, z, R)[1]

    return function


def _covariance(wrong: Callable) -> Callable:
    """Make a correction whose mean is right and whose covariance is not."""

    def function(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, R: np.ndarray) -> tuple:
        K = np.linalg.solve(Sigma[:2, :2] + R, Sigma[:2]).T
        return correct(x, Sigma, z, R)[0], wrong(Sigma, K, R)

    return function


def camera_without_error(Sigma: np.ndarray, _R: np.ndarray) -> np.ndarray:
    """Leave R out of S."""
    return np.linalg.solve(Sigma[:2, :2], Sigma[:2]).T


def one_by_one(Sigma: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Divide by the variances of S alone."""
    return Sigma[:, :2] / np.diag(Sigma[:2, :2] + R)


def camera_alone(Sigma: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Divide by R in the place of S."""
    return np.linalg.solve(R, Sigma[:2]).T


def place_only(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, R: np.ndarray) -> tuple:
    """Correct the position, and leave the velocity and all that belongs to it."""
    K = np.linalg.solve(Sigma[:2, :2] + R, Sigma[:2, :2]).T
    after = np.array(Sigma)
    after[:2, :2] = Sigma[:2, :2] - K @ Sigma[:2, :2]
    return np.concatenate([x[:2] + K @ (z - x[:2]), x[2:]]), after


def believed_outright(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, R: np.ndarray) -> tuple:
    """Replace the position by what the camera saw."""
    after = np.array(Sigma)
    after[:2, :2] = R
    return np.concatenate([z, x[2:]]), after


def another_order(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, R: np.ndarray) -> tuple:
    """Take the state for px, vx, py, vy."""
    H = np.eye(4)[[0, 2]]
    K = np.linalg.solve(H @ Sigma @ H.T + R, H @ Sigma).T
    return x + K @ (z - H @ x), _joseph(Sigma, K, H, R)


def above_the_ground(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, R: np.ndarray) -> tuple:
    """Cut the height off at 0."""
    after, Sigma = correct(x, Sigma, z, R)
    return np.array([after[0], max(after[1], 0.0), after[2], after[3]]), Sigma


def mean_overwritten(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, R: np.ndarray) -> tuple:
    """Correct the caller's mean in place."""
    x[...], after = correct(x, Sigma, z, R)
    return x, after


_ONE = (
    "Take one direction alone, with a variance of 3 before and a camera of variance 1. What is left, and why?"
)
_USELESS = "Let the camera get worse and worse: what must the gain do?"
_LINKED = "The camera never sees the velocity. What links it to what is seen?"
MISCONCEPTIONS = (
    Misconception(
        "position corrected and velocity not",
        _STAGE,
        "Only what the camera sees is corrected. The velocity is correlated with the position, by the flight and by "
        "the impacts, and it learns from what is seen; without that the filter never finds the velocity.",
        _LINKED,
        place_only,
    ),
    Misconception(
        "camera believed outright",
        _STAGE,
        "The position is replaced by what was seen. Nothing of what was known before is left in it.",
        _ONE,
        believed_outright,
    ),
    Misconception(
        "error of the camera left out",
        _STAGE,
        "S holds the doubt about the ball alone, so that the gain follows the camera all the way, however poor it is.",
        _USELESS,
        _gain(camera_without_error),
    ),
    Misconception(
        "error of the camera in the place of S",
        _STAGE,
        "The gain divides by the covariance of the camera, where that of the innovation belongs. Where the ball is "
        "doubtful, it overshoots.",
        _ONE,
        _gain(camera_alone),
    ),
    Misconception(
        "each direction on its own",
        _STAGE,
        "The gain divides by the variances of what is seen and leaves their covariance out. It is right as long as the "
        "two directions have nothing to do with one another.",
        "What is the inverse of a 2 by 2 matrix whose other two entries are not 0?",
        _gain(one_by_one),
    ),
    Misconception(
        "state in another order",
        _STAGE,
        "The second number of the camera is compared with the third of the state: the order is px, py, vx, vy.",
        "Read in the docstring in which order the state is.",
        another_order,
    ),
    Misconception(
        "expected minus seen",
        _STAGE,
        "The innovation has the wrong sign, and every picture pushes the ball away from where it was seen.",
        "The ball is seen 1 m higher than expected. Is the mean too high or too low?",
        _mean(lambda x, K, z: x - K @ (z - x[:2])),
    ),
    Misconception(
        "expectation not subtracted",
        _STAGE,
        "The gain multiplies the position that was seen, and not what is new about it. z is a position here, not yet "
        "an innovation.",
        "The ball is seen just where it was expected: how far may the mean move?",
        _mean(lambda x, K, z: x + K @ z),
    ),
    Misconception(
        "height cut off at the ground",
        _STAGE,
        "A corrected height below 0 is raised to 0. A mean that may err upwards only is too high on average; the next "
        "prediction knows what to do with a ball below the ground.",
        "Average many estimates of a ball that lies on the ground: what comes out with your function?",
        above_the_ground,
    ),
    Misconception(
        "covariance as before the picture",
        _STAGE,
        "The covariance does not shrink, so the filter never becomes surer by looking.",
        _ONE,
        _covariance(lambda Sigma, _K, _R: Sigma.copy()),
    ),
    Misconception(
        "covariance larger after the picture",
        _STAGE,
        "What the observation explains is added to the covariance. Looking never makes a Gaussian wider.",
        _ONE,
        _covariance(lambda Sigma, K, _R: Sigma + K @ Sigma[:2]),
    ),
    Misconception(
        "noise of the gain left out",
        _STAGE,
        "(I - K H) stands on both sides of Sigma, and the error that the camera brings in with K is missing: the "
        "filter becomes too sure.",
        "Two things make a corrected estimate wrong. Which one did you leave out?",
        _covariance(
            lambda Sigma, K, _R: (np.eye(4) - K @ np.eye(2, 4)) @ Sigma @ (np.eye(4) - K @ np.eye(2, 4)).T
        ),
    ),
    Misconception(
        "the caller's mean overwritten by the correction",
        _STAGE,
        "The function writes the new mean into the argument x, which the caller may still need.",
        "x += ... changes the array that was handed over; what does x = x + ... do?",
        mean_overwritten,
    ),
)
