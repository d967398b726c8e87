"""Hidden checks of the notebook *growing-the-map*: whether a line that is seen is known, new, or in doubt.

Every way that is right passes: squared distances keep a tenth away from both gates, and from each other where the least
of them decides.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.growing_map import covariance
from autograder.checks.kinds import each, repeatable, untouched
from roboloc_reference.new_lines import recognize, squared_distances

if TYPE_CHECKING:
    from numpy.random import Generator

_EASY = (0.0, 0.0)  # so near that it is the line by any measure
_HINT_COPY = "Work on copies, or on new names."
_HINT_GLOBAL = "Use the arguments alone, nothing global."


def _exactly(*_args: Any) -> float:
    return 0.25


def scene(rng: Generator, J: int = 4, spread: float = 0.3) -> tuple:
    """Draw predicted lines far from each other, their derivatives, and a covariance."""
    n = 3 + 2 * J
    hs = np.array(
        [rng.permutation(np.linspace(-2.4, 2.4, J)) + rng.uniform(-0.1, 0.1, J), rng.uniform(2.0, 6.0, J)]
    )
    Hs = rng.uniform(0.2, 1.0, (J, 2, n)) * rng.choice([-1, 1], (J, 2, n))
    return hs, Hs, covariance(rng, n, spread / 6)


def off_by(rng: Generator, d: float, S: np.ndarray, stretched: int | None = None) -> np.ndarray:
    """Draw an innovation that is d standard deviations large; with `stretched` 1 along the longest axis of S."""
    values, vectors = np.linalg.eigh(S)
    direction = rng.normal(size=2) if stretched is None else np.eye(2)[stretched]
    return d * vectors @ (np.sqrt(values) * direction / np.linalg.norm(direction))


def _sighting(
    rng: Generator, d: tuple[float, float], *, name: int = 1, turn: bool = False, long: bool = False
) -> Case:
    """Make an observation at a distance between two, in gates, of one of four lines, and far from the others.

    `name` -1 and -2 write it the other way, at an angle above 0 and below.
    """
    g, newness = rng.uniform(2.0, 2.6), rng.uniform(4.5, 5.5)
    while True:
        hs, Hs, Sigma = scene(rng)
        j, Q = int(rng.integers(4)), covariance(rng, 2, 0.12)
        if turn:
            hs[0, j] = rng.choice([-1, 1]) * 3.1
        if long:
            Q = Q + np.diag([0.0, 4.0])
        S = Hs[j] @ Sigma @ Hs[j].T + Q
        unit = g if d[1] <= 1 else newness if d[0] >= 1.5 else 1.0
        size = rng.uniform(*d) * unit if unit != 1.0 else rng.uniform(1.15 * g, 0.85 * newness)
        v = off_by(rng, size, S, 1 if long else None)
        z = hs[:, j] + v
        if name >= 0 and (abs(z[0]) >= math.pi) != turn:
            continue  # whoever forgets to wrap is told by the cases that are meant for it
        z[0] = (z[0] + math.pi) % (2 * math.pi) - math.pi
        if (name < 0 and z[0] * (name + 1.5) > 0) or (long and z[1] <= 0.0):
            continue
        if name < 0:
            z, Q = np.array([z[0] - math.copysign(math.pi, z[0]), -z[1]]), Q * [[1, -1], [-1, 1]]
        d2 = squared_distances(z, Q, hs, Hs, Sigma)
        others = np.delete(d2, j)
        if others.min() > (1.4 * newness) ** 2 and abs(d2[j] - size**2) < 1e-6:
            return RECOGNIZE.case(z, Q, hs, Hs, Sigma, float(g), float(newness))


@remembered
def known(rng: Generator) -> list[Case]:
    """Make observations of lines of the map."""
    return [_sighting(rng, d) for d in ((0.2, 0.5), (0.8, 0.9)) * 6]


@remembered
def new(rng: Generator) -> list[Case]:
    """Make observations of lines that are far from all others; one of a known line shows that not all is new."""
    return [_sighting(rng, d) for d in (*((1.5, 2.0),) * 5, _EASY)]


@remembered
def doubtful(rng: Generator) -> list[Case]:
    """Make observations between the two gates; one of a known line shows that not all is in doubt."""
    return [_sighting(rng, d) for d in (*((1.0, 1.2),) * 12, _EASY)]


@remembered
def uncertain(rng: Generator) -> list[Case]:
    """Make observations that are off by much, in the direction in which much is to be expected."""
    return [_sighting(rng, (0.8, 0.9), long=True) for _ in range(4)]


@remembered
def across_the_cut(rng: Generator) -> list[Case]:
    """Make observations of lines at the other end of the turn."""
    return [_sighting(rng, (0.8, 0.9), turn=True) for _ in range(6)]


@remembered
def other_name(rng: Generator) -> list[Case]:
    """Make observations of lines under the other name of the line."""
    return [_sighting(rng, (0.8, 0.9), name=name) for name in (-1, -2) * 3]


@remembered
def two_near(rng: Generator) -> list[Case]:
    """Make observations that are within the gate of two lines; the second is the nearer one."""
    cases = []
    while len(cases) < 8:
        case = _sighting(rng, (0.8, 0.85))
        z, Q, hs, Hs, Sigma, g, newness = case.args
        j = case.expected[0]
        if j == 0:
            continue
        hs, Hs = hs.copy(), Hs.copy()
        hs[:, 0], Hs[0] = z + off_by(rng, 0.95 * g, Hs[j] @ Sigma @ Hs[j].T + Q), Hs[j]
        if abs(hs[0, 0]) < 3.0:
            cases.append(RECOGNIZE.case(z, Q, hs, Hs, Sigma, g, newness))
    return cases


@remembered
def nothing_known(rng: Generator) -> list[Case]:
    """Make observations of a robot whose map is empty, and one of a known line."""
    z, Q = np.array([0.3, 2.0]), 0.01 * np.eye(2)
    return [*(RECOGNIZE.case(z, Q, *scene(rng, 0), 3.0, 5.0) for _ in range(3)), _sighting(rng, _EASY)]


@remembered
def any_sighting(rng: Generator) -> list[Case]:
    """Make observations of each kind."""
    return [_sighting(rng, d) for d in ((0.2, 0.85), (1.5, 2.0), (1.0, 1.2))]


_NUMBER = frozenset({"j"})
_HINT_NEAR = "Which line has the least squared distance, in units of S? Print them all."

RECOGNIZE = Stage(
    name="slam.recognize",
    outputs=("j",),
    reference=recognize,
    tolerance=_exactly,
    checks=(
        Check("lines of the map", 4, each(known), _HINT_NEAR),
        Check(
            "new lines", 4, each(new), "New is what is farther than newness from every line, not from one."
        ),
        Check("lines in doubt", 4, each(doubtful), "Between the two gates there is a third answer."),
        Check(
            "uncertain observations",
            2,
            each(uncertain),
            "How large a difference is depends on what is expected.",
        ),
        Check("across the cut", 2, each(across_the_cut), "Print the difference of the two angles."),
        Check("two lines near", 1, each(two_near), "If two are within the gate, which is it?"),
        Check("the other name", 1, each(other_name), "Which other pair of numbers is the same line?"),
        Check(
            "no line at all",
            1,
            each(nothing_known),
            "An empty map has no least distance: what is seen is new.",
        ),
        Check(
            "arguments untouched",
            0.5,
            untouched(any_sighting, ("z", "Q", "hs", "Hs", "Sigma", "g", "newness"), _NUMBER),
            _HINT_COPY,
        ),
        Check("same call, same result", 0.5, repeatable(any_sighting, _NUMBER), _HINT_GLOBAL),
    ),
)

STAGES = (RECOGNIZE,)
