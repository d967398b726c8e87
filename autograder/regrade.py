"""Grading again what was graded with other checks, and nothing else: `python -m autograder regrade ASSIGNMENT`.

Every graded notebook says which versions of the release, the checks and the packages it was graded with. Where one of
them is another one now, the notebook is graded again through the ordinary autograding step, and old and new score are
put side by side. What a person gave stays, and where the answer is still the same it does not wait for a person again.
Killed at any moment, the same command does what is left.
"""

from __future__ import annotations

import json
from collections import Counter
from contextlib import chdir, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nbgrader.api import Gradebook, MissingEntry
from nbgrader.apps import NbGraderAPI
from traitlets import Dict, List, Unicode

from .interrupted import is_interrupted
from .parallel import ParallelAutograde
from .provenance import record
from .repair import read_release
from .secret import course_root
from .standalone import CONFIG, UsageError, course_config, quiet

if TYPE_CHECKING:
    from collections.abc import Iterator

    from nbgrader.coursedir import CourseDirectory

    from .parallel import Submission

WORDS = {"release": "another release", "checks": "other checks", "environment": "other packages"}
UNKNOWN = "no record"
INTERRUPTED = "its grading was broken off"


@dataclass(frozen=True)
class Stale:
    """A graded notebook whose grade comes from other versions than the present ones.

    Attributes
    ----------
    student, notebook : str
        Whose, and which.
    reason : str
        What has changed since.
    """

    student: str
    notebook: str
    reason: str


@dataclass(frozen=True)
class Change:
    """What became of a notebook that was graded again.

    Attributes
    ----------
    student, notebook, reason : str
        As in `Stale`.
    before, after : float
        Its points, a person's included, less what lateness costs; what waits for a person counts as given so far.
    """

    student: str
    notebook: str
    reason: str
    before: float
    after: float


class Regrade(ParallelAutograde):
    """The autograding step for one notebook of some students, graded before or not."""

    students = List(Unicode(), help="Whose notebook to grade again.")
    marked = Dict(help="The answers that a person has given points for; see `_marked`.")

    def init_notebooks(self) -> None:
        """Find the submissions of these students."""
        super().init_notebooks()
        self.assignments = {
            folder: files
            for folder, files in self.assignments.items()
            if self._submission(folder).student in self.students
        }

    def _store_notebook(self, filename: str, submission: Submission) -> None:
        """Save the grades; answers that are the same still, and have a person's points, do not wait for a person."""
        super()._store_notebook(filename, submission)
        one, assignment = Stale(submission.student, Path(filename).stem, ""), submission.assignment
        with Gradebook(self.coursedir.db_url, self.coursedir.course_id) as gradebook:
            for at, (text, waits) in _marked(self.coursedir, gradebook, assignment, one).items():
                if waits and self.marked.get(at) == (text, False):
                    grade = gradebook.find_grade(at[-1], one.notebook, assignment, one.student)
                    grade.needs_manual_grade = False
            gradebook.db.commit()


def stale(api: NbGraderAPI, assignment: str) -> list[Stale]:
    """Find the graded notebooks that the present grader has not graded.

    Parameters
    ----------
    api : nbgrader.apps.NbGraderAPI
        Of the course.
    assignment : str
        Which assignment.

    Returns
    -------
    list of Stale
        By student and notebook. A submission that was never graded is none: `nbgrader autograde` grades it.

    Raises
    ------
    UsageError
        If the gradebook knows no such assignment.
    """
    directory = api.coursedir
    with Gradebook(directory.db_url, directory.course_id) as gradebook:
        try:
            names = sorted(notebook.name for notebook in gradebook.find_assignment(assignment).notebooks)
        except MissingEntry:
            known = ", ".join(sorted(one.name for one in gradebook.assignments)) or "none"
            raise UsageError(
                f"assignment: expected one of the gradebook's ({known}), got {assignment}"
            ) from None
        students = sorted(one.student.id for one in gradebook.assignment_submissions(assignment))
    found = []
    for name in names:
        now = record({cell.name: cell.source for cell in read_release(directory.db_url, assignment, name)})
        for student in students:
            folder = directory.format_path(directory.autograded_directory, student, assignment)
            path = Path(folder, f"{name}.ipynb")
            reason = _reason(path, now) if path.is_file() else ""
            if is_interrupted(path.parent):
                reason = INTERRUPTED
            if reason:
                found.append(Stale(student, name, reason))
    return sorted(found, key=lambda one: (one.student, one.notebook))


def _reason(path: Path, now: dict[str, str]) -> str:
    """Say in what a graded notebook's record differs from the present versions; "" where it does not."""
    try:
        then = json.loads(path.read_bytes())["metadata"]["grading"]
        return ", ".join(words for key, words in WORDS.items() if then[key] != now[key])
    except (ValueError, KeyError, TypeError):
        return UNKNOWN


def regrade(
    assignment: str, root: Path | None = None, *, dry_run: bool = False
) -> tuple[list[Stale], list[Change]]:
    """Grade again what the present grader has not graded.

    Parameters
    ----------
    assignment : str
        Which assignment.
    root : pathlib.Path, optional
        The course: the folder of its `nbgrader_config.py`; found from the working directory if not given.
    dry_run : bool
        Whether to look only.

    Returns
    -------
    stale : list of Stale
        What was to be graded again.
    changes : list of Change
        What became of it; empty after a dry run.

    Raises
    ------
    UsageError
        If there is no such course or assignment.
    nbgrader.converters.base.NbGraderException
        If the grader could not do its work.
    """
    with _course(root or course_root()) as api:
        todo = stale(api, assignment)
        if dry_run or not todo:
            return todo, []
        before, marked = _scores(api, assignment), {}
        with Gradebook(api.coursedir.db_url, api.coursedir.course_id) as gradebook:
            for one in todo:
                marked |= _marked(api.coursedir, gradebook, assignment, one)
        for name in sorted({one.notebook for one in todo}):
            students = sorted({one.student for one in todo if one.notebook == name})
            directory = api.coursedir
            directory.assignment_id, directory.student_id, directory.notebook_id = assignment, "*", name
            step = Regrade(coursedir=directory, parent=api, force=True, students=students, marked=marked)
            step.start()
        after = _scores(api, assignment)
    return todo, [
        Change(one.student, one.notebook, one.reason, before[at], after[at])
        for one in todo
        if (at := (one.student, one.notebook)) in before
    ]


@contextmanager
def _course(root: Path) -> Iterator[NbGraderAPI]:
    """Give nbgrader with a course's own folders and gradebook."""
    if not (root / CONFIG).is_file():
        raise UsageError(f"expected the folder of a course, with its {CONFIG}, got {root}")
    config = course_config(root)
    directory = config.CourseDirectory
    directory.setdefault("root", str(root))
    # An address such as sqlite:///gradebook.db counts from there, as for nbgrader's commands.
    with chdir(root), quiet(NbGraderAPI(config=config)) as api:
        yield api


def _scores(api: NbGraderAPI, assignment: str) -> dict[tuple[str, str], float]:
    """Return the points of each notebook of an assignment, less what lateness costs, by student and name."""
    with Gradebook(api.coursedir.db_url, api.coursedir.course_id) as gradebook:
        return {
            (submission.student.id, notebook.name): float(
                notebook.score - (notebook.late_submission_penalty or 0)
            )
            for submission in gradebook.assignment_submissions(assignment)
            for notebook in submission.notebooks
        }


def _marked(
    directory: CourseDirectory, gradebook: Gradebook, assignment: str, one: Stale
) -> dict[tuple[str, str, str], tuple[str, bool]]:
    """Return the answers that a person has given points for: text, and whether they wait for a person.

    Test cells are not among them: a test that changes may say something else of the same answer.
    """
    folder = directory.format_path(directory.autograded_directory, one.student, assignment)
    try:
        cells = json.loads(Path(folder, f"{one.notebook}.ipynb").read_bytes())["cells"]
        grades = gradebook.find_submission_notebook(one.notebook, assignment, one.student).grades
    except (OSError, ValueError, KeyError, TypeError, MissingEntry):
        return {}
    given = {grade.name: grade for grade in grades if grade.manual_score is not None}
    found = {}
    for cell in cells:
        meta = cell["metadata"].get("nbgrader", {})
        if (meta.get("solution") or meta.get("task")) and (grade := given.get(meta["grade_id"])):
            text = "".join(cell["source"])
            found[one.student, one.notebook, grade.name] = text, bool(grade.needs_manual_grade)
    return found


def as_text(todo: list[Stale], changes: list[Change], *, dry_run: bool) -> str:
    """Return what was found and done for a person to read.

    Parameters
    ----------
    todo : list of Stale
        What was to be graded again.
    changes : list of Change
        What became of it.
    dry_run : bool
        Whether nothing was done.

    Returns
    -------
    str
        A line for each notebook whose score changed, or after a dry run for each that would be graded again, and a
        summary.
    """
    if not todo:
        return (
            "Nothing to do: every graded notebook was graded with the present release, checks and packages.\n"
        )
    reasons = ", ".join(
        f"{reason}: {count}" for reason, count in sorted(Counter(one.reason for one in todo).items())
    )
    lines: list[Any] = []
    if dry_run:
        lines += [f"{one.student}  {one.notebook}  {one.reason}" for one in todo]
        return "\n".join([*lines, f"{len(todo)} notebooks would be graded again ({reasons})."]) + "\n"
    moved = [one for one in changes if one.before != one.after]
    width = max((len(one.student) for one in moved), default=0)
    lines += [
        f"{one.student:{width}}  {one.notebook}  {one.before:g} -> {one.after:g}  ({one.after - one.before:+g})"
        for one in moved
    ]
    summary = f"{len(changes)} notebooks graded again ({reasons}), {len(moved)} scores changed."
    return "\n".join([*lines, summary]) + "\n"
