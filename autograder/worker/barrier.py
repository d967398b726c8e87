"""Putting a filter of system calls in force: `autograder.system_calls` says what it refuses, and why."""

from __future__ import annotations

import ctypes
import errno
import os

_PR_SET_SECCOMP, _PR_SET_NO_NEW_PRIVS = 22, 38
_FILTER = 2
_INSTRUCTION = 8
_libc = ctypes.CDLL(None, use_errno=True)


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("instructions", ctypes.c_char_p))


def put_in_force(program: bytes) -> None:
    """Put a filter in force for this process and all that it forks from now on.

    Parameters
    ----------
    program : bytes
        The filter; nothing is done where it is empty.

    Raises
    ------
    OSError
        If the kernel does not take it.
    """
    if not program:
        return
    whole = _Program(len(program) // _INSTRUCTION, program)
    for arguments in (
        (_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0),
        (_PR_SET_SECCOMP, _FILTER, ctypes.byref(whole), 0, 0),
    ):
        if _libc.prctl(*arguments) != 0:
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def _is_refused() -> bool:
    """Return whether a call that anybody may make, and that with this argument only asks, is refused."""
    return _libc.personality(0xFFFFFFFF) == -1 and ctypes.get_errno() == errno.EPERM


def refusal(program: bytes) -> str:
    """Return why the kernel does not take a filter, empty where it does: a child tries it."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            put_in_force(program)
            text = "" if not program or _is_refused() else "it takes the filter and does not follow it"
        except BaseException as error:  # noqa: BLE001  (whatever it is, it is the answer)
            text = str(error) or type(error).__name__
        os.write(writing, b"+" + text.encode()[:500])
        os._exit(0)
    os.close(writing)
    said = b"".join(iter(lambda: os.read(reading, 512), b""))
    os.close(reading)
    os.waitpid(child, 0)
    return said[1:].decode() if said[:1] == b"+" else "a process with the filter ends at once"
