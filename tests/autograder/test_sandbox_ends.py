"""The end of a notebook in the sandbox: nothing of it is left, and notebooks at the same time do not meet."""

from __future__ import annotations

import contextlib
import os
import time
from dataclasses import replace
from pathlib import Path

import pytest

from autograder import sandbox as sandbox_
from autograder.sandbox import Sandbox
from autograder.session import CellResult, Session
from autograder.worker.warden import read_file, snapshot


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


CROWDED = """
import os, time
for _ in range(30):
    if os.fork() == 0:
        time.sleep(1000)
time.sleep(1000)
"""


def test_a_second_trial_finds_the_processes_of_the_first_gone(sandbox, limits):
    """A cell that overran is run once more when all it started is dead, so that its forks do not fail then."""
    few = replace(limits, processes=40, cell_cpu=10.0, wall_factor=0.0, wall_extra=3.0)
    with contextlib.closing(Session(sandbox, few)) as session:
        assert session.cell(CROWDED) == CellResult(ended="wall")


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


def test_a_snapshot_reads_files_alone_and_no_more_than_it_may(tmp_path):
    """The warden, which no limit holds, follows no link, waits for no pipe, and stops at its bound."""
    (tmp_path / "file").write_bytes(b"x" * 100)
    (tmp_path / "link").symlink_to("/dev/zero")
    (tmp_path / "loop").symlink_to("file")
    os.mkfifo(tmp_path / "pipe")
    assert read_file(tmp_path / "file", 100) == b"x" * 100
    assert read_file(tmp_path / "file", 99) is None
    for name in ("link", "loop", "pipe", "gone", "."):
        with pytest.raises(OSError, match="Errno"):
            read_file(tmp_path / name, 100)
    assert snapshot(tmp_path)["file"] == (0o644, b"x" * 100)
    assert snapshot(tmp_path)["link"] == (-1, "/dev/zero")
