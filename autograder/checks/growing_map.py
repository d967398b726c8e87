r"""Hidden checks of the notebook *growing-the-map*: a new line in the world, and in the state.

Every way that is right passes. Errors of rounding are allowed as in *line-measurements*. Inputs keep the line away from
the origin of the world and from the ends of a turn, so that its name is not in doubt.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.kinds import each, repeatable, untouched
from autograder.checks.line_inputs import clear, mounting, pose
from roboloc_reference.new_lines import line_in_world
from roboloc_reference.slam import augment

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

_ROUNDING = 500 * np.finfo(float).eps
_CENTRE = (0.0, 0.0, 0.0)
LINE, POSE = ("alpha", "r"), ("x", "y", "theta")
_HINT_COPY = "Work on copies, or on new names."
_HINT_GLOBAL = "Use the arguments alone, nothing global."


def line_tolerance(z: np.ndarray, x: np.ndarray, tf: np.ndarray) -> tuple[np.ndarray, ...]:
    """Bound the error that rounding may cause."""
    size = _ROUNDING * (1 + abs(z[0]) + abs(x[2]) + abs(tf[2]))
    long = size * (1 + abs(z[1]) + np.abs(x[:2]).sum() + np.abs(tf[:2]).sum())
    return np.array([size, long]), np.full((2, 3), long), np.full((2, 2), long)


def observed(rng: Generator, tf: np.ndarray, *, beyond: bool = False, wrapped: bool = False) -> tuple:
    """Draw a line that is seen, and a pose; `beyond` puts the origin of the world behind the line.

    The angle in the world is inside one turn, with and without a change of side, unless it is to be `wrapped`.
    """
    while True:
        x, z = pose(rng), np.array([rng.uniform(-3.0, 3.0), rng.uniform(0.4, 4.0)])
        if wrapped:
            x[2] = rng.uniform(2.0, 2.9) * rng.choice([-1, 1])
        alpha = z[0] + tf[2] + x[2]
        scanner = x[:2] + _turned(x[2], tf[:2])
        r = z[1] + scanner @ [math.cos(alpha), math.sin(alpha)]
        named = alpha + math.pi * (r < 0)
        inside = abs(alpha) < 3.0 and (not beyond or abs(named) < 3.0)
        far = 3.3 < abs(named) < 6.0
        if abs(r) > 0.3 and (r < 0) == beyond and clear(alpha, z[0]) and (far if wrapped else inside):
            return z, x


def _turned(theta: float, xy: np.ndarray) -> np.ndarray:
    c, s = math.cos(theta), math.sin(theta)
    return np.array([c * xy[0] - s * xy[1], s * xy[0] + c * xy[1]])


def _world(rng: Generator, tf: Any = _CENTRE, **options: bool) -> Case:
    tf = np.array(tf, dtype=float)
    return WORLD.case(*observed(rng, tf, **options), tf)


@remembered
def centred(rng: Generator) -> list[Case]:
    """Make lines seen from a robot's centre, the origin of the world on the near side."""
    return [_world(rng) for _ in range(5)]


@remembered
def mounted(rng: Generator) -> list[Case]:
    """Make lines seen by a scanner that is off the centre and turned."""
    return [_world(rng, mounting(rng)) for _ in range(5)]


@remembered
def beyond(rng: Generator) -> list[Case]:
    """Make lines of which the origin of the world is on the far side."""
    return [_world(rng, beyond=True) for _ in range(5)]


@remembered
def wrapped(rng: Generator) -> list[Case]:
    """Make lines of which the angles add up to more than half a turn."""
    return [_world(rng, wrapped=True) for _ in range(4)]


@remembered
def any_line(rng: Generator) -> list[Case]:
    """Make lines of each kind."""
    return [_world(rng), _world(rng, mounting(rng)), _world(rng, beyond=True)]


_PARTS = frozenset({"line", "by_pose", "by_z"})
_HINT_LINE = "Put the scanner into the world: where is it, and in which direction is the normal?"
_HINT_POSE = "Nudge one number of the pose, with the observation as it is: where is the line then?"
_HINT_Z = "Nudge the angle of the observation: the line turns about the scanner. What does that do to r?"
_HINT_MOUNT = "The mounting is given in the frame of the robot, which has turned."
_HINT_SIDE = "A distance in the world is not negative. If its sign changes, what else does?"
_HINT_TURN = "Three angles are added, and perhaps a pi: print the sum."

WORLD = Stage(
    name="slam.line_in_world",
    outputs=("line", "by_pose", "by_z"),
    reference=line_in_world,
    tolerance=line_tolerance,
    rows={"line": LINE, "by_pose": LINE, "by_z": LINE},
    columns={"by_pose": POSE, "by_z": LINE},
    checks=(
        Check("line, scanner at the robot's centre", 4, each(centred, "line"), _HINT_LINE),
        Check("by_pose, scanner at the robot's centre", 4, each(centred, "by_pose"), _HINT_POSE),
        Check("by_z, scanner at the robot's centre", 3, each(centred, "by_z"), _HINT_Z),
        Check("scanner mounted elsewhere", 4, each(mounted), _HINT_MOUNT),
        Check("origin on the far side", 3, each(beyond), _HINT_SIDE),
        Check("alpha in one turn", 1, each(wrapped, "line"), _HINT_TURN),
        Check("arguments untouched", 0.5, untouched(any_line, ("z", "x", "tf"), _PARTS), _HINT_COPY),
        Check("same call, same result", 0.5, repeatable(any_line, _PARTS), _HINT_GLOBAL),
    ),
)


def augment_tolerance(
    x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, tf: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Bound the error of the state, and that of the covariance by standard deviations and lengths."""
    n = x.size
    line = line_tolerance(z, x[:3], tf)
    mean = np.concatenate([_ROUNDING * np.abs(x), line[0]])
    spread = np.sqrt(np.diag(augment(x, Sigma, z, Q, tf)[1]))
    error = line[0][1] * np.outer(spread, spread)
    error[:n, :n] = _ROUNDING * np.outer(spread[:n], spread[:n])
    return mean, error


def covariance(rng: Generator, n: int, size: float) -> np.ndarray:
    """Draw a covariance without a special structure."""
    A = size * (rng.normal(size=(n, n)) / math.sqrt(n) + np.diag(rng.uniform(0.4, 1.2, n)))
    half = A @ A.T
    return (half + half.T) / 2


def _grown(rng: Generator, J: int = 2, tf: Any = _CENTRE, **options: bool) -> Case:
    tf = np.array(tf, dtype=float)
    z, x = observed(rng, tf, **options)
    lines = np.array([rng.uniform(-2.8, 2.8, J), rng.uniform(0.5, 4.0, J)]).T.ravel()
    n = 3 + 2 * J
    return AUGMENT.case(np.concatenate([x, lines]), covariance(rng, n, 0.2), z, covariance(rng, 2, 0.1), tf)


def part(rows: slice, columns: slice) -> Callable[[Case], Case]:
    """Make a view of cases that judges one block of the covariance, and its transpose."""

    def view(case: Case) -> Case:
        mean, error = case.tolerance
        judged = np.zeros(error.shape, dtype=bool)
        judged[rows, columns] = True
        return case._replace(tolerance=(mean, np.where(judged | judged.T, error, np.inf)))

    return view


def seen_as(
    view: Callable[[Case], Case], cases: Callable[[Generator], tuple[Case, ...]]
) -> Callable[[Generator], list[Case]]:
    """Return cases of which only a part is judged."""
    return lambda rng: [view(case) for case in cases(rng)]


@remembered
def plain(rng: Generator) -> list[Case]:
    """Make states into which a line enters that is seen from the robot's centre."""
    return [_grown(rng, J) for J in (2, 3, 2, 4)]


@remembered
def other_sides(rng: Generator) -> list[Case]:
    """Make states into which a line enters from a mounted scanner, or with the origin on its far side."""
    return [
        _grown(rng, tf=mounting(rng)),
        _grown(rng, beyond=True),
        _grown(rng, tf=mounting(rng), beyond=True),
    ]


@remembered
def sizes(rng: Generator) -> list[Case]:
    """Make states with no line, one and many."""
    return [_grown(rng, J) for J in (0, 1, 6)]


_BOTH = frozenset({"x", "Sigma"})
_OLD, _POSE, _MAP, _NEW = slice(None, -2), slice(0, 3), slice(3, -2), slice(-2, None)
_HINT_CROSS = (
    "The new line was placed from the pose. If the pose is off, where is the line? Write that as a product."
)
_HINT_OWN = "Two things make the new line uncertain. Which, and through which derivative does each enter?"

AUGMENT = Stage(
    name="slam.augment",
    outputs=("x", "Sigma"),
    reference=augment,
    tolerance=augment_tolerance,
    checks=(
        Check(
            "x",
            3,
            each(plain, "x"),
            "What was known stays as it is and where it is; the new line is behind it.",
        ),
        Check(
            "Sigma, what was there",
            2,
            each(seen_as(part(_OLD, _OLD), plain), "Sigma"),
            "Does a look at something new say anything about what is known?",
        ),
        Check("Sigma, new line and pose", 4, each(seen_as(part(_NEW, _POSE), plain), "Sigma"), _HINT_CROSS),
        Check(
            "Sigma, new line and map",
            4,
            each(seen_as(part(_NEW, _MAP), plain), "Sigma"),
            "Whatever has to do with the pose has to do with a line that was placed from it.",
        ),
        Check("Sigma, new line", 4, each(seen_as(part(_NEW, _NEW), plain), "Sigma"), _HINT_OWN),
        Check("scanner mounted elsewhere, origin on the far side", 1, each(other_sides), _HINT_SIDE),
        Check("maps of other sizes", 1, each(sizes), "The map may be empty: that is how it begins."),
        Check(
            "arguments untouched", 0.5, untouched(plain, ("x", "Sigma", "z", "Q", "tf"), _BOTH), _HINT_COPY
        ),
        Check("same call, same result", 0.5, repeatable(plain, _BOTH), _HINT_GLOBAL),
    ),
)


STAGES = (WORLD, AUGMENT)
