"""The public checks of splitting and merging: what they accept, and how they say what is wrong."""

from pathlib import Path

import numpy as np
import pytest
from public import Public, unmet, words_in

from autograder.checks import STAGES as GRADED
from roboloc.checks import extraction
from roboloc_reference.extraction import fit_line

STAGES = tuple(f"extraction.{name}" for name in ("split", "merge", "segments", "extract_lines"))
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
PUBLIC = Public(STAGES, FINDINGS)


@pytest.mark.parametrize("stage", STAGES)
def test_right_functions_pass_and_wrong_ones_are_told(stage):
    """Correct ways pass, every known mistake fails a check, which has a message, and no line is right by default."""
    one_run = {
        "extraction.merge": lambda _theta, _rho, ranges, *_: [[ranges[0][0], ranges[-1][1]]],
        "extraction.extract_lines": lambda theta, *_: (
            [0, 1],
            [1, 1],
            np.ones((2, 4)),
            [[0, 4], [4, len(theta)]],
        ),
    }.get(stage, lambda *_: None)
    nothing = {"a scan in which nothing was seen"} if stage == "extraction.extract_lines" else ()
    PUBLIC.hold(stage, lambda *_: None, one_run, seen=nothing)


def test_nothing_seen_can_fail():
    """A function that cannot do without beams is told so."""
    right = GRADED["extraction.extract_lines"].reference

    def lists(*args):
        return tuple(part.tolist() for part in right(*args))

    assert list(unmet(lists, "extract_lines")) == ["a scan in which nothing was seen"]


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
    assert words_in("arctan2", extraction) == []
    source = Path(extraction.__file__).read_text(encoding="utf-8")
    assert "0.5 *" not in source
    assert source.count("argmin") == 1  # of angles that are tried
