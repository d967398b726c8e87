"""Grade the sample class with the stock nbgrader commands, in a course of its own, and hold every score.

The course stands in ``build/demo`` and is new each time: its configuration is the repository's with folders, a
gradebook and a secret of its own. `sample_class` hands in the samples; ``nbgrader generate_assignment``,
``autograde``, ``generate_feedback`` and ``export`` do the work; then everything that a class must come out of it with
is looked at: each score and recognised mistake against ``samples/<assignment>/<notebook>/expected.csv``, which are
written by hand, a gradebook row for each grade cell of each student, feedback that shows nothing hidden and runs
nothing of a student's, and processor seconds within the limit of the configuration.

Usage: ``python tools/course.py [--every-mistake] [--notebook NAME ...]``. Without ``--every-mistake`` only the first
notebook's samples make all known mistakes, those of the others every third one; ``make test`` grades them all. The
exit status is 0 if all is as expected.
"""

from __future__ import annotations

import argparse
import csv
import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import course_report
import nbformat
import sample_class
from listener import Listener
from nbgrader.api import Gradebook
from traitlets.config import PyFileConfigLoader

import notebooks
from autograder.secret import FILE

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from nbformat import NotebookNode

ROOT = Path(__file__).resolve().parents[1]
DEMO = ROOT / "build" / "demo"
ASSIGNMENT = "ekf-localization"
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
c.IsolatedExecute.cell_cpu = 4.0
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


Class = dict[str, dict[str, sample_class.Sample]]
"""What each student hands in, by notebook; see `sample_class.deal`."""


def read_results(course: Path, students: Class) -> dict[str, dict[str, Result]]:
    """Read what became of the class from its gradebook and its graded notebooks: results by notebook and sample.

    A student who handed in nothing of a notebook stands there with the own name.
    """
    found: dict[str, dict[str, Result]] = {}
    with Gradebook(f"sqlite:///{course}/gradebook.db") as gradebook:
        for notebook in gradebook.find_assignment(ASSIGNMENT).notebooks:
            names = [cell.name for cell in [*notebook.grade_cells, *notebook.task_cells]]
            rows = found[notebook.name] = {}
            for submission in notebook.submissions:
                student = submission.student.id
                sample = students.get(student, {}).get(notebook.name)
                grades = {grade.cell.name: _score(grade) for grade in submission.grades}
                path = course / "autograded" / student / ASSIGNMENT / f"{notebook.name}.ipynb"
                rows[sample.name if sample else student] = Result(
                    {name: grades.get(name, MISSING) for name in names}, course_report.diagnosis(path)
                )
    return found


def compare(students: Class, found: dict[str, dict[str, Result]]) -> list[str]:
    """Say where the class came out otherwise than the tables expect."""
    faults = []
    for notebook in sorted({notebook for handed_in in students.values() for notebook in handed_in}):
        results = found.get(notebook, {})
        expected = read_expected(ROOT / "samples" / ASSIGNMENT / notebook / "expected.csv")
        absent = {name for name, handed_in in students.items() if notebook not in handed_in}
        samples = {handed_in[notebook].name for handed_in in students.values() if notebook in handed_in}
        expected = {name: row for name, row in expected.items() if name in samples}
        for name in sorted(absent):
            scores = results[name].scores if name in results else {"any cell": MISSING}
            expected[name] = Result(dict.fromkeys(scores, "0"))
        faults += [f"{notebook}: {line}" for line in differences(expected, results)]
    return faults


def _score(grade: object) -> str:
    if grade.auto_score is None and not grade.needs_manual_grade:
        return MISSING
    return MANUAL if grade.needs_manual_grade else f"{grade.auto_score:g}"


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


def prepare(course: Path, only: Sequence[str] = ()) -> dict[str, NotebookNode]:
    """Make the course's folder anew, with its sources, and return the sources of its notebooks, all or some."""
    shutil.rmtree(course, ignore_errors=True)
    course.mkdir(parents=True)
    (course / "nbgrader_config.py").write_text(CONFIGURATION, encoding="utf-8")
    notebooks.build_sources(ROOT / "solutions", course / "source")
    paths = {path.stem: path for path in sorted((course / "source" / ASSIGNMENT).glob("*.ipynb"))}
    if unknown := set(only) - set(paths):
        raise SystemExit(f"--notebook: expected one of {', '.join(paths)}, got {', '.join(sorted(unknown))}")
    for name in set(paths) - set(only or paths):
        paths.pop(name).unlink()
    return {name: nbformat.read(path, as_version=4) for name, path in paths.items()}


def students_of(sources: dict[str, NotebookNode], *, every_mistake: bool = True) -> Class:
    """Return the class of the assignment: students, and what they hand in.

    Parameters
    ----------
    sources : dict of str to NotebookNode
        The notebooks.
    every_mistake : bool, optional
        Whether the samples of all notebooks make every known mistake, or those of the largest class alone.
    """
    folder = ROOT / "samples" / ASSIGNMENT
    classes = {
        name: sample_class.sample_class(folder / name, sample_class.stage_cells(source))
        for name, source in sources.items()
    }
    largest = max(classes, key=lambda name: len(classes[name]))
    if not every_mistake:
        for name in set(classes) - {largest}:
            mistakes = [sample for sample in classes[name] if sample.name.startswith("mistake-")]
            classes[name] = [s for s in classes[name] if s not in mistakes or s in mistakes[::3]]
    return sample_class.deal(classes)


def hand_in(course: Path, sources: dict[str, NotebookNode], students: Class, port: int) -> None:
    """Write what the students hand in."""
    places = {"repository": str(ROOT), "course": str(course), "port": str(port)}
    folder = ROOT / "notebooks" / ASSIGNMENT
    releases = {name: nbformat.read(folder / f"{name}.ipynb", as_version=4) for name in sources}
    answers = {name: sample_class.solutions(source) for name, source in sources.items()}
    for student, handed_in in students.items():
        target = course / "submitted" / student / ASSIGNMENT
        target.mkdir(parents=True)
        for name, sample in handed_in.items():
            data = sample_class.hand_in(sample, releases[name], answers[name], places)
            if data is not None:
                (target / f"{name}.ipynb").write_bytes(data)


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


def print_table(notebook: str, found: dict[str, Result]) -> None:
    """Print scores and recognised mistakes of a notebook, a line for each sample."""
    columns = list(next(iter(found.values())).scores) if found else []
    print(f"{notebook:46}{'sum':>5}  {'  '.join(columns)}  recognised mistakes")
    for sample, result in found.items():
        total = sum(float(score) for score in result.scores.values() if score not in {MANUAL, MISSING})
        cells = "  ".join(f"{result.scores[name]:>{len(name)}}" for name in columns)
        print(f"{sample:46}{total:5.1f}  {cells}  {result.diagnosis}")
    print()


def main(arguments: Sequence[str] | None = None) -> int:
    """Grade the class, look at what came out, and say so."""
    parser = argparse.ArgumentParser(description="Grade the sample class and hold every score.")
    parser.add_argument(
        "--every-mistake", action="store_true", help="in each notebook, not in the first alone"
    )
    parser.add_argument("--notebook", action="append", default=[], help="grade this notebook alone")
    options = parser.parse_args(arguments)
    clock = Clock()
    faults: list[str] = []
    print(f"Sample class in {DEMO}")
    with Listener() as listener:
        with clock("source built"):
            sources = prepare(DEMO, options.notebook)
        with (
            clock("nbgrader generate_assignment, sample class handed in"),
            running(DEMO, ["generate_assignment", ASSIGNMENT]),
        ):
            students = students_of(sources, every_mistake=options.every_mistake)
            hand_in(DEMO, sources, students, listener.port)
        if not listener.hears():
            faults.append("the listener does not hear connections, so that none proves nothing")
        count = sum(map(len, students.values()))
        with (
            clock(f"nbgrader autograde: {count} notebooks of {len(students)} students"),
            running(DEMO, ["autograde", ASSIGNMENT], bar=True),
        ):
            pass
        if listener.visits:
            faults.append(f"connects-out: the listener had {listener.visits} connections")
    feedback = [["generate_feedback", ASSIGNMENT, f"--student={part}"] for part in halves(list(students))]
    with clock("nbgrader generate_feedback, export"), running(DEMO, *feedback, ["export"]):
        found = read_results(DEMO, students)
    with clock("everything looked at"):
        faults += compare(students, found)
        seconds, limit = {}, processor_limit()
        numbers = course_report.hidden_numbers((DEMO / FILE).read_text(encoding="utf-8").strip())
        with ProcessPoolExecutor() as pool:
            looked_at = {
                name: pool.submit(
                    course_report.leaks, DEMO, ASSIGNMENT, name, list(students), source, numbers
                )
                for name, source in sources.items()
            }
        for name, leaks in looked_at.items():
            faults += leaks.result()
            took = course_report.seconds(DEMO, ASSIGNMENT, name, list(students))
            faults += course_report.overruns(took, list(students), limit)
            seconds |= {(student, name): value for student, value in took.items()}
        faults += course_report.exported(DEMO / "grades.csv", list(students))
    print(f"{clock.total:6.1f} s  together\n")
    for name, results in found.items():
        handed_in = {has[name].name for has in students.values() if name in has}
        print_table(name, {sample: result for sample, result in results.items() if sample in handed_in})
    if seconds:
        longest = max(seconds, key=seconds.__getitem__)
        print(
            f"Longest: {', '.join(longest)}, {seconds[longest]:.1f} processor seconds; the limit is {limit:g}."
        )
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
