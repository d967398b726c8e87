"""Grade the sample class with the stock nbgrader commands, in a course of its own, and hold every score.

The course stands in ``build/demo`` and is new each time: its configuration is the repository's with folders, a
gradebook and a secret of its own. `sample_class` hands in the samples; ``nbgrader generate_assignment``,
``autograde``, ``generate_feedback`` and ``export`` do the work; then everything that a class must come out of it with
is looked at: each score and recognised mistake against ``samples/<assignment>/expected.csv``, which is written by
hand, a gradebook row for each grade cell of each student, feedback that shows nothing hidden and runs nothing of a
student's, and processor seconds within the limit of the configuration.

Usage: ``python tools/course.py``. The exit status is 0 if all is as expected.
"""

from __future__ import annotations

import csv
import os
import shutil
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import course_report
import nbformat
import sample_class
from nbgrader.api import Gradebook
from traitlets.config import PyFileConfigLoader

import notebooks

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from nbformat import NotebookNode

ROOT = Path(__file__).resolve().parents[1]
DEMO = ROOT / "build" / "demo"
ASSIGNMENT, NOTEBOOK = "ekf-localization", "motion-model"
MANUAL, MISSING = "manual", "no row"
DIAGNOSIS = "diagnosis"
CONFIGURATION = '''\
"""The sample class: the course's own configuration, with folders and a gradebook of its own."""

load_subconfig("../../nbgrader_config.py", path=str(__import__("pathlib").Path(__file__).parent))
c = get_config()
c.CourseDirectory.source_directory = "source"
c.CourseDirectory.release_directory = "release"
c.CourseDirectory.db_url = "sqlite:///gradebook.db"
c.Application.log_level = "WARN"
# Samples that never end run to their limits: here those need not be as generous as for a class.
c.IsolatedExecute.call_cpu = 1.0
c.IsolatedExecute.cell_cpu = 5.0
'''


@dataclass(frozen=True)
class Result:
    """What became of one student: a score, `MANUAL` or `MISSING` by grade cell, and the recognised mistakes."""

    scores: dict[str, str] = field(default_factory=dict)
    diagnosis: str = ""


def read_expected(path: Path) -> dict[str, Result]:
    """Read the table of what must come out: a line for each student, a column for each grade cell."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {row.pop("student"): Result(row, row.pop(DIAGNOSIS)) for row in rows}


def differences(expected: dict[str, Result], found: dict[str, Result]) -> list[str]:
    """Say where a class came out otherwise than expected.

    Parameters
    ----------
    expected, found : dict of str to Result
        By student.

    Returns
    -------
    list of str
        A line for each difference; empty if there is none.
    """
    lines = [
        f"{name}: expected in the gradebook, got no such student" for name in sorted(expected.keys() - found)
    ]
    lines += [f"{name}: in the gradebook, but not in the table" for name in sorted(found.keys() - expected)]
    for name in sorted(expected.keys() & found):
        want, got = expected[name], found[name]
        for cell in sorted(want.scores | got.scores):
            pair = want.scores.get(cell, MISSING), got.scores.get(cell, MISSING)
            if not _equal(*pair):
                lines.append(f"{name}, {cell}: expected {pair[0]}, got {pair[1]}")
        if want.diagnosis != got.diagnosis:
            lines.append(f"{name}: expected the diagnosis {want.diagnosis!r}, got {got.diagnosis!r}")
    return lines


def _equal(want: str, got: str) -> bool:
    if {want, got} & {MANUAL, MISSING}:
        return want == got
    return abs(float(want) - float(got)) < 1e-9


def read_results(course: Path) -> dict[str, Result]:
    """Read what became of the class from its gradebook and its graded notebooks."""
    scores: dict[str, dict[str, str]] = {}
    with Gradebook(f"sqlite:///{course}/gradebook.db") as gradebook:
        notebook = gradebook.find_notebook(NOTEBOOK, ASSIGNMENT)
        names = [cell.name for cell in [*notebook.grade_cells, *notebook.task_cells]]
        for submission in gradebook.assignment_submissions(ASSIGNMENT):
            grades = {grade.cell.name: grade for one in submission.notebooks for grade in one.grades}
            scores[submission.student.id] = {name: _score(grades.get(name)) for name in names}
    return {
        student: Result(
            row, course_report.diagnosis(course / "autograded" / student / ASSIGNMENT / f"{NOTEBOOK}.ipynb")
        )
        for student, row in scores.items()
    }


def _score(grade: object) -> str:
    if grade is None or (grade.auto_score is None and not grade.needs_manual_grade):
        return MISSING
    return MANUAL if grade.needs_manual_grade else f"{grade.auto_score:g}"


class Listener:
    """Something that listens on a port of this machine and counts who comes; a context manager."""

    def __init__(self) -> None:
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.port = self.socket.getsockname()[1]
        self.visits = 0
        self._thread = threading.Thread(target=self._count, daemon=True)

    def _count(self) -> None:
        while True:
            try:
                connection, _ = self.socket.accept()
            except OSError:
                return
            connection.close()
            self.visits += 1

    def __enter__(self) -> Listener:  # noqa: PYI034
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.shutdown(socket.SHUT_RDWR)
        self.socket.close()
        self._thread.join(5)

    def hears(self) -> bool:
        """Return whether a connection from here is counted, and count it no more."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=5) as connection:
            connection.recv(1)  # ends when the other side has closed
        time.sleep(0.05)
        heard, self.visits = self.visits == 1, 0
        return heard


class Clock:
    """Say what is done, and how long it took."""

    def __init__(self) -> None:
        self.began = time.monotonic()

    @contextmanager
    def __call__(self, what: str) -> Iterator[None]:
        """Time one step."""
        began = time.monotonic()
        yield
        print(f"{time.monotonic() - began:6.1f} s  {what}", flush=True)

    @property
    def total(self) -> float:
        """Seconds since the beginning."""
        return time.monotonic() - self.began


def prepare(course: Path) -> NotebookNode:
    """Make the course's folder anew, with its sources, and return the source of the notebook."""
    shutil.rmtree(course, ignore_errors=True)
    course.mkdir(parents=True)
    (course / "nbgrader_config.py").write_text(CONFIGURATION, encoding="utf-8")
    notebooks.build_sources(ROOT / "solutions", course / "source")
    return nbformat.read(course / "source" / ASSIGNMENT / f"{NOTEBOOK}.ipynb", as_version=4)


def hand_in(course: Path, source: NotebookNode, port: int) -> list[str]:
    """Write what the students hand in, and return their names."""
    release = nbformat.read(ROOT / "notebooks" / ASSIGNMENT / f"{NOTEBOOK}.ipynb", as_version=4)
    answers = sample_class.solutions(source)
    places = {"repository": str(ROOT), "course": str(course), "port": str(port)}
    samples = sample_class.sample_class(ROOT / "samples" / ASSIGNMENT / NOTEBOOK)
    for sample in samples:
        folder = course / "submitted" / sample.name / ASSIGNMENT
        folder.mkdir(parents=True)
        data = sample_class.hand_in(sample, release, answers, places)
        if data is not None:
            (folder / f"{NOTEBOOK}.ipynb").write_bytes(data)
    return [sample.name for sample in samples]


def processor_limit() -> float:
    """Return the processor seconds that the repository's configuration grants a notebook."""
    return PyFileConfigLoader("nbgrader_config.py", str(ROOT)).load_config().IsolatedExecute.notebook_cpu


@contextmanager
def running(course: Path, *commands: Sequence[str], bar: bool = False) -> Iterator[None]:
    """Run nbgrader commands at the same time as each other and the body, and wait for them at its end.

    What they say goes to files, a progress bar to the terminal.

    Raises
    ------
    RuntimeError
        If one of them fails.
    """
    environment = os.environ | {"PYTHONWARNINGS": "ignore"}
    environment.pop("ROBOLOC_SECRET", None)  # this course has a secret of its own
    environment["PATH"] = os.pathsep.join(
        [str(Path(sys.executable).parent), environment.get("PATH", os.defpath)]
    )
    shown = bar and sys.stderr.isatty()
    started = []
    for number, command in enumerate(commands):
        log = course / f"{command[0]}-{number}.log"
        with log.open("w") as file:
            process = subprocess.Popen(
                [sys.executable, "-m", "nbgrader", *command],
                cwd=course, env=environment, stdout=file, stderr=None if shown else file,
            )  # fmt: skip
        started.append((process, command, log))
    try:
        yield
    finally:
        for process, _, _ in started:
            process.wait()
    for process, command, log in started:
        if process.returncode != 0:
            raise RuntimeError(f"nbgrader {' '.join(command)} failed:\n{log.read_text()[-4000:]}")


def halves(names: Sequence[str]) -> list[str]:
    """Return two patterns of student ids, each for about half of the class."""
    initials = sorted({name[0] for name in names}, key=lambda one: -sum(name[0] == one for name in names))
    first: list[str] = []
    while sum(name[0] in first for name in names) < len(names) / 2 and initials:
        first.append(initials.pop(0))
    return [f"[{''.join(group)}]*" for group in (first, initials) if group]


def print_table(found: dict[str, Result]) -> None:
    """Print scores and recognised mistakes, a line for each student."""
    columns = list(next(iter(found.values())).scores) if found else []
    print(f"{'student':46}{'sum':>5}  {'  '.join(columns)}  recognised mistakes")
    for student, result in found.items():
        total = sum(float(score) for score in result.scores.values() if score not in {MANUAL, MISSING})
        cells = "  ".join(f"{result.scores[name]:>{len(name)}}" for name in columns)
        print(f"{student:46}{total:5.1f}  {cells}  {result.diagnosis}")


def main() -> int:
    """Grade the class, look at what came out, and say so."""
    clock = Clock()
    faults: list[str] = []
    print(f"Sample class in {DEMO}")
    with Listener() as listener:
        with clock("source built"):
            source = prepare(DEMO)
        with (
            clock("nbgrader generate_assignment, sample class handed in"),
            running(DEMO, ["generate_assignment", ASSIGNMENT]),
        ):
            students = hand_in(DEMO, source, listener.port)
        if not listener.hears():
            faults.append("the listener does not hear connections, so that none proves nothing")
        with (
            clock(f"nbgrader autograde: {len(students)} submissions"),
            running(DEMO, ["autograde", ASSIGNMENT], bar=True),
        ):
            pass
        if listener.visits:
            faults.append(f"connects-out: the listener had {listener.visits} connections")
    feedback = [["generate_feedback", ASSIGNMENT, f"--student={part}"] for part in halves(students)]
    with clock("nbgrader generate_feedback, export"), running(DEMO, *feedback, ["export"]):
        found = read_results(DEMO)
    with clock("everything looked at"):
        faults += differences(read_expected(ROOT / "samples" / ASSIGNMENT / "expected.csv"), found)
        faults += course_report.leaks(DEMO, ASSIGNMENT, NOTEBOOK, students, source)
        faults += course_report.exported(DEMO / "grades.csv", students)
        seconds, limit = course_report.seconds(DEMO, ASSIGNMENT, NOTEBOOK, students), processor_limit()
        faults += course_report.overruns(seconds, students, limit)
    print(f"{clock.total:6.1f} s  together\n")
    print_table(found)
    if seconds:
        longest = max(seconds, key=seconds.__getitem__)
        print(f"\nLongest: {longest}, {seconds[longest]:.1f} processor seconds; the limit is {limit:g}.")
    print()
    for what, path in (
        ("book", ROOT / "_build" / "html" / "index.html"),
        ("notebooks", ROOT / "notebooks" / ASSIGNMENT),
        ("feedback", DEMO / "feedback"),
        ("grades", DEMO / "grades.csv"),
    ):
        print(f"{what:10} {path}{'' if path.exists() else '  (not there)'}")
    if faults:
        print(f"\n{len(faults)} things are not as expected:", file=sys.stderr)
        print("\n".join(f"  {fault}" for fault in faults), file=sys.stderr)
        return 1
    print(f"\nAll {len(students)} students got what they must get.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
