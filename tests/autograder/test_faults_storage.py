"""Faults of the storage: a locked gradebook, a full disk, files that change meanwhile, a clock that jumps."""

from __future__ import annotations

import ast
import os
import shutil
import sqlite3
import subprocess
import tempfile
import threading
import time
from pathlib import Path

import pytest
from gradebooks import whole
from nbgrader.converters.base import NbGraderException
from temporary_course import ASSIGNMENT, Course, environment

import autograder
from autograder import database, interrupted, parallel, pool, system_calls
from autograder.interrupted import MARKER, begin, is_interrupted, remove, state_of

PACKAGES = ["ipython", "matplotlib-inline", "msgpack", "numpy"]  # few: the sandbox is ready sooner
OLD, NEW = "2026-01-01 10:00:00 UTC", "2026-01-02 10:00:00 UTC"
WRONG = "def square(x):\n    return x"


def hand_in(course, student, when, **answers):
    """Hand in a notebook with the time at which it was."""
    course.submit(student, **answers)
    (course.folder(student) / "timestamp.txt").write_text(when, encoding="utf-8")


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """Make a class of two in which nothing has been graded; its gradebook is in a folder of its own."""
    root = tmp_path_factory.mktemp("faults") / "course"
    (root / "db").mkdir(parents=True)
    made = Course.create(
        root, server=f"sqlite:///{root}/db/gradebook.db", course_id="faults", packages=PACKAGES
    )
    hand_in(made, "ada", OLD)
    hand_in(made, "bob", OLD, square=WRONG)
    return made


def again(course, root):
    """Return a course of its own that has what this one has."""
    shutil.copytree(course.root, root)
    made = Course(root, course.limits, f"sqlite:///{root}/db/gradebook.db", course.course_id)
    config = root / "nbgrader_config.py"
    config.write_text(config.read_text().replace(str(course.root), str(root)))
    return made


@pytest.fixture(scope="module")
def undisturbed(course, tmp_path_factory):
    """Grade the class without a fault."""
    graded = again(course, tmp_path_factory.mktemp("undisturbed") / "course")
    graded.grade()
    assert graded.rows()["ada"]["square-test"][0] == 2
    assert graded.rows()["bob"]["square-test"][0] == 0
    return graded


# ---------------------------------------------------------------- the gradebook is locked


def lock(course):
    """Lock a gradebook as another program does."""
    other = sqlite3.connect(course.root / "db" / "gradebook.db", check_same_thread=False)
    other.execute("BEGIN EXCLUSIVE")
    return other


def test_locked_gradebook_is_waited_for(course, undisturbed, tmp_path):
    """A gradebook that another program locks for a while delays the run, and changes nothing else."""
    disturbed = again(course, tmp_path / "course")
    other = lock(disturbed)
    timer = threading.Timer(1.0, other.rollback)
    timer.start()
    disturbed.grade()
    timer.join()
    other.close()
    assert whole(disturbed) == whole(undisturbed)


def test_gradebook_locked_for_ever_ends_the_run(undisturbed, tmp_path, monkeypatch):
    """A lock that is not given back ends the run with an error that names the gradebook; nothing is lost."""
    disturbed = again(undisturbed, tmp_path / "course")
    hand_in(disturbed, "bob", NEW, square=WRONG)
    before = disturbed.rows()
    monkeypatch.setattr(database, "PATIENCE", 0.1)
    other = lock(disturbed)
    with pytest.raises(NbGraderException, match=r"gradebook sqlite:.*gradebook\.db.*locked"):
        disturbed.grade()
    other.close()
    assert disturbed.rows() == before
    assert not disturbed.folder("bob", "autograded").exists()
    disturbed.grade()
    rows, files = whole(disturbed)
    expected, as_before = whole(undisturbed)
    when = f"autograded/bob/{ASSIGNMENT}/timestamp.txt"
    assert files == as_before | {when: NEW.encode()}
    assert {name: row[1:] for name, row in rows.items()} == {name: row[1:] for name, row in expected.items()}


# ---------------------------------------------------------------- the disk is full


@pytest.mark.parametrize(("place", "named"), [("autograded", "autograded/"), ("db", "the gradebook sqlite:")])
def test_full_disk_ends_the_run(place, named, course, undisturbed, tmp_path):
    """Without room for the graded notebooks or the gradebook the run says which; with room the next one is right."""
    disturbed = again(course, tmp_path / "course")
    folder, kept = disturbed.root / place, tmp_path / "kept"
    folder.mkdir(exist_ok=True)
    # What the full disk held is brought out of the mount namespace, which ends with the run.
    script = f"""
        cp -a {folder} {kept}.before && mount -t tmpfs -o size=256k none {folder} &&
        cp -a {kept}.before/. {folder} || exit 99
        head -c 1000000 /dev/zero > {folder}/filler 2>/dev/null
        "$@"; code=$?; rm {folder}/filler; cp -a {folder} {kept}; exit $code
    """
    share = ["unshare", "-m"] if os.geteuid() == 0 else ["unshare", "-rm"]
    done = subprocess.run(
        [*share, "sh", "-c", script, "sh", *disturbed.command("autograde", ASSIGNMENT)],
        cwd=disturbed.root, env=environment(), capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode not in {0, 99}, done.stderr
    assert named in done.stderr, done.stderr[-3000:]
    assert "full" in done.stderr or "No space left" in done.stderr
    shutil.rmtree(folder)
    shutil.copytree(kept, folder)
    disturbed.grade()
    assert whole(disturbed) == whole(undisturbed)


def test_filter_needs_no_temporary_folder(monkeypatch):
    """The filter of system calls is made where no temporary file can be."""
    expected = system_calls.program()
    monkeypatch.setattr(tempfile, "tempdir", "/dev/full")
    assert system_calls.program.__wrapped__() == expected


def test_half_removed_folder_is_not_taken_for_a_graded_one(tmp_path, monkeypatch):
    """Whenever a kill comes while a folder is made or removed, the next run sees that it is not finished."""
    folder = tmp_path / "autograded"
    moments = 0

    def killed(steps):
        """Do that many steps, then break off as a kill does."""
        for name in ("unlink", "rmdir", "mkdir"):
            real = getattr(os, name)

            def step(*args, real=real, **options):
                nonlocal steps
                if not steps:
                    raise KeyboardInterrupt
                steps -= 1
                return real(*args, **options)

            monkeypatch.setattr(os, name, step)

    for steps in range(7):
        begin(folder)
        for name in ("powers.ipynb", "timestamp.txt", "data.csv"):
            (folder / name).touch()
        (folder / MARKER).unlink()
        assert not is_interrupted(folder)
        with monkeypatch.context():
            killed(steps)
            try:
                remove(folder)
            except KeyboardInterrupt:
                moments += 1
            monkeypatch.undo()
        assert is_interrupted(folder) or not folder.exists() or len(list(folder.iterdir())) == 3
        remove(folder)
        assert not folder.exists()
    assert moments == 6


# ---------------------------------------------------------------- a submission is replaced


def test_submission_replaced_while_it_is_read_is_read_again(course, tmp_path, monkeypatch):
    """What is written while a submission is read is graded whole, and is not half of a file or the old time."""
    disturbed = again(course, tmp_path / "course")
    read, pending = parallel.read_submission, ["half", "all"]

    def replace(path):
        found = read(path)
        if path.parts[-3] == "bob" and pending:
            hand_in(disturbed, "bob", NEW)
            if pending.pop(0) == "half":
                text = path.read_text(encoding="utf-8")
                path.write_text(text[: len(text) // 2], encoding="utf-8")
        return found

    monkeypatch.setattr(parallel, "read_submission", replace)
    disturbed.grade()
    rows, files = whole(disturbed)
    when, grades, _ = rows["bob", "powers"]
    assert (when, grades["square-test"][0]) == ("2026-01-02 10:00:00", 2)
    assert files[f"autograded/bob/{ASSIGNMENT}/timestamp.txt"] == NEW.encode()
    assert "return x * x" in str(files[f"autograded/bob/{ASSIGNMENT}/powers.ipynb"])
    assert not disturbed.folder("bob", "autograded").joinpath(MARKER).exists()


def test_submission_replaced_while_it_runs_is_graded_by_the_next_run(course, tmp_path, monkeypatch):
    """The old one is graded and recorded whole, and the next run grades the new one though its time is the same."""
    disturbed = again(course, tmp_path / "course")
    store = parallel.ParallelAutograde._store

    def replace(self, submission):
        if submission.student == "bob":
            hand_in(disturbed, "bob", OLD)
        return store(self, submission)

    monkeypatch.setattr(parallel.ParallelAutograde, "_store", replace)
    disturbed.grade()
    assert disturbed.rows()["bob"]["square-test"][0] == 0
    assert "return x * x" not in str(disturbed.graded("bob"))
    monkeypatch.undo()
    disturbed.grade()
    assert disturbed.rows()["bob"]["square-test"][0] == 2
    assert "return x * x" in str(disturbed.graded("bob"))


# ---------------------------------------------------------------- nothing new, and clocks


def test_run_with_nothing_new_starts_and_writes_nothing(undisturbed, tmp_path, monkeypatch):
    """Where all is graded no process is started and no file of the course is written, the gradebook's among them."""
    course = again(undisturbed, tmp_path / "course")
    before = state_of(course.root)
    started = []
    monkeypatch.setattr(pool._Process, "_start", started.append)
    course.grade()
    assert not started
    assert state_of(course.root) == before


JUMPING = """
import time
_real, _calls = time.time, [0]
def jumping():
    _calls[0] += 1
    return _real() + (-1) ** _calls[0] * 86400.0 * _calls[0]
time.time = jumping
"""


def test_clock_that_jumps_changes_nothing(course, undisturbed, tmp_path, monkeypatch):
    """With a clock that jumps by days at every look, here and in the pool, the class is the same."""
    disturbed = again(course, tmp_path / "course")
    (tmp_path / "shim").mkdir()
    (tmp_path / "shim" / "sitecustomize.py").write_text(
        JUMPING + f"open({str(tmp_path / 'shim' / 'used')!r}, 'w')\n"
    )
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path / 'shim'}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    shim = {}
    monkeypatch.setattr(time, "time", time.time)  # put back what the shim replaces
    exec(JUMPING, shim)  # noqa: S102
    disturbed.grade()
    assert (tmp_path / "shim" / "used").exists()
    assert whole(disturbed) == whole(undisturbed)
    before = state_of(disturbed.root)
    disturbed.grade()
    assert state_of(disturbed.root) == before


def test_nothing_rests_on_the_time_of_day():
    """Only the date of a release asks what time it is; limits, waiting and what is new do not."""
    found = set()
    for path in Path(autograder.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Attribute) and f"{ast.unparse(node)}" in {
                "time.time", "time.time_ns", "datetime.now", "datetime.utcnow", "datetime.today", "date.today",
            }:  # fmt: skip
                found.add(path.name)
    assert found == {"versions.py"}
    assert interrupted.state_of(Path(autograder.__file__).parent)
