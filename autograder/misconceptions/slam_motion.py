"""Wrong versions of `slam.transition_model`: of what the lines of a map do while the robot moves."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.slam import transition_model

_STAGE = "slam.transition_model"


def lines_turn_with_the_robot(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Turn the lines against the robot, as it sees them turn."""
    g, Gx, Gu = transition_model(x, u, dt)
    g[3::2] -= u[1] * dt
    return g, Gx, Gu


def lines_forgotten(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Take the derivative of what does not change to be 0."""
    g, Gx, Gu = transition_model(x, u, dt)
    Gx[3:, 3:] = 0.0
    return g, Gx, Gu


def identity_times_duration(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Multiply the identity of the lines by dt."""
    g, Gx, Gu = transition_model(x, u, dt)
    Gx[3:, 3:] *= dt
    return g, Gx, Gu


def identity_of_the_pose(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Take the identity for the whole state, the pose included."""
    g, _, Gu = transition_model(x, u, dt)
    return g, np.eye(len(x)), Gu


def heading_in_the_last_column(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Put what belongs to the heading into the last column."""
    g, Gx, Gu = transition_model(x, u, dt)
    Gx[:2, -1], Gx[:2, 2] = Gx[:2, 2], Gx[:2, -1].copy()
    return g, Gx, Gu


def control_turns_the_lines(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Let the turning rate act on every angle of the state."""
    g, Gx, Gu = transition_model(x, u, dt)
    Gu[3::2, 1] = dt
    return g, Gx, Gu


def pose_at_the_end(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Take the last three numbers for the pose."""
    turned = np.roll(np.arange(len(x)), 3)
    g, Gx, Gu = transition_model(x[turned], u, dt)
    back = np.argsort(turned)
    return g[back], Gx[np.ix_(back, back)], Gu[back]


def lines_wrapped(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Wrap the angles of the lines."""
    g, Gx, Gu = transition_model(x, u, dt)
    g[3::2] = (g[3::2] + np.pi) % (2 * np.pi) - np.pi
    return g, Gx, Gu


def state_overwritten(x: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Write the new pose into the caller's state."""
    g, Gx, Gu = transition_model(x, u, dt)
    x[:3] = g[:3]
    return x, Gx, Gu


_ROW = "Row i of Gx belongs to number i of the state after the motion, column j to number j before it."
MISCONCEPTIONS = (
    Misconception(
        "lines turned with the robot",
        _STAGE,
        "The lines are turned as the robot sees them turn. But the state holds them in the frame of the world, in "
        "which they stand still.",
        "In which frame are alpha and r of the state given?",
        lines_turn_with_the_robot,
    ),
    Misconception(
        "derivative of the lines 0",
        _STAGE,
        "The derivative of the new lines by the old ones is 0. It is their rate in time that is 0; a filter with this "
        "derivative believes after one step that it knows all lines exactly.",
        "What happens to the covariance of the lines in Gx Sigma Gx^T?",
        lines_forgotten,
    ),
    Misconception(
        "identity of the lines times dt",
        _STAGE,
        "The identity of the lines is multiplied by the duration of the step. g is the state itself and not its rate, "
        "so that no dt belongs there; with dt = 1 it does not show.",
        "Write down g for a line, and differentiate it.",
        identity_times_duration,
    ),
    Misconception(
        "identity for the pose too",
        _STAGE,
        "Gx is the identity of the whole state. The lines stand still, but the robot does not: an error of its heading "
        "becomes one of its place.",
        _ROW,
        identity_of_the_pose,
    ),
    Misconception(
        "heading looked for at the end",
        _STAGE,
        "What belongs to the heading stands in the last column of Gx, which is right for a pose alone. Here the last "
        "column belongs to a line.",
        _ROW,
        heading_in_the_last_column,
    ),
    Misconception(
        "lines turned by the control",
        _STAGE,
        "Gu lets the turning rate act on the angles of the lines. The noise of the control would then make the map "
        "uncertain, step by step.",
        "Which of the numbers of g depend on u?",
        control_turns_the_lines,
    ),
    Misconception(
        "pose taken from the end of the state",
        _STAGE,
        "The last three numbers of the state are moved. The pose is at the front, and the lines follow.",
        "Print x before the call: where is the pose?",
        pose_at_the_end,
    ),
    Misconception(
        "lines wrapped",
        _STAGE,
        "The angles of the lines are wrapped on the way. What is wrapped jumps, and what jumps has no derivative; "
        "innovations are wrapped, states are not.",
        "Read in the docstring what is said about wrapping.",
        lines_wrapped,
    ),
    Misconception(
        "the caller's state overwritten",
        _STAGE,
        "The new pose is written into x. The filter that calls still needs the old one.",
        "An array that is handed over is not copied; which operation makes a new one?",
        state_overwritten,
    ),
)
