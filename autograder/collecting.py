"""Copying what students hand in: no link is followed, and a forged time is noticed.

`nbgrader collect` copies with the rights of the instructor from folders that students can write. A link there, to the
solutions or the gradebook, would become a copy of them in the student's own submission; and the time of a submission is
what the student's own file says, while when that was written last is the kernel's to say.
"""

from __future__ import annotations

import os
import pwd
import shutil
import stat
import tempfile
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from nbgrader.exchange.default import ExchangeCollect

from .late import STAMP, submitted_at

NEVER = datetime.min  # noqa: DTZ901  (nbgrader's times have no zone)
LATER = timedelta(minutes=10)  # clocks of two machines differ
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
        What was left out, by relative name: links, what is neither a file nor a folder, and what may not be read.

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


def _owner(path: Path) -> str:
    try:
        return pwd.getpwuid(path.lstat().st_uid).pw_name
    except KeyError:
        return "unknown id"


def written_later(source: Path, submitted: datetime) -> datetime | None:
    """Return when the file with a submission's time was written last, None where that agrees with it.

    Parameters
    ----------
    source : pathlib.Path
        The folder that the student wrote.
    submitted : datetime.datetime
        What the file says, in UTC and without a zone, as nbgrader has it.
    """
    try:
        changed = (source / STAMP).lstat().st_ctime
    except OSError:  # gone meanwhile
        return None
    written = datetime.fromtimestamp(changed, UTC).replace(tzinfo=None, microsecond=0)
    return written if written - submitted > LATER else None


class Collect(ExchangeCollect):
    """`nbgrader collect` that leaves links in submissions out, and says so.

    What nbgrader would stop at for everybody, or take with a warning, is left out as well: a folder that is named
    otherwise than its own command does, one that is too large, and one that somebody else put there. Where a submission
    claims to be older than it can be, there is a warning.
    """

    def _path_to_record(self, path: str) -> dict[str, Any]:
        """Return whose a folder is, and of when; of nobody where it is not to be collected."""
        reason = ""
        record = {"username": None, "timestamp": NEVER}
        try:
            record = super()._path_to_record(path)
            if self.check_owner and (owner := _owner(Path(path))) != record["username"]:
                reason = f"{owner} put it there (where students share an account, ExchangeCollect.check_owner=False)"
        except Exception as error:  # noqa: BLE001  (the name is a student's: reading it may fail in any way)
            reason = f"no student and time in its name ({type(error).__name__})"
        if reason:
            self.log.error("%s is not collected: %s", path, reason)
            record["username"] = None
        return record

    def init_src(self) -> None:
        """Find the submissions; see `_path_to_record`."""
        super().init_src()
        self.src_records = [record for record in self.src_records if record["username"] is not None]

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
                self.log.warning(
                    "%s: %s is a link, no ordinary file, or not to be read, and is left out", src, name
                )
            submitted = submitted_at(self.coursedir, str(own))
            if submitted is None:  # nbgrader's later steps stumble over what is no time
                stamp = own / STAMP
                shutil.rmtree(stamp) if stamp.is_dir() else stamp.unlink(missing_ok=True)
            elif written := written_later(Path(src), submitted):
                self.log.warning(
                    "%s: says it is of %s UTC, and was written at %s UTC", src, submitted, written
                )
            super().do_copy(str(own), dest, log)
