"""Wrong versions of `landmarks.update`: corrections by looks at landmarks as people write them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception

if TYPE_CHECKING:
    from collections.abc import Callable

_STAGE = "landmarks.update"


def _stack(x: np.ndarray, z: np.ndarray, *, wrap: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Return innovation and derivative of looks at all landmarks."""
    k = len(z) // 2
    v, H = np.zeros(2 * k), np.zeros((2 * k, 3 + 2 * k))
    for j in range(k):
        at, i = 3 + 2 * j, 2 * j
        dx, dy = x[at] - x[0], x[at + 1] - x[1]
        q = dx * dx + dy * dy
        off = z[i] - np.arctan2(dy, dx) + x[2]
        v[i] = (off + np.pi) % (2.0 * np.pi) - np.pi if wrap else off
        v[i + 1] = z[i + 1] - np.sqrt(q)
        by_place = np.array([[-dy / q, dx / q], [dx / np.sqrt(q), dy / np.sqrt(q)]])
        H[i : i + 2, :2], H[i, 2], H[i : i + 2, at : at + 2] = -by_place, -1.0, by_place
    return v, H


def _condition(x: np.ndarray, Sigma: np.ndarray, v: np.ndarray, H: np.ndarray, R: np.ndarray) -> tuple:
    """Correct by an innovation whose noise has the covariance R."""
    K = np.linalg.solve(H @ Sigma @ H.T + R, H @ Sigma).T
    A = np.eye(len(x)) - K @ H
    return x + K @ v, A @ Sigma @ A.T + K @ R @ K.T


def _noises(Q: np.ndarray, k: int) -> np.ndarray:
    """Return the covariance of the noise of k looks."""
    return np.kron(np.eye(k), Q)


def _right(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray) -> tuple:
    """Return the right correction."""
    v, H = _stack(x, z)
    return _condition(x, Sigma, v, H, _noises(Q, len(z) // 2))


def not_wrapped(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray) -> tuple:
    """Leave the difference of two bearings in the turn in which it comes out.

    The predicted bearing is in one turn, as `measurement` returns it.
    """
    v, H = _stack(x, z)
    seen = z[::2] - v[::2]
    v[::2] = z[::2] - ((seen + np.pi) % (2.0 * np.pi) - np.pi)
    return _condition(x, Sigma, v, H, _noises(Q, len(z) // 2))


def predicted_minus_seen(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray) -> tuple:
    """Take the innovation the other way round."""
    v, H = _stack(x, z)
    return _condition(x, Sigma, -v, H, _noises(Q, len(z) // 2))


def noise_of_the_range_first(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray) -> tuple:
    """Read Q as that of range and bearing."""
    v, H = _stack(x, z)
    return _condition(x, Sigma, v, H, _noises(Q[::-1, ::-1], len(z) // 2))


def no_noise(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray) -> tuple:
    """Leave the noise of the looks out of S."""
    v, H = _stack(x, z)
    return _condition(x, Sigma, v, H, 0.0 * _noises(Q, len(z) // 2))


def correlations_dropped(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray) -> tuple:
    """Take pose and landmarks for independent before the look."""
    v, H = _stack(x, z)
    owner = np.concatenate([[-1, -1, -1], np.arange(len(z)) // 2])
    apart = np.where(owner[:, None] == owner, Sigma, 0.0)
    return _condition(x, apart, v, H, _noises(Q, len(z) // 2))


def one_after_the_other(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray) -> tuple:
    """Use one landmark after the other, each where the mean has gone by then."""
    for j in range(len(z) // 2):
        v, H = _stack(x, z)
        at = slice(2 * j, 2 * j + 2)
        x, Sigma = _condition(x, Sigma, v[at], H[at], Q)
    return x, Sigma


def all_in_the_first(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray) -> tuple:
    """Write the derivative by each landmark into the columns of the first."""
    v, H = _stack(x, z)
    for i in range(2, len(z), 2):
        H[i : i + 2, 3:5] = H[i : i + 2, 3 + i : 5 + i]
        H[i : i + 2, 3 + i : 5 + i] = 0.0
    return _condition(x, Sigma, v, H, _noises(Q, len(z) // 2))


def map_taken_for_certain(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray) -> tuple:
    """Leave the derivative by the landmarks out."""
    v, H = _stack(x, z)
    H[:, 3:] = 0.0
    return _condition(x, Sigma, v, H, _noises(Q, len(z) // 2))


def pose_alone(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray) -> tuple:
    """Correct the pose and leave the landmarks where they were."""
    after, Sigma = _right(x, Sigma, z, Q)
    return np.concatenate([after[:3], x[3:]]), Sigma


def as_before(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray) -> tuple:
    """Return the covariance before the look."""
    return _right(x, Sigma, z, Q)[0], Sigma.copy()


def gain_without_noise(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray) -> tuple:
    """Forget what the noise of the looks does to the estimate."""
    v, H = _stack(x, z)
    K = np.linalg.solve(H @ Sigma @ H.T + _noises(Q, len(z) // 2), H @ Sigma).T
    A = np.eye(len(x)) - K @ H
    return x + K @ v, A @ Sigma @ A.T


def state_overwritten(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray) -> tuple:
    """Correct the caller's state in place."""
    x[...], after = _right(x, Sigma, z, Q)
    return x.copy(), after


_SHARED = "The robot sees landmark 0 further to the left than expected. What does that say of landmark 1?"
_ONE = "Take one number alone, with a variance of 3 before and a look of variance 1. What is left, and why?"


def _item(name: str, explanation: str, hint: str, function: Callable[..., tuple]) -> Misconception:
    return Misconception(name, _STAGE, explanation, hint, function)


MISCONCEPTIONS = (
    _item(
        "innovation not wrapped",
        "Observed and expected bearing are subtracted and left as they come out. On two sides of straight back they "
        "are a full turn apart, and the filter jumps.",
        "A landmark behind is expected at 3.1 rad and seen at -3.1 rad: how far off is it?",
        not_wrapped,
    ),
    _item(
        "expected minus observed",
        "The innovation has the wrong sign, and each look pushes pose and map away from what was seen.",
        "The landmark is seen nearer than expected. Is the believed distance too large or too small?",
        predicted_minus_seen,
    ),
    _item(
        "noise of the range first",
        "The two numbers of Q are used in the other order. The first one belongs to the bearing.",
        "Which unit has Q[0, 0]?",
        noise_of_the_range_first,
    ),
    _item(
        "looks without noise",
        "S holds the doubt about robot and map alone, without the noise of the looks: each look is believed outright.",
        "Let the sensor get worse and worse: what must the gain do?",
        no_noise,
    ),
    _item(
        "correlations dropped before the look",
        "Pose and landmarks are treated as independent when the gain is computed. What they have in common is what "
        "makes SLAM work.",
        _SHARED,
        correlations_dropped,
    ),
    _item(
        "linearized anew for each landmark",
        "The landmarks are used one after the other, and each is linearized where the one before has moved the mean. "
        "That is a filter too, but not the one that is asked for: its result depends on the order of the landmarks.",
        "About which x does the docstring ask you to linearize?",
        one_after_the_other,
    ),
    _item(
        "all landmarks in the columns of the first",
        "The derivative by each landmark stands in columns 3 and 4 of H, where that of the first belongs.",
        "Which numbers of x does the look at landmark 1 depend on?",
        all_in_the_first,
    ),
    _item(
        "map taken for certain",
        "H has the derivative by the pose alone, as in localization with a known map. The doubt about the landmarks "
        "is then missing from S.",
        "The landmark itself is in doubt by 1 m, the robot is not. How far should the robot follow a look?",
        map_taken_for_certain,
    ),
    _item(
        "pose corrected and map not",
        "The mean of the landmarks stays where it was at the start. A look at a landmark says where it is, too.",
        "The pose is known exactly, and a landmark is seen 10 cm further away than expected. What has to move?",
        pose_alone,
    ),
    _item(
        "covariance as before the look",
        "The covariance does not shrink, so that the filter never becomes surer by looking.",
        _ONE,
        as_before,
    ),
    _item(
        "noise of the looks left out of the covariance",
        "(I - K H) stands on both sides of Sigma, and the error that the looks bring in with K is missing.",
        "Two things make a corrected estimate wrong. Which one is not in your Sigma?",
        gain_without_noise,
    ),
    _item(
        "the caller's state corrected in place",
        "The corrected state is written into the argument x, which the caller may still need.",
        "x += ... changes the array that was handed over; what does x = x + ... do?",
        state_overwritten,
    ),
)
