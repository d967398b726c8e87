"""The public checks of the bootstrap filter: what they accept, and how they say what is wrong."""

from pathlib import Path

import numpy as np
import pytest

import kill_matrix
from autograder.checks import STAGES
from autograder.misconceptions import of_stage
from roboloc.checks import bootstrap, check, odometry, resampling

NAMES = {
    "odometry.sample_motion": odometry.SAMPLE_MOTION,
    "odometry.bearing_likelihood": odometry.BEARING_LIKELIHOOD,
    "resampling.systematic_resample": resampling.SYSTEMATIC_RESAMPLE,
    "odometry.bootstrap_step": bootstrap.BOOTSTRAP_STEP,
}
# What a mistake must be told by, at least: the name of one check.
FINDINGS = {
    "turns counted clockwise": "ways without error",
    "turns that cancel": "turns to either side count alike",
    "turns and ways with their signs": "turns to either side count alike",
    "spread taken for a variance": "spreads of one error at a time",
    "spread squared": "spreads of one error at a time",
    "one error for all particles": "every particle and every control errs for itself",
    "one number for three errors": "every particle and every control errs for itself",
    "particles moved in place": "leaves its arguments as they were",
    "innovation not wrapped": "behind the robot and after whole turns",
    "wrapped before the difference": "behind the robot and after whole turns",
    "density without its factor": "the density adds up to 1",
    "sigma taken for the variance": "the density has the right width",
    "headings wrapped in place": "leaves its arguments as they were",
    "particles overwritten while copying": "combs worked by hand",
    "sum of the weights taken for 1": "the sum of the weights does not matter",
    "run past the end": "the largest offset leads to the last particle",
    "weight of 0 taken": "no particle of weight 0 is taken",
    "offset divided once more": "and exactly so on average over all offsets",
    "weights normalised in place": "leaves its arguments as they were",
    "earlier weights left out": "earlier weights count",
    "weights kept beside the copies": "all weigh 1/M afterwards",
    "bearing not wrapped in the step": "the particle that explains the bearing survives",
    "errors drawn after the weighing": "the bearing weighs the errors",
    "particles moved without error": "particles err",
}


@pytest.mark.parametrize("stage", NAMES)
def test_correct_functions_pass(stage):
    """Every correct way passes: the reference, loops, complex numbers, matrices, searches."""
    for function in (STAGES[stage].reference, *kill_matrix.alternatives(STAGES[stage]).values()):
        report = check(function, stage=stage)
        assert report, str(report)


@pytest.mark.parametrize("stage", NAMES)
def test_wrong_functions_are_told_what_is_wrong(stage):
    """Every mistake in the catalogue fails a public check, which has a message."""
    for item in of_stage(stage):
        report = check(item.function, stage=stage)
        failed = {one.name: one.message for one in report.items if one.passed is False}
        assert failed, item.name
        assert all(failed.values()), item.name
        assert FINDINGS.get(item.name, next(iter(failed))) in failed, item.name


def test_every_finding_is_about_a_known_mistake():
    """The table above names no mistake that does not exist."""
    assert set(FINDINGS) <= {item.name for stage in NAMES for item in of_stage(stage)}


def _own(reference):
    """Return a stage that draws from a generator of its own."""
    own = np.random.default_rng(1)
    return lambda *args: reference(*args[:-1], own)


def _written(reference):
    """Return a stage that writes to what it got."""

    def writes(*args):
        result = reference(*args)
        args[0][0] += 1.0
        return result

    return writes


@pytest.mark.parametrize("stage", NAMES)
def test_each_check_can_fail(stage):
    """No line of the report is right by default."""
    reference = STAGES[stage].reference
    drawn = any("rng" in one.name for one in NAMES[stage])
    others = (lambda *_: (), _written(reference), *([_own(reference)] if drawn else []))
    failed = set()
    for function in (*(item.function for item in of_stage(stage)), *others):
        failed |= {one.name for one in check(function, stage=stage).items if one.passed is False}
    assert failed == {one.name for one in NAMES[stage]}


def test_indices_beyond_the_particles_are_said_to_be_none():
    """Indices counted from 1 are told where indices begin and end."""
    report = check(lambda ws, _: np.arange(len(ws)) + 1, stage="systematic_resample")
    assert "go from 0 to 6" in report.items[0].message


def test_no_answer_is_stored():
    """No wrap, arctangent of a landmark, search or draw of the answer is in the checks of the step and the comb."""
    for module in (bootstrap, resampling):
        source = Path(module.__file__).read_text(encoding="utf-8")
        assert not any(
            word in source for word in ("arctan2", "searchsorted", "cumsum", "standard_normal", "cos(")
        )
