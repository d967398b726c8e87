"""Grading notebooks on their own: no course folder, no gradebook that stays, the same grader.

`nbgrader autograde` grades a class that has been collected into the course's folders. Here any notebook is graded
where it lies: it becomes the submission of a nameless student in a course that lives in a temporary folder, with a
gradebook of its own and the configuration of the real course: limits, sandbox and checks are the ones of the class.
What is reported about a cell is what feedback shows: never a hidden test, its inputs, or what a hidden call printed.

Only the notebook itself is handed in; files beside it are not. Files of the assignment are there as they are for the
class.
"""

from __future__ import annotations

import logging
import os
import shutil
import sys
import tempfile
import warnings
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import nbformat
from nbgrader.api import Gradebook
from nbgrader.apps import NbGraderAPI
from nbgrader.utils import is_grade, is_task
from sqlalchemy.exc import SAWarning
from traitlets.config import Config
from traitlets.config.loader import PyFileConfigLoader

from .feedback import LeakFreeFeedback
from .parallel import ParallelAutograde
from .plugin import configure
from .repair import NOTICE
from .roles import REVIEW
from .secret import course_root

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from nbformat import NotebookNode

CONFIG = "nbgrader_config.py"
RECOGNISED = "  Recognised mistake: "  # how a line of a report begins that names one; see `report`


class UsageError(ValueError):
    """The request cannot be understood; the text says in one line what is wrong and what would be right."""


@dataclass(frozen=True)
class CellGrade:
    """What became of one graded cell.

    Attributes
    ----------
    name : str
        Its grade id.
    score : float or None
        Points earned, extra credit included; None where a person decides.
    points : float
        What it is worth; extra credit does not count.
    report : str
        What the test says, as text.
    diagnoses : tuple of str
        Mistakes that were recognised.
    flagged : str
        Why the grader could not judge the cell; empty where it could, or where a person marks it anyway.
    """

    name: str
    score: float | None
    points: float
    report: str = ""
    diagnoses: tuple[str, ...] = ()
    flagged: str = ""


@dataclass(frozen=True)
class NotebookGrade:
    """What became of one notebook.

    Attributes
    ----------
    file : str
        As it was named in the request.
    assignment, notebook : str
        What it was graded as.
    cells : tuple of CellGrade
        In the order of the notebook.
    notices : tuple of str
        What had to be mended in the file before it could be graded.
    versions : dict of str to str
        Of the run, the release, the checks and the packages.
    """

    file: str
    assignment: str
    notebook: str
    cells: tuple[CellGrade, ...]
    notices: tuple[str, ...] = ()
    versions: dict[str, str] = field(default_factory=dict)

    @property
    def score(self) -> float:
        """The points given by the grader."""
        return sum(cell.score for cell in self.cells if cell.score is not None)

    @property
    def points(self) -> float:
        """What the grader could have given."""
        return sum(cell.points for cell in self.cells if cell.score is not None)

    @property
    def waiting(self) -> float:
        """The points a person has yet to decide on."""
        return sum(cell.points for cell in self.cells if cell.score is None)


@dataclass(frozen=True)
class Task:
    """A file, and what it is graded as."""

    file: str
    assignment: str
    notebook: str


def course_config(root: Path) -> Config:
    """Return the configuration of a course, its relative folders made absolute.

    Parameters
    ----------
    root : pathlib.Path
        The folder of its `nbgrader_config.py`; without that file, nbgrader's defaults hold.

    Returns
    -------
    traitlets.config.Config
        With submissions isolated, whether or not the file says so.
    """
    config = Config()
    if (root / CONFIG).is_file():
        config = PyFileConfigLoader(CONFIG, path=str(root)).load_config()
    configure(config)
    directory = config.CourseDirectory
    given = directory.get("source_directory", "source")
    directory.source_directory = str(root / given)
    return config


def find_tasks(files: Sequence[str], source: Path, assignment: str = "") -> list[Task]:
    """Find out what each file is a submission of.

    Parameters
    ----------
    files : sequence of str
        Notebooks. A file of the name of a released notebook is a submission of that one; any name will do where
        the assignment is given and has only one notebook.
    source : pathlib.Path
        Folder of the source notebooks, `<assignment>/<name>.ipynb`.
    assignment : str, optional
        Which assignment; looked for in all of them if not given.

    Returns
    -------
    list of Task
        One for each file, in order.

    Raises
    ------
    UsageError
        If a file is not there, or fits no assignment or several.
    """
    known = [
        path for path in sorted(source.glob("*/*.ipynb")) if not path.name.startswith(".")
    ]  # a checkpoint lies a folder deeper
    if not known:
        raise UsageError(f"no assignment has a source notebook in {source}; `make notebooks` makes them")
    if assignment:
        names = sorted({path.parent.name for path in known})
        known = [path for path in known if path.parent.name == assignment]
        if not known:
            raise UsageError(f"--assignment: expected one of {', '.join(names)}, got {assignment}")
    return [_task(file, known, given=bool(assignment)) for file in files]


def _task(file: str, known: list[Path], *, given: bool) -> Task:
    if not Path(file).is_file():
        raise UsageError(f"{file}: expected a notebook, got no such file")
    fitting = [path for path in known if path.stem == Path(file).stem]
    if not fitting and given and len(known) == 1:
        fitting = known
    names = ", ".join(f"{path.parent.name}/{path.name}" for path in fitting or known)
    if not fitting:
        raise UsageError(f"{file}: expected the file name of a released notebook ({names}), or --assignment")
    if len(fitting) > 1:
        raise UsageError(
            f"{file}: several assignments have a notebook of that name ({names}); give --assignment"
        )
    return Task(file, fitting[0].parent.name, fitting[0].stem)


def grade_files(files: Sequence[str], assignment: str = "", root: Path | None = None) -> list[NotebookGrade]:
    """Grade notebooks on their own.

    Parameters
    ----------
    files : sequence of str
        Notebooks; see :func:`find_tasks`.
    assignment : str, optional
        Which assignment they belong to.
    root : pathlib.Path, optional
        The course: the folder of its `nbgrader_config.py`; found from the working directory if not given.

    Returns
    -------
    list of NotebookGrade
        One for each file, in order.

    Raises
    ------
    UsageError
        If it is not clear what to grade.
    nbgrader.converters.base.NbGraderException
        If the grader could not do its work: no sandbox, a faulty assignment.
    """
    config = course_config(root or course_root())
    tasks = find_tasks(files, Path(config.CourseDirectory.source_directory), assignment)
    with tempfile.TemporaryDirectory(prefix="grade-") as folder, _api(config, Path(folder)) as api:
        for name in sorted({task.assignment for task in tasks}):
            result = api.generate_assignment(name, force=True)
            if not result["success"]:
                raise RuntimeError(f"nbgrader cannot release {name}:\n{result.get('log', '')}")
        students = [f"submission-{number:04d}" for number in range(len(tasks))]
        for student, task in zip(students, tasks, strict=True):
            target = Path(folder, "submitted", student, task.assignment, f"{task.notebook}.ipynb")
            target.parent.mkdir(parents=True)
            shutil.copyfile(task.file, target)
        for what in sorted({(task.assignment, task.notebook) for task in tasks}):
            # The other notebooks of an assignment were not handed in for grading: they are not missing.
            api.coursedir.assignment_id, api.coursedir.notebook_id = what
            ParallelAutograde(coursedir=api.coursedir, parent=api).start()
        return [_collect(api, Path(folder), *pair) for pair in zip(students, tasks, strict=True)]


@contextmanager
def _api(config: Config, folder: Path) -> Iterator[NbGraderAPI]:
    """Give nbgrader with a course of its own in a folder."""
    own = Config()
    own.CourseDirectory.root = str(folder)
    own.CourseDirectory.db_url = f"sqlite:///{folder}/gradebook.db"
    own.CourseDirectory.student_id = "*"
    for kind in ("release", "submitted", "autograded", "feedback"):
        own.CourseDirectory[f"{kind}_directory"] = kind
    own.ParallelAutograde.create_student = True
    own.ParallelAutograde.progress = False
    config.merge(own)
    with quiet(NbGraderAPI(config=config)) as api:
        yield api


@contextmanager
def quiet(api: NbGraderAPI) -> Iterator[NbGraderAPI]:
    """Let nbgrader say nothing but what goes wrong, and find alembic.

    It calls alembic from the path, where an environment that is not activated does not stand.

    Parameters
    ----------
    api : nbgrader.apps.NbGraderAPI
        Of a course.

    Yields
    ------
    nbgrader.apps.NbGraderAPI
        The same.
    """
    before, level = os.environ.get("PATH", os.defpath), api.log.level
    handler = logging.StreamHandler()  # without an application of nbgrader's the log goes nowhere
    api.log.addHandler(handler)
    os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), before])
    api.log.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SAWarning)  # nbgrader's own queries, which work
            yield api
    finally:
        api.log.removeHandler(handler)
        api.log.setLevel(level)
        os.environ["PATH"] = before


def _collect(api: NbGraderAPI, folder: Path, student: str, task: Task) -> NotebookGrade:
    """Read a notebook's grades from the gradebook, and its reports as feedback shows them."""
    path = folder / "autograded" / student / task.assignment / f"{task.notebook}.ipynb"
    notebook = nbformat.read(path, as_version=4)
    notices = tuple(notebook.metadata.get(NOTICE, ()))
    flagged = {_name(cell): cell.metadata[REVIEW] for cell in notebook.cells if cell.metadata.get(REVIEW)}
    shown, _ = LeakFreeFeedback(parent=api).preprocess(notebook, {})
    with Gradebook(api.coursedir.db_url, api.coursedir.course_id) as gradebook:
        found = gradebook.find_submission_notebook(task.notebook, task.assignment, student)
        grades = {grade.name: grade for grade in found.grades}
        scores = {
            name: None
            if grade.needs_manual_grade or grade.auto_score is None
            else float(grade.auto_score) + float(grade.extra_credit or 0)
            for name, grade in grades.items()
        }
        points = {name: float(grade.max_score) for name, grade in grades.items()}
        extra = {name for name, grade in grades.items() if grade.extra_credit is not None}
    cells = [
        cell
        for cell in shown.cells
        if (is_grade(cell) or is_task(cell)) and (points.get(_name(cell)) or _name(cell) in extra)
    ]
    return NotebookGrade(
        task.file,
        task.assignment,
        task.notebook,
        tuple(
            _cell_grade(cell, scores[_name(cell)], points[_name(cell)], flagged.get(_name(cell), ""))
            for cell in cells
        ),
        notices,
        {name: text for name, text in notebook.metadata.get("grading", {}).items() if name != "seconds"},
    )


def _name(cell: NotebookNode) -> str:
    return cell.metadata.get("nbgrader", {}).get("grade_id", "")


def _cell_grade(cell: NotebookNode, score: float | None, points: float, flagged: str) -> CellGrade:
    report = "\n".join(filter(None, map(_text, cell.get("outputs", ())))) if cell.cell_type == "code" else ""
    return CellGrade(_name(cell), score, points, report, recognised(report), flagged)


def _text(output: Any) -> str:
    """Return an output of a test cell as text; the score itself is reported elsewhere."""
    if output.output_type == "error":
        return f"{output.ename}: {output.evalue}".rstrip(": ")
    if output.output_type == "stream":
        return output.text.rstrip()
    return "" if output.output_type == "execute_result" else output.data.get("text/plain", "").rstrip()


def recognised(report: str) -> tuple[str, ...]:
    r"""Return the mistakes that a report names.

    Parameters
    ----------
    report : str
        See `autograder.report.Report`.

    Returns
    -------
    tuple of str
        Their titles, with the outputs they explain.

    Examples
    --------
    >>> recognised("motion.compute_dynamics: 4 of 10 points\n  Recognised mistake: euler step (g, Gx).\n    Hold ...")
    ('euler step (g, Gx)',)
    """
    lines = [line for line in report.splitlines() if line.startswith(RECOGNISED)]
    return tuple(line.removeprefix(RECOGNISED).removesuffix(".") for line in lines)
