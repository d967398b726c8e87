"""The first process of one notebook's pid namespace.

It forks states, routes requests, keeps time, and never runs a line of the submission. It keeps *states*, processes that
wait. Cells run in a fork of the last state kept; where one dies or overruns, its process is ended, and a new fork runs
again what ran well since. A *mark* keeps a state for a test cell; the test cell's calls go to that state, which is
ended afterwards. Where one of them ends it, all states are made anew (see `autograder.session`), and from then on the
calls go to forks of the marks.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import signal
import stat
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import frames, wire
from . import limits as limits_
from . import state as state_
from .channel import Channel, Closed, pair

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .limits import Limits
    from .shell import NotebookShell

TICK = 0.05
FORK_TIMEOUT = 20.0
GOING_SECONDS = 5.0  # that many ended processes may take to be gone
MAX_PID = 1 << 22  # the kernel's own bound
FORK_BYTES = 64  # of the answer to a fork, which is a word and a number
ANSWER_BYTES = frames.MAX_FRAME - 1024  # of a state's, which goes on to the grader in a frame with more in it
SNAPSHOT_BYTES = 64 * 1024**2
KEPT = (".tmp", ".shm")  # see `zygote.isolate`


class Ended(Exception):  # noqa: N818
    """A state process did not answer.

    The reason is ``died``, ``cpu``, ``wall``, ``cell`` or ``notebook`` (their time is used up), ``protocol``, or
    ``lost`` (the state before it is gone).
    """

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


@dataclass
class Holder:
    """A state process and the channel to it."""

    pid: int
    channel: Channel

    def end(self) -> None:
        """Kill the process and its group."""
        self.channel.close()
        for kill in (os.killpg, os.kill):
            with contextlib.suppress(ProcessLookupError, PermissionError):
                kill(self.pid, signal.SIGKILL)


class Warden:
    """Serves the grader's requests for one notebook.

    Parameters
    ----------
    grader : Channel
        To the grader; when it closes, everything here ends.
    shell : NotebookShell
        The shell that cells run in.
    limits : Limits
        Bounds of the notebook.
    home : pathlib.Path
        The folder of the notebook.
    begun : sequence of tuple of (str, list), optional
        What the shell has run; see `state.State`.
    """

    def __init__(
        self,
        grader: Channel,
        shell: NotebookShell,
        limits: Limits,
        home: Path,
        begun: Sequence[tuple[str, list]] = (),
    ) -> None:
        self.grader = grader
        self.limits = limits
        self.home = home
        self.left = limits.notebook_cpu
        self.top = self.first(shell, begun)
        self.kept: Holder | None = None
        self.since: list[str] = []
        self.marks: dict[int, Holder] = {}
        self.files: dict[int, dict[str, tuple[int, bytes | str | None]] | None] = {}
        self.forking = False  # whether test cells get forks of their marks
        self.scratch: Holder | None = None
        self.scratch_left = 0.0

    def first(self, shell: NotebookShell, begun: Sequence[tuple[str, list]]) -> Holder:
        """Start the state that every other one descends from."""
        ours, theirs = pair()
        pid = os.fork()
        if pid == 0:
            self.grader.close()
            ours.close()
            limits_.apply(self.limits)
            state_.start(shell, theirs.sock.detach(), begun)
        theirs.close()
        return Holder(pid, ours)

    def serve(self) -> None:
        """Answer the grader until it closes the channel."""
        while True:
            try:
                request = self.grader.receive()
            except Closed:
                return
            try:
                answer = getattr(self, f"do_{request[0]}")(*request[1:])
            except Ended as ended:
                answer = ["ended", ended.reason, self.left]
            except OSError as error:
                answer = ["ended", f"died: {error.strerror}", self.left]
            except (wire.WireError, ValueError, TypeError, OverflowError, MemoryError, RecursionError):
                answer = ["ended", "protocol", self.left]  # of what a state said
            self.grader.send_frame(answer if isinstance(answer, bytes) else frames.pack(answer))

    def fork(self, holder: Holder) -> Holder:
        """Fork a state; the old one waits on."""
        ours, theirs = pair()
        try:
            holder.channel.send(["fork"], FORK_TIMEOUT)
            holder.channel.send_descriptor(theirs.fileno())
            reply = holder.channel.receive(FORK_TIMEOUT, FORK_BYTES)
            if (
                type(reply) is not list
                or len(reply) != 2
                or reply[0] != "forked"
                or type(reply[1]) is not int
            ):
                raise Ended("lost")
        except (Closed, TimeoutError, wire.WireError) as error:
            ours.close()
            raise Ended("lost") from error
        finally:
            theirs.close()
        if not 1 < reply[1] < MAX_PID:
            raise Ended("lost")
        return Holder(reply[1], ours)

    def ask(self, holder: Holder, request: bytes, cpu: float) -> bytes:
        """Send a packed request to a state and wait for its answer within limits."""
        cpu = min(cpu, self.left)
        wall = self.limits.wall(cpu)
        deadline = time.monotonic() + wall
        began = limits_.process_cpu(holder.pid) or 0.0
        try:
            holder.channel.send_frame(request, wall)
            return self.wait(holder, began + cpu, deadline)
        except TimeoutError:
            raise Ended("wall") from None
        except Closed:
            raise Ended("died") from None
        except wire.WireError:
            raise Ended("protocol") from None
        finally:
            self.left -= max(0.0, (limits_.process_cpu(holder.pid) or began) - began)

    def wait(self, holder: Holder, cpu_end: float, deadline: float) -> bytes:
        """Return the body of the next frame, or raise when a clock runs out."""
        import select  # noqa: PLC0415

        poll = select.poll()
        poll.register(holder.channel.fileno(), select.POLLIN)
        while True:
            if poll.poll(TICK * 1000):
                return holder.channel.receive_frame(max(TICK, deadline - time.monotonic()), ANSWER_BYTES)
            used = limits_.process_cpu(holder.pid)
            if used is not None and used > cpu_end:
                raise Ended("cpu")
            if time.monotonic() > deadline:
                raise Ended("wall")
            self.reap()

    def reap(self) -> None:
        """Collect orphans: the parent of last resort in this namespace is this process."""
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass

    def see_off(self, group: int, descriptor: int) -> None:
        """Wait a while until an ended state and its children are gone: they count among the notebook's processes."""
        import select  # noqa: PLC0415

        end = time.monotonic() + GOING_SECONDS
        select.select([descriptor], [], [], GOING_SECONDS)
        os.close(descriptor)
        with contextlib.suppress(ChildProcessError):  # none is left: each had become a child of this process
            while time.monotonic() < end:
                if os.waitpid(-group, os.WNOHANG)[0] == 0:
                    time.sleep(TICK / 10)

    # requests of the grader

    def do_files(self, name: str, content: bytes, mode: int) -> list:
        """Put a file into the notebook's folder."""
        path = (self.home / name).resolve()
        if not path.is_relative_to(self.home):
            return ["ended", "outside the folder", self.left]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        path.chmod(mode & 0o777 | 0o600)
        return ["done", self.left]

    def do_cell(self, source: str, careful: bool) -> bytes:
        """Run a cell in the newest state, after a fork where the state before it must stay as it is.

        A state stays where it is marked, and before the first cell that is not the instructor's since it was kept.
        """
        if self.left <= 0:
            raise Ended("notebook")
        if self.top in self.marks.values() or (careful and self.kept is None):
            self.keep()
        try:
            body = self.ask(self.top, frames.pack(["cell", source]), self.limits.cell_cpu)
        except Ended:
            self.go_back()
            raise
        self.since.append(source)
        return self.answer(body)

    def keep(self) -> None:
        """Keep the newest state as the one to go back to, and go on in a fork of it."""
        child = self.fork(self.top)
        if self.kept is not None and self.kept not in self.marks.values():
            self.kept.channel.close()
        self.kept, self.top, self.since = self.top, child, []

    def go_back(self) -> None:
        """Make the state before a cell that did not end: the kept one, and again what ran well since."""
        descriptor = None
        with contextlib.suppress(OSError):
            descriptor = os.pidfd_open(self.top.pid)
        self.top.end()
        if descriptor is not None:
            self.see_off(self.top.pid, descriptor)
        if self.kept is None:
            raise Ended("lost")
        self.top = self.fork(self.kept)
        for source in self.since:
            try:
                self.ask(self.top, frames.pack(["cell", source]), self.limits.cell_cpu)
            except Ended:
                raise Ended("lost") from None

    def answer(self, body: bytes) -> bytes:
        """Wrap what a state said, unread: the grader checks it."""
        return frames.pack(["answer", body, self.left])

    def do_mark(self, number: int) -> list:
        """Keep the newest state, and the files as they are, for a test cell."""
        self.marks[number] = self.top
        self.files[number] = snapshot(self.home)
        return ["done", self.left]

    def do_begin(self, number: int) -> list:
        """Start a test cell at a mark."""
        self.end_scratch()
        restore(self.home, self.files[number])
        self.scratch_left = self.limits.cell_cpu
        if number not in self.marks:
            raise Ended("lost")
        mark = self.marks[number]
        if self.forking or mark is self.top or mark is self.kept or list(self.marks.values()).count(mark) > 1:
            self.scratch = self.fork(mark)
        else:
            self.scratch = self.marks.pop(number)
        return ["done", self.left]

    def do_again(self, number: int) -> list:
        """Fork the mark once more, in the same test cell: its process has died."""
        left, self.forking = self.scratch_left, True
        try:
            return self.do_begin(number)
        finally:
            self.scratch_left = left

    def do_ask(self, request: bytes) -> bytes:
        """Hand a request of a test cell to its fork."""
        if self.scratch is None:
            raise Ended("died")
        cpu = min(self.limits.call_cpu, self.scratch_left)
        if cpu <= 0 or self.left <= 0:
            raise Ended("cell" if self.left > 0 else "notebook")
        before = self.left
        try:
            return self.answer(self.ask(self.scratch, frames.frame(request), cpu))
        except Ended:
            self.end_scratch()
            raise
        finally:
            self.scratch_left -= before - self.left

    def do_end(self) -> list:
        """End the test cell's fork."""
        self.end_scratch()
        return ["done", self.left]

    def end_scratch(self) -> None:
        """Kill the fork of a test cell, if there is one."""
        if self.scratch is not None:
            self.scratch.end()
            self.scratch = None
        self.reap()


def snapshot(folder: Path) -> dict[str, tuple[int, Any]] | None:
    """Return the files below a folder by relative name, None if they are too many to keep.

    What cannot be read, because a submission made it so, is left out.
    """
    found: dict[str, tuple[int, Any]] = {}
    size = 0
    for root, folders, names in os.walk(folder):
        for name in [*folders, *names]:
            path = Path(root, name)
            key = str(path.relative_to(folder))
            with contextlib.suppress(OSError):
                status = path.lstat()
                mode = stat.S_IMODE(status.st_mode) & 0o777
                if stat.S_ISLNK(status.st_mode):
                    found[key] = (-1, str(path.readlink()))
                elif stat.S_ISDIR(status.st_mode):
                    found[key] = (mode, None)
                elif stat.S_ISREG(status.st_mode):
                    content = read_file(path, SNAPSHOT_BYTES - size)
                    if content is None:
                        return None
                    size += len(content)
                    found[key] = (mode, content)
    return found


def read_file(path: Path, most: int) -> bytes | None:
    """Return the content of a file, None if it is more than so many bytes.

    A process of the submission may put something else into its place meanwhile, or let it grow: what is read is
    bounded, no link at its place is followed, and what is no file raises OSError.
    """
    with os.fdopen(os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb") as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError(errno.EINVAL, "not a file")
        content = file.read(most + 1)
    return content if len(content) <= most else None


def restore(folder: Path, files: dict[str, tuple[int, Any]] | None) -> None:
    """Bring a folder back to a snapshot, as far as a submission has not made that impossible."""
    if files is None:
        return
    for path in folder.iterdir():
        # The folders for temporary files are mounted elsewhere too: they are emptied, not made anew.
        for entry in list(path.iterdir()) if path.name in KEPT else [path]:
            with contextlib.suppress(OSError, RecursionError):
                if entry.is_dir() and not entry.is_symlink():
                    shutil.rmtree(entry, ignore_errors=True)
                else:
                    entry.unlink(missing_ok=True)
    for name, (mode, content) in files.items():
        path = folder / name
        with contextlib.suppress(OSError):
            if mode == -1:
                path.symlink_to(content)
            elif content is None:
                path.mkdir(parents=True, exist_ok=True)
            else:
                path.write_bytes(content)
                path.chmod(mode)
