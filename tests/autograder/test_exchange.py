"""Round trips of an assignment through nbgrader's exchange, with stock commands and two students."""

from __future__ import annotations

import csv
import os
import subprocess
from dataclasses import dataclass
from typing import TYPE_CHECKING

import nbformat
import pytest
from nbgrader.api import Gradebook
from temporary_course import ASSIGNMENT, GRADED, HIDDEN, NOTEBOOK, SQUARE, Course, environment

if TYPE_CHECKING:
    from pathlib import Path

COURSE_ID = "robots"
EXCHANGE = """\
c = get_config()
c.CourseDirectory.course_id = {course!r}
c.Exchange.root = {root!r}
"""
LATE = """\
c.AssignLatePenalties.plugin_class = "autograder.late.PenaltyPerDay"
c.PenaltyPerDay.per_day = 0.25
"""
WRONG = "def square(x):\n    return 2 * x"


@dataclass(frozen=True)
class Student:
    """Someone with a home, a Jupyter configuration and a name of their own."""

    name: str
    home: Path

    def nbgrader(self, *arguments):
        """Run a stock nbgrader command as this student."""
        variables = {f"JUPYTER_{kind}_DIR": str(self.home / kind.lower()) for kind in ("DATA", "RUNTIME")}
        done = subprocess.run(
            Course.command(*arguments, f"--student={self.name}"), cwd=self.home,
            env=environment(HOME=str(self.home), JUPYTER_CONFIG_DIR=str(self.home), **variables),
            capture_output=True, text=True, timeout=180, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stderr

    def write(self, **answers):
        """Write answers into the fetched notebook."""
        path = self.home / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
        notebook = nbformat.read(path, as_version=4)
        for cell in notebook.cells:
            cell.source = answers.get(cell.metadata.get("nbgrader", {}).get("grade_id"), cell.source)
        nbformat.write(notebook, path)

    def feedback(self):
        """Return the fetched pages, the oldest submission's first."""
        pages = sorted((self.home / ASSIGNMENT / "feedback").glob(f"*/{NOTEBOOK}.html"))
        return [page.read_text(encoding="utf-8") for page in pages]


@dataclass(frozen=True)
class Term:
    """A course, its exchange and its students, after the first round."""

    course: Course
    inbound: Path
    good: Student
    wrong: Student


def grades(course, student):
    """Return the row of a student in the exported grades."""
    course.nbgrader("export")
    with (course.root / "grades.csv").open(newline="", encoding="utf-8") as file:
        (row,) = [row for row in csv.DictReader(file) if row["student_id"] == student]
    return row


@pytest.fixture(scope="module")
def term(tmp_path_factory):
    """Release, fetch, hand in, collect, grade, return and fetch the feedback: each step a stock command."""
    root = tmp_path_factory.mktemp("term")
    course = Course.create(root / "course")
    exchange = root / "exchange"
    exchange.mkdir(mode=0o777)
    os.chmod(exchange, 0o777)  # noqa: S103, PTH101  (nbgrader wants it; the folder is the test's own)
    settings = EXCHANGE.format(course=COURSE_ID, root=str(exchange))
    config = course.root / "nbgrader_config.py"
    config.write_text(settings + LATE + config.read_text(encoding="utf-8"), encoding="utf-8")
    students = [Student(name, root / "homes" / name) for name in ("good", "wrong")]
    course.nbgrader("db", "assignment", "add", ASSIGNMENT, "--duedate=2030-01-01 12:00:00")
    course.nbgrader("release_assignment", ASSIGNMENT)
    for student, square in zip(students, (SQUARE, WRONG), strict=True):
        student.home.mkdir(parents=True)
        (student.home / "nbgrader_config.py").write_text(settings, encoding="utf-8")
        student.nbgrader("fetch_assignment", ASSIGNMENT)
        student.write(square=square, cube="def cube(x):\n    return x**3", why=f"Written by {student.name}.")
        student.nbgrader("submit", ASSIGNMENT)
    course.nbgrader("collect", ASSIGNMENT, "--ExchangeCollect.check_owner=False")
    course.nbgrader("autograde", ASSIGNMENT)
    course.nbgrader("generate_feedback", ASSIGNMENT)
    course.nbgrader("release_feedback", ASSIGNMENT)
    for student in students:
        student.nbgrader("fetch_feedback", ASSIGNMENT)
    return Term(course, exchange / COURSE_ID / "inbound", *students)


def test_what_was_handed_in_is_what_was_graded(term):
    """The answers that students wrote into the fetched notebook reach the gradebook with their points."""
    assert term.course.rows() == {
        "good": {"square-test": (2.0, False), "cube-test": (3.0, False), "why": (None, True)},
        "wrong": {"square-test": (0.0, False), "cube-test": (3.0, False), "why": (None, True)},
    }


def test_everybody_gets_their_own_feedback(term):
    """The fetched page is the student's own, with scores, and shows nothing of a hidden test."""
    for student, other, score in ((term.good, term.wrong, 5.0), (term.wrong, term.good, 3.0)):
        (page,) = student.feedback()
        assert f"Written by {student.name}." in page
        assert f"Written by {other.name}." not in page
        assert f"(Score: {score} / {sum(GRADED.values())})" in page
        assert not [word for word in HIDDEN if word in page]


def test_exchange_holds_no_answer(term):
    """What is released to everybody has neither a solution nor a hidden test."""
    released = term.inbound.parent / "outbound" / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
    text = released.read_text(encoding="utf-8")
    assert "raise NotImplementedError" in text
    assert not [word for word in (*HIDDEN, "x * x", "x**3") if word in text]


def test_second_submission_is_late_and_marked_by_hand(term):
    """A late second submission replaces the first; its penalty covers a person's points, which a second run keeps."""
    course, student = term.course, term.wrong
    student.write(square=SQUARE)
    student.nbgrader("submit", ASSIGNMENT)
    assert len(list(term.inbound.glob(f"{student.name}+*"))) == 2
    course.nbgrader("collect", ASSIGNMENT, "--update", "--ExchangeCollect.check_owner=False")
    stamp = course.folder(student.name) / "timestamp.txt"
    stamp.write_text("2030-01-03 00:00:00.000000 UTC", encoding="utf-8")
    course.nbgrader("autograde", ASSIGNMENT, f"--student={student.name}")
    row = grades(course, student.name)
    assert (float(row["raw_score"]), float(row["late_submission_penalty"])) == (5.0, 2.5)
    with Gradebook(course.db_url) as gradebook:
        grade = gradebook.find_grade("why", NOTEBOOK, ASSIGNMENT, student.name)
        grade.manual_score, grade.needs_manual_grade = 4.0, False
        comment = gradebook.find_comment("why", NOTEBOOK, ASSIGNMENT, student.name)
        comment.manual_comment = "Say **which** square."
        gradebook.db.commit()
    course.nbgrader("autograde", ASSIGNMENT, f"--student={student.name}", "--force")
    row = grades(course, student.name)
    assert (float(row["raw_score"]), float(row["late_submission_penalty"])) == (9.0, 4.5)
    assert (float(row["score"]), row["timestamp"]) == (4.5, "2030-01-03 00:00:00")
    course.nbgrader("generate_feedback", ASSIGNMENT, "--force")
    page = (course.folder(student.name, "feedback") / f"{NOTEBOOK}.html").read_text(encoding="utf-8")
    assert "Late submission penalty (Score: -4.5)" in page
    assert "<strong>which</strong>" in page


def test_on_time_costs_nothing(term):
    """A submission before the due date has no penalty in the export."""
    row = grades(term.course, term.good.name)
    assert (float(row["late_submission_penalty"]), float(row["score"])) == (0.0, 5.0)
