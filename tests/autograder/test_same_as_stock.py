"""An honest class scores, cell by cell, as under stock nbgrader, with the same notebooks and the same secret."""

import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import nbgrader
import pytest
from nbgrader.api import Gradebook

import course
import notebooks

ROOT = Path(__file__).resolve().parents[2]
QUICKSTART = Path(nbgrader.__file__).parent / "docs" / "source" / "user_guide"
PLAIN = 'c = get_config()\nc.CourseDirectory.db_url = "sqlite:///gradebook.db"\nc.ExecutePreprocessor.timeout = 120\n'
ISOLATED = PLAIN + "from autograder.plugin import configure\nconfigure(c)\n"
ASSIGNMENT = "ekf-localization"
HONEST = ["perfect", "blank", "mistake-gx-transposed", "mistake-division-by-zero"]
ALSO = {("perfect", "association-and-update")}  # of the others motion-model


def nbgrader_command(folder, *arguments):
    """Run a stock nbgrader command in a course."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
    done = subprocess.run(
        [sys.executable, "-m", "nbgrader", *arguments],
        cwd=folder, env=os.environ | {"PATH": path, "ROBOLOC_SECRET": "the same"},
        capture_output=True, text=True, check=False, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]


def grade(folder, configuration, assignment, source, submitted):
    """Release and grade an assignment in a course of its own; return all scores by student, notebook and cell."""
    folder.mkdir()
    (folder / "nbgrader_config.py").write_text(configuration)
    shutil.copytree(source, folder / "source" / assignment)
    shutil.copytree(submitted, folder / "submitted")
    nbgrader_command(folder, "generate_assignment", assignment)
    nbgrader_command(folder, "autograde", assignment)
    with Gradebook(f"sqlite:///{folder}/gradebook.db") as gradebook:
        return {
            (submission.student.id, notebook.name, grade.cell.name): (
                grade.auto_score,
                grade.needs_manual_grade,
            )
            for submission in gradebook.assignment_submissions(assignment)
            for notebook in submission.notebooks
            for grade in notebook.grades
        }


def both(folder, assignment, source, submitted):
    """Grade an assignment with stock nbgrader and with isolation."""
    stock = grade(folder / "stock", PLAIN, assignment, source, submitted)
    return stock, grade(folder / "isolated", ISOLATED, assignment, source, submitted)


@pytest.fixture(scope="module")
def honest(tmp_path_factory):
    """Grade the honest part of the sample class both ways."""
    folder = tmp_path_factory.mktemp("honest")
    shutil.copytree(ROOT / "solutions" / ASSIGNMENT, folder / "solutions" / ASSIGNMENT)
    notebooks.build_sources(folder / "solutions", folder / "source")
    (assignment,) = (one for one in course.assignments(folder) if one.name == ASSIGNMENT)
    students = {
        name: {n: sample for n, sample in has.items() if (name, n) in ALSO or n == "motion-model"}
        for name, has in assignment.students.items()
        if name in HONEST
    }
    course.hand_in(folder, replace(assignment, students=students), 0)
    handed_in = {(name, notebook) for name, has in students.items() for notebook in has}
    stock, isolated = both(folder, ASSIGNMENT, folder / "source" / ASSIGNMENT, folder / "submitted")
    return tuple(
        {cell: found for cell, found in scores.items() if cell[:2] in handed_in}
        for scores in (stock, isolated)
    )


def test_an_honest_class_scores_as_under_stock(honest):
    """Right answers, mistakes and a blank notebook get the same score in each cell."""
    stock, isolated = honest
    assert isolated == stock


def test_the_honest_class_is_not_all_alike(honest):
    """The comparison is of full, partial and no marks, and of every cell of every student."""
    stock, _ = honest
    assert {student for student, _, _ in stock} == set(HONEST)
    assert len({notebook for _, notebook, _ in stock}) == 2
    assert len(stock) == 8 * (len(HONEST) + len(ALSO))
    scores = {(student, cell): score for (student, _, cell), (score, _) in stock.items()}
    assert scores["perfect", "dynamics-test"] == 10
    assert scores["mistake-gx-transposed", "dynamics-test"] == 8
    assert scores["mistake-division-by-zero", "transition-test"] == 2.4
    assert scores["blank", "dynamics-test"] == 0


def test_the_quickstart_assignment_scores_as_under_stock(tmp_path):
    """The ps1 of nbgrader itself, written for another course, scores its sample submissions as under stock."""
    stock, isolated = both(tmp_path, "ps1", QUICKSTART / "source" / "ps1", QUICKSTART / "submitted")
    assert isolated == stock
    assert len(stock) > 10
    assert len({score for score, _ in stock.values()}) > 2
