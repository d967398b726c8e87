"""What all processes of a notebook may hold in memory together: where it is too much, the largest end."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from pathlib import Path

import pytest

from autograder.memory import EVERY, LOWEST, at_most, descendants, share
from autograder.session import REASONS, Session

MEGA = 1_000_000
BOUND = 450 * MEGA  # of which the warm sandbox itself takes some 130
CROWD = """
import os, time
def crowd(count, size):
    found = []
    for _ in range(count):
        if (pid := os.fork()) == 0:
            kept = bytearray(b"x") * size
            time.sleep(3)
            os._exit(0)
        found.append(pid)
    print([os.waitpid(pid, 0)[1] for pid in found])
"""
HOG = "crowd(8, 80 * 10**6)"
KILLED = 9


@pytest.fixture
def opened(either, limits):
    """Open notebooks whose processes may hold little together."""
    sessions = []

    def open_one(bound=BOUND):
        sessions.append(Session(either, replace(limits, notebook_memory=bound)))
        assert sessions[-1].cell(CROWD).succeeded
        return sessions[-1]

    yield open_one
    for session in sessions:
        assert session.close()


def shown(result):
    """Return what a cell printed."""
    return "".join(o["text"] for o in result.outputs if o["output_type"] == "stream")


def test_processes_together_are_bounded(opened):
    """As many of a crowd end as it takes, each of which is within its own limit, and the notebook goes on."""
    session = opened()
    ends = eval(shown(session.cell(HOG)))  # noqa: S307  (a list of numbers)
    assert 0 < ends.count(KILLED) < len(ends)
    assert session.watch.ended >= ends.count(KILLED)
    assert shown(session.cell("print('on')")) == "on\n"


def test_without_the_bound_the_crowd_has_it_all(opened):
    """The same crowd under a bound that is large enough ends in peace."""
    session = opened(4000 * MEGA)
    assert shown(session.cell(HOG)) == f"{[0] * 8}\n"
    assert session.watch.ended == 0


def test_a_cell_that_takes_too_much_is_told_so(opened):
    """Where the cell's own process is the largest it ends, with the reason, and the next cell goes on without it."""
    session = opened()
    source = "x = bytearray(b'x') * 500_000_000; import time; time.sleep(5)"
    assert session.cell(source).ended == "memory"
    assert "more memory than a notebook may" in REASONS["memory"]
    assert shown(session.cell("print('x' in dir())")) == "False\n"


def test_what_states_share_counts_once(opened):
    """Memory that many states of a notebook have from one cell is no more than that cell took."""
    session = opened()
    assert session.cell("x = bytearray(b'x') * 100_000_000").succeeded
    for number in range(8):
        session.mark(number)
        assert session.cell(f"y = {number}").succeeded
    below = descendants(session.sandbox.process.pid)
    assert sum(map(at_most, below)) > 2 * BOUND
    assert 100 * MEGA < sum(map(share, below)) < BOUND
    time.sleep(3 * EVERY)
    assert session.watch.ended == 0


def test_a_call_of_a_test_that_takes_too_much_ends(execute, limits):
    """A call is bounded like a cell, its test says why it has no points, and the next test is scored."""
    run = execute(
        (
            "answer",
            "import time\ndef f(x):\n    y = bytearray(b'x') * 500_000_000\n    time.sleep(5)",
            "def f(x): ...",
        ),
        ("answer", "def g(x): return x + 1", "def g(x): ..."),
        ("test", "assert f(3) == 9"),
        ("test", "assert g(1) == 2"),
        limits=replace(limits, notebook_memory=BOUND),
    )
    assert run.scores == [0, 2], [run.error(i) for i in (0, 1)]
    assert run.error(0) == ("MemoryExceeded", REASONS["memory"])
    assert run.flags == ["", ""]


def test_the_kernel_takes_from_the_sandbox_first(opened):
    """Where the machine runs out of memory, every process of the sandbox goes before any other."""
    session = opened()
    below = descendants(session.sandbox.process.pid)
    assert len(below) > 3
    assert {Path(f"/proc/{pid}/oom_score_adj").read_text(encoding="ascii") for pid in below} == {"1000\n"}


SPIN = """
import os, time
def spin(seconds=4):
    end = time.monotonic() + seconds
    while time.monotonic() < end: pass
pids = []
for _ in range(12):
    if (pid := os.fork()) == 0:
        spin()
        os._exit(0)
    pids.append(pid)
time.sleep(1.5)
print({os.getpriority(os.PRIO_PROCESS, pid) for pid in pids})
"""


def test_a_crowd_that_computes_gives_way(opened):
    """Many processes that compute at a time have the lowest priority soon; one that computes alone keeps its own."""
    alone = f"{SPIN.partition('pids')[0]}spin(1)\nprint(os.getpriority(os.PRIO_PROCESS, 0))"
    assert shown(opened().cell(alone)) == f"{os.getpriority(os.PRIO_PROCESS, 0)}\n"
    assert shown(opened().cell(SPIN)) == f"{{{LOWEST}}}\n"
