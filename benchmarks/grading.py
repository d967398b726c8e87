"""Grading a class: `nbgrader autograde` with our plug-in against the same command without it.

The class is honest: right answers, other right ways, and common mistakes; a submission that ends its process or hangs
would only make the baseline slower. Both sides get the same submissions, hidden tests, reports and secret, and their
gradebooks are asserted equal before any time is used. Stock nbgrader starts a kernel for each notebook and runs tests
and submission in it; ours starts one sandbox and runs the submission in a fork of it, the tests outside.

Times are wall times of the whole command, its start included: a new process, imports, the pool, the sandbox. The
overhead is what is left of them without the cells' own work, which is measured in an IPython shell with all imports
done. Stock nbgrader runs every cell of every submission, and its tests compute what is right anew. Ours runs the
instructor's cells at the beginning once for the class, and its tests keep what is right: it saves work, so that its
whole wall time is shorter than that work, and no overhead is left. The second result does not profit from what is
saved: from each side it subtracts the work that this side does.
"""

import contextlib
import functools
import importlib
import importlib.util
import itertools
import json
import os
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

import nbformat
from nbformat import NotebookNode
from sympy.core.cache import clear_cache

from autograder.roles import role_of
from autograder.worker.shell import NotebookShell, make_shell, run_cell
from autograder.worker.zygote import draw_once, preload, settle
from benchmarks.harness import Result

ROOT = Path(__file__).resolve().parents[1]
ASSIGNMENT, NOTEBOOK = "ekf-localization", "motion-model"
COPIES = 8  # of each kind of submission
ROUNDS = 1
WORK_ROUNDS = 3
NOTHING_LEFT = 1000.0  # the ratio where ours has no overhead
INLINE = "module://matplotlib_inline.backend_inline"  # as in a notebook
SECRET = "a course"  # noqa: S105  (of this benchmark)
# Kinds of submissions by the cell that differs from the solution: the text to replace there, and by what.
ALTERNATIVES = ROOT / "tests" / "autograder" / "alternatives" / "motion_model"
KINDS = {
    "right": {},
    "series": {"dynamics": (None, "series.py")},
    "complex": {"dynamics": (None, "complex_numbers.py")},
    "no-dt": {"transition": ("dt * Gu @ R", "Gu @ R")},
    "zeroed": {"dynamics": ("[-np.sin(theta) * V * dt / 2, np.cos(theta) * V * dt / 2, 1]", "[0, 0, 1]")},
    "blank": {"dynamics": (None, "")},
}  # fmt: skip
STOCK = """c = get_config()
c.CourseDirectory.source_directory = "source"
"""
OURS = """from autograder.plugin import configure
c = get_config()
c.CourseDirectory.source_directory = "source"
c.ParallelAutograde.progress = False
configure(c)
"""


def tool(name: str) -> ModuleType:
    """Import one of the tools, which are in no package."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _answer(source: str) -> str:
    """Return a solution cell without the lines that mark the solution."""
    lines = source.splitlines()
    return "\n".join(line for line in lines if "BEGIN SOLUTION" not in line and "END SOLUTION" not in line)


def submission(source: NotebookNode, released: NotebookNode, kind: str) -> NotebookNode:
    """Fill in the released notebook.

    Parameters
    ----------
    source, released : NotebookNode
        The instructor's version and the students'.
    kind : str
        A key of `KINDS`.
    """
    answers = {c.metadata.nbgrader.grade_id: c.source for c in source.cells if "nbgrader" in c.metadata}
    notebook = nbformat.from_dict(released)
    for cell in notebook.cells:
        meta = cell.metadata.get("nbgrader", {})
        if not meta.get("solution"):
            continue
        text = _answer(answers[meta["grade_id"]])
        if meta["grade_id"] in KINDS[kind]:
            old, new = KINDS[kind][meta["grade_id"]]
            if old is None:
                text = (ALTERNATIVES / new).read_text(encoding="utf-8") if new else cell.source
            elif old not in text:
                raise LookupError(f"{kind}: the solution has no {old!r}")
            else:
                text = text.replace(old, new)
        cell.source = text
    return notebook


def make_course(folder: Path) -> list[NotebookNode]:
    """Make a course with its release and all submissions; return the latter with their hidden tests."""
    notebooks = tool("notebooks")
    source = folder / "source"
    notebooks.build_sources(ROOT / "solutions", source)
    for other in source.iterdir():
        if other.name != ASSIGNMENT:
            shutil.rmtree(other)
    notebooks.release(source, folder / "release", [ASSIGNMENT], f"sqlite:///{folder}/gradebook.db")
    instructors = nbformat.read(source / ASSIGNMENT / f"{NOTEBOOK}.ipynb", as_version=4)
    released = nbformat.read(folder / "release" / ASSIGNMENT / f"{NOTEBOOK}.ipynb", as_version=4)
    tests = {c.metadata.nbgrader.grade_id: c.source for c in instructors.cells if "nbgrader" in c.metadata}
    found = []
    for kind in KINDS:
        made = submission(instructors, released, kind)
        for copy in range(COPIES):
            target = folder / "submitted" / f"{kind}-{copy}" / ASSIGNMENT
            target.mkdir(parents=True)
            nbformat.write(made, target / f"{NOTEBOOK}.ipynb")
        whole = nbformat.from_dict(made)
        for cell in whole.cells:
            meta = cell.metadata.get("nbgrader", {})
            if meta.get("grade") and not meta.get("solution"):
                cell.source = tests[meta["grade_id"]]
        found += [whole] * COPIES
    return found


def command_environment() -> dict[str, str]:
    """Return the environment of a command of nbgrader's."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
    threads = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
    return os.environ | {"PATH": path, "ROBOLOC_SECRET": SECRET} | threads


def nbgrader(course: Path, config: str, *arguments: str) -> float:
    """Run a command of nbgrader's in a course; return the wall time of the command [s]."""
    (course / "nbgrader_config.py").write_text(config, encoding="utf-8")
    with (course / "log").open("w") as log:
        begin = time.perf_counter()
        done = subprocess.run(  # noqa: S603  (our own command)
            [sys.executable, "-m", "nbgrader", *arguments],
            cwd=course, env=command_environment(), stdout=log, stderr=log, check=False,
        )  # fmt: skip
        seconds = time.perf_counter() - begin
    if done.returncode:
        raise RuntimeError(f"nbgrader {arguments[0]} failed:\n{(course / 'log').read_text()[-2000:]}")
    return seconds


def autograde(course: Path, config: str, *options: str) -> float:
    """Grade a fresh copy of the course; return the wall time of the command [s]."""
    shutil.rmtree(course / "autograded", ignore_errors=True)
    return nbgrader(course, config, "autograde", ASSIGNMENT, *options)


def scores(course: Path) -> list[tuple]:
    """Return every student's automatic score of every cell."""
    query = """select student.id, base_cell.name, grade.auto_score, grade.needs_manual_grade from grade
        join base_cell on base_cell.id = grade.cell_id
        join submitted_notebook on submitted_notebook.id = grade.notebook_id
        join submitted_assignment on submitted_assignment.id = submitted_notebook.assignment_id
        join student on student.id = submitted_assignment.student_id order by 1, 2"""
    with contextlib.closing(sqlite3.connect(course / "gradebook.db")) as database:
        return database.execute(query).fetchall()


def _code(notebook: NotebookNode) -> list[NotebookNode]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def _in_fork(shell: NotebookShell, notebook: NotebookNode) -> list[float]:
    """Return the time of each code cell of a notebook in a fork of this process [s]."""
    reader, writer = os.pipe()
    pid = os.fork()
    if pid == 0:
        seconds = []
        for cell in _code(notebook):
            begin = time.perf_counter()
            run_cell(shell, cell.source)
            seconds.append(time.perf_counter() - begin)
        os.write(writer, json.dumps(seconds).encode())
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as answer:
        seconds = json.loads(answer.read())
    os.waitpid(pid, 0)
    return seconds


def _least(shell: NotebookShell, notebooks: list[NotebookNode], beginning: int = 0) -> float:
    """Return the time of the cells of all notebooks but for the first ones [s], of each the shortest of all rounds."""
    rounds = [[_in_fork(shell, notebook)[beginning:] for notebook in notebooks] for _ in range(WORK_ROUNDS)]
    return sum(min(times) for cells in zip(*rounds, strict=True) for times in zip(*cells, strict=True))


def tell_work(paths: Sequence[str]) -> None:
    """Print the time that the cells of notebooks take with stock nbgrader and with ours [s], all imports done.

    It is measured in this process, a new one that is warmed up as the sandbox's is. Each notebook runs in a fork of its
    own: SymPy's cache would remember one student's derivation for the next.
    """
    notebooks = [nbformat.read(path, as_version=4) for path in paths]
    shell = make_shell()
    preload()
    draw_once(shell)
    importlib.import_module("autograder.grading")
    settle()
    each = _least(shell, notebooks)
    beginning = len(list(itertools.takewhile(lambda cell: role_of(cell) == "given", _code(notebooks[0]))))
    once = sum(_in_fork(shell, notebooks[0])[:beginning])
    for cell in _code(notebooks[0]):  # from here on the tests know what is right
        run_cell(shell, cell.source)
    clear_cache()
    settle()
    print(json.dumps([each, once + _least(shell, notebooks, beginning)]))


def cells_work(notebooks: list[NotebookNode], folder: Path) -> list[float]:
    """Return the time that the cells take with stock nbgrader and with ours [s]; see `tell_work`."""
    paths = [str(folder / f"{number}.ipynb") for number in range(len(notebooks))]
    for notebook, path in zip(notebooks, paths, strict=True):
        nbformat.write(notebook, path)
    done = subprocess.run(  # noqa: S603  (our own command)
        [sys.executable, "-c", "import sys; from benchmarks.grading import tell_work; tell_work(sys.argv[1:])", *paths],
        cwd=ROOT, env=command_environment() | {"MPLBACKEND": INLINE}, stdout=subprocess.PIPE, text=True, check=True,
    )  # fmt: skip
    return json.loads(done.stdout.splitlines()[-1])


@functools.cache
def measure() -> dict[str, float]:
    """Grade the class in all ways, interleaved; return the shortest times [s] and the cells' own work."""
    ways = {
        "stock": (STOCK, ()),
        "one": (OURS, ("--ParallelAutograde.jobs=1",)),
        "two": (OURS, ("--ParallelAutograde.jobs=2",)),
    }
    with tempfile.TemporaryDirectory(prefix="grading-") as name:
        folder = Path(name).resolve()
        notebooks = make_course(folder / "course")
        courses = {way: shutil.copytree(folder / "course", folder / way) for way in ways}
        times = dict.fromkeys(ways, float("inf"))
        for _ in range(ROUNDS):
            for way, (config, options) in ways.items():
                times[way] = min(times[way], autograde(courses[way], config, *options))
            expected = scores(courses["stock"])
            for way in ("one", "two"):
                if scores(courses[way]) != expected or not sum(row[2] or 0 for row in expected):
                    got = scores(courses[way])
                    raise ArithmeticError(f"expected equal gradebooks, got {expected} and {got}")
        times["stock work"], times["our work"] = cells_work(notebooks, folder)
        times["submissions"] = len(notebooks)
    print("        " + ", ".join(f"{way} {value:.3g}" for way, value in times.items()), flush=True)
    return times


def overhead() -> Result:
    """Compare what is left of the wall time without the work of all cells, one notebook at a time."""
    found = measure()
    stock, ours = (found[way] - found["stock work"] for way in ("stock", "one"))
    ratio = min(stock / ours, NOTHING_LEFT) if ours > 0 else NOTHING_LEFT
    return Result("grading-overhead-vs-stock", ratio, 20, _baseline(found))


def overhead_of_own_work() -> Result:
    """Compare what is left of the wall time without the work that each side does, one notebook at a time."""
    found = measure()
    ratio = (found["stock"] - found["stock work"]) / (found["one"] - found["our work"])
    return Result(
        "grading-overhead-vs-stock: from each side the work that it does", ratio, 5, _baseline(found)
    )


def wall() -> Result:
    """Compare whole wall times on two processors."""
    found = measure()
    return Result("grading-vs-stock-nbgrader", found["stock"] / found["two"], 5, _baseline(found))


def _baseline(found: dict[str, float]) -> str:
    return f"stock nbgrader autograde of the same {found['submissions']} submissions, same scores"


BENCHMARKS = (overhead, overhead_of_own_work, wall)
