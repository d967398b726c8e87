r"""Hidden checks of the notebook *line-measurements*: a line in the frame of the scanner, normalised, and a whole map.

Every way that is right passes.

* *Names of an angle.* The transform does not say which turn its angle is in, so any will do. The other two
  stages say [-pi, pi); there both ends are accepted, since rounding decides between them.
* *Names of a line.* Where r is 0 up to rounding, (alpha, r) and (alpha + pi, -r) are both right, each with the
  derivative that belongs to it. Elsewhere the sign of r decides, and inputs keep r at least 0.3 m away from 0.
* *Rounding.* A sine is off by eps times the size of its argument, and a distance by that times the lengths that
  are added up; the allowed error is a few hundred times this.

Inputs keep away from angles where a sine or a cosine vanishes and a wrong entry would be 0 like the right one. The
angles that a check expects are inside one turn, with and without the pi of a change of side, so that a missing wrap
costs the check that is about wrapping and no other; the scanner is at the robot's centre where a check is not about
its place.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.kinds import each, repeatable, untouched
from autograder.checks.line_inputs import (
    NEAREST,
    any_turn,
    line_seen_from,
    mounting,
    normalize_tolerance,
    one_turn,
    pose,
    predicted_tolerance,
    transform_tolerance,
)
from roboloc_reference.lines import (
    compute_predicted_measurements,
    normalize_line_parameters,
    transform_line_to_scanner_frame,
)

if TYPE_CHECKING:
    from numpy.random import Generator

LINE, POSE = ("alpha", "r"), ("x", "y", "theta")
CENTRE = (0.0, 0.0, 0.0)


def _transform_case(rng: Generator, tf: Any, *, crossed: bool = False) -> Case:
    x, tf = pose(rng), np.array(tf, dtype=float)
    args = (line_seen_from(rng, x, tf, crossed=crossed), x, tf)
    return TRANSFORM.case(*args)


@remembered
def centred(rng: Generator) -> list[Case]:
    """Make lines seen by a scanner at the robot's centre."""
    return [_transform_case(rng, CENTRE) for _ in range(5)]


@remembered
def shifted(rng: Generator) -> list[Case]:
    """Make lines seen by a scanner that is off the centre and looks ahead."""
    return [_transform_case(rng, mounting(rng, turned=False)) for _ in range(5)]


@remembered
def turned(rng: Generator) -> list[Case]:
    """Make lines seen by a scanner at the centre that does not look ahead."""
    return [_transform_case(rng, [0.0, 0.0, mounting(rng)[2]]) for _ in range(5)]


@remembered
def crossed(rng: Generator) -> list[Case]:
    """Make lines that the robot has driven across: r comes out negative."""
    return [_transform_case(rng, CENTRE, crossed=True) for _ in range(5)]


@remembered
def any_mounting(rng: Generator) -> list[Case]:
    """Make lines seen by a scanner off the centre and turned, and by one at the centre."""
    return [_transform_case(rng, tf) for tf in (mounting(rng), mounting(rng), CENTRE, CENTRE)]


_HINT_H = (
    "Put the scanner into the world first: where is it, which way does it look? Then see the line from there."
)
_HINT_SHIFT = "The mounting is given in the frame of the robot, which has turned by theta in the world."
_HINT_TURN = "How many headings lie between the world and the scanner?"
_HINT_HX = (
    "Differentiate the h that you return by x, y and theta; check one entry by hand with a small change."
)
_HINT_CROSSED = (
    "The formula goes on beyond the line: r passes through 0 and becomes negative. Nothing else happens."
)
_HINT_COPY = "Work on copies, or on new names."
_HINT_GLOBAL = "Use the arguments alone, nothing global."
_ONE = frozenset({"h", "Hx"})

TRANSFORM = Stage(
    name="lines.transform_line_to_scanner_frame",
    outputs=("h", "Hx"),
    reference=transform_line_to_scanner_frame,
    tolerance=transform_tolerance,
    rows={"h": LINE, "Hx": LINE},
    columns={"Hx": POSE},
    aligned=any_turn,
    checks=(
        Check("h, scanner at the robot's centre", 4, each(centred, "h"), _HINT_H),
        Check("h, scanner off the centre", 3, each(shifted, "h"), _HINT_SHIFT),
        Check("h, scanner turned", 2, each(turned, "h"), _HINT_TURN),
        Check("h, line crossed", 1, each(crossed, "h"), _HINT_CROSSED),
        Check("Hx, scanner at the robot's centre", 3, each(centred, "Hx"), _HINT_HX),
        Check("Hx, scanner off the centre", 3, each(shifted, "Hx"), _HINT_HX),
        Check("Hx, line crossed", 1, each(crossed, "Hx"), _HINT_CROSSED),
        Check(
            "arguments untouched",
            2,
            untouched(any_mounting, ("line", "x", "tf_base_to_camera"), _ONE),
            _HINT_COPY,
        ),
        Check("same call, same result", 1, repeatable(any_mounting, _ONE), _HINT_GLOBAL),
    ),
)


def _jacobian(rng: Generator, n: int) -> np.ndarray:
    """Draw a derivative without zeros."""
    return rng.uniform(0.2, 1.5, (2, n)) * rng.choice([-1, 1], (2, n))


def _normalize_case(alpha: float, r: float, Hx: np.ndarray) -> Case:
    args = (np.array([alpha, r]), Hx)
    return NORMALIZE.case(*args)


def _negative(rng: Generator, n: int = 3) -> Case:
    """Make a line with r < 0 whose angle needs no wrapping: a pi more is still inside the turn."""
    return _normalize_case(rng.uniform(-2.9, -0.2), -rng.uniform(NEAREST, 3), _jacobian(rng, n))


def _positive(rng: Generator, side: int, n: int = 3, farthest: float = 3.0) -> Case:
    """Make a line with r > 0 to the left, for side 1, or to the right, for side -1."""
    return _normalize_case(side * rng.uniform(0.2, 2.9), rng.uniform(NEAREST, farthest), _jacobian(rng, n))


@remembered
def positive(rng: Generator) -> list[Case]:
    """Make lines that are normalised already."""
    return [_positive(rng, side, farthest=r) for side, r in ((1, 3), (-1, 0.9), (1, 0.9), (-1, 3), (-1, 3))]


@remembered
def negative(rng: Generator) -> list[Case]:
    """Make lines with r < 0."""
    return [_negative(rng) for _ in range(5)]


@remembered
def beyond(rng: Generator) -> list[Case]:
    """Make lines whose angle is outside one turn, or leaves it with the pi of a change of side."""
    spans = [(3.4, 6.0, 1), (-6.0, -3.4, 1), (7.0, 9.0, 1), (-20, -16.5, 1), (0.2, 2.9, -1), (3.4, 6.0, -1)]
    spans += [(-9.2, -6.6, -1)]
    return [
        _normalize_case(rng.uniform(low, high), sign * rng.uniform(NEAREST, 3), _jacobian(rng, 3))
        for low, high, sign in spans
    ]


@remembered
def sizes(rng: Generator) -> list[Case]:
    """Make lines with r > 0 whose derivative is by 2, 5 and 9 numbers: a state may hold a map."""
    return [_positive(rng, side, n) for side, n in ((1, 2), (-1, 5), (1, 9))]


@remembered
def at_zero(rng: Generator) -> list[Case]:
    """Make lines through the scanner: r exactly 0, of either sign, and 0 up to rounding."""
    return [
        _normalize_case(rng.uniform(-2.9, -0.2), r, _jacobian(rng, 3))
        for r in (0.0, -0.0, 1e-17, -1e-17, 0.0)
    ]


@remembered
def both_sides(rng: Generator) -> list[Case]:
    """Make lines with r of either sign."""
    return [_positive(rng, 1), _negative(rng), _positive(rng, -1), _negative(rng)]


_HINT_KEPT = "A line with r above 0 and its angle in [-pi, pi) is normalised already."
_HINT_FLIP = "Which point of a line is nearest to the scanner? It does not depend on how the line is written."
_HINT_ROWS = (
    "Row 1 of Hx is the derivative of alpha, row 2 that of r. What happens to each where r changes sign?"
)
_HINT_WRAP = "roboloc.angles.wrap, or a formula for it: more than one turn may have to go, on either side."

NORMALIZE = Stage(
    name="lines.normalize_line_parameters",
    outputs=("h", "Hx"),
    reference=normalize_line_parameters,
    tolerance=normalize_tolerance,
    rows={"h": LINE, "Hx": LINE},
    aligned=one_turn,
    checks=(
        Check("h with r > 0", 2, each(positive, "h"), _HINT_KEPT),
        Check("Hx with r > 0", 2, each(positive, "Hx"), _HINT_KEPT),
        Check("h with r < 0", 4, each(negative, "h"), _HINT_FLIP),
        Check("Hx with r < 0", 4, each(negative, "Hx"), _HINT_ROWS),
        Check("alpha in one turn", 3, each(beyond, "h"), _HINT_WRAP),
        Check("states of another size", 1, each(sizes, "Hx"), "Hx may have any number of columns."),
        Check("r = 0", 1, each(at_zero), "At r = 0 there is nothing to be changed, and nothing to be lost."),
        Check("arguments untouched", 2, untouched(both_sides, ("h", "Hx"), _ONE), _HINT_COPY),
        Check("same call, same result", 1, repeatable(both_sides, _ONE), _HINT_GLOBAL),
    ),
)


def _map_case(rng: Generator, tf: Any, crossed: tuple[bool, ...]) -> Case:
    """Make a map with one line for each entry of `crossed`."""
    x, tf = pose(rng), np.array(tf, dtype=float)
    lines = [line_seen_from(rng, x, tf, crossed=one) for one in crossed]
    nearest_first = sorted(
        range(len(lines)), key=lambda j: abs(transform_line_to_scanner_frame(lines[j], x, tf)[0][1])
    )
    if nearest_first == list(range(len(lines))):
        lines.reverse()  # sorting must show
    args = (x, np.array(lines).T.copy(), tf)
    return PREDICTED.case(*args)


@remembered
def around(rng: Generator) -> list[Case]:
    """Make maps of lines around a scanner at the robot's centre."""
    return [_map_case(rng, CENTRE, (False,) * count) for count in (4, 5, 6)]


@remembered
def mounted(rng: Generator) -> list[Case]:
    """Make maps seen by a scanner that is off the centre and turned."""
    return [_map_case(rng, mounting(rng), (False,) * count) for count in (4, 5, 6)]


@remembered
def some_crossed(rng: Generator) -> list[Case]:
    """Make maps of which the robot has driven across some lines."""
    return [_map_case(rng, CENTRE, tuple(rng.permutation([True, False] * 2 + [True]))) for _ in range(3)]


@remembered
def crossed_anywhere(rng: Generator) -> list[Case]:
    """Make maps of which the robot has driven across some lines, its scanner at its centre or elsewhere."""
    flags = [tuple(rng.permutation([True, False] * 2 + [True])) for _ in range(4)]
    return [
        _map_case(rng, tf, crossed) for tf, crossed in zip([CENTRE, mounting(rng)] * 2, flags, strict=True)
    ]


@remembered
def behind(rng: Generator) -> list[Case]:
    """Make maps of lines that need wrapping."""
    cases = []
    for sign in (1, -1, 1):
        x = pose(rng)
        x[2] = sign * rng.uniform(2.0, 2.8)
        lines = np.array([_line_behind(rng, x, sign) for _ in range(4)]).T.copy()
        args = (x, lines, np.array(CENTRE))
        cases.append(PREDICTED.case(*args))
    return cases


def _line_behind(rng: Generator, x: np.ndarray, sign: int) -> np.ndarray:
    """Draw a line at which alpha - theta is more than half a turn."""
    while True:
        alpha = x[2] - sign * rng.uniform(3.5, 4.5)
        r = rng.uniform(NEAREST, 3.0) + x[0] * np.cos(alpha) + x[1] * np.sin(alpha)
        if r > 0.2:
            return np.array([alpha, r])


@remembered
def one_line(rng: Generator) -> list[Case]:
    """Make maps of a single line."""
    return [_map_case(rng, CENTRE, (False,)) for _ in range(3)]


@remembered
def whole(rng: Generator) -> list[Case]:
    """Make maps of each kind."""
    return [
        _map_case(rng, CENTRE, (False,) * 4),
        _map_case(rng, mounting(rng), (False, True, False, False, True)),
    ]


_HINT_MAP = "Column j of map_lines gives column j of hs and layer j of Hs, each from its own line."
_HINT_SIDES = "Every line is normalised for itself, h and derivative together."
_ALL = frozenset({"hs", "Hs"})

PREDICTED = Stage(
    name="lines.compute_predicted_measurements",
    outputs=("hs", "Hs"),
    reference=compute_predicted_measurements,
    tolerance=predicted_tolerance,
    rows={"hs": LINE},
    aligned=one_turn,
    checks=(
        Check("hs, scanner at the robot's centre", 3, each(around, "hs"), _HINT_MAP),
        Check("Hs, scanner at the robot's centre", 3, each(around, "Hs"), _HINT_MAP),
        Check("hs, scanner mounted elsewhere", 2, each(mounted, "hs"), _HINT_SHIFT),
        Check("Hs, scanner mounted elsewhere", 2, each(mounted, "Hs"), _HINT_SHIFT),
        Check("hs, lines crossed", 2, each(some_crossed, "hs"), _HINT_SIDES),
        Check("Hs, lines crossed", 2, each(crossed_anywhere, "Hs"), _HINT_SIDES),
        Check("alpha in one turn", 2, each(behind, "hs"), _HINT_WRAP),
        Check(
            "map of one line", 1, each(one_line), "A map of one line is still (2, 1), and Hs is (1, 2, 3)."
        ),
        Check(
            "arguments untouched",
            2,
            untouched(whole, ("x", "map_lines", "tf_base_to_camera"), _ALL),
            _HINT_COPY,
        ),
        Check("same call, same result", 1, repeatable(whole, _ALL), _HINT_GLOBAL),
    ),
)

STAGES = (TRANSFORM, NORMALIZE, PREDICTED)
