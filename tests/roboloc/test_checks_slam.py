"""The public checks of SLAM with lines: what they accept, and how they say what is wrong."""

import numpy as np
import pytest
from public import Public, words_in

from autograder.misconceptions import of_stage
from roboloc.checks import check, slam
from roboloc_reference import slam as reference

STAGES = ("slam.transition_model", "slam.compute_predicted_measurements")
# What each mistake must be told by, at least: the name of one check.
FINDINGS = {
    "lines turned with the robot": "the walls stand still",
    "derivative of the lines 0": "Gx agrees with small changes of the state",
    "identity of the lines times dt": "Gx agrees with small changes of the state",
    "identity for the pose too": "Gx agrees with small changes of the state",
    "heading looked for at the end": "Gx agrees with small changes of the state",
    "lines turned by the control": "Gu agrees with small changes of the control",
    "pose taken from the end of the state": "the walls stand still",
    "lines wrapped": "the walls stand still",
    "the caller's state overwritten": "leaves its arguments as they were",
    "map taken for certain": "Hs agrees with small changes of the lines",
    "distance taken not to follow alpha": "Hs agrees with small changes of the lines",
    "sign of the derivative by alpha": "Hs agrees with small changes of the lines",
    "lever of the robot's centre": "Hs agrees with small changes of the lines",
    "block of the line not normalised": "Hs agrees with small changes of the lines",
    "all blocks in one place": "Hs agrees with small changes of the lines",
    "numbers fixed, not lines": "the first lines are fixed, and no others",
    "nothing fixed": "the first lines are fixed, and no others",
    "last lines fixed": "the first lines are fixed, and no others",
    "fixed lines teach nothing": "fixed lines are seen like others",
    "the caller's lines overwritten": "leaves its arguments as they were",
}
PUBLIC = Public(STAGES, FINDINGS)


@pytest.mark.parametrize("stage", STAGES)
def test_right_functions_pass_and_wrong_ones_are_told(stage):
    """Correct ways pass, every known mistake fails a check, which has a message, and no line is right by default."""
    right = getattr(reference, stage.removeprefix("slam."))

    def eight_numbers_at_least(x, *others):
        if len(x) < 8:
            raise ValueError
        return right(x, *others)

    def closed_form(x, u, dt):
        g, Gx, Gu = right(x, u, dt)
        return g + (abs(u[1]) < 1e-5) * (u[1] != 0), Gx, Gu

    def elsewhere(x, *others):
        first, *rest = right(x, *others)
        return first + 1.0, *rest

    def negative(x, *others):
        first, *rest = right(x, *others)
        return np.array(first) * np.reshape([1, -1], (2, *[1] * (np.ndim(first) - 1))), *rest

    last = closed_form if stage == "slam.transition_model" else negative
    PUBLIC.hold(stage, eight_numbers_at_least, elsewhere, last)
    assert {item.name for item in of_stage(stage)} <= set(FINDINGS)  # each mistake has its check


def test_the_name_alone_means_the_older_stage():
    """Two stages are called compute_predicted_measurements: without a stage, the check is that of line-measurements."""
    report = check(reference.compute_predicted_measurements)
    assert report.items[0].name == "returns hs (2, J), Hs (J, 2, 3)"
    assert not report


def test_no_answer_is_stored():
    """The sines and cosines of the answer are not in the checks."""
    assert words_in("cos( sin(", slam) == []
