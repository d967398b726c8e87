"""`python -m autograder grade`: the same grades as the class gets, in three forms, and nothing that is hidden."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import nbformat
import pytest
from temporary_course import CUBE, GRADED, HIDDEN, SQUARE, Course, environment

from autograder import __main__ as command
from autograder import standalone
from autograder.grading import grade, grading_run
from autograder.misconceptions.motion_model import euler_step
from autograder.notebook_grades import CellGrade, NotebookGrade, recognised
from autograder.standalone import UsageError, find_tasks

WRONG = "import sys\ndef square(x):\n    print('given', x)\n    return 2 * x"


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """Make a course with a right, a half right and an unreadable submission."""
    made = Course.create(tmp_path_factory.mktemp("standalone") / "course")
    made.submit("good")
    made.submit("wrong", square=WRONG, why="\x1b[31mRed <script>alert(1)</script>")
    made.submit_file("broken", "{")
    return made


def paths(course, *students):
    """Return the notebooks of students."""
    return [str(course.folder(student) / "powers.ipynb") for student in students]


def run(course, *arguments, **variables):
    """Run the command in the course's folder."""
    return subprocess.run(
        [sys.executable, "-m", "autograder", *arguments],
        cwd=course.root, env=environment(**variables), capture_output=True, text=True, timeout=180, check=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def graded(course):
    """Grade three submissions; return the process and its JSON."""
    done = run(course, "grade", *paths(course, "good", "wrong", "broken"), "--format", "json")
    assert done.returncode == 0, done.stderr
    return done, json.loads(done.stdout)


@pytest.fixture
def grades(graded):
    """Return the same as objects."""
    found = []
    for fields in graded[1]["notebooks"]:
        cells = tuple(CellGrade(**cell | {"diagnoses": tuple(cell["diagnoses"])}) for cell in fields["cells"])
        kept = {name: fields[name] for name in ("file", "assignment", "notebook", "notices", "versions")}
        found.append(NotebookGrade(**kept, cells=cells))
    return found


def test_every_cell_has_its_score(graded):
    """A right, a half right and an unreadable notebook get full, part and no points; written answers wait."""
    done, result = graded
    assert done.stderr == ""
    assert result["schema"] == 1
    good, wrong, broken = result["notebooks"]
    assert [(n["score"], n["points"], n["waiting"]) for n in (good, wrong)] == [(5, 5, 5), (3, 5, 5)]
    assert broken["score"] == 0
    for notebook in (good, wrong, broken):
        assert {cell["name"]: cell["points"] for cell in notebook["cells"]} == GRADED
        assert (notebook["assignment"], notebook["notebook"]) == ("powers", "powers")
    assert [cell["score"] for cell in good["cells"]] == [2, 3, None]
    assert [cell["score"] for cell in wrong["cells"]] == [0, 3, None]
    assert "not JSON" in broken["notices"][0]


def test_schema_is_the_documented_one(graded):
    """The JSON has the fields that the module's docstring lists, and no others."""
    _, result = graded
    assert set(result) == {"schema", "notebooks"}
    for notebook in result["notebooks"]:
        assert set(notebook) == {
            "file", "assignment", "notebook", "score", "points", "waiting", "notices", "versions", "cells",
        }  # fmt: skip
        assert set(notebook["versions"]) == {"run", "release", "checks", "environment"}
        for cell in notebook["cells"]:
            assert set(cell) == {"name", "score", "points", "report", "diagnoses", "flagged", "explanation"}
    for name in ("schema", "versions", "waiting", "notices", "diagnoses", "flagged", "explanation"):
        assert f"`{name}`" in command.__doc__


def test_nothing_hidden_is_told(graded, grades):
    """A failed hidden test says that it failed: not its inputs, not its text, not what the call printed."""
    done, _ = graded
    assert "AssertionError: a hidden test failed" in done.stdout
    for make in command.FORMATS.values():
        text = make(grades)
        assert not [secret for secret in (*HIDDEN, "given", "Traceback") if secret in text]


def test_same_grades_as_the_class(course, graded, tmp_path):
    """`nbgrader autograde` in the course gives the very scores."""
    class_ = course.copy(tmp_path / "class")
    class_.grade()
    rows = class_.rows()
    for student, notebook in zip(("good", "wrong", "broken"), graded[1]["notebooks"], strict=True):
        expected = {name: None if manual else score for name, (score, manual) in rows[student].items()}
        assert {cell["name"]: cell["score"] for cell in notebook["cells"]} == expected


def test_text_is_readable_and_cannot_steer_a_terminal(grades):
    """The text has a line for each cell, and no control character of a submission."""
    text = command.as_text(grades)
    for line in ("3 of 5 points, 5 more to be marked by a person", "  square-test: 0 of 2", "  why: - of 5",
                 "    A person marks this one.", "  Note: the file is not a notebook"):  # fmt: skip
        assert line in text
    assert all(c == "\n" or c.isprintable() for c in text)


def test_gradescope_results(grades):
    """Gradescope gets tests with names, scores, texts and a total that is the sum of them."""
    result = json.loads(command.as_gradescope(grades[1:2]))
    assert result["score"] == 3
    assert result["stdout_visibility"] == "hidden"
    square, cube, why = result["tests"]
    assert square == {
        "name": "square-test", "score": 0.0, "max_score": 2.0, "status": "failed", "visibility": "visible",
        "output": "AssertionError: a hidden test failed", "output_format": "text",
    }  # fmt: skip
    assert (cube["score"], cube["max_score"], cube["status"]) == (3, 3, "passed")
    assert why["output"] == command.WAITING
    assert "score" not in why


def test_extra_credit_adds_to_the_score_alone(grades):
    """What was earned beyond the points is a test of 0 points, what was not earned a remark, in every form."""
    cells = [
        CellGrade(name, score, 0.0, f"{score:g} of 2 extra points")
        for name, score in (("a", 2.0), ("b", 0.0))
    ]
    grade = replace(grades[0], cells=(*grades[0].cells, *cells))
    assert (grade.score, grade.points) == (grades[0].score + 2, grades[0].points)
    text = command.as_text([grade])
    assert "  a: 2 extra\n    2 of 2 extra points" in text
    assert "  b: 0 extra\n    0 of 2 extra points" in text
    (shown,) = json.loads(command.as_json([grade]))["notebooks"]
    assert [(cell["score"], cell["points"]) for cell in shown["cells"][-2:]] == [(2, 0), (0, 0)]
    result = json.loads(command.as_gradescope([grade]))
    earned, missed = result["tests"][-2:]
    assert result["score"] == sum(test.get("score", 0) for test in result["tests"]) == grade.score
    assert (earned["score"], earned["max_score"], earned["status"]) == (2, 0, "passed")
    assert not {"score", "max_score", "status"} & missed.keys()
    assert missed["output"] == "0 of 2 extra points"


def test_recognised_mistakes_are_listed():
    """A misconception of the motion model is named in the list of diagnoses, and its report stays."""
    with grading_run(secret="a course", publish=lambda _: None):  # noqa: S106
        score = grade("motion.compute_dynamics", euler_step, points=10)
    titles = [d.title for d in score.report.diagnoses if d.known]
    assert titles
    found = recognised(str(score.report))
    assert [text.partition(" (")[0] for text in found] == titles


def test_output_goes_to_a_file(course, grades, tmp_path, monkeypatch, capsys):
    """With --output the result is in the file and nothing on the terminal."""
    monkeypatch.setattr(standalone, "grade_files", lambda *_, **__: grades[:1])
    target = tmp_path / "results.json"
    arguments = ["grade", *paths(course, "good"), "--format", "gradescope", "--output", str(target)]
    assert command.main(arguments) == 0
    assert json.loads(target.read_text(encoding="utf-8"))["score"] == 5
    assert capsys.readouterr().out == ""


def test_flagged_cell_has_no_score_and_says_why(grades):
    """What the grader could not judge is null, never 0; the reason is there, but not where students read it."""
    cell = replace(
        grades[0].cells[0], score=None, report="GraderError: x", flagged="the test itself is faulty"
    )
    grade = replace(grades[0], cells=(cell, *grades[0].cells[1:]))
    assert (grade.score, grade.points, grade.waiting) == (3, 3, 7)
    assert "person will look at it. The reason: the test itself is faulty" in command.as_text([grade])
    assert "faulty" not in command.as_gradescope([grade])
    assert (
        json.loads(command.as_json([grade]))["notebooks"][0]["cells"][0]["flagged"]
        == "the test itself is faulty"
    )
    assert json.loads(command.as_json([grade]))["notebooks"][0]["cells"][0]["score"] is None
    assert "score" not in json.loads(command.as_gradescope([grade]))["tests"][0]


# ---------------------------------------------------------------- bad usage


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "required: grade"),
        (["grade"], "required: NOTEBOOK"),
        (["grade", "{good}", "--format", "pdf"], "invalid choice: 'pdf'"),
        (["grade", "nowhere.ipynb"], "nowhere.ipynb: expected a notebook, got no such file or directory"),
        (["grade", "."], ".: expected a notebook, got is a directory"),
        (["grade", "{good}", "--assignment", "ps9"], "--assignment: expected one of powers, got ps9"),
        (["grade", "{other}"], "expected the file name of a released notebook (powers/powers.ipynb)"),
        (["grade", "{good}", "{good}", "--format", "gradescope"], "got two of one name"),
        (
            ["grade", "{good}", "--explain", "--format", "gradescope"],
            "--explain: expected --format text or json",
        ),
        (
            ["grade", "{good}", "--output", "no/folder/x"],
            "--output: expected a file in a folder that is there",
        ),
    ],
)
def test_bad_usage_is_one_clear_line(course, monkeypatch, capsys, arguments, said):
    """A wrong request ends with status 2 and one line that says what would be right."""
    monkeypatch.chdir(course.root)
    other = course.root / "else.ipynb"
    other.write_text("{}", encoding="utf-8")
    words = [word.format(good=paths(course, "good")[0], other=other) for word in arguments]
    try:
        status = command.main(words)
    except SystemExit as error:
        status = error.code
    captured = capsys.readouterr()
    assert status == 2
    assert captured.out == ""
    last = captured.err.strip().splitlines()[-1]
    assert said in last
    assert "Traceback" not in captured.err


def test_bad_usage_of_the_process(course):
    """The exit status of the process is 2 as well."""
    done = run(course, "grade", "nowhere.ipynb")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)


def test_missing_sandbox_is_status_1(course, tmp_path):
    """Without bubblewrap nothing is graded: status 1, the remedy, no result."""
    (tmp_path / "alembic").symlink_to(Path(sys.executable).parent / "alembic")
    done = subprocess.run(
        [sys.executable, "-m", "autograder", "grade", *paths(course, "good")],
        cwd=course.root, env=os.environ | {"PATH": str(tmp_path)}, capture_output=True, text=True, timeout=180,
        check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert done.stdout == ""
    assert "apt-get install bubblewrap" in done.stderr
    assert "Traceback" not in done.stderr


def test_file_name_tells_the_assignment(tmp_path):
    """A name that fits one notebook is that one; with the assignment given any name fits its only notebook."""
    for name in ("a/one", "a/two", "b/three", "c/three"):
        path = tmp_path / "source" / f"{name}.ipynb"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("{}", encoding="utf-8")
    files = {}
    for name in ("one", "three", "x"):
        files[name] = tmp_path / f"{name}.ipynb"
        files[name].touch()
    source = tmp_path / "source"

    def found(name, assignment=""):
        (task,) = find_tasks([str(files[name])], source, assignment)
        return task.assignment, task.notebook

    assert found("one") == ("a", "one")
    assert found("three", "b") == found("x", "b") == ("b", "three")
    with pytest.raises(UsageError, match="several assignments"):
        found("three")
    with pytest.raises(UsageError, match="file name of a released notebook"):
        found("x", "a")
    with pytest.raises(UsageError, match="make notebooks"):
        find_tasks([str(files["one"])], tmp_path / "nothing")


def test_submission_is_only_read(course, graded):
    """The graded file is as it was, and nothing is left beside it."""
    folder = course.folder("good")
    assert [path.name for path in folder.iterdir()] == ["powers.ipynb"]
    notebook = nbformat.read(folder / "powers.ipynb", as_version=4)
    sources = [cell.source for cell in notebook.cells]
    assert SQUARE in sources
    assert CUBE in sources
    assert not any(cell.get("outputs") for cell in notebook.cells)
    assert not (course.root / "gradebook.db").exists() or course.rows() == {}
