"""`python -m autograder grade NOTEBOOK...`: grade notebooks without the course's gradebook; `regrade` a class.

Usage: `python -m autograder grade NOTEBOOK... [--assignment NAME] [--format text|json|gradescope] [--output FILE]
[--explain]`

Each notebook is graded as the assignment that its file name belongs to (or `--assignment`), in the sandbox and with the
limits of the course's `nbgrader_config.py`: the nearest one at or above the working directory, else the one of this
project. Nothing is kept. The exit status is 0 where grading worked, whatever the score; 1 where the grader could not do
its work (no sandbox); 2 where the request was wrong. Errors are one or a few lines on stderr.

`--format text` is for people. `--format json` is one object; within `schema` 1 fields may be added, none changes:

* `schema`: 1.
* `notebooks`: a list in the order of the request, each with
    * `file`, `assignment`, `notebook`: strings;
    * `score`, `points`: numbers, what the grader gave and could have given; extra credit adds to `score` alone;
    * `waiting`: number, the points that a person has yet to decide on;
    * `notices`: strings, what had to be mended in the file before it could be graded;
    * `versions`: object of strings: `run`, `release`, `checks`, `environment`;
    * `cells`: a list in the order of the notebook, each with
        * `name`: string, the cell's grade id;
        * `score`: number, or null where a person decides;
        * `points`: number; 0 where the cell gives extra credit;
        * `report`: string, what the test says: what feedback shows a student;
        * `diagnoses`: strings, the mistakes that were recognised;
        * `flagged`: string, why the grader could not judge the cell, for a person alone, since a submission may have a
          say in the words; empty where it could;
        * `explanation`: string, with `--explain`; else empty.

`--explain` is for whoever answers an appeal, and shows what is hidden: of each check its points and its calls; of a
failed one the first call at fault, with what went in, what is right and what came back. Not for `gradescope`, which
students read.

`--format gradescope` is a `results.json` of Gradescope's autograders: one submission, so one notebook of a kind. Its
`score` is the sum of the tests that have a score; a cell that a person marks is a test without one, and says so, and so
is extra credit that was not earned. What was earned is a test of `max_score` 0.

Usage: `python -m autograder regrade ASSIGNMENT [--dry-run]`

In a course's folder: the submissions that were graded with other checks, another release or other packages than the
present ones are graded again, no others, and each score that changed is shown with the one before. `--dry-run` only
says which.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .notebook_grades import CellGrade, NotebookGrade

SCHEMA = 1
WAITING = "A person marks this one."
# What moves a terminal's cursor or colours it, written by a submission.
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def as_text(grades: Sequence[NotebookGrade]) -> str:
    """Return grades for a person to read.

    Parameters
    ----------
    grades : sequence of NotebookGrade
        What was graded.

    Returns
    -------
    str
        A paragraph for each cell.
    """
    return "\n\n".join(_paragraphs(grade) for grade in grades) + "\n"


def _paragraphs(grade: NotebookGrade) -> str:
    waiting = f", {grade.waiting:g} more to be marked by a person" if grade.waiting else ""
    lines = [
        f"{grade.file}: {grade.score:g} of {grade.points:g} points{waiting}  ({grade.assignment}/{grade.notebook})",
        *(f"  Note: {notice}" for notice in grade.notices),
    ]
    for cell in grade.cells:
        score = "-" if cell.score is None else f"{cell.score:g}"
        lines += ["", f"  {cell.name}: {score} " + (f"of {cell.points:g}" if cell.points else "extra")]
        why = f" The reason: {cell.flagged}" if cell.flagged else ""
        lines += [f"    {line}" for line in (_body(cell) + why).splitlines()]
    return "\n".join(_CONTROL.sub("", line) for line in lines)


def _body(cell: CellGrade) -> str:
    """Return what is said about a cell."""
    if cell.flagged:
        return "Not judged by the grader; a person will look at it."
    return cell.explanation or cell.report or (WAITING if cell.score is None else "")


def as_json(grades: Sequence[NotebookGrade]) -> str:
    """Return grades in the schema of this module's docstring.

    Parameters
    ----------
    grades : sequence of NotebookGrade
        What was graded.

    Returns
    -------
    str
        JSON.
    """
    notebooks = [
        asdict(grade) | {"score": grade.score, "points": grade.points, "waiting": grade.waiting}
        for grade in grades
    ]
    return json.dumps({"schema": SCHEMA, "notebooks": notebooks}, indent=2) + "\n"


def as_gradescope(grades: Sequence[NotebookGrade]) -> str:
    """Return grades as Gradescope's `results.json`.

    Parameters
    ----------
    grades : sequence of NotebookGrade
        The notebooks of one submission.

    Returns
    -------
    str
        JSON.
    """
    several = len(grades) > 1
    tests = [
        _test(cell, f"{grade.notebook}: " if several else "") for grade in grades for cell in grade.cells
    ]
    notices = [notice for grade in grades for notice in grade.notices]
    result = {
        "score": sum(grade.score for grade in grades),
        "output": _CONTROL.sub("", "\n".join(f"Note: {notice}" for notice in notices)),
        "output_format": "text",
        "test_output_format": "text",
        "test_name_format": "text",
        "visibility": "visible",
        "stdout_visibility": "hidden",
        "tests": tests,
    }
    return json.dumps(result, indent=2) + "\n"


def _test(cell: CellGrade, prefix: str) -> dict[str, Any]:
    found: dict[str, Any] = {
        "name": prefix + cell.name,
        "output": _CONTROL.sub("", _body(cell)),
        "output_format": "text",
        "visibility": "visible",
    }
    if cell.score is None or not (cell.score or cell.points):  # a test without a score is shown as a remark
        return found
    status = "passed" if cell.score >= cell.points else "failed"
    return found | {"score": cell.score, "max_score": cell.points, "status": status}


FORMATS = {"text": as_text, "json": as_json, "gradescope": as_gradescope}


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(prog="python -m autograder", description="Grade notebooks in the sandbox.")
    commands = made.add_subparsers(dest="command", required=True, metavar="grade|regrade")
    grade = commands.add_parser(
        "grade",
        help="grade notebooks without the course's gradebook",
        description="Grade notebooks in the sandbox, without the course's gradebook; nothing is kept.",
    )
    grade.add_argument("notebooks", nargs="+", metavar="NOTEBOOK", help="a submission's .ipynb file")
    grade.add_argument(
        "--assignment", default="", metavar="NAME", help="what it is (default: by its file name)"
    )
    grade.add_argument(
        "--format", choices=sorted(FORMATS), default="text", help="of the result (default: text)"
    )
    grade.add_argument("--explain", action="store_true", help="show what the checks asked, hidden inputs too")
    grade.add_argument("--output", metavar="FILE", type=Path, help="where the result goes (default: stdout)")
    again = commands.add_parser(
        "regrade",
        help="grade again what was graded with other checks",
        description="Grade again the submissions of an assignment that were graded with other checks, another release "
        "or other packages, and show old and new scores.",
    )
    again.add_argument("assignment", metavar="ASSIGNMENT", help="which")
    again.add_argument("--dry-run", action="store_true", help="only say what would be graded again")
    return made


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Of the command line.

    Returns
    -------
    int
        0 where grading worked, 1 where it could not be done, 2 where the request was wrong.
    """
    options = parser().parse_args(arguments)
    return (
        _grade(options)
        if options.command == "grade"
        else _regrade(options.assignment, dry_run=options.dry_run)
    )


def _misused(options: argparse.Namespace) -> str:
    """Say what is wrong with the options before anything is graded; nothing if they fit."""
    if options.output is not None and not options.output.absolute().parent.is_dir():
        return f"--output: expected a file in a folder that is there, got {options.output}"
    if options.format != "gradescope":
        return ""
    names = [Path(name).stem for name in options.notebooks]
    if len(set(names)) < len(names):
        return "--format gradescope: expected the notebooks of one submission, got two of one name"
    if options.explain:
        return "--explain: expected --format text or json, got gradescope, which students read"
    return ""


def _grade(options: argparse.Namespace) -> int:
    # Only now: these imports take a second, a wrong option should not.
    from nbgrader.converters.base import NbGraderException  # noqa: PLC0415

    from .standalone import UsageError, grade_files  # noqa: PLC0415

    if fault := _misused(options):
        return _complain(fault, 2)
    try:
        grades = grade_files(options.notebooks, options.assignment, explain=options.explain)
    except UsageError as error:
        return _complain(str(error), 2)
    except NbGraderException:  # its log has said why
        return 1
    except RuntimeError as error:
        return _complain(str(error), 1)
    text = FORMATS[options.format](grades)
    if options.output is None:
        sys.stdout.write(text)
    else:
        options.output.write_text(text, encoding="utf-8")
    return 0


def _regrade(assignment: str, *, dry_run: bool) -> int:
    from nbgrader.converters.base import NbGraderException  # noqa: PLC0415

    from .regrade import as_text, regrade  # noqa: PLC0415
    from .standalone import UsageError  # noqa: PLC0415

    try:
        todo, changes = regrade(assignment, dry_run=dry_run)
    except UsageError as error:
        return _complain(str(error), 2)
    except NbGraderException:  # its log has said why
        return 1
    sys.stdout.write(as_text(todo, changes, dry_run=dry_run))
    return 0


def _complain(message: str, status: int) -> int:
    sys.stderr.write(f"python -m autograder: {message}\n")
    return status


if __name__ == "__main__":
    sys.exit(main())
