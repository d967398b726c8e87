"""Executing notebooks in processes of their own, several at a time.

A process of the pool holds the trusted side: the tests, the reference, and one warm sandbox. It does not hold the
gradebook: what comes back is an executed notebook, and one writer stores it.
"""

from __future__ import annotations

import atexit
import json
import os
import pickle
import struct
import subprocess
import sys
import threading
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, TYPE_CHECKING

import nbformat

from .beside import beside_tests
from .layout import Layout
from .roles import REVIEW, role_of
from .sandbox import Sandbox, SandboxError
from .secret import course_root
from .worker.limits import Limits

if TYPE_CHECKING:
    from types import ModuleType

    from nbformat import NotebookNode

ATTEMPTS = 2


@dataclass(frozen=True)
class Job:
    """The execution of one notebook, as data.

    Attributes
    ----------
    key : str
        Student, assignment and notebook.
    notebook : str
        The restored notebook, as `pack` writes it.
    release : dict of str to str
        Released source by grade id.
    files : dict of str to tuple of (bytes, int)
        The notebook's folder.
    limits : tuple of float
        See `worker.limits.Limits.to_list`.
    packages, hidden : tuple of str
        See `sandbox.Sandbox`.
    problem : str
        Why it cannot be executed at all; empty where it can.
    nothing : str
        Why there is nothing of a student's to execute: no file, or none that can be read. Empty where there is.
    run : str
        The run of the grader, for the reports.
    warm : bool
        See `execute.Execution`.
    explain : bool
        See `grading.grading_run`.
    layout : layout.Layout
        What else is known of the release.
    given : frozenset of str
        Those of the files that are the instructor's.
    secret : str
        The course's secret where the process that executes cannot look it up; empty where it can.
    """

    key: str
    notebook: str
    release: dict[str, str]
    files: dict[str, tuple[bytes, int]]
    limits: tuple[float, ...]
    packages: tuple[str, ...]
    hidden: tuple[str, ...] = ()
    problem: str = ""
    nothing: str = ""
    run: str = ""
    warm: bool = True
    explain: bool = False
    layout: Layout = field(default_factory=Layout)
    given: frozenset[str] = frozenset()
    secret: str = field(default="", repr=False)

    def record(self) -> dict[str, str]:
        """Return what an appeal needs to know: which run, and which versions of the release, checks and packages."""
        from .provenance import record  # noqa: PLC0415

        return {"run": self.run, **record(self.release)}


def pack(notebook: NotebookNode) -> str:
    """Write a notebook for another process of ours: as it is, without validating it and without splitting lines."""
    return json.dumps(notebook)


def unpack(text: str) -> NotebookNode:
    """Read what `pack` wrote."""
    return nbformat.from_dict(json.loads(text))


_sandboxes: dict[tuple, Sandbox] = {}


def _close_sandboxes() -> None:
    while _sandboxes:
        _sandboxes.popitem()[1].close()


def _sandbox(job: Job) -> Sandbox:
    key = (job.packages, job.hidden)
    if key not in _sandboxes:
        _close_sandboxes()
        _sandboxes[key] = Sandbox(job.packages, job.hidden)
        atexit.register(_close_sandboxes)
    return _sandboxes[key]


def load() -> tuple[ModuleType, ModuleType]:
    """Import what executes, and the checks, and return both modules; the grader's first process needs neither."""
    from . import execute as execute_  # noqa: PLC0415
    from . import grading  # noqa: PLC0415

    return execute_, grading


def execute(job: Job) -> str:
    """Execute a notebook in this process.

    Parameters
    ----------
    job : Job
        What to execute.

    Returns
    -------
    str
        The executed notebook, as `pack` writes it. Where it could not be executed, every test cell says why and is
        flagged.

    Raises
    ------
    SandboxError
        If no sandbox can be had at all.
    """
    if job.problem:
        return failed(job, job.problem)
    if job.nothing:
        return unexecuted(job)
    problem = ""
    for _ in range(ATTEMPTS):
        sandbox = _sandbox(job)
        execute_, grading = load()
        notebook = unpack(job.notebook)
        killed = killed_for_memory()
        try:
            settings = {"secret": job.secret or None, "explain": job.explain, "root": course_root()}
            with grading.grading_run(run_id=job.run, **settings), beside_tests(job.files, job.given):
                limits = Limits.from_list(list(job.limits))
                execution = execute_.Execution(
                    notebook, job.release, sandbox, limits, job.files,
                    warm=job.warm, layout=job.layout, beside=job.given,
                )  # fmt: skip
                execution.run()
        except SandboxError:
            _close_sandboxes()
            problem = "the sandbox ended while this notebook ran, twice"
            continue
        except Exception as error:  # noqa: BLE001  (whatever goes wrong in the grader: a person, never a silent 0)
            return failed(job, f"the grader itself failed: {type(error).__name__}: {error}")
        if (
            killed_for_memory() != killed
        ):  # a process of this notebook may be among them, which has not ended itself
            problem = "this machine ran out of memory while this notebook ran, twice"
            continue
        seconds = limits.notebook_cpu - execution.session.left
        notebook.metadata["grading"] = {**job.record(), "seconds": round(seconds, 2)}
        return pack(notebook)
    return failed(job, problem)


def killed_for_memory() -> int:
    """Return how many processes the kernel has ended on this machine, since it started, for want of memory."""
    for line in Path("/proc/vmstat").read_text(encoding="ascii").splitlines():
        if line.startswith("oom_kill "):
            return int(line.split()[1])
    return 0


def failed(job: Job, reason: str) -> str:
    """Return a notebook whose test cells are all flagged with a reason."""
    notebook = unpack(job.notebook)
    for cell in _fail(notebook, "GraderError", f"a person will look at this cell: {reason}"):
        cell.metadata[REVIEW] = reason
    notebook.metadata["grading"] = {**job.record(), "seconds": 0.0}
    return pack(notebook)


def unexecuted(job: Job) -> str:
    """Return a notebook in whose place nothing was handed in that could be executed: each test cell says so."""
    notebook = unpack(job.notebook)
    _fail(notebook, "NothingHandedIn", job.nothing)
    notebook.metadata["grading"] = {**job.record(), "seconds": 0.0}
    return pack(notebook)


def _fail(notebook: NotebookNode, name: str, text: str) -> list[NotebookNode]:
    """Give the test cells of a notebook an error, and return them."""
    from .outputs import error  # noqa: PLC0415

    cells = [cell for cell in notebook.cells if cell.cell_type == "code" and role_of(cell) == "test"]
    for cell in cells:
        cell.outputs = [error(name, text)]
    return cells


def serve(source: IO[bytes], sink: IO[bytes]) -> None:
    """Execute jobs from one pipe and write results to another, until the first one ends."""
    while header := source.read(4):
        job = pickle.loads(source.read(*struct.unpack(">I", header)))  # noqa: S301  (from our own parent process)
        try:
            kind, text = b"+", execute(job)
        except SandboxError as error:
            kind, text = b"-", str(error)
        body = kind + text.encode()
        sink.write(struct.pack(">I", len(body)) + body)
        sink.flush()


class _Process:
    """A process that executes jobs; started again where it died."""

    def __init__(self) -> None:
        self.process: subprocess.Popen[bytes] | None = None
        self.stopped = False

    def execute(self, job: Job) -> str:
        """Execute a job; where the process dies meanwhile, once more."""
        for _ in range(ATTEMPTS):
            try:
                return self._once(job)
            except (EOFError, BrokenPipeError):
                self.close()
                if self.stopped:
                    break
        return failed(job, "the grader's process died while this notebook ran")

    def _once(self, job: Job) -> str:
        process = self.process = self.process or self._start()
        data = pickle.dumps(job)
        process.stdin.write(struct.pack(">I", len(data)) + data)
        process.stdin.flush()
        wall = Limits.from_list(list(job.limits)).wall(job.limits[2])
        watchdog = threading.Timer(6 * wall + 300, process.kill)
        watchdog.start()
        try:
            header = process.stdout.read(4)
            if len(header) < 4:
                raise EOFError
            (length,) = struct.unpack(">I", header)
            body = process.stdout.read(length)
            if len(body) < length:
                raise EOFError
        except ValueError as error:  # the pool was left meanwhile, and its pipes are closed
            raise EOFError from error
        finally:
            watchdog.cancel()
        if body[:1] == b"-":
            raise SandboxError(body[1:].decode())
        return body[1:].decode()

    def _start(self) -> subprocess.Popen[bytes]:
        threads = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
        told = {"NBGRADER_EXECUTION": "autograde"}  # test cells may ask for it, as under stock nbgrader
        return subprocess.Popen(
            [sys.executable, "-m", "autograder.pool_process"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, env={**os.environ, **threads, **told},
        )  # fmt: skip

    def close(self) -> None:
        """End the process and, with it, its sandbox."""
        if self.process is None:
            return
        process, self.process = self.process, None
        try:
            process.stdin.close()
            process.wait(10)
        except (OSError, subprocess.TimeoutExpired):
            process.kill()
            process.wait()
        process.stdout.close()


class Pool:
    """Processes that execute jobs; a context manager.

    Parameters
    ----------
    processes : int
        How many; `size` afterwards.
    """

    def __init__(self, processes: int) -> None:
        self.size = processes
        self._threads = ThreadPoolExecutor(processes, thread_name_prefix="grading")
        self._own = threading.local()
        self._all: list[_Process] = []

    def __enter__(self) -> Pool:  # noqa: PYI034
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._threads.shutdown(wait=kind is None, cancel_futures=True)
        for process in self._all:
            process.stopped = True
            if kind is not None and process.process is not None:
                process.process.kill()
            process.close()

    def submit(self, job: Job) -> Future[str]:
        """Execute a job in some process.

        Parameters
        ----------
        job : Job
            What to execute.

        Returns
        -------
        concurrent.futures.Future of str
            The executed notebook, as `pack` writes it. Its exception is `SandboxError` where no sandbox can be had.
        """
        return self._threads.submit(self._execute, job)

    def _execute(self, job: Job) -> str:
        if not hasattr(self._own, "process"):
            self._own.process = _Process()
            self._all.append(self._own.process)
        return self._own.process.execute(job)
