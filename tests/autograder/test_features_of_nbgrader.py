"""What a course of nbgrader may use besides tests is as under stock: AUTOTEST, tasks, late penalties, IgnorePattern."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import nbformat
import nbgrader
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook
from nbgrader.api import Gradebook
from temporary_course import ASSIGNMENT, NOTEBOOK, SQUARE, TWO_LINES, Course, cell, environment, solution

TEMPLATES = Path(nbgrader.__file__).parent / "docs" / "source" / "user_guide" / "autotests.yml"
SETTINGS = """
c = get_config()
c.CourseDirectory.db_url = "sqlite:///gradebook.db"
c.LateSubmissionPlugin.penalty_method = "zero"
c.IgnorePattern.enabled = True
c.IgnorePattern.pattern = "a line to ignore"
"""
NOISE = "import sys\nprint('a line to ignore', file=sys.stderr)"
ANSWERS = {"right": SQUARE, "wrong": "def square(x):\n    return x + x", "late": SQUARE}
DUE, LATE = "2026-01-01 12:00:00 UTC", "2026-01-02 12:00:00 UTC"


def _source():
    """Return a notebook with plain and hashed automatic tests and a task."""
    test = {"grade": True, "locked": True}
    return new_notebook(
        cells=[
            cell(new_code_cell, solution(SQUARE), "square", solution=True),
            cell(new_code_cell, "### AUTOTEST square(3); square(-2)", "plain", points=2, **test),
            cell(new_code_cell, "### HASHED AUTOTEST square(7)", "hashed", points=3, **test),
            cell(new_markdown_cell, "Draw it.", "task", points=4, task=True, locked=True),
        ],
        metadata={"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}},
    )


def _graded(root, configuration):
    """Release the assignment, hand in, have a person grade the task, grade again; return all that is recorded."""
    folder = root / "source" / ASSIGNMENT
    folder.mkdir(parents=True)
    (root / "nbgrader_config.py").write_text(configuration)
    shutil.copy(TEMPLATES, root)
    nbformat.write(_source(), folder / f"{NOTEBOOK}.ipynb")
    course = Course(root)
    with Gradebook(course.db_url) as gradebook:
        gradebook.update_or_create_assignment(ASSIGNMENT, duedate=DUE)
    course.nbgrader("generate_assignment", ASSIGNMENT)
    released = "".join(node.source for node in course.released().cells)
    assert "assert" in released
    assert "AUTOTEST" not in released
    for student, answer in ANSWERS.items():
        course.submit(student, answer, more=[NOISE])
        date = LATE if student == "late" else DUE
        course.submit_file(student, date, "timestamp.txt")
    course.nbgrader("autograde", ASSIGNMENT)
    with Gradebook(course.db_url) as gradebook:
        grade = gradebook.find_grade("task", NOTEBOOK, ASSIGNMENT, "right")
        grade.manual_score, grade.needs_manual_grade = 3.5, False
        comment = gradebook.find_comment("task", NOTEBOOK, ASSIGNMENT, "right")
        comment.manual_comment = "A person wrote this."
        gradebook.db.commit()
    course.nbgrader("autograde", ASSIGNMENT, "--force")
    with Gradebook(course.db_url) as gradebook:
        return course, {
            submission.student.id: (
                submission.score,
                submission.late_submission_penalty,
                sorted(
                    (g.name, g.auto_score, g.manual_score, g.needs_manual_grade)
                    for n in submission.notebooks
                    for g in n.grades
                ),
                sorted((c.name, c.comment) for n in submission.notebooks for c in n.comments),
            )
            for submission in gradebook.assignment_submissions(ASSIGNMENT)
        }


@pytest.fixture(scope="module")
def ours(tmp_path_factory):
    """Grade the class with our plug-in."""
    return _graded(tmp_path_factory.mktemp("ours"), SETTINGS + TWO_LINES)


def test_all_is_recorded_as_under_stock(ours, tmp_path):
    """Scores, penalties, a person's points and comments are those that stock nbgrader records."""
    _, stock = _graded(tmp_path / "stock", SETTINGS)
    assert ours[1] == stock


def test_automatic_tests_and_penalties_tell_students_apart(ours):
    """A right answer has all points of the automatic tests, a wrong one none, and a late one loses what it earned."""
    scores = {student: (row[0], row[1]) for student, row in ours[1].items()}
    assert scores == {"right": (8.5, 0.0), "wrong": (0.0, 0.0), "late": (5.0, 5.0)}
    assert ("task", "A person wrote this.") in ours[1]["right"][3]


def test_ignored_pattern_is_not_in_the_graded_notebook(ours):
    """What a course tells nbgrader to ignore on the error stream is in no graded notebook."""
    for student in ANSWERS:
        assert "a line to ignore" not in str([n.get("outputs") for n in ours[0].graded(student).cells])


def test_one_notebook_is_graded_with_the_automatic_tests_of_the_course(ours):
    """Graded on its own, a notebook gets what it got in the class: the course's templates are found."""
    course, recorded = ours
    path = str(course.folder("right") / f"{NOTEBOOK}.ipynb")
    done = subprocess.run(
        [sys.executable, "-m", "autograder", "grade", path, "--format", "json"],
        cwd=course.root, env=environment(), capture_output=True, text=True, timeout=180, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    (notebook,) = json.loads(done.stdout)["notebooks"]
    found = {cell["name"]: cell["score"] for cell in notebook["cells"]}
    wanted = {name: score for name, score, *_ in recorded["right"][2] if name != "task"}
    assert wanted == {"plain": 2.0, "hashed": 3.0}
    assert found | wanted == found
