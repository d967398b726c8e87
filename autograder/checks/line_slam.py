r"""Hidden checks of the notebook *line-slam*: the motion of pose and lines, and the lines predicted from both.

Every way that is right passes. What a robot of its own does, and how it sees a line of a known map, are stages of
other notebooks, and are needed here again: a mistake in them costs little. Most checks look at what is new alone, the
blocks that belong to the lines, and allow anything elsewhere. Tolerances of the old parts are those of the old stages;
a zero and a one must be right up to rounding.

Lines keep 0.3 m away from the scanner, so that the sign of r is never in doubt, and their angles are inside one turn
with and without the pi of a change of side, except where a check is about wrapping.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.kinds import each, repeatable, untouched
from autograder.checks.line_inputs import line_seen_from, mounting, one_turn, pose, transform_tolerance
from autograder.checks.motion_model import POSE, dynamics_tolerance, heading
from roboloc_reference.slam import compute_predicted_measurements, transition_model

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

_ROUNDING = 200 * np.finfo(float).eps
_CENTRE = (0.0, 0.0, 0.0)
_HINT_COPY = "Work on copies, or on new names."
_HINT_GLOBAL = "Use the arguments alone, nothing global."


def transition_tolerance(x: np.ndarray, u: np.ndarray, dt: float) -> tuple[np.ndarray, ...]:
    """Bound the error of g, Gx and Gu: that of the motion for the pose, rounding for the lines."""
    n = x.size
    parts = _ROUNDING * np.abs(x), np.full((n, n), _ROUNDING), np.full((n, 2), _ROUNDING)
    for whole, block in zip(parts, dynamics_tolerance(x[:3], u, dt), strict=True):
        whole[tuple(map(slice, block.shape))] = block
    return parts


def _lines(rng: Generator, count: int) -> np.ndarray:
    """Draw lines of a state, alpha and r in turns."""
    alpha = rng.uniform(0.3, 2.8, count) * rng.choice([-1, 1], count)
    return np.array([alpha, rng.uniform(0.5, 4.0, count)]).T.ravel()


def _moved(rng: Generator, omega: float, J: int, turns: int = 0) -> Case:
    """Make one motion of a robot that knows J lines; a step is never of 1 s."""
    dt = float(rng.choice([rng.uniform(0.1, 0.5), rng.uniform(1.4, 2.0)]))
    V = rng.uniform(0.4, 1.5) * rng.choice([-1, 1])
    lines = _lines(rng, J)
    lines[::2] += 2 * math.pi * turns
    place = rng.uniform(0.4, 3.0, 2) * rng.choice([-1, 1], 2)
    x = np.array([*place, heading(rng, omega * dt, turns), *lines])
    return TRANSITION.case(x, np.array([V, omega]), dt)


def lines_alone(case: Case) -> Case:
    """Allow anything in the blocks of the pose, but that the robot has not turned at all: the state itself is no g."""
    parts = tuple(np.array(part) for part in case.tolerance)
    parts[0][:3], parts[1][:3, :3], parts[2][:3] = np.inf, np.inf, np.inf
    parts[0][2] = 0.9 * abs(case.args[1][1] * case.args[2])
    return case._replace(tolerance=parts)


def pose_alone(case: Case) -> Case:
    """Allow anything in the blocks of the lines."""
    parts = tuple(np.array(part) for part in case.tolerance)
    parts[0][3:], parts[1][3:], parts[1][:, 3:], parts[2][3:] = np.inf, np.inf, np.inf, np.inf
    return case._replace(tolerance=parts)


def seen_as(
    view: Callable[[Case], Case], cases: Callable[[Generator], tuple[Case, ...]]
) -> Callable[[Generator], list[Case]]:
    """Return cases of which only a part is judged."""
    return lambda rng: [view(case) for case in cases(rng)]


@remembered
def arcs(rng: Generator) -> list[Case]:
    """Make arcs to both sides among some lines."""
    return [_moved(rng, sign * rng.uniform(0.3, 1.2), J) for sign, J in ((1, 2), (-1, 3), (1, 4), (-1, 2))]


@remembered
def nearly_straight(rng: Generator) -> list[Case]:
    """Make straight drives, and turns so slow that the closed form fails."""
    omegas = (0.0, rng.uniform(1e-9, 2e-9), -rng.uniform(1e-7, 2e-7), 0.0)
    return [_moved(rng, omega, 2) for omega in omegas]


@remembered
def sizes(rng: Generator) -> list[Case]:
    """Make motions with no line, with one, and with many."""
    return [_moved(rng, rng.uniform(0.3, 1.2), J) for J in (0, 1, 7)]


@remembered
def many_turns(rng: Generator) -> list[Case]:
    """Make motions of a robot that has turned around several times, among lines that have as well."""
    cases = [_moved(rng, sign * rng.uniform(0.3, 1.2), 2, 4) for sign in (1, -1, 1)]
    anywhere = np.array([np.inf, np.inf, 0.0, 0.0, 0.0, 0.0, 0.0])
    return [case._replace(tolerance=(case.tolerance[0] + anywhere, *case.tolerance[1:])) for case in cases]


_MOTION = frozenset({"g", "Gx", "Gu"})
_HINT_STAY = "A wall stands still in the world. What is then its alpha after the motion, and what its r?"
_HINT_ONE = "A wall that is 1 cm farther away than thought is so after the motion too: which entry says that?"
_HINT_POSE = "The first three numbers move as in the notebook motion-model; the lines have no part in it."
_HINT_CONTROL = "What does a control do to a wall?"

TRANSITION = Stage(
    name="slam.transition_model",
    outputs=("g", "Gx", "Gu"),
    reference=transition_model,
    tolerance=transition_tolerance,
    rows={"g": POSE, "Gx": POSE, "Gu": POSE},
    columns={"Gx": POSE, "Gu": ("V", "omega")},
    checks=(
        Check("g, the lines", 3, each(seen_as(lines_alone, arcs), "g"), _HINT_STAY),
        Check("g, the pose", 3, each(seen_as(pose_alone, arcs), "g"), _HINT_POSE),
        Check("Gx, rows and columns of the lines", 4, each(seen_as(lines_alone, arcs), "Gx"), _HINT_ONE),
        Check("Gx, block of the pose", 2, each(seen_as(pose_alone, arcs), "Gx"), _HINT_POSE),
        Check("Gu, rows of the lines", 2, each(seen_as(lines_alone, arcs), "Gu"), _HINT_CONTROL),
        Check("Gu, rows of the pose", 1, each(seen_as(pose_alone, arcs), "Gu"), _HINT_POSE),
        Check(
            "straight lines and very slow turns",
            1,
            each(seen_as(pose_alone, nearly_straight)),
            "omega = 0 is allowed, and so is 1e-9: take the limits there.",
        ),
        Check(
            "maps of other sizes",
            1,
            each(seen_as(lines_alone, sizes)),
            "There may be no line, or many: read their number off the length of x.",
        ),
        Check("nothing is wrapped", 1, each(many_turns, "g"), "A motion keeps every angle in its turn."),
        Check(
            "arguments untouched",
            1,
            untouched(seen_as(lines_alone, arcs), ("x", "u", "dt"), _MOTION),
            _HINT_COPY,
        ),
        Check("same call, same result", 1, repeatable(seen_as(lines_alone, arcs), _MOTION), _HINT_GLOBAL),
    ),
)


def predicted_tolerance(x: np.ndarray, tf: np.ndarray, _fixed: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Bound the error that rounding may cause: that of the transform, in all of the line's rows."""
    J = (x.size - 3) // 2
    hs, Hs = np.zeros((2, J)), np.full((J, 2, x.size), _ROUNDING)
    for j, line in enumerate(x[3:].reshape(J, 2)):
        hs[:, j], by_pose = transform_tolerance(line, x[:3], tf)
        Hs[j, :, :3] = by_pose
        Hs[j, :, 3:] = by_pose.max()
    return hs, Hs


def _state(rng: Generator, tf: np.ndarray, crossed: tuple[bool, ...]) -> np.ndarray:
    """Draw a pose and one line for each entry of `crossed`."""
    x = pose(rng)
    return np.concatenate([x, *(line_seen_from(rng, x, tf, crossed=one) for one in crossed)])


def _seen(
    rng: Generator, crossed: tuple[bool, ...], *fixed: int, tf: Any = _CENTRE, reverse: bool = False
) -> Case:
    """Make a prediction; without `fixed` the call leaves it out."""
    tf = np.array(tf, dtype=float)
    return PREDICTED.case(_state(rng, tf, crossed[:: -1 if reverse else 1]), tf, *fixed)


def _blocks(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Return which entries of Hs belong to each line's own block (J, n), and which to the pose (n,)."""
    n = case.args[0].size
    J = (n - 3) // 2
    of = (np.arange(n) - 3) // 2
    return (np.arange(J)[:, None] == of) & (np.arange(n) >= 3), np.arange(n) < 3


def by_pose(case: Case) -> Case:
    """Judge the columns of the pose alone."""
    return _judged(case, np.broadcast_to(_blocks(case)[1], case.expected[1].shape))


def by_itself(case: Case) -> Case:
    """Judge the block of each line alone."""
    return _judged(case, np.broadcast_to(_blocks(case)[0][:, None], case.expected[1].shape))


def by_others(case: Case) -> Case:
    """Judge the columns of all lines but the line's own."""
    own, of_pose = _blocks(case)
    return _judged(case, np.broadcast_to(~(own | of_pose)[:, None], case.expected[1].shape))


def by_certain(case: Case) -> Case:
    """Judge the columns of the fixed lines, and all rows of angles, which are simple."""
    own, _ = _blocks(case)
    fixed = case.args[2] if len(case.args) > 2 else 2
    certain = (np.arange(own.shape[1]) >= 3) & (np.arange(own.shape[1]) < 3 + 2 * fixed)
    judged = np.broadcast_to(certain, case.expected[1].shape).copy()
    judged[:, 0] = True
    return _judged(case, judged)


def _judged(case: Case, judged: np.ndarray) -> Case:
    hs, Hs = case.tolerance
    return case._replace(tolerance=(hs, np.where(judged, Hs, np.inf)))


@remembered
def free(rng: Generator) -> list[Case]:
    """Make maps of lines around a scanner at the robot's centre, none fixed."""
    return [_seen(rng, (False,) * J, 0) for J in (3, 4, 5, 4)]


@remembered
def mounted(rng: Generator) -> list[Case]:
    """Make maps seen by a scanner that is off the centre and turned, none fixed."""
    return [_seen(rng, (False,) * J, 0, tf=mounting(rng)) for J in (3, 4, 5, 4)]


@remembered
def crossed(rng: Generator) -> list[Case]:
    """Make maps of which the robot has driven across some lines, none fixed."""
    return [_seen(rng, tuple(rng.permutation([True, False, True])), 0) for _ in range(4)]


@remembered
def certain(rng: Generator) -> list[Case]:
    """Make maps of which some lines are fixed: one, three, and two where nothing is said."""
    return [_seen(rng, (False,) * 5, *fixed) for fixed in ((1,), (3,), (), (2,))]


@remembered
def few(rng: Generator) -> list[Case]:
    """Make maps of one line, free and fixed, and of two of which three would be fixed."""
    return [_seen(rng, (False,) * J, fixed) for J, fixed in ((1, 0), (1, 2), (2, 3), (1, 1))]


@remembered
def whole(rng: Generator) -> list[Case]:
    """Make maps of each kind."""
    return [
        _seen(rng, (False,) * 4, 0),
        _seen(rng, (False, True, False), 1, tf=mounting(rng)),
        _seen(rng, (False,) * 3, 2),
    ]


_SEEN = frozenset({"hs", "Hs"})
_HINT_OLD = "This part is that of the notebook line-measurements, with the lines read from the state."
_HINT_OWN = (
    "Nudge alpha of one line by 0.01, and see what your own hs does: that is a column. Then do it with r."
)
_HINT_PLACE = "Which columns of layer j may be other than 0? Count from the start of the state."
_HINT_SIDES = "Where the sign of r changes, what happens to each of the two rows, in all of their columns?"
_HINT_FIXED = "What is observed may still move the robot, but none of the lines that are certain."

PREDICTED = Stage(
    name="slam.compute_predicted_measurements",
    outputs=("hs", "Hs"),
    reference=compute_predicted_measurements,
    tolerance=predicted_tolerance,
    rows={"hs": ("alpha", "r")},
    aligned=one_turn,
    checks=(
        Check("hs", 3, each(free, "hs"), _HINT_OLD),
        Check("Hs by the pose", 2, each(seen_as(by_pose, free), "Hs"), _HINT_OLD),
        Check("Hs of each line by itself", 5, each(seen_as(by_itself, free), "Hs"), _HINT_OWN),
        Check("Hs by the other lines", 2, each(seen_as(by_others, free), "Hs"), _HINT_PLACE),
        Check(
            "scanner mounted elsewhere",
            2,
            each(mounted),
            "A wall that turns about the origin of the world passes the scanner, not the robot's centre: how fast?",
        ),
        Check("lines crossed", 2, each(crossed), _HINT_SIDES),
        Check("fixed lines", 2, each(seen_as(by_certain, certain), "Hs"), _HINT_FIXED),
        Check(
            "maps of other sizes",
            1,
            each(few),
            "One line is still (2, 1) and (1, 2, 5). Fewer lines than fixed: all are.",
        ),
        Check("arguments untouched", 0.5, untouched(whole, ("x", "tf", "fixed"), _SEEN), _HINT_COPY),
        Check("same call, same result", 0.5, repeatable(whole, _SEEN), _HINT_GLOBAL),
    ),
)

STAGES = (TRANSITION, PREDICTED)
