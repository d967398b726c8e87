"""The gradebook on a real PostgreSQL server: what is in it is what SQLite would hold."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import psycopg
import pytest
import sqlalchemy as sa
from nbgrader.api import Gradebook
from nbgrader.apps import NbGraderAPI
from nbgrader.converters.base import NbGraderException
from temporary_course import ASSIGNMENT, GRADED, Course, environment
from traitlets.config import Config

from autograder.exporter import Feedback
from autograder.lms import CanvasExporter, MoodleExporter
from autograder.parallel import ParallelAutograde
from autograder.plugin import configure

START = 30.0  # seconds in which a server must answer


def command(name):
    """Return the path of one of the server's commands, which Debian keeps off the path."""
    places = [os.environ["PATH"], *map(str, sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True))]
    found = shutil.which(name, path=os.pathsep.join(places))
    assert found, "PostgreSQL is not installed: tools/setup.sh system"
    return found


@dataclass(frozen=True)
class Server:
    """A running server that is reached through a socket in a folder."""

    folder: Path

    def create(self, database):
        """Make a database and return its address."""
        with psycopg.connect(self.dsn("postgres"), autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {database}")
        return f"postgresql+psycopg://postgres@/{database}?host={self.folder}"

    def dsn(self, database):
        """Return what libpq connects by."""
        return f"host={self.folder} user=postgres dbname={database}"


@pytest.fixture(scope="module")
def server():
    """Start a server of our own on a socket that nobody else can open, and stop it."""
    # A socket's path is short, so not pytest's folder; the server refuses to run as root.
    folder = Path(tempfile.mkdtemp(prefix="pg-"))
    other = {}
    if os.geteuid() == 0:
        shutil.chown(folder, "postgres", "postgres")
        other = {"user": "postgres", "group": "postgres", "extra_groups": []}
    options = {"cwd": folder, "stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, **other}
    data = folder / "data"
    running = None
    try:
        subprocess.run(
            [command("initdb"), "-D", data, "-U", "postgres", "-A", "trust", "--no-sync", "-E", "UTF8"],
            check=True, timeout=60, **options,
        )  # fmt: skip
        with (folder / "log").open("w") as log:
            running = subprocess.Popen(
                [command("postgres"), "-D", data, "-k", folder, "-c", "listen_addresses=", "-c", "fsync=off"],
                stderr=log, **options,
            )  # fmt: skip
        started = Server(folder)
        end = time.monotonic() + START
        while True:
            try:
                psycopg.connect(started.dsn("postgres")).close()
                break
            except psycopg.OperationalError:
                assert running.poll() is None, (folder / "log").read_text()
                assert time.monotonic() < end, (folder / "log").read_text()
                time.sleep(0.05)
        yield started
    finally:
        if running is not None and running.poll() is None:
            running.send_signal(signal.SIGINT)  # connections are cut
            try:
                running.wait(20)
            except subprocess.TimeoutExpired:
                running.kill()
                running.wait()
        shutil.rmtree(folder)


def hand_in(course):
    """Hand in a class."""
    course.submit("honest")
    course.submit("wrong", square="def square(x):\n    return 2 * x")
    course.submit("exits", square="def square(x):\n    import os\n    os._exit(0)")
    course.submit("blank", square="raise NotImplementedError", cube="raise NotImplementedError", why="")
    course.submit_file("not-json", '{"cells": [')
    course.folder("no-file").mkdir(parents=True)
    (course.folder("honest") / "timestamp.txt").write_text("2026-12-05 00:30:00 UTC", encoding="utf-8")


def contents(url):
    """Return all rows of all tables, sorted, with what a row refers to in the place of ids that were drawn."""
    engine = sa.create_engine(url)
    found = sa.MetaData()
    found.reflect(engine)
    with engine.connect() as connection:
        tables = {
            name: [dict(row._mapping) for row in connection.execute(table.select())]
            for name, table in found.tables.items()
        }
    engine.dispose()
    drawn = {
        row["id"]: {"in": name, **row, "id": ""}
        for name, table in found.tables.items()
        if "id" in table.c and not table.c["id"].foreign_keys
        for row in tables[name]
        if len(row["id"]) == 32
    }

    def said(row):
        return str(sorted((k, said(drawn[v]) if v in drawn else v) for k, v in row.items()))

    return {name: sorted(map(said, rows)) for name, rows in tables.items()}


@pytest.fixture(scope="module")
def graded(server, tmp_path_factory):
    """Grade one class with its gradebook in a file, and, by the stock command, with it on the server."""
    # A server holds nbgrader to its own tables: an assignment belongs to a course, which has to have a name.
    in_file, on_server = (
        Course.create(tmp_path_factory.mktemp(kind) / "course", course_id="robots", **where)
        for kind, where in (("sqlite", {}), ("postgres", {"server": server.create("course")}))
    )
    for course in (in_file, on_server):
        hand_in(course)
    in_file.grade()
    on_server.nbgrader("autograde", ASSIGNMENT)
    return in_file, on_server


def test_both_gradebooks_hold_the_same(graded):
    """Every row of every table is the same on the server as in the file: scores, flags, comments, versions."""
    in_file, on_server = (contents(course.db_url) for course in graded)
    assert on_server == in_file
    counts = {"student": 6, "submitted_assignment": 6, "grade": 18, "comment": 18, "released_version": 1}
    assert {name: len(in_file[name]) for name in counts} == counts
    scores = {student: row["square-test"][0] for student, row in graded[1].rows().items()}
    assert scores == {"honest": 2, "wrong": 0, "exits": 0, "blank": 0, "not-json": 0, "no-file": 0}


def test_next_runs_on_the_server(graded, monkeypatch):
    """The next run grades who is new and nobody else; where the grader itself fails, a person is asked, then not."""
    _, course = graded
    before = course.rows()
    when = {path: path.stat().st_mtime_ns for path in course.root.glob("autograded/*/*/*.ipynb")}
    course.submit("late")
    course.submit("unlucky")
    sanitize = ParallelAutograde._sanitize

    def fail(self, filename):
        if "/unlucky/" in filename:
            raise RuntimeError("a fault of the grader")
        return sanitize(self, filename)

    with monkeypatch.context() as patch:
        patch.setattr(ParallelAutograde, "_sanitize", fail)
        with pytest.raises(NbGraderException, match="could not be graded"):
            course.grade()
    new = {"late": before["honest"], "unlucky": dict.fromkeys(GRADED, (None, True))}
    assert course.rows() == before | new
    course.grade()
    assert course.rows() == before | dict.fromkeys(new, before["honest"])
    assert {path: path.stat().st_mtime_ns for path in when} == when


def test_feedback_and_exports_read_the_server(graded, monkeypatch):
    """Feedback is written by several processes, and the exports for other systems say what the gradebook says."""
    _, course = graded
    config = Config(
        {"Feedback": {"jobs": 2}, "CourseDirectory": {**course.settings(), "assignment_id": ASSIGNMENT}}
    )
    configure(config)
    monkeypatch.chdir(course.root)
    api = NbGraderAPI(config=config)
    Feedback(coursedir=api.coursedir, parent=api).start()
    assert len(list(course.root.glob("feedback/*/*/*.html"))) == len(course.rows())
    with Gradebook(course.db_url, course.course_id) as gradebook:
        for exporter in (CanvasExporter, MoodleExporter):
            path = course.root / "export.csv"
            exporter(to=str(path), unmarked=True).export(gradebook)
            assert len(path.read_text(encoding="utf-8").splitlines()) > len(course.rows())


def test_two_graders_share_a_gradebook(server, graded, tmp_path):
    """Two graders at a time, each with its part of the class, leave what one leaves that grades all."""
    course = Course.create(tmp_path / "course", course_id="robots", server=server.create("shared"))
    hand_in(course)
    # Names sort so that both begin with a student that the gradebook has not seen.
    parts = [
        ("--student=[a-g]*", "--ParallelAutograde.jobs=1"),
        ("--student=[h-z]*", "--ParallelAutograde.jobs=1"),
    ]
    graders = [
        subprocess.Popen(
            course.command("autograde", ASSIGNMENT, *options), cwd=course.root, env=environment(),
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        )
        for options in parts
    ]  # fmt: skip
    said = [grader.communicate(timeout=120)[1] for grader in graders]
    assert [grader.returncode for grader in graders] == [0, 0], "\n".join(said)
    assert course.rows() == {student: graded[0].rows()[student] for student in course.rows()}
    assert len(course.rows()) == 6
