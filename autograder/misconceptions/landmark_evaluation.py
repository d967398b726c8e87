"""Wrong versions of `landmarks.evaluate`: how far a map is from the truth, as people measure it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.landmarks import evaluate

if TYPE_CHECKING:
    from collections.abc import Callable

_STAGE = "landmarks.evaluate"


def _errors(x: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Return estimate minus truth, a row for each landmark."""
    return (x[3:] - truth).reshape(-1, 2)


def _each(x: np.ndarray, Sigma: np.ndarray, truth: np.ndarray, measure: Callable) -> np.ndarray:
    """Return what a measure makes of error and covariance of each landmark."""
    found = []
    for j, e in enumerate(_errors(x, truth)):
        found.append(measure(e, Sigma[3 + 2 * j : 5 + 2 * j, 3 + 2 * j : 5 + 2 * j], Sigma[:2, :2]))
    return np.array(found)


def _product(e: np.ndarray, S: np.ndarray, _pose: np.ndarray) -> float:
    return np.sqrt(e @ S @ e)


def _upright(e: np.ndarray, S: np.ndarray, _pose: np.ndarray) -> float:
    return np.sqrt(np.sum(e * e / np.diag(S)))


def _round(e: np.ndarray, S: np.ndarray, _pose: np.ndarray) -> float:
    return np.sqrt(e @ e / (np.trace(S) / 2.0))


def _wider(e: np.ndarray, S: np.ndarray, pose: np.ndarray) -> float:
    return np.sqrt(e @ np.linalg.solve(S + pose, e))


def squared(x: np.ndarray, Sigma: np.ndarray, truth: np.ndarray) -> tuple:
    """Forget the root of the Mahalanobis distance."""
    euclidean, mahalanobis = evaluate(x, Sigma, truth)
    return euclidean, mahalanobis**2


def euclidean_squared(x: np.ndarray, Sigma: np.ndarray, truth: np.ndarray) -> tuple:
    """Forget the root of the Euclidean distance."""
    euclidean, mahalanobis = evaluate(x, Sigma, truth)
    return euclidean**2, mahalanobis


def sum_of_both(x: np.ndarray, Sigma: np.ndarray, truth: np.ndarray) -> tuple:
    """Add the distances along both axes."""
    return np.abs(_errors(x, truth)).sum(axis=1), evaluate(x, Sigma, truth)[1]


def not_inverted(x: np.ndarray, Sigma: np.ndarray, truth: np.ndarray) -> tuple:
    """Multiply by the covariance."""
    return evaluate(x, Sigma, truth)[0], _each(x, Sigma, truth, _product)


def variances_alone(x: np.ndarray, Sigma: np.ndarray, truth: np.ndarray) -> tuple:
    """Divide by the variances alone."""
    return evaluate(x, Sigma, truth)[0], _each(x, Sigma, truth, _upright)


def blocks_from_the_pose(x: np.ndarray, Sigma: np.ndarray, truth: np.ndarray) -> tuple:
    """Count the blocks of Sigma from its first row."""
    found = []
    for j, e in enumerate(_errors(x, truth)):
        block = Sigma[2 * j : 2 * j + 2, 2 * j : 2 * j + 2]
        found.append(np.sqrt(e @ np.linalg.solve(block, e)))
    return evaluate(x, Sigma, truth)[0], np.array(found)


def one_spread(x: np.ndarray, Sigma: np.ndarray, truth: np.ndarray) -> tuple:
    """Divide the Euclidean distance by the root of the mean variance."""
    return evaluate(x, Sigma, truth)[0], _each(x, Sigma, truth, _round)


def with_the_robot(x: np.ndarray, Sigma: np.ndarray, truth: np.ndarray) -> tuple:
    """Add the doubt about the robot to that about the landmark."""
    return evaluate(x, Sigma, truth)[0], _each(x, Sigma, truth, _wider)


def truth_overwritten(x: np.ndarray, Sigma: np.ndarray, truth: np.ndarray) -> tuple:
    """Subtract the estimate from the caller's truth in place."""
    found = evaluate(x, Sigma, truth)
    truth -= x[3:]
    return found


_TENTH = (
    "A landmark is 0.2 m off, in a direction in which its standard deviation is 0.1 m. How many are that?"
)
_NARROW = "Draw a long, narrow ellipse at 45 degrees, and two points equally far from its middle. Which is likelier?"


def _item(name: str, explanation: str, hint: str, function: Callable[..., tuple]) -> Misconception:
    return Misconception(name, _STAGE, explanation, hint, function)


MISCONCEPTIONS = (
    _item(
        "square of the Mahalanobis distance",
        "The root is forgotten. The square is the number that is chi-square distributed, but it is no distance: it "
        "does not count standard deviations.",
        _TENTH,
        squared,
    ),
    _item(
        "square of the Euclidean distance",
        "The root is forgotten: the result has the unit m^2, and small errors look smaller than they are.",
        "Which unit has a distance?",
        euclidean_squared,
    ),
    _item(
        "sum of the two coordinates",
        "The errors along x and along y are added. That is the way around a block of houses.",
        "A landmark is off by 3 m along x and 4 m along y. How far is that?",
        sum_of_both,
    ),
    _item(
        "covariance not inverted",
        "The error is multiplied by the covariance, where its inverse belongs: the distance grows with the doubt.",
        "A doubtful landmark and a well-known one are both 0.2 m off. Which error is the worse surprise?",
        not_inverted,
    ),
    _item(
        "covariance of x and y of a landmark dropped",
        "Only the variances of x and y are used. An ellipse that leans is replaced by one that stands upright.",
        _NARROW,
        variances_alone,
    ),
    _item(
        "blocks counted from the pose",
        "The block of landmark j is read off three rows too early, so that the doubt about the robot is among it.",
        "Write the indices of Sigma for three landmarks on paper.",
        blocks_from_the_pose,
    ),
    _item(
        "one spread for all directions",
        "The Euclidean distance is divided by one mean standard deviation. A landmark is known better along the ray "
        "than across it, or the other way round.",
        _NARROW,
        one_spread,
    ),
    _item(
        "doubt about the robot added",
        "The covariance of the pose is added to that of the landmark. The block of the landmark holds what the "
        "robot's doubt does to it already.",
        "Of which two points is the error, and does the robot's place occur in it?",
        with_the_robot,
    ),
    _item(
        "the caller's truth overwritten",
        "The estimate is subtracted from the truth in the array that the caller handed over.",
        "truth -= ... writes into the array that was handed over.",
        truth_overwritten,
    ),
)
