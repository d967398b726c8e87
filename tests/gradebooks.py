"""All that grading a class leaves: what two runs that should agree are compared by."""

from __future__ import annotations

import json
import re

from nbgrader.api import Gradebook
from temporary_course import ASSIGNMENT

_COUNT = re.compile(r"(?:Cell )?In *\S*\[(?:\x1b\[\S*?m)?\d+\S*?\]")
PASSING = ("run", "seconds")  # of the record in a notebook: differ from run to run


def whole(course):
    """Return all rows with scores, comments and times of handing in, and all files of `autograded`."""
    rows = {}
    with Gradebook(course.db_url) as gradebook:
        for submission in gradebook.assignment_submissions(ASSIGNMENT):
            for notebook in submission.notebooks:
                rows[submission.student.id, notebook.name] = (
                    str(submission.timestamp),
                    {
                        g.name: (g.auto_score, g.manual_score, g.extra_credit, g.needs_manual_grade)
                        for g in notebook.grades
                    },
                    {c.name: (c.auto_comment, c.manual_comment) for c in notebook.comments},
                )
    return rows, {str(path.relative_to(course.root)): _content(path) for path in files(course)}


def files(course):
    """Return the files of `autograded`."""
    return sorted(path for path in (course.root / "autograded").rglob("*") if path.is_file())


def _content(path):
    if path.suffix != ".ipynb":
        return path.read_bytes()
    notebook = json.loads(path.read_text(encoding="utf-8"))
    for name in PASSING:
        notebook["metadata"].get("grading", {}).pop(name, None)
    for cell in notebook["cells"]:
        for output in cell.get("outputs", ()):  # a traceback counts the cells that its process has run before
            output["traceback"] = [_COUNT.sub("In[n]", line) for line in output.get("traceback", ())]
    return notebook
