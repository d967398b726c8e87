r"""Hidden checks of the notebook *motion-model*: the motion, its Jacobians, and the prediction step.

Every way that is right passes, so the allowed error of each entry comes from the mathematics.

* *Rounding.* With :math:`|\omega| > 10^{-3}` the closed form that divides by omega is a correct answer. Its
  sines are off by eps times the size of their argument, and it divides their difference by omega, the
  derivative by omega by omega squared.
* *Truncation.* Up to :math:`|\omega| = 10^{-3}` the handout allows the limits instead. From
  :math:`|\cos(\theta + \omega\tau) - \cos\theta| \le |\omega| \tau`, integrated over the step, the position
  and its derivative by the heading are then off by at most :math:`|V \omega| \Delta t^2 / 2`, the derivative
  by V by :math:`|\omega| \Delta t^2 / 2` and the one by omega by :math:`|V \omega| \Delta t^3 / 3`. The
  heading and the constant entries have no such excuse.

Inputs keep away from what no formula settles: |omega| next to the threshold, headings where a sine vanishes
and a wrong entry would be 0 like the right one. The prediction step is fed a motion made here, never the
student's own.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.kinds import each, repeatable, untouched
from roboloc_reference.gaussian import transition_update
from roboloc_reference.motion import EPSILON_OMEGA, compute_dynamics

if TYPE_CHECKING:
    from numpy.random import Generator

_ROUNDING = 200 * np.finfo(float).eps
POSE, _CONTROL = ("x", "y", "theta"), ("V", "omega")
_SLOW = (1e-12, 1e-9, 1e-7, 1e-5, 4e-4)


def dynamics_tolerance(
    xvec: np.ndarray, u: np.ndarray, dt: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bound the error of g, Gx and Gu that a correct way of computing them may have, entry by entry."""
    x, y, theta = np.abs(xvec).tolist()
    V, omega = np.abs(u).tolist()
    eps = _ROUNDING * (1 + theta + omega * dt)
    if omega > EPSILON_OMEGA:
        by_V = eps * (1 / omega + dt)
        by_omega = eps * V * (1 / omega**2 + dt / omega + dt**2)
    else:
        by_V = eps * dt + omega * dt**2 / 2
        by_omega = eps * V * dt**2 + V * omega * dt**3 / 3
    move = V * by_V
    g = np.array([move + eps * x, move + eps * y, eps * (theta + omega * dt)])
    Gx = np.full((3, 3), eps)
    Gx[:2, 2] = move
    Gu = np.array([[by_V, by_omega], [by_V, by_omega], [eps, eps * dt]])
    return g, Gx, Gu


def _dynamics_case(xvec: Any, u: Any, dt: float) -> Case:
    args = (np.array(xvec, dtype=float), np.array(u, dtype=float), float(dt))
    return DYNAMICS.case(*args)


def heading(rng: Generator, turn: float = 0.0, turns: int = 0) -> float:
    """Draw a heading whose sine and cosine are both between 0.29 and 0.96 in size.

    After a further `turn` [rad] it is within (-pi, pi) without `turns`, and outside with them.
    """
    while True:
        theta = float(rng.integers(-2 - 4 * turns, 2 + 4 * turns) * math.pi / 2 + rng.uniform(0.3, 1.27))
        if (abs(theta + turn) > 3.3) if turns else (abs(theta + turn) < 3.0):
            return theta


def _signs(rng: Generator, count: int) -> np.ndarray:
    """Draw signs, of which at least one is + and one is -."""
    signs = np.resize([1.0, -1.0], count)
    return rng.permutation(signs)


def _motions(rng: Generator, omegas: np.ndarray, turns: int = 0) -> list[Case]:
    """Make one case for each omega, at unlike places and durations, driving forwards and backwards."""
    count = len(omegas)
    xy = rng.uniform(-3, 3, (count, 2))
    V = rng.uniform(0.4, 1.5, count) * _signs(rng, count)
    dt = rng.permutation(np.geomspace(0.05, 2.0, count)) * rng.uniform(0.9, 1.1, count)
    return [
        _dynamics_case([*xy[i], heading(rng, omegas[i] * dt[i], turns)], [V[i], omegas[i]], dt[i])
        for i in range(count)
    ]


@remembered
def turning(rng: Generator) -> list[Case]:
    """Make arcs to both sides, forwards and backwards, short and long, apart from near-zero omega; two turn far."""
    arcs = _motions(rng, rng.uniform(0.2, 1.5, 6) * np.array([1, 1, 1, -1, -1, -1]))
    for turn in (rng.uniform(1.6, 2.6), -rng.uniform(0.8, 0.95)):
        dt = rng.uniform(1.4, 1.8)
        arcs.append(_dynamics_case([1.0, -2.0, heading(rng, turn)], [rng.uniform(0.4, 1.5), turn / dt], dt))
    return arcs


@remembered
def straight(rng: Generator) -> list[Case]:
    """Make straight drives: omega exactly 0."""
    return _motions(rng, np.zeros(4))


@remembered
def slow(rng: Generator) -> list[Case]:
    """Make turns too slow for the closed form, to both sides, from 1e-12 to below the handout's threshold."""
    sizes = np.concatenate([_SLOW, _SLOW]) * rng.uniform(0.6, 2.0, 2 * len(_SLOW))
    return _motions(rng, sizes * np.repeat([1.0, -1.0], len(_SLOW)))


@remembered
def many_turns(rng: Generator) -> list[Case]:
    """Make motions of a robot that has turned around several times; only the heading counts."""
    cases = _motions(rng, rng.uniform(0.5, 1.5, 4) * _signs(rng, 4), turns=5)
    anywhere = np.array([np.inf, np.inf, 0.0])
    return [case._replace(tolerance=(case.tolerance[0] + anywhere, *case.tolerance[1:])) for case in cases]


@remembered
def mixed(rng: Generator) -> list[Case]:
    """Make one arc, one straight drive and one slow turn."""
    return _motions(rng, np.array([rng.uniform(0.3, 1.2), 0.0, -rng.uniform(1e-6, 5e-4)]))


_HINT_ARC = (
    "With V and omega held constant the robot drives along an arc; integrate the rates over the whole step."
)
_HINT_LIMIT = (
    "omega = 0 is allowed. Each entry has a limit there; take it from the derivation, entry by entry."
)
_HINT_SLOW = (
    "Near omega = 0 the closed form subtracts nearly equal numbers and divides by a tiny one. "
    "Where must the limits take over, and what still depends on omega there?"
)
_HINT_JACOBIAN = "Differentiate the g that you return, with respect to the arguments that went in."
_ARGUMENTS = ("xvec", "u", "dt")
_ANY = frozenset({"g", "Gx", "Gu"})

DYNAMICS = Stage(
    name="motion.compute_dynamics",
    outputs=("g", "Gx", "Gu"),
    reference=compute_dynamics,
    tolerance=dynamics_tolerance,
    rows={"g": POSE, "Gx": POSE, "Gu": POSE},
    columns={"Gx": POSE, "Gu": _CONTROL},
    checks=(
        Check("g on an arc", 3, each(turning, "g"), _HINT_ARC),
        Check("g on a straight line", 1, each(straight, "g"), _HINT_LIMIT),
        Check("g in a very slow turn", 2, each(slow, "g"), _HINT_SLOW),
        Check("heading after many turns", 1, each(many_turns, "g"), "The motion never wraps the heading."),
        Check("Gx on an arc", 2, each(turning, "Gx"), _HINT_JACOBIAN),
        Check("Gx on a straight line", 1, each(straight, "Gx"), _HINT_LIMIT),
        Check("Gx in a very slow turn", 1, each(slow, "Gx"), _HINT_SLOW),
        Check("Gu on an arc", 3, each(turning, "Gu"), _HINT_JACOBIAN),
        Check("Gu on a straight line", 1, each(straight, "Gu"), _HINT_LIMIT),
        Check("Gu in a very slow turn", 2, each(slow, "Gu"), _HINT_SLOW),
        Check(
            "arguments untouched", 2, untouched(mixed, _ARGUMENTS, _ANY), "Work on copies, or on new names."
        ),
        Check(
            "same call, same result",
            1,
            repeatable(mixed, _ANY),
            "Use the arguments alone, nothing global.",
        ),
    ),
)


def transition_tolerance(
    g: np.ndarray, Gx: np.ndarray, Gu: np.ndarray, Sigma: np.ndarray, R: np.ndarray, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Bound the error of x and Sigma that rounding may cause, whatever the order of the products."""
    size = np.sqrt(
        np.diag(np.abs(Gx) @ np.abs(Sigma) @ np.abs(Gx).T + dt * np.abs(Gu) @ np.abs(R) @ np.abs(Gu).T)
    )
    return _ROUNDING * np.abs(g), _ROUNDING * len(g) * np.outer(size, size)


def _covariance(rng: Generator, n: int) -> np.ndarray:
    """Draw a covariance without a special structure: correlated, unequal variances, exactly symmetric."""
    A = rng.normal(size=(n, n)) + np.diag(rng.uniform(0.5, 2.0, n))
    half = A @ A.T
    return (half + half.T) / 2


def _transition_case(rng: Generator, n: int, *, prior: bool = True, noise: bool = True) -> Case:
    """Make a prediction step: a motion with a dense Jacobian, a duration that is not 1."""
    g = rng.uniform(-3, 3, n)
    Gx = np.eye(n) + rng.uniform(0.2, 0.9, (n, n)) * rng.choice([-1, 1], (n, n))
    Gu = rng.uniform(0.2, 1.5, (n, 2)) * rng.choice([-1, 1], (n, 2))
    Sigma = _covariance(rng, n) * prior
    R = _covariance(rng, 2) * noise
    dt = float(rng.choice([rng.uniform(0.05, 0.4), rng.uniform(1.8, 3.0)]))
    args = (g, Gx, Gu, Sigma, R, dt)
    return TRANSITION.case(*args)


def _robot_case(rng: Generator) -> Case:
    """Make a prediction step of a real motion: what compute_dynamics gives for an arc."""
    arc = _motions(rng, rng.uniform(0.4, 1.2, 2))[0]
    args = (*(part.copy() for part in arc.expected), _covariance(rng, 3), _covariance(rng, 2), arc.args[2])
    return TRANSITION.case(*args)


@remembered
def prior_alone(rng: Generator) -> list[Case]:
    """Make steps without control noise."""
    return [_transition_case(rng, 3, noise=False) for _ in range(3)]


@remembered
def noise_alone(rng: Generator) -> list[Case]:
    """Make steps from a state known exactly."""
    return [_transition_case(rng, 3, prior=False) for _ in range(3)]


@remembered
def both(rng: Generator) -> list[Case]:
    """Make whole steps of a pose: two of a real motion, two of a dense one."""
    return [*(_robot_case(rng) for _ in range(2)), *(_transition_case(rng, 3) for _ in range(2))]


@remembered
def larger(rng: Generator) -> list[Case]:
    """Make steps of states with 2, 4 and 9 numbers: the stage serves filters with a map in the state too."""
    return [_transition_case(rng, n) for n in (2, 4, 9)]


_HINT_PRIOR = "How does the covariance of a vector change when a matrix is applied to the vector?"
_HINT_NOISE = (
    "Control noise of covariance R enters through Gu; how much of it depends on the length of the step."
)
_SIGMA = frozenset({"Sigma"})

TRANSITION = Stage(
    name="gaussian.transition_update",
    outputs=("x", "Sigma"),
    reference=transition_update,
    tolerance=transition_tolerance,
    checks=(
        Check("mean", 1, each(both, "x"), "Which argument already is the predicted mean?"),
        Check("covariance without control noise", 3, each(prior_alone, "Sigma"), _HINT_PRIOR),
        Check("covariance from an exactly known state", 3, each(noise_alone, "Sigma"), _HINT_NOISE),
        Check("whole step of a pose", 1, each(both, "Sigma"), f"{_HINT_PRIOR} {_HINT_NOISE}"),
        Check(
            "states of another size",
            1,
            each(larger),
            "Nothing in this step knows that a pose has 3 numbers.",
        ),
        Check(
            "arguments untouched",
            0.5,
            untouched(both, ("g", "Gx", "Gu", "Sigma", "R", "dt"), _SIGMA),
            "Sigma += ... writes into the caller's array; Sigma = Sigma + ... does not.",
        ),
        Check(
            "same call, same result",
            0.5,
            repeatable(both, _SIGMA),
            "Use the arguments alone, nothing global.",
        ),
    ),
)

STAGES = (DYNAMICS, TRANSITION)
