"""A person grades a written answer in the formgrader: score and comment stand in the feedback and in the export."""

from __future__ import annotations

import csv
from dataclasses import dataclass

import pytest
from browser.browser import visit
from browser.formgrader import READY, SCREENSHOTS, local, page, serve, submission
from nbgrader.api import Gradebook
from temporary_course import ASSIGNMENT, NOTEBOOK, Course

ANSWER = "Because a square has **two** sides: $x^2 = x \\cdot x$."
STOLEN = "document.documentElement.dataset.stolen = 'yes'"
COMMENT = f'Right, but *which* two? $a^2$ <script>{STOLEN}</script><img src=x onerror="{STOLEN}">'
MARK = (
    READY
    + f"""
const type = (selector, text) => {{
  const box = document.querySelector(selector);
  box.focus();
  box.value = text;
  $(box).trigger("change");
}};
type("#why", "3.5");
type("#why-comment", {COMMENT!r});
type("#square-test", "1.5");
const grade = (name) => formgrader.grades.find((g) => g.get("name") === name);
await until(() => grade("why").get("manual_score") === 3.5 && grade("square-test").get("manual_score") === 1.5);
await pause(1500);
return {{
  total: document.querySelector("#notebook").innerText,
  saved: formgrader.comments.find((c) => c.get("name") === "why").get("manual_comment"),
}};
"""
)
READ = """
return {
  stolen: document.documentElement.dataset.stolen ?? null,
  text: document.body.innerText,
  emphasis: [...document.querySelectorAll(".panel-footer em")].map((e) => e.innerText),
  parts: [...document.querySelectorAll("#notebook :is(script, iframe, svg, [onerror], [onload])")].length,
};
"""


@dataclass(frozen=True)
class Marked:
    """A course after a person has marked, and what the formgrader and the feedback page showed."""

    course: Course
    formgrader: dict
    feedback: dict
    again: dict


@pytest.fixture(scope="module")
def marked(tmp_path_factory):
    """Grade two students, mark one in the formgrader, return the feedback with the stock commands, open it."""
    course = Course.create(tmp_path_factory.mktemp("marking") / "course")
    course.submit("writer", square="def square(x):\n    return 2 * x", why=ANSWER)
    course.submit("other", why="No idea.")
    course.grade()
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    with serve(course, tmp_path_factory.mktemp("jupyter")) as server:
        place = f"submissions/{submission(course, 'writer')}"
        (formgrader,) = visit([page(server, place, wait="textarea#why-comment", run=MARK)], parallel=1)
        shown = (
            READY
            + "return document.querySelector('#why').value + ' ' + document.querySelector('#why-comment').value"
        )
        picture = str(SCREENSHOTS / "formgrader-marked.png")
        (again,) = visit(
            [page(server, place, wait="textarea#why-comment", run=shown, screenshot=picture, full=True)],
            parallel=1,
        )
    course.nbgrader("generate_feedback", ASSIGNMENT)
    course.nbgrader("export")
    html = course.folder("writer", "feedback") / f"{NOTEBOOK}.html"
    picture = str(SCREENSHOTS / "feedback-marked.png")
    (feedback,) = visit(
        [{"url": html.as_uri(), "run": READ, "screenshot": picture, "full": True}], parallel=1
    )
    return Marked(course, formgrader, feedback, again)


def exported(course, student):
    """Return a student's row of the exported grades."""
    with (course.root / "grades.csv").open(newline="", encoding="utf-8") as file:
        return next(row for row in csv.DictReader(file) if row["student_id"] == student)


def test_score_and_comment_are_saved(marked):
    """What was typed is in the gradebook, and on the page when it is opened once more."""
    assert not local(marked.formgrader)
    assert marked.formgrader["value"]["saved"] == COMMENT
    assert marked.again["value"] == f"3.5 {COMMENT}"
    with Gradebook(marked.course.db_url) as gradebook:
        grade = gradebook.find_grade("why", NOTEBOOK, ASSIGNMENT, "writer")
        assert (grade.manual_score, grade.needs_manual_grade) == (3.5, False)


def test_both_stand_in_the_feedback(marked):
    """The page that the student gets has the score and the comment, drawn as text, and nothing of it runs."""
    shown = marked.feedback["value"]
    assert "Score: 3.5 / 5.0" in shown["text"]
    assert "Comments:" in shown["text"]
    assert "Right, but which two?" in shown["text"]
    assert shown["emphasis"] == ["which"]
    assert shown["stolen"] is None
    assert shown["parts"] == 0


def test_both_stand_in_the_export(marked):
    """The exported points are those of the grader and of the person; the one who waits for a person has none yet."""
    assert float(exported(marked.course, "writer")["raw_score"]) == 1.5 + 3.0 + 3.5
    assert float(exported(marked.course, "other")["raw_score"]) == 2.0 + 3.0


def test_overruled_test_cell_shows_the_persons_score(marked):
    """A score that a person gave to a test cell takes the place of the grader's, in the feedback too."""
    assert "Score: 1.5 / 2.0" in marked.feedback["value"]["text"]
    assert marked.course.rows()["writer"]["square-test"] == (0.0, False)


def test_graded_again_the_persons_points_stay(marked, tmp_path):
    """A second run of the grader keeps a person's scores and comments, and asks for another look at them."""
    course = marked.course.copy(tmp_path / "course")
    course.nbgrader("autograde", ASSIGNMENT, "--student=writer", "--force")
    with Gradebook(course.db_url) as gradebook:
        grade = gradebook.find_grade("why", NOTEBOOK, ASSIGNMENT, "writer")
        comment = gradebook.find_comment("why", NOTEBOOK, ASSIGNMENT, "writer")
        assert (grade.score, grade.needs_manual_grade, comment.comment) == (3.5, True, COMMENT)
