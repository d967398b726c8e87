"""Grading a thousand: what a submission costs in a large class and in a small one, and what the grader remembers.

The notebook is a tiny one, so that what is measured is the grader: two functions with hidden tests. Every submission
differs by a comment from every other. Classes of `SMALL` and of `LARGE` are graded from nothing by a command of their
own, with as many processes as it takes by itself, after one of a single submission, whose time is that of the start and
is subtracted. All scores are asserted to be full marks. The large class is graded once more, killed half way and
finished by the next command.

The writer is the one process that reads and stores, the workers are all others. How many workers it can keep busy is
asked of the real notebook `ekf-localization`, too.
"""

import contextlib
import functools
import shutil
import signal
import sqlite3
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import nbformat
import psutil
from nbformat.v4 import new_code_cell, new_notebook

from benchmarks.grading import ASSIGNMENT, OURS, command_environment, make_course, tool
from benchmarks.harness import Result

SMALL, LARGE = 50, 1000
EVERY = 0.25  # seconds between two looks at the processes
TINY = "powers"
POWERS = {"square": "def square(x):\n    return x * x", "cube": "def cube(x):\n    return x**3"}
TESTS = {"square": "assert square(3) == 9", "cube": "assert cube(-2) == -8"}
# Runs the command and says what its own process took.
COUNTED = """import atexit, sys, time
def tell():
    with open("used", "w") as file:
        file.write(str(time.process_time()))
atexit.register(tell)
from nbgrader.apps.nbgraderapp import main
sys.argv[0] = "nbgrader"
main()
"""


@dataclass(frozen=True)
class Used:
    """What grading a class took.

    Attributes
    ----------
    wall : float
        Wall time [s].
    writer : float
        Processor time of the process that stores [s].
    memory, pool : float
        Largest resident size that was seen of that process and of the largest other one [MiB].
    """

    wall: float
    writer: float
    memory: float
    pool: float


def _cell(source: str, grade_id: str, **fields: object) -> nbformat.NotebookNode:
    meta = {"schema_version": 3, "grade": False, "solution": False, "locked": False, "task": False}
    return new_code_cell(source, id=grade_id, metadata={"nbgrader": meta | {"grade_id": grade_id} | fields})


def make_powers(folder: Path, count: int) -> None:
    """Make a course with `count` right submissions of the tiny notebook, no two the same."""
    cells = []
    for name, source in POWERS.items():
        marked = f"### BEGIN SOLUTION\n{source}\n### END SOLUTION"
        cells.append(_cell(marked, name, solution=True))
        test = f"### BEGIN HIDDEN TESTS\n{TESTS[name]}\n### END HIDDEN TESTS"
        cells.append(_cell(test, f"{name}-test", grade=True, locked=True, points=1))
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    source = folder / "source" / TINY / f"{TINY}.ipynb"
    source.parent.mkdir(parents=True)
    nbformat.write(new_notebook(cells=cells, metadata=kernel), source)
    tool("notebooks").release(
        folder / "source", folder / "release", [TINY], f"sqlite:///{folder}/gradebook.db"
    )
    notebook = nbformat.read(folder / "release" / TINY / f"{TINY}.ipynb", as_version=4)
    for number in range(count):
        for cell in notebook.cells:
            if cell.metadata.nbgrader.grade_id in POWERS:
                cell.source = f"# Written by student {number}.\n{POWERS[cell.metadata.nbgrader.grade_id]}"
        target = folder / "submitted" / f"student-{number:04}" / TINY
        target.mkdir(parents=True)
        nbformat.write(notebook, target / f"{TINY}.ipynb")


def grade(folder: Path, assignment: str, *options: str, until: int | None = None) -> Used:
    """Grade a course by a command of its own, killed with SIGKILL once `until` submissions are there."""
    (folder / "nbgrader_config.py").write_text(OURS, encoding="utf-8")
    largest = {True: 0, False: 0}
    with (folder / "log").open("w") as log:
        begin = time.perf_counter()
        command = psutil.Popen(
            [sys.executable, "-c", COUNTED, "autograde", assignment, *options],
            cwd=folder, env=command_environment(), stdout=log, stderr=log,
        )  # fmt: skip
        while command.poll() is None:
            for process in [command, *command.children(recursive=True)]:
                with contextlib.suppress(psutil.NoSuchProcess):
                    own = process.pid == command.pid
                    largest[own] = max(largest[own], process.memory_info().rss)
            if until is not None and len(list(folder.glob("autograded/*"))) >= until:
                cpu = sum(command.cpu_times()[:2])
                command.kill()
                command.wait()
                break
            time.sleep(EVERY)
        wall = time.perf_counter() - begin
    if command.returncode != (0 if until is None else -signal.SIGKILL):
        raise RuntimeError(
            f"grading ended with {command.returncode}:\n{(folder / 'log').read_text()[-2000:]}"
        )
    if until is None:
        cpu = float((folder / "used").read_text(encoding="utf-8"))
    return Used(wall, cpu, largest[True] / 2**20, largest[False] / 2**20)


def _require_full_marks(folder: Path, count: int) -> None:
    """Require every test cell of a class of `count` to have full marks."""
    with contextlib.closing(sqlite3.connect(folder / "gradebook.db")) as database:
        right = database.execute("select count(*) from grade where auto_score = 1").fetchone()[0]
    if right != count * len(TESTS):
        raise ArithmeticError(f"expected {count * len(TESTS)} test cells of full marks, got {right}")


@functools.cache
def measure() -> dict[int, Used]:
    """Grade a class of one, a small one and a large one."""
    found = {}
    for count in (1, SMALL, LARGE):
        with tempfile.TemporaryDirectory(prefix="scale-") as name:
            folder = Path(name).resolve()
            make_powers(folder, count)
            found[count] = grade(folder, TINY)
            _require_full_marks(folder, count)
        print(f"        {count} submissions: {found[count]}", flush=True)
    return found


def _each(found: dict[int, Used], count: int) -> float:
    """Return the wall time of a submission in a class of `count`, the start subtracted [s]."""
    return (found[count].wall - found[1].wall) / (count - 1)


def cost() -> Result:
    """Compare the cost of a submission in the small class and in the large one."""
    found = measure()
    ratio = _each(found, SMALL) / _each(found, LARGE)
    baseline = f"the same in a class of {SMALL}"
    return Result(f"grading-{LARGE}: wall time of a submission, start subtracted", ratio, 1 / 1.2, baseline)


def memory() -> Result:
    """Compare the largest resident size of any process of the grader in both classes."""
    found = measure()
    ratio = min(
        found[SMALL].memory / found[LARGE].memory,
        found[SMALL].pool / found[LARGE].pool,
    )
    baseline = f"the same in a class of {SMALL}"
    return Result(f"grading-{LARGE}: largest process of the grader", ratio, 1 / 1.2, baseline)


def resumed() -> Result:
    """Compare the large class graded in one piece with one killed half way and finished by the next command."""
    with tempfile.TemporaryDirectory(prefix="scale-") as name:
        folder = Path(name).resolve()
        make_powers(folder, LARGE)
        killed = grade(folder, TINY, until=LARGE // 2)
        finished = grade(folder, TINY)
        _require_full_marks(folder, LARGE)
    print(f"        killed after {killed.wall:.3g} s, finished in {finished.wall:.3g} s more", flush=True)
    ratio = measure()[LARGE].wall / (killed.wall + finished.wall)
    baseline = "the same class in one piece"
    return Result(f"grading-{LARGE}: killed half way and finished, both commands", ratio, 1 / 1.2, baseline)


def writer() -> Result:
    """Ask how many workers one writer can keep busy with a real notebook."""
    with tempfile.TemporaryDirectory(prefix="scale-") as name:
        folder = Path(name).resolve()
        count = len(make_course(folder))
        whole = grade(folder, ASSIGNMENT, "--ParallelAutograde.jobs=1")
        for graded in (folder / "autograded").iterdir():
            shutil.rmtree(graded)
        for other in sorted((folder / "submitted").iterdir())[1:]:
            shutil.rmtree(other)
        one = grade(folder, ASSIGNMENT, "--ParallelAutograde.jobs=1")
    stored, done = (whole.writer - one.writer) / (count - 1), (whole.wall - one.wall) / (count - 1)
    print(f"        a submission: writer {stored:.3g} s, worker {done:.3g} s", flush=True)
    baseline = f"processor time of the writer for the same submissions of {ASSIGNMENT}, start subtracted"
    return Result(
        "grading-writer: time of a worker, how many a writer keeps busy", done / stored, 4, baseline
    )


BENCHMARKS = (cost, memory, resumed, writer)
