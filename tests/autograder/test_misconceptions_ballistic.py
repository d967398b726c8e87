"""Wrong versions of the bouncing ball, and the diagnosis that names them."""

from __future__ import annotations

import numpy as np
import pytest

from autograder.check import copied, run_stage
from autograder.checks import EXPRESSIONS, STAGES
from autograder.diagnose import diagnose
from autograder.misconceptions import ball_correction, ball_on_a_slope, ball_prediction, of_stage
from roboloc_reference.ballistic import correct, motion, predict

COURSE = "a course"
ALL_STAGES = STAGES | {name: expression.stage() for name, expression in EXPRESSIONS.items()}
OURS = ball_prediction.MISCONCEPTIONS + ball_correction.MISCONCEPTIONS + ball_on_a_slope.MISCONCEPTIONS
PREDICT, CORRECT = "ballistic.predict", "ballistic.correct"


def found(stage, function):
    """Diagnose a function: pairs of title and outputs."""
    outcome = run_stage(ALL_STAGES[stage], function, COURSE)
    return [(item.title, item.outputs) for item in diagnose(outcome, of_stage(stage))]


@pytest.mark.parametrize("item", OURS, ids=lambda item: f"{item.stage}-{item.name}")
def test_wrong_balls_return_numbers_of_the_right_shape(item):
    """A wrong version differs by its fault alone: right shapes, finite numbers."""
    stage = ALL_STAGES[item.stage]
    for call in run_stage(stage, stage.reference, COURSE).calls:
        if not item.determined(*call.args):
            continue
        returned, right = item.function(*copied(call.args)), stage.reference(*call.args)
        assert [np.shape(value) for value in returned] == [np.shape(value) for value in right]
        assert all(np.isfinite(value).all() for value in returned)


def test_every_wrong_ball_has_words():
    """Each has an explanation and a hint of some length, and no name is there twice."""
    assert len({item.name for item in OURS}) == len(OURS)
    assert all(len(item.explanation) > 60 and len(item.hint) > 20 for item in OURS)


def test_the_right_loop_behind_the_wrong_versions_is_right():
    """The loop that the wrong versions are made from is the reference, as long as nothing is spoilt."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        x = rng.uniform([-2, 0.5, -2, -2], [2, 3, 2, 2])
        dt, g, e = rng.uniform(0, 3), rng.uniform(6, 15), rng.uniform(0.5, 0.95)
        state, J = ball_prediction._journey(x, dt, g, e, ball_prediction.saltation)
        right, slope = motion(x, dt, g, e)
        np.testing.assert_allclose(state, right, atol=1e-8)
        np.testing.assert_allclose(J, slope, atol=1e-6)


def test_mistakes_in_mean_and_covariance_are_both_named():
    """A mean without restitution beside a covariance of the jump alone: each output has its own name."""
    jump = next(item for item in of_stage(PREDICT) if item.name == "Jacobian of the jump alone")
    late = next(item for item in of_stage(PREDICT) if item.name == "first impact only")

    def both(*args):
        return late.function(*copied(args))[0], jump.function(*copied(args))[1]

    assert found(PREDICT, both) == [("first impact only", ("x",)), ("Jacobian of the jump alone", ("Sigma",))]


def test_a_right_ball_has_no_diagnosis():
    """Nothing is said about functions that pass."""
    assert found(PREDICT, lambda *args: tuple(value.tolist() for value in predict(*args))) == []
    assert found(CORRECT, correct) == []


def test_an_unknown_mistake_is_located():
    """A mistake that nobody knows is described by where it is: here the place along the ground."""

    def stays(x, Sigma, dt, gravity, restitution, Q):
        after, Sigma = predict(x, Sigma, dt, gravity, restitution, Q)
        return np.array([x[0], *after[1:]]), Sigma

    outcome = run_stage(STAGES[PREDICT], stays, COURSE)
    (item,) = diagnose(outcome, of_stage(PREDICT))
    assert not item.known
    assert "px" in item.explanation
