"""Wrong versions of `measurement_update`: the short forms of the covariance (ERRATA H8), and what people write."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.checks.correction import ill_conditioned, short_form
from autograder.misconceptions.model import Misconception
from roboloc_reference.gaussian import measurement_update

if TYPE_CHECKING:
    from collections.abc import Callable

_UPDATE = "gaussian.measurement_update"
_ONE = "Do it for one number by hand: prior variance 4, observation variance 1, H = 1. What do you get for Sigma?"


def _well_conditioned(*args: Any) -> bool:
    return not ill_conditioned(args)


def _short_of_rank(_x: Any, _Sigma: Any, z: np.ndarray, _Q: Any, H: np.ndarray) -> bool:
    return len(z) > H.shape[1]


def _joseph(Sigma: np.ndarray, K: np.ndarray, H: np.ndarray, Q: np.ndarray) -> np.ndarray:
    A = np.eye(len(Sigma)) - K @ H
    Sigma = A @ Sigma @ A.T + K @ Q @ K.T
    return (Sigma + Sigma.T) / 2


def _gain(wrong: Callable[..., np.ndarray]) -> Callable[..., tuple]:
    """Make an update with another gain, whose covariance is computed as if the gain were right."""

    def function(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, H: np.ndarray) -> tuple:
        if not len(z):
            return x.copy(), Sigma.copy()
        K = wrong(Sigma, Q, H)
        return x + K @ z, _joseph(Sigma, K, H, Q)

    return function


def _result(wrong: Callable[..., dict[str, np.ndarray]]) -> Callable[..., tuple]:
    """Make an update of which the mean or the covariance is another, from the right gain."""

    def function(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, H: np.ndarray) -> tuple:
        right = dict(zip(("x", "Sigma"), measurement_update(x, Sigma, z, Q, H), strict=True))
        S = H @ Sigma @ H.T + Q
        K = np.linalg.solve(S, H @ Sigma).T
        return tuple((right | wrong(x, Sigma, z, Q, H, S, K)).values())

    return function


def arguments_overwritten(
    x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, H: np.ndarray
) -> tuple:
    """Update the caller's mean in place."""
    results = measurement_update(x, Sigma, z, Q, H)
    x[...] = results[0]
    return results


MISCONCEPTIONS = (
    Misconception(
        "a variance can become negative",
        _UPDATE,
        "The covariance is computed as a difference, Sigma - K S K^T or (I - K H) Sigma. On paper both are right. "
        "When two sharp observations say nearly the same thing, the difference of nearly equal numbers is rounding, "
        "and a variance comes out negative.",
        "There is a third form, a sum of two products A P A^T. Whose name does it bear?",
        short_form,
        _well_conditioned,
    ),
    Misconception(
        "noise of the observation left out of S",
        _UPDATE,
        "S holds the doubt about the state alone, so that the gain follows the observation all the way, however "
        "noisy it is.",
        _ONE,
        _gain(lambda Sigma, _Q, H: Sigma @ H.T @ np.linalg.pinv(H @ Sigma @ H.T)),
        lambda *args: _well_conditioned(*args) and not _short_of_rank(*args),
    ),
    Misconception(
        "Q inverted in the place of S",
        _UPDATE,
        "The gain divides by Q instead of S. It grows without bound where the prior is poor, and the mean overshoots.",
        _ONE,
        _gain(lambda Sigma, Q, H: np.linalg.solve(Q, H @ Sigma).T),
        _well_conditioned,
    ),
    Misconception(
        "S inverted entry by entry",
        _UPDATE,
        "Every entry of S is inverted on its own: 1 / S and S**-1 do that to an array. For one number it is the "
        "inverse, for a matrix it is not.",
        "Multiply your inverse of S by S: what should come out?",
        _gain(lambda Sigma, Q, H: Sigma @ H.T @ (1 / (H @ Sigma @ H.T + Q))),
        _well_conditioned,
    ),
    Misconception(
        "mean moved the wrong way",
        _UPDATE,
        "The correction is subtracted from the mean, and every observation pushes the state away from itself.",
        "The innovation is observed minus expected. If H = 1 and it is positive, is the state too small or too large?",
        _result(lambda x, _Sigma, z, _Q, _H, _S, K: {"x": x - K @ z}),
    ),
    Misconception(
        "expectation subtracted twice",
        _UPDATE,
        "The correction uses z - H x, as for a linear observation z. Here z is the innovation already: what was "
        "expected has been subtracted before.",
        "Read in the docstring what z is.",
        _result(lambda x, _Sigma, z, _Q, H, _S, K: {"x": x + K @ (z - H @ x)}),
    ),
    Misconception(
        "mean not corrected",
        _UPDATE,
        "The mean is what it was before the observation: the filter becomes surer of where it was wrong.",
        "What is the gain for, if not for the mean?",
        _result(lambda x, *_: {"x": x.copy()}),
    ),
    Misconception(
        "covariance not corrected",
        _UPDATE,
        "The covariance is what it was before the observation, so the filter learns where it is and never becomes "
        "surer of it.",
        _ONE,
        _result(lambda _x, Sigma, *_: {"Sigma": Sigma.copy()}),
    ),
    Misconception(
        "covariance grows",
        _UPDATE,
        "K S K^T is added to the covariance. An observation never makes a Gaussian wider.",
        _ONE,
        _result(lambda _x, Sigma, _z, _Q, _H, S, K: {"Sigma": Sigma + K @ S @ K.T}),
    ),
    Misconception(
        "Q in the place of S in the covariance",
        _UPDATE,
        "K Q K^T is subtracted where K S K^T belongs, so that a precise observation makes the filter hardly surer.",
        _ONE,
        _result(lambda _x, Sigma, _z, Q, _H, _S, K: {"Sigma": Sigma - K @ Q @ K.T}),
    ),
    Misconception(
        "half of Joseph's form",
        _UPDATE,
        "(I - K H) stands on both sides of Sigma, and the noise K Q K^T that the observation brings in is missing. "
        "The filter becomes too sure of itself.",
        "Two things make the corrected estimate wrong. Which one did you leave out?",
        _result(
            lambda _x, Sigma, _z, _Q, H, _S, K: {
                "Sigma": (np.eye(len(Sigma)) - K @ H) @ Sigma @ (np.eye(len(Sigma)) - K @ H).T
            }
        ),
    ),
    Misconception(
        "K H Sigma kept, not taken away",
        _UPDATE,
        "The covariance returned is the part that the observation explains, and it is the rest that remains.",
        "If the observation is useless, K is 0. What must Sigma be then?",
        _result(lambda _x, Sigma, _z, _Q, H, _S, K: {"Sigma": K @ H @ Sigma}),
    ),
    Misconception(
        "the caller's mean overwritten",
        _UPDATE,
        "The function writes the new mean into the argument x. In Python an array that is handed over is not "
        "copied: x += ... changes the caller's.",
        "x = x + ... makes a new array; what does x += ... do?",
        arguments_overwritten,
    ),
)
