"""Grading a class: everybody gets a row, nobody disturbs anybody, and a killed grader loses nothing."""

from __future__ import annotations

import errno
import json
import os
import shutil
import signal
import subprocess
from pathlib import Path

import nbformat
import pytest
from nbgrader.converters.base import NbGraderException
from processes import alive, children, wait_for
from temporary_course import ASSIGNMENT, GRADED, NOTEBOOK, SQUARE, Course, environment, printed

from autograder.interrupted import MARKER
from autograder.parallel import ParallelAutograde
from autograder.pool import Job, Pool, pack
from autograder.sandbox import PACKAGES
from autograder.worker.limits import Limits

TRACE = """
import os, pathlib, tempfile
spots = [pathlib.Path(place) for place in ("/tmp", "/dev/shm", os.path.expanduser("~"), ".")]
print("uid", os.getuid())
print("seen", [p.name for spot in spots for p in spot.rglob("trace-*")])
for spot in spots:
    (spot / "trace-{name}").write_text("{name} was here")
print("left", sum((spot / "trace-{name}").exists() for spot in spots))
"""
# Right, missing a person: what the two automatic scores are, square and cube.
EXPECTED = {
    "honest": (2, 3), "wrong": (0, 3), "blank": (0, 0), "exits": (0, 3), "not-json": (0, 0), "no-cells": (0, 0),
    "not-cells": (0, 0), "old-format": (2, 3), "no-file": (0, 0), "other-name": (0, 0), "no-tests": (2, 3),
    "twice": (2, 3),
    "renamed": (2, 3), "trace-one": (2, 3), "trace-two": (2, 3),
}  # fmt: skip


def hand_in(course):
    """Hand in a class: right, wrong, hostile, and malformed in every way that nbgrader would stumble over."""
    course.submit("honest")
    course.submit("wrong", square="def square(x):\n    return 2 * x")
    course.submit("blank", square="raise NotImplementedError", cube="raise NotImplementedError", why="")
    course.submit("exits", square="def square(x):\n    import os\n    os._exit(0)")
    for name in ("trace-one", "trace-two"):
        course.submit(name, more=[TRACE.format(name=name)])
    course.submit_file("not-json", '{"cells": [')
    course.submit_file("no-cells", '{"nbformat": 4, "nbformat_minor": 5, "metadata": {}, "cells": "none"}')
    course.submit_file(
        "not-cells", '{"cells": [1, null, [], {"cell_type": "code"}, {"cell_type": "x", "source": 1}]}'
    )
    course.folder("no-file").mkdir(parents=True)
    course.submit_file("other-name", "{}", name="power.ipynb")

    def change(student, how):
        course.submit(student)
        path = course.folder(student) / "powers.ipynb"
        notebook = json.loads(path.read_text(encoding="utf-8"))
        how(notebook)
        path.write_text(json.dumps(notebook), encoding="utf-8")

    def tests(notebook):
        return [
            c
            for c in notebook["cells"]
            if c["metadata"].get("nbgrader", {}).get("grade_id", "").endswith("-test")
        ]

    def rename(notebook):
        for node in tests(notebook):
            node["metadata"]["nbgrader"]["grade_id"] += "-of-mine"

    def forget(notebook):
        for node in tests(notebook):
            notebook["cells"].remove(node)

    def double(notebook):
        notebook["cells"] += [json.loads(json.dumps(node)) for node in tests(notebook)]

    def age(notebook):
        old = nbformat.convert(nbformat.reads(json.dumps(notebook), as_version=4), 3)
        old["worksheets"][0]["metadata"] = {}
        notebook.clear()
        notebook.update(json.loads(json.dumps(old)))

    change("renamed", rename)
    change("no-tests", forget)
    change("twice", double)
    change("old-format", age)


@pytest.fixture(scope="module")
def empty(tmp_path_factory):
    """Make a course in which nothing has been handed in."""
    return Course.create(tmp_path_factory.mktemp("parallel") / "course")


@pytest.fixture(scope="module")
def undisturbed(empty, tmp_path_factory):
    """Grade the whole class one notebook at a time."""
    course = empty.copy(tmp_path_factory.mktemp("undisturbed") / "course")
    hand_in(course)
    course.grade(jobs=1)
    return course


def test_every_grade_cell_of_everybody_has_a_row(undisturbed):
    """Whatever was handed in, right, hostile or malformed, each graded cell has its row and its expected score."""
    rows = undisturbed.rows()
    assert set(rows) == set(EXPECTED)
    found = {student: (row["square-test"][0], row["cube-test"][0]) for student, row in rows.items()}
    assert found == EXPECTED
    assert all(set(row) == set(GRADED) for row in rows.values())
    assert not [student for student in rows if (undisturbed.folder(student, "autograded") / MARKER).exists()]


def test_class_mates_are_not_visible(undisturbed):
    """Two students leave files wherever they can: neither sees the other's; graded by root, they are two users."""
    said = [printed(undisturbed.graded(f"trace-{name}")) for name in ("one", "two")]
    for text in said:
        assert "seen []" in text
        assert "left 4" in text
    users = [next(line for line in text.splitlines() if line.startswith("uid")) for text in said]
    assert (len(set(users)) == 2) == (os.geteuid() == 0)


def test_two_jobs_give_the_same_gradebook(undisturbed, tmp_path):
    """Graded two at a time, in whatever order they end, the class gets equal rows."""
    course = undisturbed.copy(tmp_path / "course")
    shutil.rmtree(course.root / "autograded")
    course.grade(jobs=2)
    assert course.rows() == undisturbed.rows()


def times(course):
    """Return when each student's graded notebook was written."""
    paths = course.root.glob(f"autograded/*/{ASSIGNMENT}/powers.ipynb")
    return {path.parts[-3]: path.stat().st_mtime_ns for path in paths}


def test_interrupted_submission_is_graded_again_and_finished_ones_are_not(undisturbed, tmp_path):
    """A submission with the marker of a broken-off run is done anew; those without are not touched."""
    course = undisturbed.copy(tmp_path / "course")
    before = times(course)
    (course.folder("honest", "autograded") / MARKER).touch()
    (course.folder("honest", "autograded") / "left-over").touch()
    course.grade()
    after = times(course)
    assert {student for student in after if after[student] != before[student]} == {"honest"}
    assert course.rows() == undisturbed.rows()
    assert not (course.folder("honest", "autograded") / MARKER).exists()
    assert not (course.folder("honest", "autograded") / "left-over").exists()


def test_killed_grader_loses_nothing(empty, tmp_path):
    """After kill -9 twice in a class the next run ends with the undisturbed gradebook and grades nothing twice."""
    course = empty.copy(tmp_path / "course")
    for number in range(6):
        wait = f"import time\ntime.sleep({0.0 if number < 2 else 0.5})"
        course.submit(
            f"student-{number}", more=[wait], square=SQUARE if number % 2 else "def square(x):\n    return x"
        )
    undisturbed = course.copy(tmp_path / "undisturbed")
    undisturbed.grade(jobs=2)

    def marked():
        return list(course.root.glob(f"autograded/*/{ASSIGNMENT}/{MARKER}"))

    def finished():
        done = {
            student
            for student in times(course)
            if not (course.folder(student, "autograded") / MARKER).exists()
        }
        return done if marked() else set()

    kept = {}
    for moment in (marked, finished):
        with (tmp_path / "log").open("w") as log:
            grader = subprocess.Popen(
                [*course.command("autograde", ASSIGNMENT), "--ParallelAutograde.jobs=1"],
                cwd=course.root, env=environment(), stdout=log, stderr=log,
            )  # fmt: skip
        try:
            wait_for(moment)
            below = children(grader.pid)
        finally:
            grader.kill()
            grader.wait()
        assert grader.returncode == -signal.SIGKILL
        wait_for(lambda pids=below: not alive(pids))
        kept = {student: when for student, when in times(course).items() if student in finished()}
    assert kept
    assert marked()
    course.grade()
    assert course.rows() == undisturbed.rows()
    assert set(times(course)) == set(times(undisturbed))
    assert {student: times(course)[student] for student in kept} == kept
    assert not marked()


@pytest.mark.parametrize("step", ["init_assignment", "_sanitize", "_store_notebook"])
def test_failing_submission_touches_nobody(empty, tmp_path, monkeypatch, step):
    """Where a step of one submission fails in the grader itself, the others are graded and it waits for a person."""
    course = empty.copy(tmp_path / "course")
    for student in ("ada", "bob", "cy"):
        course.submit(student)
    done = getattr(ParallelAutograde, step)

    def fail_for_bob(self, *arguments):
        if arguments[-1] == "bob" or "/bob/" in arguments[0]:
            raise RuntimeError("a fault of the grader")
        return done(self, *arguments)

    monkeypatch.setattr(ParallelAutograde, step, fail_for_bob)
    with pytest.raises(NbGraderException, match="could not be graded"):
        course.grade()
    rows = course.rows()
    good = {"square-test": (2, False), "cube-test": (3, False), "why": (None, True)}
    assert rows["ada"] == rows["cy"] == good
    assert rows["bob"] == dict.fromkeys(GRADED, (None, True))
    assert not course.folder("bob", "autograded").exists()
    monkeypatch.undo()
    course.grade()
    assert course.rows()["bob"] == good


def test_what_the_machine_does_not_let_read_waits_for_a_person(empty, tmp_path, monkeypatch, caplog):
    """A submitted file without the right to read it is no empty submission, and the log has one line of it."""
    course = empty.copy(tmp_path / "course")
    for student in ("ada", "bob"):
        course.submit(student)
    read = Path.read_text

    def deny_bob(self, *arguments, **options):
        if self == course.folder("bob") / f"{NOTEBOOK}.ipynb":  # the tests may run as root, who may read all
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(self))
        return read(self, *arguments, **options)

    monkeypatch.setattr(Path, "read_text", deny_bob)
    with pytest.raises(NbGraderException, match="could not be graded"):
        course.grade()
    assert course.rows()["bob"] == dict.fromkeys(GRADED, (None, True))
    assert course.rows()["ada"]["square-test"] == (2, False)
    (said,) = [record for record in caplog.records if "Permission denied" in record.getMessage()]
    assert not said.exc_info
    monkeypatch.undo()
    course.grade()
    assert course.rows()["bob"] == course.rows()["ada"]


# ---------------------------------------------------------------- the pool

SLOW = "import time\ntime.sleep(1.5)"


def job(course, *more):
    """Describe the execution of a solved notebook."""
    course.submit("pool", more=more)
    notebook = nbformat.read(course.folder("pool") / "powers.ipynb", as_version=4)
    source = nbformat.read(course.root / "source" / ASSIGNMENT / "powers.ipynb", as_version=4)
    sources = {c.metadata.nbgrader.grade_id: c.source for c in source.cells if "nbgrader" in c.metadata}
    for node in notebook.cells:
        if node.metadata.get("nbgrader", {}).get("locked"):
            node.source = sources[node.metadata.nbgrader.grade_id]
    return Job("pool", pack(notebook), {}, {}, tuple(Limits().to_list()), PACKAGES)


def errors(text):
    """Return the names of the errors in the test cells of an executed notebook."""
    notebook = nbformat.reads(text, as_version=4)
    tests = [
        c for c in notebook.cells if c.metadata.get("nbgrader", {}).get("grade_id", "").endswith("-test")
    ]
    assert len(tests) == 2
    return [[o.ename for o in c.outputs if o.output_type == "error"] for c in tests]


@pytest.mark.parametrize(("kills", "expected"), [(1, [[], []]), (2, [["GraderError"], ["GraderError"]])])
def test_killed_pool_process_is_replaced(empty, tmp_path, kills, expected):
    """A notebook whose process is killed is done once more; killed twice, it is flagged, and the pool works on."""
    course = empty.copy(tmp_path / "course")
    with Pool(1) as pool:
        future = pool.submit(job(course, SLOW))
        killed = set()
        for _ in range(kills):

            def running(killed=killed):
                process = pool._all[0].process if pool._all else None
                # Its sandbox is up and has forked for the notebook.
                below = children(process.pid) if process and process.pid not in killed else []
                return process if len(below) > 3 else None

            process = wait_for(running)
            killed.add(process.pid)
            below = children(process.pid)
            process.kill()
            wait_for(lambda pids=below: not alive(pids))
        assert errors(future.result(120)) == expected
        assert errors(pool.submit(job(course)).result(120)) == [[], []]
