"""`kill -9` at random moments of a class: what is graded in the end is what an undisturbed run gives.

Killed are the grader, a process of its pool, the warm process of the sandbox (the zygote), and the warden of a notebook
(the worker). After a kill of the grader the next run goes on; after the others the same run does.
"""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import tempfile
import threading
import time
from pathlib import Path

import pytest
from gradebooks import whole
from processes import alive, children
from temporary_course import ASSIGNMENT, Course, environment

from autograder.interrupted import MARKER

PACKAGES = ["ipython", "matplotlib-inline", "msgpack", "numpy"]  # few: the sandbox is ready sooner
SEED = 20260
KILLS = {"grader": 5, "pool": 5, "zygote": 5, "worker": 5}
SPIN = "import time\nend = time.process_time() + 0.15\nwhile time.process_time() < end:\n    pass"


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """Make a class of four, one of them wrong, that takes about a second besides the start."""
    made = Course.create(tmp_path_factory.mktemp("kills") / "course", packages=PACKAGES)
    for student in ("ada", "bob", "cy", "di"):
        wrong = {"square": "def square(x):\n    return x"} if student == "bob" else {}
        made.submit(student, more=[SPIN], **wrong)
    return made


@pytest.fixture(scope="module")
def undisturbed(course, tmp_path_factory):
    """Return all that the class leaves undisturbed, and how long it took, of which the moments are shares."""
    graded = course.copy(tmp_path_factory.mktemp("undisturbed") / "course")
    began = time.monotonic()
    graded.grade()
    return whole(graded), time.monotonic() - began


@pytest.fixture(scope="module")
def hits():
    """Collect what was killed."""
    return []


def words(pid):
    """Return a process's command line."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").split("\0")
    return []


def below(pid):
    """Return the processes right below a process."""
    deeper = children(pid)
    return sorted(set(deeper) - {one for child in deeper for one in children(child)})


def find(role, grader):
    """Return a process of a role below the grader, or nothing while there is none."""
    pools = [pid for pid in below(grader) if "autograder.pool_process" in words(pid)]
    if role == "pool":
        return pools[0] if pools else None
    zygotes = [
        pid
        for pool in pools
        for pid in sorted(children(pool))
        if any("zygote.main" in word for word in words(pid)) and not words(pid)[0].endswith("bwrap")
    ]
    if not zygotes:
        return None
    if role == "zygote":
        return zygotes[0]
    wardens = below(zygotes[0])
    return wardens[0] if wardens else None


def leftovers(course, before):
    """Return what a run should not leave: markers, temporary files."""
    marked = [str(path) for path in course.root.rglob(MARKER)]
    journals = [str(path) for path in course.root.glob("gradebook.db-*")]
    return marked + journals + sorted({path.name for path in Path(tempfile.gettempdir()).iterdir()} - before)


def moments(role, seconds):
    """Return the moments at which a role is killed, of the length of an undisturbed run."""
    chance = random.Random(f"{SEED} {role}")  # noqa: S311
    count = KILLS[role]
    return [seconds * (number + chance.random()) / count for number in range(count)]


@pytest.mark.parametrize("number", range(KILLS["grader"]))
def test_next_run_ends_as_if_the_grader_had_not_been_killed(
    number, course, undisturbed, tmp_path, monkeypatch
):
    """The grader is killed at a random moment: all it started ends, and the next run gives the same gradebook."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    expected, seconds = undisturbed
    disturbed = course.copy(tmp_path / "course")
    spot = {path.name for path in tmp_path.iterdir()}
    moment = moments("grader", seconds)[number]
    with (tmp_path / "log").open("w") as log:
        grader = subprocess.Popen(
            [*disturbed.command("autograde", ASSIGNMENT), "--ParallelAutograde.jobs=1",
             f"--IsolatedExecute.packages={PACKAGES}"],
            cwd=disturbed.root, env=environment(TMPDIR=str(tmp_path)), stdout=log, stderr=log,
        )  # fmt: skip
    with contextlib.suppress(subprocess.TimeoutExpired):
        while not list(disturbed.root.rglob(MARKER)) and grader.poll() is None:
            time.sleep(0.02)  # importing nbgrader is not grading
        grader.wait(moment)
    started = children(grader.pid)
    grader.kill()
    grader.wait()
    end = time.monotonic() + 30
    while alive(started):
        assert time.monotonic() < end, "a process of a killed grader lives on"
        time.sleep(0.02)
    disturbed.grade()
    assert whole(disturbed) == expected
    assert leftovers(disturbed, spot | {"log"}) == []


@pytest.mark.parametrize(
    ("role", "number"),
    [(role, number) for role in ("pool", "zygote", "worker") for number in range(KILLS[role])],
)
def test_run_goes_on_without_a_killed_process(role, number, course, undisturbed, hits, tmp_path, monkeypatch):
    """A process below the grader is killed at a random moment: the run itself ends with the undisturbed gradebook."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    expected, seconds = undisturbed
    disturbed = course.copy(tmp_path / "course")
    spot = {path.name for path in tmp_path.iterdir()}
    ran = set(children(os.getpid()))
    over, killed = threading.Event(), []

    def kill():
        over.wait(moments(role, seconds)[number])
        while not over.is_set() and not killed:
            pid = find(role, os.getpid())
            if pid:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
                    killed.append(pid)
            over.wait(0.01)

    thread = threading.Thread(target=kill)
    thread.start()
    try:
        disturbed.grade()
    finally:
        over.set()
        thread.join()
    hits += [role for _ in killed]
    disturbed.grade()
    assert whole(disturbed) == expected
    assert leftovers(disturbed, spot) == []
    assert set(children(os.getpid())) <= ran


def test_processes_were_killed(hits):
    """Of the moments a third at least met a process, each role among them: a late one may come after the end."""
    assert len(hits) >= 5
    assert set(hits) == {"pool", "zygote", "worker"}
