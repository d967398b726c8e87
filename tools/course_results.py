"""What became of a class, and where that is not what its hand-written tables expect."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from nbgrader.api import Gradebook

import course_report
import sample_class

if TYPE_CHECKING:
    from nbformat import NotebookNode

SAMPLES = Path(__file__).resolve().parents[1] / "samples"
MANUAL, MISSING = "manual", "no row"
DIAGNOSIS = "diagnosis"


@dataclass(frozen=True)
class Result:
    """What became of one student: a score, `MANUAL` or `MISSING` by grade cell, and the recognised mistakes."""

    scores: dict[str, str] = field(default_factory=dict)
    diagnosis: str = ""


def read_expected(path: Path) -> dict[str, Result]:
    """Read the table of what must come out: a line for each student, a column for each grade cell."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {row.pop("student"): Result(row, row.pop(DIAGNOSIS)) for row in rows}


def differences(expected: dict[str, Result], found: dict[str, Result]) -> list[str]:
    """Say where a class came out otherwise than expected.

    Parameters
    ----------
    expected, found : dict of str to Result
        By student.

    Returns
    -------
    list of str
        A line for each difference; empty if there is none.
    """
    lines = [
        f"{name}: expected in the gradebook, got no such student" for name in sorted(expected.keys() - found)
    ]
    lines += [f"{name}: in the gradebook, but not in the table" for name in sorted(found.keys() - expected)]
    for name in sorted(expected.keys() & found):
        want, got = expected[name], found[name]
        for cell in sorted(want.scores | got.scores):
            pair = want.scores.get(cell, MISSING), got.scores.get(cell, MISSING)
            if not _equal(*pair):
                lines.append(f"{name}, {cell}: expected {pair[0]}, got {pair[1]}")
        if want.diagnosis != got.diagnosis:
            lines.append(f"{name}: expected the diagnosis {want.diagnosis!r}, got {got.diagnosis!r}")
    return lines


def _equal(want: str, got: str) -> bool:
    if {want, got} & {MANUAL, MISSING}:
        return want == got
    return abs(float(want) - float(got)) < 1e-9


Class = dict[str, dict[str, sample_class.Sample]]
"""What each student hands in, by notebook; see `sample_class.deal`."""


@dataclass(frozen=True)
class Assignment:
    """An assignment of the sample class: its name, the sources of its notebooks, and who hands in what."""

    name: str
    sources: dict[str, NotebookNode]
    students: Class


def read_results(course: Path, assignment: Assignment) -> dict[str, dict[str, Result]]:
    """Read what became of the class from its gradebook and its graded notebooks: results by notebook and sample.

    A student who handed in nothing of a notebook stands there with the own name.
    """
    found: dict[str, dict[str, Result]] = {}
    with Gradebook(f"sqlite:///{course}/gradebook.db") as gradebook:
        for notebook in gradebook.find_assignment(assignment.name).notebooks:
            names = [cell.name for cell in [*notebook.grade_cells, *notebook.task_cells]]
            rows = found[notebook.name] = {}
            for submission in notebook.submissions:
                student = submission.student.id
                sample = assignment.students.get(student, {}).get(notebook.name)
                grades = {grade.cell.name: _score(grade) for grade in submission.grades}
                path = course / "autograded" / student / assignment.name / f"{notebook.name}.ipynb"
                rows[sample.name if sample else student] = Result(
                    {name: grades.get(name, MISSING) for name in names}, course_report.diagnosis(path)
                )
    return found


def compare(assignment: Assignment, found: dict[str, dict[str, Result]]) -> list[str]:
    """Say where the class came out otherwise than the tables expect."""
    faults = []
    for notebook in sorted(assignment.sources):
        results = found.get(notebook, {})
        expected = read_expected(SAMPLES / assignment.name / notebook / "expected.csv")
        handed_in = {student: has.get(notebook) for student, has in assignment.students.items()}
        samples = {sample.name for sample in handed_in.values() if sample}
        expected = {name: row for name, row in expected.items() if name in samples}
        for name in sorted(student for student, sample in handed_in.items() if not sample):
            scores = results[name].scores if name in results else {"any cell": MISSING}
            expected[name] = Result(dict.fromkeys(scores, "0"))
        faults += [f"{notebook}: {line}" for line in differences(expected, results)]
    return faults


def _score(grade: object) -> str:
    if grade.auto_score is None and not grade.needs_manual_grade:
        return MISSING
    return MANUAL if grade.needs_manual_grade else f"{grade.auto_score + (grade.extra_credit or 0):g}"
