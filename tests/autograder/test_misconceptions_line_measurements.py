"""Wrong versions of line measurements, and the diagnosis that names them."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis import found, observed

from autograder.diagnose import ARGUMENTS
from autograder.misconceptions import (
    line_measurements,
    line_normalization,
    line_transform,
)
from roboloc_reference.lines import (
    compute_predicted_measurements,
    normalize_line_parameters,
    transform_line_to_scanner_frame,
)

TRANSFORM = "lines.transform_line_to_scanner_frame"
NORMALIZE = "lines.normalize_line_parameters"
PREDICTED = "lines.compute_predicted_measurements"


def test_the_faults_of_the_sources_are_there():
    """ERRATA A4 and A5 are wrong versions, with the numbers that prove them wrong."""
    line, pose, tf = np.array([0.0, 1.0]), np.array([3.0, 0.5, 0.2]), np.array([-0.128, 0.0, 0.0])
    h, Hx = transform_line_to_scanner_frame(line, pose, tf)
    bare, slope = line_normalization.bare_absolute_value(h, Hx)
    assert bare.round(4).tolist() == [-0.2, 1.8746]
    assert np.array_equal(slope, Hx)
    assert normalize_line_parameters(h, Hx)[0].round(4).tolist() == [2.9416, 1.8746]
    line, tf = np.array([np.pi / 2, 2.0]), np.array([0.3, 0.1, 0.0])
    wrong, _ = line_transform.x_cam_in_the_row_of_y(line, np.zeros(3), tf)
    assert wrong[1] == pytest.approx(2.0 - 0.3)  # and 2.0 - 0.1 is right


def test_a_right_function_has_no_diagnosis():
    """Nothing is said about functions that pass, in whatever turn and under whatever name of a line."""

    def turned(*args):
        h, Hx = transform_line_to_scanner_frame(*args)
        return h - [4 * np.pi, 0], Hx

    def other_name(h, Hx):
        line, slope = normalize_line_parameters(h, Hx)
        if line[1] < 1e-12:
            return [(line[0] + 2 * np.pi) % (2 * np.pi) - np.pi, -line[1]], np.diag([1, -1]) @ slope
        return line, slope

    assert found(TRANSFORM, turned) == []
    assert found(NORMALIZE, other_name) == []


def test_a_mistake_is_recognised_in_another_turn():
    """A scanner that is taken to be at the centre is named though the angle is two turns on."""

    def turned(*args):
        h, Hx = line_transform.offset_ignored(*args)
        return [h[0] + 4 * np.pi, h[1]], Hx.tolist()

    assert found(TRANSFORM, turned) == [("scanner taken to be at the robot's centre", ("h", "Hx"))]


def test_half_of_a_mistake_has_its_own_name():
    """Of the bare absolute value each half is named for itself; at r = 0 a kept angle leaves the wrong row."""
    assert found(NORMALIZE, line_normalization.bare_absolute_value) == [("bare absolute value", ("h", "Hx"))]
    assert found(NORMALIZE, line_normalization.row_not_flipped) == [("derivative of r not flipped", ("Hx",))]
    assert found(NORMALIZE, line_normalization.angle_not_shifted) == [("angle not shifted", ("h", "Hx"))]


def test_two_mistakes_in_two_outputs_are_both_named():
    """A forgotten heading of the mounting and a forgotten lever arm give both names."""

    def both(*args):
        h, _ = line_transform.mounting_heading_forgotten(*args)
        return h, line_transform.lever_forgotten(*args)[1]

    assert found(TRANSFORM, both) == [
        ("heading of the mounting forgotten", ("h",)),
        ("derivative by the heading without the lever arm", ("Hx",)),
    ]


def test_a_mistake_and_a_changed_argument_are_both_named():
    """Derivatives that are not normalised, and a map that is overwritten, give both names."""

    def both(x, map_lines, tf):
        hs, Hs = line_measurements.derivatives_not_normalized(x, map_lines, tf)
        map_lines[...] = hs
        return hs, Hs

    assert found(PREDICTED, both) == [
        ("derivatives not normalised", ("Hs",)),
        ("the caller's map overwritten", (ARGUMENTS,)),
    ]


def test_no_name_for_what_only_looks_alike():
    """A function that is right but for an unknown fault is not given a known mistake's name."""

    def odd(*args):
        hs, Hs = compute_predicted_measurements(*args)
        Hs[:, 1, 0] *= 1.5
        return hs, Hs

    observed(PREDICTED, odd)  # asserts that nothing known is seen
