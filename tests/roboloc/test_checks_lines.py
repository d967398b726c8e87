"""The public checks of the three line stages: what they accept, and how they say what is wrong."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from autograder.misconceptions import of_stage
from roboloc.checks import check, lines
from roboloc_reference import lines as reference

STAGES = (
    "transform_line_to_scanner_frame",
    "normalize_line_parameters",
    "compute_predicted_measurements",
)
ALTERNATIVES = Path(__file__).resolve().parents[1] / "autograder" / "alternatives"


def alternative(name, stage):
    """Load another right way to write a stage."""
    spec = importlib.util.spec_from_file_location(
        f"public_{name}", ALTERNATIVES / "line_measurements" / f"{name}.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return getattr(module, stage)


@pytest.mark.parametrize("stage", STAGES)
def test_correct_functions_pass(stage):
    """Every correct way passes: the reference, loops, complex numbers, homogeneous matrices."""
    functions = [getattr(reference, stage)]
    functions += [alternative(name, stage) for name in ("line_complex", "line_loops", "line_matrices")]
    for function in functions:
        report = check(function)
        assert report, str(report)


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


@pytest.mark.parametrize("stage", STAGES)
def test_wrong_functions_are_told_what_is_wrong(stage):
    """Every mistake in the catalogue fails a public check, which has a message; many fail just the one about them."""
    for item in of_stage(f"lines.{stage}"):
        report = check(item.function, stage=stage)
        failed = {one.name: one.message for one in report.items if one.passed is False}
        assert failed, item.name
        assert all(failed.values()), item.name
        assert FINDINGS.get(item.name, next(iter(failed))) in failed, item.name


def test_every_finding_is_about_a_known_mistake():
    """The table above names no mistake that does not exist."""
    known = {item.name for stage in STAGES for item in of_stage(f"lines.{stage}")}
    assert set(FINDINGS) <= known


def test_each_check_can_fail():
    """No line of the three reports is right by default."""
    failed = {stage: set() for stage in STAGES}
    for stage in STAGES:
        functions = [item.function for item in of_stage(f"lines.{stage}")]

        def short(*arguments):
            return np.zeros(1), np.zeros(1)

        def three_columns_only(*arguments, stage=stage):
            if np.shape(arguments[1])[-1] not in {3, 4}:
                raise ValueError
            return getattr(reference, stage)(*arguments)

        for function in (*functions, short, three_columns_only):
            report = check(function, stage=stage)
            failed[stage] |= {one.name for one in report.items if one.passed is False}
    assert failed["transform_line_to_scanner_frame"] >= {one.name for one in lines.TRANSFORM}
    assert failed["normalize_line_parameters"] >= {one.name for one in lines.NORMALIZE}
    assert failed["compute_predicted_measurements"] >= {
        one.name for one in lines.PREDICTED if one.name != "a map may have one line"
    }


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
    source = Path(lines.__file__).read_text(encoding="utf-8")
    assert "cos(" not in source
    assert "sin(" not in source
