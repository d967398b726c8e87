"""What a cell is to nbgrader."""

from __future__ import annotations

import pytest
from nbformat.v4 import new_code_cell

from autograder.roles import grade_id, has_hidden_part, role_of, visible_part

HIDDEN = "### BEGIN HIDDEN TESTS\nassert f(3) == 9\n### END HIDDEN TESTS"


def cell(**info):
    """Return a code cell with nbgrader's metadata."""
    return new_code_cell("", metadata={"nbgrader": info} if info else {})


@pytest.mark.parametrize(
    ("info", "role"),
    [
        ({}, "plain"),
        ({"grade": True, "solution": False, "locked": True}, "test"),
        ({"grade": True, "solution": True, "locked": False}, "answer"),
        ({"grade": False, "solution": True}, "answer"),
        ({"grade": False, "solution": False, "locked": True}, "given"),
        ({"grade": False, "solution": False, "locked": False}, "plain"),
    ],
)
def test_roles(info, role):
    """A solution is the student's even where it is graded; a locked cell is the instructor's; the rest is free."""
    assert role_of(cell(**info)) == role


def test_grade_id():
    """A cell without metadata has no name in the gradebook."""
    assert grade_id(cell()) == ""
    assert grade_id(cell(grade_id="q1")) == "q1"


@pytest.mark.parametrize(
    ("source", "visible"),
    [
        (HIDDEN, ""),
        (f"a = 1\n{HIDDEN}\nb = 2", "a = 1\n\nb = 2"),
        (f"{HIDDEN}\nx\n{HIDDEN}", "\nx\n"),
        (HIDDEN.replace("###", "#"), ""),
        ("  " + HIDDEN, ""),
        ("assert f(3) == 9", "assert f(3) == 9"),
    ],
)
def test_visible_part(source, visible):
    """All that stands between the marks is taken out, several times and indented too, and nothing else."""
    assert visible_part(source) == visible
    assert has_hidden_part(source) is (source != visible)
