"""Saving the grades of a notebook with two questions to the gradebook, and one answer.

nbgrader asks for the row of each cell by a join of seven tables, writes it and commits, which takes longer than most
notebooks take to run. Here the rows of a notebook are read together and committed together; a grader that is killed in
between leaves none of them changed. Extra credit that a test cell gives is written too, where nbgrader keeps what a
person gives; see `vectorised`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nbgrader.api import BaseCell, Comment, Grade, Gradebook, MissingEntry
from nbgrader.preprocessors import NbGraderPreprocessor, SaveAutoGrades
from nbgrader.utils import is_grade

from .roles import EXTRA

if TYPE_CHECKING:
    from nbformat import NotebookNode


def extra_credit(cell: NotebookNode) -> float | None:
    """Return the extra credit that a test cell of 0 points gives.

    Parameters
    ----------
    cell : NotebookNode
        Executed.

    Returns
    -------
    float or None
        None where it is no cell that gives any: what a person gave there is left alone.
    """
    if cell.cell_type != "code" or float(cell.metadata.nbgrader.get("points") or 0):
        return None
    for output in cell.outputs:
        if output.output_type == "display_data" and EXTRA in output.data:
            said = output.data[EXTRA]
            return min(max(float(said["earned"]), 0.0), float(said["of"]))
    return 0.0 if "grade_vectorised(" in cell.source else None


class Rows:
    """The rows of one student's notebook, in the place of the gradebook.

    Parameters
    ----------
    gradebook : nbgrader.api.Gradebook
        Where they are; who opened it commits.
    notebook, assignment, student : str
        Whose notebook, and which.
    """

    def __init__(self, gradebook: Gradebook, notebook: str, assignment: str, student: str) -> None:
        submitted = gradebook.find_submission_notebook(notebook, assignment, student)
        self._grades, self._comments = (
            dict(
                gradebook.db.query(BaseCell.name, row)
                .join(row, row.cell_id == BaseCell.id)
                .filter(row.notebook_id == submitted.id)
                .all()
            )
            for row in (Grade, Comment)
        )
        self.db = self  # of a gradebook's session only `commit` is asked for

    def find_grade(self, cell: str, *_: str) -> Grade:
        """Return the row of a grade cell or task."""
        return _find(self._grades, "grade", cell)

    def find_comment(self, cell: str, *_: str) -> Comment:
        """Return the row of a solution cell or task."""
        return _find(self._comments, "comment", cell)

    def commit(self) -> None:
        """Leave it to the end of the notebook."""


def _find(rows: dict[str, Any], kind: str, cell: str) -> Any:
    if cell not in rows:
        raise MissingEntry(f"No such {kind}: {cell}")
    return rows[cell]


class SaveGrades(SaveAutoGrades):
    """nbgrader's step that writes scores and automatic comments into the gradebook."""

    def preprocess(self, nb: NotebookNode, resources: dict[str, Any]) -> tuple[NotebookNode, dict[str, Any]]:
        """Save the grades of a notebook."""
        info = resources["nbgrader"]
        place = self.notebook_id, self.assignment_id, self.student_id = (
            info["notebook"], info["assignment"], info["student"],
        )  # fmt: skip
        with Gradebook(info["db_url"]) as gradebook:
            self.gradebook = Rows(gradebook, *place)
            nb, resources = NbGraderPreprocessor.preprocess(self, nb, resources)
            for cell in filter(is_grade, nb.cells):
                grade = self.gradebook.find_grade(cell.metadata.nbgrader["grade_id"], *place)
                extra = extra_credit(cell)
                if extra is not None and grade.manual_score is None:
                    grade.extra_credit = extra
            gradebook.db.commit()
        return nb, resources
