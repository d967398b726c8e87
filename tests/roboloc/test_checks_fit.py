"""The public checks of the line fit: what they accept, and how they say what is wrong."""

from pathlib import Path

import numpy as np
import pytest
from public import Public, words_in

from autograder.checks import STAGES as GRADED
from roboloc.checks import check, fit

STAGES = ("extraction.line_parameters", "extraction.line_jacobians", "extraction.fit_line")
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
PUBLIC = Public(STAGES, FINDINGS)


@pytest.mark.parametrize("stage", STAGES)
def test_right_functions_pass_and_wrong_ones_are_told(stage):
    """Correct ways pass, every known mistake fails a check, which has a message, and no line is right by default."""
    PUBLIC.hold(stage)


def test_a_fit_with_a_line_and_no_covariance_is_told_so():
    """A function that returns the line alone learns which value is missing."""
    report = check(lambda *_: (0.0, 1.0), stage="fit_line")
    assert "Expected 3 values, alpha, r, C" in report.items[0].message


def test_the_search_finds_the_best_line():
    """The lines that the checks find by trying are those of the reference, to nine digits."""
    reference = GRADED["extraction.line_parameters"].reference
    for beams, line in fit._lines():
        alpha, r = reference(*beams)
        assert abs(np.exp(1j * (line[0] - alpha)) - 1) < 1e-7
        assert abs(line[1] - r) < 1e-7


def test_no_answer_is_stored():
    """The sines, cosines and arctangents of the answer are not in the checks, but for the beams of given points."""
    assert words_in("cos( sin(", fit) == []
    assert Path(fit.__file__).read_text(encoding="utf-8").count("arctan2") == 1
