"""Breaking a run off, and what it leaves on the disk then or when its source changes, for the next one to see.

A folder of `autograded` that is not finished carries a marker from its first moment to its last one. Whatever the
moment of a kill, the folder is not there, or is empty, or has the marker, or is finished.
"""

from __future__ import annotations

import errno
import os
import shutil
import signal
import threading
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from nbgrader.api import InvalidEntry
from sqlalchemy.exc import OperationalError

from .sandbox import SandboxError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

MARKER = ".being-graded"
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)


@contextmanager
def hearing_ctrl_c() -> Iterator[Callable[[], None]]:
    """Let no Ctrl-C be lost: Python drops the exception where it meets a finalizer.

    Yields
    ------
    callable
        Raises `KeyboardInterrupt` where there has been a Ctrl-C since the beginning.
    """
    heard = threading.Event()

    def hear(*_: object) -> None:
        heard.set()
        raise KeyboardInterrupt

    def check() -> None:
        if heard.is_set():
            raise KeyboardInterrupt

    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield check  # a program around us has its own way
        return
    signal.signal(signal.SIGINT, hear)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def begin(folder: Path) -> None:
    """Make a folder, or take one that is there, and mark it."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / MARKER).touch()


def is_interrupted(folder: Path) -> bool:
    """Return whether a folder is there and not finished."""
    return folder.is_dir() and ((folder / MARKER).exists() or not any(folder.iterdir()))


def remove(folder: Path) -> None:
    """Remove a folder, its marker last: half removed it must not look finished."""
    if not folder.exists():
        return
    folder.chmod(folder.stat().st_mode | 0o700)
    begin(folder)
    for path in folder.iterdir():
        if path.name != MARKER:
            if path.is_dir() and not path.is_symlink():
                for root, _, _ in os.walk(path):
                    os.chmod(root, 0o700)  # noqa: PTH101  (a folder that was copied may be read-only)
                shutil.rmtree(path)
            else:
                path.unlink()
    (folder / MARKER).unlink()
    folder.rmdir()


def state_of(folder: Path) -> tuple[tuple[str, int, int, int], ...]:
    """Return what tells whether somebody has written to a folder: no clock of ours has a part in it.

    Parameters
    ----------
    folder : Path
        Of a submission.

    Returns
    -------
    tuple of tuple
        Name, inode, bytes and time of writing of each file.
    """
    found = []
    for root, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(root, name)  # noqa: PTH118  (a folder may have thousands of files)
            try:
                status = os.lstat(path)
            except FileNotFoundError:
                continue
            found.append((path, status.st_ino, status.st_size, status.st_mtime_ns))
    return tuple(sorted(found))


def of_the_machine(error: BaseException, folder: Path, gradebook: str) -> str:
    """Say what is wrong where no submission is at fault, and no other one would fare better; else nothing.

    Parameters
    ----------
    error : BaseException
        What happened.
    folder : Path
        What was being written.
    gradebook : str
        Its address, without a password.

    Returns
    -------
    str
        What to put right, or nothing.
    """
    if isinstance(error, InvalidEntry) and isinstance(error.__context__, OperationalError):
        error = error.__context__  # nbgrader takes a full disk for a bad entry
    if isinstance(error, OperationalError):
        return f"the gradebook {gradebook} cannot be used: {error.orig}"
    if isinstance(error, OSError) and (error.errno in _NO_ROOM or _is_denied(error, folder)):
        return f"{error.filename or folder} cannot be written: {error.strerror}"
    return str(error) if isinstance(error, SandboxError) else ""


def _is_denied(error: OSError, folder: Path) -> bool:
    """Return whether the grader may not write in a folder that is to be its own, or in the ones above."""
    if not isinstance(error, PermissionError) or error.filename is None:
        return False
    path = Path(os.fsdecode(error.filename)).absolute()
    folder = folder.absolute()
    return path.is_relative_to(folder) or folder.is_relative_to(path)
