"""Wrong versions of SLAM with lines, and the diagnosis that names them."""

from __future__ import annotations

import numpy as np
from diagnosis import found, observed

from autograder.diagnose import ARGUMENTS
from autograder.misconceptions import slam_lines, slam_motion
from autograder.misconceptions.motion_model import euler_step
from roboloc_reference.slam import compute_predicted_measurements, transition_model

TRANSITION = "slam.transition_model"
PREDICTED = "slam.compute_predicted_measurements"


def test_right_functions_have_no_diagnosis():
    """Nothing is said about functions that pass."""
    assert found(TRANSITION, transition_model) == []
    assert found(PREDICTED, compute_predicted_measurements) == []


def test_three_mistakes_in_three_outputs_are_all_named():
    """Lines that turn, an identity lost, and noise on the lines are each named for their output."""

    def three(x, u, dt):
        g = slam_motion.lines_turn_with_the_robot(x, u, dt)[0]
        Gx = slam_motion.lines_forgotten(x, u, dt)[1]
        return g, Gx, slam_motion.control_turns_the_lines(x, u, dt)[2]

    assert found(TRANSITION, three) == [
        ("lines turned with the robot", ("g",)),
        ("derivative of the lines 0", ("Gx",)),
        ("lines turned by the control", ("Gu",)),
    ]


def test_a_mistake_and_an_overwritten_state_are_both_named():
    """Padding with zeros and writing to the state have both their name."""

    def both(x, tf, fixed=2):
        hs, Hs = slam_lines.padded_with_zeros(x, tf, fixed)
        slam_lines.state_overwritten(x, tf, fixed)
        return hs, Hs

    assert found(PREDICTED, both) == [
        ("map taken for certain", ("Hs",)),
        ("the caller's lines overwritten", (ARGUMENTS,)),
    ]


def test_a_motion_of_another_notebook_is_not_given_a_name_of_this_one():
    """A straight step of the pose beside right lines is observed, not taken for a mistake about lines."""

    def straight(x, u, dt):
        g, Gx, Gu = transition_model(x, u, dt)
        for whole, part in zip((g, Gx, Gu), euler_step(x[:3], u, dt), strict=True):
            whole[tuple(map(slice, np.shape(part)))] = part
        return g, Gx, Gu

    observed(TRANSITION, straight)  # asserts that nothing known is seen


def test_no_name_for_what_only_looks_alike():
    """A function that is right but for an unknown fault is not given a known mistake's name."""

    def odd(x, tf, fixed=2):
        hs, Hs = compute_predicted_measurements(x, tf, fixed)
        return hs, Hs * np.where(np.arange(len(x)) < 3, 1.0, 1.1)

    observed(PREDICTED, odd)
