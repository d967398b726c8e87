"""A notebook's states: what ends a cell costs that cell alone, and a test cell leaves nothing behind."""

# ruff: noqa: E501, PT012  (a clock may end any of several calls)

from __future__ import annotations

from dataclasses import replace

import pytest

from autograder import wire
from autograder.session import Ended

CALL = "call"


def shown(result):
    """Return what a cell printed."""
    return "".join(o["text"] for o in result.outputs if o["output_type"] == "stream")


def failed(result):
    """Return class and text of the exception that ended a cell."""
    return next((o["ename"], o["evalue"]) for o in result.outputs if o["output_type"] == "error")


def call(session, name, *args):
    """Call a function of the notebook by its name, in the test cell's process."""
    _, [(_, ref)] = session.ask(["describe", [name]])
    kind, body, *_ = session.ask(
        [CALL, wire.decode(ref).number, "", wire.encode(list(args)), wire.encode({}), []]
    )
    return (kind, wire.decode(body) if kind == "value" else body)


# What ends a cell.

DEADLY = {
    "os._exit": ("import os; x = 2; os._exit(0)", "died"),
    "segfault": ("import ctypes; x = 2; ctypes.string_at(0)", "died"),
    "kills itself": ("import os; x = 2; os.kill(os.getpid(), 9)", "died"),
    "abort": ("import os; x = 2; os.abort()", "died"),
    "replaces itself": ("import os; x = 2; os.execv('/usr/bin/env', ['env', 'true'])", "died"),
    "closes every descriptor": ("import os; x = 2; os.closerange(0, 500)", "died"),
    "writes to the channel": (
        (
            "import os, socket; x = 2\nfor fd in range(3, 60):\n"
            "    try: os.write(fd, b'\\xff' * 64)\n    except OSError: pass\nos._exit(0)"
        ),
        "protocol",
    ),
}


@pytest.mark.parametrize("name", DEADLY)
def test_a_deadly_cell_costs_that_cell_alone(open_session, name):
    """However a cell ends its process, the next one goes on from the state before it."""
    source, reason = DEADLY[name]
    session = open_session()
    assert session.cell("x = 1").succeeded
    result = session.cell(source)
    assert (result.succeeded, result.ended) == (False, reason)
    after = session.cell("print(x)")
    assert (after.succeeded, shown(after)) == (True, "1\n")


@pytest.mark.parametrize("source", ["import sys; x = 2; sys.exit(3)", "x = 2; raise KeyboardInterrupt"])
def test_an_exit_is_an_exception_of_its_cell(open_session, source):
    """As in a notebook, `sys.exit` and an interrupt are errors of their cell, and what it assigned stays."""
    session = open_session()
    result = session.cell(source)
    assert (result.succeeded, result.ended) == (False, "")
    assert failed(result)[0] in {"SystemExit", "KeyboardInterrupt"}
    assert shown(session.cell("print(x)")) == "2\n"


LOOPS = {
    "loop": "while True: pass",
    "swallows": "while True:\n    try:\n        while True: pass\n    except BaseException: pass",
    "ignores signals": "import signal\nfor n in range(1, 60):\n    try: signal.signal(n, signal.SIG_IGN)\n"
    "    except (OSError, ValueError): pass\nsum(iter(int, 1))",
    "in C": "x = 2; (10**9 + 7) ** (10**9)",
    "in threads": "import threading, time\ndef f():\n    while True: pass\n"
    "for _ in range(3): threading.Thread(target=f).start()\ntime.sleep(60)",
}


@pytest.mark.parametrize("name", LOOPS)
def test_a_loop_uses_up_its_cell(open_session, limits, name):
    """A loop, whatever it ignores, ends with the cell's processor time, and the state before it goes on."""
    session = open_session(replace(limits, cell_cpu=0.4))
    session.cell("x = 1")
    assert session.cell(LOOPS[name]).ended == "cpu"
    assert shown(session.cell("print(x)")) == "1\n"


def test_a_sleeper_is_stopped_by_the_wall_clock_after_a_second_try(open_session, limits):
    """A cell that only waits is ended by the wall clock, once more tried, and uses none of the notebook's time."""
    session = open_session(replace(limits, cell_cpu=0.3, wall_factor=1.0, wall_extra=0.2))
    asked = []
    request = session._request
    session._request = lambda *args: asked.append(args[0][0]) or request(*args)
    assert session.cell("import time; time.sleep(60)").ended == "wall"
    assert asked == ["cell", "cell"]
    assert session.left > limits.notebook_cpu - 1


def test_what_only_was_slow_once_is_done_again(open_session, limits):
    """A cell that is slow the first time alone, as on a loaded machine, succeeds."""
    session = open_session(replace(limits, cell_cpu=0.3, wall_factor=1.0, wall_extra=0.5))
    session.cell("import os, time")
    result = session.cell(
        "if not os.path.exists('once'):\n    open('once', 'w').close()\n    time.sleep(60)\nprint('done')"
    )
    assert (result.ended, shown(result)) == ("", "done\n")


def test_the_notebooks_time_is_bounded(open_session, limits):
    """Cells that each stay below their limit use up the notebook's time together; after that none runs."""
    session = open_session(replace(limits, cell_cpu=0.5, notebook_cpu=0.7))
    burn = "import time\nend = time.process_time() + 0.4\nwhile time.process_time() < end: pass"
    reasons = [session.cell(burn).ended for _ in range(4)]
    assert reasons[0] == ""
    assert reasons[-1] == "notebook"
    assert session.left <= 0.1


@pytest.mark.parametrize("who", ["-1", "os.getppid()"])
def test_killing_the_ancestors_is_survived(open_session, who):
    """A cell that kills every process it can, or its parent, costs itself at most: what ran before it stands."""
    session = open_session()
    session.cell("import os; x = 1")
    session.mark(0)
    session.cell(f"try: os.kill({who}, 9)\nexcept OSError: pass")
    assert shown(session.cell("print(x)")) == "1\n"


def test_a_killing_call_does_not_stop_the_next_test(open_session):
    """A function that kills every state when a test calls it costs that test; the next is served from a replay."""
    session = open_session()
    session.cell("import os\ndef kill():\n    os.kill(-1, 9)\n    os._exit(1)\ndef f(x): return x + 1")
    session.mark(0)
    session.cell("print('between')")
    session.mark(1)
    session.begin(0)
    with pytest.raises(Ended, match="process"):
        call(session, "kill")
    session.begin(1)
    assert call(session, "f", 1) == ("value", 2)
    session.begin(0)
    assert call(session, "f", 2) == ("value", 3)


# Test cells.


def test_marks_keep_their_moment(open_session):
    """A mark keeps the state of its place in the notebook, however often and in whatever order it is used."""
    session = open_session()
    for number in range(3):
        session.cell(f"x = {number}\ndef f(): return x")
        session.mark(number)
    assert session.cell("x = 99").succeeded
    for number in (2, 0, 1, 0):
        session.begin(number)
        assert call(session, "f") == ("value", number)


def test_a_test_cells_fork_leaves_nothing(open_session):
    """Globals, modules, files, folder, environment and random state that a call changed are as before in the next."""
    session = open_session()
    session.cell(
        "import math, os, random, sys, tempfile\nhits = []\nopen('data.txt', 'w').write('first'); os.mkdir('sub')\n"
        "def spoil():\n"
        "    hits.append(1); math.pi = 3; os.environ['SPOILT'] = '1'; sys.path.append('x'); random.seed(1)\n"
        "    open('data.txt', 'w').write('second'); open('new.txt', 'w').close(); os.rename('sub', 'bus')\n"
        "    open('/tmp/left', 'w').close(); open('/dev/shm/left', 'w').close(); os.chdir('/'); f.mark = 1\n"
        "def f():\n"
        "    return (hits, math.pi == 3, 'SPOILT' in os.environ, 'x' in sys.path, open('data.txt').read(),\n"
        "        sorted(n for n in os.listdir('.') if n[0] != '.'), os.path.exists('/tmp/left'),\n"
        "        os.path.exists('/dev/shm/left'), os.getcwd(), hasattr(f, 'mark'))"
    )
    session.mark(0)
    clean = (
        "value",
        ([], False, False, False, "first", ["data.txt", "sub"], False, False, "/home/student", False),
    )
    session.begin(0)
    assert call(session, "f") == clean
    assert call(session, "spoil")[0] == "value"
    assert call(session, "f")[0] == "raised"  # in the same test cell it is seen: there is no data.txt in /
    session.end()
    session.begin(0)
    assert call(session, "f") == clean


def test_a_call_may_use_temporary_files(open_session):
    """Calls of every test cell find a temporary folder that can be written."""
    session = open_session()
    session.cell(
        "import tempfile\n"
        "def f():\n    with tempfile.NamedTemporaryFile() as file, open('/dev/shm/x', 'wb') as shared:\n"
        "        shared.write(b'abc'); file.write(b'abc'); file.seek(0)\n        return len(file.read())\nf()"
    )
    session.mark(0)
    session.mark(1)
    for number in (0, 1, 0):
        session.begin(number)
        assert call(session, "f") == ("value", 3)


@pytest.mark.parametrize(
    "source",
    [
        "open('locked', 'w').close(); os.chmod('locked', 0)",
        "os.mkdir('closed'); open('closed/x', 'w').close(); os.chmod('closed', 0)",
        "[(os.mkdir('d' * 50), os.chdir('d' * 50)) for _ in range(400)]; os.chdir('/home/student')",
        "os.symlink('/', 'root'); os.symlink('loop', 'loop'); os.mkfifo('pipe')",
        "open(b'\\xff\\xfe', 'w').close()",
        "import socket; s = socket.socket(socket.AF_UNIX); s.bind('sock')",
    ],
    ids=["unreadable file", "unreadable folder", "deep", "links", "bytes", "socket"],
)
def test_odd_files_are_no_obstacle(open_session, source):
    """Whatever a cell leaves in its folder, the test cells after it are served."""
    session = open_session()
    session.cell(f"import os\ndef f(x): return x + 1\n{source}")
    session.mark(0)
    session.cell("y = 1")
    session.mark(1)
    for number in (0, 1, 0):
        session.begin(number)
        assert call(session, "f", number) == ("value", number + 1)


def test_a_call_that_dies_is_reported_and_the_test_goes_on(open_session):
    """A call that ends its process says so; the same test's process can be had again with the state before it."""
    session = open_session()
    session.cell("import os\nn = 0\ndef die(): os._exit(0)\ndef f():\n    global n; n += 1; return n")
    session.mark(0)
    session.begin(0)
    assert call(session, "f") == ("value", 1)
    with pytest.raises(Ended, match="ended its own process") as caught:
        call(session, "die")
    assert not caught.value.by_time
    with pytest.raises(Ended):
        call(session, "f")
    session.again(0)
    assert call(session, "f") == ("value", 1)


def test_calls_are_bounded_each_and_together(open_session, limits):
    """One call may use its processor time, all calls of a test cell together theirs, and a new test cell starts anew."""
    session = open_session(replace(limits, call_cpu=0.5, cell_cpu=0.8))
    session.cell(
        "import time\ndef burn(t):\n    end = time.process_time() + t\n    while time.process_time() < end: pass"
    )
    session.mark(0)
    session.begin(0)
    assert call(session, "burn", 0.35)[0] == "value"
    assert call(session, "burn", 0.35)[0] == "value"
    with pytest.raises(Ended) as caught:
        for _ in range(5):
            call(session, "burn", 0.2)
    assert caught.value.by_time
    with pytest.raises(Ended, match="this cell"):
        session.again(0)
        for _ in range(3):
            call(session, "burn", 0.05)
    session.begin(0)
    assert call(session, "burn", 0.01)[0] == "value"
    with pytest.raises(Ended, match="processor time"):
        call(session, "burn", 5)


@pytest.mark.parametrize(
    "reply",
    [
        "b'\\xff\\xff\\xff\\xff'",
        "b'\\0\\0\\0\\1\\xc0'",
        "b'\\0\\0\\0\\2\\x91\\xc0'",
        "b'\\0\\0\\0\\1\\xc1'",
        "b'\\0\\0'",
    ],
)
def test_forged_answers_are_recognised(open_session, reply):
    """Bytes that a function writes to the grader's channel are no answer, and the next test is served."""
    session = open_session()
    session.cell(
        "import os, stat\ndef forge():\n    for fd in range(3, 60):\n        try:\n"
        f"            if stat.S_ISSOCK(os.fstat(fd).st_mode): os.write(fd, {reply})\n"
        "        except OSError: pass\n    os._exit(0)\ndef f(): return 1"
    )
    session.mark(0)
    session.begin(0)
    with pytest.raises(Ended):
        call(session, "forge")
    session.begin(0)
    assert call(session, "f") == ("value", 1)


# Limits the kernel keeps.


def test_memory(open_session):
    """Eight gigabytes are not had: the cell gets a MemoryError, catches it or not, and the notebook goes on."""
    session = open_session()
    result = session.cell("import numpy as np\nx = np.ones(8 * 2**30 // 8)")
    assert failed(result)[0] in {"MemoryError", "_ArrayMemoryError", "ArrayMemoryError"}
    result = session.cell("try:\n    b = bytearray(8 * 2**30)\nexcept MemoryError:\n    print('no')")
    assert (result.ended, shown(result)) == ("", "no\n")


def test_processes(open_session, limits):
    """A fork bomb stops at the limit, and the next cell runs all the same."""
    session = open_session(replace(limits, processes=20))
    result = session.cell(
        "import os, time\nn = 0\ntry:\n    while n < 1000:\n        if os.fork() == 0:\n            time.sleep(300)\n"
        "        n += 1\nexcept OSError:\n    pass\nprint(n)"
    )
    assert result.ended == ""
    assert int(shown(result)) < 20
    after = session.cell("print('on')")
    assert (after.ended, shown(after)) in {("", "on\n"), ("lost", "")}


def test_a_fork_bomb_in_a_call_costs_that_call(open_session, limits):
    """Processes that a call starts and leaves do not keep the next test cell from its own."""
    session = open_session(replace(limits, processes=20))
    session.cell(
        "import os, time\ndef bomb():\n    try:\n        while True:\n            if os.fork() == 0:\n"
        "                os.setsid(); time.sleep(300)\n    except OSError:\n        return 1\ndef f(): return 2"
    )
    session.mark(0)
    session.begin(0)
    assert call(session, "bomb") == ("value", 1)
    session.begin(0)
    assert call(session, "f") == ("value", 2)


def test_file_size_and_disk(open_session):
    """A file above its limit, and files above theirs together, give an error in the cell that writes them."""
    session = open_session()
    result = session.cell(
        "import signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\nopen('big', 'wb').write(b'x' * (5 * 2**20))"
    )
    assert failed(result)[0] == "OSError"
    result = session.cell("for i in range(9):\n    open(f'part{i}', 'wb').write(b'x' * (3 * 2**20))")
    assert failed(result)[0] == "OSError"
    assert shown(session.cell("print('on')")) == "on\n"
    result = session.cell("for i in range(30000):\n    open(f'n{i}', 'w').close()")
    assert failed(result)[0] == "OSError"


def test_output_is_bounded(open_session):
    """A cell that prints without end, or shows a thousand tables, sends a bounded output."""
    session = open_session()
    result = session.cell("for _ in range(3000): print('x' * 1000)")
    assert result.succeeded
    assert 100_000 < len(shown(result)) < 300_000
    result = session.cell(
        "from IPython.display import display, HTML\nfor _ in range(1000): display(HTML('x'))"
    )
    assert len(result.outputs) <= 200
    result = session.cell(
        "import sys\nfor i in range(1000):\n    print(1)\n    print(2, file=sys.stderr)\n1/0"
    )
    assert failed(result)[0] == "ZeroDivisionError"


def test_files_of_the_notebook_are_there(open_session):
    """The notebook's folder holds the files that came with it, with their mode, and nothing else."""
    session = open_session(
        files={"map.csv": (b"0,1\n", 0o644), "lib/run.sh": (b"#!/bin/sh\necho 5\n", 0o755)}
    )
    assert shown(session.cell("print(open('map.csv').read(), sorted(f for f in __import__('os').listdir('.')"
                              " if f[0] != '.'))")) == "0,1\n ['lib', 'map.csv']\n"  # fmt: skip
    assert "5" in shown(session.cell("!lib/run.sh"))


@pytest.mark.parametrize("name", ["../outside", "/outside", "a/../../outside"])
def test_no_file_is_put_outside_the_folder(open_session, name):
    """A file name that leads out of the folder is refused."""
    with pytest.raises(Ended):
        open_session(files={name: (b"x", 0o644)})


def test_the_instructors_cell_without_a_fork(open_session):
    """A cell run without care changes the state in place; where it dies after all, the state is made anew."""
    session = open_session()
    session.cell("import os; x = 1")
    assert session.cell("x = 2", careful=False).succeeded
    session.mark(0)
    assert session.cell("x = 3", careful=False).succeeded
    assert session.cell("x = 4; os._exit(0)", careful=False).ended == "died"
    assert shown(session.cell("print(x)")) == "3\n"
    session.begin(0)
    assert session.ask(["describe", ["x"]]) == ["value", [["data", 2]]]
