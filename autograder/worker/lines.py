"""How many lines of Python a call runs: a loop over particles runs ten times as many at ten times the particles.

The tracer lives in the process that runs the submission, which is untrusted ground. What can be had there: while it
counts, an audit hook, which cannot be taken out again, hears of anyone who sets a tracer, starts a process or searches
memory, and then there is no count at all; lines of new threads count as well. A submission that has rewritten this
module before, in a cell of its own, still counts as it likes. So a count alone decides nothing: `autograder.loops`
reads the cells as they were handed in, in a process that runs none of them, and refuses what reaches for a tracer.
"""

from __future__ import annotations

import functools
import sys
import threading
from sys import gettrace, settrace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

_WATCHED = frozenset(
    {
        "sys.settrace", "sys.setprofile", "sys.addaudithook", "_thread.start_new_thread",
        "_thread.start_joinable_thread", "os.fork", "os.forkpty", "os.exec", "os.posix_spawn",
        "subprocess.Popen", "gc.get_objects",
        "gc.get_referrers", "gc.get_referents", "ctypes.dlopen", "ctypes.dlsym",
    }
)  # fmt: skip


class _Enough(BaseException):
    """The count has reached its bound: no more is to be learnt."""


class _Watch:
    """What the audit hook of this process tells to."""

    def __init__(self) -> None:
        self.counting = False
        self.disturbed = False

    def hear(self, event: str, args: tuple) -> None:  # noqa: ARG002  (the signature of audit hooks)
        """Note an event that could take the tracer away."""
        if self.counting and event in _WATCHED:
            self.disturbed = True


@functools.cache
def _watch() -> _Watch:
    watch = _Watch()
    sys.addaudithook(watch.hear)
    return watch


def count(
    function: Callable[..., Any], args: list, most: int, *, watched: bool = False
) -> tuple[int | None, Any]:
    """Call a function and count the line events of all Python code that runs in the call.

    Parameters
    ----------
    function : callable
        What to call.
    args : list
        Its arguments.
    most : int
        Where to stop counting: the call is ended there.
    watched : bool, optional
        Whether to set the audit hook, which stays as long as the process.

    Returns
    -------
    events : int or None
        At most `most`; None where something else set a tracer, or started a thread or process.
    value : object
        What the call returned; None where it was ended.

    Examples
    --------
    >>> count(sum, [[1, 2, 3]], 100)
    (0, 6)
    >>> def total(numbers):
    ...     result = 0
    ...     for number in numbers:
    ...         result += number
    ...     return result
    >>> [count(total, [range(n)], 1000)[0] for n in (10, 100)]
    [23, 203]
    """
    events = 0

    def inside(frame: FrameType, event: str, arg: object) -> Any:  # noqa: ARG001
        nonlocal events
        if event == "line":
            events += 1
            if events >= most:
                raise _Enough
        return inside

    watch = _watch() if watched else _Watch()
    watch.disturbed = False
    value, before, elsewhere = None, gettrace(), threading.gettrace()
    threading.settrace(inside)
    settrace(inside)
    watch.counting = True
    try:
        value = function(*args)
    except BaseException:
        if events < most:
            raise
    finally:
        watch.counting = False
        kept = gettrace() is inside or events >= most
        settrace(before)
        threading.settrace(elsewhere)
    if watch.disturbed and events < most:
        return None, value
    return (events, value) if kept else (None, value)
