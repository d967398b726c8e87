"""The public checks of the particle filter: what they accept, and how they say what is wrong."""

import numpy as np
import pytest

import kill_matrix
from autograder.checks import STAGES
from autograder.misconceptions import of_stage
from roboloc.checks import check, velocity_cloud

NAMES = {
    "particle.predict": velocity_cloud.PREDICT,
    "particle.correct": velocity_cloud.CORRECT,
    "particle.effective_sample_size": velocity_cloud.EFFECTIVE_SAMPLE_SIZE,
}


@pytest.mark.parametrize("stage", NAMES)
def test_correct_functions_pass(stage):
    """Every correct way passes: the reference, loops, complex numbers."""
    for function in (STAGES[stage].reference, *kill_matrix.alternatives(STAGES[stage]).values()):
        report = check(function, stage=stage)
        assert report, str(report)


def _own(reference):
    """Return a prediction that draws from a generator of its own."""
    own = np.random.default_rng(1)
    return lambda *args: reference(*args[:-1], own)


@pytest.mark.parametrize("stage", NAMES)
def test_wrong_functions_are_told_and_each_check_can_fail(stage):
    """Every mistake in the catalogue fails a public check, which has a message; no line is right by default."""
    drawn = [_own(STAGES[stage].reference)] if stage.endswith("predict") else []
    seen = set()
    for function in (*(item.function for item in of_stage(stage)), *drawn, lambda *_: ()):
        failed = {one.name: one.message for one in check(function, stage=stage).items if one.passed is False}
        assert failed
        assert all(failed.values())
        seen |= set(failed)
    assert seen == {one.name for one in NAMES[stage]}
