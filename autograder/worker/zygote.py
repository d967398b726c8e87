"""The warm process of a sandbox: imports once what notebooks import, then forks for each notebook.

It is started by `autograder.sandbox` inside bubblewrap. It sees no submission: the grader hands it a socket, it forks a
warden into new pid, mount and IPC namespaces with a folder of its own, and what the notebook is goes over that socket.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import os
import signal
import socket
import sys
from pathlib import Path
from typing import Any

from . import state as state_
from .channel import Channel, Closed
from .limits import Limits
from .shell import make_shell

HOME = Path("/home/student")
PRELOAD = (
    "numpy.testing", "numpy.linalg", "numpy.random", "scipy.linalg", "sympy", "matplotlib.pyplot",
    "matplotlib_inline.backend_inline", "IPython.display", "roboloc.angles", "roboloc.se2", "roboloc.simulation",
    "roboloc.filters", "roboloc.checks", "roboloc.plotting",
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


def spawn(descriptor: int, limits: Limits, uid: int, shell: Any) -> None:
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
                Warden(Channel(socket.socket(fileno=descriptor)), shell, limits, HOME).serve()
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
    if "sympy" in sys.modules:  # fill the caches of its simplest operations
        import sympy  # noqa: PLC0415

        t = sympy.Symbol("t")
        sympy.limit(sympy.sin(t) / t, t, 0)
        str(sympy.latex(sympy.diff(sympy.sin(t) ** 2, t)))
    if "matplotlib.pyplot" in sys.modules:  # find the fonts, once
        import matplotlib.pyplot as plt  # noqa: PLC0415

        figure, axes = plt.subplots()
        axes.set_title("$x$")
        figure.canvas.draw()
        plt.close(figure)
    gc.collect()
    gc.freeze()  # what is here stays: collections in forks must not touch, and so copy, its pages
    return missing


def main(descriptor: int) -> None:
    """Serve the grader until it closes the control socket.

    Parameters
    ----------
    descriptor : int
        The control socket, inherited.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    control = Channel(socket.socket(fileno=descriptor))
    state_.hide_memory()
    shell = make_shell()
    missing = preload()
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    control.send(["ready", missing, os.getuid()])
    while True:
        try:
            limits, uid = control.receive()
            handed = control.receive_descriptor()
        except Closed:
            return
        if os.fork() == 0:
            control.close()
            signal.signal(signal.SIGINT, signal.default_int_handler)
            spawn(handed, Limits.from_list(limits), uid, shell)
        os.close(handed)
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
