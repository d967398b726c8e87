"""The sandbox of submissions: bubblewrap around a warm worker.

What a submission can see is listed here and is short: the interpreter and its standard library, the packages of an
allow-list with what they depend on, the system's shared libraries, and its own folder. There is no network, no `/proc`,
no repository, no reference, and nobody else's work. What is not there cannot be read or imported. Of the kernel less
can be asked than it offers: see `system_calls`.
"""

from __future__ import annotations

import importlib.metadata
import os
import re
import secrets
import shutil
import socket
import subprocess
import sys
import sysconfig
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from .system_calls import FilterError, program
from .worker.channel import Channel, Closed, pair

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from .worker.limits import Limits

PACKAGES = (
    "roboloc",
    "ipython",
    "ipywidgets",
    "matplotlib",
    "matplotlib-inline",
    "msgpack",
    "numpy",
    "scipy",
    "sympy",
)
SITE = "/opt/site"
WORKER = "/opt/worker"
NAME = "notebook_session"
START_TIMEOUT = 120.0
# Runs what follows; where memory runs out, the kernel ends what runs below it before any other process of the machine.
FIRST_TO_GO = ("/bin/sh", "-c", 'echo 1000 2>/dev/null >/proc/self/oom_score_adj; exec "$@"', "sh")
_CAP_MODES = {
    # Root on its own machine: no user namespace; a notebook gets an unprivileged user of its own, so that the limit on
    # processes, which the kernel does not apply to root, holds.
    "root": [w for name in ("SYS_ADMIN", "SETUID", "SETGID", "CHOWN", "FOWNER") for w in ("--cap-add", f"CAP_{name}")],
    "user": ["--unshare-user", "--uid", "1000", "--gid", "1000", "--cap-add", "CAP_SYS_ADMIN"],
}  # fmt: skip


class SandboxError(RuntimeError):
    """No sandbox can be had, or it is gone; the text says what to do."""


REMEDY = """submissions are graded inside bubblewrap, and {problem}.
  Debian, Ubuntu:  apt-get install bubblewrap libseccomp2
  Fedora:          dnf install bubblewrap libseccomp
  In a container:  allow user namespaces (Docker: --security-opt seccomp=unconfined, or a profile with unshare)
  Ubuntu 24.04:    sysctl kernel.apparmor_restrict_unprivileged_userns=0
  Where none of this can be had, --IsolatedExecute.trust_submissions=True grades WITHOUT protection."""


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def closure(packages: Iterable[str]) -> list[importlib.metadata.Distribution]:
    """Return the installed distributions of some names and everything they require.

    Parameters
    ----------
    packages : iterable of str
        Distribution names; one that is not installed is left out.

    Returns
    -------
    list of importlib.metadata.Distribution
        Each once, by name.
    """
    found: dict[str, importlib.metadata.Distribution] = {}
    waiting = [_normal(name) for name in packages]
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        try:
            found[name] = importlib.metadata.distribution(name)
        except importlib.metadata.PackageNotFoundError:
            continue
        for line in found[name].requires or ():
            requirement, _, marker = line.partition(";")
            match = re.match(r"[A-Za-z0-9._-]+", requirement.strip())
            if match and "extra" not in marker:
                waiting.append(_normal(match[0]))
    return [found[name] for name in sorted(found)]


def _top_level(distribution: importlib.metadata.Distribution) -> set[Path]:
    """Return the entries of site-packages that belong to a distribution."""
    entries = set()
    for file in distribution.files or ():
        first = file.parts[0]
        if first in ("..", "__pycache__") or first.endswith(".pth") or first.startswith("__editable__"):
            continue
        entries.add(Path(str(distribution.locate_file(first))))
    return entries


@cache
def _site_binds(packages: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    binds: dict[str, str] = {}
    for distribution in closure(packages):
        if _normal(distribution.name) == "roboloc":
            continue  # its project also installs the reference: take the one package
        for path in sorted(_top_level(distribution)):
            binds.setdefault(f"{SITE}/{path.name}", str(path))
    if "roboloc" in packages:
        import roboloc  # noqa: PLC0415

        binds[f"{SITE}/roboloc"] = str(Path(roboloc.__file__).parent)
    return tuple((source, target) for target, source in sorted(binds.items()))


def _interpreter_binds() -> list[str]:
    """Return bubblewrap's arguments for the interpreter, its library and the system below it."""
    prefix = Path(sys.base_prefix).resolve()
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    library = prefix / "lib" / version
    arguments = []
    if not prefix.is_relative_to("/usr"):
        executable = Path(sys.executable).resolve()
        arguments += [*_folders(executable.parent), *_folders(library.parent)]
        arguments += ["--ro-bind", str(executable), str(executable), "--ro-bind", str(library), str(library)]
        for shared in sorted((prefix / "lib").glob("libpython*.so*")):
            arguments += ["--ro-bind", str(shared), str(shared)]
    # What happens to be installed for everybody is not for submissions: they have the allow-list.
    hidden = {
        library / "site-packages",
        Path(sysconfig.get_path("purelib", vars={"base": str(prefix)})),
        *(Path(f"/usr{local}/lib/{name}/{kind}") for local in ("", "/local") for name in ("python3", version)
          for kind in ("dist-packages", "site-packages")),
        Path("/usr/src"), Path("/usr/share/doc"), Path("/usr/local/src"),
    }  # fmt: skip
    for folder in sorted(hidden):
        if folder.is_dir() and (folder.is_relative_to("/usr") or folder.is_relative_to(library)):
            arguments += ["--tmpfs", str(folder)]
    return arguments


def _folders(folder: Path) -> list[str]:
    """Return the arguments that make a folder and those above it, readable by all (implied ones are not)."""
    return [word for path in [*reversed(folder.parents), folder][1:] for word in ("--dir", str(path))]


def _system_binds() -> list[str]:
    arguments = ["--ro-bind", "/usr", "/usr"]
    for name in ("bin", "sbin", "lib", "lib32", "lib64"):
        path = Path("/", name)
        if path.is_symlink():
            arguments += ["--symlink", str(path.readlink()), str(path)]
        elif path.is_dir():
            arguments += ["--ro-bind", str(path), str(path)]
    for name in ("/etc/ld.so.cache", "/etc/alternatives", "/etc/localtime", "/etc/fonts"):
        if Path(name).exists():
            arguments += ["--ro-bind", name, name]
    return arguments


def command(packages: Sequence[str], mode: str, hidden: Sequence[str] = ()) -> list[str]:
    """Return the command line that starts a sandbox, up to the descriptor of its control socket.

    Parameters
    ----------
    packages : sequence of str
        Distributions a submission may import, with what they require.
    mode : {"root", "user"}
        Whether the grader is root on its own machine, or anybody else.
    hidden : sequence of str, optional
        Folders that must not be seen even where they lie below a folder that is.

    Returns
    -------
    list of str
        For `subprocess.Popen`.
    """
    here = Path(__file__).resolve().parent
    environment = {
        "HOME": "/home/student", "USER": "student", "LOGNAME": "student", "LANG": "C.UTF-8", "PATH": "/usr/bin:/bin",
        "PYTHONPATH": SITE, "MPLBACKEND": "module://matplotlib_inline.backend_inline",
        "MPLCONFIGDIR": "/tmp/.matplotlib",  # noqa: S108
        "IPYTHONDIR": "/home/student/.ipython", "PYTHONHASHSEED": "0",
        **{f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMEXPR")},
    }  # fmt: skip
    arguments = [
        shutil.which("bwrap") or "bwrap",
        *("--unshare-pid", "--unshare-net", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try"),
        *_CAP_MODES[mode],
        *("--die-with-parent", "--new-session", "--clearenv", "--hostname", "notebook"),
        *_system_binds(),
        *_interpreter_binds(),
    ]
    for folder in hidden:
        if Path(folder).resolve().is_relative_to("/usr"):
            arguments += ["--tmpfs", str(Path(folder).resolve())]
    arguments += [*_folders(Path(SITE)), *_folders(Path(WORKER, NAME))]
    for source, target in _site_binds(tuple(packages)):
        arguments += ["--ro-bind", source, target]
    for name in ("wire.py", "named.py", "frames.py"):
        arguments += ["--ro-bind", str(here / name), f"{WORKER}/{NAME}/{name}"]
    arguments += ["--ro-bind", str(here / "worker"), f"{WORKER}/{NAME}/worker"]
    arguments += ["--dev", "/dev", "--tmpfs", "/tmp", "--dir", "/home/student", "--chdir", "/home/student"]  # noqa: S108
    # What is mapped from /dev/zero is memory that no limit counts.
    arguments += ["--ro-bind", "/dev/null", "/dev/zero"]
    for folder in ("/dev", "/"):
        arguments += ["--remount-ro", folder]
    for name, value in environment.items():
        arguments += ["--setenv", name, value]
    start = f"import sys; sys.path[:0] = [{SITE!r}, {WORKER!r}]; from {NAME}.worker import zygote; zygote.main(int(sys.argv[1]))"  # noqa: E501
    return [*arguments, str(Path(sys.executable).resolve()), "-I", "-S", "-B", "-c", start]


def require_bubblewrap() -> bytes:
    """Refuse to go on where there is no bubblewrap, or no filter for what runs in it.

    Returns
    -------
    bytes
        The filter.

    Raises
    ------
    SandboxError
        If one of them is not installed; the text says what to do.
    """
    if shutil.which("bwrap") is None:
        raise SandboxError(REMEDY.format(problem="it is not installed"))
    try:
        return program()
    except FilterError as error:
        raise SandboxError(REMEDY.format(problem=str(error))) from error


class Sandbox:
    """A running sandbox; :meth:`open` starts notebooks in it.

    Parameters
    ----------
    packages : sequence of str, optional
        Distributions that submissions may import besides the standard library.
    hidden : sequence of str, optional
        Folders to cover where the system's folders contain them: the course, the repository.
    filtered : bool, optional
        Whether system calls are filtered; tests of the other defences do without.

    Attributes
    ----------
    importable : frozenset of str
        The packages that submissions may import.

    Raises
    ------
    SandboxError
        If bubblewrap or libseccomp is missing or refused; the text says what to do.
    """

    def __init__(
        self, packages: Sequence[str] = PACKAGES, hidden: Sequence[str] = (), *, filtered: bool = True
    ) -> None:
        self.importable = frozenset(
            Path(place).name.partition(".")[0] for _, place in _site_binds(tuple(packages))
        )
        self._program = require_bubblewrap() if filtered else b""
        modes = ["root", "user"] if os.geteuid() == 0 else ["user"]
        for mode in modes:
            problem = self._start(command(packages, mode, hidden))
            if not problem:
                self.mode = mode
                return
        raise SandboxError(REMEDY.format(problem=f"it does not start here ({problem})"))

    def _start(self, arguments: list[str]) -> str:
        """Start the process; return what went wrong, or nothing."""
        self.control, theirs = pair()
        descriptor = theirs.fileno()
        self.process = subprocess.Popen(  # noqa: S603
            [*FIRST_TO_GO, *arguments, str(descriptor)],
            pass_fds=[descriptor], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        )  # fmt: skip
        theirs.close()
        try:
            self.control.send(self._program, START_TIMEOUT)
            _, self.missing, self.uid, refusal = self.control.receive(START_TIMEOUT)
        except (Closed, TimeoutError):
            self.process.kill()
            _, text = self.process.communicate()
            self.control.close()
            return (text.decode(errors="replace").strip().splitlines() or ["no message"])[-1]
        if refusal:
            self.close()
            return f"the kernel refuses its filter of system calls: {refusal}"
        return ""

    def open(self, limits: Limits, beginning: Sequence[str] = ()) -> Channel:
        """Start a notebook; return the channel to its warden.

        Parameters
        ----------
        limits : Limits
            What it may use.
        beginning : sequence of str, optional
            The instructor's cells with which it begins, as others do: they are run once for all.

        Returns
        -------
        Channel
            See `autograder.session.Session`, which speaks on it.
        """
        ours, theirs = pair()
        # As root every notebook is another user, so that none can signal, trace or be counted with another.
        uid = self.uid or (1 << 30) + secrets.randbelow(1 << 29)
        try:
            self.control.send([limits.to_list(), uid, list(beginning)], START_TIMEOUT)
            self.control.send_descriptor(theirs.fileno())
        except OSError as error:  # `Closed` and `TimeoutError` are ones too
            ours.close()
            raise SandboxError("the sandbox has ended") from error
        finally:
            theirs.close()
        return ours

    def close(self) -> None:
        """End the sandbox and all that runs in it."""
        self.control.close()
        try:
            self.process.wait(5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        if self.process.stderr:
            self.process.stderr.close()

    def __enter__(self) -> Sandbox:  # noqa: PYI034
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def finish(channel: Channel, timeout: float = 30.0) -> bool:
    """End a notebook and wait until the kernel has ended all its processes; return whether that was seen."""
    try:
        channel.sock.shutdown(socket.SHUT_WR)
        while True:
            channel.receive_frame(timeout)
    except Closed:
        return True
    except (TimeoutError, OSError, ValueError):
        return False
    finally:
        channel.close()
