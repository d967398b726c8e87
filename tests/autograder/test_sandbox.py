"""The sandbox from inside: what is not there cannot be reached, and where nothing can be shut off nothing starts."""

# ruff: noqa: ARG005, E501  (stand-ins take what the real ones take)

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from starts import UNFILTERED_TOO

import autograder
import roboloc_reference
from autograder import sandbox as sandbox_
from autograder.sandbox import Sandbox, SandboxError
from autograder.session import Session
from autograder.worker.limits import Limits

REPOSITORY = Path(autograder.__file__).resolve().parents[1]


# What is there.


def test_no_answers_can_be_imported(inside):
    """The student's package can be imported; the reference, the grader, its checks and its tools cannot."""
    names = [
        "roboloc_reference", "roboloc_reference.motion", "autograder", "autograder.checks", "autograder.wire",
        "nbgrader", "notebook_session.session", "notebook_session.sandbox", "notebook_session.checks", "pytest",
        "pip", "sqlalchemy", "__editable___roboloc_0_1_0_finder",
    ]  # fmt: skip
    printed = inside(
        f"import importlib, roboloc.angles\nfor name in {names}:\n"
        "    try: importlib.import_module(name); print(name)\n    except ImportError: pass"
    )
    assert printed == ""


WALK = """
import os
for root, folders, files in os.walk("/", onerror=lambda error: None):
    if root in ("/usr/share", "/usr/lib"):
        folders[:] = [f for f in folders if "python" in f]
    for name in [*folders, *files]:
        print(os.path.join(root, name))
"""


def test_no_file_of_the_course_is_there(inside):
    """A walk over everything that can be seen meets no repository, reference, check, gradebook or submission."""
    paths = inside("import builtins\nlines = []\nprint = lines.append\n" + WALK + (
        "words = ('roboloc_reference', 'autograder', 'gradebook', 'submitted', 'nbgrader', 'solutions', '/.git/',"
        " 'handout', 'misconception', 'pyproject.toml', 'nbgrader_config')\n"
        "bad = [l for l in lines if any(w in l for w in words)]\n"
        "builtins.print(len(lines)); builtins.print(*bad, sep='\\n')"
    )).split("\n")  # fmt: skip
    assert int(paths[0]) > 5000
    assert [path for path in paths[1:] if path] == []


@pytest.mark.parametrize(
    "path",
    [
        "/proc", "/proc/self/maps", "/proc/1/environ", "/sys", "/run", "/var", f"/home/student/../..{REPOSITORY}", "/etc/passwd",
        "/etc/shadow", "/etc/hostname", str(Path.home() / ".bashrc"), str(REPOSITORY), str(REPOSITORY / ".git"),
        str(Path(roboloc_reference.__file__).parent), str(REPOSITORY / "autograder"), "/dev/kmsg", "/dev/mem", "/boot",
        "/opt/worker/notebook_session/session.py", "/opt/worker/notebook_session/mirror.py",
    ],
)  # fmt: skip
def test_paths_that_are_not_there(inside, path):
    """Neither the kernel's files, the system's accounts, nor the course's folders exist inside."""
    assert inside(f"import os; print(os.path.lexists({path!r}))") == "False\n"


def test_the_environment_tells_nothing(inside, monkeypatch):
    """Nothing of the grader's environment is inside: no variable, no argument, no host name, no course secret."""
    monkeypatch.setenv("ROBOLOC_SECRET", "a-secret-of-the-course")
    known = (
        sys.base_prefix,
        "/usr/bin:/bin",
        "C.UTF-8",
    )  # where the interpreter is, a process of it can tell
    secrets = [
        value for value in os.environ.values() if len(value) > 6 and not any(value in word for word in known)
    ]
    assert "a-secret-of-the-course" in secrets
    printed = inside(
        "import os, socket, sys\nprint(dict(os.environ), socket.gethostname(), sys.argv, sys.path, os.getcwd())\n"
        "import ctypes\nlibc = ctypes.CDLL(None)\nenviron = ctypes.POINTER(ctypes.c_char_p).in_dll(libc, 'environ')\n"
        "i = 0\nwhile environ[i]:\n    print(environ[i]); i += 1"
    )
    assert [value for value in secrets if value in printed] == []
    assert "grad" not in printed.lower()
    assert "ROBOLOC" not in printed
    assert str(REPOSITORY) not in printed


def test_the_stack_shows_no_grader(inside):
    """Objects that a cell can reach in its own process hold nothing of checks, answers or the machine's paths."""
    printed = inside(
        "import gc, sys\nprint(sorted(sys.modules))\nframe = sys._getframe()\nwhile frame:\n"
        "    print(frame.f_code.co_filename); frame = frame.f_back\n"
        f"print([s for s in gc.get_objects() if type(s) is dict and {str(REPOSITORY)!r} in s])"
    )
    for word in ("roboloc_reference", "autograder", "nbgrader", str(REPOSITORY), "misconception"):
        assert word not in printed


WRITE = """
import os
places = ["/", "/usr", "/usr/lib", "/bin", "/etc", "/opt", "/opt/site", "/opt/site/numpy", "/opt/site/roboloc",
          "/opt/worker/notebook_session", "/opt/worker/notebook_session/worker", "/home", "/dev", "/lib", "/root",
          os.path.dirname(os.__file__)]
for place in places:
    for what in (lambda: open(os.path.join(place, "mine"), "w").close(), lambda: os.mkdir(os.path.join(place, "dir"))):
        try:
            what()
            print("wrote", place)
        except OSError:
            pass
for path in ("/opt/site/numpy/__init__.py", "/opt/worker/notebook_session/wire.py", "/usr/bin/env", os.__file__):
    for what in (lambda: open(path, "a"), lambda: os.unlink(path), lambda: os.chmod(path, 0o777),
                 lambda: os.rename(path, path + "x")):
        try:
            what()
            print("changed", path)
        except OSError:
            pass
open("mine", "w").close(); open("/tmp/mine", "w").close(); open("/dev/shm/mine", "w").close()
"""


def test_nothing_is_written_outside_the_folder(inside):
    """Only the notebook's own folder and temporary folders can be written, and no file of the system changed."""
    assert inside(WRITE) == ""


RISE = """
import ctypes, os
libc = ctypes.CDLL(None, use_errno=True)
def attempt(name, result):
    if result == 0 or result is None:
        print("got", name)
def quiet(f):
    try: return f()
    except OSError: return -1
attempt("mount", libc.mount(b"none", b"/tmp", b"tmpfs", 0, None))
attempt("proc", libc.mount(b"proc", b"/tmp", b"proc", 0, None))
attempt("umount", libc.umount2(b"/home/student", 2))
attempt("remount", libc.mount(b"none", b"/", None, 32 | 4096, None))
attempt("chroot", libc.chroot(b"/tmp"))
attempt("sethostname", libc.sethostname(b"x", 1))
attempt("setuid", quiet(lambda: os.setuid(0)))
attempt("setresuid", quiet(lambda: os.setresuid(0, 0, 0)))
attempt("mknod", quiet(lambda: os.mknod("disk", 0o60666, os.makedev(8, 0))))
for pid in (1, 2, os.getppid()):
    attempt(f"ptrace {pid}", libc.ptrace(0x4206, pid, None, None))
buffer = ctypes.create_string_buffer(8)
class Vec(ctypes.Structure):
    _fields_ = [("base", ctypes.c_void_p), ("len", ctypes.c_size_t)]
mine, theirs = Vec(ctypes.addressof(buffer), 8), Vec(id(os), 8)
for pid in (1, 2, os.getppid()):
    read = libc.process_vm_readv(pid, ctypes.byref(mine), 1, ctypes.byref(theirs), 1, 0)
    attempt(f"read {pid}", 0 if read > 0 else -1)
print(os.getuid() != 0, os.geteuid() != 0)
"""


@UNFILTERED_TOO
def test_no_rights_are_had(inside):
    """No mount, no other user, no device, and no look into the warden's or an earlier state's memory."""
    assert inside(RISE) == "True True\n"


def test_the_warden_cannot_be_stopped(inside, either, limits):
    """Signals to the first process of the notebook's namespace do nothing."""
    session = Session(either, limits)
    session.cell(
        "import os, signal\nfor n in range(1, 32):\n    try: os.kill(1, n)\n    except OSError: pass"
    )
    result = session.cell("print('on')")
    assert (result.ended, result.outputs[0]["text"]) == ("", "on\n")
    assert session.close()


# Starting, and failing to.


def test_without_bubblewrap_it_refuses_and_names_the_remedy(monkeypatch):
    """Where bubblewrap is missing nothing is run, and the message says what to install or to allow."""
    monkeypatch.setattr(sandbox_.shutil, "which", lambda name: None)
    with pytest.raises(
        SandboxError, match=r"not installed[\s\S]*apt-get install bubblewrap[\s\S]*trust_submissions"
    ):
        Sandbox()


def test_where_bubblewrap_is_refused_it_says_so(monkeypatch, tmp_path):
    """Where bubblewrap cannot do its work, the sandbox passes on its reason and does not start."""
    fake = tmp_path / "bwrap"
    fake.write_text("#!/bin/sh\necho 'bwrap: No permissions to create new namespace' >&2\nexit 1\n")
    fake.chmod(0o755)
    monkeypatch.setattr(sandbox_.shutil, "which", lambda name: str(fake))
    with pytest.raises(SandboxError, match="No permissions to create new namespace"):
        Sandbox()


def test_a_sandbox_that_has_ended_says_so(limits):
    """Opening a notebook in a sandbox that is gone is an error of the sandbox, not of the submission."""
    sandbox = Sandbox()
    sandbox.close()
    with pytest.raises(SandboxError, match="has ended"):
        Session(sandbox, limits)


def test_packages_are_an_allow_list(monkeypatch):
    """What is bound into the sandbox are the named distributions and what they require, and of ours `roboloc` alone."""
    sources = [source for source, _ in sandbox_._site_binds(sandbox_.PACKAGES)]
    targets = {Path(target).name for _, target in sandbox_._site_binds(sandbox_.PACKAGES)}
    assert {"numpy", "scipy", "sympy", "matplotlib", "IPython", "msgpack", "roboloc"} <= targets
    assert not {"roboloc_reference", "autograder", "nbgrader", "jupyterlab", "pytest", "sqlalchemy"} & targets
    assert [s for s in sources if "roboloc_reference" in s or s.endswith("autograder")] == []
    names = {d.name for d in sandbox_.closure(["sympy", "no-such-distribution"])}
    assert names == {"sympy", "mpmath"}


def test_memory_of_the_limits_reaches_the_kernel(inside):
    """Inside, the limits of the kernel are those that were asked for."""
    printed = inside(
        "import resource as r\nprint(*[r.getrlimit(k)[1] for k in (r.RLIMIT_AS, r.RLIMIT_NPROC, r.RLIMIT_FSIZE,"
        " r.RLIMIT_CORE)])"
    )
    assert printed.split() == [str(3 * 1024**3), "40", str(4 * 1024**2), "0"]


def test_limits_round_trip():
    """Limits cross the wire in order."""
    limits = Limits(call_cpu=1.5, disk=7)
    assert Limits.from_list(limits.to_list()) == limits
