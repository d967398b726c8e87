"""Wrong versions of a map that grows, and the diagnosis that names them."""

from __future__ import annotations

import numpy as np
from diagnosis import found, observed

from autograder.diagnose import ARGUMENTS
from autograder.misconceptions import augmentation
from autograder.misconceptions import line_in_world as wrong_lines
from roboloc_reference.new_lines import line_in_world, recognize
from roboloc_reference.slam import augment

WORLD, AUGMENT, RECOGNIZE = "slam.line_in_world", "slam.augment", "slam.recognize"


def test_right_functions_have_no_diagnosis():
    """Nothing is said about functions that pass."""
    assert found(WORLD, line_in_world) == []
    assert found(AUGMENT, augment) == []
    assert found(RECOGNIZE, recognize) == []


def test_three_mistakes_in_three_outputs_are_all_named():
    """A bare absolute value, the signs of the prediction and a missing lever are each named for their output."""

    def three(*args):
        line = wrong_lines.not_wrapped(*args)[0]
        by_pose = wrong_lines.derivative_of_the_prediction(*args)[1]
        return line, by_pose, wrong_lines.observation_without_lever(*args)[2]

    assert found(WORLD, three) == [
        ("new angle not wrapped", ("line",)),
        ("sign of the prediction", ("by_pose",)),
        ("r taken not to follow the angle that is seen", ("by_z",)),
    ]


def test_a_mistake_and_an_overwritten_argument_are_both_named():
    """A line that is independent of all else, and a Q that is changed on the way."""

    def both(*args):
        right = augmentation.zero_cross_covariance(*args)
        augmentation.covariance_overwritten(*args)
        return right

    assert found(AUGMENT, both) == [
        ("new line independent", ("Sigma",)),
        ("the caller's Q overwritten", (ARGUMENTS,)),
    ]


def test_no_name_for_what_only_looks_alike():
    """Cross-covariances that are too small by a tenth are not those that were left out."""

    def odd(*args):
        state, grown = augment(*args)
        grown[-2:, :-2] *= 0.9
        grown[:-2, -2:] *= 0.9
        return state, np.array(grown)

    observed(AUGMENT, odd)  # asserts that nothing known is seen
