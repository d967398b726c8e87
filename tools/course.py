"""Grade the sample class with the stock nbgrader commands, in a course of its own, and hold every score.

The course stands in ``build/demo`` and is new each time, unless nothing has changed since it was graded as expected,
when it is only looked at again: its configuration is the repository's with folders, a
gradebook and a secret of its own. `sample_class` hands in the samples; ``nbgrader generate_assignment``,
``autograde``, ``generate_feedback`` and ``export`` do the work; then everything that a class must come out of it with
is looked at: each score and recognised mistake against ``samples/<assignment>/<notebook>/expected.csv``, which are
written by hand, a gradebook row for each grade cell of each student, feedback that shows nothing hidden and runs
nothing of a student's, and processor seconds within the limit of the configuration.

Usage: ``python tools/course.py [--every-mistake] [--notebook NAME ...] [--anew]``. Without ``--every-mistake`` the
class makes every eighth of the known mistakes of each notebook. The exit status is 0 if all is as expected.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import nbformat
from traitlets.config import PyFileConfigLoader

import course_report
import notebooks
import sample_class
from autograder.secret import FILE
from course_results import MANUAL, MISSING, SAMPLES, Assignment, compare, read_results
from inputs import fingerprint
from listener import Listener

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from nbformat import NotebookNode

    from course_results import Class, Result

ROOT = Path(__file__).resolve().parents[1]
DEMO = ROOT / "build" / "demo"
MADE = DEMO / ".made-from"  # of what the class was graded as expected
_EVERY = 8  # of so many students with known mistakes one is in the class, and at least three of a notebook
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


def prepare(course: Path, only: Sequence[str] = ()) -> None:
    """Make the course's folder anew, with the sources of its notebooks, all or some."""
    shutil.rmtree(course, ignore_errors=True)
    course.mkdir(parents=True)
    (course / "nbgrader_config.py").write_text(CONFIGURATION, encoding="utf-8")
    notebooks.build_sources(ROOT / "solutions", course / "source")
    paths = {path.stem: path for path in sorted((course / "source").glob("*/*.ipynb"))}
    if unknown := set(only) - set(paths):
        raise SystemExit(f"--notebook: expected one of {', '.join(paths)}, got {', '.join(sorted(unknown))}")
    for name in set(paths) - set(only or paths):
        paths[name].unlink()


def assignments(course: Path, *, every_mistake: bool = True) -> list[Assignment]:
    """Return the assignments of a course that is prepared, with the class.

    Parameters
    ----------
    course : pathlib.Path
        See `prepare`.
    every_mistake : bool, optional
        Whether the samples make every known mistake, or every eighth of each notebook's.
    """
    found = []
    for folder in sorted(path for path in (course / "source").iterdir() if any(path.glob("*.ipynb"))):
        sources = {path.stem: nbformat.read(path, as_version=4) for path in sorted(folder.glob("*.ipynb"))}
        found.append(
            Assignment(folder.name, sources, students(folder.name, sources, every_mistake=every_mistake))
        )
    return found


def students(assignment: str, sources: dict[str, NotebookNode], *, every_mistake: bool) -> Class:
    """Return who is in the class of an assignment, with the samples that each hands in."""
    classes = {
        name: sample_class.sample_class(SAMPLES / assignment / name, sample_class.stage_cells(source))
        for name, source in sources.items()
    }
    if not every_mistake:
        for name, samples in classes.items():
            mistakes = [sample for sample in samples if sample.name.startswith("mistake-")]
            step = max(1, min(_EVERY, len(mistakes) // 3))
            classes[name] = [s for s in samples if s not in mistakes or s in mistakes[::step]]
    return sample_class.deal(classes)


def hand_in(course: Path, assignment: Assignment, port: int) -> None:
    """Write what the students hand in."""
    places = {"repository": str(ROOT), "course": str(course), "port": str(port)}
    folder = ROOT / "notebooks" / assignment.name
    releases = {name: nbformat.read(folder / f"{name}.ipynb", as_version=4) for name in assignment.sources}
    answers = {name: sample_class.solutions(source) for name, source in assignment.sources.items()}
    for student, handed_in in assignment.students.items():
        target = course / "submitted" / student / assignment.name
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


def print_table(notebook: str, found: dict[str, Result]) -> None:
    """Print scores and recognised mistakes of a notebook, a line for each sample."""
    columns = list(next(iter(found.values())).scores) if found else []
    print(f"{notebook:46}{'sum':>5}  {'  '.join(columns)}  recognised mistakes")
    for sample, result in found.items():
        total = sum(float(score) for score in result.scores.values() if score not in {MANUAL, MISSING})
        cells = "  ".join(f"{result.scores[name]:>{len(name)}}" for name in columns)
        print(f"{sample:46}{total:5.1f}  {cells}  {result.diagnosis}")
    print()


def grade(course: Path, options: argparse.Namespace, clock: Clock) -> tuple[list[Assignment], list[str]]:
    """Hand the class in and let nbgrader grade it; return the class, and what is not as expected."""
    faults: list[str] = []
    with clock("sources built"):
        prepare(course, options.notebook)
    names = sorted(path.name for path in (course / "source").iterdir() if any(path.glob("*.ipynb")))
    with Listener() as listener:
        with clock("nbgrader generate_assignment, sample class handed in"):
            with running(course, ["generate_assignment", names[0]]):
                found = assignments(course, every_mistake=options.every_mistake)
                for assignment in found:
                    hand_in(course, assignment, listener.port)
            for name in names[1:]:
                with running(course, ["generate_assignment", name]):
                    pass
        if not listener.hears():
            faults.append("the listener does not hear connections, so that none proves nothing")
        for assignment in found:
            count = sum(map(len, assignment.students.values()))
            what = f"nbgrader autograde {assignment.name}: {count} notebooks of {len(assignment.students)} students"
            with clock(what), running(course, ["autograde", assignment.name], bar=True):
                pass
        if listener.visits:
            faults.append(f"connects-out: the listener had {listener.visits} connections")
    for number, name in enumerate(names):
        last = number == len(names) - 1  # the grades are exported meanwhile
        with (
            clock(f"nbgrader generate_feedback {name}{', export' if last else ''}"),
            running(course, ["generate_feedback", name], *([["export"]] if last else [])),
        ):
            pass
    return found, faults


def look(course: Path, found: list[Assignment]) -> list[str]:
    """Look at everything that a graded class leaves behind, print it, and return what is not as expected."""
    faults: list[str] = []
    numbers = course_report.hidden_numbers((course / FILE).read_text(encoding="utf-8").strip())
    with ProcessPoolExecutor() as pool:
        leaks = [
            pool.submit(course_report.leaks, course, one.name, name, list(one.students), source, numbers)
            for one in found
            for name, source in one.sources.items()
        ]
        for assignment in found:
            faults += _look_at(course, assignment)
        faults += [line for leak in leaks for line in leak.result()]
    handed_in = [(assignment.name, student) for assignment in found for student in assignment.students]
    return faults + course_report.exported(course / "grades.csv", handed_in)


def _look_at(course: Path, assignment: Assignment) -> list[str]:
    """Look at the scores and processor seconds of an assignment, and print them."""
    found = read_results(course, assignment)
    faults = compare(assignment, found)
    seconds, limit = {}, processor_limit()
    for name in assignment.sources:
        students = list(assignment.students)
        took = course_report.seconds(course, assignment.name, name, students)
        faults += course_report.overruns(took, students, limit)
        seconds |= {(student, name): value for student, value in took.items()}
    print(f"\n{assignment.name}\n{'=' * len(assignment.name)}\n")
    for name, results in found.items():
        handed_in = {has[name].name for has in assignment.students.values() if name in has}
        print_table(name, {sample: result for sample, result in results.items() if sample in handed_in})
    if seconds:
        longest = max(seconds, key=seconds.__getitem__)
        honest = sum(value for (student, _), value in seconds.items() if student == "perfect")
        took = f"{seconds[longest]:.1f} processor seconds"
        print(f"One honest submission: {honest:.1f} processor seconds in the sandbox.")
        print(f"Longest: {', '.join(longest)}, {took}; the limit is {limit:g}.\n")
    return faults


def main(arguments: Sequence[str] | None = None) -> int:
    """Grade the class, look at what came out, and say so."""
    parser = argparse.ArgumentParser(description="Grade the sample class and hold every score.")
    parser.add_argument(
        "--every-mistake", action="store_true", help="make all known mistakes, not every eighth"
    )
    parser.add_argument("--notebook", action="append", default=[], help="grade this notebook alone")
    parser.add_argument("--anew", action="store_true", help="grade it again though nothing has changed")
    options = parser.parse_args(arguments)
    clock = Clock()
    print(f"Sample class in {DEMO}")
    made = fingerprint(str(options.every_mistake), *options.notebook)
    if options.anew or not MADE.exists() or MADE.read_text(encoding="utf-8") != made:
        found, faults = grade(DEMO, options, clock)
    else:
        print("         graded before, and nothing has changed since: --anew grades it again")
        found, faults = assignments(DEMO, every_mistake=options.every_mistake), []
    with clock("everything looked at"):
        faults += look(DEMO, found)
    print(f"{clock.total:6.1f} s  together\n")
    for what, path in (
        ("book", ROOT / "_build" / "html" / "index.html"),
        ("notebooks", ROOT / "notebooks"),
        ("feedback", DEMO / "feedback"),
        ("grades", DEMO / "grades.csv"),
    ):
        print(f"{what:10} {path}{'' if path.exists() else '  (not there)'}")
    if faults:
        MADE.unlink(missing_ok=True)
        print(f"\n{len(faults)} things are not as expected:", file=sys.stderr)
        print("\n".join(f"  {fault}" for fault in faults), file=sys.stderr)
        return 1
    MADE.write_text(made, encoding="utf-8")
    count = len({student for assignment in found for student in assignment.students})
    print(f"\nAll {count} students got what they must get.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
