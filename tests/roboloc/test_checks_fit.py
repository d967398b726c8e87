"""The public checks of the line fit: what they accept, and how they say what is wrong."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from autograder.checks import STAGES
from autograder.misconceptions import of_stage
from roboloc.checks import check, fit

NAMES = {
    "line_parameters": fit.PARAMETERS,
    "line_jacobians": fit.JACOBIANS,
    "fit_line": fit.FIT,
}
ALTERNATIVES = Path(__file__).resolve().parents[1] / "autograder" / "alternatives" / "fit_a_line"


def alternative(name, stage):
    """Load another right way to write a stage."""
    spec = importlib.util.spec_from_file_location(f"public_{name}", ALTERNATIVES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return getattr(module, stage)


@pytest.mark.parametrize("stage", NAMES)
def test_correct_functions_pass(stage):
    """Every correct way passes: the reference, loops, complex numbers, matrices, differences."""
    functions = [STAGES[f"extraction.{stage}"].reference]
    functions += [
        alternative(f"fit_{name}", stage) for name in ("complex", "loops", "matrices", "differences")
    ]
    for function in functions:
        report = check(function, stage=stage)
        assert report, str(report)


# What each mistake must be told by, at least: the name of one check.
FINDINGS = {
    "errors measured along y": "no line nearby is nearer to the points",
    "errors measured along x": "no line nearby is nearer to the points",
    "direction along the wall": "walls along the axes",
    "sums about the scanner": "a wall that leans, worked by hand",
    "angle not halved": "a wall that leans, worked by hand",
    "arctangent of a quotient": "walls along the axes",
    "sign of the mixed sum": "a wall that leans, worked by hand",
    "ranges turned into x in place": "leaves its arguments as they were",
    "levers from the foot": "a scanner that is moved sees the same line",
    "the foot does not move": "a scan that is turned turns its line",
    "angle of incidence ignored": "three ranges of a wall ahead, worked by hand",
    "bearing errors across in full": "a scan that is turned turns its line",
    "distances from the line left out": "agrees with lines found by trying",
    "scatter along the line alone": "a scan that is turned turns its line",
    "bearings turned in place": "leaves its arguments as they were",
    "fit with r below 0": "the best line, with r >= 0",
    "fit with the bare absolute value": "the best line, with r >= 0",
    "covariance of the other name": "C agrees with small changes of the beams",
    "half a turn beyond the turn": "alpha is in one turn",
    "fit with angles from 0 to 2 pi": "alpha is in one turn",
    "variances exchanged": "C agrees with small changes of the beams",
    "correlation dropped": "C agrees with small changes of the beams",
    "the caller's bearings sorted": "leaves its arguments as they were",
}


@pytest.mark.parametrize("stage", NAMES)
def test_wrong_functions_are_told_what_is_wrong(stage):
    """Every mistake in the catalogue fails a public check, which has a message."""
    for item in of_stage(f"extraction.{stage}"):
        report = check(item.function, stage=stage)
        failed = {one.name: one.message for one in report.items if one.passed is False}
        assert failed, item.name
        assert all(failed.values()), item.name
        assert FINDINGS.get(item.name, next(iter(failed))) in failed, item.name


def test_every_finding_is_about_a_known_mistake():
    """The table above names no mistake that does not exist."""
    known = {item.name for stage in NAMES for item in of_stage(f"extraction.{stage}")}
    assert set(FINDINGS) <= known


@pytest.mark.parametrize("stage", NAMES)
def test_each_check_can_fail(stage):
    """No line of the report is right by default."""
    failed = set()
    for function in (*(item.function for item in of_stage(f"extraction.{stage}")), lambda *_: ()):
        report = check(function, stage=stage)
        failed |= {one.name for one in report.items if one.passed is False}
    assert failed == {one.name for one in NAMES[stage]}


def test_a_fit_with_a_line_and_no_covariance_is_told_so():
    """A function that returns the line alone learns which value is missing."""
    report = check(lambda *_: (0.0, 1.0), stage="fit_line")
    assert "Expected 3 values, alpha, r, C" in report.items[0].message


def test_the_search_finds_the_best_line():
    """The lines that the checks find by trying are those of the reference, to nine digits."""
    reference = STAGES["extraction.line_parameters"].reference
    for beams, line in fit._lines():
        alpha, r = reference(*beams)
        assert abs(np.exp(1j * (line[0] - alpha)) - 1) < 1e-7
        assert abs(line[1] - r) < 1e-7


def test_no_answer_is_stored():
    """The sines, cosines and arctangents of the answer are not in the checks, but for the beams of given points."""
    source = Path(fit.__file__).read_text(encoding="utf-8")
    assert "cos(" not in source
    assert "sin(" not in source
    assert source.count("arctan2") == 1
