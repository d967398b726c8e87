r"""Hidden checks of the notebook *particle-filter*: a cloud of poses that is moved, weighed and measured.

`predict` is judged by what its particles have done. Of each returned particle the control that took it there is worked
out again; means, standard deviations and correlations of these over `COUNT` particles must be those of the model.
Spreads and correlations may be `WIDE` standard errors off, means a third of a spread. A normal number is farther off
with probability 8e-11, a standard deviation of so many with less than 1e-9; four cases have 36 such numbers, so that
correct code is rejected with probability below 1e-7, whatever order it draws in. Headings may come in any turn.
Without noise each particle must be where it belongs, to 1e-9.

`correct` may be off by 1e-8 of each weight, and by 1e-13 of the whole; `effective_sample_size` by 1e-9 of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.kinds import each, repeatable, seeded, untouched
from autograder.checks.velocity_model import CONTROL
from autograder.compare import read
from roboloc_reference.particle import correct, effective_sample_size, predict
from roboloc_reference.velocity import noise, range_bearings

if TYPE_CHECKING:
    from numpy.random import Generator

COUNT, WIDE, EXACT = 2500, 6.5, 1e-9


def spreads(u: np.ndarray, alphas: np.ndarray) -> np.ndarray:
    """Return the standard deviations of the three numbers of a control."""
    return np.sqrt(np.diag(noise(u, alphas)))


def controls(before: np.ndarray, after: np.ndarray, u: np.ndarray, dt: float) -> np.ndarray:
    """Return the control (M, 3) that took each particle from where it was to where it is.

    Of the two arcs to a place, ahead and back, the one is taken that was asked for.
    """
    side, half = (-1.0 if u[0] < 0.0 else 1.0), u[1] * dt / 2.0
    step = side * ((after[:, :2] - before[:, :2]) @ [1.0, 1j]) * np.exp(-1j * (before[:, 2] + half))
    step[np.abs(step) < 1e-12] = 0.0
    h = half + np.angle(step)
    v = side * np.abs(step) / (dt * np.sinc(h / np.pi))
    rest = after[:, 2] - before[:, 2] - 2.0 * h - u[2] * dt
    return np.stack([v, 2.0 * h / dt, u[2] + np.angle(np.exp(1j * rest)) / dt], axis=-1)


def moments(args: tuple, returned: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return means, standard deviations and correlations of the controls of the particles.

    What does not err although it should has the correlation 0 with itself.
    """
    xs, u, alphas, dt, _ = args
    found = controls(xs, read(returned, "xs", xs.shape), u, dt)
    mean, spread = found.mean(axis=0), found.std(axis=0)
    errs = spread > EXACT
    white = (found - mean) / np.where(errs, spread, np.inf)
    together = white.T @ white / len(xs)
    np.fill_diagonal(together, errs | (spreads(u, alphas) == 0.0))
    return mean, spread, together


def true_moments(
    _xs: np.ndarray, u: np.ndarray, alphas: np.ndarray, _dt: float, _rng: Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the moments of the model."""
    return u, spreads(u, alphas), np.eye(3)


def prediction_tolerance(
    xs: np.ndarray, u: np.ndarray, alphas: np.ndarray, _dt: float, _rng: Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Allow so many standard errors of each moment."""
    spread, error = spreads(u, alphas), WIDE / np.sqrt(len(xs))
    return EXACT + spread / 3.0, EXACT + error * spread / np.sqrt(2.0), np.full((3, 3), error)


def _moved(rng: Generator, u: Any, alphas: Any, dt: float, count: int = COUNT) -> Case:
    """Make particles all around and a generator for their errors."""
    xs = np.stack([*rng.uniform(-5.0, 5.0, (2, count)), rng.uniform(-np.pi, np.pi, count)], axis=-1)
    seed = np.random.default_rng(int(rng.integers(2**32)))
    return PREDICT.case(xs, np.array(u, dtype=float), np.array(alphas, dtype=float), float(dt), seed)


@remembered
def without_noise(rng: Generator) -> list[Case]:
    """Make drives without noise: arcs to both sides, backwards, straight ahead and on the spot."""
    shapes = ((1, 1, 1), (1, -1, 1), (-1, 1, -1), (1, 0, 1), (0, 1, -1))
    sizes = [rng.uniform([1.0, 0.5, 0.2], [1.6, 0.9, 0.5]) for _ in shapes]
    return [
        _moved(rng, size * shape, np.zeros(6), rng.uniform(0.4, 0.9), 40)
        for size, shape in zip(sizes, shapes, strict=True)
    ]


@remembered
def by_speed(rng: Generator) -> list[Case]:
    """Make drives whose noise comes from the speed most of all, ahead and back."""
    alphas = rng.uniform(
        [0.006, 0.0002, 0.02, 0.0005, 0.03, 0.001], [0.009, 0.0004, 0.03, 0.001, 0.04, 0.002]
    )
    return [
        _moved(rng, [sign * rng.uniform(1.3, 1.7), rng.uniform(0.15, 0.25), 0.0], alphas, dt)
        for sign, dt in ((1, 0.3), (-1, 0.35))
    ]


@remembered
def by_turning(rng: Generator) -> list[Case]:
    """Make drives whose noise comes from the turning rate most of all, to both sides."""
    alphas = rng.uniform([0.001, 0.006, 0.002, 0.02, 0.002, 0.05], [0.002, 0.009, 0.004, 0.03, 0.004, 0.07])
    return [
        _moved(rng, [rng.uniform(0.42, 0.48), sign * rng.uniform(0.23, 0.27), 0.2], alphas, dt)
        for sign, dt in ((1, 0.4), (-1, 0.3))
    ]


_HINT_WHERE = "Drive one particle by hand: an arc of v and omega, then, on the spot, a turn by gamma dt."
_HINT_SPREAD = "Which six numbers make the three variances, and what does your generator want: a variance?"
_HINT_OWN = "How many numbers does one particle need, and does any number serve twice?"
_HINT_RNG = "Draw from rng alone, and make no generator of your own."
_HINT_COPY = "Work on copies, or on new names."
_HINT_GLOBAL = "Use the arguments alone, nothing global."
_MOMENTS = ("mean", "spread", "together")

PREDICT = Stage(
    name="particle.predict",
    outputs=_MOMENTS,
    reference=predict,
    tolerance=prediction_tolerance,
    rows=dict.fromkeys(_MOMENTS, CONTROL),
    columns={"together": CONTROL},
    summary=moments,
    truth=true_moments,
    checks=(
        Check("drives without noise", 5, each(without_noise, "mean", "spread"), _HINT_WHERE),
        Check("mean of the controls", 2, each(by_speed, "mean"), _HINT_WHERE),
        Check("spread, noise of the speed", 4, each(by_speed, "spread"), _HINT_SPREAD),
        Check("spread, noise of the turning rate", 4, each(by_turning, "spread"), _HINT_SPREAD),
        Check("errors of their own", 2, each(by_speed, "together"), _HINT_OWN),
        Check("draws from rng alone", 1, seeded(by_turning, frozenset({"spread"})), _HINT_RNG),
        Check(
            "arguments untouched",
            2,
            untouched(without_noise, ("xs", "u", "alphas", "dt", "rng"), frozenset({"mean"})),
            _HINT_COPY,
        ),
    ),
)


def weight_tolerance(*args: Any) -> np.ndarray:
    """Bound the error of each weight by a share of it, and of the whole."""
    return 1e-8 * correct(*args) + 1e-13


def _sensor(rng: Generator) -> np.ndarray:
    """Draw a covariance of bearing and range that are correlated."""
    d = rng.uniform([0.1, 0.3], [0.2, 0.6])
    return np.diag(d) @ np.array([[1.0, rho := rng.uniform(0.4, 0.6)], [rho, 1.0]]) @ np.diag(d)


def _seen(
    rng: Generator, bearings: Any, *, off: Any = 1.0, near: float = 1.0, laps: int = 0, dead: int = 0
) -> Case:
    """Make particles about a pose that sees landmarks at some bearings; `off` is how far the observation is off."""
    count, Q = 14, _sensor(rng)
    at = np.array([*rng.uniform(-2.0, 2.0, 2), rng.uniform(-2.5, 2.5)])
    bearings = np.array(bearings, dtype=float)
    ranges = rng.uniform(2.5, 5.0, len(bearings))
    landmarks = at[:2] + ranges[:, None] * np.stack([np.cos(at[2] + bearings), np.sin(at[2] + bearings)], -1)
    xs = at + near * rng.uniform(-1.0, 1.0, (count, 3)) * [0.3, 0.3, 0.12]
    xs[:, 2] += 2.0 * np.pi * laps * rng.integers(1, 4, count)
    error = rng.uniform(0.4, 1.0, (len(bearings), 2)) * rng.choice([-1.0, 1.0], (len(bearings), 2))
    z = np.stack([bearings, ranges], -1) + error * np.sqrt(np.diag(Q)) * off
    z[:, 0] = np.angle(np.exp(1j * z[:, 0]))
    ws = rng.uniform(0.2, 2.0, count) * rng.uniform(0.5, 1.5)
    ws[rng.permutation(count)[:dead]] = 0.0
    return CORRECT.case(xs, ws, z.ravel(), landmarks, Q)


@remembered
def ahead(rng: Generator) -> list[Case]:
    """Make a landmark seen before the robot or beside it."""
    return [_seen(rng, [sign * rng.uniform(0.3, 1.4)]) for sign in (1, -1, 1)]


@remembered
def several(rng: Generator) -> list[Case]:
    """Make two or three landmarks."""
    return [_seen(rng, rng.uniform(-0.2, 0.2, k) + np.array([0.5, -0.9, 1.4])[:k]) for k in (2, 3)]


@remembered
def behind(rng: Generator) -> list[Case]:
    """Make a landmark straight behind, and headings of several turns."""
    found = [_seen(rng, [np.pi + 0.02 * sign], off=0.1, laps=sign) for sign in (1, -1)]
    return [*found, _seen(rng, [3.13, 0.4], off=0.1)]


@remembered
def unlikely(rng: Generator) -> list[Case]:
    """Make observations that no particle explains: every density is 0 in floating point."""
    return [_seen(rng, [sign * 0.5, sign * 1.2], off=[0.1, 100.0], near=0.05) for sign in (1, -1)]


@remembered
def dead(rng: Generator) -> list[Case]:
    """Make clouds in which some weights are 0 already."""
    return [_seen(rng, [0.7, -0.6], dead=count) for count in (3, 9)]


@remembered
def nothing(rng: Generator) -> list[Case]:
    """Make steps in which no landmark is seen."""
    return [_seen(rng, []) for _ in range(2)]


_HINT_AHEAD = (
    "One particle, one landmark: what does it expect, and by how much is that off? What did it weigh before?"
)
_HINT_SEVERAL = "Landmarks are seen independently of each other: what becomes of their densities?"
_HINT_WRAP = "Two bearings, 3.1 and -3.1: how far are they apart?"
_HINT_TAIL = "Print the densities of a bad observation. Which of their properties survive in the logarithms?"
_HINT_DEAD = "A particle of weight 0 stays impossible. What is left of it in the logarithms?"
_HINT_NONE = "Where nothing is seen, the weights keep their ratios, and add up to 1."
_WS = frozenset({"ws"})

CORRECT = Stage(
    name="particle.correct",
    outputs=("ws",),
    reference=correct,
    tolerance=weight_tolerance,
    checks=(
        Check("one landmark", 6, each(ahead, "ws"), _HINT_AHEAD),
        Check("several landmarks", 3, each(several, "ws"), _HINT_SEVERAL),
        Check("landmark behind, headings of several turns", 3, each(behind, "ws"), _HINT_WRAP),
        Check("observations that nothing explains", 2, each(unlikely, "ws"), _HINT_TAIL),
        Check("weights of 0", 2, each(dead, "ws"), _HINT_DEAD),
        Check("nothing seen", 1, each(nothing, "ws"), _HINT_NONE),
        Check(
            "arguments untouched", 2, untouched(ahead, ("xs", "ws", "z", "landmarks", "Q"), _WS), _HINT_COPY
        ),
        Check("same call, same result", 1, repeatable(ahead, _WS), _HINT_GLOBAL),
    ),
)


def underflows(case: Case) -> bool:
    """Say whether every density of a case is 0 in floating point."""
    xs, _, z, landmarks, Q = case.args
    v = z.reshape(-1, 2) - range_bearings(xs, landmarks)
    v[..., 0] = np.angle(np.exp(1j * v[..., 0]))
    exponents = np.einsum("mki,ij,mkj->m", v, np.linalg.inv(Q), v) / 2.0
    return bool(exponents.min() > 760.0)


def size_tolerance(ws: np.ndarray) -> float:
    """Bound the error of the size by a share of it."""
    return 1e-9 * effective_sample_size(ws)


def _sizes(rng: Generator, scale: float, count: int = 30, dead_ones: int = 0) -> Case:
    ws = rng.exponential(size=count) + 0.01
    ws[:dead_ones] = 0.0
    return SIZE.case(rng.permutation(ws) / ws.sum() * scale)


@remembered
def normalised(rng: Generator) -> list[Case]:
    """Make weights of sum 1."""
    return [_sizes(rng, 1.0, count) for count in (5, 30, 200)]


@remembered
def of_any_sum(rng: Generator) -> list[Case]:
    """Make weights of other sums."""
    return [_sizes(rng, scale) for scale in (0.3, 7.0, 40.0)]


@remembered
def ends(rng: Generator) -> list[Case]:
    """Make clouds of one particle, of one that lives, and of equal weights."""
    one = np.zeros(9)
    one[rng.integers(9)] = 1.0
    return [SIZE.case(ws) for ws in (np.ones(1), one, np.full(11, 1.0 / 11.0))] + [_sizes(rng, 1.0, 20, 8)]


@remembered
def tiny(rng: Generator) -> list[Case]:
    """Make weights so small that their squares are 0 in floating point."""
    return [_sizes(rng, 1e-190), _sizes(rng, 1e-220)]


_HINT_SIZE = "Try it on weights of which you know the answer: all equal, or one that has all."
_HINT_SUM = "Twice the weights are the same cloud."
_HINT_TINY = "What is the square of 1e-200 in floating point? What can be done before anything is squared?"
_N = frozenset({"n_eff"})

SIZE = Stage(
    name="particle.effective_sample_size",
    outputs=("n_eff",),
    reference=effective_sample_size,
    tolerance=size_tolerance,
    checks=(
        Check("weights of sum 1", 8, each(normalised, "n_eff"), _HINT_SIZE),
        Check("weights of any sum", 4, each(of_any_sum, "n_eff"), _HINT_SUM),
        Check("one particle, one that lives, equal weights", 3, each(ends, "n_eff"), _HINT_SIZE),
        Check("weights whose squares are 0", 2, each(tiny, "n_eff"), _HINT_TINY),
        Check("arguments untouched", 2, untouched(of_any_sum, ("ws",), _N), _HINT_COPY),
        Check("same call, same result", 1, repeatable(normalised, _N), _HINT_GLOBAL),
    ),
)

STAGES = (PREDICT, CORRECT, SIZE)
