"""Hidden checks of the notebook *comparison*: errors over runs, coverage, a mean with its precision, a paired interval.

The inputs are made up, not recorded: runs that differ, instants that resemble each other, headings on both sides of the
cut, correlated covariances. Each right number is a closed formula of them, so the allowed error is rounding alone. A
share counts: there the squares keep away from the bound, so that rounding cannot move one across.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.special import chdtri

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.kinds import each, repeatable, untouched
from roboloc_reference.verdict import coverage, mean_and_error, paired_interval, rms_errors

if TYPE_CHECKING:
    from numpy.random import Generator


def _poses(rng: Generator, runs: int, instants: int, turns: int = 0, cut: bool = False) -> Case:
    """Make estimates with an offset that all runs share, and truth; across the cut, or some turns away."""
    truth = rng.uniform(-3.0, 3.0, (runs, instants, 3))
    truth[..., 2] = (np.pi if cut else 0.0) + rng.uniform(-0.4, 0.4, (runs, instants))
    poses = truth + rng.normal(size=truth.shape) * [0.5, 0.8, 0.2] + [0.4, -0.3, 0.15]
    if cut:
        truth[..., 2], poses[..., 2] = (np.angle(np.exp(1j * angles[..., 2])) for angles in (truth, poses))
    poses[..., 2] += 2 * np.pi * turns * rng.choice([-1, 1], (runs, instants))
    return RMS.case(poses, truth)


@remembered
def plain_errors(rng: Generator) -> list[Case]:
    """Make runs whose headings stay away from the cut."""
    return [_poses(rng, runs, instants) for runs, instants in ((5, 3), (4, 6), (3, 4))]


@remembered
def errors_across(rng: Generator) -> list[Case]:
    """Make runs that look west, on both sides of the cut."""
    return [_poses(rng, 8, 4, cut=True) for _ in range(3)]


@remembered
def errors_turned(rng: Generator) -> list[Case]:
    """Make runs whose headings were counted on by several turns."""
    return [_poses(rng, 5, 3, turns) for turns in (1, 4)]


def _claims(rng: Generator, size: int, probability: float, runs: int = 24, instants: int = 4) -> Case:
    """Make errors on both sides of the bound, of covariances that differ from run to run and are correlated."""
    bound = float(chdtri(size, 1.0 - probability))
    L = np.tril(
        rng.uniform(0.5, 1.0, (runs, instants, size, size))
        * rng.choice([-1, 1], (runs, instants, size, size))
    )
    L[..., range(size), range(size)] = rng.uniform(0.5, 1.0, (runs, instants, size))
    L *= np.exp(rng.uniform(-1.2, 1.2, (runs, instants, 1, 1)))
    z = rng.normal(size=(runs, instants, size))
    z /= np.linalg.norm(z, axis=-1, keepdims=True)
    inside = rng.random((runs, instants)) < 0.6
    inside[0], inside[1] = True, False
    ratio = np.where(inside, rng.uniform(0.35, 0.97, inside.shape), rng.uniform(1.03, 2.2, inside.shape))
    if size > 1:
        # At the last instant all errors lie along long and narrow ellipses: inside, and outside without the slant.
        slant = np.linalg.cholesky(0.1 * np.eye(size) + 0.9)
        L[:, -1] = rng.uniform(0.3, 3.0, (runs, 1, 1)) * slant
        z[:, -1] = np.linalg.solve(slant, np.ones(size))
        z[:, -1] /= np.linalg.norm(z[0, -1])
        ratio[:, -1] = rng.uniform(0.65, 0.95, runs)
    errors = (L @ (z * np.sqrt(ratio * bound)[..., None])[..., None])[..., 0]
    return COVERAGE.case(errors, L @ np.swapaxes(L, -1, -2), probability)


@remembered
def poses_inside(rng: Generator) -> list[Case]:
    """Make claims about poses."""
    return [_claims(rng, 3, probability) for probability in (0.95, 0.8, 0.99)]


@remembered
def places_inside(rng: Generator) -> list[Case]:
    """Make claims about positions, and about one number."""
    return [
        _claims(rng, size, probability) for size, probability in ((2, 0.9), (1, 0.95), (2, 0.6), (1, 0.5))
    ]


def _series(rng: Generator, runs: int, instants: int) -> Case:
    """Make numbers that go up and down slowly, about another level in every run."""
    level = rng.uniform(1.0, 6.0, (runs, 1))
    return MEAN.case(
        level + 0.5 * np.cumsum(rng.normal(size=(runs, instants)), axis=1) + rng.uniform(0, 2, instants)
    )


@remembered
def series(rng: Generator) -> list[Case]:
    """Make numbers of several runs."""
    return [_series(rng, runs, instants) for runs, instants in ((5, 8), (20, 6), (9, 40))]


@remembered
def short_series(rng: Generator) -> list[Case]:
    """Make two runs, and runs of one instant."""
    return [_series(rng, 2, 7), _series(rng, 6, 1), _series(rng, 3, 2)]


def _pair(rng: Generator, runs: int, draws: int, probability: float) -> Case:
    """Make two filters whose runs are alike: a hard run is hard for both."""
    hard = rng.gamma(2.0, 2.0, runs)
    a = hard + rng.gamma(1.0, 0.6, runs)
    b = hard + rng.gamma(1.0, 0.3, runs) - 0.1
    return PAIRED.case(a, b, rng.integers(0, runs, (draws, runs)), probability)


@remembered
def pairs(rng: Generator) -> list[Case]:
    """Make pairs of filters."""
    return [_pair(rng, *sizes) for sizes in ((12, 200, 0.95), (20, 101, 0.9), (7, 60, 0.5))]


@remembered
def few_draws(rng: Generator) -> list[Case]:
    """Make so few draws that the ends lie between two of them."""
    return [_pair(rng, 6, 8, 0.8), _pair(rng, 9, 5, 0.9)]


_COPY = "The caller still needs its arrays: work on copies."
_GLOBAL = "Use the arguments alone, nothing global, and draw nothing."
_POSITION, _HEADING = frozenset({"position"}), frozenset({"heading"})

RMS = Stage(
    name="verdict.rms_errors",
    outputs=("position", "heading"),
    reference=rms_errors,
    tolerance=lambda poses, _: (np.full(poses.shape[1], 1e-8),) * 2,
    checks=(
        Check(
            "position",
            5,
            each(plain_errors, "position"),
            "Write down all that happens to one instant: which runs, squared when, averaged over what?",
        ),
        Check(
            "heading", 4, each(plain_errors, "heading"), "The same steps as for the position, for one number."
        ),
        Check(
            "headings across the cut",
            4,
            each(errors_across, "heading"),
            "How far apart are 179 and -179 degrees?",
        ),
        Check(
            "headings of many turns",
            3,
            each(errors_turned, "heading"),
            "A robot that has turned once around looks where it looked before.",
        ),
        Check(
            "arguments untouched", 2, untouched(plain_errors, ("poses", "truth"), _POSITION | _HEADING), _COPY
        ),
        Check("same call, same result", 2, repeatable(plain_errors, _POSITION | _HEADING), _GLOBAL),
    ),
)
_INSIDE = frozenset({"share"})
COVERAGE = Stage(
    name="verdict.coverage",
    outputs=("share",),
    reference=coverage,
    tolerance=lambda errors, _covs, _p: np.full(errors.shape[1], 1e-8),
    checks=(
        Check(
            "poses",
            8,
            each(poses_inside, "share"),
            "Which number of each run and instant is compared with which bound, and where does the bound "
            "come from?",
        ),
        Check(
            "positions and single numbers",
            8,
            each(places_inside, "share"),
            "The bound depends on how many numbers an error has.",
        ),
        Check(
            "arguments untouched",
            2,
            untouched(poses_inside, ("errors", "covs", "probability"), _INSIDE),
            _COPY,
        ),
        Check("same call, same result", 2, repeatable(poses_inside, _INSIDE), _GLOBAL),
    ),
)
_MEAN, _ERROR = frozenset({"mean"}), frozenset({"error"})
MEAN = Stage(
    name="verdict.mean_and_error",
    outputs=("mean", "error"),
    reference=mean_and_error,
    tolerance=lambda values: (1e-9 * (1 + np.abs(values).max()),) * 2,
    checks=(
        Check("mean", 3, each(series, "mean"), "The mean of all numbers there are."),
        Check(
            "standard error",
            8,
            each(series, "error"),
            "How many independent numbers do you have? Of which numbers do you take the spread?",
        ),
        Check(
            "two runs, and one instant",
            5,
            each(short_series, "mean", "error"),
            "With two runs, work both numbers out by hand.",
        ),
        Check("arguments untouched", 2, untouched(series, ("values",), _MEAN | _ERROR), _COPY),
        Check("same call, same result", 2, repeatable(series, _MEAN | _ERROR), _GLOBAL),
    ),
)
_ENDS = frozenset({"low", "high"})
PAIRED = Stage(
    name="verdict.paired_interval",
    outputs=("low", "high"),
    reference=paired_interval,
    tolerance=lambda *_: (1e-8, 1e-8),
    checks=(
        Check(
            "many draws",
            10,
            each(pairs, "low", "high"),
            "One draw is a set of runs. What is computed of one set, and what of all sets?",
        ),
        Check(
            "few draws",
            6,
            each(few_draws, "low", "high"),
            "Where a quantile lies between two numbers, it is on the straight line between them.",
        ),
        Check("arguments untouched", 2, untouched(pairs, ("a", "b", "picks", "probability"), _ENDS), _COPY),
        Check("same call, same result", 2, repeatable(pairs, _ENDS), _GLOBAL),
    ),
)

STAGES = (RMS, COVERAGE, MEAN, PAIRED)
