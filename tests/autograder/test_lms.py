"""Grades for Canvas and Moodle: every student and assignment in its place, and no formula."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest
from nbgrader.api import Gradebook

from autograder.lms import CanvasExporter, MoodleExporter, safe

pytestmark = pytest.mark.filterwarnings(
    "ignore:Object of type:sqlalchemy.exc.SAWarning"
)  # nbgrader's own queries


@pytest.fixture
def db(tmp_path):
    """Make a gradebook: one student is marked, one waits, one was late, one handed in nothing."""
    address = f"sqlite:///{tmp_path}/gradebook.db"
    with Gradebook(address) as gradebook:
        for assignment, points in (("ps4", 10), ("ps3", 4)):
            gradebook.add_assignment(assignment)
            gradebook.add_notebook("one", assignment)
            gradebook.add_grade_cell("a", "one", assignment, max_score=points, cell_type="code")
        names = {
            "ada": {
                "first_name": "Ada",
                "last_name": "Lovelace",
                "email": "ada@example.org",
                "lms_user_id": "17",
            },
            "=cmd()": {"first_name": "+1", "last_name": '"quoted", and more', "email": "@sum(a1)"},
            "late": {},
            "nothing": {},
        }
        for student, more in names.items():
            gradebook.add_student(student, **more)
        for student, score, waits, penalty in (
            ("ada", 7.5, False, 0),
            ("=cmd()", 3, True, 0),
            ("late", 1, False, 4),
        ):
            submission = gradebook.add_submission("ps4", student)
            submission.notebooks[0].late_submission_penalty = penalty
            grade = gradebook.find_grade("a", "one", "ps4", student)
            grade.auto_score, grade.needs_manual_grade = score, waits
        gradebook.db.commit()
    return address


def exported(db, exporter):
    """Export and read the file again."""
    with Gradebook(db) as gradebook:
        exporter.export(gradebook)
    with Path(exporter.to).open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def test_canvas_gets_its_five_columns_and_what_each_assignment_is_worth(db, tmp_path):
    """Names, numbers and points are where Canvas looks for them; what is not known is empty."""
    exporter = CanvasExporter(to=str(tmp_path / "c.csv"), columns={"ps4": "Problem set 4 (1234)"})
    assert exported(db, exporter) == [
        ["Student", "ID", "SIS User ID", "SIS Login ID", "Section", "ps3", "Problem set 4 (1234)"],
        ["    Points Possible", "", "", "", "", "4", "10"],
        ['"quoted", and more, +1', "", "", "'=cmd()", "", "", ""],
        ["Lovelace, Ada", "17", "", "ada", "", "", "7.5"],
        ["late", "", "", "late", "", "", "0"],
        ["nothing", "", "", "nothing", "", "", ""],
    ]


def test_moodle_finds_students_by_number_or_address(db, tmp_path):
    """One assignment alone, work that waits as it stands, and no text that a spreadsheet would work out."""
    exporter = MoodleExporter(to=str(tmp_path / "m.csv"), assignment=["ps4"], unmarked=True)
    assert exported(db, exporter) == [
        ["ID number", "Email address", "ps4"],
        ["'=cmd()", "'@sum(a1)", "3"],
        ["ada", "ada@example.org", "7.5"],
        ["late", "", "0"],
        ["nothing", "", ""],
    ]


def test_one_student_can_be_exported(db, tmp_path):
    """The options of nbgrader's own exporter hold."""
    found = exported(db, MoodleExporter(to=str(tmp_path / "m.csv"), student=["ada"]))
    assert [line[0] for line in found] == ["ID number", "ada"]


@pytest.mark.parametrize(
    ("options", "words"),
    [({"assignment": ["ps5"]}, "expected some of ps3, ps4, got ps5"), ({"student": ["bob"]}, "got bob")],
)
def test_what_is_not_there_is_refused(db, tmp_path, options, words):
    """A name that the gradebook does not know is named, and an earlier file stays as it is."""
    (tmp_path / "m.csv").write_text("earlier")
    with pytest.raises(ValueError, match=words), Gradebook(db) as gradebook:
        MoodleExporter(to=str(tmp_path / "m.csv"), **options).export(gradebook)
    assert (tmp_path / "m.csv").read_text() == "earlier"


@pytest.mark.parametrize("begin", ["=", "+", "-", "@", "\t", "\r", "  =", "\uff1d"])
def test_no_text_begins_as_a_formula(begin):
    """Whatever a spreadsheet takes for a formula has an apostrophe before it."""
    assert safe(f"{begin}1") == f"'{begin}1"


def test_the_stock_command_uses_it(db, tmp_path):
    """`nbgrader export --exporter` finds the class, and says who waits for a person."""
    command = [
        sys.executable,
        "-m",
        "nbgrader",
        "export",
        "--exporter=autograder.lms.CanvasExporter",
        f"--db={db}",
    ]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "ps4: left empty for 1 students, whose work waits for a person" in done.stderr
    assert (tmp_path / "canvas.csv").read_text(encoding="utf-8").startswith('"Student","ID",')
