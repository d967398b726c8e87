"""Wrong versions of `compute_dynamics`.

Several are faults of the source handouts (ERRATA A1, R1, H1); the others are what people write.
"""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.motion import EPSILON_OMEGA, compute_dynamics

_DYNAMICS = "motion.compute_dynamics"


def _closed_form(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Evaluate g, Gx and Gu as they are derived, with omega in the denominator: not a number at omega = 0."""
    (x, y, theta), (V, omega) = xvec, u
    end = theta + omega * dt
    with np.errstate(all="ignore"):
        dx = V / omega * (np.sin(end) - np.sin(theta))
        dy = -V / omega * (np.cos(end) - np.cos(theta))
        by_V = np.array([(np.sin(end) - np.sin(theta)) / omega, -(np.cos(end) - np.cos(theta)) / omega, 0.0])
        by_omega = np.array([(V * dt * np.cos(end) - dx) / omega, (V * dt * np.sin(end) - dy) / omega, dt])
    Gx = np.array([[1.0, 0.0, -dy], [0.0, 1.0, dx], [0.0, 0.0, 1.0]])
    return np.array([x + dx, y + dy, end]), Gx, np.column_stack([by_V, by_omega])


def _well_conditioned(_xvec: np.ndarray, u: np.ndarray, _dt: float) -> bool:
    return u[1] == 0 or abs(u[1]) > EPSILON_OMEGA


def guarded_at_zero(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Take the limits at omega exactly 0 and the closed form everywhere else."""
    return compute_dynamics(xvec, u, dt) if u[1] == 0 else _closed_form(xvec, u, dt)


def euler_step(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Hold the heading over the step."""
    (x, y, theta), (V, omega) = xvec, u
    c, s = np.cos(theta), np.sin(theta)
    g = np.array([x + V * dt * c, y + V * dt * s, theta + omega * dt])
    Gx = np.array([[1.0, 0.0, -V * dt * s], [0.0, 1.0, V * dt * c], [0.0, 0.0, 1.0]])
    return g, Gx, np.array([[dt * c, 0.0], [dt * s, 0.0], [0.0, dt]])


def midpoint_step(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Drive straight in the heading of half time."""
    (x, y, theta), (V, omega) = xvec, u
    c, s = np.cos(theta + omega * dt / 2), np.sin(theta + omega * dt / 2)
    g = np.array([x + V * dt * c, y + V * dt * s, theta + omega * dt])
    Gx = np.array([[1.0, 0.0, -V * dt * s], [0.0, 1.0, V * dt * c], [0.0, 0.0, 1.0]])
    return g, Gx, np.array([[dt * c, -V * dt**2 * s / 2], [dt * s, V * dt**2 * c / 2], [0.0, dt]])


def euler_jacobians(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Move along the arc, and differentiate the straight step."""
    _, Gx, Gu = euler_step(xvec, u, dt)
    return compute_dynamics(xvec, u, dt)[0], Gx, Gu


def omega_derivative_zeroed(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Take the limit of g at small omega, and its derivative by omega as 0."""
    g, Gx, Gu = compute_dynamics(xvec, u, dt)
    if abs(u[1]) < EPSILON_OMEGA:
        Gu[:2, 1] = 0.0
    return g, Gx, Gu


def heading_frozen(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Keep the heading at small omega."""
    g, Gx, Gu = compute_dynamics(xvec, u, dt)
    if abs(u[1]) < EPSILON_OMEGA:
        g[2] = xvec[2]
    return g, Gx, Gu


def printed_velocity_column(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Differentiate 1 / omega alone, and lose V on the way (ERRATA R1)."""
    g, Gx, Gu = compute_dynamics(xvec, u, dt)
    if abs(u[1]) > EPSILON_OMEGA:
        Gu[:2, 1] = -Gu[:2, 0] / u[1]
    return g, Gx, Gu


def quotient_half_differentiated(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Differentiate 1 / omega, and not the sine that holds omega too."""
    g, Gx, Gu = compute_dynamics(xvec, u, dt)
    if abs(u[1]) > EPSILON_OMEGA:
        Gu[:2, 1] = -u[0] * Gu[:2, 0] / u[1]
    return g, Gx, Gu


def degrees(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Convert headings from degrees before taking a sine or cosine, and nothing else."""
    start, end = np.deg2rad(xvec[2]), np.deg2rad(xvec[2] + u[1] * dt)
    V, omega = u
    if abs(omega) < EPSILON_OMEGA:
        by_V = np.array([dt * np.cos(start), dt * np.sin(start)])
        by_omega = V * dt**2 / 2 * np.array([-np.sin(start), np.cos(start)])
    else:
        by_V = np.array([np.sin(end) - np.sin(start), np.cos(start) - np.cos(end)]) / omega
        by_omega = (V * dt * np.array([np.cos(end), np.sin(end)]) - V * by_V) / omega
    dx, dy = V * by_V
    Gx = np.array([[1.0, 0.0, -dy], [0.0, 1.0, dx], [0.0, 0.0, 1.0]])
    Gu = np.vstack([np.column_stack([by_V, by_omega]), [0.0, dt]])
    return np.array([xvec[0] + dx, xvec[1] + dy, xvec[2] + omega * dt]), Gx, Gu


def state_jacobian_transposed(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Put rows where columns belong."""
    g, Gx, Gu = compute_dynamics(xvec, u, dt)
    return g, Gx.T, Gu


def differentiated_by_new_heading(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Differentiate as if the robot drove straight in its new heading (ERRATA A1)."""
    g, Gx, Gu = compute_dynamics(xvec, u, dt)
    Gx[:2, 2] = u[0] * dt * np.array([-np.sin(g[2]), np.cos(g[2])])
    return g, Gx, Gu


def control_columns_swapped(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Order the columns of Gu as omega, V."""
    g, Gx, Gu = compute_dynamics(xvec, u, dt)
    return g, Gx, Gu[:, ::-1]


def cosine_sign(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Integrate the sine to +cos."""
    g, Gx, Gu = compute_dynamics(xvec, u, dt)
    g[1], Gx[0, 2], Gu[1] = 2 * xvec[1] - g[1], -Gx[0, 2], -Gu[1]
    return g, Gx, Gu


def heading_wrapped(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Wrap the new heading to [-pi, pi)."""
    g, Gx, Gu = compute_dynamics(xvec, u, dt)
    g[2] = (g[2] + np.pi) % (2 * np.pi) - np.pi
    return g, Gx, Gu


def duration_ignored(xvec: np.ndarray, u: np.ndarray, _dt: float) -> tuple:
    """Compute a step of one second, whatever dt is."""
    return compute_dynamics(xvec, u, 1.0)


def pose_overwritten(xvec: np.ndarray, u: np.ndarray, dt: float) -> tuple:
    """Update the caller's pose in place."""
    g, Gx, Gu = compute_dynamics(xvec, u, dt)
    xvec[...] = g
    return g, Gx, Gu


_LIMITS = "Compare the limit of each entry in the derivation with what your code returns there."
_JACOBIAN = "Check one entry by hand: nudge one argument, and see how much one component of g changes."
MISCONCEPTIONS = (
    Misconception(
        "division by zero",
        _DYNAMICS,
        "The closed form is used for every omega, and it divides by omega. On a straight line omega is 0 "
        "and the result is not a number. It is easily missed, because a robot that is steered by hand never"
        " drives quite straight.",
        _LIMITS,
        _closed_form,
        _well_conditioned,
    ),
    Misconception(
        "limits at exactly zero only",
        _DYNAMICS,
        "The limits are taken only where omega equals 0. Just beside it the closed form still subtracts "
        "nearly equal sines and divides by a tiny number, and few digits or none are left, though nothing "
        "looks wrong on paper.",
        "Evaluate your function at omega = 1e-9 and compare with omega = 0: how far apart may they be?",
        guarded_at_zero,
        _well_conditioned,
    ),
    Misconception(
        "Euler step",
        _DYNAMICS,
        "The heading is held over the step, so that the robot drives straight and turns afterwards. This is"
        " the usual recipe for short steps; here omega is constant and the motion has an exact solution, an"
        " arc.",
        "Where does the heading depend on time inside the integral?",
        euler_step,
    ),
    Misconception(
        "midpoint step",
        _DYNAMICS,
        "The robot drives straight in the heading it has at half time. The direction is right, and the "
        "length is that of the arc instead of its chord: a good approximation, not the solution.",
        "Which is longer, an arc or its chord? By what factor?",
        midpoint_step,
    ),
    Misconception(
        "Jacobians of the straight step",
        _DYNAMICS,
        "g follows the arc while the Jacobians belong to a straight step. They are in many textbooks, next "
        "to the simpler model; a filter that mixes the two is overconfident about turns.",
        _JACOBIAN,
        euler_jacobians,
    ),
    Misconception(
        "derivative by omega set to 0",
        _DYNAMICS,
        "At small omega the derivative of the position by omega is 0, as if one differentiated the limit of"
        " g, in which omega no longer occurs. Taking a limit and differentiating must not change places "
        "here.",
        _LIMITS,
        omega_derivative_zeroed,
    ),
    Misconception(
        "heading frozen at small omega",
        _DYNAMICS,
        "At small omega the heading does not change. That it stays about constant helps to find the new "
        "position; the new heading itself needs no limit, and a slow turn adds up over many steps.",
        "Which rows of g have omega in a denominator at all?",
        heading_frozen,
    ),
    Misconception(
        "derivative of 1 / omega alone, without V",
        _DYNAMICS,
        "In the derivative by omega only the factor 1 / omega is differentiated, and V is lost from it. A "
        "widely copied solution of another course prints this column.",
        _JACOBIAN,
        printed_velocity_column,
    ),
    Misconception(
        "half of the product rule",
        _DYNAMICS,
        "In the derivative by omega only the factor 1 / omega is differentiated. The sine and cosine of the"
        " final heading depend on omega too.",
        _JACOBIAN,
        quotient_half_differentiated,
    ),
    Misconception(
        "headings taken for degrees",
        _DYNAMICS,
        "Headings are converted from degrees to radians before their sine is taken, but they are in radians"
        " already, like every angle of this course.",
        "What unit does the docstring give for theta, and what unit does np.cos expect?",
        degrees,
    ),
    Misconception(
        "Gx transposed",
        _DYNAMICS,
        "Rows and columns of Gx have changed places. It has the right shape either way, and a filter with "
        "it runs.",
        "Row i of a Jacobian belongs to component i of g, column j to argument j.",
        state_jacobian_transposed,
    ),
    Misconception(
        "derivative at the new heading",
        _DYNAMICS,
        "Gx is taken with respect to, or at, the new heading. The Jacobian belongs to the state before the "
        "step; after it the robot has turned.",
        _JACOBIAN,
        differentiated_by_new_heading,
    ),
    Misconception(
        "columns of Gu exchanged",
        _DYNAMICS,
        "The columns of Gu are in the order omega, V. The control of this course is u = [V, omega].",
        "Column j of Gu belongs to component j of u.",
        control_columns_swapped,
    ),
    Misconception(
        "sign of the cosine",
        _DYNAMICS,
        "The sideways motion has the wrong sign: sine was integrated to plus cosine. The robot turns left "
        "and ends on the right.",
        "From the origin, facing along x and turning left: which sign must y have?",
        cosine_sign,
    ),
    Misconception(
        "heading wrapped",
        _DYNAMICS,
        "The new heading is wrapped into one turn. That is right for innovations; a motion stage keeps the "
        "heading it gets, so that g stays smooth and its Jacobian its derivative.",
        "Read in the docstring what is said about wrapping.",
        heading_wrapped,
    ),
    Misconception(
        "duration ignored",
        _DYNAMICS,
        "The result is that of a step of one second. With dt = 1 it cannot be told from the right one, "
        "which is how it survives a first test.",
        "Call your function with dt and with half of dt: what must change?",
        duration_ignored,
        _well_conditioned,  # the limits that are allowed at small omega are those of another step
    ),
    Misconception(
        "the caller's pose overwritten",
        _DYNAMICS,
        "The function writes the new pose into xvec. In Python an array that is handed over is not copied: "
        "the caller's pose has changed when the function returns.",
        "x = xvec names the same array; which operation makes a new one?",
        pose_overwritten,
    ),
)
