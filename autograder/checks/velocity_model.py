r"""Hidden checks of the velocity model in the notebook *ekf-and-ukf*: motion, its Jacobians, noise, and a landmark.

Every way that is right passes. The arc is that of the notebook *motion-model*, so the allowed errors come from there:
the closed form that divides by omega is right above the handout's threshold, and its limits are right below. The other
stages are sums and quotients of a few numbers, whose rounding is far below 1e-10 of their size.

Inputs keep away from where a wrong answer is the right one by chance: every control has a gamma of its own, every pose
a heading with a sine and a cosine of some size, every landmark two differences that are unlike.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.circle import nearest_turn
from autograder.checks.kinds import each, repeatable, untouched
from autograder.checks.motion_model import dynamics_tolerance, heading
from roboloc.angles import wrap
from roboloc_reference import velocity

if TYPE_CHECKING:
    from numpy.random import Generator

POSE, CONTROL, SEEN = ("x", "y", "theta"), ("v", "omega", "gamma"), ("bearing", "range")
_SHARE = 1e-10
_SLOW = (1e-12, 1e-9, 1e-7, 1e-5, 4e-4)


def aligned_bearing(right: dict[str, Any], got: dict[str, Any]) -> dict[str, Any]:
    """Accept a bearing at the cut on either side of it: half a turn to the left is half a turn to the right."""
    z = got["z"]
    if z is not None and abs(right["z"][0]) > math.pi - 1e-6 and abs(z[0]) <= math.pi + 1e-9:
        z = z.copy()
        z[0] = nearest_turn(z[0], right["z"][0])
    return got | {"z": z}


def motion_tolerance(x: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
    """Bound the error of the pose that a correct way of computing it may have."""
    return dynamics_tolerance(x, u[:2], dt)[0] + 1e-14 * (1 + abs(u[2]) * dt)


def jacobians_tolerance(x: np.ndarray, u: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Bound the errors of F and W."""
    _, Gx, Gu = dynamics_tolerance(x, u[:2], dt)
    return Gx, np.column_stack([Gu, np.full(3, 1e-14 * (1 + dt))])


def noise_tolerance(u: np.ndarray, alphas: np.ndarray) -> np.ndarray:
    """Bound the error of M by its largest entry."""
    return np.full((3, 3), _SHARE * velocity.noise(u, alphas).max() + 1e-300)


def sighting_tolerance(x: np.ndarray, landmark: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bound the errors of z and H."""
    near = 1 / float(np.hypot(*(landmark - x[:2])))
    return _SHARE * (1 + np.abs(velocity.range_bearing(x, landmark)[0])), np.full((2, 3), _SHARE * (1 + near))


def _controls(rng: Generator, omegas: np.ndarray, turns: int = 0) -> list[tuple]:
    """Draw one pose, control and duration for each omega: both directions, a gamma of its own each."""
    found = []
    for i, omega in enumerate(omegas):
        dt = rng.uniform(0.3, 0.8) if i % 2 else rng.uniform(1.2, 1.8)
        v = rng.uniform(0.5, 1.5) * (-1) ** (i // 2)
        gamma = rng.uniform(0.2, 0.5) * rng.choice([-1, 1])
        theta = heading(rng, (omega + gamma) * dt, turns)
        found.append((np.array([*rng.uniform(-3, 3, 2), theta]), np.array([v, omega, gamma]), float(dt)))
    return found


def _arcs(rng: Generator) -> list[tuple]:
    return _controls(rng, rng.uniform(0.3, 1.0, 6) * np.array([1, -1, 1, -1, 1, -1]))


def _slow(rng: Generator) -> list[tuple]:
    return _controls(rng, np.array([sign * w * rng.uniform(0.6, 2) for w in _SLOW for sign in (1, -1)]))


@remembered
def arcs(rng: Generator) -> list[Case]:
    """Make arcs to both sides, forwards and backwards."""
    return [MOTION.case(*args) for args in _arcs(rng)]


@remembered
def straight(rng: Generator) -> list[Case]:
    """Make straight drives with a turn at their end."""
    return [MOTION.case(*args) for args in _controls(rng, np.zeros(4))]


@remembered
def slow(rng: Generator) -> list[Case]:
    """Make turns too slow for the closed form."""
    return [MOTION.case(*args) for args in _slow(rng)]


@remembered
def many_turns(rng: Generator) -> list[Case]:
    """Make drives of a robot that has turned around several times; only the heading counts."""
    cases = [MOTION.case(*args) for args in _controls(rng, np.array([0.6, -0.7, 0.8, -0.5]), turns=5)]
    anywhere = np.array([np.inf, np.inf, 0.0])
    return [case._replace(tolerance=(case.tolerance[0] + anywhere,)) for case in cases]


@remembered
def jacobian_arcs(rng: Generator) -> list[Case]:
    """Make arcs to be differentiated."""
    return [JACOBIANS.case(*args) for args in _arcs(rng)]


@remembered
def jacobian_straight(rng: Generator) -> list[Case]:
    """Make straight drives to be differentiated."""
    return [JACOBIANS.case(*args) for args in _controls(rng, np.zeros(4))]


@remembered
def jacobian_slow(rng: Generator) -> list[Case]:
    """Make slow turns to be differentiated."""
    return [JACOBIANS.case(*args) for args in _slow(rng)]


def _noises(rng: Generator, *which: bool) -> list[Case]:
    """Make controls of which only some numbers are not 0, each with six alphas of their own."""
    cases = []
    for _ in range(4):
        u = rng.uniform(0.4, 2.5, 3) * rng.choice([-1, 1], 3) * which
        cases.append(
            NOISE.case(u, rng.permutation([0.01, 0.02, 0.05, 0.1, 0.2, 0.4]) * rng.uniform(0.8, 1.2))
        )
    return cases


@remembered
def driving(rng: Generator) -> list[Case]:
    """Make controls that drive and do not turn."""
    return _noises(rng, True, False, False)


@remembered
def turning(rng: Generator) -> list[Case]:
    """Make controls that turn and do not drive."""
    return _noises(rng, False, True, False)


@remembered
def both(rng: Generator) -> list[Case]:
    """Make controls that do all three."""
    return _noises(rng, True, True, True)


def _sights(rng: Generator, bearings: tuple[float, ...], *, shift: float = 0.0) -> list[Case]:
    """Make landmarks seen under some bearings, in directions of which no sine or cosine is small."""
    cases = []
    for bearing in bearings:
        direction, r = heading(rng), rng.uniform(1.5, 4.0)
        x = np.array([*rng.uniform(-3, 3, 2), wrap(direction - bearing) + shift])
        cases.append(SIGHTING.case(x, x[:2] + r * np.array([np.cos(direction), np.sin(direction)])))
    return cases


@remembered
def ahead(rng: Generator) -> list[Case]:
    """Make landmarks before the robot, whose bearing needs no wrap."""
    cases: list[Case] = []
    while len(cases) < 12:
        (case,) = _sights(rng, (rng.uniform(0.2, 1.0) * rng.choice([-1, 1]),))
        x, landmark = case.args
        direction = math.atan2(*(landmark - x[:2])[::-1])
        if abs(direction - x[2]) < 2 and abs(x[2]) > 0.3:
            cases.append(case)
    return cases


@remembered
def around(rng: Generator) -> list[Case]:
    """Make landmarks whose direction less the heading is outside the turn."""
    cases: list[Case] = []
    while len(cases) < 12:
        (case,) = _sights(rng, (rng.uniform(0.5, 2.8) * rng.choice([-1, 1]),))
        x, landmark = case.args
        if abs(math.atan2(*(landmark - x[:2])[::-1]) - x[2]) > 3.5:
            cases.append(case)
    return cases


@remembered
def turned(rng: Generator) -> list[Case]:
    """Make landmarks seen by a robot that has turned around several times."""
    return [case for turns in (2, -3, 4) for case in _sights(rng, (0.7, -1.9), shift=2 * math.pi * turns)]


_HINT_ARC = (
    "First the whole arc of v and omega, then the turn on the spot. Which of the three does gamma change?"
)
_HINT_LIMIT = (
    "omega = 0 is allowed. Each entry has a limit there; take it from the derivation, entry by entry."
)
_HINT_SLOW = "Near omega = 0 the closed form subtracts nearly equal numbers and divides by a tiny one."
_HINT_F = (
    "Differentiate the pose at the end by the pose at the start: rows are what changes, columns by what."
)
_HINT_W = "Differentiate by v, omega and gamma, each wherever it stands: omega stands in two places."
_HINT_M = "M is a covariance: what unit have its entries? Put in a control that only drives, then one that only turns."
_HINT_Z = "Where is the landmark, seen from the robot? Bearing first, in [-pi, pi), then range."
_HINT_H = "Each entry has a unit: rad per m in the first row. Move the robot by 1 cm and look at z."
_HINT_COPY = "Work on copies, or on new names."
_HINT_GLOBAL = "Use the arguments alone, nothing global."
_MOVE = ("x", "u", "dt")

MOTION = Stage(
    name="velocity.motion",
    outputs=("moved",),
    reference=velocity.motion,
    tolerance=motion_tolerance,
    rows={"moved": POSE},
    checks=(
        Check("arcs with a turn at the end", 4, each(arcs), _HINT_ARC),
        Check("straight drives", 2, each(straight), _HINT_LIMIT),
        Check("omega nearly 0", 1, each(slow), _HINT_SLOW),
        Check(
            "a robot that has turned around", 1, each(many_turns), "The heading of a motion is not wrapped."
        ),
        Check("arguments untouched", 1, untouched(arcs, _MOVE, frozenset({"moved"})), _HINT_COPY),
        Check("same call, same result", 1, repeatable(arcs, frozenset({"moved"})), _HINT_GLOBAL),
    ),
)
JACOBIANS = Stage(
    name="velocity.jacobians",
    outputs=("F", "W"),
    reference=velocity.jacobians,
    tolerance=jacobians_tolerance,
    rows={"F": POSE, "W": POSE},
    columns={"F": POSE, "W": CONTROL},
    checks=(
        Check("F, arcs", 3, each(jacobian_arcs, "F"), _HINT_F),
        Check("W, arcs", 6, each(jacobian_arcs, "W"), _HINT_W),
        Check("F, straight drives", 2, each(jacobian_straight, "F"), _HINT_LIMIT),
        Check("W, straight drives", 4, each(jacobian_straight, "W"), _HINT_LIMIT),
        Check("omega nearly 0", 3, each(jacobian_slow), _HINT_SLOW),
        Check("arguments untouched", 1, untouched(jacobian_arcs, _MOVE, frozenset("FW")), _HINT_COPY),
        Check("same call, same result", 1, repeatable(jacobian_arcs, frozenset("FW")), _HINT_GLOBAL),
    ),
)
NOISE = Stage(
    name="velocity.noise",
    outputs=("M",),
    reference=velocity.noise,
    tolerance=noise_tolerance,
    rows={"M": CONTROL},
    columns={"M": CONTROL},
    checks=(
        Check("a robot that drives", 3, each(driving), _HINT_M),
        Check("a robot that turns", 3, each(turning), _HINT_M),
        Check("a robot that does both", 2, each(both), "gamma adds noise to nothing; it only has some."),
        Check("arguments untouched", 1, untouched(both, ("u", "alphas"), frozenset("M")), _HINT_COPY),
        Check("same call, same result", 1, repeatable(both, frozenset("M")), _HINT_GLOBAL),
    ),
)
SIGHTING = Stage(
    name="velocity.range_bearing",
    outputs=("z", "H"),
    reference=velocity.range_bearing,
    tolerance=sighting_tolerance,
    rows={"z": SEEN, "H": SEEN},
    columns={"H": POSE},
    aligned=aligned_bearing,
    checks=(
        Check("z, landmark before the robot", 4, each(ahead, "z"), _HINT_Z),
        Check("H", 8, each(ahead, "H"), _HINT_H),
        Check("z, direction less heading beyond the turn", 3, each(around, "z"), _HINT_Z),
        Check("a robot that has turned around", 3, each(turned), _HINT_Z),
        Check("arguments untouched", 1, untouched(ahead, ("x", "landmark"), frozenset("zH")), _HINT_COPY),
        Check("same call, same result", 1, repeatable(ahead, frozenset("zH")), _HINT_GLOBAL),
    ),
)
STAGES = (MOTION, JACOBIANS, NOISE, SIGHTING)
