"""What feedback says of mistakes that nobody knows: each kind is located, and what is right is left alone."""

import numpy as np
import pytest
from diagnosis import COURSE

from autograder.check import run_stage
from autograder.checks import STAGES
from autograder.diagnose import diagnose

DYNAMICS, TRANSITION = "motion.compute_dynamics", "gaussian.transition_update"
PREDICT, FIT = "ballistic.predict", "extraction.fit_line"
DEGREES = 180 / np.pi
SEVERAL = [name for name, stage in STAGES.items() if len(stage.outputs) > 1 and not stage.summary]


def changed(stage, index, how):
    """Make the right function of a stage, with one output changed."""

    def function(*args):
        outputs = list(STAGES[stage].reference(*args))
        outputs[index] = how(outputs[index])
        return tuple(outputs)

    return function


def seen(stage, function):
    """Diagnose a function as if no mistake had a name: the sentences."""
    return [item.explanation for item in diagnose(run_stage(STAGES[stage], function, COURSE), ())]


@pytest.mark.parametrize(
    ("stage", "index", "how", "sentence"),
    [
        (
            DYNAMICS,
            0,
            lambda g: g * [1, 1, DEGREES],
            "Entry [2] (theta) of g: in degrees, where radians are meant.",
        ),
        (
            DYNAMICS,
            0,
            lambda g: g * [1e3, 1e3, 1],
            "Entries [0] (x), [1] (y) of g: in millimetres, where metres are meant.",
        ),
        (FIT, 2, lambda C: C * np.outer([DEGREES, 1], [DEGREES, 1]), "in degrees, where radians are meant."),
        (FIT, 2, lambda C: C * np.outer([1, 1e3], [1, 1e3]), "in millimetres, where metres are meant."),
        (
            FIT,
            2,
            lambda C: C / np.outer([1, 1e3], [1, 1e3]),
            "as if a length in metres had been taken for",
        ),
        (DYNAMICS, 0, lambda g: np.add(g, [0, 0, 2 * np.pi]), "Entry [2] (theta) of g: off by whole turns."),
        (
            DYNAMICS,
            0,
            lambda g: g - [0, 0, 4 * np.pi * (g[0] > 0)],
            "Entry [2] (theta) of g: off by whole turns.",
        ),
        (DYNAMICS, 1, np.transpose, "Gx is the transpose of the right matrix."),
        (DYNAMICS, 2, np.transpose, "Gu is the transpose of the right matrix."),
        (DYNAMICS, 2, np.ravel, "The numbers of Gu are right, but not their shape."),
        (FIT, 0, lambda alpha: [alpha], "The numbers of alpha are right, but not their shape."),
        (
            PREDICT,
            1,
            lambda S: S + 0.3 * np.triu(np.ones((4, 4)), 1),
            "Sigma is not symmetric, and a covariance is.",
        ),
        (TRANSITION, 1, lambda S: S + np.triu(S, 1), "Sigma is not symmetric, and a covariance is."),
        (
            PREDICT,
            1,
            lambda S: S - np.trace(S) * np.eye(4),
            "Sigma has a negative eigenvalue",
        ),
        (
            TRANSITION,
            1,
            lambda S: S - np.trace(S) * np.eye(len(S)),
            "Sigma has a negative eigenvalue",
        ),
    ],
)
def test_each_kind_of_mistake_is_seen(stage, index, how, sentence):
    """The one sentence about the one output says what kind of mistake it is, and where."""
    (found,) = seen(stage, changed(stage, index, how))
    assert sentence in found


def test_global_random_numbers_are_seen():
    """A result that is drawn, or that goes by what an earlier call left, is said to depend on something else."""
    rng, calls = np.random.default_rng(3), []

    def drawn(g):
        return g + rng.normal(0.0, 0.1, 3)

    def counted(g):
        calls.append(g)
        return g + 0.1 * len(calls)

    for how in (drawn, counted):
        (found,) = seen(DYNAMICS, changed(DYNAMICS, 0, how))
        assert found.startswith("The same arguments gave two different results for g.")
        assert "random numbers" in found


def test_a_turn_that_is_not_whole_is_no_turn():
    """An angle that is off by any other amount is not said to be a matter of wrapping."""
    (found,) = seen(DYNAMICS, changed(DYNAMICS, 0, lambda g: np.add(g, [0, 0, 6.28])))
    assert "turns" not in found
    assert "entry [2] (theta)" in found


@pytest.mark.parametrize(
    "name", [name for name, stage in STAGES.items() if len(stage.outputs) > 1 and not stage.summary]
)
def test_what_is_right_is_left_alone(name):
    """Where one output is wrong by a factor nothing is said of the others, and of that one nothing but the factor."""
    stage = STAGES[name]
    for index, output in enumerate(stage.outputs):
        wrong = changed(name, index, lambda value: np.multiply(value, 1.37))
        found = diagnose(run_stage(stage, wrong, COURSE), ())
        assert {item.outputs for item in found} <= {(output,)}
        assert all("same factor" in item.explanation or "only" in item.explanation for item in found)
    assert diagnose(run_stage(stage, stage.reference, COURSE), ()) == ()
