"""Feedback that shows what was tested and how it went, and nothing that was hidden."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from nbformat.v4 import new_markdown_cell
from nbgrader.preprocessors import NbGraderPreprocessor
from traitlets import List, Unicode

from .analysis import analyse
from .check import ORDINARY_ERRORS
from .outputs import error
from .repair import NOTICE
from .roles import EXPLANATION, has_hidden_part, role_of, visible_part

if TYPE_CHECKING:
    from nbformat import NotebookNode

PLACEHOLDER = "# (hidden tests)"
_MARK_SCHEME = re.compile(r"^[^\n]*BEGIN MARK SCHEME.*?END MARK SCHEME[^\n]*$", re.MULTILINE | re.DOTALL)
# Errors whose text is the grader's own, not the submission's.
_OWN = frozenset(
    {"SubmissionStopped", "LimitExceeded", "ProcessDied", "MemoryExceeded", "CellStopped", "NothingHandedIn"}
)
_FLAGGED = "GraderError"  # its text is for a person: it may name a class of the submission's, or say what did not cross


class LeakFreeFeedback(NbGraderPreprocessor):
    """Take hidden tests, their inputs and what hidden calls printed out of a notebook before a student sees it."""

    # The HTML exporter sets it for every preprocessor, and warns of one that does not know it.
    display_data_priority = List(Unicode()).tag(config=True)

    def preprocess(self, nb: NotebookNode, resources: dict[str, Any]) -> tuple[NotebookNode, dict[str, Any]]:
        """Return the notebook as a student may see it."""
        for cell in nb.cells:
            if cell.cell_type != "code":
                cell.source = _MARK_SCHEME.sub("", cell.source).rstrip()
            elif role_of(cell) == "test" and has_hidden_part(cell.source):
                names = analyse(cell.source).loads
                cell.source = visible_part(cell.source).rstrip() + "\n" + PLACEHOLDER
                cell.outputs = [
                    shown for output in cell.outputs if (shown := _shown(output, names)) is not None
                ]
            for output in cell.get("outputs", []):
                output.get("data", {}).pop(EXPLANATION, None)
                _describe_pictures(output)
        notices = nb.metadata.get(NOTICE, [])
        if notices:
            text = "**Notes on this file**\n\n" + "\n".join(f"* {_plain(notice)}" for notice in notices)
            nb.cells.insert(0, new_markdown_cell(text))
        return nb, resources


def _describe_pictures(output: Any) -> None:
    """Give pictures without an alternative text one."""
    for kind in ("image/png", "image/jpeg"):
        if kind in output.get("data", {}) and not output.metadata.get("alt"):
            output.metadata.setdefault(kind, {}).setdefault("alt", "figure that this cell drew")


def _shown(output: Any, names: frozenset[str]) -> Any:
    """Return what a student sees of a hidden test's output: reports, scores, and which error it was."""
    if output.output_type == "stream":
        return None
    if output.output_type != "error":
        return output
    if output.ename in _OWN:
        return error(output.ename, output.evalue)  # without the lines of the test that stand around the call
    if output.ename == _FLAGGED:
        return error(_FLAGGED, "a person will look at this cell")
    # A submission can raise a NameError with a hidden input in the place of the name: only the test's own are shown.
    missing = (
        re.fullmatch(r"name '(\w+)' is not defined", output.evalue) if output.ename == "NameError" else None
    )
    if missing and missing[1] in names:
        return error(output.ename, output.evalue)
    # The kind of an error can be chosen too: one that no honest mistake raises is not named.
    return error(output.ename if output.ename in ORDINARY_ERRORS else "Error", "a hidden test failed")


def _plain(text: str) -> str:
    return "".join(c if c.isalnum() or c in " .,:;()'-_/" else " " for c in text)
