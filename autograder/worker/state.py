"""A process that holds a notebook's state: runs cells, forks itself, answers calls of the submission's functions.

It runs the submission's code, so nothing it says is believed further than a value is: see `warden` and
`autograder.session` for what is checked outside.
"""

from __future__ import annotations

import builtins
import contextlib
import ctypes
import linecache
import os
import signal
import sys
import traceback
from types import ModuleType
from typing import TYPE_CHECKING, Any

from .. import wire
from . import lines, randomness, symbolic
from .channel import Channel, Closed
from .shell import recording, run_cell

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .shell import NotebookShell

CELL_FILE = "<ipython-input-"
MAX_MESSAGE = 2000
_PR_SET_DUMPABLE = 4
_PR_SET_PDEATHSIG = 1
_libc = ctypes.CDLL(None, use_errno=True)


def hide_memory() -> None:
    """Forbid other processes of this user to read this one's memory."""
    _libc.prctl(_PR_SET_DUMPABLE, 0, 0, 0, 0)


class State:
    """The shell with its namespace, and the objects that are known to the grader by number.

    Parameters
    ----------
    shell : NotebookShell
        Holds the namespace.
    channel : Channel
        To the warden.
    begun : sequence of tuple of (str, list), optional
        The cells that have run already, and what `do_cell` answered: see `zygote.begin`. The notebook's first cells are
        these.
    """

    def __init__(
        self, shell: NotebookShell, channel: Channel, begun: Sequence[tuple[str, list]] = ()
    ) -> None:
        self.shell = shell
        self.channel = channel
        self.begun = list(begun)
        self.objects: list[Any] = []
        self.children: set[int] = set()
        self.random: list | None = None  # the shared generators as the test set them, where it did

    def serve(self) -> None:
        """Answer requests until the warden is gone."""
        while True:
            self.reap()
            try:
                request = self.channel.receive()
            except (Closed, wire.WireError):
                os._exit(0)
            if request[0] == "fork":
                self.fork(self.channel.receive_descriptor())
            else:
                self.channel.send(self.answer(request))

    def reap(self) -> None:
        """Collect children that have ended."""
        for child in list(self.children):
            with contextlib.suppress(ChildProcessError):
                if os.waitpid(child, os.WNOHANG)[0] == 0:
                    continue
            self.children.discard(child)

    def fork(self, descriptor: int) -> None:
        """Make a child with this state that serves the given channel; tell the warden its number."""
        try:
            child = os.fork()
        except OSError:  # the submission has used up its processes
            child = -1
        if child == 0:
            self.become_child(descriptor)
            return
        os.close(descriptor)
        if child > 0:
            self.children.add(child)
        self.channel.send(["forked", child])

    def become_child(self, descriptor: int) -> None:
        """Serve a channel of its own from now on."""
        os.setpgid(0, 0)
        hide_memory()
        self.channel.close()
        import socket  # noqa: PLC0415

        self.channel = Channel(socket.socket(fileno=descriptor))
        self.children = set()

    def answer(self, request: list) -> list:
        """Carry out one request.

        Parameters
        ----------
        request : list
            ``["cell", source]``, ``["describe", names]``, ``["call", ref, attribute, args, kwargs, changes]``,
            ``["getattr", ref, attribute, changes]``, ``["evaluate", ref, values]`` or ``["lines", ref, args, most,
            changes]``.

        Returns
        -------
        list
            ``["value", ...]``, ``["raised", ...]`` or ``["uncrossable", reason]``.
        """
        try:
            return getattr(self, f"do_{request[0]}")(*request[1:])
        except wire.WireError as error:
            return ["uncrossable", str(error)[:MAX_MESSAGE]]

    def do_cell(self, source: str) -> list:
        """Run a cell; answer with its outputs."""
        if self.begun and self.begun[0][0] == source:
            return self.begun.pop(0)[1]
        return answer_of_cell(self.shell, source)

    def do_describe(self, names: list[str]) -> list:
        """Say what each name stands for; objects that are not plain data get a number."""
        return ["value", [self.describe(name) for name in names]]

    def describe(self, name: str) -> list:
        """Say what one name stands for."""
        namespace = self.shell.user_ns
        if name not in namespace:
            return ["missing"]
        value = namespace[name]
        if type(value) is ModuleType:
            return ["module", str(value.__name__)]
        return ["data", wire.encode(value, self.refer)]

    def refer(self, value: object) -> wire.Ref:
        """Give an object a number."""
        self.objects.append(value)
        return wire.Ref(len(self.objects) - 1, type(value).__name__, callable(value))

    def look_up(self, ref: wire.Ref) -> Any:
        """Return the object of a number."""
        if not 0 <= ref.number < len(self.objects):
            raise wire.WireError("an object that is gone")
        return self.objects[ref.number]

    def apply(self, changes: list) -> None:
        """Carry over what the test cell assigned or deleted since the last request."""
        for change in changes:
            if change[0] == "random":
                randomness.put(wire.decode(change[1]))
                self.random = randomness.states()
            elif change[0] == "set":
                self.shell.user_ns[change[1]] = wire.decode(change[2], self.look_up, allow_named=True)
            else:
                self.shell.user_ns.pop(change[1], None)

    def do_apply(self, changes: list) -> list:
        """Carry over changes alone."""
        self.apply(changes)
        return ["value", None]

    def do_call(self, ref: int, attribute: str, args: list, kwargs: list, changes: list) -> list:
        """Call an object, or a method of it, and say what it did to its arguments."""
        self.apply(changes)
        args = wire.decode(args, self.look_up, allow_named=True)
        kwargs = wire.decode(kwargs, self.look_up, allow_named=True)
        places = [*enumerate(args), *kwargs.items()]
        before = [_encode_or_none(value) for _, value in places]
        target = self.look_up(wire.Ref(ref))
        with recording(self.shell) as recorder:
            try:
                function = getattr(target, attribute) if attribute else target
                result = ["value", wire.encode(function(*args, **kwargs), self.refer)]
            except wire.WireError:
                raise
            except BaseException as error:  # noqa: BLE001  (whatever a submission raises is an answer)
                result = self.raised(error)
        after = [_encode_or_none(value) for _, value in places]
        changed = [
            [place, new] for (place, _), old, new in zip(places, before, after, strict=True) if new != old
        ]
        if self.random is not None and (drawn := randomness.states()) != self.random:
            self.random = drawn
            changed.append([randomness.DRAWN, wire.encode(drawn)])
        printed = "".join(o["text"] for o in recorder.finish() if o.get("name") == "stdout")
        return [*result, changed, printed]

    def do_getattr(self, ref: int, attribute: str, changes: list) -> list:
        """Return an attribute of an object."""
        self.apply(changes)
        try:
            value = getattr(self.look_up(wire.Ref(ref)), attribute)
        except BaseException as error:  # noqa: BLE001
            return [*self.raised(error), [], ""]
        return ["value", wire.encode(value, self.refer), [], ""]

    def do_evaluate(self, ref: int, values: dict[str, float]) -> list:
        """Evaluate a symbolic expression at a point."""
        try:
            return ["value", wire.encode(symbolic.evaluate(self.look_up(wire.Ref(ref)), values)), [], ""]
        except wire.WireError:
            raise
        except BaseException as error:  # noqa: BLE001
            return [*self.raised(error), [], ""]

    def do_lines(self, ref: int, args: list, most: int, changes: list) -> list:
        """Call an object and count the lines of Python that run; see `lines`."""
        self.apply(changes)
        args = wire.decode(args, self.look_up, allow_named=True)
        target = self.look_up(wire.Ref(ref))
        with recording(self.shell) as recorder:
            try:
                result = ["value", wire.encode(lines.count(target, args, most, watched=True), self.refer)]
            except wire.WireError:
                raise
            except BaseException as error:  # noqa: BLE001
                result = self.raised(error)
        recorder.finish()
        return [*result, [], ""]

    def raised(self, error: BaseException) -> list:
        """Describe an exception: its class, the nearest builtin class, its text and the submission's line."""
        kind = type(error)
        nearest = next(c.__name__ for c in kind.__mro__ if getattr(builtins, c.__name__, None) is c)
        line, text = _own_line(error)
        return ["raised", [kind.__module__, kind.__name__, nearest, _text(error), line, text]]


def answer_of_cell(shell: NotebookShell, source: str) -> list:
    """Run a cell and return what a state answers."""
    outputs, succeeded = run_cell(shell, source)
    try:
        return ["value", wire.encode(outputs), succeeded]
    except wire.WireError as error:  # e.g. a display hook of the submission's that returns odd objects
        text = f"the outputs of this cell cannot be shown: {error}"
        lost = {"output_type": "error", "ename": "OutputError", "evalue": text, "traceback": [text]}
        return ["value", wire.encode([lost]), False]


def _encode_or_none(value: object) -> Any:
    """Encode an argument that a call could change; None for what it could not, or what cannot be compared."""
    try:
        return wire.encode(value)
    except wire.WireError:
        return None


def _text(error: BaseException) -> str:
    try:
        return str(error)[:MAX_MESSAGE]
    except BaseException:  # noqa: BLE001
        return ""


def _own_line(error: BaseException) -> tuple[int, str]:
    """Return number and text of the innermost line of a cell in a traceback."""
    number, text = 0, ""
    for frame in traceback.walk_tb(error.__traceback__):
        name = frame[0].f_code.co_filename
        if name.startswith(CELL_FILE):
            number, text = frame[1], linecache.getline(name, frame[1]).strip()[:200]
    return number, text


def start(shell: NotebookShell, descriptor: int, begun: Sequence[tuple[str, list]] = ()) -> None:
    """Be the first state process of a notebook; does not return."""
    import socket  # noqa: PLC0415

    os.setpgid(0, 0)
    hide_memory()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.path.append("")  # files beside the notebook; last, and here alone: the warden imports none of them
    state = State(shell, Channel(socket.socket(fileno=descriptor)), begun)
    try:
        state.serve()
    finally:
        sys.stdout = sys.stderr = None
        os._exit(1)
