r"""Hidden checks of the notebook *bootstrap-filter*: particles that are moved, and bearings that are weighed.

`sample_motion` is judged by what its particles have done. Of each returned particle the turn, the way and the second
turn that took it there are worked out again; their means, standard deviations and correlations over `COUNT` particles
must be those of the model. Spreads and correlations may be `WIDE` standard errors off, means a third of a spread. A
normal number is farther off with probability 8e-11, a standard deviation of so many with less than 1e-9; five cases
have 45 such numbers, so that correct code is rejected with probability below 1e-7, whatever order it draws in.
Headings may come in any turn. With all errors 0 each particle must be where it belongs, to 1e-9.

`bearing_likelihood` may be off by 1e-7 of each density: sums of many turns lose some digits, and no more.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.kinds import each, repeatable, seeded, untouched
from autograder.compare import read
from roboloc_reference.odometry import bearing_likelihood, sample_motion

if TYPE_CHECKING:
    from numpy.random import Generator

COUNT, WIDE, EXACT = 2500, 6.5, 1e-9
CONTROLS = ("rot1", "trans", "rot2")
_ARGUMENTS = ("xs", "odometry", "alphas", "rng")


def spreads(odometry: np.ndarray, alphas: np.ndarray) -> np.ndarray:
    """Return the standard deviations of the three errors."""
    one, way, two = np.abs(odometry)
    a1, a2, a3, a4 = alphas
    return np.array([a1 * one + a2 * way, a3 * way + a4 * (one + two), a1 * two + a2 * way])


def controls(before: np.ndarray, after: np.ndarray, odometry: np.ndarray) -> np.ndarray:
    """Return the turn, way and turn (M, 3) that took each particle from where it was to where it is.

    Of the two ways to a place, ahead and back, the one is taken that was asked for.
    """
    step = (after[:, :2] - before[:, :2]) @ [1.0, 1j] * np.exp(-1j * (before[:, 2] + odometry[0]))
    step[np.abs(step) < 1e-12] = 0.0
    side = -1.0 if odometry[1] < 0.0 else 1.0
    first = np.angle(side * step)
    rest = after[:, 2] - before[:, 2] - first - odometry[0] - odometry[2]
    second = np.angle(np.exp(1j * rest))
    return np.stack([odometry[0] + first, side * np.abs(step), odometry[2] + second], axis=-1)


def moments(args: tuple, returned: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return means, standard deviations and correlations of what the particles have done.

    What does not err although it should has the correlation 0 with itself.
    """
    xs, odometry, alphas, _ = args
    found = controls(xs, read(returned, "xs", xs.shape), odometry)
    mean, spread = found.mean(axis=0), found.std(axis=0)
    white = (found - mean) / np.where(spread > EXACT, spread, np.inf)
    together = white.T @ white / len(xs)
    np.fill_diagonal(together, (spread > EXACT) | (spreads(odometry, alphas) == 0.0))
    return mean, spread, together


def true_moments(
    _xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, _rng: Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the moments of the model."""
    return odometry, spreads(odometry, alphas), np.eye(3)


def motion_tolerance(
    xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, _rng: Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Allow so many standard errors of each moment."""
    spread, error = spreads(odometry, alphas), WIDE / np.sqrt(len(xs))
    return EXACT + spread / 3.0, EXACT + error * spread / np.sqrt(2.0), np.full((3, 3), error)


def _moved(rng: Generator, odometry: Any, alphas: Any, count: int = COUNT) -> Case:
    """Make particles all around and a generator for their errors."""
    xs = np.stack([*rng.uniform(-5.0, 5.0, (2, count)), rng.uniform(-np.pi, np.pi, count)], axis=-1)
    seed = np.random.default_rng(int(rng.integers(2**32)))
    return MOTION.case(xs, np.array(odometry, dtype=float), np.array(alphas, dtype=float), seed)


def _turn(rng: Generator) -> float:
    return float(rng.uniform(0.7, 0.9))


def _way(rng: Generator) -> float:
    return float(rng.uniform(2.0, 2.4))


def _of_turns(rng: Generator) -> np.ndarray:
    """Draw errors that come from the turns most of all."""
    return rng.uniform([0.09, 0.035, 0.004, 0.05], [0.11, 0.045, 0.008, 0.07])


def _of_ways(rng: Generator) -> np.ndarray:
    """Draw errors that come from the way most of all."""
    return rng.uniform([0.04, 0.04, 0.05, 0.004], [0.06, 0.06, 0.08, 0.008])


@remembered
def without_error(rng: Generator) -> list[Case]:
    """Make motions without any error, among them one on the spot and one backwards."""
    signs = ((1, 1, 1), (1, 1, -1), (-1, 1, 1), (-1, -1, -1), (1, 0, -1))
    return [
        _moved(rng, [a * _turn(rng), b * _way(rng), c * rng.uniform(0.3, 0.6)], np.zeros(4), 40)
        for a, b, c in signs
    ]


@remembered
def one_side(rng: Generator) -> list[Case]:
    """Make motions that turn twice to the same side."""
    return [
        _moved(rng, [_turn(rng), _way(rng), _turn(rng)], _of_turns(rng)),
        _moved(rng, [-_turn(rng), _way(rng), -_turn(rng)], _of_turns(rng)),
    ]


@remembered
def either_side(rng: Generator) -> list[Case]:
    """Make a motion that turns to one side and back."""
    turn = _turn(rng)
    return [_moved(rng, [turn, _way(rng), 0.1 - turn], _of_turns(rng))]


@remembered
def along(rng: Generator) -> list[Case]:
    """Make a motion with small turns, and one backwards."""
    return [
        _moved(rng, [rng.uniform(0.1, 0.2), _way(rng), rng.uniform(-0.5, -0.4)], _of_ways(rng)),
        _moved(rng, [-rng.uniform(0.4, 0.5), -_way(rng), rng.uniform(0.1, 0.2)], _of_ways(rng)),
    ]


_HINT_WHERE = (
    "Draw one particle by hand: it turns, drives along the new heading, and turns again. Left is positive."
)
_HINT_MEAN = "The errors have mean 0: on average a particle does what was asked."
_HINT_SPREAD = "Print the three standard deviations for one motion and work them out by hand."
_HINT_SIDES = "Is a robot that turns left and back again surer of its way than one that does not turn?"
_HINT_OWN = "How many numbers does one particle need, and does any number serve twice?"
_HINT_RNG = "Draw from rng alone, and make no generator of your own."
_HINT_COPY = "Work on copies, or on new names."
_HINT_GLOBAL = "Use the arguments alone, nothing global."
_MOMENTS = ("mean", "spread", "together")

MOTION = Stage(
    name="odometry.sample_motion",
    outputs=_MOMENTS,
    reference=sample_motion,
    tolerance=motion_tolerance,
    rows=dict.fromkeys(_MOMENTS, CONTROLS),
    columns={"together": CONTROLS},
    summary=moments,
    truth=true_moments,
    checks=(
        Check("motion without error", 5, each(without_error, "mean", "spread"), _HINT_WHERE),
        Check("mean of the errors", 2, each(one_side, "mean"), _HINT_MEAN),
        Check("spread, both turns to one side", 3, each(one_side, "spread"), _HINT_SPREAD),
        Check("spread, turns to either side", 3, each(either_side, "spread"), _HINT_SIDES),
        Check("spread, along and backwards", 2, each(along, "spread"), _HINT_SPREAD),
        Check("errors of their own", 2, each(one_side, "together"), _HINT_OWN),
        Check("draws from rng alone", 1, seeded(either_side), _HINT_RNG),
        Check(
            "arguments untouched", 2, untouched(without_error, _ARGUMENTS, frozenset({"mean"})), _HINT_COPY
        ),
    ),
)


def support_tolerance(xs: np.ndarray, landmark: np.ndarray, bearing: float, sigma: float) -> np.ndarray:
    """Bound the error of each density by a share of it."""
    return 1e-7 * bearing_likelihood(xs, landmark, bearing, sigma) + 1e-14 / sigma


def _seen(
    rng: Generator, bearing: float, *, beyond: bool = False, turns: int = 0, count: int = 12, far: float = 1.2
) -> Case:
    """Make particles around a landmark whose innovations are some standard deviations at most.

    Without `beyond` the difference of bearing and prediction is small as it is; with it it is a whole turn more or
    less, and `turns` adds more of them to the headings.
    """
    landmark, sigma = rng.uniform(-2.0, 2.0, 2), float(rng.uniform(0.2, 0.5))
    direction = rng.uniform(-3.0, 3.0, count)
    away = rng.uniform(1.0, 5.0, count)
    v = sigma * far * rng.choice([-1.0, 1.0], count) * rng.uniform(0.2, 1.0, count)
    theta = direction - bearing + v
    if beyond:
        theta += 2.0 * np.pi * np.where(theta < 0.0, 1.0, -1.0)
    theta += 2.0 * np.pi * turns * rng.integers(1, 4, count)
    x, y = landmark[:, None] - away * np.array([np.cos(direction), np.sin(direction)])
    return BEARING.case(np.stack([x, y, theta], axis=-1), landmark, float(bearing), sigma)


@remembered
def ahead(rng: Generator) -> list[Case]:
    """Make landmarks seen before the robot or beside it."""
    return [_seen(rng, sign * rng.uniform(0.2, 1.5)) for sign in (1, -1, 1, -1)]


@remembered
def behind(rng: Generator) -> list[Case]:
    """Make landmarks seen nearly straight behind, where bearing and prediction have unlike signs."""
    return [_seen(rng, sign * rng.uniform(2.6, 3.1), beyond=True) for sign in (1, -1, 1, -1)]


@remembered
def turned(rng: Generator) -> list[Case]:
    """Make particles that have turned several times, the one way and the other."""
    return [_seen(rng, rng.uniform(-1.5, 1.5), turns=sign) for sign in (1, -1, 1)]


@remembered
def unlikely(rng: Generator) -> list[Case]:
    """Make bearings that hardly any particle explains."""
    return [_seen(rng, sign * rng.uniform(0.2, 1.5), far=4.0) for sign in (1, -1, 1)]


@remembered
def single(rng: Generator) -> list[Case]:
    """Make sets of one particle."""
    return [_seen(rng, sign * rng.uniform(0.2, 1.5), count=1) for sign in (1, -1) * 8]


_HINT_AHEAD = "One particle, one landmark: in which direction is it, and from where is the bearing counted?"
_HINT_WRAP = "Two bearings, 3.1 and -3.1: how far are they apart?"
_HINT_TURNS = "A robot that has turned twice sees what it saw before."
_HINT_TAIL = "Compare the logarithm of your density with a table of the normal distribution at 3 sigma."
_HINT_ONE = "A set of one particle has one support: an array of length 1."
_SUPPORT = frozenset({"support"})

BEARING = Stage(
    name="odometry.bearing_likelihood",
    outputs=("support",),
    reference=bearing_likelihood,
    tolerance=support_tolerance,
    checks=(
        Check("landmark ahead or beside", 6, each(ahead, "support"), _HINT_AHEAD),
        Check("landmark behind", 5, each(behind, "support"), _HINT_WRAP),
        Check("headings of several turns", 3, each(turned, "support"), _HINT_TURNS),
        Check("unlikely bearings", 2, each(unlikely, "support"), _HINT_TAIL),
        Check("one particle", 1, each(single, "support"), _HINT_ONE),
        Check(
            "arguments untouched",
            2,
            untouched(ahead, ("xs", "landmark", "bearing", "sigma"), _SUPPORT),
            _HINT_COPY,
        ),
        Check("same call, same result", 1, repeatable(ahead, _SUPPORT), _HINT_GLOBAL),
    ),
)

STAGES = (MOTION, BEARING)
