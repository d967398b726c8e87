"""Wrong versions of `ballistic.predict`: impacts too late, a Jacobian that misses them, and what people write."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.ballistic import predict

if TYPE_CHECKING:
    from collections.abc import Callable

_STAGE = "ballistic.predict"


def _flown(state: np.ndarray, t: float, gravity: float) -> tuple[np.ndarray, np.ndarray]:
    """Return state and Jacobian of a flight."""
    F = np.eye(4) + t * np.eye(4, k=2)
    return F @ state - gravity * np.array([0, t * t / 2, 0, t]), F


def _lifted(x: np.ndarray) -> np.ndarray:
    """Return a ball that is not below the ground."""
    return np.array([x[0], max(x[1], 0.0), x[2], x[3]])


def saltation(v: float, vx: float, gravity: float, e: float) -> tuple:
    """Return vx and vy after an impact at the velocity v < 0, and what it does to errors: all right."""
    Xi = np.diag([1, -e, 1, -e])
    Xi[3, 1] = -(1 + e) * gravity / v
    return vx, -e * v, Xi


def _journey(x: np.ndarray, dt: float, gravity: float, e: float, impact: Callable, most: int = 1000) -> tuple:
    """Fly from impact to impact, and ignore the ground after `most` of them; return state and Jacobian."""
    state, left, J = np.array(x), dt, np.eye(4)
    for _ in range(most):
        s = np.sqrt(state[3] ** 2 + 2 * gravity * state[1])
        fall = (state[3] + s) / gravity
        if fall > left or left == 0:
            break
        if (left - fall) * (1 - e) >= 2 * e * s / gravity:
            D = np.diag([1.0, 0.0, 1.0, 0.0])
            return D @ _flown(state, left, 0)[0], D @ _flown(state, left, 0)[1] @ J
        state, F = _flown(state, fall, gravity)
        vx, vy, Xi = impact(state[3], state[2], gravity, e)
        state, J, left = np.array([state[0], 0.0, vx, vy]), Xi @ F @ J, left - fall
    state, F = _flown(state, left, gravity)
    return state, F @ J


def _impact(wrong: Callable) -> Callable:
    """Make a prediction with another rule of impact, or another matrix for it."""

    def function(
        x: np.ndarray, Sigma: np.ndarray, dt: float, gravity: float, restitution: float, Q: np.ndarray
    ) -> tuple:
        g, J = _journey(_lifted(x), dt, gravity, restitution, wrong)
        return g, J @ Sigma @ J.T + Q

    return function


def _noise(wrong: Callable) -> Callable:
    """Make a prediction whose covariance is put together wrongly, from the right mean and Jacobian."""

    def function(
        x: np.ndarray, Sigma: np.ndarray, dt: float, gravity: float, restitution: float, Q: np.ndarray
    ) -> tuple:
        g, J = _journey(_lifted(x), dt, gravity, restitution, saltation)
        return g, wrong(J, Sigma, Q, dt)

    return function


def jump_alone(v: float, vx: float, _gravity: float, e: float) -> tuple:
    """Take the derivative of the jump itself."""
    return vx, -e * v, np.diag([1, 1, 1, -e])


def never_lands(v: float, vx: float, _gravity: float, e: float) -> tuple:
    """Leave the impact out of the Jacobian."""
    return vx, -e * v, np.eye(4)


def height_alone(v: float, vx: float, _gravity: float, e: float) -> tuple:
    """Turn the errors of height and velocity over, and leave the change of velocity with the delay out."""
    return vx, -e * v, np.diag([1, -e, 1, -e])


def delay_backwards(v: float, vx: float, gravity: float, e: float) -> tuple:
    """Count the delay with the wrong sign."""
    Xi = np.diag([1, -e, 1, -e])
    Xi[3, 1] = (1 + e) * gravity / v
    return vx, -e * v, Xi


def sideways_too(v: float, vx: float, gravity: float, e: float) -> tuple:
    """Let the impact slow the ball down along the ground as well."""
    Xi = np.diag([1, -e, e, -e])
    Xi[3, 1] = -(1 + e) * gravity / v
    return e * vx, -e * v, Xi


def ground_ignored(
    x: np.ndarray, Sigma: np.ndarray, dt: float, gravity: float, _restitution: float, Q: np.ndarray
) -> tuple:
    """Fly through the ground."""
    g, F = _flown(_lifted(x), dt, gravity)
    return g, F @ Sigma @ F.T + Q


def end_of_the_step(
    x: np.ndarray, Sigma: np.ndarray, dt: float, gravity: float, restitution: float, Q: np.ndarray
) -> tuple:
    """Put the ball on the ground, and reverse it, when the step is over."""
    g, F = _flown(_lifted(x), dt, gravity)
    if g[1] < 0:
        g = np.array([g[0], 0.0, g[2], -restitution * g[3]])
        F = np.diag([1, 1, 1, -restitution]) @ F
    return g, F @ Sigma @ F.T + Q


def first_impact_only(
    x: np.ndarray, Sigma: np.ndarray, dt: float, gravity: float, restitution: float, Q: np.ndarray
) -> tuple:
    """Look for one impact, and for no other."""
    g, J = _journey(_lifted(x), dt, gravity, restitution, saltation, 1)
    return g, J @ Sigma @ J.T + Q


def share_of_energy(
    x: np.ndarray, Sigma: np.ndarray, dt: float, gravity: float, restitution: float, Q: np.ndarray
) -> tuple:
    """Keep the share e of the energy, and so its root of the speed."""
    return predict(x, Sigma, dt, gravity, np.sqrt(restitution), Q)


def nothing_lost(
    x: np.ndarray, Sigma: np.ndarray, dt: float, gravity: float, _restitution: float, Q: np.ndarray
) -> tuple:
    """Reverse the velocity and forget the restitution."""
    return predict(x, Sigma, dt, gravity, 1.0, Q)


def by_the_jacobian(
    x: np.ndarray, Sigma: np.ndarray, dt: float, gravity: float, restitution: float, Q: np.ndarray
) -> tuple:
    """Multiply the mean by the Jacobian."""
    _, J = _journey(_lifted(x), dt, gravity, restitution, saltation)
    return J @ x, J @ Sigma @ J.T + Q


def doubt_at_rest(
    x: np.ndarray, Sigma: np.ndarray, dt: float, gravity: float, restitution: float, Q: np.ndarray
) -> tuple:
    """Let the ball come to rest, and keep the old doubt about height and velocity."""
    g, J = _journey(_lifted(x), dt, gravity, restitution, saltation)
    if g[1] == 0 and g[3] == 0:
        J = np.eye(4)
        J[0, 2] = dt
    return g, J @ Sigma @ J.T + Q


def not_lifted(
    x: np.ndarray, Sigma: np.ndarray, dt: float, gravity: float, restitution: float, Q: np.ndarray
) -> tuple:
    """Start below the ground if the mean is there."""
    g, J = _journey(x, dt, gravity, restitution, saltation)
    return g, J @ Sigma @ J.T + Q


def covariance_overwritten(
    x: np.ndarray, Sigma: np.ndarray, dt: float, gravity: float, restitution: float, Q: np.ndarray
) -> tuple:
    """Write the new covariance over the caller's."""
    g, Sigma[...] = predict(x, Sigma, dt, gravity, restitution, Q)
    return g, Sigma


_TWO_BALLS = (
    "Imagine two balls, one 1 cm above the other. When both have bounced, which one is higher, and why?"
)
_CLOCK = "Let an impact come right after the beginning of a step: where is the ball at its end?"
_RULE = "Read in the docstring what restitution is a share of."
_EXPECTED = "Write the covariance of J times a random error as an expected value, and compare, term by term."
MISCONCEPTIONS = (
    Misconception(
        "Jacobian of the jump alone",
        _STAGE,
        "The impact enters the covariance by the derivative of its rule: the height stays, the velocity is reversed. "
        "But an error of the state also shifts the time of the impact, and in between one ball rises while the other "
        "falls.",
        _TWO_BALLS,
        _impact(jump_alone),
    ),
    Misconception(
        "covariance of a ball that never lands",
        _STAGE,
        "The mean bounces and the covariance does not: it is that of a flight through the whole step.",
        _TWO_BALLS,
        _impact(never_lands),
    ),
    Misconception(
        "delay without a change of velocity",
        _STAGE,
        "The matrix of the impact turns errors of height and velocity over, and nothing more. A ball that comes late "
        "falls longer and rises shorter, so that gravity gives it another velocity as well.",
        "Gravity acts for the same time on both balls. On which of them does the impact scale what it gave?",
        _impact(height_alone),
    ),
    Misconception(
        "sign of the delay",
        _STAGE,
        "The entry of the impact's matrix that makes velocity out of height has the wrong sign. It is easily lost "
        "where the velocity of the impact, which is negative, is replaced by the speed.",
        "A ball that comes late: is it faster or slower upwards than the other, when both have bounced?",
        _impact(delay_backwards),
    ),
    Misconception(
        "slowed down along the ground too",
        _STAGE,
        "The restitution scales the whole velocity. A ball that does not spin, on a smooth ground, keeps its velocity "
        "along the ground.",
        "Throw the ball so flat that it hardly bounces: what would your function do to its way along the ground?",
        _impact(sideways_too),
    ),
    Misconception(
        "flight through the ground",
        _STAGE,
        "The ball falls for the whole step, and nothing happens at height 0.",
        "What is the height that you return after a long step?",
        ground_ignored,
    ),
    Misconception(
        "impact at the end of the step",
        _STAGE,
        "The ball flies for the whole step, and is then put on the ground and reversed if it is below it. The impact "
        "is late by up to a whole step, and so is the ball.",
        _CLOCK,
        end_of_the_step,
    ),
    Misconception(
        "first impact only",
        _STAGE,
        "After one impact nothing looks for the next, and in a long step the ball falls through the ground.",
        "What is left of the step after an impact is a step again.",
        first_impact_only,
    ),
    Misconception(
        "restitution taken for a share of energy",
        _STAGE,
        "The impact leaves the share e of the energy, so that the speed is multiplied by its root. The balls bounce "
        "too high.",
        _RULE,
        share_of_energy,
    ),
    Misconception(
        "nothing lost at an impact",
        _STAGE,
        "The velocity changes its sign and keeps its size: the restitution is not used.",
        _RULE,
        nothing_lost,
    ),
    Misconception(
        "mean multiplied by the Jacobian",
        _STAGE,
        "The mean is carried by the same matrix as its errors. That holds for a linear motion; gravity, which is the "
        "same for both of two balls, is in no Jacobian.",
        "Let go of a ball at rest: what does your function return for its velocity?",
        by_the_jacobian,
    ),
    Misconception(
        "doubt about a ball at rest",
        _STAGE,
        "The ball has come to rest, and the covariance still holds the old doubt about its height and its velocity. "
        "However high it was, it lies on the ground now.",
        "Start the ball 1 cm higher: what changes about where it lies?",
        doubt_at_rest,
    ),
    Misconception(
        "start below the ground",
        _STAGE,
        "A mean that a correction left a little below the ground falls or rises from there. The time of its impact is "
        "then that of a ball in a hole.",
        "Read in the docstring what is said of a py below the ground.",
        not_lifted,
    ),
    Misconception(
        "Jacobian transposed",
        _STAGE,
        "The transposed Jacobian stands on the left of Sigma. Shapes and symmetry are the same, the numbers are not.",
        _EXPECTED,
        _noise(lambda J, Sigma, Q, _dt: J.T @ Sigma @ J + Q),
    ),
    Misconception(
        "old doubt not moved",
        _STAGE,
        "Q is added to the covariance as it was. A doubtful velocity then never becomes a doubtful place.",
        _EXPECTED,
        _noise(lambda _J, Sigma, Q, _dt: Sigma + Q),
    ),
    Misconception(
        "Q multiplied by dt",
        _STAGE,
        "The noise is scaled by the length of the step. Q is what one step adds, whatever its length.",
        "Read in the docstring what Q is.",
        _noise(lambda J, Sigma, Q, dt: J @ Sigma @ J.T + dt * Q),
    ),
    Misconception(
        "the caller's covariance overwritten by the prediction",
        _STAGE,
        "The function writes the new covariance into Sigma, which the caller still holds and may still need.",
        "Sigma += ... and Sigma[...] = ... write into the array that was handed over.",
        covariance_overwritten,
    ),
)
