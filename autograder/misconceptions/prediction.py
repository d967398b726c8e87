"""Wrong versions of `transition_update`: faults of the source handouts (ERRATA H1), and what people write."""

from __future__ import annotations

from typing import Any

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.gaussian import transition_update

_TRANSITION = "gaussian.transition_update"


def _transition(fault: Any) -> Any:
    """Make a wrong prediction step from a formula of its covariance."""

    def function(
        g: np.ndarray, Gx: np.ndarray, Gu: np.ndarray, Sigma: np.ndarray, R: np.ndarray, dt: float
    ) -> tuple:
        return g.copy(), fault(Gx, Gu, Sigma, R, dt)

    return function


def mean_moved_twice(
    g: np.ndarray, Gx: np.ndarray, Gu: np.ndarray, Sigma: np.ndarray, R: np.ndarray, dt: float
) -> tuple:
    """Apply the Jacobian to a mean that has moved already."""
    return Gx @ g, transition_update(g, Gx, Gu, Sigma, R, dt)[1]


def covariance_overwritten(
    g: np.ndarray, Gx: np.ndarray, Gu: np.ndarray, Sigma: np.ndarray, R: np.ndarray, dt: float
) -> tuple:
    """Write the new covariance over the caller's."""
    Sigma[...] = transition_update(g, Gx, Gu, Sigma, R, dt)[1]
    return g.copy(), Sigma


_NOISE = (
    "Look at how dt, R and Gu enter the noise of one step, and compare with the equation of the notebook."
)

MISCONCEPTIONS = (
    Misconception(
        "dt missing",
        _TRANSITION,
        "The noise of the control is added without the length of the step. In tests with dt = 1 this looks "
        "right.",
        _NOISE,
        _transition(lambda Gx, Gu, Sigma, R, _dt: Gx @ Sigma @ Gx.T + Gu @ R @ Gu.T),
    ),
    Misconception(
        "dt squared",
        _TRANSITION,
        "The noise of the control is multiplied by dt twice, as a standard deviation would be by dt once.",
        _NOISE,
        _transition(lambda Gx, Gu, Sigma, R, dt: Gx @ Sigma @ Gx.T + dt**2 * Gu @ R @ Gu.T),
    ),
    Misconception(
        "divided by dt",
        _TRANSITION,
        "The noise of the control is divided by dt. For continuous white noise that would be consistent "
        "(the book's page on noise shows why); the model of this stage is the handout's, with its own "
        "factor.",
        _NOISE,
        _transition(lambda Gx, Gu, Sigma, R, dt: Gx @ Sigma @ Gx.T + Gu @ R @ Gu.T / dt),
    ),
    Misconception(
        "R squared",
        _TRANSITION,
        "R enters twice, as if it held standard deviations. R is a covariance: its entries are variances "
        "already.",
        "What is the unit of R[0, 0] if V is in m/s?",
        _transition(lambda Gx, Gu, Sigma, R, dt: Gx @ Sigma @ Gx.T + dt * Gu @ R @ R @ Gu.T),
    ),
    Misconception(
        "transpose on the wrong side",
        _TRANSITION,
        "The transposed Jacobian stands on the left of Sigma. The shapes fit either way, and the result is "
        "symmetric either way, so nothing but the numbers shows it.",
        "Write the covariance of A e for a random vector e as an expected value, and read off where the "
        "transpose goes.",
        _transition(lambda Gx, Gu, Sigma, R, dt: Gx.T @ Sigma @ Gx + dt * Gu @ R @ Gu.T),
    ),
    Misconception(
        "old uncertainty not moved",
        _TRANSITION,
        "The noise is added to the old covariance as it was. An uncertain heading then never becomes an "
        "uncertain position.",
        "What does Gx do to a small error of the old state?",
        _transition(lambda _Gx, Gu, Sigma, R, dt: Sigma + dt * Gu @ R @ Gu.T),
    ),
    Misconception(
        "old uncertainty forgotten",
        _TRANSITION,
        "Only the noise of this step is in the result, as if the state before had been known exactly.",
        "Which of the arguments does the result not depend on?",
        _transition(lambda _Gx, Gu, _Sigma, R, dt: dt * Gu @ R @ Gu.T),
    ),
    Misconception(
        "elementwise product",
        _TRANSITION,
        "Matrices are multiplied entry by entry: in numpy * is not the matrix product.",
        "Which operator multiplies matrices in Python?",
        _transition(lambda Gx, Gu, Sigma, R, dt: Gx * Sigma * Gx.T + dt * Gu @ R @ Gu.T),
    ),
    Misconception(
        "correlation of the control dropped",
        _TRANSITION,
        "Only the diagonal of R is used. Errors of V and omega may be correlated: both come from the same "
        "two wheels.",
        "Which entries of R does the result not depend on?",
        _transition(lambda Gx, Gu, Sigma, R, dt: Gx @ Sigma @ Gx.T + dt * Gu @ np.diag(np.diag(R)) @ Gu.T),
    ),
    Misconception(
        "mean moved twice",
        _TRANSITION,
        "The mean is multiplied by Gx. g is the state after the motion; a Jacobian moves small errors, not "
        "the state.",
        "Which argument already is the predicted mean?",
        mean_moved_twice,
    ),
    Misconception(
        "the caller's covariance overwritten",
        _TRANSITION,
        "The function writes the new covariance into Sigma, which the caller still holds and may still need.",
        "Sigma += ... and Sigma[...] = ... write into the array that was handed over.",
        covariance_overwritten,
    ),
)
