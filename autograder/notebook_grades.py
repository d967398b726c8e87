"""What became of notebooks that were graded on their own: their cells' points and what the tests say of them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import nbformat
from nbgrader.api import Gradebook
from nbgrader.utils import is_grade, is_task

from .feedback import LeakFreeFeedback
from .repair import NOTICE
from .roles import EXPLANATION, REVIEW

if TYPE_CHECKING:
    from pathlib import Path

    from nbformat import NotebookNode
    from nbgrader.apps import NbGraderAPI

    from .standalone import Task

RECOGNISED = "  Recognised mistake: "  # how a line of a report begins that names one; see `report`


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
    explanation : str
        What the test asked, hidden inputs too; empty where it was not asked for.
    """

    name: str
    score: float | None
    points: float
    report: str = ""
    diagnoses: tuple[str, ...] = ()
    flagged: str = ""
    explanation: str = ""


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


def collect(api: NbGraderAPI, folder: Path, student: str, task: Task, *, explain: bool) -> NotebookGrade:
    """Read a notebook's grades from the gradebook, and its reports as feedback shows them.

    Parameters
    ----------
    api : nbgrader.apps.NbGraderAPI
        Of the course in which it was graded.
    folder : pathlib.Path
        Of that course.
    student : str
        Whose it is there.
    task : Task
        What was graded.
    explain : bool
        Whether the cells come with explanations.

    Returns
    -------
    NotebookGrade
        All that is to be said of it.
    """
    path = folder / "autograded" / student / task.assignment / f"{task.notebook}.ipynb"
    notebook = nbformat.read(path, as_version=4)
    notices = tuple(notebook.metadata.get(NOTICE, ()))
    flagged = {_name(cell): cell.metadata[REVIEW] for cell in notebook.cells if cell.metadata.get(REVIEW)}
    explained = {_name(cell): _explanation(cell) for cell in notebook.cells if explain}
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
            replace(
                _cell_grade(cell, scores[_name(cell)], points[_name(cell)], flagged.get(_name(cell), "")),
                explanation=explained.get(_name(cell), ""),
            )
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


def _explanation(cell: NotebookNode) -> str:
    """Return what a test cell said before anything was taken out; a report as it is explained."""
    if cell.cell_type != "code":
        return ""
    found = [output.get("data", {}).get(EXPLANATION) or _text(output) for output in cell.outputs]
    return "\n".join(filter(None, found))


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
