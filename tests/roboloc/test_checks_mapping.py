"""The public checks of a map that grows: what they accept, and how they say what is wrong."""

import numpy as np
import pytest
from public import Public, words_in, writes

from autograder.checks import STAGES as GRADED
from roboloc.checks import mapping

STAGES = ("slam.line_in_world", "slam.augment", "slam.recognize")
PUBLIC = Public(STAGES, {})


@pytest.mark.parametrize("stage", STAGES)
def test_right_functions_pass_and_wrong_ones_are_told(stage):
    """Correct ways pass, every known mistake fails a check, which has a message, and no line is right by default."""
    reference = GRADED[stage].reference

    def with_a_map_alone(*arguments):
        if len(arguments[0]) == 3 or 0 in np.shape(arguments[2]):
            raise ValueError
        return reference(*arguments)

    def negative(*arguments):
        x, Sigma = reference(*arguments)
        return x, -Sigma

    def elsewhere(*arguments):
        line, *rest = reference(*arguments)
        return line + 1.0, *rest

    others = {
        "slam.line_in_world": [elsewhere],
        "slam.augment": [with_a_map_alone, negative],
        "slam.recognize": [with_a_map_alone],
    }
    PUBLIC.hold(stage, writes(reference, where=0), *others[stage], lambda *_: 7)


def test_no_answer_is_stored():
    """The sines and cosines of the answer are not in the checks."""
    assert words_in("cos( sin(", mapping) == []
