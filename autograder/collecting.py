"""Copying what students hand in: no link is followed.

`nbgrader collect` copies with the rights of the instructor from folders that students can write. A link there, to the
solutions or the gradebook, would become a copy of them in the student's own submission.
"""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
from pathlib import Path
from typing import Any

from nbgrader.exchange.default import ExchangeCollect

# Without O_NONBLOCK the opening of a pipe waits for somebody who writes.
_NO_LINK = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK


def copy_files(source: Path, target: Path, most: int) -> list[str]:
    """Copy the ordinary files of a folder that somebody else can change meanwhile.

    Parameters
    ----------
    source, target : pathlib.Path
        The folders; the second is made.
    most : int
        How many bytes may be copied.

    Returns
    -------
    list of str
        What was left out, by relative name: links, and what is neither a file nor a folder.

    Raises
    ------
    ValueError
        If there are more bytes.
    """
    left_out = []
    target.mkdir(parents=True)
    if source.is_symlink():
        return ["."]
    for root, folders, names, folder in os.fwalk(source, follow_symlinks=False):
        inside = Path(os.path.relpath(root, source))
        for name in folders:
            # A link to a folder is listed as one, and not entered.
            if stat.S_ISLNK(os.stat(name, dir_fd=folder, follow_symlinks=False).st_mode):
                left_out.append(str(inside / name))
            else:
                (target / inside / name).mkdir()
        for name in names:
            try:
                descriptor = os.open(name, _NO_LINK, dir_fd=folder)
            except OSError:
                left_out.append(str(inside / name))
                continue
            with open(descriptor, "rb") as file:  # noqa: PTH123  (of a descriptor)
                status = os.fstat(descriptor)
                if not stat.S_ISREG(status.st_mode):
                    left_out.append(str(inside / name))
                    continue
                most -= status.st_size
                if most < 0:
                    raise ValueError("it is larger than CourseDirectory.max_dir_size")
                with (target / inside / name).open("wb") as copy:
                    shutil.copyfileobj(file, copy)
            os.utime(target / inside / name, ns=(status.st_atime_ns, status.st_mtime_ns))
    return sorted(left_out)


class Collect(ExchangeCollect):
    """`nbgrader collect` that leaves links in submissions out, and one that is too large, and says so."""

    def do_copy(self, src: str, dest: str, log: Any = None) -> None:
        """Copy a submission, by nbgrader's own rules on names and sizes, as far as it is the student's own."""
        most = 1000 * self.coursedir.max_dir_size
        with tempfile.TemporaryDirectory(prefix="collect-") as folder:
            own = Path(folder, "submission")
            try:
                left_out = copy_files(Path(src), own, most)
            except ValueError as error:  # the others are collected
                self.log.error("%s is not collected: %s", src, error)  # noqa: TRY400  (no traceback: the text says it)
                return
            for name in left_out:
                self.log.warning("%s: %s is a link, or no ordinary file, and is left out", src, name)
            super().do_copy(str(own), dest, log)
