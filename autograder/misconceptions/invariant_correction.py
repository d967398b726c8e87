"""Wrong versions of `invariant.correct` (ERRATA R7, R8), as people write them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.invariant_prediction import matrix
from autograder.misconceptions.model import Misconception
from roboloc import se2
from roboloc_reference.invariant import correct

if TYPE_CHECKING:
    from collections.abc import Callable

_STAGE = "invariant.correct"


def _jacobian(points: np.ndarray) -> np.ndarray:
    """Return the rows of H for some points, stacked."""
    H = np.zeros((len(points), 2, 3))
    H[:, 0, 0] = H[:, 1, 1] = -1.0
    H[:, 0, 2], H[:, 1, 2] = points[:, 1], -points[:, 0]
    return H.reshape(-1, 3)


def _right_H(_X: np.ndarray, _Y: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    return _jacobian(landmarks)


def _transposed_hat(_X: np.ndarray, _Y: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    return _jacobian(landmarks) * [0.0, 0.0, -1.0]


def _one_sign(_X: np.ndarray, _Y: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    H = _jacobian(landmarks)
    H[1::2, 2] *= -1
    return H


def _at_the_sight(_X: np.ndarray, Y: np.ndarray, _landmarks: np.ndarray) -> np.ndarray:
    return _jacobian(Y)


def _about_the_robot(X: np.ndarray, _Y: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    return _jacobian(landmarks - X[:2, 2])


def _right_v(X: np.ndarray, Y: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    return (Y @ X[:2].T - landmarks).ravel()


def _transposed_v(X: np.ndarray, Y: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    return (Y @ X[:, :2] - landmarks).ravel()


def _in_the_robot(X: np.ndarray, Y: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    return (Y[:, :2] - (landmarks - X[:2, 2]) @ X[:2, :2]).ravel()


def _right_N(R: np.ndarray, N: np.ndarray) -> np.ndarray:
    return R @ N @ R.T


def _by_exp(X: np.ndarray, xi: np.ndarray) -> np.ndarray:
    return matrix(se2.exp(xi)) @ X


def _on_the_right(X: np.ndarray, xi: np.ndarray) -> np.ndarray:
    return X @ matrix(se2.exp(xi))


def _added(X: np.ndarray, xi: np.ndarray) -> np.ndarray:
    return matrix(np.array([*X[:2, 2], np.arctan2(X[1, 0], X[0, 0])]) + xi)


def _update(
    jacobian: Callable = _right_H,
    innovation: Callable = _right_v,
    noise: Callable = _right_N,
    applied: Callable = _by_exp,
    joseph: float = 1.0,
) -> Callable[..., tuple]:
    """Make a correction of which one part is another."""

    def function(X, P, Y, landmarks, N) -> tuple:  # noqa: ANN001
        k = len(landmarks)
        if k == 0:
            return X.copy(), P.copy()
        H, v = jacobian(X, Y, landmarks), innovation(X, Y, landmarks)
        Nbar = np.kron(np.eye(k), noise(X[:2, :2], N))
        L = np.linalg.solve(H @ P @ H.T + Nbar, H @ P).T
        A = np.eye(3) - L @ H
        return applied(X, L @ v), A @ P @ A.T + joseph * L @ Nbar @ L.T

    return function


def _kept(X, P, Y, landmarks, N) -> tuple:  # noqa: ANN001
    return correct(X, P, Y, landmarks, N)[0], P.copy()


def _first_alone(X, P, Y, landmarks, N) -> tuple:  # noqa: ANN001
    return correct(X, P, Y[:1], landmarks[:1], N)


def _overwritten(X, P, Y, landmarks, N) -> tuple:  # noqa: ANN001
    after, Sigma = correct(X, P, Y, landmarks, N)
    P[...] = Sigma
    return after, P


_PLACE = "Put the robot at (2, 1), facing left, and a landmark 1 m ahead of it. Where in the world is that, by your X?"
_SMALL = "Move the whole world by a small xi. By how much does the landmark move in x, if xi is a turn alone?"
_NOISE = "A sensor is good along its ray and poor across. Which direction of the world is that for a robot facing up?"
_SIDE = "In this notebook estimate = exp(xi) truth. On which side of the estimate must a correction stand?"
MISCONCEPTIONS = (
    Misconception(
        "transpose of the pose in the innovation",
        _STAGE,
        "What is seen is multiplied by the transpose of X, as the source prints it. A rotation is undone by its "
        "transpose, a pose is not, and undoing is not what is needed: what is seen has to go into the world.",
        _PLACE,
        _update(innovation=_transposed_v),
    ),
    Misconception(
        "transpose of the error in H",
        _STAGE,
        "The error stands transposed before b, as the source prints it. It is the matrix of the twist that moves a "
        "point; its transpose loses the shift.",
        "The whole world is shifted by 1 cm along x. By how much is then each landmark off?",
        _update(jacobian=_transposed_hat),
    ),
    Misconception(
        "correction the wrong way",
        _STAGE,
        "H or the innovation has the other sign, so that every correction doubles the error.",
        "The landmark is seen nearer than expected. Which way must the robot move?",
        _update(innovation=lambda *args: -_right_v(*args)),
    ),
    Misconception(
        "both signs of the turn alike",
        _STAGE,
        "The two entries of H for omega have the same sign. A turn moves a point at right angles to where it is.",
        _SMALL,
        _update(jacobian=_one_sign),
    ),
    Misconception(
        "H of what is seen",
        _STAGE,
        "The place of the landmark in the robot's frame stands in H. That is the Jacobian of an error in the "
        "robot's frame.",
        _SIDE,
        _update(jacobian=_at_the_sight),
    ),
    Misconception(
        "turn about the robot in H",
        _STAGE,
        "The entries for omega hold the landmark less the robot, as for the error of x, y and theta. A turn of the "
        "whole world is one about its origin.",
        _SMALL,
        _update(jacobian=_about_the_robot),
    ),
    Misconception(
        "innovation in the robot's frame",
        _STAGE,
        "What is seen is compared in the robot's frame, while H and the noise are those of the world.",
        _PLACE,
        _update(innovation=_in_the_robot),
    ),
    Misconception(
        "noise not turned into the world",
        _STAGE,
        "N is used as it is. It is given in the robot's frame, and the innovation is one of the world.",
        _NOISE,
        _update(noise=lambda _R, N: N),
    ),
    Misconception(
        "noise turned the other way",
        _STAGE,
        "N stands between the transpose of the rotation and the rotation, which turns it by the opposite angle.",
        _NOISE,
        _update(noise=lambda R, N: R.T @ N @ R),
    ),
    Misconception(
        "correction on the right of the pose",
        _STAGE,
        "The correction is applied in the robot's frame: X exp(L v). The error of this notebook is on the left.",
        _SIDE,
        _update(applied=_on_the_right),
    ),
    Misconception(
        "correction added to x, y and theta",
        _STAGE,
        "The three numbers L v are added to position and heading. They are a twist about the origin of the world.",
        "L v is a turn alone, and the robot is at (2, 0). Does it stay where it is?",
        _update(applied=_added),
    ),
    Misconception(
        "noise left out of the covariance after",
        _STAGE,
        "The first term of the covariance stands alone, so that the noise of the sensor counts in the gain only. "
        "The filter is too sure.",
        "How many terms has the covariance of (I - L H) xi + L times noise?",
        _update(joseph=0.0),
    ),
    Misconception(
        "covariance as before",
        _STAGE,
        "The covariance is returned as it was. What has been seen makes the belief narrower.",
        "Which of your two results has changed?",
        _kept,
    ),
    Misconception(
        "first landmark alone",
        _STAGE,
        "Only the first landmark is used, however many are seen; the others are thrown away.",
        "How many rows has Y, and how many numbers your innovation?",
        _first_alone,
    ),
    Misconception(
        "the caller's covariance overwritten",
        _STAGE,
        "The covariance that was given is written to. The caller's prediction is gone.",
        "Which operations make a new array, and which write into the old one?",
        _overwritten,
    ),
)
