"""The public checks of splitting and merging: what they accept, and how they say what is wrong."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from autograder.checks import STAGES
from autograder.misconceptions import of_stage
from roboloc.checks import check, extraction
from roboloc_reference.extraction import fit_line

NAMES = {
    "split": extraction.SPLIT,
    "merge": extraction.MERGE,
    "segments": extraction.SEGMENTS,
    "extract_lines": extraction.EXTRACT,
}
ALTERNATIVES = Path(__file__).resolve().parents[1] / "autograder" / "alternatives" / "split_and_merge"


def alternative(name, stage):
    """Load another right way to write a stage."""
    spec = importlib.util.spec_from_file_location(f"public_{name}", ALTERNATIVES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return getattr(module, stage)


@pytest.mark.parametrize("stage", NAMES)
def test_correct_functions_pass(stage):
    """Every correct way passes: the reference, recursion in plain Python, eigenvalues."""
    functions = [STAGES[f"extraction.{stage}"].reference]
    functions += [alternative(f"pieces_{name}", stage) for name in ("recursive", "eigenvalues")]
    for function in functions:
        report = check(function, stage=stage)
        assert report, str(report)


# What each mistake must be told by, at least: the name of one check.
FINDINGS = {
    "cut at the farthest point": "a corner",
    "gaps not looked for": "a doorway",
    "gap as a difference of ranges": "a doorway",
    "cut once": "every run is a line",
    "mean distance in the place of the largest": "every run is a line",
    "last beam for last beam + 1": "one wall stays whole",
    "joined from the left": "the best pair first",
    "joined over a gap": "a doorway stays",
    "joined over beams left out": "runs with beams between them",
    "one pair joined": "a wall in three pieces",
    "mean distance of the joint run": "a slight bend",
    "one point more than needed": "as many points as are needed",
    "points or length": "a run with too few points",
    "length not asked for": "a run that is too short",
    "ends as they were seen": "both ends are on the line",
    "end of the next run": "the ends belong to the first and the last beam",
    "never merged": "four walls",
    "dropped before merging": "four walls",
    "beams counted among the seen": "lost beams",
    "lost beams behind the wall": "lost beams",
    "cut at every lost beam": "lost beams",
}


@pytest.mark.parametrize("stage", NAMES)
def test_wrong_functions_are_told_what_is_wrong(stage):
    """Every mistake in the catalogue fails a public check, which has a message, and no line is right by default."""
    seen = set()
    for item in of_stage(f"extraction.{stage}"):
        report = check(item.function, stage=stage)
        failed = {one.name: one.message for one in report.items if one.passed is False}
        assert failed, item.name
        assert all(failed.values()), item.name
        assert FINDINGS.get(item.name, next(iter(failed))) in failed, item.name
        seen |= set(failed)
    one_run = {
        "merge": lambda _theta, _rho, ranges, *_: [[ranges[0][0], ranges[-1][1]]],
        "extract_lines": lambda theta, *_: ([0, 1], [1, 1], np.ones((2, 4)), [[0, 4], [4, len(theta)]]),
    }.get(stage, lambda *_: None)
    for function in (lambda *_: None, one_run):
        seen |= {one.name for one in check(function, stage=stage).items if one.passed is False}
    assert seen >= {one.name for one in NAMES[stage]} - {"a scan in which nothing was seen"}


def test_every_finding_is_about_a_known_mistake():
    """The table above names no mistake that does not exist."""
    known = {item.name for stage in NAMES for item in of_stage(f"extraction.{stage}")}
    assert set(FINDINGS) <= known


def test_nothing_seen_can_fail():
    """A function that cannot do without beams is told so."""
    right = STAGES["extraction.extract_lines"].reference

    def lists(*args):
        return tuple(part.tolist() for part in right(*args))

    failed = [one.name for one in check(lists, stage="extract_lines").items if one.passed is False]
    assert failed == ["a scan in which nothing was seen"]


def test_the_search_finds_the_best_lines():
    """The lines that the checks find by trying are those of the reference, to seven digits."""
    for points in (extraction._ROOM, extraction._CORNER, extraction._BEND):
        x, y = np.transpose(points)
        lines = extraction._table(points)
        for i, j in ((0, len(points)), (1, 3), (2, 8)):
            alpha, r, _ = fit_line(np.arctan2(y, x)[i:j], np.hypot(x, y)[i:j], 0.0, 0.0)
            np.testing.assert_allclose(lines[i, j], (alpha, r), atol=1e-7)


def test_no_answer_is_stored():
    """The checks hold no half angle and no arctangent, and cut nothing."""
    source = Path(extraction.__file__).read_text(encoding="utf-8")
    assert "arctan2" not in source
    assert "0.5 *" not in source
    assert "argmin" in source  # of angles that are tried, once
    assert source.count("argmin") == 1
