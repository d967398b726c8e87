r"""Hidden checks of one step of the bootstrap filter: motion, weights and resampling together.

The particles of a case stand at `GROUPS` places, metres apart, so that of every particle that comes back it is known
where it was. What is judged of them: which `share` comes from each place, means and standard deviations of the turn,
way and turn that they have done (see `autograder.checks.odometry`), and the weights.

* *Without errors of the motion* the shares are the normalised products of weight and density, and a systematic comb
  takes each within one particle, whatever its offset: nothing is left to chance.
* *With errors, and a bearing that says nothing*, every particle is taken once: means and spreads are the model's.
* *With an error of the second turn alone, and a landmark so far away that its direction is that of a star*, the
  errors that survive are normal again: with prior variance s^2 and bearing variance q^2, an innovation v0 shifts them
  by -v0 s^2 / (s^2 + q^2) and leaves the variance s^2 q^2 / (s^2 + q^2).

What is left to chance may be `WIDE` standard errors off: with 4 such cases and 6 numbers in each, correct code is
rejected with probability below 1e-7.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.kinds import each, seeded, untouched
from autograder.checks.odometry import CONTROLS, EXACT, controls, spreads
from autograder.compare import kind, read
from roboloc_reference.odometry import bearing_likelihood, bootstrap_step

if TYPE_CHECKING:
    from numpy.random import Generator

GROUPS, EACH, WIDE = 6, 150, 7.0
COUNT = GROUPS * EACH
STAR = 1e7  # [m]
_ARGUMENTS = ("xs", "ws", "odometry", "alphas", "landmark", "bearing", "sigma", "rng")


def moved(xs: np.ndarray, odometry: np.ndarray) -> np.ndarray:
    """Return where particles are after a motion without error."""
    direction = xs[:, 2] + odometry[0]
    way = odometry[1] * np.stack([np.cos(direction), np.sin(direction)], axis=-1)
    return np.column_stack([xs[:, :2] + way, direction + odometry[2]])


def _star(args: tuple) -> tuple[float, float]:
    """Return the prior deviation of the heading, and its innovation without error: both 0 unless it matters."""
    xs, _, odometry, alphas, landmark, bearing, *_ = args
    if np.hypot(*landmark) < STAR / 2.0:
        return 0.0, 0.0
    direction = np.arctan2(landmark[1], landmark[0])
    v0 = np.angle(np.exp(1j * (bearing - direction + xs[0, 2] + odometry[0] + odometry[2])))
    return float(spreads(odometry, alphas)[2]), float(v0)


def summary(args: tuple, returned: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, Any]:
    """Return the shares of the places, means and deviations of what was done, and the weights."""
    if type(returned) not in {tuple, list}:
        raise AssertionError(f"the function returned {kind(returned)}, expected a tuple xs, ws")
    if len(returned) != 2:
        raise AssertionError("the function did not return 2 values, expected xs, ws")
    xs, odometry = args[0], args[2]
    after = read(returned[0], "xs", xs.shape)
    places = xs[::EACH]
    gaps = after[:, :2] @ [1.0, 1j] - (moved(places, odometry)[:, :2] @ [1.0, 1j])[:, None]
    origin = np.argmin(np.abs(gaps), axis=0)
    done = controls(places[origin], after, odometry)
    share = np.bincount(origin, minlength=GROUPS) / COUNT
    return share, done.mean(axis=0), done.std(axis=0), returned[1]


def truth(*args: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return what the outputs are, or are on average."""
    xs, ws, odometry, alphas, landmark, bearing, sigma, _ = args
    mean, spread = odometry.copy(), spreads(odometry, alphas)
    support = bearing_likelihood(moved(xs, odometry), landmark, bearing, sigma) * ws
    share = support.reshape(GROUPS, EACH).sum(axis=1) / support.sum()
    prior, v0 = _star(args)
    if prior:
        gain = prior**2 / (prior**2 + sigma**2)
        mean[2] -= gain * v0
        spread[2] = sigma * np.sqrt(gain)
    return share, mean, spread, np.full(COUNT, 1.0 / COUNT)


def tolerance(*args: Any) -> tuple[float, np.ndarray, np.ndarray, float]:
    """Allow one particle of a share, or so many standard errors."""
    _, _, spread, _ = truth(*args)
    prior, v0 = _star(args)
    error, share = WIDE / np.sqrt(COUNT), 1.001 / COUNT
    if prior:
        ratio, q2 = (prior / args[6]) ** 2, args[6] ** 2
        uneven = (
            (1 + ratio)
            / np.sqrt(1 + 2 * ratio)
            * np.exp(v0**2 * prior**2 / (q2 + prior**2) / (q2 + 2 * prior**2))
        )
        error *= np.sqrt(uneven)
        share = WIDE * np.sqrt((uneven - 1.0) / EACH) / GROUPS + 2.0 / COUNT
    return share, EXACT + error * spread, EXACT + error * spread / np.sqrt(2.0), 1e-9 / COUNT


def _places(rng: Generator) -> np.ndarray:
    """Draw places around the origin, 2 m apart at least."""
    angle = rng.uniform(-np.pi, np.pi) + np.arange(GROUPS) * 2.0 * np.pi / GROUPS
    return rng.uniform(4.0, 5.0, GROUPS)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _case(rng: Generator, places: np.ndarray, shares: np.ndarray, *rest: Any) -> Case:
    seed = np.random.default_rng(int(rng.integers(2**32)))
    return STEP.case(np.repeat(places, EACH, axis=0), np.repeat(shares, EACH), *rest, seed)


def _exact(rng: Generator, bearing: float) -> Case:
    """Make a motion without error, after which each place sees the landmark within 1.3 sigma of the bearing."""
    odometry = rng.uniform([0.5, 0.6, 0.3], [0.9, 1.0, 0.6]) * rng.choice([-1.0, 1.0], 3)
    odometry[2] = abs(odometry[2]) * np.sign(odometry[0])
    sigma, landmark = float(rng.uniform(0.35, 0.5)), rng.uniform(-0.5, 0.5, 2)
    after = _places(rng)
    step = landmark - after
    v = sigma * rng.permutation([-1.3, -0.9, -0.4, 0.3, 0.8, 1.2])
    heading = np.arctan2(step[:, 1], step[:, 0]) - bearing + v
    before = heading - odometry[0] - odometry[2]
    before = np.angle(np.exp(1j * before))
    direction = before + odometry[0]
    start = after - odometry[1] * np.stack([np.cos(direction), np.sin(direction)], axis=-1)
    weights = rng.permutation([1.0, 2.0, 3.0, 4.0, 5.0, 0.0]) / (15.0 * EACH)
    return _case(
        rng, np.column_stack([start, before]), weights, odometry, np.zeros(4), landmark, float(bearing), sigma
    )


@remembered
def ahead(rng: Generator) -> list[Case]:
    """Make motions without error, and a landmark before the robot."""
    return [_exact(rng, sign * rng.uniform(0.1, 0.4)) for sign in (1, -1, 1)]


@remembered
def behind(rng: Generator) -> list[Case]:
    """Make motions without error, and a landmark behind the robot."""
    return [_exact(rng, sign * rng.uniform(2.8, 3.1)) for sign in (1, -1, 1)]


@remembered
def blind(rng: Generator) -> list[Case]:
    """Make motions with errors, and a bearing that says nothing."""
    found = []
    for sign in (1, -1):
        places = np.column_stack([_places(rng), rng.uniform(-np.pi, np.pi, GROUPS)])
        odometry = np.array([sign * rng.uniform(0.6, 0.9), rng.uniform(0.8, 1.0), rng.uniform(-0.6, -0.4)])
        alphas = rng.uniform([0.08, 0.02, 0.02, 0.03], [0.12, 0.04, 0.04, 0.04])
        even = np.full(GROUPS, 1.0 / COUNT)
        found.append(_case(rng, places, even, odometry, alphas, rng.uniform(-1, 1, 2), 0.5, 1e4))
    return found


@remembered
def star(rng: Generator) -> list[Case]:
    """Make motions with an error of the second turn, and a landmark as far away as a star."""
    found = []
    for sign in (1, -1):
        heading, direction = rng.uniform(-1.0, 1.0, 2)
        places = np.column_stack([_places(rng), np.full(GROUPS, heading)])
        odometry = np.array([0.0, rng.uniform(0.6, 1.0), rng.uniform(0.8, 1.0)])
        alphas = np.array([rng.uniform(0.2, 0.3), 0.0, 0.0, 0.0])
        prior = alphas[0] * odometry[2]
        bearing = direction - heading - odometry[2] + sign * 1.2 * prior
        landmark = STAR * np.array([np.cos(direction), np.sin(direction)])
        even = np.full(GROUPS, 1.0 / COUNT)
        found.append(_case(rng, places, even, odometry, alphas, landmark, float(bearing), float(prior)))
    return found


_HINT_SHARE = (
    "Two places, by hand: what does each weigh before the bearing, what after, and which share does it get?"
)
_HINT_BEHIND = "Print the innovations of a landmark behind the robot."
_HINT_WS = "After resampling the copies stand for the weights. What does each of them weigh?"
_HINT_MOVED = "Which particles are copied: those before the motion, or those after it?"
_HINT_ERRORS = "Every particle has errors of its own, drawn once in a step."
_HINT_STAR = "Which headings does the bearing weigh: those that were asked for, or those that were drawn?"
_HINT_RNG = "Draw from rng alone, the offset of the comb too."
_HINT_COPY = "Work on copies, or on new names."

STEP = Stage(
    name="odometry.bootstrap_step",
    outputs=("share", "mean", "spread", "ws"),
    reference=bootstrap_step,
    tolerance=tolerance,
    rows=dict.fromkeys(("mean", "spread"), CONTROLS),
    summary=summary,
    truth=truth,
    checks=(
        Check("shares, landmark ahead", 4, each(ahead, "share"), _HINT_SHARE),
        Check("shares, landmark behind", 3, each(behind, "share"), _HINT_BEHIND),
        Check("weights afterwards", 3, each(ahead, "ws"), _HINT_WS),
        Check("particles are moved", 3, each(ahead, "mean", "spread"), _HINT_MOVED),
        Check("particles err", 3, each(blind, "mean", "spread"), _HINT_ERRORS),
        Check("errors are weighed", 2, each(star, "mean", "spread"), _HINT_STAR),
        Check("draws from rng alone", 1, seeded(blind, frozenset({"spread"})), _HINT_RNG),
        Check("arguments untouched", 1, untouched(ahead, _ARGUMENTS, frozenset({"mean", "ws"})), _HINT_COPY),
    ),
)

STAGES = (STEP,)
