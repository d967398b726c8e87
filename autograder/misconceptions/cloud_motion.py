"""Wrong versions of `mcl.transition_model`: of how a cloud moves."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.mcl import transition_model

_STAGE = "mcl.transition_model"


def straight_step(xs: np.ndarray, us: np.ndarray, dt: float) -> np.ndarray:
    """Drive along the heading at the start."""
    x, y, theta = xs.T
    V, omega = us.T
    return np.stack([x + V * dt * np.cos(theta), y + V * dt * np.sin(theta), theta + omega * dt], axis=1)


def heading_of_the_end(xs: np.ndarray, us: np.ndarray, dt: float) -> np.ndarray:
    """Turn first and then drive."""
    turned = xs + np.outer(us[:, 1] * dt, [0, 0, 1])
    return straight_step(turned, us * [1, 0], dt)


def control_of_the_first(xs: np.ndarray, us: np.ndarray, dt: float) -> np.ndarray:
    """Move all particles by the first control."""
    return transition_model(xs, np.broadcast_to(us[:1], us.shape), dt)


def mean_control(xs: np.ndarray, us: np.ndarray, dt: float) -> np.ndarray:
    """Move all particles by the mean of the controls."""
    return transition_model(xs, np.broadcast_to(us.mean(axis=0), us.shape), dt)


def one_formula_for_all(xs: np.ndarray, us: np.ndarray, dt: float) -> np.ndarray:
    """Drive straight with the whole cloud as soon as one particle does."""
    if (np.abs(us[:, 1]) < 1e-3).any():
        return straight_step(xs, us, dt)
    return transition_model(xs, us, dt)


def wrapped(xs: np.ndarray, us: np.ndarray, dt: float) -> np.ndarray:
    """Wrap the headings."""
    xs = np.array(transition_model(xs, us, dt))
    xs[:, 2] = (xs[:, 2] + np.pi) % (2 * np.pi) - np.pi
    return xs


def overwritten(xs: np.ndarray, us: np.ndarray, dt: float) -> np.ndarray:
    """Move the caller's particles."""
    xs[:] = transition_model(xs, us, dt)
    return xs


MISCONCEPTIONS = (
    Misconception(
        "straight step",
        _STAGE,
        "Over a short time the heading hardly changes, so that it is natural to drive along the one at the start."
        " The error grows with the square of dt, and all particles share it: no correction spreads them to where "
        "the robot is.",
        "What is the heading half way?",
        straight_step,
    ),
    Misconception(
        "turn first, then drive",
        _STAGE,
        "Updating theta in place and using it on the next line looks harmless; the whole way is then driven along"
        " the heading of the end.",
        "Which heading does each of the lines of your code read?",
        heading_of_the_end,
    ),
    Misconception(
        "one control for all",
        _STAGE,
        "The robot has one control, and so it seems that the cloud has. But the noise of the control is drawn for"
        " each particle, and the rows of us are these draws.",
        "How many rows has us, and how many do you use?",
        control_of_the_first,
    ),
    Misconception(
        "mean control for all",
        _STAGE,
        "The mean of the draws is the best guess of the control. A cloud that moves by its mean does not spread, "
        "and without spread it cannot hold the truth.",
        "After the motion, should two particles that started in one place still be in one place?",
        mean_control,
    ),
    Misconception(
        "one formula for the whole cloud",
        _STAGE,
        "For one robot an `if` chooses between the arc and the straight line. Over a cloud the condition is an "
        "array, and `any` or `all` makes one choice for every particle.",
        "Which of the particles drive straight? Choose the formula for each of them.",
        one_formula_for_all,
    ),
    Misconception(
        "headings wrapped",
        _STAGE,
        "Angles are often wrapped wherever they occur. A motion keeps the turn; who compares angles wraps the "
        "difference.",
        "Is anything compared here?",
        wrapped,
    ),
    Misconception(
        "the caller's cloud overwritten",
        _STAGE,
        "Assigning to xs[:, 0] and its neighbours spares an array, but the array is the caller's.",
        "Make a new array before the first assignment.",
        overwritten,
    ),
)
