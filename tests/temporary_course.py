"""A small nbgrader course in a folder of its own, graded by our plug-in: two lines of configuration, nothing else.

Its assignment `powers` has two functions with hidden tests and a written answer, and takes next to no time to run.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import warnings
from dataclasses import dataclass, field
from pathlib import Path

import nbformat
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook
from nbgrader.api import Gradebook
from nbgrader.apps import NbGraderAPI
from sqlalchemy.exc import SAWarning
from traitlets.config import Config

from autograder.parallel import ParallelAutograde
from autograder.plugin import configure

ASSIGNMENT = NOTEBOOK = "powers"
TWO_LINES = "from autograder.plugin import configure\nconfigure(get_config())\n"
SQUARE = "def square(x):\n    return x * x"
CUBE = "def cube(x):\n    return x**3"
# What a hidden test has that nobody must see: the numbers, and the error's text.
HIDDEN = ("31337", "the square of a hidden number")
GRADED = {"square-test": 2.0, "cube-test": 3.0, "why": 5.0}


def solution(source):
    """Mark a source as the solution."""
    return f"### BEGIN SOLUTION\n{source}\n### END SOLUTION"


def hidden(source):
    """Mark a source as hidden tests."""
    return f"# Tested here.\n### BEGIN HIDDEN TESTS\n{source}\n### END HIDDEN TESTS"


def cell(make, source, grade_id=None, **fields):
    """Make a cell with nbgrader's metadata."""
    made = make(source, id=grade_id or "text")
    if grade_id:
        meta = {"schema_version": 3, "grade": False, "solution": False, "locked": False, "task": False}
        made.metadata["nbgrader"] = meta | {"grade_id": grade_id} | fields
    return made


def source_notebook():
    """Return the instructor's version of the assignment."""
    square = f"assert square(31337) == 31337**2, '{HIDDEN[1]}'\nassert square(-2) == 4"
    test = {"grade": True, "locked": True}
    return new_notebook(
        cells=[
            cell(new_markdown_cell, "# Powers"),
            cell(new_code_cell, solution(SQUARE), "square", solution=True),
            cell(new_code_cell, hidden(square), "square-test", points=2, **test),
            cell(new_code_cell, solution(CUBE), "cube", solution=True),
            cell(new_code_cell, hidden("assert [cube(n) for n in (-1, 0, 2)] == [-1, 0, 8]"), "cube-test",
                 points=3, **test),
            cell(new_markdown_cell, solution("Because."), "why", grade=True, solution=True, points=5),
        ],
        metadata={"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}},
    )  # fmt: skip


def environment(**more):
    """Return an environment in which nbgrader finds its commands."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
    return os.environ | {"PATH": path} | more


@dataclass(frozen=True)
class Course:
    """A course in a folder."""

    root: Path
    limits: dict = field(default_factory=dict)  # of `IsolatedExecute`, where not its own
    server: str = ""  # the gradebook's address where it is not in a file of the folder
    course_id: str = ""

    @classmethod
    def create(cls, root, notebook=None, server="", course_id="", **limits):
        """Make the course and release its assignment: the notebook above, or another one."""
        course = cls(root, limits, server, course_id)
        folder = root / "source" / ASSIGNMENT
        folder.mkdir(parents=True)
        settings = f"get_config().CourseDirectory.update({course.settings()!r})\n" if course_id else ""
        (root / "nbgrader_config.py").write_text(TWO_LINES + settings, encoding="utf-8")
        nbformat.write(notebook or source_notebook(), folder / f"{NOTEBOOK}.ipynb")
        with course.api() as api:
            result = api.generate_assignment(ASSIGNMENT)
        assert result["success"], result.get("log", "") + result.get("error", "")
        return course

    def copy(self, root):
        """Return a course that has what this one has, in another folder."""
        shutil.copytree(self.root, root)
        return Course(root, self.limits)

    @property
    def db_url(self):
        """The address of the gradebook."""
        return self.server or f"sqlite:///{self.root}/gradebook.db"

    def settings(self):
        """Return where the course is, as its configuration says it."""
        return {"root": str(self.root), "db_url": self.db_url, "course_id": self.course_id}

    @contextlib.contextmanager
    def api(self, **options):
        """Give nbgrader's programming interface, configured as the course's file says."""
        config = Config()
        configure(config)
        config.CourseDirectory.update(self.settings() | {"assignment_id": ASSIGNMENT})
        config.ParallelAutograde.update({"jobs": 1} | options)
        config.IsolatedExecute.update(self.limits)
        path, here = os.environ.get("PATH", ""), Path.cwd()
        os.environ["PATH"] = environment()["PATH"]
        os.chdir(self.root)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", SAWarning)
                yield NbGraderAPI(config=config)
        finally:
            os.chdir(here)
            os.environ["PATH"] = path

    def grade(self, **options):
        """Grade the class in this process."""
        with self.api(**options) as api:
            ParallelAutograde(coursedir=api.coursedir, parent=api).start()

    def nbgrader(self, *arguments, check=True, **variables):
        """Run a stock nbgrader command."""
        done = subprocess.run(
            self.command(*arguments), cwd=self.root, env=environment(**variables),
            capture_output=True, text=True, timeout=180, check=False,
        )  # fmt: skip
        assert not check or done.returncode == 0, done.stderr
        return done

    @staticmethod
    def command(*arguments):
        """Return a stock nbgrader command."""
        return [sys.executable, "-m", "nbgrader", *arguments]

    def folder(self, student, kind="submitted"):
        """Return a student's folder."""
        return self.root / kind / student / ASSIGNMENT

    def released(self):
        """Return the student version."""
        return nbformat.read(self.root / "release" / ASSIGNMENT / f"{NOTEBOOK}.ipynb", as_version=4)

    def submit(self, student, square=SQUARE, cube=CUBE, why="Because.", more=()):
        """Hand in a notebook with these answers and, before them, more cells."""
        notebook = self.released()
        answers = {"square": square, "cube": cube, "why": why}
        for node in notebook.cells:
            name = node.metadata.get("nbgrader", {}).get("grade_id")
            node.source = answers.get(name, node.source)
        notebook.cells[1:1] = [new_code_cell(source) for source in more]
        self.submit_file(student, nbformat.writes(notebook))

    def submit_file(self, student, text, name=f"{NOTEBOOK}.ipynb"):
        """Hand in a file."""
        folder = self.folder(student)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")

    def graded(self, student, kind="autograded"):
        """Return a student's executed notebook."""
        return nbformat.read(self.folder(student, kind) / f"{NOTEBOOK}.ipynb", as_version=4)

    def rows(self):
        """Return all that the gradebook says of each graded cell: automatic score, and whether a person must look."""
        with Gradebook(self.db_url) as gradebook:
            return {
                submission.student.id: {
                    grade.name: (grade.auto_score, grade.needs_manual_grade)
                    for notebook in submission.notebooks
                    for grade in notebook.grades
                }
                for submission in gradebook.assignment_submissions(ASSIGNMENT)
            }


def printed(notebook):
    """Return what the cells of a notebook printed."""
    return "".join(o.text for c in notebook.cells for o in c.get("outputs", ()) if o.output_type == "stream")
