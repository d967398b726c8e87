"""Stages of one output, and stages that return samples: what their checks accept, refuse and recognise."""

from __future__ import annotations

import numpy as np
import pytest

from autograder.check import Check, Stage, remembered, run_stage
from autograder.checks.kinds import each, repeatable, seeded, untouched
from autograder.compare import read
from autograder.diagnose import diagnose
from autograder.misconceptions.model import Misconception

COUNT = 4000


@remembered
def numbers(rng):
    """Make some vectors."""
    return [SQUARES.case(rng.uniform(1.0, 2.0, 3)) for _ in range(3)]


SQUARES = Stage(
    name="toy.squares",
    outputs=("y",),
    reference=lambda x: x * x,
    tolerance=lambda _: 1e-12,
    checks=(
        Check("y", 2, each(numbers, "y")),
        Check("arguments untouched", 1, untouched(numbers, ("x",), frozenset({"y"}))),
        Check("same call, same result", 1, repeatable(numbers, frozenset({"y"}))),
    ),
)
DOUBLED = Misconception("doubled", SQUARES.name, "", "", lambda x: 2 * x)


def moments(_args, returned):
    """Return mean and standard deviation of samples."""
    samples = read(returned, "samples", (COUNT,))
    return samples.mean(), samples.std()


def bounds(_mean, sigma, _rng):
    """Allow six standard errors."""
    return 6 * sigma / np.sqrt(COUNT), 6 * sigma / np.sqrt(2 * COUNT)


@remembered
def draws(rng):
    """Make some distributions to draw from."""
    return [DRAW.case(rng.uniform(-1, 1), rng.uniform(1, 2), np.random.default_rng(i)) for i in range(3)]


def draw(mean, sigma, rng):
    """Draw many samples."""
    return rng.normal(mean, sigma, COUNT)


DRAW = Stage(
    name="toy.draw",
    outputs=("mean", "spread"),
    reference=draw,
    tolerance=bounds,
    checks=(
        Check("mean", 1, each(draws, "mean")),
        Check("spread", 1, each(draws, "spread")),
        Check("draws from the generator", 1, seeded(draws)),
        Check("arguments untouched", 1, untouched(draws, ("mean", "sigma", "rng"), frozenset({"mean"}))),
    ),
    summary=moments,
    truth=lambda mean, sigma, _rng: (mean, sigma),
)
SQUARED = Misconception("variance as deviation", DRAW.name, "", "", lambda m, s, rng: draw(m, s * s, rng))


def outcome(stage, function):
    """Run all checks of a stage; the messages, and what is recognised."""
    ran = run_stage(stage, function, "a course")
    known = (DOUBLED,) if stage is SQUARES else (SQUARED,)
    return [result.message for result in ran.results], [item.title for item in diagnose(ran, known)]


def test_one_output_is_returned_by_itself():
    """A stage of one output wants the output, not a tuple of one; lists are read as arrays as everywhere."""
    assert outcome(SQUARES, lambda x: x * x) == (["", "", ""], [])
    assert outcome(SQUARES, lambda x: (x * x).tolist()) == (["", "", ""], [])
    messages, _ = outcome(SQUARES, lambda x: (x * x,))
    assert messages[0].startswith("y has shape (1, 3), expected shape (3,)")


def test_a_mistake_in_one_output_is_named():
    """Wrong versions of a stage of one output return it by itself, too."""
    messages, titles = outcome(SQUARES, lambda x: x + x)
    assert messages[0].startswith("y is off")
    assert titles == ["doubled"]


def test_samples_are_judged_by_their_moments():
    """Any way of drawing from the right distribution passes, in whatever order the draws come."""
    assert outcome(DRAW, draw) == (["", "", "", ""], [])
    assert outcome(DRAW, lambda m, s, rng: m - s * rng.standard_normal(COUNT)[::-1]) == (["", "", "", ""], [])


def test_a_wrong_distribution_is_named():
    """A variance in the place of the deviation is recognised by the moments of other draws."""
    messages, titles = outcome(DRAW, lambda m, s, rng: m + s * s * rng.standard_normal(COUNT)[::-1])
    assert (messages[0], messages[2]) == ("", "")
    assert messages[1].startswith("spread is off")
    assert titles == ["variance as deviation"]


def test_draws_from_elsewhere_are_seen():
    """Right samples from a generator of one's own fail the one check that asks for the given one."""
    own = np.random.default_rng(5)
    messages, _ = outcome(DRAW, lambda m, s, _rng: own.normal(m, s, COUNT))
    assert messages[:2] == ["", ""]
    assert "every draw must come from the generator that is given" in messages[2]


@pytest.mark.parametrize(
    ("returned", "words"),
    [
        (None, "returned None"),
        (np.zeros(3), "expected shape (4000,)"),
        (np.full(COUNT, np.nan), "holds NaN"),
        ("x", "samples"),
    ],
)
def test_no_samples_fail_with_a_reason(returned, words):
    """What is no array of samples is said to be none, and nothing falls over."""
    messages, titles = outcome(DRAW, lambda *_: returned)
    assert all(words in message or "not judged" in message for message in messages)
    assert titles == []
