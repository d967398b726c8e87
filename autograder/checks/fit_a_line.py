r"""Hidden checks of the notebook *fit-a-line*: the best line, its derivatives by every beam, and the whole fit.

Every way that is right passes.

* *Names of a line.* `line_parameters` may return (alpha, r) or (alpha + pi, -r), in any turn; `line_jacobians` is
  given one of the two and must differentiate that one; `fit_line` must return r >= 0 and alpha in [-pi, pi). Inputs
  keep alpha away from the ends of the turn, and r away from 0 where its sign decides.
* *Rounding.* An error is allowed that is 1e-7 of the line's direction and distance, and 1e-6 of a derivative or of
  the standard deviations that C holds: sums that are not centred lose a few digits, optimisers and differences more,
  and neither is a mistake. The points scatter by centimetres, so that a term left out is 1e4 times as large.

`line_parameters` and `line_jacobians` are parts of `roboloc_reference.extraction.fit_line`: the notebook grades it in
three steps, each fed with right inputs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.circle import nearest_turn
from autograder.checks.kinds import each, repeatable, untouched
from roboloc_reference.extraction import fit_line

if TYPE_CHECKING:
    from numpy.random import Generator

ANGLE, SHARE = 1e-7, 1e-6
LINE = ("alpha", "r")
_BEAMS = ("theta", "rho")


def line_parameters(theta: np.ndarray, rho: np.ndarray) -> tuple[float, float]:
    """Return the line of least squared distances, under the name that `fit_line` gives it.

    In the complex plane the squares of the centred points add up to a number with twice the angle of the wall.
    """
    points = rho * np.exp(1j * theta)
    mean = points.mean()
    wall = np.sqrt(((points - mean) ** 2).sum())
    foot = (mean * np.conj(1j * wall)).real * 1j * wall / abs(wall) ** 2
    return float(np.angle(foot)), float(abs(foot))


def line_jacobians(
    theta: np.ndarray, rho: np.ndarray, alpha: float, r: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivatives of the best line (alpha, r) by every bearing and by every range.

    Both conditions of the best line stay fulfilled when a beam changes; in the complex plane an error of a bearing
    moves a point by 1j times where it is, one of a range by its direction.
    """
    seen = np.exp(1j * (theta - alpha))
    foot = rho * seen
    lever = foot.imag - foot.imag.mean()
    gap = foot.real - r
    size = (lever**2).sum() - (gap**2).sum()
    jacobians = []
    for step in (1j * foot, seen):
        turn = -(lever * step.real + gap * step.imag) / size
        jacobians.append(np.array([turn, step.real / theta.size + foot.imag.mean() * turn]))
    return tuple(jacobians)


def other_name(line: tuple[float, float], near: float) -> tuple[float, float]:
    """Return a line under the name, and in the turn, whose angle is from 1.0 before `near` to 2.1 behind it.

    No plausible mistake lies at the ends, neither a right angle nor half a turn.
    """
    alpha = float(nearest_turn(line[0], near, 1.0, np.pi))
    return alpha, line[1] * (-1.0) ** round((line[0] - alpha) / np.pi)


def any_name(right: dict[str, Any], got: dict[str, Any]) -> dict[str, Any]:
    """Accept a line under either name and in any turn."""
    alpha, r = got["alpha"], got["r"]
    if alpha is None or not np.isfinite(alpha):
        return got
    alpha, sign = other_name((float(alpha), 1.0), float(right["alpha"]))
    return {"alpha": np.array(alpha), "r": None if r is None else sign * r}


def parameters_tolerance(_theta: np.ndarray, rho: np.ndarray) -> tuple[float, float]:
    """Bound the error of the line."""
    return ANGLE, ANGLE * (1.0 + float(np.max(rho)))


def jacobians_tolerance(theta: np.ndarray, rho: np.ndarray, alpha: float, r: float) -> tuple[np.ndarray, ...]:
    """Bound the error of the derivatives by the largest of each row."""
    return tuple(
        SHARE * np.abs(J).max(axis=1, keepdims=True) * np.ones_like(J)
        for J in line_jacobians(theta, rho, alpha, r)
    )


def fit_tolerance(
    theta: np.ndarray, rho: np.ndarray, var_theta: float, var_rho: float
) -> tuple[float, float, np.ndarray]:
    """Bound the error of the line and, by its standard deviations, that of the covariance."""
    spread = np.sqrt(np.diag(fit_line(theta, rho, var_theta, var_rho)[2]))
    return *parameters_tolerance(theta, rho), SHARE * np.outer(spread, spread)


def wall(
    rng: Generator, alpha: float, *, scatter: float = 0.03, count: int = 0, r: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Draw the beams to a piece of wall at `alpha`, unevenly spaced and off the foot of its perpendicular."""
    count = count or int(rng.integers(9, 16))
    r = r or rng.uniform(0.8, 2.5)
    side = rng.choice([-1.0, 1.0])
    first = rng.uniform(0.3, 0.6)
    along = side * (first + np.sort(rng.uniform(0.0, 1.0, count)) + np.arange(count) * 1.0 / count)
    points = (r + scatter * rng.uniform(-1.0, 1.0, count) + 1j * along) * np.exp(1j * alpha)
    order = rng.permutation(count)
    return np.angle(points)[order], np.abs(points)[order]


def _angle(rng: Generator, low: float, high: float) -> float:
    """Draw an angle between two, of either sign."""
    return float(rng.uniform(low, high) * rng.choice([-1.0, 1.0]))


def _parameters(theta: np.ndarray, rho: np.ndarray) -> Case:
    args = (theta, rho)
    return PARAMETERS.case(*args)


@remembered
def ahead(rng: Generator) -> list[Case]:
    """Make walls that the scanner has before it: the scatter along y is the larger one."""
    return [_parameters(*wall(rng, sign * rng.uniform(0.2, 0.6))) for sign in (1, -1, 1, -1, 1)]


@remembered
def beside(rng: Generator) -> list[Case]:
    """Make walls to the sides and behind: the scatter along x is the larger one, or the normal points back."""
    spans = [(1.0, 1.4), (1.75, 2.15), (2.55, 2.9), (1.0, 1.4), (1.75, 2.15)]
    return [_parameters(*wall(rng, _angle(rng, *span))) for span in spans]


@remembered
def along_the_axes(rng: Generator) -> list[Case]:
    """Make walls exactly along the axes, without scatter."""
    return [_parameters(*wall(rng, quarter * np.pi / 2, scatter=0.0)) for quarter in (0, 1, 2, -1)]


@remembered
def through_the_scanner(rng: Generator) -> list[Case]:
    """Make walls on whose line the scanner stands, but for some centimetres."""
    spans = [(0.3, 0.6), (1.0, 1.3), (1.75, 2.15)]
    return [_parameters(*wall(rng, _angle(rng, *span), r=rng.uniform(0.002, 0.02))) for span in spans]


@remembered
def two_beams(rng: Generator) -> list[Case]:
    """Make pairs of beams."""
    return [_parameters(*wall(rng, _angle(rng, *span), count=2)) for span in ((0.3, 0.6), (1.0, 1.3))]


_HINT_ALPHA = "Draw the points and your normal: does it cross the wall at a right angle?"
_HINT_R = "Through which point does the best line go, whatever its direction?"
_HINT_AXES = "Print both arguments of your arctangent for a wall along x, and for one along y."
_HINT_FOOT = "Nothing is special about r = 0: the perpendicular is short, the direction is as clear as ever."
_HINT_TWO = "Two points are enough for a line."
_HINT_COPY = "Work on copies, or on new names."
_HINT_GLOBAL = "Use the arguments alone, nothing global."
_LINE = frozenset(LINE)

PARAMETERS = Stage(
    name="extraction.line_parameters",
    outputs=LINE,
    reference=line_parameters,
    tolerance=parameters_tolerance,
    aligned=any_name,
    checks=(
        Check("alpha, wall ahead", 4, each(ahead, "alpha"), _HINT_ALPHA),
        Check("r, wall ahead", 3, each(ahead, "r"), _HINT_R),
        Check("alpha, wall beside or behind", 4, each(beside, "alpha"), _HINT_ALPHA),
        Check("r, wall beside or behind", 3, each(beside, "r"), _HINT_R),
        Check("walls along the axes", 1, each(along_the_axes), _HINT_AXES),
        Check("scanner on the line", 1, each(through_the_scanner), _HINT_FOOT),
        Check("two beams", 1, each(two_beams), _HINT_TWO),
        Check("arguments untouched", 2, untouched(beside, _BEAMS, _LINE), _HINT_COPY),
        Check("same call, same result", 1, repeatable(ahead, _LINE), _HINT_GLOBAL),
    ),
)


def _jacobians(rng: Generator, *, scatter: float = 0.06, count: int = 0, back: bool = False) -> Case:
    """Make a wall with its line given; `back` gives the line under the name with r < 0."""
    theta, rho = wall(rng, _angle(rng, 0.3, 1.3), scatter=scatter, count=count)
    alpha, r = line_parameters(theta, rho)
    if back:
        alpha, r = alpha - np.sign(alpha) * np.pi, -r
    args = (theta, rho, alpha, r)
    return JACOBIANS.case(*args)


@remembered
def on_the_line(rng: Generator) -> list[Case]:
    """Make walls whose points are all on the line."""
    return [_jacobians(rng, scatter=0.0) for _ in range(5)]


@remembered
def scattered(rng: Generator) -> list[Case]:
    """Make walls whose points are on no line."""
    return [_jacobians(rng) for _ in range(5)]


@remembered
def other_names(rng: Generator) -> list[Case]:
    """Make walls whose line is given with r < 0."""
    return [_jacobians(rng, back=True) for _ in range(3)]


@remembered
def pairs(rng: Generator) -> list[Case]:
    """Make pairs of beams with their line."""
    return [_jacobians(rng, count=2) for _ in range(3)]


_HINT_RANGE = (
    "Move one point along its beam by 1 cm: how far does it go across the wall, and what is its lever?"
)
_HINT_BEARING = (
    "An error of a bearing moves a point at a right angle to its beam: what of that is across the wall?"
)
_HINT_EXACT = "No term is left out, not even one that is small where the points are nearly on the line."
_HINT_NAME = "The derivative is that of the line which is given, in the form in which it is given."
_BOTH = frozenset({"J_theta", "J_rho"})

JACOBIANS = Stage(
    name="extraction.line_jacobians",
    outputs=("J_theta", "J_rho"),
    reference=line_jacobians,
    tolerance=jacobians_tolerance,
    rows={"J_theta": LINE, "J_rho": LINE},
    checks=(
        Check("J_rho, points on the line", 5, each(on_the_line, "J_rho"), _HINT_RANGE),
        Check("J_theta, points on the line", 5, each(on_the_line, "J_theta"), _HINT_BEARING),
        Check("J_rho, points that scatter", 2, each(scattered, "J_rho"), _HINT_EXACT),
        Check("J_theta, points that scatter", 2, each(scattered, "J_theta"), _HINT_EXACT),
        Check("line given with r < 0", 2, each(other_names), _HINT_NAME),
        Check("two beams", 1, each(pairs), _HINT_TWO),
        Check("arguments untouched", 2, untouched(on_the_line, (*_BEAMS, "alpha", "r"), _BOTH), _HINT_COPY),
        Check("same call, same result", 1, repeatable(on_the_line, _BOTH), _HINT_GLOBAL),
    ),
)


def _fit(rng: Generator, alpha: float, *, count: int = 0) -> Case:
    var_theta, var_rho = rng.uniform(0.005, 0.01) ** 2, rng.uniform(0.02, 0.04) ** 2
    args = (*wall(rng, alpha, count=count), float(var_theta), float(var_rho))
    return FIT.case(*args)


@remembered
def in_front(rng: Generator) -> list[Case]:
    """Make walls of which the half angle is the normal already."""
    return [_fit(rng, sign * rng.uniform(0.2, 1.3)) for sign in (1, -1, 1, -1, 1)]


@remembered
def behind_left(rng: Generator) -> list[Case]:
    """Make walls behind to the left: the normal is half a turn on, and still in the turn."""
    return [_fit(rng, rng.uniform(1.8, 2.8)) for _ in range(5)]


@remembered
def behind_right(rng: Generator) -> list[Case]:
    """Make walls behind to the right: half a turn on, the angle has left the turn."""
    return [_fit(rng, -rng.uniform(1.8, 2.8)) for _ in range(5)]


@remembered
def fewest(rng: Generator) -> list[Case]:
    """Make pairs of beams, to be fitted with their covariance."""
    return [_fit(rng, sign * rng.uniform(0.2, 1.3), count=2) for sign in (1, -1, 1)]


_HINT_SIDE = "Which point of the line is nearest to the scanner? r is its distance, alpha its direction."
_HINT_C = "The errors of all beams are independent: what adds up, and with which variance each?"
_HINT_SAME = "C belongs to the alpha and r that are returned. By how much does the new r change with the old?"
_HINT_TURN = "Print alpha for a wall behind the scanner, to its right."
_ALL = frozenset({"alpha", "r", "C"})

FIT = Stage(
    name="extraction.fit_line",
    outputs=("alpha", "r", "C"),
    reference=fit_line,
    tolerance=fit_tolerance,
    rows={"C": LINE},
    columns={"C": LINE},
    checks=(
        Check("alpha and r, wall in front", 3, each(in_front, "alpha", "r"), _HINT_ALPHA),
        Check("C, wall in front", 4, each(in_front, "C"), _HINT_C),
        Check("alpha and r, wall behind", 3, each(behind_left, "alpha", "r"), _HINT_SIDE),
        Check("C, wall behind", 4, each(behind_left, "C"), _HINT_SAME),
        Check("alpha in one turn", 2, each(behind_right, "alpha"), _HINT_TURN),
        Check("two beams", 1, each(fewest), _HINT_TWO),
        Check(
            "arguments untouched", 2, untouched(in_front, (*_BEAMS, "var_theta", "var_rho"), _ALL), _HINT_COPY
        ),
        Check("same call, same result", 1, repeatable(in_front, _ALL), _HINT_GLOBAL),
    ),
)

STAGES = (PARAMETERS, JACOBIANS, FIT)
