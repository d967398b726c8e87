"""Wrong versions of `velocity.jacobians`: the printed W of the source (ERRATA R1), and what people write."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.velocity import jacobians

_STAGE = "velocity.jacobians"
_TURNS = 0.05


def _turning(_x: np.ndarray, u: np.ndarray, _dt: float) -> bool:
    """Tell whether a robot turns so much that the printed column is a number with some digits."""
    return bool(abs(u[1]) > _TURNS)


def as_printed(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Differentiate 1 / omega alone, and lose the speed."""
    F, W = jacobians(x, u, dt)
    if abs(u[1]) > _TURNS:
        W[:2, 1] = -F[1, 2] / u[1] / u[0], F[0, 2] / u[1] / u[0]
    else:
        W[:2, 1] = 0.0
    return F, W


def end_of_the_arc_fixed(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Differentiate 1 / omega alone."""
    F, W = jacobians(x, u, dt)
    if abs(u[1]) > _TURNS:
        W[:2, 1] = -F[1, 2] / u[1], F[0, 2] / u[1]
    else:
        W[:2, 1] = 0.0
    return F, W


def limit_first(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Set omega to 0 before the derivative by omega is taken."""
    F, W = jacobians(x, u, dt)
    if abs(u[1]) < _TURNS / 50:
        W[:2, 1] = 0.0
    return F, W


def straight_ahead(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Differentiate a straight drive, whatever omega is."""
    F, W = jacobians(x, np.array([u[0], 0.0, u[2]]), dt)
    W[:2, 1] = 0.0
    return F, W


def transposed(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Put what changes into the columns."""
    F, W = jacobians(x, u, dt)
    return F.T, W.T


def two_columns(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Leave the column of gamma at zero."""
    F, W = jacobians(x, u, dt)
    return F, W * np.array([1.0, 1.0, 0.0])


def gamma_moves_the_robot(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Let gamma turn the robot before it drives."""
    F, W = jacobians(x, u, dt)
    W[:, 2] = F[:, 2] * dt
    return F, W


def without_dt(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Write ones where the heading follows the rates."""
    F, W = jacobians(x, u, dt)
    W[2, 1:] = 1.0
    return F, W


def heading_does_not_matter(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Take F for the identity."""
    return np.eye(3), jacobians(x, u, dt)[1]


def arc_to_the_other_side(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Change the signs of the third column of F."""
    F, W = jacobians(x, u, dt)
    F[:2, 2] *= -1.0
    return F, W


_NUDGE = "Turn 0.01 rad/s faster and look at the end of the arc: compare with 0.01 times your second column."
MISCONCEPTIONS = (
    Misconception(
        "second column of W as it is printed",
        _STAGE,
        "This is the column that the source prints. omega stands in two places of the motion: in front, under v, and "
        "inside, where the arc ends. Only the first was differentiated, and v was lost on the way.",
        _NUDGE,
        as_printed,
        _turning,
    ),
    Misconception(
        "end of the arc not differentiated",
        _STAGE,
        "In the derivative by omega the radius changes and the angle at which the arc ends does not. omega stands in "
        "two places of the motion.",
        _NUDGE,
        end_of_the_arc_fixed,
        _turning,
    ),
    Misconception(
        "omega set to 0 before the derivative",
        _STAGE,
        "For a robot that drives straight the derivative by omega is 0 in the place. A formula in which omega is 0 "
        "already does not know omega; a robot that turns a little ends beside its line.",
        "Take omega = 0.1 for one second at 1 m/s: how far from the straight line does the robot end?",
        limit_first,
    ),
    Misconception(
        "derivatives of a straight drive",
        _STAGE,
        "F and W are those of a robot that goes straight along its first heading. On an arc it moves at right angles "
        "to its chord when it is turned.",
        "From where to where goes the chord of the arc?",
        straight_ahead,
    ),
    Misconception(
        "F and W transposed",
        _STAGE,
        "Rows and columns are exchanged. A row belongs to what changes, a column to what changes it.",
        "Which entry says that the heading at the start moves y at the end?",
        transposed,
    ),
    Misconception(
        "no column for gamma",
        _STAGE,
        "The column of gamma is 0. Its noise must reach the heading, or it might as well not be there.",
        "What does gamma change, and by how much in a time dt?",
        two_columns,
    ),
    Misconception(
        "gamma moves the robot",
        _STAGE,
        "gamma is taken to turn the robot before it drives, so that it changes the place. It turns the robot at the "
        "end of its arc, where it stands already.",
        "At which moment of the step does the robot turn by gamma dt?",
        gamma_moves_the_robot,
    ),
    Misconception(
        "rates without dt",
        _STAGE,
        "The heading is taken to change by the rates themselves. They last for a time dt.",
        "Which units do the entries of the last row have?",
        without_dt,
    ),
    Misconception(
        "F taken for the identity",
        _STAGE,
        "F is the identity: the error of the pose is carried along as it is. But a robot that looks elsewhere drives "
        "elsewhere.",
        "The heading is off by 0.1 rad, the robot drives 2 m: where does it end?",
        heading_does_not_matter,
    ),
    Misconception(
        "third column of F with the other sign",
        _STAGE,
        "Turned a little to the left, the robot is taken to end further to the right.",
        "A robot that looks along x and drives straight is turned to the left: which entry must be positive?",
        arc_to_the_other_side,
    ),
)
