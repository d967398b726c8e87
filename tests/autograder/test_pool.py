"""Notebooks executed in processes of their own: one that dies is replaced, and a job is never lost."""

# ruff: noqa: ARG005, PT012  (stand-ins take what the real ones take)

from __future__ import annotations

import io
import os
import pickle
import signal
import struct
import time
from pathlib import Path

import nbformat
import pytest
from nbgrader.utils import determine_grade

from autograder import pool as pool_
from autograder.pool import Job, Pool, failed, pack
from autograder.roles import REVIEW
from autograder.sandbox import SandboxError


@pytest.fixture
def job(build_notebook, limits):
    """Make jobs out of cells."""

    def make(*cells, **fields):
        notebook, release = build_notebook(cells)
        given = {"key": "s/a/n", "files": {}, "packages": ("ipython", "msgpack", "numpy"), **fields}
        return Job(notebook=pack(notebook), release=release, limits=tuple(limits.to_list()), **given)

    return make


def cells_of(text):
    """Return the test cells of an executed notebook."""
    notebook = nbformat.reads(text, as_version=4)
    return [cell for cell in notebook.cells if cell.metadata.get("nbgrader", {}).get("grade")]


RIGHT = ("answer", "def f(x): return x * x", "def f(x): ...")
TEST = ("test", "assert f(3) == 9")
EXIT = ("answer", "import os\ndef f(x): os._exit(0)", "def f(x): ...")


def test_jobs_in_processes(job):
    """Several notebooks are executed in processes of their own, each with its own result."""
    with Pool(1) as pool:
        futures = [pool.submit(job(answer, TEST)) for answer in (RIGHT, EXIT, RIGHT)]
        assert [determine_grade(cells_of(f.result())[0])[0] for f in futures] == [2, 0, 2]
        pids = [process.process.pid for process in pool._all]
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_a_killed_process_is_replaced_and_its_job_done_again(job):
    """A process that is killed while it works on a job costs nothing: the job is done again."""
    slow = ("plain", "import time\nend = time.process_time() + 1.0\nwhile time.process_time() < end: pass")
    with Pool(1) as pool:
        future = pool.submit(job(slow, RIGHT, TEST))
        deadline = time.monotonic() + 30
        while not (pool._all and pool._all[0].process) and time.monotonic() < deadline:
            time.sleep(0.01)
        first = pool._all[0].process.pid
        time.sleep(0.3)
        os.kill(first, signal.SIGKILL)
        (cell,) = cells_of(future.result(timeout=60))
        assert pool._all[0].process.pid != first
    assert (determine_grade(cell)[0], REVIEW in cell.metadata) == (2, False)


def test_a_process_that_dies_every_time_flags_the_job(job, monkeypatch):
    """A job whose process dies twice is flagged for a person, and the next one is executed."""
    dying = [True]
    start = pool_._Process._start

    def start_and_kill(self):
        process = start(self)
        if dying[0]:
            process.kill()
        return process

    monkeypatch.setattr(pool_._Process, "_start", start_and_kill)
    with Pool(1) as pool:
        (cell,) = cells_of(pool.submit(job(RIGHT, TEST)).result(timeout=60))
        dying[0] = False
        (next_cell,) = cells_of(pool.submit(job(RIGHT, TEST)).result(timeout=60))
    assert "died" in cell.metadata[REVIEW]
    assert determine_grade(cell)[0] == 0
    assert determine_grade(next_cell)[0] == 2


def test_failed_flags_every_test_cell(job):
    """A notebook that could not be executed has no pass and no silent zero: each test cell says why."""
    cells = cells_of(failed(job(RIGHT, TEST, ("test", "1.0")), "the reason"))
    assert [cell.metadata[REVIEW] for cell in cells] == ["the reason"] * 2
    assert [determine_grade(cell)[0] for cell in cells] == [0, 0]
    assert all("the reason" in cell.outputs[0].evalue for cell in cells)


def test_a_problem_known_beforehand_is_the_reason(job):
    """A job that cannot be executed, because its files are too large, says so without a sandbox."""
    (cell,) = cells_of(pool_.execute(job(RIGHT, TEST, problem="the files take too much")))
    assert cell.metadata[REVIEW] == "the files take too much"


def test_a_fault_of_the_grader_is_flagged(job, monkeypatch, sandbox):
    """An exception in the grader itself is flagged with its name: a person decides."""
    monkeypatch.setattr(pool_, "_sandbox", lambda job: sandbox)
    monkeypatch.setattr(pool_.Limits, "from_list", lambda values: 1 / 0)
    (cell,) = cells_of(pool_.execute(job(RIGHT, TEST)))
    assert "ZeroDivisionError" in cell.metadata[REVIEW]


def test_a_sandbox_that_ends_is_had_again(job, monkeypatch, sandbox):
    """A sandbox that ends while a notebook runs is started anew once; a second time the cells are flagged."""
    from autograder import execute  # noqa: PLC0415

    ends = [True]
    run = execute.Execution.run

    def maybe(self):
        if ends.pop(0):
            self.session.close()
            raise SandboxError("it has ended")
        run(self)

    monkeypatch.setattr(pool_, "_sandbox", lambda job: sandbox)
    monkeypatch.setattr(execute.Execution, "run", maybe)
    ends[:] = [True, False]
    assert determine_grade(cells_of(pool_.execute(job(RIGHT, TEST)))[0])[0] == 2
    ends[:] = [True, True]
    assert "twice" in cells_of(pool_.execute(job(RIGHT, TEST)))[0].metadata[REVIEW]


def test_a_notebook_is_done_again_where_the_machine_runs_out_of_memory(job, sandbox, monkeypatch):
    """What the kernel kills for want of memory is not the submission's doing: once more, and then a person looks."""
    monkeypatch.setattr(pool_, "_sandbox", lambda job: sandbox)
    counted = iter([3, 4, 4, 4])
    monkeypatch.setattr(pool_, "killed_for_memory", lambda: next(counted))
    assert determine_grade(cells_of(pool_.execute(job(RIGHT, TEST)))[0])[0] == 2
    assert next(counted, None) is None
    counted = iter([4, 5, 5, 6])
    assert "out of memory" in cells_of(pool_.execute(job(RIGHT, TEST)))[0].metadata[REVIEW]


def test_what_the_kernel_kills_for_memory_is_counted():
    """The kernel's count is a number that stays where nothing is killed."""
    assert pool_.killed_for_memory() == pool_.killed_for_memory() >= 0
    assert "\noom_kill " in Path("/proc/vmstat").read_text(encoding="ascii")


def test_without_a_sandbox_nothing_is_graded(job, monkeypatch):
    """Where no sandbox can be had at all, the future raises what says so, and no notebook comes back."""
    monkeypatch.setenv("PATH", "/nowhere")
    with Pool(1) as pool, pytest.raises(SandboxError, match="bubblewrap"):
        pool.submit(job(RIGHT, TEST)).result(timeout=60)


def test_leaving_on_an_error_does_not_wait(job):
    """Leaving a pool by an exception kills its processes, and none is started anew for their jobs."""
    slow = ("plain", "import time\ntime.sleep(60)")
    with pytest.raises(KeyboardInterrupt), Pool(1) as pool:
        future = pool.submit(job(slow, RIGHT, TEST))
        while not (pool._all and pool._all[0].process):
            time.sleep(0.01)
        process = pool._all[0].process
        raise KeyboardInterrupt
    assert process.poll() is not None
    (cell,) = cells_of(future.result(timeout=30))
    assert cell.metadata[REVIEW]
    assert pool._all[0].process is None


def test_serve_writes_one_answer_for_each_job(job, monkeypatch):
    """A process of the pool answers each job in its pipe with one result, errors of the sandbox included."""
    results = iter(["first", SandboxError("none to be had"), "third"])

    def execute(job):
        result = next(results)
        if isinstance(result, Exception):
            raise result
        return result

    monkeypatch.setattr(pool_, "execute", execute)
    data = pickle.dumps(job(RIGHT, TEST))
    sink = io.BytesIO()
    pool_.serve(io.BytesIO((struct.pack(">I", len(data)) + data) * 3), sink)
    answers, rest = [], sink.getvalue()
    while rest:
        (length,) = struct.unpack(">I", rest[:4])
        answers.append(rest[4 : 4 + length])
        rest = rest[4 + length :]
    assert answers == [b"+first", b"-none to be had", b"+third"]


def test_where_nothing_was_handed_in_nothing_runs(job, monkeypatch):
    """A file that is missing costs no sandbox: each test cell says so, scores 0, and waits for nobody."""
    monkeypatch.setattr(pool_, "Sandbox", None)
    notebook = pool_.unpack(pool_.execute(job(RIGHT, TEST, nothing="no file set.ipynb was handed in")))
    answer, test = notebook.cells
    assert answer.outputs == []
    assert [output.evalue for output in test.outputs] == ["no file set.ipynb was handed in"]
    assert REVIEW not in test.metadata
    assert determine_grade(test) == (0, 2)
    assert notebook.metadata.grading.seconds == 0
