"""What a cell is to nbgrader, read from its metadata without importing nbgrader."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nbformat import NotebookNode

EXPLANATION = "application/vnd.roboloc.explanation"  # media type of what only the instructor may read
REVIEW = "needs_review"
EXTRA = (
    "application/vnd.roboloc.extra+json"  # display data with which a test cell of 0 points gives extra credit
)
_HIDDEN = re.compile(
    r"^[ \t]*#+ BEGIN HIDDEN TESTS.*?^[ \t]*#+ END HIDDEN TESTS[^\n]*$", re.MULTILINE | re.DOTALL
)


def role_of(cell: NotebookNode) -> str:
    """Return the role of a code cell.

    Parameters
    ----------
    cell : NotebookNode
        A code cell.

    Returns
    -------
    {"test", "given", "answer", "plain"}
        A test cell; a locked cell of the instructor's; a cell the release gives to the student; any other.
    """
    info = cell.metadata.get("nbgrader", {})
    if info.get("solution"):
        return "answer"
    if info.get("grade"):
        return "test"
    return "given" if info.get("locked") else "plain"


def grade_id(cell: NotebookNode) -> str:
    """Return a cell's name in the gradebook; empty where it has none."""
    return cell.metadata.get("nbgrader", {}).get("grade_id", "")


def visible_part(source: str) -> str:
    r"""Return a test cell's source without its hidden tests.

    Parameters
    ----------
    source : str
        The source.

    Returns
    -------
    str
        What students were given.

    Examples
    --------
    >>> visible_part("n = 1\n### BEGIN HIDDEN TESTS\nassert n\n### END HIDDEN TESTS")
    'n = 1\n'
    """
    return _HIDDEN.sub("", source)


def has_hidden_part(source: str) -> bool:
    """Return whether a test cell has hidden tests."""
    return visible_part(source) != source
