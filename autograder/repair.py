"""Bringing whatever was handed in into the shape of the release.

A student may duplicate, delete, rename, retype or empty cells, and so may an editor gone wrong. Repair rebuilds every
cell from the few fields that matter, gives those that the gradebook knows their own metadata back, and adds what is
missing, so that every grade cell gets its row whatever the file looked like. A file that cannot be read at all is
replaced by the release with the reason on top. A file that was made from an earlier version of the assignment is
brought into the shape of the present one; see `versions`.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import nbformat
from nbgrader.api import Gradebook, MissingEntry
from nbgrader.preprocessors import NbGraderPreprocessor

from .versions import NEW, Origin, find_origin, given_now, given_then, read_history

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from nbformat import NotebookNode

MAX_BYTES = 50 * 1024 * 1024
SCHEMA_VERSION = 3
NOTICE = "grading_notice"
_KINDS = ("code", "markdown", "raw")
_PRESENT = Origin(None)  # nothing has changed


@dataclass(frozen=True)
class Released:
    """A cell of the release, as the gradebook keeps it.

    Attributes
    ----------
    name : str
        Its grade id.
    cell_type, source, checksum : str
        What students were given.
    locked, grade, solution, task : bool
        What nbgrader does with it.
    points : float
        What it is worth; 0 where it is not graded.
    """

    name: str
    cell_type: str
    source: str
    checksum: str
    locked: bool
    grade: bool
    solution: bool
    task: bool
    points: float

    def metadata(self) -> dict[str, Any]:
        """Return nbgrader's metadata of the cell."""
        found = {
            "grade_id": self.name, "grade": self.grade, "solution": self.solution, "task": self.task,
            "locked": self.locked, "cell_type": self.cell_type, "checksum": self.checksum,
            "schema_version": SCHEMA_VERSION,
        }  # fmt: skip
        return found | ({"points": self.points} if self.grade or self.task else {})


def read_release(db_url: str, assignment: str, notebook: str, order: Sequence[str] = ()) -> list[Released]:
    """Return the cells of a release from the gradebook, in their order.

    Parameters
    ----------
    db_url : str
        The gradebook.
    assignment, notebook : str
        Which notebook.
    order : sequence of str, optional
        Their names in order: a database keeps none.

    Returns
    -------
    list of Released
        Every cell that nbgrader keeps track of.
    """
    with Gradebook(db_url) as gradebook:
        found = gradebook.find_notebook(notebook, assignment)
        points = {cell.name: cell.max_score for cell in [*found.grade_cells, *found.task_cells]}
        grades = {cell.name for cell in found.grade_cells}
        solutions = {cell.name for cell in found.solution_cells}
        tasks = {cell.name for cell in found.task_cells}
        cells = [
            Released(
                cell.name, cell.cell_type, cell.source or "", cell.checksum, bool(cell.locked), cell.name in grades,
                cell.name in solutions, cell.name in tasks, float(points.get(cell.name, 0.0)),
            )
            for cell in found.source_cells
        ]  # fmt: skip
    place = {name: number for number, name in enumerate(order)}
    return sorted(cells, key=lambda cell: place.get(cell.name, len(place)))


def read_submission(path: Path) -> tuple[NotebookNode | None, str]:  # noqa: PLR0911  (a return for each fault)
    """Read a submitted file; return the notebook, or None and why it cannot be read.

    Raises
    ------
    OSError
        If the machine does not let the grader read a file that is there: no fault of the student's.
    """
    try:
        if path.is_symlink() or path.parent.is_symlink():  # whose reader has rights that who made it has not
            return None, "the file is a link, and links are not followed"
        if path.stat().st_size > MAX_BYTES:
            return None, f"the file is larger than {MAX_BYTES // 1024**2} MB"
        raw = json.loads(path.read_text(encoding="utf-8-sig"))
        notebook = nbformat.reads(json.dumps(raw), as_version=4) if _is_old(raw) else nbformat.from_dict(raw)
    except FileNotFoundError:
        return None, f"no file {path.name} was handed in"
    except (IsADirectoryError, NotADirectoryError, UnicodeDecodeError) as error:
        return None, f"the file cannot be read ({type(error).__name__})"
    except OSError:
        raise
    except RecursionError:
        return None, "the file is nested too deeply to be a notebook"
    except json.JSONDecodeError as error:
        return (
            None,
            f"the file is not a notebook: it is not JSON from line {error.lineno}, column {error.colno} on",
        )
    except Exception as error:  # noqa: BLE001  (upgrading an old format may fail in any way)
        return None, f"the file is not a notebook ({type(error).__name__})"
    if not isinstance(notebook, dict) or not isinstance(notebook.get("cells"), list):
        return None, "the file is not a notebook: it has no list of cells"
    return notebook, ""


def _is_old(raw: object) -> bool:
    return isinstance(raw, dict) and isinstance(raw.get("nbformat"), int) and raw["nbformat"] < 4


def repair(
    notebook: NotebookNode | None,
    released: Sequence[Released],
    reason: str = "",
    origin: Origin | None = None,
) -> NotebookNode:
    """Return a valid notebook that has every graded cell of the release exactly once.

    Parameters
    ----------
    notebook : NotebookNode or None
        What was handed in; None where it could not be read.
    released : sequence of Released
        The release.
    reason : str, optional
        Why it could not be read, for the student.
    origin : Origin, optional
        The version it was made from, where that is not the present one.

    Returns
    -------
    NotebookNode
        A new notebook. What was mended is listed in its metadata under `NOTICE`.
    """
    known = {cell.name: cell for cell in released}
    origin = origin or _PRESENT
    notices = [reason] if reason else []
    if origin is not _PRESENT:
        notices += origin.notices()
    rebuilt = [_rebuild(cell) for cell in (notebook or {}).get("cells", [])]
    cells = [cell for cell in rebuilt if cell is not None]
    if len(cells) < len(rebuilt):
        notices.append(f"{len(rebuilt) - len(cells)} cells were not cells and have been left out")
    _name_cells(cells, known, notices, frozenset(origin.gone))
    _add_missing(cells, released, notices, frozenset(origin.new), whole=notebook is None)
    if reason:
        cells.insert(0, _new_cell("markdown", f"**This notebook was not graded as handed in: {reason}.**"))
    for number, cell in enumerate(cells):
        cell["id"] = f"cell-{number}"
    result = nbformat.from_dict({"cells": cells, "metadata": {}, "nbformat": 4, "nbformat_minor": 5})
    result.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
    if notices:
        result.metadata[NOTICE] = notices
    if origin.new:
        result.metadata[NEW] = list(origin.new)
    return result


def _new_cell(kind: str, source: str) -> NotebookNode:
    """Return a cell as nbformat makes it, without the validation of each that nbformat does."""
    fields: dict[str, Any] = {"cell_type": kind, "metadata": {}, "source": source}
    if kind == "code":
        fields |= {"execution_count": None, "outputs": []}
    return nbformat.from_dict(fields)


def _rebuild(cell: object) -> NotebookNode | None:
    """Return a cell with the fields that matter, None where there is no cell in it."""
    if not isinstance(cell, dict) or cell.get("cell_type") not in _KINDS:
        return None
    source = cell.get("source", "")
    if isinstance(source, list) and all(isinstance(line, str) for line in source):
        source = "".join(source)
    if not isinstance(source, str):
        return None
    metadata = cell.get("metadata")
    metadata = metadata if isinstance(metadata, dict) else {}
    nbgrader = metadata.get("nbgrader")
    name = nbgrader.get("grade_id") if isinstance(nbgrader, dict) else None
    made = _new_cell(cell["cell_type"], source.encode("utf-8", "replace").decode("utf-8"))
    if isinstance(name, str):
        made.metadata["nbgrader"] = {"grade_id": name}
    if made.cell_type == "markdown" and (pictures := _pictures(cell.get("attachments"))):
        made["attachments"] = pictures
    return made


def _pictures(attachments: object) -> dict[str, dict[str, str]]:
    """Return the pictures pasted into a Markdown cell: a photo of a derivation, say."""
    found: dict[str, dict[str, str]] = {}
    for name, bundle in attachments.items() if isinstance(attachments, dict) else ():
        if isinstance(name, str) and isinstance(bundle, dict):
            kept = {
                mime: "".join(data)
                if isinstance(data, list) and all(isinstance(d, str) for d in data)
                else data
                for mime, data in bundle.items()
                if mime in ("image/png", "image/jpeg")
            }
            found[name] = {mime: data for mime, data in kept.items() if isinstance(data, str)}
    return {name: bundle for name, bundle in found.items() if bundle}


def _name_cells(
    cells: list[NotebookNode], known: dict[str, Released], notices: list[str], gone: frozenset[str]
) -> None:
    """Give cells of the release their metadata; of a duplicated cell the last is it, as nbgrader has it."""
    seen: set[str] = set()
    for i in range(len(cells) - 1, -1, -1):
        name = cells[i].metadata.pop("nbgrader", {}).get("grade_id")
        if name not in known:
            if name is not None and name not in gone:
                notices.append(f"a cell of the unknown name {name[:60]!r} was taken as a cell of your own")
            continue
        if name in seen:
            notices.append(f"the cell {name} was there more than once; the last one counts")
            if known[name].locked:
                cells[i].source = ""
            continue
        seen.add(name)
        own = cells[i]
        cells[i] = _of_release(known[name], None if known[name].locked else own.source)
        if (
            "attachments" in own and cells[i].cell_type == "markdown"
        ):  # the gradebook has none, not even the release's
            cells[i]["attachments"] = own.attachments


def _of_release(released: Released, source: str | None = None) -> NotebookNode:
    cell = _new_cell(released.cell_type, released.source if source is None else source)
    cell.metadata["nbgrader"] = released.metadata()
    return cell


def _add_missing(
    cells: list[NotebookNode],
    released: Sequence[Released],
    notices: list[str],
    new: frozenset[str],
    *,
    whole: bool,
) -> None:
    """Put cells of the release that are missing after the one they followed there."""

    def place(name: str) -> int | None:
        return next(
            (i for i, c in enumerate(cells) if c.metadata.get("nbgrader", {}).get("grade_id") == name), None
        )

    before: str | None = None
    late = False  # whether the answer cell before this one is missing
    for number, cell in enumerate(released):
        if place(cell.name) is None:
            if cell.solution and not cell.grade and not whole:
                late = True
                continue  # the student's own code may stand elsewhere: nothing is put in its place
            at = 0 if before is None else (place(before) or 0) + 1
            if late:  # ... but before the next cell of the release
                after = (place(later.name) for later in released[number + 1 :])
                at = next((found for found in after if found is not None), len(cells))
            cells.insert(at, _of_release(cell))
            if not whole and cell.name not in new:
                notices.append(f"the cell {cell.name} was missing and has been put back")
        before, late = cell.name, False


class RepairNotebook(NbGraderPreprocessor):
    """The first step of `nbgrader autograde`: see :func:`repair`."""

    def preprocess(self, nb: NotebookNode, resources: dict[str, Any]) -> tuple[NotebookNode, dict[str, Any]]:
        """Return the repaired notebook."""
        info = resources["nbgrader"]
        try:
            released = info.get("released") or read_release(
                info["db_url"], info["assignment"], info["notebook"]
            )
        except MissingEntry:
            return nb, resources  # an unknown notebook: nbgrader itself leaves it out
        reason = info.get("unreadable", "")
        submitted = None if reason else info.pop("submitted", nb)
        repaired = repair(submitted, released, reason, self._origin(submitted, released, info))
        for notice in repaired.metadata.get(NOTICE, []):
            self.log.warning("%s/%s: %s", info["student"], info["notebook"], notice)
        return repaired, resources

    def _origin(self, submitted: Any, released: Sequence[Released], info: dict[str, Any]) -> Origin | None:
        """Return the version that a file was made from, where that is not the present one."""
        then = given_then(submitted)
        now = given_now(map(_of_release, released), self)
        if not then or then == now:
            return None
        return find_origin(then, now, read_history(info["db_url"], info["assignment"], info["notebook"]))
