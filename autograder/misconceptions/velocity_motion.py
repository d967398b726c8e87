"""Wrong versions of `velocity.motion` and `velocity.noise`: an arc, a turn after it, and what both cost."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.velocity import motion, noise

_MOTION, _NOISE = "velocity.motion", "velocity.noise"


def gamma_left_out(x: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
    """Drive the arc alone."""
    return motion(x, u * np.array([1.0, 1.0, 0.0]), dt)


def turned_before_the_arc(x: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
    """Turn by gamma dt, and then drive."""
    start = x + np.array([0.0, 0.0, u[2] * dt])
    return motion(start, u * np.array([1.0, 1.0, 0.0]), dt)


def turned_on_the_arc(x: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
    """Add gamma to omega, all along the arc."""
    return motion(x, np.array([u[0], u[1] + u[2], 0.0]), dt)


def along_the_first_heading(x: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
    """Drive straight, and turn then."""
    return motion(x, np.array([u[0], 0.0, u[1] + u[2]]), dt)


def gamma_as_an_angle(x: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
    """Add gamma itself to the heading."""
    return motion(x, u * np.array([1.0, 1.0, 1.0 / dt]), dt)


def heading_wrapped(x: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
    """Wrap the heading at the end."""
    end = motion(x, u, dt)
    end[2] = np.arctan2(np.sin(end[2]), np.cos(end[2]))
    return end


def divided_by_omega(x: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
    """Use the radius v / omega for every omega but 0, and stay where one is for that."""
    if u[1] == 0:
        return x + np.array([0.0, 0.0, u[2] * dt])
    return motion(x, u, dt)


def moved_in_place(x: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
    """Write the new pose over the caller's."""
    x[...] = motion(x, u, dt)
    return x


def standard_deviations(u: np.ndarray, alphas: np.ndarray) -> np.ndarray:
    """Take the roots of the variances."""
    return np.sqrt(noise(u, alphas))


def speeds_not_squared(u: np.ndarray, alphas: np.ndarray) -> np.ndarray:
    """Multiply the alphas by the sizes of the speeds."""
    return noise(np.sqrt(np.abs(u)), alphas)


def pairs_exchanged(u: np.ndarray, alphas: np.ndarray) -> np.ndarray:
    """Take the first alpha of each pair for omega, the second for v."""
    return noise(u, alphas.reshape(3, 2)[:, ::-1].ravel())


def alphas_in_two_rows(u: np.ndarray, alphas: np.ndarray) -> np.ndarray:
    """Take the first three alphas for v, the last three for omega."""
    return noise(u, alphas.reshape(2, 3).T.ravel())


def variance_of_gamma_by_gamma(u: np.ndarray, alphas: np.ndarray) -> np.ndarray:
    """Let the last variance grow with gamma."""
    M = noise(u, alphas)
    M[2, 2] += alphas[5] * u[2] ** 2
    return M


def gamma_certain(u: np.ndarray, alphas: np.ndarray) -> np.ndarray:
    """Give gamma no noise."""
    return noise(u, alphas) * np.diag([1.0, 1.0, 0.0])


def alphas_squared(u: np.ndarray, alphas: np.ndarray) -> np.ndarray:
    """Square the alphas too."""
    return noise(u, alphas**2)


_ORDER = "Draw the way of a robot with a large gamma: at which of its points does it turn on the spot?"
_ALPHAS = "Set five of the six alphas to 0: which entry of M must be left, and with which speed must it grow?"
MISCONCEPTIONS = (
    Misconception(
        "gamma left out",
        _MOTION,
        "The robot drives its arc and the third number of the control is not used. It is 0 in what is asked for, but "
        "not in what a sigma point or a particle does.",
        "Which of the three numbers of u does your function not read?",
        gamma_left_out,
    ),
    Misconception(
        "turned before the arc",
        _MOTION,
        "The turn by gamma comes first, so that the whole arc starts with another heading. In this model it comes "
        "last and moves the robot nowhere.",
        _ORDER,
        turned_before_the_arc,
    ),
    Misconception(
        "turned on the arc",
        _MOTION,
        "gamma is added to omega, so that it bends the arc. It is there to make headings possible that no arc to the "
        "same place has.",
        _ORDER,
        turned_on_the_arc,
    ),
    Misconception(
        "along the first heading",
        _MOTION,
        "The robot goes straight ahead for the whole step and turns at its end. That is Euler's step; it cuts every "
        "bend.",
        "Drive a quarter circle in one step: where does it end?",
        along_the_first_heading,
    ),
    Misconception(
        "gamma taken for an angle",
        _MOTION,
        "gamma itself is added to the heading. It is a rate, like omega.",
        "In which unit is gamma?",
        gamma_as_an_angle,
    ),
    Misconception(
        "heading of the motion wrapped",
        _MOTION,
        "The heading is wrapped. A filter averages headings of many poses, and wrapped ones on either side of the cut "
        "have a mean that looks the other way; in this course motions never wrap.",
        "What is the mean of 3.1 and of what 3.2 becomes in your function?",
        heading_wrapped,
    ),
    Misconception(
        "no drive straight ahead",
        _MOTION,
        "For omega = 0 the division is avoided by not moving at all. A robot that does not turn drives straight on.",
        "Try u = (1, 0, 0) for a second: where does the robot end?",
        divided_by_omega,
    ),
    Misconception(
        "the caller's pose overwritten",
        _MOTION,
        "The new pose is written into the array that was given. The caller's old pose is gone.",
        "Which operations make a new array, and which write into the old one?",
        moved_in_place,
    ),
    Misconception(
        "standard deviations in M",
        _NOISE,
        "M holds standard deviations. A covariance holds their squares, and W M W^T is then a covariance of poses.",
        "In which unit is the first entry of M?",
        standard_deviations,
    ),
    Misconception(
        "speeds not squared",
        _NOISE,
        "The alphas are multiplied by the sizes of v and omega. With the squares a robot twice as fast has twice the "
        "standard deviation.",
        "Double v: by what does each entry of M grow?",
        speeds_not_squared,
    ),
    Misconception(
        "alphas of v and omega exchanged",
        _NOISE,
        "In each pair of alphas the first is multiplied by omega**2 and the second by v**2.",
        _ALPHAS,
        pairs_exchanged,
    ),
    Misconception(
        "alphas read in another order",
        _NOISE,
        "The first three alphas are used with v and the last three with omega. They come in pairs, one pair for each "
        "number of the control.",
        _ALPHAS,
        alphas_in_two_rows,
    ),
    Misconception(
        "noise of gamma grows with gamma",
        _NOISE,
        "A share of gamma**2 is added to the variance of gamma. Driving and turning is what makes the robot end with "
        "another heading; gamma itself is never asked for.",
        "With which two numbers of u do all three variances grow?",
        variance_of_gamma_by_gamma,
    ),
    Misconception(
        "gamma without noise",
        _NOISE,
        "The variance of gamma is 0. Then every pose is the end of an arc, and two numbers have to explain three "
        "errors.",
        "How many entries of M are not 0?",
        gamma_certain,
    ),
    Misconception(
        "alphas squared",
        _NOISE,
        "The alphas are squared as well. They are shares of the variance already.",
        "With a first alpha of 0.01, to how many m/s is a speed of 1 m/s kept?",
        alphas_squared,
    ),
)
