r"""Hidden checks of the notebook *monte-carlo-localization*: the motion of a cloud, what it predicts, and its weights.

Every way that is right passes, with loops or without: loops are a matter of extra credit alone. Clouds here have few
particles, mostly not as many as there are lines or coordinates, so that no axis passes for another.

* *Rounding.* The motion is allowed what that of one robot is, a predicted line what that of one robot is. Innovations
  are differences, weights exponentials of forms of at most a few thousand: 1e-9 is above the rounding of both.
* *Choices.* The nearest line is a choice, and has no tolerance: every scene is drawn until the nearest line of each
  observation is nearer than the next, for each particle, by far more than rounding.
* *Weights.* Where no particle is possible the result is 1/M for each. That a warning is to be given, only the public
  check sees: what a call writes to the screen never leaves the sandbox.
"""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks import cloud_inputs
from autograder.checks.association_inputs import covariance
from autograder.checks.kinds import each, repeatable, untouched
from autograder.checks.line_inputs import mounting, one_turn, transform_tolerance
from autograder.checks.motion_model import dynamics_tolerance, heading
from roboloc.angles import wrap
from roboloc_reference import mcl

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

_EPS = 1e-9
_TRIES = 200_000
_CENTRE = (0.0, 0.0, 0.0)
_HINT_COPY = "Work on copies, or on new names."
_HINT_GLOBAL = "Use the arguments alone, nothing global."


# The motion


def transition_tolerance(xs: np.ndarray, us: np.ndarray, dt: float) -> np.ndarray:
    """Bound the error of each pose: that of the motion of one robot."""
    bounds = [dynamics_tolerance(x, u, dt)[0] for x, u in zip(xs, us, strict=True)]
    return np.reshape(bounds, (-1, 3))


def _moved(rng: Generator, omegas: Any, turns: int = 0) -> Case:
    dt = float(rng.choice([rng.uniform(0.2, 0.6), rng.uniform(1.4, 2.0)]))
    omegas = np.array(omegas, dtype=float)
    V = rng.uniform(0.4, 1.5, omegas.size) * rng.choice([-1, 1], omegas.size)
    xs = [[*rng.uniform(-3, 3, 2), heading(rng, omega * dt, turns)] for omega in omegas]
    return TRANSITION.case(np.array(xs).reshape(-1, 3), np.stack([V, omegas], axis=1), dt)


def _turning(rng: Generator, count: int) -> np.ndarray:
    """Draw turning rates, all of them clearly turning and no two alike."""
    return rng.permutation(np.linspace(0.3, 1.2, count) * np.resize([1, -1], count)) * rng.uniform(0.9, 1.1)


@remembered
def arcs(rng: Generator) -> list[Case]:
    """Make clouds of which every particle turns, each by a control of its own."""
    return [_moved(rng, _turning(rng, M)) for M in (5, 7, 6)]


@remembered
def straight(rng: Generator) -> list[Case]:
    """Make clouds that drive straight, or turn so slowly that the closed form fails."""
    slow = (0.0, rng.uniform(1e-9, 2e-9), -rng.uniform(1e-7, 2e-7), 0.0, 1e-12)
    return [_moved(rng, [0.0] * 5), _moved(rng, slow)]


@remembered
def mixed(rng: Generator) -> list[Case]:
    """Make clouds of which some particles turn and some do not."""
    return [_moved(rng, rng.permutation([*_turning(rng, 4), 0.0, 0.0, 1e-9])) for _ in range(3)]


@remembered
def many_turns(rng: Generator) -> list[Case]:
    """Make clouds that have turned around several times."""
    return [_moved(rng, _turning(rng, 5), 4) for _ in range(2)]


@remembered
def clouds(rng: Generator) -> list[Case]:
    """Make clouds of one, two, three and many particles."""
    return [_moved(rng, _turning(rng, M)) for M in (1, 2, 3, 40)]


_XS = frozenset({"xs"})
TRANSITION = Stage(
    name="mcl.transition_model",
    outputs=("xs",),
    reference=mcl.transition_model,
    tolerance=transition_tolerance,
    columns={"xs": ("x", "y", "theta")},
    many=cloud_inputs.many_moved,
    checks=(
        Check("every particle by its own control", 6, each(arcs), "Row m of us belongs to row m of xs."),
        Check(
            "straight lines and very slow turns", 3, each(straight), "omega = 0 is allowed, and so is 1e-9."
        ),
        Check(
            "some turn, some do not",
            4,
            each(mixed),
            "One cloud holds particles of both kinds: the choice of the formula is each particle's own.",
        ),
        Check("nothing is wrapped", 2, each(many_turns), "A motion keeps every heading in its turn."),
        Check(
            "clouds of other sizes", 2, each(clouds), "A cloud may have one particle: (1, 3) in, (1, 3) out."
        ),
        Check("arguments untouched", 1.5, untouched(arcs, ("xs", "us", "dt"), _XS), _HINT_COPY),
        Check("same call, same result", 1.5, repeatable(arcs, _XS), _HINT_GLOBAL),
    ),
)


# The lines that each particle expects


def predicted_tolerance(xs: np.ndarray, map_lines: np.ndarray, tf: np.ndarray) -> np.ndarray:
    """Bound the error of each line as each particle expects it."""
    bounds = [[transform_tolerance(line, x, tf)[0] for line in map_lines.T] for x in xs]
    return np.array(bounds).transpose(0, 2, 1)


def each_in_one_turn(right: dict[str, Any], got: dict[str, Any]) -> dict[str, Any]:
    """Accept both ends of the turn, for every line of every particle."""
    if got["hs"] is None:
        return got
    M, _, J = right["hs"].shape
    wanted, found = (
        {"hs": part["hs"].transpose(1, 0, 2).reshape(2, M * J), "": None} for part in (right, got)
    )
    return {"hs": one_turn(wanted, found)["hs"].reshape(2, M, J).transpose(1, 0, 2)}


def _seen(rng: Generator, M: int, J: int, tf: Any = _CENTRE, crossed: str = "no") -> Case:
    """Make a cloud in a map; `crossed` says of which lines the particles are on both sides."""
    tf = np.array(tf, dtype=float)
    for _ in range(_TRIES):
        spread = 2.5 if crossed == "some" else 1.0
        xs = np.stack([*rng.uniform(-spread, spread, (2, M)), rng.uniform(-3.0, 3.0, M)], axis=1)
        r = rng.uniform(0.3, 2.0, J) if crossed == "some" else rng.uniform(2.4, 4.0, J)
        map_lines = np.stack([rng.uniform(-3.0, 3.0, J), r])
        alpha, normal = map_lines[0], np.exp(1j * map_lines[0])
        place = xs[:, 0] + 1j * xs[:, 1] + np.exp(1j * xs[:, 2]) * complex(*tf[:2])
        ahead = r - (place[:, None] * normal.conj()).real
        angle = alpha - xs[:, 2:] - tf[2]
        clear = np.abs(wrap(angle)) < 3.0, np.abs(wrap(angle + math.pi)) < 3.0, np.abs(ahead) > 0.2
        behind = ahead < 0
        wanted = behind.any() and not behind.all() if crossed == "some" else not behind.any()
        turned = (np.abs(angle) > math.pi).any() or crossed != "turned"
        inside = (np.abs(angle + math.pi * behind) < math.pi).all() or crossed == "turned"
        if all(part.all() for part in clear) and wanted and turned and inside:
            return PREDICTED.case(xs, map_lines, tf)
    raise AssertionError  # pragma: no cover


@remembered
def seen(rng: Generator) -> list[Case]:
    """Make clouds with the scanner at the robot's centre, no line crossed, no angle beyond a turn."""
    return [_seen(rng, M, J) for M, J in ((4, 1), (2, 3), (1, 4), (3, 2))]


@remembered
def mounted(rng: Generator) -> list[Case]:
    """Make clouds with a scanner off the centre and turned."""
    return [_seen(rng, M, J, mounting(rng)) for M, J in ((4, 1), (2, 3), (1, 4))]


@remembered
def crossed(rng: Generator) -> list[Case]:
    """Make clouds of which some particles have crossed some lines."""
    return [_seen(rng, 3, 2, crossed="some"), _seen(rng, 2, 3, mounting(rng), crossed="some")]


@remembered
def turned(rng: Generator) -> list[Case]:
    """Make clouds that see some lines beyond the end of a turn."""
    return [_seen(rng, M, J, crossed="turned") for M, J in ((4, 3), (3, 4))]


@remembered
def maps(rng: Generator) -> list[Case]:
    """Make one particle in a map of one line, and several sizes that a wrong axis would not survive."""
    return [_seen(rng, M, J, crossed="turned") for M, J in ((1, 1), (2, 2), (5, 1), (1, 5))]


_HS = frozenset({"hs"})
PREDICTED = Stage(
    name="mcl.compute_predicted_measurements",
    outputs=("hs",),
    reference=mcl.compute_predicted_measurements,
    tolerance=predicted_tolerance,
    rows={"hs": ("alpha", "r")},
    aligned=each_in_one_turn,
    many=cloud_inputs.many_seen,
    checks=(
        Check(
            "alpha and r, particle by particle",
            6,
            each(seen),
            "hs[m] is (2, J): row 0 has alphas, row 1 has r.",
        ),
        Check(
            "scanner mounted elsewhere", 3, each(mounted), "Where in the world is the scanner of particle m?"
        ),
        Check("lines crossed", 4, each(crossed), "r < 0: which two numbers change, and for whom?"),
        Check("alpha in one turn", 3, each(turned), "Wrap every alpha to [-pi, pi), after all else is done."),
        Check("maps and clouds of other sizes", 2, each(maps), "One particle or one line keeps its axis."),
        Check("arguments untouched", 1, untouched(seen, ("xs", "map_lines", "tf"), _HS), _HINT_COPY),
        Check("same call, same result", 1, repeatable(seen, _HS), _HINT_GLOBAL),
    ),
)


# Which line is which


def _cases(scenes: Callable[[Generator], list[tuple]]) -> Callable[[Generator], tuple[Case, ...]]:
    """Return a maker of cases out of one of scenes."""
    return remembered(lambda rng: [INNOVATIONS.case(*args) for args in scenes(rng)])


plain = _cases(cloud_inputs.plain)
judged_by_covariance = _cases(cloud_inputs.judged_by_covariance)
own_covariance = _cases(cloud_inputs.own_covariance)
wrapped = _cases(cloud_inputs.wrapped)
far = _cases(cloud_inputs.far)
scenes = _cases(cloud_inputs.scenes)
_VS = frozenset({"vs"})
_HINT_JUDGE = "Nearest means the least v^T Q^-1 v, with the covariance of that observation."
INNOVATIONS = Stage(
    name="mcl.compute_innovations",
    outputs=("vs",),
    reference=mcl.compute_innovations,
    tolerance=lambda z_raw, _, hs: np.full((len(hs), 2 * z_raw.shape[1]), _EPS),
    many=cloud_inputs.many_matched,
    checks=(
        Check(
            "innovations, in order",
            5,
            each(plain),
            "Row m: alpha of the first observation, its r, alpha of the next.",
        ),
        Check("nearest by the covariance", 3, each(judged_by_covariance), _HINT_JUDGE),
        Check("each observation by its own covariance", 3, each(own_covariance), _HINT_JUDGE),
        Check(
            "angles across the end of a turn",
            4,
            each(wrapped),
            "Wrap before you judge, and return what is wrapped.",
        ),
        Check("no gate", 2, each(far), "A particle that explains nothing must not look good for it."),
        Check(
            "other numbers of particles, observations and lines", 1, each(scenes), "One of each is allowed."
        ),
        Check("arguments untouched", 1, untouched(plain, ("z_raw", "Q_raw", "hs"), _VS), _HINT_COPY),
        Check("same call, same result", 1, repeatable(plain, _VS), _HINT_GLOBAL),
    ),
)


# Weights


def weights(vs: np.ndarray, Q_raw: np.ndarray, ws: np.ndarray) -> np.ndarray:
    """Return the right weights; that the reference warns is its own business."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return mcl.measurement_weights(vs, Q_raw, ws)


def _weighed(
    rng: Generator, M: int, count: int, size: float, *, equal: bool = True, far: float = 0.0
) -> Case:
    """Make innovations of about `size` standard deviations, all of them as far off as `far` says."""
    Q_raw = np.array([rng.uniform(0.05, 0.3) ** 2 * covariance(rng, 2) for _ in range(count)])
    L = np.linalg.cholesky(Q_raw)
    white = rng.normal(size=(M, count, 2)) * size
    white += far * np.sign(white)
    vs = np.einsum("iab,mib->mia", L, white).reshape(M, 2 * count)
    ws = np.full(M, 1 / M) if equal else rng.uniform(0.1, 1.0, M)
    return WEIGHTS.case(vs, Q_raw, ws if equal else ws / ws.sum())


@remembered
def weighed(rng: Generator) -> list[Case]:
    """Make clouds of equal weights and single observations."""
    return [_weighed(rng, M, 1, 1.0) for M in (3, 5, 7)]


@remembered
def several(rng: Generator) -> list[Case]:
    """Make clouds that see several lines."""
    return [_weighed(rng, M, count, 0.8) for M, count in ((5, 2), (4, 3), (3, 5))]


@remembered
def carried(rng: Generator) -> list[Case]:
    """Make clouds whose weights differ before."""
    return [_weighed(rng, M, count, 0.7, equal=False) for M, count in ((5, 2), (4, 1), (6, 3))]


@remembered
def unlikely(rng: Generator) -> list[Case]:
    """Make clouds of which every likelihood is below the least positive number, but not all alike."""
    return [
        _weighed(rng, 5, 4, 0.3, far=16.0),
        _weighed(rng, 4, 40, 0.1, far=5.0),
        _weighed(rng, 4, 1, 0.02, far=30.0),
    ]


@remembered
def some_impossible(rng: Generator) -> list[Case]:
    """Make clouds of which some particles had lost all weight before."""
    found = []
    for case in carried(rng):
        vs, Q_raw, ws = case.fresh()
        ws[1] = 0.0
        found.append(WEIGHTS.case(vs, Q_raw, ws))
    return found


@remembered
def impossible(rng: Generator) -> list[Case]:
    """Make clouds in which no particle is possible."""
    vs, Q_raw, ws = _weighed(rng, 5, 2, 1.0).fresh()
    return [WEIGHTS.case(vs, Q_raw, 0 * ws), WEIGHTS.case(1e170 * vs, Q_raw, ws)]


def _silently(run: Callable[..., None]) -> Callable[..., None]:
    """Make a check that a function may warn in: where it runs in this process, the warning would count as an error."""

    def silent(function: Callable[..., Any], rng: Generator) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            run(function, rng)

    return silent


_WS = frozenset({"ws"})
WEIGHTS = Stage(
    name="mcl.measurement_weights",
    outputs=("ws",),
    reference=weights,
    tolerance=lambda vs, Q_raw, ws: np.full(len(ws), _EPS),  # noqa: ARG005  (the arguments of the stage)
    many=cloud_inputs.many_weighed,
    checks=(
        Check("one line", 4, each(weighed), "exp(-v^T Q^-1 v / 2), and then all of them together make 1."),
        Check(
            "several lines", 3, each(several), "Each observation has a covariance, and each counts in full."
        ),
        Check("weights before", 4, each(carried), "What a particle was worth before, still counts."),
        Check(
            "likelihoods too small for a number",
            3,
            each(unlikely),
            "Sum logarithms; take off the largest before exp.",
        ),
        Check("particles without weight", 1, each(some_impossible), "What is 0 stays 0."),
        Check(
            "all impossible",
            3,
            _silently(each(impossible)),
            "Where nobody can be right, all are worth the same: 1/M.",
        ),
        Check("arguments untouched", 1, untouched(several, ("vs", "Q_raw", "ws"), _WS), _HINT_COPY),
        Check("same call, same result", 1, repeatable(several, _WS), _HINT_GLOBAL),
    ),
)

STAGES = (TRANSITION, PREDICTED, INNOVATIONS, WEIGHTS)
