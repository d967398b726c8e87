"""A submission that was made from an earlier version of the assignment is graded as the present one, and says so."""

from __future__ import annotations

import re

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell
from nbgrader.api import Gradebook
from temporary_course import (
    ASSIGNMENT,
    CUBE,
    NOTEBOOK,
    SQUARE,
    Course,
    cell,
    hidden,
    solution,
    source_notebook,
)

from autograder.repair import NOTICE, Released, repair
from autograder.versions import NEW, REASON, Origin, Version, find_origin, given_now, given_then, read_history

FOURTH = "def fourth(x):\n    return x**4"
ANSWERS = {
    "square": SQUARE,
    "square-code": SQUARE,
    "cube": CUBE,
    "fourth": FOURTH,
    "why": "So.",
    "why-not": "No.",
}


def second_version():
    """Return the assignment with cells renamed and added, other points, another test and another given cell."""
    notebook = source_notebook()
    by_name = {node.metadata.get("nbgrader", {}).get("grade_id"): node for node in notebook.cells}
    by_name["square"].metadata.nbgrader.grade_id = "square-code"
    by_name["square-test"].metadata.nbgrader.points = 4
    by_name["square-test"].source += "\n# Two cases."
    by_name["cube-test"].metadata.nbgrader.grade_id = "cube-check"
    notebook.cells[1:1] = [cell(new_code_cell, "import math", "given", locked=True)]
    notebook.cells += [
        cell(new_code_cell, solution(FOURTH), "fourth", solution=True),
        cell(
            new_code_cell, hidden("assert fourth(2) == 16"), "fourth-test", grade=True, locked=True, points=1
        ),
        cell(new_markdown_cell, solution("No."), "why-not", grade=True, solution=True, points=2),
    ]
    return notebook


def answered(notebook, skip=(), **answers):
    """Fill in a released notebook, without the cells to skip."""
    texts = ANSWERS | answers
    notebook = nbformat.from_dict(notebook)
    name = {node.id: node.metadata.get("nbgrader", {}).get("grade_id") for node in notebook.cells}
    notebook.cells = [node for node in notebook.cells if name[node.id] not in skip]
    for node in notebook.cells:
        node.source = texts.get(name[node.id], node.source)
    return notebook


@pytest.fixture(scope="module")
def graded(tmp_path_factory):
    """Release twice, hand in files of both versions, grade them as the second and write feedback."""
    course = Course.create(tmp_path_factory.mktemp("versions") / "course")
    first = course.released()
    nbformat.write(second_version(), course.root / "source" / ASSIGNMENT / f"{NOTEBOOK}.ipynb")
    with course.api() as api:
        assert api.generate_assignment(ASSIGNMENT, force=True)["success"]
    second = course.released()
    foreign = answered(second)
    foreign.cells[-1].metadata.nbgrader.checksum = "0" * 32
    files = {
        "early": answered(first),
        "early-blank": first,
        "early-deleted": answered(first, skip=["square-test"]),
        "present": answered(second),
        "present-deleted": answered(second, skip=["fourth", "fourth-test"]),
        "unknown": foreign,
    }
    for student, notebook in files.items():
        course.submit_file(student, nbformat.writes(notebook))
    course.grade()
    with course.api() as api:
        assert api.generate_feedback(ASSIGNMENT)["success"]
    return course


def notices(course, student):
    """Return what was said about a file."""
    return "\n".join(course.graded(student).metadata.get(NOTICE, []))


def test_every_release_is_on_record(graded):
    """Both versions stand in the gradebook with names and days of their own, in their order."""
    first, second = read_history(graded.db_url, ASSIGNMENT, NOTEBOOK)
    assert set(first.cells) == {"square", "square-test", "cube", "cube-test", "why"}
    assert {"square-code", "fourth", "given"} <= set(second.cells)
    assert first.name != second.name
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", first.day)


def test_same_release_again_is_no_new_version(graded):
    """Releasing the same notebook once more leaves the record as it is."""
    with graded.api() as api:
        assert api.generate_assignment(ASSIGNMENT, force=True)["success"]
    assert len(read_history(graded.db_url, ASSIGNMENT, NOTEBOOK)) == 2


@pytest.mark.parametrize(
    ("student", "expected"),
    [
        ("early", {"square-test": (4, False), "cube-check": (3, False), "fourth-test": (None, True),
                   "why": (None, True), "why-not": (None, True)}),
        ("early-blank", {"square-test": (0, False), "cube-check": (None, True), "fourth-test": (None, True),
                         "why": (0, False), "why-not": (None, True)}),
        ("early-deleted", {"square-test": (4, False), "cube-check": (3, False), "fourth-test": (None, True),
                           "why": (None, True), "why-not": (None, True)}),
        ("present", {"square-test": (4, False), "cube-check": (3, False), "fourth-test": (1, False),
                     "why": (None, True), "why-not": (None, True)}),
        ("present-deleted", {"square-test": (4, False), "cube-check": (3, False), "fourth-test": (0, False),
                             "why": (None, True), "why-not": (None, True)}),
        ("unknown", {"square-test": (4, False), "cube-check": (3, False), "fourth-test": (1, False),
                     "why": (None, True), "why-not": (None, True)}),
    ],
)  # fmt: skip
def test_graded_as_the_present_version(graded, student, expected):
    """Known work earns the present points under old and new names; a new cell is no automatic 0; a deleted one is."""
    assert graded.rows()[student] == expected


@pytest.mark.parametrize("student", ["early", "early-blank", "early-deleted"])
def test_feedback_names_the_version(graded, student):
    """The page says from which version the file was made, and what has changed since."""
    first, _ = read_history(graded.db_url, ASSIGNMENT, NOTEBOOK)
    page = (graded.folder(student, "feedback") / f"{NOTEBOOK}.html").read_text(encoding="utf-8")
    assert f"made from an earlier version of the assignment ({first.name} of {first.day})" in page
    assert "given otherwise since then: square-test" in page
    assert "new since then: given, square-code, cube-check, fourth, fourth-test, why-not" in page
    assert "no longer part of the assignment: square, cube-test" in page
    assert REASON in page
    assert "unknown name" not in page
    assert ("square-test was missing" in page) == (student == "early-deleted")


def test_present_version_has_nothing_to_say(graded):
    """A file of the present version gets no note about versions, with cells deleted or not."""
    assert "version" not in notices(graded, "present") + notices(graded, "present-deleted")
    assert "fourth-test was missing" in notices(graded, "present-deleted")


def test_version_without_a_record_is_called_that(graded):
    """A file of a version that the gradebook never had is graded, with a note that says so."""
    assert "of which the gradebook has no record" in notices(graded, "unknown")


def test_after_grading_points_may_change_and_cells_may_not(graded, tmp_path):
    """After grading a release with other points is taken and counts, and one with another cell is refused."""
    course = graded.copy(tmp_path / "course")
    path = course.root / "source" / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
    notebook = second_version()
    next(c for c in notebook.cells if c.id == "cube-test").metadata.nbgrader.points = 30
    nbformat.write(notebook, path)
    with course.api() as api:
        assert api.generate_assignment(ASSIGNMENT, force=True)["success"]
        api.autograde(ASSIGNMENT, "present", force=True)
    assert course.rows()["present"]["cube-check"] == (30, False)
    assert "given otherwise since then: cube-check" in notices(course, "present")
    notebook.cells.append(cell(new_code_cell, "2", "more", locked=True))
    nbformat.write(notebook, path)
    with course.api() as api:
        result = api.generate_assignment(ASSIGNMENT, force=True)
    assert not result["success"]
    assert "Cannot add or remove cells" in result["log"]


def test_history_without_a_table_is_empty(tmp_path):
    """A gradebook from before versions were recorded has none, and is not touched."""
    with Gradebook(f"sqlite:///{tmp_path}/gradebook.db"):
        pass
    assert read_history(f"sqlite:///{tmp_path}/gradebook.db", ASSIGNMENT, NOTEBOOK) == []


# without a course

OLD, PRESENT = {"f": "a" * 32, "f-test": "b" * 32}, {"f": "a" * 32, "f-test": "c" * 32, "g": "d" * 32}


@pytest.mark.parametrize(
    ("then", "history", "found"),
    [
        ({}, [OLD], None),
        (PRESENT, [OLD], None),
        ({"f": "a" * 32, "g": "d" * 32}, [OLD], None),  # a present file with a cell deleted
        (OLD, [OLD], OLD),
        ({"f-test": "b" * 32}, [OLD], OLD),
        ({"f": "a" * 32}, [{"f": "a" * 32}, OLD], {"f": "a" * 32}),  # exactly an earlier one
        ({"other": "e" * 32}, [OLD], None),
        (OLD, [PRESENT], "unknown"),
        (OLD, [OLD, {**OLD, "h": "9" * 32}], OLD),  # the nearer of two
    ],
)
def test_version_is_the_nearest_one_with_evidence(then, history, found):
    """A version is named on evidence alone: a foreign checksum of it, or exactly its cells."""
    origin = find_origin(then, PRESENT, [Version(cells, "2026-01-31") for cells in history])
    if found is None:
        assert origin is None
    else:
        assert (origin.version and origin.version.cells) == (None if found == "unknown" else found)


@pytest.mark.parametrize(
    "raw",
    [None, [], {"cells": None}, {"cells": [None, 3, {}]}, {"cells": [{"metadata": {"nbgrader": 5}}]},
     {"cells": [{"metadata": {"nbgrader": {"grade_id": ["f"], "checksum": "a" * 32}}}]},
     {"cells": [{"metadata": {"nbgrader": {"grade_id": "f", "checksum": "<b>"}}}]}],
)  # fmt: skip
def test_any_file_has_checksums_or_none(raw):
    """Whatever stands where checksums should is not one."""
    assert given_then(raw) == {}


def test_hidden_tests_are_no_part_of_what_was_given():
    """Two test cells that differ in their hidden part alone are given alike."""
    fields = {"grade": True, "locked": True, "points": 2.0}
    one, other = (
        cell(new_code_cell, hidden(source), "f-test", **fields) for source in ("assert f(1)", "assert f(2)")
    )
    assert given_now([one]) == given_now([other])


def test_long_lists_are_cut():
    """A list of many cells is shortened, and names of any length are cut."""
    origin = Origin(None, new=tuple(f"cell-{i}" for i in range(40)), gone=("x" * 1000,))
    assert all(len(line) < 300 for line in origin.notices())
    assert "and 28 more" in origin.notices()[1]


def test_solution_cell_of_a_new_name_is_not_put_over_the_old_one():
    """Where an answer cell was renamed, no stub is put in that would undo what the student wrote under the old name."""
    released = [Released("g", "code", "def f(x): ...", "", False, False, True, False, 0.0)]
    notebook = {"cells": [new_code_cell("def f(x): return x", metadata={"nbgrader": {"grade_id": "f"}})]}
    repaired = repair(notebook, released, origin=Origin(None, new=("g",), gone=("f",)))
    assert [node.source for node in repaired.cells] == ["def f(x): return x"]
    assert repaired.metadata[NEW] == ["g"]
