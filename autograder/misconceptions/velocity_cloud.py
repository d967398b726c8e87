"""Wrong versions of the velocity model's cloud: motion of the particles, as people write it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

_STAGE = "particle.predict"


def _variances(u: np.ndarray, alphas: np.ndarray) -> np.ndarray:
    """Return the variances of the three numbers of a control."""
    return np.reshape(alphas, (3, 2)) @ np.square(u[:2])


def _sigma(u: np.ndarray, alphas: np.ndarray) -> np.ndarray:
    """Return the right standard deviations."""
    return np.sqrt(_variances(u, alphas))


def _motions(xs: np.ndarray, us: np.ndarray, dt: float) -> np.ndarray:
    """Move each pose by a control of its own."""
    v, omega, gamma = us.T
    half = omega * dt / 2
    chord, phi = v * dt * np.sinc(half / np.pi), xs[:, 2] + half
    return xs + np.stack([chord * np.cos(phi), chord * np.sin(phi), (omega + gamma) * dt], axis=-1)


def _with(spread: Callable[[np.ndarray, np.ndarray, float], np.ndarray]) -> Callable:
    """Return a prediction with other standard deviations."""

    def function(xs: np.ndarray, u: np.ndarray, alphas: np.ndarray, dt: float, rng: Generator) -> np.ndarray:
        return _motions(xs, u + spread(u, alphas, dt) * rng.normal(size=xs.shape), dt)

    return function


def one_for_all(xs: np.ndarray, u: np.ndarray, alphas: np.ndarray, dt: float, rng: Generator) -> np.ndarray:
    """Draw one control for the whole cloud."""
    return _motions(xs, np.tile(u + _sigma(u, alphas) * rng.normal(size=3), (len(xs), 1)), dt)


def one_number_each(
    xs: np.ndarray, u: np.ndarray, alphas: np.ndarray, dt: float, rng: Generator
) -> np.ndarray:
    """Draw one number for the three errors of a particle."""
    return _motions(xs, u + _sigma(u, alphas) * rng.normal(size=(len(xs), 1)), dt)


def on_the_pose(xs: np.ndarray, u: np.ndarray, alphas: np.ndarray, dt: float, rng: Generator) -> np.ndarray:
    """Move without error, and add the errors of the control to the pose."""
    return _motions(xs, np.tile(u, (len(xs), 1)), dt) + _sigma(u, alphas) * rng.normal(size=xs.shape)


def along_the_first_heading(
    xs: np.ndarray, u: np.ndarray, alphas: np.ndarray, dt: float, rng: Generator
) -> np.ndarray:
    """Drive straight along the heading from before."""
    v, omega, gamma = (u + _sigma(u, alphas) * rng.normal(size=xs.shape)).T
    x, y, theta = xs.T
    return np.stack(
        [x + v * dt * np.cos(theta), y + v * dt * np.sin(theta), theta + (omega + gamma) * dt], -1
    )


def turned_first(xs: np.ndarray, u: np.ndarray, alphas: np.ndarray, dt: float, rng: Generator) -> np.ndarray:
    """Turn by gamma before the arc."""
    us = u + _sigma(u, alphas) * rng.normal(size=xs.shape)
    first = xs + np.stack([0 * us[:, 2], 0 * us[:, 2], us[:, 2] * dt], axis=-1)
    return _motions(first, us * [1.0, 1.0, 0.0], dt)


def in_place(xs: np.ndarray, u: np.ndarray, alphas: np.ndarray, dt: float, rng: Generator) -> np.ndarray:
    """Write the new poses over the old."""
    xs[:] = _motions(xs, u + _sigma(u, alphas) * rng.normal(size=xs.shape), dt)
    return xs


_SIZE = "Let one alpha be 0.01 and all others 0, drive at 2 m/s, and print the spread of a thousand speeds."
_DRAW = "Draw the way of one robot, with a large omega and a large gamma: which of the two bends the way?"
_ONCE = "Print the controls of three particles. Which numbers are different, and which are not?"


def _known(name: str, explanation: str, hint: str, function: Callable) -> Misconception:
    return Misconception(name, _STAGE, explanation, hint, function)


MISCONCEPTIONS = (
    _known(
        "variances drawn as deviations",
        "The sums of alphas and squares are variances, and a generator of normal numbers wants a standard "
        "deviation. Without the root, small errors become far too small, and the cloud is too sure.",
        _SIZE,
        _with(lambda u, alphas, _dt: _variances(u, alphas)),
    ),
    _known(
        "errors scaled with the time",
        "The errors are multiplied by the root of dt, as for white noise in time. In this model the control is off "
        "by one draw for the whole step, however long that is.",
        "Make the step twice as long: does the speed of a particle err more in it?",
        _with(lambda u, alphas, dt: _sigma(u, alphas) * np.sqrt(dt)),
    ),
    _known(
        "alphas of v and omega exchanged in the cloud",
        "The first of each pair of alphas belongs to v squared, the second to omega squared. Exchanged, a robot "
        "that drives straight errs as if it turned.",
        _SIZE,
        _with(lambda u, alphas, _dt: _sigma(u, np.asarray(alphas)[[1, 0, 3, 2, 5, 4]])),
    ),
    _known(
        "speeds not squared in the cloud",
        "The variances are made of the sizes of v and omega, not of their squares: they then have another unit, and "
        "other sizes wherever a speed is not 1.",
        _SIZE,
        _with(
            lambda u, alphas, _dt: np.sqrt(
                np.reshape(alphas, (3, 2)) @ np.abs(np.asarray(u, dtype=float)[:2])
            )
        ),
    ),
    _known(
        "gamma without an error",
        "Since gamma is asked for as 0, it is left at what was asked for. It is there for the noise: without it "
        "each particle ends where its arc ends, and the cloud is a surface in three dimensions.",
        _ONCE,
        _with(lambda u, alphas, _dt: _sigma(u, alphas) * [1.0, 1.0, 0.0]),
    ),
    _known(
        "one control for all particles",
        "Three numbers are drawn for the whole cloud, which moves as one. It never spreads, and copies of a particle "
        "stay copies for ever.",
        _ONCE,
        one_for_all,
    ),
    _known(
        "one number for three controls",
        "Each particle draws one number and uses it for v, omega and gamma. The three errors then always have the "
        "same sign, and the cloud is a line.",
        _ONCE,
        one_number_each,
    ),
    _known(
        "errors added to the pose",
        "The cloud is moved without error, and the errors of the control are added to x, y and theta. A speed in m/s "
        "is not a place, and it errs along the way, not along the x axis.",
        "Which unit has the noise, and which the number that you add it to?",
        on_the_pose,
    ),
    _known(
        "cloud along the first heading",
        "The particles drive straight along the heading that they had before the step. Between its ends the heading "
        "turns, and the way is an arc.",
        _DRAW,
        along_the_first_heading,
    ),
    _known(
        "cloud turned before the arc",
        "The turn by gamma comes first, so that the arc begins in another direction. In this model the robot drives, "
        "and then turns on the spot.",
        _DRAW,
        turned_first,
    ),
    _known(
        "cloud moved in place",
        "The new poses are written into the array that was handed over. The caller's cloud is gone, and whoever "
        "compares before and after compares an array with itself.",
        "Does your function write to xs, or to a new array?",
        in_place,
    ),
)
