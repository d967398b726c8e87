"""The public checks of the three line stages: what they accept, and how they say what is wrong."""

import numpy as np
import pytest
from public import Public, words_in

from roboloc.checks import check, lines
from roboloc_reference import lines as reference

STAGES = (
    "lines.transform_line_to_scanner_frame",
    "lines.normalize_line_parameters",
    "lines.compute_predicted_measurements",
)
# What each mistake must be told by, at least: the name of one check.
FINDINGS = {
    "scanner taken to be at the robot's centre": "a scanner in front is nearer to what is ahead",
    "mounting not turned with the robot": "the scanner turns with the robot",
    "x_cam in the row of y": "points of the wall are on the line h",
    "heading of the mounting forgotten": "a scanner that looks back sees it behind",
    "heading added": "after a turn to the left the wall is on the right",
    "derivative by the heading without the lever arm": "Hx agrees with small changes of the pose",
    "sign of the derivative of the distance": "Hx agrees with small changes of the pose",
    "normalised too early": "beyond the wall r is negative",
    "the caller's line overwritten": "leaves its arguments as they were",
    "bare absolute value": "the line is the same line",
    "derivative of r not flipped": "Hx follows the line that is returned",
    "angle from 0 to 2 pi": "keeps a line that is normalised",
    "angle wrapped by one turn at most": "alpha is in one turn",
    "r left negative": "r is not negative",
    "sign of 0": "a line through the scanner keeps its Hx",
    "the caller's derivative overwritten": "leaves its arguments as they were",
    "one line for all": "each prediction belongs to its own line",
    "predictions not normalised": "every line is normalised",
    "bare absolute value of a crossed line": "walls that were crossed are on the other side",
    "derivatives not normalised": "Hs agrees with small changes of the pose",
    "mounting ignored": "four walls of a room, scanner mounted elsewhere",
    "the caller's map overwritten": "leaves its arguments as they were",
}
PUBLIC = Public(STAGES, FINDINGS)


@pytest.mark.parametrize("stage", STAGES)
def test_right_functions_pass_and_wrong_ones_are_told(stage):
    """Correct ways pass, every known mistake fails a check, which has a message, and no line is right by default."""
    right = getattr(reference, stage.removeprefix("lines."))

    def three_columns_only(*arguments):
        if np.shape(arguments[1])[-1] not in {3, 4}:
            raise ValueError
        return right(*arguments)

    one = {"a map may have one line"} if stage == "lines.compute_predicted_measurements" else ()
    others = [] if stage == "lines.transform_line_to_scanner_frame" else [three_columns_only]
    PUBLIC.hold(stage, lambda *_: (np.zeros(1), np.zeros(1)), *others, seen=one)
    assert check(right)  # by its own name


def test_a_map_of_one_line_must_keep_its_axes():
    """A function that squeezes a single line is told so."""

    def squeezed(*arguments):
        return tuple(value.squeeze() for value in reference.compute_predicted_measurements(*arguments))

    report = check(squeezed, stage="compute_predicted_measurements")
    (item,) = [one for one in report.items if one.passed is False]
    assert item.name == "a map may have one line"
    assert "shape" in item.message


def test_no_answer_is_stored():
    """The sines and cosines of the answer are not in the checks."""
    assert words_in("cos( sin(", lines) == []
