"""The public checks of the bootstrap filter: what they accept, and how they say what is wrong."""

import numpy as np
import pytest
from public import Public, words_in, writes

from autograder.checks import STAGES as GRADED
from roboloc.checks import STAGES as CHECKS
from roboloc.checks import bootstrap, check, resampling

STAGES = (
    "odometry.sample_motion",
    "odometry.bearing_likelihood",
    "resampling.systematic_resample",
    "odometry.bootstrap_step",
)
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
PUBLIC = Public(STAGES, FINDINGS)


def _own(reference):
    """Return a stage that draws from a generator of its own."""
    own = np.random.default_rng(1)
    return lambda *args: reference(*args[:-1], own)


@pytest.mark.parametrize("stage", STAGES)
def test_right_functions_pass_and_wrong_ones_are_told(stage):
    """Correct ways pass, every known mistake fails a check, which has a message, and no line is right by default."""
    reference = GRADED[stage].reference
    drawn = any("rng" in one.name for one in CHECKS[stage])
    PUBLIC.hold(stage, writes(reference, where=0), *([_own(reference)] if drawn else []))


def test_indices_beyond_the_particles_are_said_to_be_none():
    """Indices counted from 1 are told where indices begin and end."""
    report = check(lambda ws, _: np.arange(len(ws)) + 1, stage="systematic_resample")
    assert "go from 0 to 6" in report.items[0].message


def test_no_answer_is_stored():
    """No wrap, arctangent of a landmark, search or draw of the answer is in the checks of the step and the comb."""
    words = "arctan2 searchsorted cumsum standard_normal cos("
    assert words_in(words, bootstrap, resampling) == []
