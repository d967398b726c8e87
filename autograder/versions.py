"""Which version of an assignment a submission was made from.

An assignment that has been released is sometimes released once more: a typing error, points, a question added or
renamed. Some students have fetched the first version by then, and what they hand in is graded as the present one: what
they wrote under a name that both versions have is theirs, given cells and tests are the present ones, and what they
wrote in a cell that the present version does not have runs as a cell of their own. This module notices it, says so in
the feedback, and sees to it that nobody gets an automatic 0 for a cell they were never given: a person decides.

Every cell of a release carries nbgrader's checksum of what students were given, also when the cell has been filled in.
The checksums of all cells together are the version; `nbgrader generate_assignment` writes each one, with its date, into
a table of the gradebook.
"""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import sqlalchemy as sa
from nbformat.v4 import new_output
from nbgrader import utils
from nbgrader.api import Gradebook
from nbgrader.preprocessors import ClearHiddenTests, ClearMarkScheme, NbGraderPreprocessor

from .roles import REVIEW, grade_id

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from nbformat import NotebookNode

NEW = "new_since_their_version"
REASON = "it is new since the version that this file was made from"
SAID = f"A person will look at this cell: {REASON}."
_CHECKSUM = re.compile(r"[0-9a-f]{32}")
_NAMED = 12
_TABLE = sa.Table(
    "released_version",
    sa.MetaData(),
    sa.Column("number", sa.Integer, primary_key=True),
    sa.Column("assignment", sa.Text, nullable=False),
    sa.Column("notebook", sa.Text, nullable=False),
    sa.Column("day", sa.Text, nullable=False),
    sa.Column("cells", sa.Text, nullable=False),
)


@dataclass(frozen=True)
class Version:
    """A released version of a notebook.

    Attributes
    ----------
    cells : dict of str to str
        nbgrader's checksum of what students were given, by grade id.
    day : str
        When it was made, as in 2026-01-31.
    """

    cells: Mapping[str, str]
    day: str = ""

    @property
    def name(self) -> str:
        """A short name that no other version has."""
        text = "\0".join(f"{name}\0{checksum}" for name, checksum in sorted(self.cells.items()))
        return hashlib.sha256(text.encode()).hexdigest()[:8]


@dataclass(frozen=True)
class Origin:
    """The version that a file was made from, where that is not the present one.

    Attributes
    ----------
    version : Version or None
        None where the gradebook has no record of it.
    changed, new, gone : tuple of str
        Grade ids: given otherwise now, not there then, not there now.
    """

    version: Version | None
    changed: tuple[str, ...] = ()
    new: tuple[str, ...] = ()
    gone: tuple[str, ...] = ()

    def notices(self) -> list[str]:
        """Return what students and instructors read about it."""
        if self.version is None:
            first = (
                "this file was made from another version of the assignment, of which the gradebook has no record; "
                "it was graded as the present version"
            )
        else:
            first = (
                f"this file was made from an earlier version of the assignment ({self.version.name} of "
                f"{self.version.day}); it was graded as the present version"
            )
        lines = [first]
        if self.changed:
            lines.append(f"given otherwise since then: {_listed(self.changed)}")
        if self.new:
            lines.append(f"new since then: {_listed(self.new)}; where that cost points, a person decides")
        if self.gone:
            lines.append(
                f"no longer part of the assignment: {_listed(self.gone)}; what stands there was run as your own"
            )
        return lines


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(name[:60] for name in names[:_NAMED])
    return shown if len(names) <= _NAMED else f"{shown} and {len(names) - _NAMED} more"


def given_now(cells: Iterable[NotebookNode], parent: Any = None) -> dict[str, str]:
    """Return the checksums of cells as students are given them.

    Parameters
    ----------
    cells : iterable of NotebookNode
        Cells of the gradebook, hidden tests and mark schemes included; they are changed.
    parent : traitlets.config.Configurable, optional
        Where the course's own marks of hidden tests are configured.

    Returns
    -------
    dict of str to str
        By grade id.
    """
    hidden, scheme = ClearHiddenTests(parent=parent), ClearMarkScheme(parent=parent)
    found = {}
    for cell in cells:
        if utils.is_grade(cell) or utils.is_solution(cell) or utils.is_locked(cell):
            hidden.preprocess_cell(cell, {}, 0)
            scheme.preprocess_cell(cell, {}, 0)
            found[grade_id(cell)] = utils.compute_checksum(cell)
    return found


def given_then(notebook: Any) -> dict[str, str]:
    """Return the checksums that a submitted file carries, whatever the file is.

    Parameters
    ----------
    notebook : Any
        A notebook, or what was handed in as one.

    Returns
    -------
    dict of str to str
        By grade id; empty where there are none.
    """
    found = {}
    for cell in notebook.get("cells") or () if isinstance(notebook, dict) else ():
        metadata = cell.get("metadata") if isinstance(cell, dict) else None
        info = metadata.get("nbgrader") if isinstance(metadata, dict) else None
        if isinstance(info, dict):
            name, checksum = info.get("grade_id"), info.get("checksum")
            if isinstance(name, str) and isinstance(checksum, str) and _CHECKSUM.fullmatch(checksum):
                found[name] = checksum
    return found


def find_origin(then: Mapping[str, str], now: Mapping[str, str], history: Sequence[Version]) -> Origin | None:
    """Find the version that a file was made from.

    A file of the present version in which cells were deleted is one of the present version, unless what is left is
    exactly an earlier one.

    Parameters
    ----------
    then : mapping of str to str
        What the file carries; see :func:`given_then`.
    now : mapping of str to str
        The present version; see :func:`given_now`.
    history : sequence of Version
        Those on record, the oldest first.

    Returns
    -------
    Origin or None
        None for the present version, and where nothing is known.

    Examples
    --------
    A test that is worth other points now has another checksum, and the one who has the old one is told.

    >>> old, new = {"f": "a", "f-test": "b"}, {"f": "a", "f-test": "c", "g": "d"}
    >>> find_origin(old, new, [Version(old, "2026-01-31")]).changed
    ('f-test',)
    """
    foreign = then.items() - now.items()
    earlier = [version for version in history if version.cells != dict(now)]
    if foreign:
        likely = [version for version in earlier if foreign & version.cells.items()]
    else:
        likely = [version for version in earlier if version.cells == dict(then)]
    if not likely and not any(name in now for name, _ in foreign):
        return None
    version = min(reversed(likely), key=lambda v: len(then.items() ^ v.cells.items())) if likely else None
    cells = then if version is None else version.cells
    return Origin(
        version,
        changed=tuple(name for name in now if name in cells and cells[name] != now[name]),
        new=tuple(name for name in now if name not in cells),
        gone=tuple(name for name in cells if name not in now),
    )


def read_history(db_url: str, assignment: str, notebook: str) -> list[Version]:
    """Return the versions of a notebook that the gradebook has on record, the oldest first."""
    with Gradebook(db_url) as gradebook, gradebook.engine.connect() as connection:
        if not sa.inspect(connection).has_table(_TABLE.name):
            return []
        query = sa.select(_TABLE.c.cells, _TABLE.c.day).where(
            _TABLE.c.assignment == assignment, _TABLE.c.notebook == notebook
        )
        return [
            Version(json.loads(cells), day)
            for cells, day in connection.execute(query.order_by(_TABLE.c.number))
        ]


def record_version(db_url: str, assignment: str, notebook: str, version: Version) -> None:
    """Put a version on record, unless it is the last one there."""
    history = read_history(db_url, assignment, notebook)
    if history and history[-1].cells == version.cells:
        return
    with Gradebook(db_url) as gradebook, gradebook.engine.begin() as connection:
        _TABLE.create(connection, checkfirst=True)
        row = {"assignment": assignment, "notebook": notebook, "day": version.day}
        connection.execute(_TABLE.insert().values(cells=json.dumps(dict(version.cells)), **row))


class RecordVersion(NbGraderPreprocessor):
    """The last step of `nbgrader generate_assignment`: put what students are given on record."""

    def preprocess(self, nb: NotebookNode, resources: dict[str, Any]) -> tuple[NotebookNode, dict[str, Any]]:
        """Return the notebook as it is."""
        if not getattr(self.parent, "no_database", False):
            info = resources["nbgrader"]
            version = Version(given_then(nb), f"{datetime.now(UTC):%Y-%m-%d}")
            record_version(info["db_url"], info["assignment"], info["notebook"], version)
        return nb, resources


class FlagNewCells(NbGraderPreprocessor):
    """After `SaveGrades`: no automatic 0 for a cell that the student's version did not have."""

    def preprocess(self, nb: NotebookNode, resources: dict[str, Any]) -> tuple[NotebookNode, dict[str, Any]]:
        """Write it into the gradebook and under the cell."""
        new = set(nb.metadata.get(NEW, ()))
        cells = [cell for cell in nb.cells if utils.is_grade(cell) and grade_id(cell) in new]
        if cells:
            info = resources["nbgrader"]
            with Gradebook(info["db_url"]) as gradebook:
                for cell in cells:
                    place = (grade_id(cell), info["notebook"], info["assignment"], info["student"])
                    grade = gradebook.find_grade(*place)
                    if grade.auto_score == 0:
                        grade.auto_score, grade.needs_manual_grade = None, True
                        cell.metadata[REVIEW] = REASON
                        if cell.cell_type == "code":
                            cell.outputs.append(new_output("display_data", {"text/plain": SAID}))
                        self.log.warning(
                            "%s, cell %s: for manual grading: %s", info["student"], place[0], REASON
                        )
                gradebook.db.commit()
        return nb, resources
