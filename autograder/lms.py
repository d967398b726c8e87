"""Grades as the gradebooks of Canvas and Moodle import them.

``nbgrader export --exporter=autograder.lms.CanvasExporter`` (or ``MoodleExporter``). Both have a line for each student
and a column for each assignment. What is not known is left empty, which neither system takes for a zero: work that was
not handed in, and work that a person has yet to mark. Every text is quoted, and one that a spreadsheet would take for
a formula has an apostrophe before it.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nbgrader.plugins import ExportPlugin
from traitlets import Bool, Dict, Unicode

if TYPE_CHECKING:
    from nbgrader.api import Assignment, Gradebook, Student, SubmittedAssignment

# What a spreadsheet takes for the beginning of a formula, full-width forms included.
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "\uff1d", "\uff0b", "\uff0d", "\uff20")


def safe(text: Any) -> str:
    """Return a text that no spreadsheet takes for a formula.

    Parameters
    ----------
    text : object
        A name, a number; None is nothing.

    Returns
    -------
    str
        The text, after an apostrophe where it begins as a formula does, also behind spaces.

    Examples
    --------
    >>> safe("=1+2"), safe("Ada"), safe(None), safe(" @sum")
    ("'=1+2", 'Ada', '', "' @sum")
    """
    written = "" if text is None else str(text)
    return f"'{written}" if written.startswith(_FORMULA) or written.lstrip().startswith(_FORMULA) else written


class GradebookExporter(ExportPlugin):
    """What the exporters for the two systems share: a line for each student, a column for each assignment."""

    default_name = "grades.csv"

    unmarked = Bool(
        False, help="Whether the points of work that a person has yet to mark are exported as they stand."
    ).tag(config=True)
    columns = Dict(
        key_trait=Unicode(),
        value_trait=Unicode(),
        help="The title of an assignment's column, if not its name.",
    ).tag(config=True)

    def export(self, gradebook: Gradebook) -> None:
        """Write the file; an earlier one of that name is replaced when the new one is whole.

        Parameters
        ----------
        gradebook : nbgrader.api.Gradebook
            Where the grades are.

        Raises
        ------
        ValueError
            If there is no assignment or student of a name that was asked for.
        """
        assignments = _chosen("assignment", gradebook.assignments, self.assignment, "name")
        students = _chosen("student", gradebook.students, self.student, "id")
        table = {one.name: self._scores(gradebook, one) for one in assignments}
        lines = [*self.head(assignments)]
        lines += [
            [*self.who(one), *(table[task.name].get(one.id, "") for task in assignments)] for one in students
        ]
        target = Path(self.to or self.default_name)
        part = target.with_name(f"{target.name}.part")
        with part.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, quoting=csv.QUOTE_ALL).writerows([map(safe, line) for line in lines])
        part.replace(target)
        self.log.info("%d students and %d assignments written to %s", len(students), len(assignments), target)

    def title(self, assignment: Assignment) -> str:
        """Return the title of an assignment's column."""
        return self.columns.get(assignment.name, assignment.name)

    def head(self, assignments: list[Assignment]) -> list[list[Any]]:
        """Return the lines before those of the students."""
        raise NotImplementedError

    def who(self, student: Student) -> list[Any]:
        """Return what names a student."""
        raise NotImplementedError

    def _scores(self, gradebook: Gradebook, assignment: Assignment) -> dict[str, str]:
        found, waiting = {}, 0
        for submission in gradebook.assignment_submissions(assignment.name):
            if submission.needs_manual_grade and not self.unmarked:
                waiting += 1
            else:
                found[submission.student.id] = _points(submission)
        if waiting:
            self.log.warning(
                "%s: left empty for %d students, whose work waits for a person", assignment.name, waiting
            )
        return found


def _points(submission: SubmittedAssignment) -> str:
    """Return what a submission is worth, lateness taken off."""
    return f"{max(0.0, submission.score - (submission.late_submission_penalty or 0.0)):g}"


def _chosen(kind: str, known: list[Any], wanted: list[Any], key: str) -> list[Any]:
    """Return those of a name that is wanted, or all, in the order of their names."""
    names = {getattr(one, key): one for one in known}
    missing = [str(name) for name in wanted if str(name) not in names]
    if missing:
        raise ValueError(f"{kind}: expected some of {', '.join(sorted(names))}, got {', '.join(missing)}")
    return [names[name] for name in sorted(map(str, wanted) if wanted else names)]


class CanvasExporter(GradebookExporter):
    """A file for the import of Canvas's gradebook.

    A student is found by the login, which is the student's id here, or by the number in `lms_user_id`. Canvas finds an
    assignment by the title of its column, ``Name (number)``: give it as ``columns``, or choose the assignment when the
    file is imported.
    """

    default_name = "canvas.csv"

    def head(self, assignments: list[Assignment]) -> list[list[Any]]:
        """Return the names of the columns, and what each assignment is worth."""
        names = ["Student", "ID", "SIS User ID", "SIS Login ID", "Section"]
        return [
            [*names, *map(self.title, assignments)],
            ["    Points Possible", *[""] * (len(names) - 1), *(f"{one.max_score:g}" for one in assignments)],
        ]

    def who(self, student: Student) -> list[Any]:
        """Return name, number, and login."""
        name = ", ".join(filter(None, (student.last_name, student.first_name))) or student.id
        return [name, student.lms_user_id, "", student.id, ""]


class MoodleExporter(GradebookExporter):
    """A file for the import of Moodle's gradebook: a student is found by ID number or by e-mail address."""

    default_name = "moodle.csv"

    def head(self, assignments: list[Assignment]) -> list[list[Any]]:
        """Return the names of the columns."""
        return [["ID number", "Email address", *map(self.title, assignments)]]

    def who(self, student: Student) -> list[Any]:
        """Return number and address."""
        return [student.id, student.email]
