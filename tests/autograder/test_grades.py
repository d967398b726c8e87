"""Grades of a notebook are saved as nbgrader saves them, in one piece."""

import csv
from datetime import UTC, datetime

import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output
from nbgrader.api import Course, Gradebook, MissingEntry
from nbgrader.plugins import CsvExportPlugin
from nbgrader.preprocessors import SaveAutoGrades
from nbgrader.utils import compute_checksum

from autograder.database import one_engine
from autograder.grades import Rows, SaveGrades
from autograder.roles import EXTRA

# nbgrader warns of its own way to add a submission.
pytestmark = pytest.mark.filterwarnings("ignore:Object of type <Submitted")

KINDS = {"auto": "100", "answer": "010", "written": "110", "task": "001"}
POINTS = 4


def cell(make, name, source, *outputs):
    """Return a cell of the kind that its name says."""
    grade, solution, task = (flag == "1" for flag in KINDS[name.partition("-")[0]])
    options = {"outputs": list(outputs)} if outputs else {}
    made = make(source, **options)
    made.metadata["nbgrader"] = {
        "grade_id": name, "grade": grade, "solution": solution, "task": task, "points": POINTS,
        "schema_version": 3, "locked": not solution,
    }  # fmt: skip
    return made


def graded():
    """Return an executed notebook: right, partly right and wrong tests, an answer untouched, one given, a task."""
    result = new_output("execute_result", {"text/plain": "2.5"}, execution_count=1)
    wrong = new_output("error", ename="AssertionError", evalue="", traceback=[])
    cells = [
        cell(new_code_cell, "auto-right", "assert True"),
        cell(new_code_cell, "auto-partly", "2.5", result),
        cell(new_code_cell, "auto-wrong", "assert False", wrong),
        cell(new_code_cell, "answer-untouched", "raise NotImplementedError"),
        cell(new_code_cell, "answer-given", "def f(): return 1"),
        cell(new_markdown_cell, "written-untouched", "YOUR ANSWER HERE"),
        cell(new_markdown_cell, "written-given", "Because."),
        cell(new_markdown_cell, "task-drawing", "Draw it."),
        new_markdown_cell("Not graded."),
    ]
    for one in cells[:-1]:
        one.metadata.nbgrader["checksum"] = compute_checksum(one) if one.source != "Because." else "another"
    cells[4].metadata.nbgrader["checksum"] = "another"
    return new_notebook(cells=cells)


@pytest.fixture
def url(tmp_path):
    """Return the address of a gradebook with an assignment and what two students handed in."""
    address = f"sqlite:///{tmp_path}/gradebook.db"
    with Gradebook(address) as gradebook:
        gradebook.add_assignment("a")
        gradebook.add_notebook("n", "a")
        for one in graded().cells[:-1]:
            name = one.metadata.nbgrader["grade_id"]
            kind, place = one.cell_type, {"notebook": "n", "assignment": "a"}
            grade, solution, task = (flag == "1" for flag in KINDS[name.partition("-")[0]])
            if grade:
                gradebook.add_grade_cell(name, **place, max_score=POINTS, cell_type=kind)
            if solution:
                gradebook.add_solution_cell(name, **place)
            if task:
                gradebook.add_task_cell(name, **place, max_score=POINTS, cell_type=kind)
        for student in ("stock", "ours"):
            gradebook.add_student(student)
            gradebook.add_submission("a", student, timestamp=datetime(2026, 1, 1, tzinfo=UTC))
        for student in ("stock", "ours"):  # a second run after a person has looked at one
            gradebook.find_grade("auto-wrong", "n", "a", student).manual_score = 1.0
        gradebook.db.commit()
    return address


def save(step, url, student, notebook=None):
    """Run a step that saves grades."""
    info = {"notebook": "n", "assignment": "a", "student": student, "db_url": url}
    return step().preprocess(notebook or graded(), {"nbgrader": info})


def rows(url, student):
    """Return what the gradebook says of a student."""
    with Gradebook(url) as gradebook:
        found = gradebook.find_submission_notebook("n", "a", student)
        grades = {(g.name, g.auto_score, g.manual_score, g.needs_manual_grade) for g in found.grades}
        return grades, {(c.name, c.auto_comment, c.manual_comment) for c in found.comments}


def test_rows_are_those_of_nbgrader(url):
    """Scores, what waits for a person, and comments, for every kind of cell."""
    save(SaveAutoGrades, url, "stock")
    save(SaveGrades, url, "ours")
    grades, comments = rows(url, "ours")
    assert (grades, comments) == rows(url, "stock")
    assert ("auto-partly", 2.5, None, False) in grades
    assert ("auto-wrong", 0.0, 1.0, True) in grades
    assert ("answer-untouched", "No response.", None) in comments
    assert ("answer-given", None, None) in comments
    assert len(grades) == 6
    assert len(comments) == 5


def with_extra(**said):
    """Return the notebook with a test cell of 0 points that gives extra credit, or that fails."""
    notebook = graded()
    one = cell(new_code_cell, "auto-right", "grade_vectorised('stage', f, extra=2)")
    one.metadata.nbgrader["points"] = 0
    shown = new_output("display_data", {EXTRA: said}) if said else new_output("error", ename="NameError")
    one.outputs = [shown, new_output("execute_result", {"text/plain": "0"}, execution_count=1)]
    notebook.cells[0] = one
    return notebook


def test_extra_credit_reaches_the_table_of_grades(url, tmp_path):
    """What a test cell of 0 points earned adds to the score, not to the maximum, and never exceeds what it is worth."""
    table = tmp_path / "grades.csv"
    cases = [
        ({"earned": 2.0, "of": 2.0}, 2),
        ({"earned": 9.0, "of": 2.0}, 2),
        ({"earned": 0.0, "of": 2.0}, 0),
        ({}, 0),
    ]
    for said, extra in cases:
        save(SaveGrades, url, "ours", with_extra(**said))
        with Gradebook(url) as gradebook:
            grade = gradebook.find_grade("auto-right", "n", "a", "ours")
            assert (grade.auto_score, grade.extra_credit, grade.needs_manual_grade) == (0, extra, False)
            CsvExportPlugin(to=str(table)).export(gradebook)
        lines = table.read_text(encoding="utf-8").splitlines()
        (row,) = [row for row in csv.DictReader(lines) if row["student_id"] == "ours"]
        assert float(row["score"]) == 2.5 + 1.0 + extra
        assert float(row["max_score"]) == 7 * POINTS - 4


def test_extra_credit_of_a_person_stays(url):
    """Where a person has decided on the cell, or the cell is any other, what they gave is left alone."""
    with Gradebook(url) as gradebook:
        for name, manual in (("auto-right", 0.0), ("auto-partly", None)):
            grade = gradebook.find_grade(name, "n", "a", "ours")
            grade.manual_score, grade.extra_credit = manual, 1.5
        gradebook.db.commit()
    save(SaveGrades, url, "ours", with_extra(earned=2.0, of=2.0))
    with Gradebook(url) as gradebook:
        for name in ("auto-right", "auto-partly"):
            assert gradebook.find_grade(name, "n", "a", "ours").extra_credit == 1.5


def test_a_notebook_is_saved_whole_or_not_at_all(url):
    """Where it fails at the last cell, no row has changed."""
    before = rows(url, "ours")
    notebook = graded()
    notebook.cells[-2].metadata.nbgrader["grade_id"] = "task-unknown"
    with pytest.raises(MissingEntry, match="task-unknown"):
        save(SaveGrades, url, "ours", notebook)
    assert rows(url, "ours") == before


def test_a_row_that_is_missing_is_named(url):
    """As nbgrader does, so that the grader can say what is wrong with a gradebook."""
    with Gradebook(url) as gradebook:
        found = Rows(gradebook, "n", "a", "ours")
        with pytest.raises(MissingEntry, match="No such comment: auto-right"):
            found.find_comment("auto-right", "n", "a", "ours")


def test_a_course_is_looked_for_once(tmp_path):
    """Within `one_engine` a new course gets its row all the same, and each database its own."""
    urls = [f"sqlite:///{tmp_path}/{name}.db" for name in "ab"]
    check = Gradebook.check_course
    with one_engine():
        for url in [*urls, *urls]:
            for course in ("one", "two"):
                with Gradebook(url, course) as gradebook:
                    assert gradebook.course_id == course
    assert Gradebook.check_course is check
    for url in urls:
        with Gradebook(url) as gradebook:
            assert {course.id for course in gradebook.db.query(Course)} == {"one", "two", "default_course"}
