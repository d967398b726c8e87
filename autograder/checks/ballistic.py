r"""Hidden checks of the notebook *tracking*: a bouncing ball is predicted through its impacts and corrected.

Every way that is right passes: a loop over impacts, a closed form, a root finder for the time of the impact, a
Jacobian written down or taken by central differences. So the mean may be off by what an impact time solved to about
1e-8 s does, and the covariance by the rounding of a difference; the wrong versions are off by a percent and more.

Inputs keep away from where the answer is a matter of convention or of the last digit: an impact at the very end of a
step, a ball about to come to rest. Gravity and restitution are other ones in every call. Of a ball below the ground the
mean alone is looked at, since the derivative by a height that counts as 0 can be read in two ways.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.kinds import each, repeatable, untouched
from roboloc_reference.ballistic import correct, predict

if TYPE_CHECKING:
    from numpy.random import Generator

STATE = ("px", "py", "vx", "vy")
_SOLVED, _DIFFERENCED, _ROUNDED = 1e-7, 1e-6, 1e-10
_BOTH = frozenset({"x", "Sigma"})


def _covariance(rng: Generator, n: int, scale: float) -> np.ndarray:
    """Draw a covariance whose standard deviations differ, and whose numbers are all correlated."""
    while True:
        A = rng.normal(size=(n, n)) + np.eye(n)
        Sigma = A @ A.T
        d = np.sqrt(np.diag(Sigma))
        correlation = Sigma / np.outer(d, d)
        weak = np.abs(correlation[~np.eye(n, dtype=bool)]).min()
        if weak > 0.15 and np.linalg.cond(correlation) < 100:
            sizes = scale * rng.uniform(0.6, 1.5, n)
            return correlation * np.outer(sizes, sizes)


def predict_tolerance(*args: object) -> tuple[np.ndarray, np.ndarray]:
    """Bound the error of x and Sigma that a solved impact time and a difference may cause."""
    x, Sigma = predict(*args)
    size = np.sqrt(np.diag(Sigma))
    return _SOLVED * (1 + np.abs(x)), _DIFFERENCED * np.outer(size, size)


def _fall(x: np.ndarray, g: float) -> tuple[float, float]:
    """Return time and speed of the first impact."""
    s = float(np.sqrt(x[3] ** 2 + 2 * g * max(x[1], 0.0)))
    return (x[3] + s) / g, s


def _predict_case(rng: Generator, x: np.ndarray, dt: float, g: float, e: float) -> Case:
    args = (x, _covariance(rng, 4, 0.2), float(dt), float(g), float(e), _covariance(rng, 4, 0.05))
    return PREDICT.case(*args)


def _thrown(rng: Generator) -> tuple[np.ndarray, float]:
    """Draw a ball in the air, and gravity on some planet."""
    signs = rng.choice([-1, 1], 3)
    sideways, upwards = signs[1:] * rng.uniform(0.5, 2.0, 2)
    x = np.array([signs[0] * rng.uniform(0.5, 2), rng.uniform(1, 3), sideways, upwards])
    return x, rng.uniform(6, 15)


def _bouncing(rng: Generator, impacts: int, e: float, slow: int = 0) -> Case:
    """Make a step with a number of impacts, that ends well inside a flight; a `slow` one is on the moon."""
    x, g = _thrown(rng)
    if slow:  # below 1 m/s all the way
        x[1], x[3], g = rng.uniform(0.05, 0.1), slow * rng.uniform(0.3, 0.5), rng.uniform(1.4, 1.8)
    first, s = _fall(x, g)
    part = rng.uniform(0.2, 0.8)
    flights = 2 * s / g * e ** np.arange(1, impacts + 1)
    dt = part * first if impacts == 0 else first + flights[:-1].sum() + part * flights[-1]
    return _predict_case(rng, x, dt, g, e)


@remembered
def in_the_air(rng: Generator) -> list[Case]:
    """Make steps without an impact."""
    return [_bouncing(rng, 0, rng.uniform(0.5, 0.9)) for _ in range(4)]


@remembered
def one_impact(rng: Generator) -> list[Case]:
    """Make steps with one impact, two of them of a ball that is slow, on its way down and up."""
    slow = [_bouncing(rng, 1, rng.uniform(0.25, 0.45), slow=sign) for sign in (-1, 1)]
    return [*(_bouncing(rng, 1, rng.uniform(0.5, 0.9)) for _ in range(5)), *slow]


@remembered
def several_impacts(rng: Generator) -> list[Case]:
    """Make steps with two, three and five impacts."""
    return [_bouncing(rng, count, rng.uniform(0.6, 0.9)) for count in (2, 3, 5, 2)]


@remembered
def elastic(rng: Generator) -> list[Case]:
    """Make steps of a ball that loses nothing."""
    return [_bouncing(rng, count, 1.0) for count in (1, 2, 4)]


@remembered
def at_rest(rng: Generator) -> list[Case]:
    """Make steps that end on the ground: after many impacts, after one that it sticks at, from the start."""
    cases = []
    for e in (rng.uniform(0.2, 0.6), 0.0, rng.uniform(0.2, 0.6)):
        x, g = _thrown(rng)
        first, s = _fall(x, g)
        cases.append(_predict_case(rng, x, rng.uniform(1.2, 2) * (first + 2 * s / g * e / (1 - e)), g, e))
    x, g = _thrown(rng)
    x[1] = x[3] = 0.0
    return [*cases, _predict_case(rng, x, rng.uniform(0.2, 1), g, rng.uniform(0.3, 0.8))]


@remembered
def below_the_ground(rng: Generator) -> list[Case]:
    """Make steps from a height that a correction left a little below the ground."""
    cases = []
    for sign in (-1, 1, -1, 1):
        x, g = _thrown(rng)
        x[1], x[3] = -rng.uniform(0.03, 0.08), sign * rng.uniform(2.5, 4)
        e = rng.uniform(0.5, 0.9)
        s = abs(x[3])
        dt = rng.uniform(0.3, 0.8) * 2 * s / g * (e if sign < 0 else 1)
        cases.append(_predict_case(rng, x, dt, g, e))
    return cases


@remembered
def any_step(rng: Generator) -> list[Case]:
    """Make a step of each kind."""
    return [_bouncing(rng, count, rng.uniform(0.6, 0.9)) for count in (0, 1, 0, 2)]


_HINT_FLIGHT = "In the air nothing acts but gravity. The notebook has the flight and its Jacobian F(t)."
_HINT_NOISE = "Carry Sigma through F on both sides, and let Q come on top."
_HINT_IMPACT = (
    "Solve for the time at which the height is 0; fly so long, reverse vy, fly for what is left of dt."
)
_HINT_SALTATION = "Flight, impact, flight: three matrices. What does the middle one do to an error of height?"
_HINT_AGAIN = "What is left of the step after an impact may hold another one."
_HINT_COPY = "x += ... and x[1] = ... write into the caller's array; work on new ones."
_HINT_GLOBAL = (
    "Use the arguments alone, nothing global: gravity and restitution are other ones in every call."
)
_ARGUMENTS = ("x", "Sigma", "dt", "gravity", "restitution", "Q")

PREDICT = Stage(
    name="ballistic.predict",
    outputs=("x", "Sigma"),
    reference=predict,
    tolerance=predict_tolerance,
    rows={"x": STATE, "Sigma": STATE},
    columns={"Sigma": STATE},
    checks=(
        Check("x, in the air", 2, each(in_the_air, "x"), _HINT_FLIGHT),
        Check("Sigma, in the air", 2, each(in_the_air, "Sigma"), _HINT_NOISE),
        Check("x, one impact", 3, each(one_impact, "x"), _HINT_IMPACT),
        Check("Sigma, one impact", 4, each(one_impact, "Sigma"), _HINT_SALTATION),
        Check("x, several impacts in one step", 2, each(several_impacts, "x"), _HINT_AGAIN),
        Check("Sigma, several impacts in one step", 2, each(several_impacts, "Sigma"), _HINT_AGAIN),
        Check("a ball that loses nothing", 1, each(elastic), "With restitution 1 there is no rest."),
        Check("a ball that comes to rest", 1, each(at_rest), "Infinitely many impacts take a finite time."),
        Check(
            "a ball below the ground", 1, each(below_the_ground, "x"), "A py below the ground counts as 0."
        ),
        Check("arguments untouched", 1, untouched(any_step, _ARGUMENTS, _BOTH), _HINT_COPY),
        Check("same call, same result", 1, repeatable(any_step, _BOTH), _HINT_GLOBAL),
    ),
)


def correct_tolerance(
    x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, R: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Bound the error of x and Sigma that rounding may cause, in the units of each entry."""
    size = np.sqrt(np.diag(Sigma))
    surprise = 1 + np.abs(z - x[:2]).max() / np.sqrt(np.diag(R)).min()
    return _ROUNDED * (np.abs(x) + surprise * size), _ROUNDED * np.outer(size, size)


def _correct_case(rng: Generator, Sigma: np.ndarray, R: np.ndarray, height: float | None = None) -> Case:
    """Make a correction by a position that is off by about what both sides admit."""
    x, _ = _thrown(rng)
    off = rng.uniform(0.5, 1.5, 2) * rng.choice([-1, 1], 2) * np.sqrt(np.diag(Sigma)[:2] + np.diag(R))
    if height is not None:
        x[1], off[1] = height, -abs(off[1])
    args = (x, Sigma, x[:2] + off, R)
    return CORRECT.case(*args)


def _apart(rng: Generator) -> np.ndarray:
    """Draw a covariance in which only height and its velocity, and place and its velocity, are correlated."""
    Sigma = _covariance(rng, 4, 0.2)
    Sigma[::2, 1::2] = Sigma[1::2, ::2] = 0.0
    return Sigma


@remembered
def apart(rng: Generator) -> list[Case]:
    """Make corrections in which the two directions have nothing to do with one another."""
    return [_correct_case(rng, _apart(rng), np.diag(rng.uniform(0.1, 0.3, 2) ** 2)) for _ in range(4)]


@remembered
def correlated(rng: Generator) -> list[Case]:
    """Make corrections in which everything is correlated, the errors of the camera too."""
    return [_correct_case(rng, _covariance(rng, 4, 0.2), _covariance(rng, 2, 0.2)) for _ in range(5)]


@remembered
def near_the_ground(rng: Generator) -> list[Case]:
    """Make corrections whose right result lies below the ground."""
    cases: list[Case] = []
    while len(cases) < 4:
        case = _correct_case(rng, _apart(rng), np.diag(rng.uniform(0.1, 0.2, 2) ** 2), rng.uniform(0, 0.05))
        if case.expected[0][1] < -0.02:
            cases.append(case)
    return cases


_HINT_MEAN = "How far is the ball seen from where it was expected? The gain says how far each number follows."
_HINT_COVARIANCE = "S is the covariance of what the camera sees: of the ball, and of the camera."

CORRECT = Stage(
    name="ballistic.correct",
    outputs=("x", "Sigma"),
    reference=correct,
    tolerance=correct_tolerance,
    rows={"x": STATE, "Sigma": STATE},
    columns={"Sigma": STATE},
    checks=(
        Check("x, the directions apart", 3, each(apart, "x"), _HINT_MEAN),
        Check("Sigma, the directions apart", 3, each(apart, "Sigma"), _HINT_COVARIANCE),
        Check("x, everything correlated", 4, each(correlated, "x"), _HINT_MEAN),
        Check("Sigma, everything correlated", 4, each(correlated, "Sigma"), _HINT_COVARIANCE),
        Check(
            "a ball seen below the ground",
            3,
            each(near_the_ground, "x"),
            "The camera errs to both sides. What becomes of the mean of an estimate that may err to one side only?",
        ),
        Check("arguments untouched", 2, untouched(correlated, ("x", "Sigma", "z", "R"), _BOTH), _HINT_COPY),
        Check(
            "same call, same result",
            1,
            repeatable(correlated, _BOTH),
            "Use the arguments alone, nothing global.",
        ),
    ),
)

STAGES = (PREDICT, CORRECT)
