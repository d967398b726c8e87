"""Grading again after a change: what changed, nothing else, and the scores before and after."""

import contextlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from nbgrader.api import Gradebook
from temporary_course import ASSIGNMENT, NOTEBOOK, Course, environment, source_notebook

from autograder import provenance
from autograder.__main__ import main
from autograder.interrupted import MARKER
from autograder.parallel import ParallelAutograde
from autograder.regrade import Change, Stale, as_text, regrade
from autograder.standalone import UsageError

HARDER = "assert [cube(n) for n in (-1, 0, 2)] == [-1, 0, 8]"
EASIER = "assert cube(1) == 1"
ONES = "def cube(x):\n    return 1"


def graded(course):
    """Return the records of what the class was graded with, by student."""
    found = {}
    for path in Path(course.root, "autograded").glob(f"*/{ASSIGNMENT}/{NOTEBOOK}.ipynb"):
        found[path.parts[-3]] = json.loads(path.read_text(encoding="utf-8"))["metadata"]["grading"]
    return found


@pytest.fixture
def said(course, monkeypatch, capsys):
    """Return a function that gives the command in the course's folder and returns its status and what it says."""
    monkeypatch.chdir(course.root)

    def say(*arguments):
        status = main(["regrade", *arguments])
        return status, *capsys.readouterr()

    return say


@pytest.fixture(scope="module")
def before(tmp_path_factory):
    """Grade a class of two, one of whom knows that a cube is 1; a person has marked the answer of the other."""
    course = Course.create(tmp_path_factory.mktemp("regrade") / "course")
    course.submit("ada")
    course.submit("bob", cube=ONES)
    course.grade()
    with Gradebook(course.db_url) as gradebook:
        gradebook.find_grade("why", NOTEBOOK, ASSIGNMENT, "ada").manual_score = 4.0
        gradebook.db.commit()
    return course


@pytest.fixture
def course(before, tmp_path):
    """Give a copy of the graded course."""
    return before.copy(tmp_path / "course")


def test_nothing_is_graded_again_where_nothing_has_changed(course, said):
    """The command says so, and touches no file."""
    records = graded(course)
    status, out, _ = said(ASSIGNMENT)
    assert status == 0
    assert out.startswith("Nothing to do")
    assert graded(course) == records


def test_a_changed_test_is_graded_again_and_a_persons_points_stay(course, said):
    """An easier hidden test is released: all are graded again, one score grows, the marked answer keeps its points."""
    notebook = source_notebook()
    for cell in notebook.cells:
        cell.source = cell.source.replace(HARDER, EASIER)
    nbformat.write(notebook, course.root / "source" / ASSIGNMENT / f"{NOTEBOOK}.ipynb")
    with course.api() as api:
        assert api.generate_assignment(ASSIGNMENT, force=True)["success"]
    assert said(ASSIGNMENT, "--dry-run")[1].splitlines() == [
        "ada  powers  another release",
        "bob  powers  another release",
        "2 notebooks would be graded again (another release: 2).",
    ]
    done = subprocess.run(
        [sys.executable, "-m", "autograder", "regrade", ASSIGNMENT],
        cwd=course.root, env=environment(), capture_output=True, text=True, timeout=180, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [
        "bob  powers  2 -> 5  (+3)",
        "2 notebooks graded again (another release: 2), 1 scores changed.",
    ]
    with Gradebook(course.db_url) as gradebook:
        assert gradebook.find_submission(ASSIGNMENT, "ada").score == 9
    assert said(ASSIGNMENT)[1].startswith("Nothing to do")


def test_only_who_was_graded_with_other_checks_is_graded_again(course):
    """One of two has the record of an earlier grader: the other is left alone."""
    forget(course, "bob")
    runs = {student: found["run"] for student, found in graded(course).items()}
    todo, changes = regrade(ASSIGNMENT, course.root)
    assert todo == [Stale("bob", NOTEBOOK, "other checks")]
    assert changes == [Change("bob", NOTEBOOK, "other checks", 2.0, 2.0)]
    now = {student: found["run"] for student, found in graded(course).items()}
    assert now["ada"] == runs["ada"]
    assert now["bob"] != runs["bob"]


def forget(course, student, notebook=NOTEBOOK):
    """Let a graded notebook have the record of an earlier grader."""
    path = course.folder(student, "autograded") / f"{notebook}.ipynb"
    text = json.loads(path.read_text(encoding="utf-8"))
    text["metadata"]["grading"]["checks"] = "0123456789ab"
    path.chmod(0o644)
    path.write_text(json.dumps(text), encoding="utf-8")


def mark(course, student, notebook=NOTEBOOK):
    """Give a written answer four points, as a person does in the formgrader."""
    with Gradebook(course.db_url) as gradebook:
        grade = gradebook.find_grade("why", notebook, ASSIGNMENT, student)
        grade.manual_score, grade.needs_manual_grade = 4.0, False
        gradebook.db.commit()


def waits(course, student, notebook=NOTEBOOK):
    """Return points and whether the written answer waits for a person."""
    with Gradebook(course.db_url) as gradebook:
        grade = gradebook.find_grade("why", notebook, ASSIGNMENT, student)
        return grade.manual_score, grade.needs_manual_grade


def test_the_other_notebook_of_a_student_is_left_alone(tmp_path):
    """Of two notebooks the one with an earlier record is graded again, and no marked answer waits afterwards."""
    course = Course.create(tmp_path / "course")
    nbformat.write(source_notebook(), course.root / "source" / ASSIGNMENT / "more.ipynb")
    with course.api() as api:
        assert api.generate_assignment(ASSIGNMENT, force=True)["success"]
    course.submit("ada")
    shutil.copy(course.folder("ada") / f"{NOTEBOOK}.ipynb", course.folder("ada") / "more.ipynb")
    course.grade()
    for name in (NOTEBOOK, "more"):
        mark(course, "ada", name)
    forget(course, "ada")
    other = course.folder("ada", "autograded") / "more.ipynb"
    kept = other.stat().st_mtime_ns
    assert regrade(ASSIGNMENT, course.root)[1] == [Change("ada", NOTEBOOK, "other checks", 9.0, 9.0)]
    assert other.stat().st_mtime_ns == kept
    assert waits(course, "ada") == waits(course, "ada", "more") == (4.0, False)
    assert not (other.parent / MARKER).exists()


def test_an_answer_that_changed_waits_for_a_person_again(course):
    """What a person marked stays with its points, and where the text is another one the person looks again."""
    mark(course, "ada")
    course.submit("ada", why="Because of this.")
    forget(course, "ada")
    regrade(ASSIGNMENT, course.root)
    assert waits(course, "ada") == (4.0, True)


def test_what_lateness_costs_is_in_the_scores(course, said):
    """A penalty that is new shows, though the checks give the same."""
    course.submit_file("bob", "2026-01-02 12:00:00 UTC", "timestamp.txt")
    with Gradebook(course.db_url) as gradebook:
        gradebook.update_or_create_assignment(ASSIGNMENT, duedate="2026-01-01 12:00:00 UTC")
    with (course.root / "nbgrader_config.py").open("a", encoding="utf-8") as file:
        file.write('get_config().LateSubmissionPlugin.penalty_method = "zero"\n')
    forget(course, "bob")
    assert said(ASSIGNMENT)[1].splitlines()[0] == "bob  powers  2 -> 0  (-2)"


@pytest.mark.parametrize("moment", ["_read", "_store_notebook"])
def test_what_was_broken_off_is_finished_by_the_same_command(course, monkeypatch, moment):
    """Killed while it grades one notebook again, the command grades the whole submission when it is given again."""
    forget(course, "bob")
    with monkeypatch.context() as patch:
        patch.setattr(ParallelAutograde, moment, lambda *_: os._exit(9))
        child = os.fork()
        if not child:
            with contextlib.suppress(BaseException):
                regrade(ASSIGNMENT, course.root)
            os._exit(1)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 9
    todo, changes = regrade(ASSIGNMENT, course.root)
    assert [one.reason for one in todo] == ["its grading was broken off"]
    assert [(one.student, one.after) for one in changes] == [("bob", 2.0)]
    assert regrade(ASSIGNMENT, course.root) == ([], [])


def test_what_is_not_there_is_refused(said, tmp_path):
    """An assignment or a course that is not there is a wrong request."""
    status, out, error = said("roots")
    assert (status, out) == (2, "")
    assert "expected one of the gradebook's (powers), got roots" in error
    with pytest.raises(UsageError, match="expected the folder of a course"):
        regrade(ASSIGNMENT, tmp_path)


def test_summary_counts_reasons():
    """Several reasons are counted, and a score that stayed has no line."""
    todo = [Stale("a", "n", "no record"), Stale("b", "n", "other checks, other packages")]
    changes = [
        Change("a", "n", "no record", 1.5, 1.5),
        Change("b", "n", "other checks, other packages", 3.0, 2.25),
    ]
    assert as_text(todo, changes, dry_run=False).splitlines() == [
        "b  n  3 -> 2.25  (-0.75)",
        "2 notebooks graded again (no record: 1, other checks, other packages: 1), 1 scores changed.",
    ]


# ---------------------------------------------------------------- versions


@pytest.mark.parametrize(
    ("stage", "inside", "outside"),
    [
        ("motion.compute_dynamics", "roboloc_reference.motion", "roboloc_reference.extraction"),
        ("extraction.merge", "autograder.checks.scan_scenes", "autograder.checks.motion_model"),
        ("foot_map.H_foot", "autograder.misconceptions.foot_map", "autograder.misconceptions.mast"),
    ],
)
def test_a_version_is_that_of_what_decides(stage, inside, outside):
    """The checks of a stage, its wrong versions and its reference are behind it, those of others are not."""
    behind = provenance._behind(stage)
    assert inside in behind
    assert outside not in behind


def test_a_change_changes_the_versions_of_what_it_is_behind(tmp_path, monkeypatch):
    """Another reference of the motion is another version of its stage, and none of the extraction's."""
    stages = "motion.compute_dynamics", "extraction.merge"
    before = [provenance._version.__wrapped__((stage,)) for stage in stages]
    changed = tmp_path / "motion.py"
    file = provenance._file
    changed.write_text(
        file("roboloc_reference.motion").read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8"
    )
    monkeypatch.setattr(
        provenance, "_file", lambda name: changed if name == "roboloc_reference.motion" else file(name)
    )
    after = [provenance._version.__wrapped__((stage,)) for stage in stages]
    assert [one != other for one, other in zip(before, after, strict=True)] == [True, False]


def test_tests_of_another_course_have_no_version_of_our_checks():
    """A notebook without a stage of ours is not graded again for a change in them."""
    assert provenance.record({"a": "assert f(2) == 4"})["checks"] == "none of ours"
    ours = provenance.record({"a": 'grade("extraction.merge", merge, points=3)'})
    assert ours["checks"] == provenance.checks_version("extraction.merge")
