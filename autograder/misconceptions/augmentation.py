"""Wrong versions of `slam.augment`: of what a new line has to do with all else. ERRATA C10 is among them."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.slam import augment

_STAGE = "slam.augment"


def zero_cross_covariance(
    x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, tf: np.ndarray
) -> tuple:
    """Take the new line to have nothing to do with what is known (ERRATA C10)."""
    x, grown = augment(x, Sigma, z, Q, tf)
    grown[-2:, :-2] = 0.0
    grown[:-2, -2:] = 0.0
    return x, grown


def identity_cross_covariance(
    x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, tf: np.ndarray
) -> tuple:
    """Take over the first rows of the covariance, as if the line were the place of the robot (ERRATA C10)."""
    x, grown = augment(x, Sigma, z, Q, tf)
    grown[-2:, :-2] = Sigma[:2]
    grown[:-2, -2:] = Sigma[:2].T
    return x, grown


def cross_with_the_pose_alone(
    x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, tf: np.ndarray
) -> tuple:
    """Fill in the covariance with the pose, and leave that with the map at 0."""
    x, grown = augment(x, Sigma, z, Q, tf)
    grown[-2:, 3:-2] = 0.0
    grown[3:-2, -2:] = 0.0
    return x, grown


def one_side_alone(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, tf: np.ndarray) -> tuple:
    """Fill in the rows of the new line, and not its columns."""
    x, grown = augment(x, Sigma, z, Q, tf)
    grown[:-2, -2:] = 0.0
    return x, grown


def pose_taken_for_certain(
    x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, tf: np.ndarray
) -> tuple:
    """Give the new line the error of the observation alone."""
    right, grown = augment(x, Sigma, z, Q, tf)
    grown[-2:, -2:] = augment(x, 0 * Sigma, z, Q, tf)[1][-2:, -2:]
    return right, grown


def observation_taken_for_certain(
    x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, tf: np.ndarray
) -> tuple:
    """Give the new line the error of the pose alone."""
    right, grown = augment(x, Sigma, z, Q, tf)
    grown[-2:, -2:] = augment(x, Sigma, z, 0 * Q, tf)[1][-2:, -2:]
    return right, grown


def covariance_as_seen(
    x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, tf: np.ndarray
) -> tuple:
    """Add Q as it is, without the derivative by the observation."""
    right, grown = augment(x, Sigma, z, Q, tf)
    grown[-2:, -2:] = augment(x, Sigma, z, 0 * Q, tf)[1][-2:, -2:] + Q
    return right, grown


def behind_the_pose(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, tf: np.ndarray) -> tuple:
    """Put the new line in front of the map."""
    n = len(x)
    order = np.concatenate([[0, 1, 2, n, n + 1], np.arange(3, n)])
    x, grown = augment(x, Sigma, z, Q, tf)
    return x[order], grown[np.ix_(order, order)]


def line_as_seen(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, tf: np.ndarray) -> tuple:
    """Append the observation itself to the state."""
    _, grown = augment(x, Sigma, z, Q, tf)
    return np.concatenate([x, z]), grown


def covariance_overwritten(
    x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, tf: np.ndarray
) -> tuple:
    """Turn the caller's Q on the way."""
    right, grown = augment(x, Sigma, z, Q, tf)
    Q += grown[-2:, -2:]
    return right, grown


_SAME = "The robot is in fact 10 cm to the left of where it thinks: by how much is the new line off?"
MISCONCEPTIONS = (
    Misconception(
        "new line independent",
        _STAGE,
        "The covariances of the new line with all else are 0, as a published solution of another course has it. The "
        "filter then counts the error of the pose twice, once in the pose and once in the line, and gets too sure of "
        "itself.",
        _SAME,
        zero_cross_covariance,
    ),
    Misconception(
        "new line taken for the place of the robot",
        _STAGE,
        "The covariances of the new line are those of the place of the robot, as if the derivative by the pose were an "
        "identity. It is one of angle and distance by the pose, and that is another matrix.",
        _SAME,
        identity_cross_covariance,
    ),
    Misconception(
        "covariance with the map left out",
        _STAGE,
        "The covariance with the pose is there, and that with the lines of the map is 0. What has to do with the pose "
        "has to do with all that was placed from it.",
        "Two walls were placed from the same wrong pose: have their errors to do with each other?",
        cross_with_the_pose_alone,
    ),
    Misconception(
        "covariance on one side",
        _STAGE,
        "The rows of the new line are filled in, and its columns are not: the matrix is not symmetric.",
        "Compare Sigma with its transpose.",
        one_side_alone,
    ),
    Misconception(
        "new line from a certain pose",
        _STAGE,
        "The covariance of the new line is that of a line seen from a pose that is known exactly.",
        "How well can a line be known that was placed from a place known to a metre?",
        pose_taken_for_certain,
    ),
    Misconception(
        "new line from an exact scan",
        _STAGE,
        "The covariance of the new line leaves out the error of the observation: Q is not used.",
        "Which of the arguments does your function not use?",
        observation_taken_for_certain,
    ),
    Misconception(
        "Q not carried into the world",
        _STAGE,
        "Q is added as it is. It is the covariance of the line in the frame of the scanner: an error of its angle "
        "turns the line about the scanner, and changes its distance from the origin.",
        "Through which derivative does an error of the observation reach the line?",
        covariance_as_seen,
    ),
    Misconception(
        "new line in front of the map",
        _STAGE,
        "The new line is put between the pose and the map. Line j of the map has to stay line j.",
        "Print x before and after: which numbers have moved?",
        behind_the_pose,
    ),
    Misconception(
        "line appended as it is seen",
        _STAGE,
        "The observation itself is appended to the state, in the frame of the scanner. The map is one of the world.",
        "In which frame are the other lines of the state?",
        line_as_seen,
    ),
    Misconception(
        "the caller's Q overwritten",
        _STAGE,
        "Q is changed in place on the way. The caller still needs the covariance of what was seen.",
        "Q += ... writes into the caller's array; which operation makes a new one?",
        covariance_overwritten,
    ),
)
