"""Wrong versions of `ukf.correct` (ERRATA R3, R5), as people write them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.ukf import correct

if TYPE_CHECKING:
    from collections.abc import Callable

_STAGE = "ukf.correct"


def _wrapped(angles: np.ndarray) -> np.ndarray:
    return (angles + np.pi) % (2 * np.pi) - np.pi


def _seen(points: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    """Return what each point sees: bearings in one turn, and ranges."""
    d = landmarks - points[:, None, :2]
    bearings = _wrapped(np.arctan2(d[..., 1], d[..., 0]) - points[:, 2:])
    return np.stack([bearings, np.hypot(d[..., 0], d[..., 1])], axis=2).reshape(len(points), -1)


def _points(mean: np.ndarray, cov: np.ndarray, kappa: float) -> tuple:
    rows = np.linalg.cholesky((3 + kappa) * cov).T
    weights = np.array([kappa, *[0.5] * 6]) / (3 + kappa)
    return np.concatenate([mean[None], mean + rows, mean - rows]), weights


def _averaged(h: np.ndarray, weights: np.ndarray) -> tuple:
    """Return the mean of what is seen, and how far each point is from it."""
    e = h - h[0]
    e[:, ::2] = _wrapped(e[:, ::2])
    average = weights @ e
    return h[0] + average, e - average if weights[0] >= 0 else e


def _about_the_mean(h: np.ndarray, weights: np.ndarray) -> tuple:
    """Take the squares about the mean, whatever the sign of kappa."""
    e = h - h[0]
    e[:, ::2] = _wrapped(e[:, ::2])
    return h[0] + weights @ e, e - weights @ e


def _as_numbers(h: np.ndarray, weights: np.ndarray) -> tuple:
    """Average bearings as numbers, and do not wrap the differences."""
    average = weights @ h
    return average, h - (average if weights[0] >= 0 else h[0])


def _residuals_as_numbers(h: np.ndarray, weights: np.ndarray) -> tuple:
    """Average the right way, and do not wrap the differences."""
    average = _averaged(h, weights)[0]
    average[::2] = _wrapped(average[::2])
    return average, h - (average if weights[0] >= 0 else h[0])


def _by_vectors(h: np.ndarray, weights: np.ndarray) -> tuple:
    """Average bearings by the sum of their unit vectors."""
    average, e = _averaged(h, weights)
    sines, cosines = weights @ np.sin(h[:, ::2]), weights @ np.cos(h[:, ::2])
    direction = np.arctan2(sines, cosines)
    average[::2] = direction
    return average, e


def _by_the_centre(h: np.ndarray, weights: np.ndarray) -> tuple:
    """Expect what the centre sees."""
    return h[0], _averaged(h, weights)[1]


def _update(
    averaged: Callable, noise: Callable, turn: Callable, after: Callable
) -> Callable[..., tuple[np.ndarray, np.ndarray]]:
    """Make a correction of which one part is another."""

    def function(mean, cov, z, landmarks, Q, kappa) -> tuple:  # noqa: ANN001
        if len(z) == 0:
            return mean.copy(), cov.copy()
        points, weights = _points(mean, cov, kappa)
        expected, e = averaged(_seen(points, landmarks), weights)
        v = turn(z - expected)
        weighted = e.T * weights
        S = weighted @ e + noise(np.kron(np.eye(len(landmarks)), Q), v)
        K = np.linalg.solve(S, weighted @ (points - mean)).T
        return mean + K @ v, after(cov, K, S)

    return function


def _plain(R: np.ndarray, _v: np.ndarray) -> np.ndarray:
    return R


def _no_noise(R: np.ndarray, _v: np.ndarray) -> np.ndarray:
    return 1e-9 * R


def _innovation_as_noise(R: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.outer(v, v) * R


def _roots(R: np.ndarray, _v: np.ndarray) -> np.ndarray:
    return np.diag(np.sqrt(np.diag(R)))


def _on_the_circle(v: np.ndarray) -> np.ndarray:
    return np.stack([_wrapped(v[::2]), v[1::2]], axis=1).ravel()


def _number(v: np.ndarray) -> np.ndarray:
    return v


def _wrapped_expectation(h: np.ndarray, weights: np.ndarray) -> tuple:
    """Return the mean in one turn."""
    average, e = _averaged(h, weights)
    average[::2] = _wrapped(average[::2])
    return average, e


def _smaller(cov: np.ndarray, K: np.ndarray, S: np.ndarray) -> np.ndarray:
    return cov - K @ S @ K.T


def expected_minus_seen(mean, cov, z, landmarks, Q, kappa) -> tuple:  # noqa: ANN001
    """Go the other way."""
    after, Sigma = correct(mean, cov, z, landmarks, Q, kappa)
    return 2 * mean - after, Sigma


def covariance_kept(mean, cov, z, landmarks, Q, kappa) -> tuple:  # noqa: ANN001
    """Return the covariance from before."""
    return correct(mean, cov, z, landmarks, Q, kappa)[0], cov.copy()


def covariance_grown(mean, cov, z, landmarks, Q, kappa) -> tuple:  # noqa: ANN001
    """Add what should be subtracted."""
    after, Sigma = correct(mean, cov, z, landmarks, Q, kappa)
    return after, 2 * cov - Sigma


def first_landmark_alone(mean, cov, z, landmarks, Q, kappa) -> tuple:  # noqa: ANN001
    """Use the first landmark alone."""
    return correct(mean, cov, z[:2], landmarks[:1], Q, kappa)


def mean_overwritten(mean, cov, z, landmarks, Q, kappa) -> tuple:  # noqa: ANN001
    """Correct the caller's mean in place."""
    after, Sigma = correct(mean, cov, z, landmarks, Q, kappa)
    mean[...] = after
    return mean, Sigma


_BACK = "A landmark almost straight behind: print what each of the seven points sees, and what you subtract from it."
_SUMS = (
    "S is the covariance of what is seen: that of the seven points, and what the sensor adds. In which units?"
)
MISCONCEPTIONS = (
    Misconception(
        "innovation not wrapped",
        _STAGE,
        "Seen less expected may be almost a whole turn where a landmark is straight behind, and is taken as such.",
        _BACK,
        _update(_wrapped_expectation, _plain, _number, _smaller),
    ),
    Misconception(
        "bearings averaged as numbers",
        _STAGE,
        "The seven bearings are averaged as numbers, as the source has it. Of 3.1 and -3.1 the mean is 0: the landmark "
        "behind is expected in front.",
        _BACK,
        _update(_as_numbers, _plain, _on_the_circle, _smaller),
    ),
    Misconception(
        "residuals not wrapped",
        _STAGE,
        "The mean is one on the circle, but the differences from it are those of numbers. A point on the other side "
        "of the cut then counts as off by a whole turn, and S becomes huge.",
        _BACK,
        _update(_residuals_as_numbers, _plain, _on_the_circle, _smaller),
    ),
    Misconception(
        "bearings averaged as vectors",
        _STAGE,
        "The mean bearing is the direction of the weighted sum of unit vectors. For small spreads that is nearly the "
        "mean of the wrapped residuals, but not it; and with a negative weight the sum can point the wrong way.",
        "The notebook says how bearings are averaged: from where are the residuals taken, and what is done to them?",
        _update(_by_vectors, _plain, _on_the_circle, _smaller),
    ),
    Misconception(
        "expected from the centre alone",
        _STAGE,
        "What is expected is what the centre sees. The average of the seven views is another: seen from a cloud a "
        "landmark is farther away than from its middle.",
        "Which sum over the points is missing in your innovation?",
        _update(_by_the_centre, _plain, _on_the_circle, _smaller),
    ),
    Misconception(
        "noise of the sensor left out of S",
        _STAGE,
        "S is the covariance of the seven views alone, so that the sensor is believed to the last digit.",
        _SUMS,
        _update(_averaged, _no_noise, _on_the_circle, _smaller),
    ),
    Misconception(
        "innovation in the place of the noise",
        _STAGE,
        "The innovation is multiplied into the noise, as in the S that the source prints. S says how far off an "
        "observation may be before it is made; it cannot depend on how far off this one is.",
        _SUMS,
        _update(_averaged, _innovation_as_noise, _on_the_circle, _smaller),
    ),
    Misconception(
        "standard deviations of the sensor",
        _STAGE,
        "The roots of Q's diagonal stand in S. Q is a covariance already.",
        _SUMS,
        _update(_averaged, _roots, _on_the_circle, _smaller),
    ),
    Misconception(
        "squares of the views about their mean with a negative weight",
        _STAGE,
        "With a negative weight in the centre the squares are still taken about the mean, where the centre's own "
        "square counts against the others.",
        "About which point has the centre's square no weight at all?",
        _update(_about_the_mean, _plain, _on_the_circle, _smaller),
    ),
    Misconception(
        "expected minus seen",
        _STAGE,
        "The innovation has the other sign, so that every correction doubles the error instead of removing it.",
        "A landmark is seen nearer than expected: which way must the robot move?",
        expected_minus_seen,
    ),
    Misconception(
        "covariance as before",
        _STAGE,
        "The covariance is returned as it was. What has been seen makes the belief narrower.",
        "Which of your two results has changed?",
        covariance_kept,
    ),
    Misconception(
        "covariance larger than before",
        _STAGE,
        "What the observation takes off the covariance is added to it.",
        "Look at the diagonal before and after.",
        covariance_grown,
    ),
    Misconception(
        "first landmark alone",
        _STAGE,
        "Only the first landmark is used, however many are seen; the others are thrown away.",
        "How many numbers does z have, and how many does your innovation?",
        first_landmark_alone,
    ),
    Misconception(
        "the caller's mean overwritten",
        _STAGE,
        "The mean that was given is corrected in place. The caller's prediction is gone.",
        "Which operations make a new array, and which write into the old one?",
        mean_overwritten,
    ),
)
