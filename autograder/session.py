"""The grader's end of one notebook in the sandbox."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from . import frames, wire
from .memory import MemoryWatch
from .sandbox import SandboxError, finish
from .worker.channel import Channel, Closed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .sandbox import Sandbox
    from .worker.limits import Limits

SLACK = 60.0  # seconds by which the warden may overrun its own clocks before the sandbox is given up

REASONS = {
    "cpu": "it ran longer than its processor time allows",
    "wall": "it did not come to an end in time",
    "cell": "the time of this cell is used up",
    "notebook": "the time of this notebook is used up",
    "died": "it ended its own process",
    "memory": "it used more memory than a notebook may",
    "protocol": "it wrote to the grader's own channel",
    "lost": "it ended the processes it depends on",
}


class Ended(Exception):  # noqa: N818
    """The process that should have answered is gone; `reason` is a key of `REASONS`."""

    def __init__(self, reason: str) -> None:
        self.reason = reason if reason in REASONS else "died"
        super().__init__(REASONS[self.reason])

    @property
    def by_time(self) -> bool:
        """Whether a clock ended it."""
        return self.reason in {"cpu", "wall", "cell", "notebook"}

    @property
    def by_memory(self) -> bool:
        """Whether the watch on the notebook's memory ended it."""
        return self.reason == "memory"


@dataclass(frozen=True)
class CellResult:
    """What became of a cell.

    Attributes
    ----------
    outputs : list of dict
        As the worker sent them: to be cleaned before they are shown.
    succeeded : bool
        Whether it ended without an exception.
    ended : str
        A key of `REASONS` where the cell did not come to its end, else empty.
    """

    outputs: list[dict[str, Any]] = field(default_factory=list)
    succeeded: bool = False
    ended: str = ""


class Session:
    """One notebook in a sandbox: cells run one after the other, test cells ask afterwards.

    Parameters
    ----------
    sandbox : Sandbox
        Where it runs.
    limits : Limits
        What it may use.
    files : dict of str to tuple of (bytes, int)
        The notebook's folder: content and mode by relative name.
    beginning : sequence of str, optional
        See `Sandbox.open`.
    """

    def __init__(
        self,
        sandbox: Sandbox,
        limits: Limits,
        files: dict[str, tuple[bytes, int]] | None = None,
        beginning: Sequence[str] = (),
    ) -> None:
        self.sandbox = sandbox
        self.limits = limits
        self.files = files or {}
        self.beginning = beginning
        self.history: list[list] = []
        self.left = limits.notebook_cpu
        self.watch = MemoryWatch(sandbox.process.pid, limits.notebook_memory)
        try:
            self.channel = self._open()
        except BaseException:
            self.watch.stop()
            raise

    def _open(self) -> Channel:
        channel = self.sandbox.open(self.limits, self.beginning)
        self.channel = channel
        try:
            for name, (content, mode) in self.files.items():
                self._request(["files", name, content, mode])
        except BaseException:
            finish(channel)
            raise
        return channel

    def _request(self, request: list, cpu: float = 0.0) -> list:
        """Send a request to the warden and return its answer's fields."""
        wall = 2 * self.limits.wall(cpu) + SLACK
        ended = self.watch.ended
        try:
            self.channel.send(request, wall)
            answer = self.channel.receive(wall)
        except (Closed, TimeoutError, wire.WireError) as error:
            raise SandboxError(f"the sandbox does not answer ({type(error).__name__})") from error
        kind, *fields, self.left = answer
        if kind == "ended":
            by_watch = fields[0].startswith("died") and self.watch.ended > ended
            raise Ended("memory" if by_watch else fields[0])
        return fields

    def _recover(self) -> None:
        """Start anew and run again what ran well: the states before were ended by the submission itself."""
        finish(self.channel)
        self.channel = self._open()
        for request in self.history:
            self._request(request, self.limits.cell_cpu)

    def _persist(self, request: list, cpu: float) -> list:
        """Send a request; once more where only the wall clock ran out or the states were lost."""
        for last in (False, True):
            try:
                return self._request(request, cpu)
            except Ended as ended:
                if last or ended.reason not in {"wall", "lost"}:
                    raise
                if ended.reason == "lost":
                    self._recover()
                    if request[0] == "cell":
                        request = ["cell", request[1], True]  # what ended its process once is run with care
        raise AssertionError  # pragma: no cover

    def cell(self, source: str, *, careful: bool = True) -> CellResult:
        """Run a cell; one that ends its process, or overruns, leaves the state as it was before it.

        Parameters
        ----------
        source : str
            The cell.
        careful : bool, optional
            Whether to keep the state before it; without, it is made anew where the cell ends its process after all.

        Returns
        -------
        CellResult
            Its outputs, or why it ended.
        """
        try:
            (body,) = self._persist(["cell", source, careful], self.limits.cell_cpu)
            kind, outputs, succeeded = frames.unpack(body)
            outputs = wire.decode(outputs)
            if kind != "value" or type(outputs) is not list or type(succeeded) is not bool:
                return CellResult(ended="protocol")
        except Ended as ended:
            return CellResult(ended=ended.reason)
        except (wire.WireError, ValueError, TypeError):
            return CellResult(ended="protocol")
        self.history.append(["cell", source, True])
        return CellResult(outputs, succeeded)

    def mark(self, number: int) -> None:
        """Keep the state of this moment for a test cell."""
        self._request(["mark", number])
        self.history.append(["mark", number])

    def begin(self, number: int) -> None:
        """Start a test cell at a mark."""
        self._persist(["begin", number], self.limits.call_cpu)

    def again(self, number: int) -> None:
        """Start the same test cell's process once more."""
        self._persist(["again", number], self.limits.call_cpu)

    def end(self) -> None:
        """End a test cell's process."""
        self._request(["end"])

    def ask(self, request: list) -> list:
        """Send a request to the test cell's process and return its answer.

        Parameters
        ----------
        request : list
            See `worker.state.State.answer`.

        Returns
        -------
        list
            What it says, unpacked and not yet decoded: nothing in it is to be believed.

        Raises
        ------
        Ended
            If the process died, overran, or does not speak the protocol.
        """
        (body,) = self._request(["ask", frames.pack(request)[4:]], self.limits.call_cpu)
        try:
            answer = frames.unpack(body)
        except wire.WireError:
            raise Ended("protocol") from None
        if type(answer) is not list or not answer or type(answer[0]) is not str:
            raise Ended("protocol")
        return answer

    def close(self) -> bool:
        """End the notebook; return whether all its processes were seen to end."""
        self.watch.stop()
        return finish(self.channel)
