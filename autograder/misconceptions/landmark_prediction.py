"""Wrong versions of `landmarks.predict`: a step of the robot as people write it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.landmarks import predict

if TYPE_CHECKING:
    from collections.abc import Callable

_STAGE = "landmarks.predict"


def _turn(theta: float) -> np.ndarray:
    """Return the turn of a frame as a matrix of a pose."""
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _slope(theta: float, d: float) -> np.ndarray:
    """Return the derivative of the pose after the step by the pose before."""
    return np.array([[1.0, 0.0, -d * np.sin(theta)], [0.0, 1.0, d * np.cos(theta)], [0.0, 0.0, 1.0]])


def _spread(Sigma: np.ndarray, G: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Carry a covariance through the derivative of the pose, and add noise of the pose."""
    whole = np.eye(len(Sigma))
    whole[:3, :3] = G
    after = whole @ Sigma @ whole.T
    after[:3, :3] += noise
    return after


def way_in_the_heading(
    x: np.ndarray, Sigma: np.ndarray, control: np.ndarray, control_cov: np.ndarray
) -> tuple:
    """Add the way to the heading."""
    after, Sigma = predict(x, Sigma, control, control_cov)
    after[2] = x[2] + control[0]
    return after, Sigma


def turn_first(x: np.ndarray, Sigma: np.ndarray, control: np.ndarray, control_cov: np.ndarray) -> tuple:
    """Turn first, and drive along the new heading."""
    ahead = x + np.concatenate([[0.0, 0.0, control[1]], np.zeros(len(x) - 3)])
    return predict(ahead, Sigma, np.array([control[0], 0.0]), control_cov)


def landmarks_driven_along(
    x: np.ndarray, Sigma: np.ndarray, control: np.ndarray, control_cov: np.ndarray
) -> tuple:
    """Move the landmarks by the step of the robot."""
    after, Sigma = predict(x, Sigma, control, control_cov)
    after[3:] += np.tile((after - x)[:2], (len(x) - 3) // 2)
    return after, Sigma


def first_error_twice(
    x: np.ndarray, Sigma: np.ndarray, control: np.ndarray, control_cov: np.ndarray
) -> tuple:
    """Take the first error for that of the heading."""
    c, s = np.cos(x[2]), np.sin(x[2])
    L = np.array([[c, -s, 0.0], [s, c, 0.0], [1.0, 0.0, 0.0]])
    after, _ = predict(x, Sigma, control, control_cov)
    return after, _spread(Sigma, _slope(x[2], control[0]), L @ control_cov @ L.T)


def noise_in_the_world(
    x: np.ndarray, Sigma: np.ndarray, control: np.ndarray, control_cov: np.ndarray
) -> tuple:
    """Add the noise as it is."""
    after, _ = predict(x, Sigma, control, control_cov)
    return after, _spread(Sigma, _slope(x[2], control[0]), control_cov)


def noise_turned_back(
    x: np.ndarray, Sigma: np.ndarray, control: np.ndarray, control_cov: np.ndarray
) -> tuple:
    """Turn the noise the wrong way."""
    L = _turn(-x[2])
    after, _ = predict(x, Sigma, control, control_cov)
    return after, _spread(Sigma, _slope(x[2], control[0]), L @ control_cov @ L.T)


def cross_terms_left(x: np.ndarray, Sigma: np.ndarray, control: np.ndarray, control_cov: np.ndarray) -> tuple:
    """Carry the block of the pose and leave the rest of Sigma."""
    after, moved = predict(x, Sigma, control, control_cov)
    moved[:3, 3:], moved[3:, :3] = Sigma[:3, 3:], Sigma[3:, :3]
    return after, moved


def transposed(x: np.ndarray, Sigma: np.ndarray, control: np.ndarray, control_cov: np.ndarray) -> tuple:
    """Carry the covariance by the transpose."""
    L = _turn(x[2])
    after, _ = predict(x, Sigma, control, control_cov)
    return after, _spread(Sigma, _slope(x[2], control[0]).T, L @ control_cov @ L.T)


def not_carried(x: np.ndarray, Sigma: np.ndarray, control: np.ndarray, control_cov: np.ndarray) -> tuple:
    """Add the noise to the covariance before the step."""
    L = _turn(x[2])
    after, _ = predict(x, Sigma, control, control_cov)
    return after, _spread(Sigma, np.eye(3), L @ control_cov @ L.T)


def after_the_turn(x: np.ndarray, Sigma: np.ndarray, control: np.ndarray, control_cov: np.ndarray) -> tuple:
    """Put the heading after the step into both derivatives."""
    after, _ = predict(x, Sigma, control, control_cov)
    L = _turn(after[2])
    return after, _spread(Sigma, _slope(after[2], control[0]), L @ control_cov @ L.T)


def covariance_overwritten(
    x: np.ndarray, Sigma: np.ndarray, control: np.ndarray, control_cov: np.ndarray
) -> tuple:
    """Write the new covariance into the caller's array."""
    after, Sigma[...] = predict(x, Sigma, control, control_cov)
    return after, Sigma.copy()


_UP = "Draw a robot that faces up the page and slips along its way: is that x or y?"


def _item(name: str, explanation: str, hint: str, function: Callable[..., tuple]) -> Misconception:
    return Misconception(name, _STAGE, explanation, hint, function)


MISCONCEPTIONS = (
    _item(
        "heading grows by the way",
        "The third row of the step adds d, where the turn belongs. Metres are no radians.",
        "Which unit has each row of the step?",
        way_in_the_heading,
    ),
    _item(
        "turn before the drive",
        "The robot turns first and drives along its new heading. Here it drives first; the two end in different "
        "places.",
        "Drive 1 m ahead and turn by a right angle; then the other way round. Where are you?",
        turn_first,
    ),
    _item(
        "landmarks driven along",
        "The step is added to the landmarks too. They stand in the world, and the robot drives among them.",
        "What does a landmark do while the robot drives?",
        landmarks_driven_along,
    ),
    _item(
        "first error in the place of the third",
        "The heading gets the error along the way, where the third error belongs. Three errors have three names.",
        "Let only the heading be in error: what must Sigma be after a step from a certain start?",
        first_error_twice,
    ),
    _item(
        "noise along the axes of the world",
        "control_cov is added as it is. Its axes are those of the robot: it holds for a robot that faces along x "
        "alone.",
        _UP,
        noise_in_the_world,
    ),
    _item(
        "noise turned the wrong way",
        "The noise is turned from the world into the robot, and it is wanted the other way round: L and its transpose "
        "are exchanged.",
        "Let the robot face at 45 degrees to the left: to which side does its ellipse lean?",
        noise_turned_back,
    ),
    _item(
        "covariance with the landmarks not carried",
        "Only the block of the pose is carried through the step. A doubt about the heading that a landmark shares "
        "becomes "
        "a doubt about the place that the landmark shares.",
        "Write the derivative of the whole state by the whole state. Which blocks of Sigma does it touch?",
        cross_terms_left,
    ),
    _item(
        "derivative of the step transposed",
        "The covariance is carried by the transpose of G: a doubt about the place turns into one about the heading.",
        "The place is in doubt and the heading is not. Is the heading in doubt after a step?",
        transposed,
    ),
    _item(
        "doubt before the step not carried",
        "The noise is added to the old covariance. A robot that doubts its heading doubts its place after a step.",
        "Two robots start at one point and face a little apart. Where are they after a metre?",
        not_carried,
    ),
    _item(
        "derivatives at the heading after the turn",
        "The mean is moved along the old heading, and the derivatives are taken at the new one, because x was "
        "overwritten "
        "first.",
        "Which heading did the robot have while it drove?",
        after_the_turn,
    ),
    _item(
        "the caller's covariance overwritten",
        "The new covariance is written into the argument Sigma, which the caller may still need.",
        "Sigma[:3, :3] = ... changes the array that was handed over. Work on a copy.",
        covariance_overwritten,
    ),
)
