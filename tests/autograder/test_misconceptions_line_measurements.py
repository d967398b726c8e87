"""Wrong versions of line measurements, and the diagnosis that names them."""

from __future__ import annotations

import numpy as np
import pytest

from autograder.check import run_stage
from autograder.checks import EXPRESSIONS, STAGES
from autograder.diagnose import ARGUMENTS, diagnose
from autograder.misconceptions import (
    line_measurements,
    line_normalization,
    line_transform,
    of_stage,
    upside_down,
)
from roboloc_reference.lines import (
    compute_predicted_measurements,
    normalize_line_parameters,
    transform_line_to_scanner_frame,
)

COURSE = "a course"
ALL_STAGES = STAGES | {name: expression.stage() for name, expression in EXPRESSIONS.items()}
OURS = (
    line_transform.MISCONCEPTIONS
    + line_normalization.MISCONCEPTIONS
    + line_measurements.MISCONCEPTIONS
    + upside_down.MISCONCEPTIONS
)
TRANSFORM = "lines.transform_line_to_scanner_frame"
NORMALIZE = "lines.normalize_line_parameters"
PREDICTED = "lines.compute_predicted_measurements"


def found(stage, function):
    """Diagnose a function: pairs of title and outputs."""
    outcome = run_stage(ALL_STAGES[stage], function, COURSE)
    return [(item.title, item.outputs) for item in diagnose(outcome, of_stage(stage))]


@pytest.mark.parametrize("item", OURS, ids=lambda item: f"{item.stage}-{item.name}")
def test_wrong_versions_return_numbers_of_the_right_shape(item):
    """A wrong version differs by its fault alone: right shapes, finite numbers."""
    stage = ALL_STAGES[item.stage]
    for call in run_stage(stage, stage.reference, COURSE).calls:
        returned = item.function(*(np.copy(a) if isinstance(a, np.ndarray) else a for a in call.args))
        right = stage.reference(*call.args)
        assert [np.shape(value) for value in returned] == [np.shape(value) for value in right]
        assert all(np.isfinite(value).all() for value in returned)


def test_every_stage_has_enough_wrong_versions():
    """At least four of each stage and two of each symbolic answer, all with words, no name twice."""
    assert all(len(of_stage(name)) >= 4 for name in (TRANSFORM, NORMALIZE, PREDICTED))
    assert all(len(of_stage(name)) >= 2 for name in EXPRESSIONS if name.startswith("upside_down"))
    assert len({(item.stage, item.name) for item in OURS}) == len(OURS)
    assert all(len(item.explanation) > 60 and len(item.hint) > 20 for item in OURS)


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

    outcome = run_stage(ALL_STAGES[PREDICTED], odd, COURSE)
    assert not any(item.known for item in diagnose(outcome, of_stage(PREDICTED)))
