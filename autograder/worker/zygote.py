"""The warm process of a sandbox: imports once what notebooks import, then forks for each notebook.

It is started by `autograder.sandbox` inside bubblewrap. It sees no submission: the grader hands it a socket, it forks a
warden into new pid, mount and IPC namespaces with a folder of its own, and what the notebook is goes over that socket.
The one thing it is told of an assignment is the cells of the instructor's with which all its notebooks begin: a child
runs them once, and each notebook goes on from there.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import linecache
import os
import resource
import signal
import socket
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from .. import wire
from . import barrier
from . import state as state_
from .channel import Channel, Closed, pair
from .limits import Limits
from .shell import fresh_namespace, make_shell

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .shell import NotebookShell

HOME = Path("/home/student")
BEGIN_SECONDS = 60
MAX_BEGINNINGS = (
    8  # each is a process; a submission that inserts a cell at the top has a beginning of its own
)
PRELOAD = (
    "numpy.testing", "numpy.linalg", "numpy.random", "scipy.linalg", "sympy", "matplotlib.pyplot",
    "matplotlib_inline.backend_inline", "IPython.display", "roboloc.angles", "roboloc.se2", "roboloc.simulation",
    "roboloc.filters", "roboloc.checks", "roboloc.plotting", "roboloc.worlds", "roboloc.lidar", "roboloc.logs",
    "roboloc.metrics",
)  # fmt: skip

_CLONE_NEWNS, _CLONE_NEWIPC, _CLONE_NEWPID = 0x20000, 0x08000000, 0x20000000
_MS_NOSUID, _MS_NODEV, _MS_BIND, _MS_REC, _MS_PRIVATE = 2, 4, 4096, 16384, 1 << 18
_PR_CAP_AMBIENT, _PR_CAP_AMBIENT_CLEAR_ALL, _PR_SET_NO_NEW_PRIVS = 47, 4, 38
_CAPABILITY_VERSION_3 = 0x20080522
_libc = ctypes.CDLL(None, use_errno=True)


def _check(result: int, what: str) -> None:
    if result != 0:
        number = ctypes.get_errno()
        raise OSError(number, f"{what}: {os.strerror(number)}")


def _mount(source: str, target: str, kind: str, flags: int, options: str = "") -> None:
    _check(
        _libc.mount(source.encode(), target.encode(), kind.encode(), flags, options.encode()),
        f"mount {kind or source} on {target}",
    )


def isolate(limits: Limits, uid: int) -> None:
    """Give this process namespaces and a folder of its own; the next fork is the first of its pid namespace.

    Parameters
    ----------
    limits : Limits
        Size of the folder.
    uid : int
        Who owns it.
    """
    _check(_libc.unshare(_CLONE_NEWNS | _CLONE_NEWPID | _CLONE_NEWIPC), "unshare")
    _mount("none", "/", "", _MS_REC | _MS_PRIVATE)
    options = f"size={limits.disk},nr_inodes=20000,mode=0755,uid={uid},gid={uid}"
    _mount("tmpfs", str(HOME), "tmpfs", _MS_NOSUID | _MS_NODEV, options)
    for inside, outside in ((".tmp", "/tmp"), (".shm", "/dev/shm")):  # noqa: S108  (mount points of the sandbox)
        folder = HOME / inside
        folder.mkdir()
        os.chown(folder, uid, uid)
        folder.chmod(0o1777)
        _mount(str(folder), outside, "", _MS_BIND)
    os.chdir(HOME)


def drop_privileges(uid: int) -> None:
    """Become an ordinary user for good."""
    if os.getuid() != uid:
        os.setgroups([])
        os.setresgid(uid, uid, uid)
        os.setresuid(uid, uid, uid)
    _libc.prctl(_PR_CAP_AMBIENT, _PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0)
    header = (ctypes.c_uint32 * 2)(_CAPABILITY_VERSION_3, 0)
    _check(_libc.capset(header, (ctypes.c_uint32 * 6)()), "capset")
    _check(_libc.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0), "no_new_privs")


def keep_only(descriptor: int) -> None:
    """Close every inherited descriptor but one, and connect the standard streams to nothing."""
    os.closerange(3, descriptor)
    os.closerange(descriptor + 1, max(resource.getrlimit(resource.RLIMIT_NOFILE)[0], descriptor + 1))
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(nothing, stream)
    os.close(nothing)


def spawn(
    descriptor: int,
    limits: Limits,
    uid: int,
    shell: NotebookShell,
    begun: Sequence[tuple[str, list]],
    program: bytes,
) -> None:
    """Run a notebook's warden to its end; in a child of the zygote, does not return.

    The process that waits here keeps the notebook's socket open. When the grader reads the end of it, the kernel has
    ended every process of the notebook.
    """
    from .warden import Warden  # noqa: PLC0415

    with contextlib.suppress(Exception):
        isolate(limits, uid)
        child = os.fork()
        if child == 0:
            with contextlib.suppress(BaseException):
                drop_privileges(uid)
                state_.hide_memory()
                barrier.put_in_force(program)
                Warden(Channel(socket.socket(fileno=descriptor)), shell, limits, HOME, begun).serve()
            os._exit(0)
        os.waitpid(child, 0)
    os._exit(0)


def preload() -> list[str]:
    """Import what notebooks import; what the environment lacks is left out."""
    missing = []
    for name in PRELOAD:
        try:
            importlib.import_module(name)
        except ImportError:
            missing.append(name)
    if "sympy" in sys.modules:  # fill the caches of its simplest operations, and have its printers imported
        import sympy  # noqa: PLC0415

        from .symbolic import evaluate  # noqa: PLC0415

        t = sympy.Symbol("t")
        sympy.limit(sympy.sin(t) / t, t, 0)
        str(sympy.latex(sympy.diff(sympy.sin(t) ** 2, t)))
        evaluate(sympy.sin(t), {"t": 0.5})
    if "matplotlib.pyplot" in sys.modules:  # find the fonts, once
        import matplotlib.pyplot as plt  # noqa: PLC0415

        figure, axes = plt.subplots()
        axes.set_title("$x$")
        figure.canvas.draw()
        plt.close(figure)
    return missing


def draw_once(shell: NotebookShell) -> None:
    """Let the inline back end show and close a cell's figures before pyplot draws those that are open still.

    The other way round, as they come by import, every figure is drawn one time more.
    """
    shell.events.callbacks["post_execute"].sort(key=lambda call: call.__module__ == "matplotlib.pyplot")


def begin(shell: NotebookShell, sources: list[str]) -> list[tuple[str, list]]:
    """Run the cells with which notebooks begin; return each with what it answers.

    Parameters
    ----------
    shell : NotebookShell
        The shell that notebooks are forked with.
    sources : list of str
        Cells of the instructor's with which every notebook of an assignment begins.

    Returns
    -------
    list of tuple of (str, list)
        The cells and answers, in order. Empty where one fails here, for lack of a file say, or leaves a file behind,
        which a notebook would not see: then each notebook runs them itself, and only what they imported,
        and what libraries remember of them, is kept.
    """
    files = _temporary_files()
    signal.alarm(BEGIN_SECONDS)  # its default action ends this process, and notebooks start cold
    begun = [(source, state_.answer_of_cell(shell, source)) for source in sources]
    signal.alarm(0)
    succeeded = all(answer[-1] is True for _, answer in begun)
    if succeeded and _temporary_files() == files:
        settle()
        return begun
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
    shell.reset(new_session=True)
    fresh_namespace(shell, "__main__")
    shell.execution_count = 1
    linecache.clearcache()
    settle()
    return []


def _temporary_files() -> list[str]:
    return sorted(str(path) for path in Path("/tmp").rglob("*") if ".matplotlib" not in path.parts)  # noqa: S108


def settle() -> None:
    """Let collections in forks leave alone what is in memory now: touching a page would copy it."""
    gc.collect()
    gc.freeze()


class Nursery:
    """Forks notebooks; for each beginning that notebooks share, a child that has run it once.

    Parameters
    ----------
    control : Channel
        Where requests come from.
    shell : NotebookShell
        What notebooks start with.
    begun : sequence of tuple of (str, list)
        What has run in it; see `begin`.
    program : bytes
        The filter of system calls that notebooks run under.
    """

    def __init__(
        self, control: Channel, shell: NotebookShell, begun: Sequence[tuple[str, list]], program: bytes
    ) -> None:
        self.control = control
        self.shell = shell
        self.program = program
        self.begun = begun
        self.warm: dict[tuple[str, ...], Channel | None] = {}

    def serve(self) -> None:
        """Start notebooks until the control channel closes."""
        while True:
            try:
                limits, uid, beginning = self.control.receive()
                handed = self.control.receive_descriptor()
            except Closed:
                return
            if not (beginning and self.pass_on(tuple(beginning), limits, uid, handed)):
                self.fork_notebook(Limits.from_list(limits), uid, handed)
            os.close(handed)
            with contextlib.suppress(ChildProcessError):
                while os.waitpid(-1, os.WNOHANG)[0]:
                    pass

    def fork_notebook(self, limits: Limits, uid: int, handed: int) -> None:
        """Start a notebook from this process."""
        if os.fork() == 0:
            keep_only(handed)
            spawn(handed, limits, uid, self.shell, self.begun, self.program)

    def pass_on(self, beginning: tuple[str, ...], limits: list[float], uid: int, handed: int) -> bool:
        """Let the child that knows a beginning start the notebook; return False where there is none."""
        if beginning not in self.warm:
            if len(self.warm) == MAX_BEGINNINGS:
                return False
            self.warm[beginning] = self.fork_nursery(beginning)
        child = self.warm[beginning]
        if child is None:
            return False
        try:
            child.send([limits, uid, []])
            child.send_descriptor(handed)
        except Closed:
            self.warm[beginning] = None
            return False
        return True

    def fork_nursery(self, beginning: tuple[str, ...]) -> Channel | None:
        """Start a child that runs a beginning and then forks notebooks; None where it does not survive that."""
        ours, theirs = pair()
        if os.fork() == 0:
            with contextlib.suppress(BaseException):
                keep_only(theirs.fileno())
                begun = begin(self.shell, list(beginning))
                theirs.send(["ready"])
                Nursery(theirs, self.shell, begun, self.program).serve()
            os._exit(0)
        theirs.close()
        try:
            ours.receive(2 * BEGIN_SECONDS)
        except (Closed, TimeoutError, wire.WireError):
            ours.close()
            return None
        return ours


def main(descriptor: int) -> None:
    """Serve the grader until it closes the control socket.

    Parameters
    ----------
    descriptor : int
        The control socket, inherited.
    """
    # The warden too ignores it: to the first process of a namespace come only the signals it has a handler for.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    control = Channel(socket.socket(fileno=descriptor))
    program = control.receive()
    state_.hide_memory()
    shell = make_shell()
    missing = preload()
    draw_once(shell)
    settle()
    control.send(["ready", missing, os.getuid(), barrier.refusal(program)])
    Nursery(control, shell, (), program).serve()
