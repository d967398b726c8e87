"""The sandbox from inside: what is not there cannot be reached, and nothing is left of a notebook."""

# ruff: noqa: ARG005, E501  (stand-ins take what the real ones take)

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import autograder
import roboloc_reference
from autograder import sandbox as sandbox_
from autograder.sandbox import Sandbox, SandboxError
from autograder.session import Session
from autograder.worker.limits import Limits

REPOSITORY = Path(autograder.__file__).resolve().parents[1]


STARTS = ("as it is", "user")


@pytest.fixture(scope="module", params=STARTS)
def either(request, sandbox):
    """Give the sandbox as it starts here, and as it starts for a grader who is not root."""
    if request.param != "user":
        yield sandbox if request.param == "as it is" else request.getfixturevalue("unfiltered")
        return
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "geteuid", lambda: 1000)
        running = Sandbox()
    with running:
        assert running.mode == "user"
        yield running


@pytest.fixture
def inside(either, limits):
    """Run one cell in a new notebook of either sandbox and return what it printed."""
    sessions = []

    def run(source, files=None):
        session = Session(either, limits, files)
        sessions.append(session)
        result = session.cell(source)
        assert result.succeeded, (result.ended, result.outputs)
        return "".join(o["text"] for o in result.outputs if o["output_type"] == "stream")

    yield run
    for session in sessions:
        session.close()


def owned_by(uid):
    """Return the processes of a user on this machine."""
    found = set()
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            with contextlib.suppress(OSError):
                if folder.stat().st_uid == uid:
                    found.add(int(folder.name))
    return found


def below(pid):
    """Return a process and all its descendants on this machine."""
    parents = {}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            with contextlib.suppress(OSError, IndexError):
                parents[int(folder.name)] = int((folder / "stat").read_text().rsplit(")", 1)[1].split()[1])
    found = {pid}
    while more := {child for child, parent in parents.items() if parent in found} - found:
        found |= more
    return found


# No network.


@pytest.fixture
def listeners():
    """Listen outside on loopback, IPv4 and IPv6, and on an abstract name; collect who comes."""
    visitors, sockets = [], []

    def listen(family, address):
        listener = socket.socket(family)
        listener.bind(address)
        listener.listen()
        listener.settimeout(0.1)
        sockets.append(listener)
        return listener.getsockname()

    addresses = [
        (socket.AF_INET, listen(socket.AF_INET, ("127.0.0.1", 0))),
        (socket.AF_UNIX, listen(socket.AF_UNIX, f"\0listener-{os.getpid()}")),
    ]
    with contextlib.suppress(OSError):
        addresses.append((socket.AF_INET6, listen(socket.AF_INET6, ("::1", 0))))
    running = threading.Event()

    def accept():
        while not running.is_set():
            for listener in sockets:
                with contextlib.suppress(TimeoutError):
                    connection, _ = listener.accept()
                    visitors.append(connection.recv(100))
                    connection.close()

    thread = threading.Thread(target=accept)
    thread.start()
    yield addresses, visitors
    running.set()
    thread.join()
    for listener in sockets:
        listener.close()


CONNECT = """
import socket
for family, address in {addresses!r}:
    try:
        with socket.socket(family) as s:
            s.settimeout(2)
            s.connect(address)
            s.sendall(b"visit")
        print("connected")
    except OSError as error:
        print(type(error).__name__)
"""


@pytest.mark.parametrize("either", [*STARTS, "without the filter"], indirect=True)
def test_no_listener_is_reached(inside, listeners):
    """Listeners outside that anybody here can reach are not reached from inside, by address nor by abstract name."""
    addresses, visitors = listeners
    source = CONNECT.format(addresses=[(int(family), address) for family, address in addresses])
    done = subprocess.run([sys.executable, "-c", source], check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["connected"] * len(
        addresses
    )  # outside it works: the test would see a connection
    deadline = time.monotonic() + 5
    while len(visitors) < len(addresses) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert visitors == [b"visit"] * len(addresses)
    assert "connected" not in inside(source)
    time.sleep(0.3)
    assert len(visitors) == len(addresses)


@pytest.mark.parametrize("either", [*STARTS, "without the filter"], indirect=True)
def test_no_other_way_out(inside):
    """There is no interface that is up, no route, no name service, and no raw socket."""
    printed = inside(
        "import socket\n"
        "def attempt(f):\n    try: print('got', f())\n    except OSError: print('no')\n"
        "attempt(lambda: socket.getaddrinfo('example.org', 80))\n"
        "attempt(lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b'x', ('192.0.2.1', 9)))\n"
        "attempt(lambda: socket.socket(socket.AF_INET, socket.SOCK_RAW, 1))\n"
        "attempt(lambda: socket.socket(socket.AF_PACKET, socket.SOCK_RAW))\n"
    )
    assert printed.split() == ["no"] * 4


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


@pytest.mark.parametrize("either", [*STARTS, "without the filter"], indirect=True)
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


# Nothing is left.


def living(pids):
    """Return the processes that are neither gone nor waiting to be collected."""
    found = set()
    for pid in pids:
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            if " Z " not in (Path("/proc") / str(pid) / "stat").read_text():
                found.add(pid)
    return found


def test_no_process_is_left(sandbox, limits):
    """Daemons that left their session and their parent are dead when the notebook has ended, with all its files."""
    with pytest.MonkeyPatch.context() as patch:
        uids = []
        draw = sandbox_.secrets.randbelow
        patch.setattr(sandbox_.secrets, "randbelow", lambda n: uids.append(draw(n)) or uids[-1])
        before = below(sandbox.process.pid)
        session = Session(sandbox, limits)
    result = session.cell(
        "import os, subprocess, time\n"
        "for _ in range(3):\n    if os.fork() == 0:\n        os.setsid()\n        if os.fork() == 0:\n"
        "            while True: time.sleep(1)\n        os._exit(0)\n"
        "p = subprocess.Popen(['sleep', '1000'], start_new_session=True)\nopen('/tmp/left', 'w').write('x')"
    )
    assert result.succeeded, result
    if sandbox.mode == "root":
        assert len(owned_by((1 << 30) + uids[0])) >= 6  # warden, states, three daemons, sleep
    assert len(below(sandbox.process.pid) - before) >= 6
    assert session.close()
    if sandbox.mode == "root":
        assert owned_by((1 << 30) + uids[0]) == set()
    # The parent of the warden closes its end a moment before it is dead; then the zygote collects it when next asked.
    deadline = time.monotonic() + 10
    while (alive := living(below(sandbox.process.pid) - before)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert alive == set()


SPOIL = """
import builtins, os, random, sys, numpy as np, math, roboloc.angles
secret_of_first = 42
np.first = 1; builtins.first = 1; math.pi = 3; os.environ["FIRST"] = "1"; np.random.seed(0); random.seed(0)
roboloc.angles.wrap = None; sys.path.append("/first"); sys.modules["first"] = np; np.sin = np.cos
for place in (".", "/tmp", "/dev/shm"):
    open(os.path.join(place, "first"), "w").write("x")
os.umask(0); os.nice(3)
"""
LOOK = """
import builtins, os, sys, math, numpy as np, roboloc.angles
print("secret_of_first" in globals(), hasattr(np, "first"), hasattr(builtins, "first"), math.pi == 3,
      "FIRST" in os.environ, roboloc.angles.wrap is None, "/first" in sys.path, "first" in sys.modules,
      float(np.sin(0.0)) == 1, any(os.path.exists(p) for p in ("first", "/tmp/first", "/dev/shm/first")),
      os.umask(0o22) == 0, os.nice(0) == 3)
"""


def test_a_second_notebook_sees_nothing_of_the_first(inside):
    """Variables, patched modules, environment, files and process settings of one notebook are not in the next."""
    inside(SPOIL)
    assert inside(LOOK).split() == ["False"] * 12


def test_notebooks_at_the_same_time_do_not_meet(either, limits):
    """Two open notebooks see neither each other's files, processes, shared memory nor sockets."""
    first, second = Session(either, limits), Session(either, limits)
    made = first.cell(
        "import socket, os\nfrom multiprocessing import shared_memory\nopen('/tmp/first', 'w').close()\n"
        "open('/dev/shm/first', 'w').write('x')\nprint(os.getuid())"
    )
    assert made.succeeded, made
    seen = second.cell(
        "import os\ndef alive(pid):\n    try:\n        os.kill(pid, 0)\n        return True\n"
        "    except ProcessLookupError:\n        return False\n    except PermissionError:\n        return True\n"
        "print(os.getuid())\n"
        "print(sorted(os.listdir('/tmp') + os.listdir('/dev/shm')), [p for p in range(1, 400) if alive(p)])"
    )
    uid, rest = seen.outputs[0]["text"].split("\n", 1)
    assert rest.startswith("[] [1, 2, 3]")  # warden, first state, this cell
    if either.mode == "root":
        assert uid != made.outputs[0]["text"].strip()
    first.close()
    second.close()


def test_a_killing_notebook_leaves_the_other_alone(either, limits):
    """A notebook that kills everything it can reach does not disturb one that runs beside it."""
    first, second = Session(either, limits), Session(either, limits)
    second.cell("x = 5")
    first.cell("import os; os.kill(-1, 9)")
    result = second.cell("print(x)")
    assert result.outputs[0]["text"] == "5\n"
    assert first.close()
    assert second.close()


def test_a_full_error_channel_does_not_stop_the_next_notebook(either, limits):
    """Whatever a notebook writes to the process's own standard error, another one can still write there."""
    for _ in range(2):
        session = Session(either, limits)
        result = session.cell(
            "import os\nfor _ in range(40): os.write(2, b'x' * 4096); os.write(1, b'x' * 4096)"
        )
        assert result.succeeded, result
        session.close()


def test_standard_input_is_empty(inside):
    """Nothing can be read from standard input, and asking for input is an error at once."""
    assert inside("import os; print(os.read(0, 10))") == "b''\n"


def test_end_of_the_sandbox_ends_everything(limits):
    """Closing the sandbox ends the processes of every notebook that is still open."""
    sandbox = Sandbox()
    session = Session(sandbox, limits)
    session.cell("import os, time\nif os.fork() == 0:\n    os.setsid(); time.sleep(1000)")
    inside = below(sandbox.process.pid)
    assert len(inside) > 5
    sandbox.close()
    session.channel.close()
    deadline = time.monotonic() + 10
    while any((Path("/proc") / str(pid)).exists() for pid in inside) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert [pid for pid in inside if (Path("/proc") / str(pid)).exists()] == []


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
