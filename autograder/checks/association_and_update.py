"""Hidden checks of the notebook *association-and-update*: which line is which wall, and the stacked measurement.

The scenes are made in :mod:`autograder.checks.association_inputs`; the update itself is checked in
:mod:`autograder.checks.correction`. What is compared are numbers that are only taken, not computed (covariances,
derivatives), and a difference of two angles, which is not compared on the circle: it must be wrapped.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks import association_inputs
from autograder.checks.association_inputs import covariance
from autograder.checks.kinds import each, repeatable, untouched
from roboloc_reference.association import compute_innovations, measurement_model

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

_ROUNDING = 200 * np.finfo(float).eps
LINE = ("alpha", "r")


def _largest(array: np.ndarray) -> float:
    return float(np.abs(array).max(initial=0.0))


def innovations_tolerance(
    z_raw: np.ndarray, Q_raw: np.ndarray, hs: np.ndarray, Hs: np.ndarray, _Sigma: np.ndarray, _g: float
) -> tuple[float, float, float]:
    """Bound the error of v by the rounding of a difference and a turn; Q and H are copies."""
    v = _ROUNDING * (_largest(z_raw) + _largest(hs) + 2 * np.pi)
    return v, _ROUNDING * _largest(Q_raw), _ROUNDING * _largest(Hs)


def _cases(scenes: Callable[[Generator], list[tuple]]) -> Callable[[Generator], tuple[Case, ...]]:
    """Put what is right beside the scenes."""

    def make(rng: Generator) -> list[Case]:
        return [INNOVATIONS.case(*args) for args in scenes(rng)]

    return remembered(make)


plain = _cases(association_inputs.plain)
gated = _cases(association_inputs.gated)
crowded = _cases(association_inputs.crowded)
across_the_cut = _cases(association_inputs.across_the_cut)
shared = _cases(association_inputs.shared)
nothing = _cases(association_inputs.nothing)
larger = _cases(association_inputs.larger)

_HINT_WRAP = "By how much does a wall turn between 179 degrees on one side and 179 degrees on the other?"
_HINT_NEAREST = "Nearest is judged by d2, whose S takes both doubts into account, and among all walls."
_HINT_GATE = "The gate g is a number of standard deviations, and d2 is a square."
_HINT_ROWS = "Row k of Q belongs to the observation, row k of H to the wall, of innovation k."
_INNOVATIONS_ARGUMENTS = ("z_raw", "Q_raw", "hs", "Hs", "Sigma", "g")
_VQH = frozenset({"v", "Q", "H"})

INNOVATIONS = Stage(
    name="association.compute_innovations",
    outputs=("v", "Q", "H"),
    reference=compute_innovations,
    tolerance=innovations_tolerance,
    columns={"v": LINE},
    checks=(
        Check("innovations of lines near their walls", 3, each(plain, "v"), "v is observed minus expected."),
        Check("covariances that belong to them", 2, each(plain, "Q"), _HINT_ROWS),
        Check("derivatives that belong to them", 2, each(plain, "H"), _HINT_ROWS),
        Check("validation gate", 3, each(gated, "v", "Q"), _HINT_GATE),
        Check("nearest among walls close together", 3, each(crowded), _HINT_NEAREST),
        Check("angles on both sides of the cut at pi", 2, each(across_the_cut, "v"), _HINT_WRAP),
        Check("pieces of one wall", 2, each(shared), "Each observation chooses for itself."),
        Check(
            "nothing to keep",
            1,
            each(nothing),
            "No rows, but of the right width: (0, 2), (0, 2, 2), (0, 2, n).",
        ),
        Check("states of another size", 1, each(larger), "Nothing here knows that a pose has 3 numbers."),
        Check(
            "arguments untouched",
            0.5,
            untouched(plain, _INNOVATIONS_ARGUMENTS, _VQH),
            "A column of an array is a view of it: v -= ... writes into the caller's array.",
        ),
        Check(
            "same call, same result", 0.5, repeatable(plain, _VQH), "Use the arguments alone, nothing global."
        ),
    ),
)


def stack_tolerance(v: np.ndarray, Q: np.ndarray, H: np.ndarray) -> tuple[float, float, float]:
    """Allow the last digits: every number is a copy."""
    return tuple(_ROUNDING * _largest(part) for part in (v, Q, H))


def _stack_case(rng: Generator, count: int, n: int = 3) -> Case:
    """Make `count` innovations of unlike sizes."""
    v = rng.uniform(0.02, 0.5, (count, 2)) * rng.choice([-1, 1], (count, 2))
    Q = np.array([covariance(rng, 2) for _ in range(count)]).reshape(count, 2, 2)
    H = rng.uniform(0.2, 1.5, (count, 2, n)) * rng.choice([-1, 1], (count, 2, n))
    args = (v, Q, H)
    return STACK.case(*args)


@remembered
def several(rng: Generator) -> list[Case]:
    """Make stacks of two to five lines."""
    return [_stack_case(rng, count) for count in (3, 2, 5)]


@remembered
def single(rng: Generator) -> list[Case]:
    """Make stacks of one line."""
    return [_stack_case(rng, 1) for _ in range(3)]


@remembered
def empty(rng: Generator) -> list[Case]:
    """Make stacks of no line, for states of several sizes."""
    return [_stack_case(rng, 0, n) for n in (3, 7)]


@remembered
def wide(rng: Generator) -> list[Case]:
    """Make stacks for states of other sizes."""
    return [_stack_case(rng, count, n) for count, n in ((2, 2), (3, 5), (4, 9))]


STACK = Stage(
    name="association.measurement_model",
    outputs=("z", "Q", "H"),
    reference=measurement_model,
    tolerance=stack_tolerance,
    checks=(
        Check(
            "order of the numbers in z", 3, each(several, "z"), "One line after another: alpha, r, alpha, r."
        ),
        Check("blocks of Q", 4, each(several, "Q"), "Which numbers of which lines vary together?"),
        Check("rows of H", 3, each(several, "H"), "Row i of H belongs to entry i of z."),
        Check("one line", 2, each(single), "What is a stack of one?"),
        Check(
            "no line", 3, each(empty), "Shapes (0,), (0, 0) and (0, n): an update with them changes nothing."
        ),
        Check("states of another size", 2, each(wide), "Nothing here knows that a pose has 3 numbers."),
        Check(
            "arguments untouched",
            1.5,
            untouched(several, ("v", "Q", "H"), frozenset({"z", "Q", "H"})),
            "Work on copies, or on new names.",
        ),
        Check(
            "same call, same result",
            1.5,
            repeatable(several, frozenset({"z", "Q", "H"})),
            "Use the arguments alone, nothing global.",
        ),
    ),
)

STAGES = (INNOVATIONS, STACK)
