"""Collecting what a class uploaded to Canvas.

*Download Submissions* gives one zip file with a file for each upload, named by name, numbers of student and upload, and
the name that the student's file had: `doejane_LATE_12345_67890_motion-model-1.ipynb`. `nbgrader zip_collect` sorts
them into the course's folders with the collector of this module. In `nbgrader_config.py`::

    c.ZipCollectApp.collector_plugin = "autograder.canvas.CanvasCollector"

A student goes by the number: names are not unique, and the number is the column *ID* of Canvas's grade table. Only the
outermost name counts, the one that Canvas wrote; inside a zip file that a student uploaded, any name can stand.
"""

from __future__ import annotations

import re
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, NamedTuple

from nbgrader.plugins import FileNameCollectorPlugin

if TYPE_CHECKING:
    from collections.abc import Iterable

_UPLOAD = re.compile(r"(?P<name>.*?)_(?:LATE_)?(?P<student>\d+)_(?P<number>\d+)_(?P<file>.+)", re.DOTALL)
# What Canvas (-1) and browsers ( (1)) add to the name of a file that is uploaded or saved again.
_AGAIN = re.compile(r"(?:-\d+|\s*\(\d+\))+$")


class Upload(NamedTuple):
    """One notebook that somebody uploaded: who, as which upload, and which notebook."""

    student: str
    number: int
    notebook: str


def parse(path: PurePath) -> Upload | None:
    """Find out what a collected file is.

    Parameters
    ----------
    path : pathlib.PurePath
        Below the folder of extracted files.

    Returns
    -------
    Upload or None
        None where no part of the path is a name that Canvas gives, and for what is no notebook.

    Examples
    --------
    >>> parse(PurePath("submissions", "doejane_LATE_12345_67890_motion-model-1.ipynb"))
    Upload(student='12345', number=67890, notebook='motion-model')

    A file in a zip file is that of the student who uploaded the zip file, whatever its own name says.

    >>> parse(PurePath("roejohn_222_3_work", "doejane_12345_4_motion-model.ipynb")).student
    '222'
    """
    last = path.name
    if path.suffix != ".ipynb" or last.startswith("."):
        return None
    for part in path.parts:
        if match := _UPLOAD.fullmatch(part):
            own = match["file"] if part is path.parts[-1] else last
            return Upload(match["student"], int(match["number"]), _AGAIN.sub("", PurePath(own).stem))
    return None


def newest(paths: Iterable[PurePath]) -> set[PurePath]:
    """Return those of the files that count: of several uploads of one notebook by one student, the last.

    Parameters
    ----------
    paths : iterable of pathlib.PurePath
        Below the folder of extracted files.

    Returns
    -------
    set of pathlib.PurePath
        One for each student and notebook.
    """
    found: dict[tuple[str, str], tuple[int, PurePath]] = {}
    for path in paths:
        if upload := parse(path):
            key = upload.student, upload.notebook
            found[key] = max(found.get(key, (-1, path)), (upload.number, path))
    return {path for _, path in found.values()}


class CanvasCollector(FileNameCollectorPlugin):
    """nbgrader's hook that says whose a file is, for the names that Canvas gives."""

    _counting: set[PurePath] | None = None

    def collect(self, submitted_file: str) -> dict[str, str] | None:
        """Return student and notebook of a file, None where it does not count."""
        folder = Path(self.parent._format_collect_path(self.parent.extracted_directory))  # noqa: SLF001  (its only home)
        path = Path(submitted_file).relative_to(folder)
        if self._counting is None:
            self._counting = newest(file.relative_to(folder) for file in folder.rglob("*") if file.is_file())
        upload = parse(path)
        if upload is None:
            return None
        if path not in self._counting:
            self.log.warning("%s: a later upload of %s by %s counts", path, upload.notebook, upload.student)
            return None
        return {"student_id": upload.student, "file_id": upload.notebook}
