"""The public checks of the bouncing ball: what they accept, and how they say what is wrong."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from autograder.misconceptions import of_stage
from roboloc.checks import ballistic, check
from roboloc_reference import ballistic as reference

STAGES = {"predict": ballistic.PREDICT, "correct": ballistic.CORRECT}
ALTERNATIVES = Path(__file__).resolve().parents[1] / "autograder" / "alternatives" / "ballistic"


def alternative(name, stage):
    """Load another right way to write a stage."""
    spec = importlib.util.spec_from_file_location(f"public_{name}", ALTERNATIVES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return getattr(module, stage)


@pytest.mark.parametrize("stage", STAGES)
def test_right_balls_pass(stage):
    """Every correct way passes: the reference, a closed form, differences, a list of events."""
    functions = [getattr(reference, stage)]
    functions += [
        alternative(name, stage) for name in ("ball_closed_form", "ball_differences", "ball_events")
    ]
    for function in functions:
        report = check(function, stage=f"ballistic.{stage}")
        assert report, str(report)


# What each mistake must be told by, at least: the name of one check.
FINDINGS = {
    "Jacobian of the jump alone": "Sigma follows the mean, through an impact",
    "covariance of a ball that never lands": "Sigma follows the mean, through an impact",
    "sign of the delay": "Sigma follows the mean, through three",
    "slowed down along the ground too": "bounces once, to a quarter of the height",
    "flight through the ground": "bounces once, to a quarter of the height",
    "impact at the end of the step": "two steps are one",
    "first impact only": "bounces twice in one step",
    "mean multiplied by the Jacobian": "falls",
    "doubt about a ball at rest": "comes to rest",
    "start below the ground": "starts below the ground as on the ground",
    "Jacobian transposed": "Sigma follows the mean, in the air",
    "Q multiplied by dt": "Q is added once",
    "the caller's covariance overwritten by the prediction": "leaves its arguments as they were",
    "position corrected and velocity not": "the velocity is corrected along",
    "error of the camera left out": "a useless camera changes nothing",
    "error of the camera in the place of S": "a sharp camera is believed",
    "each direction on its own": "two numbers together are two one by one",
    "state in another order": "seen as expected, the ball stays",
    "height cut off at the ground": "a ball may be a little below the ground",
    "covariance larger after the picture": "Sigma is symmetric and grows in no direction",
    "the caller's mean overwritten by the correction": "leaves its arguments as they were",
}


@pytest.mark.parametrize("stage", STAGES)
def test_wrong_balls_are_told_what_is_wrong(stage):
    """Every mistake in the catalogue fails a public check, which has a message."""
    for item in of_stage(f"ballistic.{stage}"):
        report = check(item.function, stage=f"ballistic.{stage}")
        failed = {one.name: one.message for one in report.items if one.passed is False}
        assert failed, item.name
        assert all(failed.values()), item.name
        assert FINDINGS.get(item.name, next(iter(failed))) in failed, item.name


def test_every_finding_is_about_a_known_mistake_of_the_ball():
    """The table above names no mistake that does not exist."""
    assert set(FINDINGS) <= {item.name for stage in STAGES for item in of_stage(f"ballistic.{stage}")}


@pytest.mark.parametrize("stage", STAGES)
def test_each_check_of_the_ball_can_fail(stage):
    """No line of the reports is right by default."""

    def short(*_):
        return np.zeros(1), np.zeros(1)

    def elastic_only_lost(x, Sigma, dt, gravity, restitution, Q):
        return reference.predict(x, Sigma, dt, gravity, min(restitution, 0.99), Q)

    functions = [item.function for item in of_stage(f"ballistic.{stage}")] + [short]
    if stage == "predict":
        functions.append(elastic_only_lost)
    failed = set()
    for function in functions:
        report = check(function, stage=f"ballistic.{stage}")
        failed |= {one.name for one in report.items if one.passed is False}
    assert failed == {one.name for one in STAGES[stage]}


def test_no_answer_of_the_ball_is_stored():
    """No flight, no root and no gain stands in the checks."""
    source = Path(ballistic.__file__).read_text(encoding="utf-8")
    for word in ("sqrt(", "solve(", "inv(", "roboloc_reference"):
        assert word not in source
