"""Wrong versions of `sample_motion`: signs, errors and spreads of the odometry, as people write them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

_STAGE = "odometry.sample_motion"


def _drawn(odometry: np.ndarray, spread: list, rng: Generator, count: int) -> np.ndarray:
    """Return the controls of all particles, drawn about the odometry."""
    return (odometry + np.array(spread) * rng.standard_normal((count, 3))).T


def _spread(odometry: np.ndarray, alphas: np.ndarray) -> list:
    """Return the standard deviations of the three errors."""
    a1, a2, a3, a4 = alphas
    one, way, two = np.abs(odometry)
    return [a1 * one + a2 * way, a3 * way + a4 * (one + two), a1 * two + a2 * way]


def _gone(xs: np.ndarray, direction: np.ndarray, trans: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """Return particles that went some way in some direction and have a new heading."""
    x, y = xs[:, 0] + trans * np.cos(direction), xs[:, 1] + trans * np.sin(direction)
    return np.stack([x, y, heading], axis=-1)


def clockwise_positive(
    xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, rng: Generator
) -> np.ndarray:
    """Count turns clockwise."""
    rot1, trans, rot2 = _drawn(odometry, _spread(odometry, alphas), rng, len(xs))
    direction = xs[:, 2] - rot1
    return _gone(xs, direction, trans, direction - rot2)


def commanded_way(xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, rng: Generator) -> np.ndarray:
    """Drive the way that was asked for."""
    rot1, _, rot2 = _drawn(odometry, _spread(odometry, alphas), rng, len(xs))
    direction = xs[:, 2] + rot1
    return _gone(xs, direction, odometry[1], direction + rot2)


def cancelling_turns(xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, rng: Generator) -> np.ndarray:
    """Take the size of the sum of the turns."""
    spread = _spread(odometry, alphas)
    spread[1] = alphas[2] * abs(odometry[1]) + alphas[3] * abs(odometry[0] + odometry[2])
    rot1, trans, rot2 = _drawn(odometry, spread, rng, len(xs))
    direction = xs[:, 2] + rot1
    return _gone(xs, direction, trans, direction + rot2)


def signed_turns(xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, rng: Generator) -> np.ndarray:
    """Leave the sizes away."""
    a1, a2, a3, a4 = alphas
    one, way, two = odometry
    spread = [a1 * one + a2 * way, a3 * way + a4 * (one + two), a1 * two + a2 * way]
    rot1, trans, rot2 = _drawn(odometry, spread, rng, len(xs))
    direction = xs[:, 2] + rot1
    return _gone(xs, direction, trans, direction + rot2)


def as_variance(xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, rng: Generator) -> np.ndarray:
    """Take the root of the spread."""
    rot1, trans, rot2 = _drawn(odometry, np.sqrt(_spread(odometry, alphas)), rng, len(xs))
    direction = xs[:, 2] + rot1
    return _gone(xs, direction, trans, direction + rot2)


def squared(xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, rng: Generator) -> np.ndarray:
    """Square the spread."""
    rot1, trans, rot2 = _drawn(odometry, np.square(_spread(odometry, alphas)), rng, len(xs))
    direction = xs[:, 2] + rot1
    return _gone(xs, direction, trans, direction + rot2)


def both_turns_first(xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, rng: Generator) -> np.ndarray:
    """Make both turns before the way."""
    rot1, trans, rot2 = _drawn(odometry, _spread(odometry, alphas), rng, len(xs))
    heading = xs[:, 2] + rot1 + rot2
    return _gone(xs, heading, trans, heading)


def old_heading(xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, rng: Generator) -> np.ndarray:
    """Drive along the heading before the turn."""
    rot1, trans, rot2 = _drawn(odometry, _spread(odometry, alphas), rng, len(xs))
    return _gone(xs, xs[:, 2], trans, xs[:, 2] + rot1 + rot2)


def one_error_for_all(xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, rng: Generator) -> np.ndarray:
    """Draw three numbers for all particles together."""
    rot1, trans, rot2 = _drawn(odometry, _spread(odometry, alphas), rng, 1)
    direction = xs[:, 2] + rot1
    return _gone(xs, direction, trans, direction + rot2)


def one_number_each(xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, rng: Generator) -> np.ndarray:
    """Use one normal number of a particle for all three errors."""
    error = rng.standard_normal((len(xs), 1)) * np.array(_spread(odometry, alphas))
    rot1, trans, rot2 = (odometry + error).T
    direction = xs[:, 2] + rot1
    return _gone(xs, direction, trans, direction + rot2)


def heading_without_first_error(
    xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, rng: Generator
) -> np.ndarray:
    """Let the heading follow the first turn as it was asked for."""
    rot1, trans, rot2 = _drawn(odometry, _spread(odometry, alphas), rng, len(xs))
    return _gone(xs, xs[:, 2] + rot1, trans, xs[:, 2] + odometry[0] + rot2)


def in_place(xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, rng: Generator) -> np.ndarray:
    """Move the caller's particles."""
    rot1, trans, rot2 = _drawn(odometry, _spread(odometry, alphas), rng, len(xs))
    direction = xs[:, 2] + rot1
    xs[:] = _gone(xs, direction, trans, direction + rot2)
    return xs


_DRAW = "Draw on paper where a particle at the origin is after a quarter turn to the left and 1 m."
_UNIT = "What does the second number of a normal distribution mean in this notebook, and in your call?"
_ONCE = "Change one of the errors of one particle: what of that particle changes?"


def _known(name: str, explanation: str, hint: str, function: Callable) -> Misconception:
    return Misconception(name, _STAGE, explanation, hint, function)


MISCONCEPTIONS = (
    _known(
        "turns counted clockwise",
        "A turn to the left is taken as negative, as on a compass. The headings of this course grow "
        "anticlockwise, like the angles of sine and cosine, so every particle turns to the wrong side.",
        _DRAW,
        clockwise_positive,
    ),
    _known(
        "way without its error",
        "The error of the way is drawn and then not used: the particle drives exactly what was asked. It "
        "happens where the noisy control and the clean one have names that look alike.",
        "Print the ways that three particles have gone.",
        commanded_way,
    ),
    _known(
        "turns that cancel",
        "The two turns are added before their size is taken. A turn to the left and one back then leave no "
        "doubt about the way, although the robot has turned twice.",
        "What does the error of the way come to for a turn of 20 degrees and the same turn back?",
        cancelling_turns,
    ),
    _known(
        "turns and ways with their signs",
        "The spread is computed from the signed numbers. A turn to the right makes the errors smaller than "
        "none, and driving backwards makes a standard deviation negative.",
        "Work the three spreads out for a robot that turns right and drives backwards.",
        signed_turns,
    ),
    _known(
        "spread taken for a variance",
        "The spread is taken for a variance, and its root is drawn from. N(0, .) is written with a variance "
        "in most books, with a standard deviation here: small errors become far too large.",
        _UNIT,
        as_variance,
    ),
    _known(
        "spread squared",
        "The spread is squared, as for a variance, and then handed to a function that wants a standard "
        "deviation. Small errors become far too small.",
        _UNIT,
        squared,
    ),
    _known(
        "both turns before the way",
        "The particle makes both turns and then drives. The second turn belongs to the end of the way, and "
        "its only effect is on the heading.",
        _DRAW,
        both_turns_first,
    ),
    _known(
        "way along the old heading",
        "The particle drives along the heading that it had before the first turn. The final heading is right, "
        "so a robot that turns little hardly shows it.",
        _DRAW,
        old_heading,
    ),
    _known(
        "one error for all particles",
        "Three numbers are drawn for the whole cloud, which then moves as one. It never spreads, and so it "
        "can follow no robot that slips.",
        "How many numbers does rng return in your function, and how many particles are there?",
        one_error_for_all,
    ),
    _known(
        "one number for three errors",
        "Each particle draws one number and uses it for both turns and the way. The three errors then always "
        "have the same sign, and the cloud is a line instead of a patch.",
        _ONCE,
        one_number_each,
    ),
    _known(
        "heading without the first error",
        "The first turn errs in the direction of the way, and not in the heading that is returned, where the "
        "clean turn is added. A particle then looks elsewhere than where it went.",
        _ONCE,
        heading_without_first_error,
    ),
    _known(
        "particles moved in place",
        "The new poses are written into the array that was handed over. The caller's particles are gone, and "
        "whoever compares before and after compares an array with itself.",
        "Does your function write to xs, or to a new array?",
        in_place,
    ),
)
