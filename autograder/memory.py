"""A bound on what all processes of a notebook hold in memory together, and on their share of the processors.

The kernel bounds the address space of each process. What it has for many together, control groups, an ordinary user
mostly cannot set up. So the processes of a sandbox are looked at from outside, a few times a second, and where they
hold too much the largest of the notebook's are ended, as the kernel does where memory runs out. Where more of them
compute at a time than an exercise has use for, they go on with the lowest priority: other notebooks come first.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import threading
import time
from pathlib import Path

EVERY = 0.2  # seconds between two looks
SHARE = 0.1  # of the time of one processor, which exact looks may take at the most
CROWD = 4  # threads of a notebook that compute at a time, above which they give way to others
LOWEST = 19
GONE = 5.0  # seconds that an ended process may take to give its memory back
PROC = Path("/proc")


def descendants(root: int) -> list[int]:
    """Return the processes below one, itself first."""
    found = [root]
    for pid in found:  # which grows meanwhile
        with contextlib.suppress(OSError):
            for thread in (PROC / str(pid) / "task").iterdir():
                found += map(int, (thread / "children").read_text(encoding="ascii").split())
    return found


def _status(pid: int) -> dict[str, list[str]]:
    """Return what the kernel says of a process, the words of each line by its name; nothing where it is gone."""
    with contextlib.suppress(OSError):
        lines = (PROC / str(pid) / "status").read_text(encoding="utf-8", errors="replace").splitlines()
        return {name: words.split() for name, _, words in (line.partition(":") for line in lines)}
    return {}


def at_most(pid: int) -> int:
    """Return the memory of a process that is not a file's [bytes]: what it shares with others counts in each."""
    status = _status(pid)
    return sum(1024 * int(status[name][0]) for name in ("RssAnon", "RssShmem") if name in status)


def share(pid: int) -> int:
    """Return the memory of a process, of shared pages its part [bytes]; 0 where it is gone."""
    with contextlib.suppress(OSError):
        for line in (PROC / str(pid) / "smaps_rollup").read_text(encoding="ascii").splitlines():
            if line.startswith("Pss:"):
                return 1024 * int(line.split()[1])
    return 0


def _is_ours(pid: int, depth: int) -> bool:
    """Return whether a process is of a notebook's own namespace, and not the first there, the warden."""
    names = _status(pid).get("NSpid", [])
    return len(names) == depth and names[-1] != "1"


def _computing(pid: int) -> list[int]:
    """Return the threads of a process that compute, or could."""
    found = []
    with contextlib.suppress(OSError):
        for thread in (PROC / str(pid) / "task").iterdir():
            with contextlib.suppress(OSError):
                if (thread / "stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()[
                    0
                ] == "R":
                    found.append(int(thread.name))
    return found


class MemoryWatch:
    """Watches a sandbox in a thread of its own until :meth:`stop`.

    Parameters
    ----------
    root : int
        The process of the sandbox; see `sandbox.Sandbox`.
    bound : int
        What it and all below it may hold together [bytes].

    Attributes
    ----------
    ended : int
        How many processes have been ended so far.
    """

    def __init__(self, root: int, bound: int) -> None:
        self.root = root
        self.bound = bound
        self.ended = 0
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the watch."""
        self._done.set()
        self._thread.join()

    def _run(self) -> None:
        pause = EVERY
        while not self._done.wait(pause):
            pause = EVERY
            below = descendants(self.root)
            self._give_way(below)
            if sum(map(at_most, below)) > self.bound:
                began = time.thread_time()
                self._relieve(below)
                pause = max(EVERY, (time.thread_time() - began) / SHARE)

    def _give_way(self, below: list[int]) -> None:
        """Give a crowd of threads that compute the lowest priority; the sandbox's own processes keep theirs."""
        crowd = {pid: threads for pid in below if (threads := _computing(pid))}
        if sum(map(len, crowd.values())) <= CROWD:
            return
        depth = self._depth()
        for pid, threads in crowd.items():
            if _is_ours(pid, depth):
                for thread in threads:
                    with contextlib.suppress(OSError):
                        os.setpriority(os.PRIO_PROCESS, thread, LOWEST)

    def _depth(self) -> int:
        """Return how many pid namespaces a process of the notebook is in: bubblewrap's and its own besides ours."""
        return 2 + len(_status(self.root).get("NSpid", []))

    def _relieve(self, below: list[int]) -> None:
        """End as many of the largest processes as it takes to come below the bound."""
        sizes = {pid: share(pid) for pid in below}
        over = sum(sizes.values()) - self.bound
        if over <= 0:
            return
        depth = self._depth()
        ended = []
        for pid in sorted(sizes, key=sizes.__getitem__, reverse=True):
            if over <= 0:
                break
            with contextlib.suppress(OSError):
                descriptor = os.pidfd_open(pid)
                # Another process may have got the number meanwhile; from here on it keeps its meaning.
                if _is_ours(pid, depth) and pid in descendants(self.root):
                    signal.pidfd_send_signal(descriptor, signal.SIGKILL)
                    self.ended += 1
                    over -= sizes[pid]
                ended.append(descriptor)
        deadline = time.monotonic() + GONE
        for descriptor in ended:
            select.select([descriptor], [], [], max(0.0, deadline - time.monotonic()))
            os.close(descriptor)
