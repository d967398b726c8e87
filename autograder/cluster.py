"""Executing notebooks on the workers of a Dask scheduler, on this machine or on others.

What crosses is what crosses to a process of the pool: a `pool.Job` out, an executed notebook back, both as bytes. A
worker gives each job to a pool of its own, so a notebook is isolated there exactly as it is here. The course secret
travels in the job. A worker that is not installed as the grader is, refuses.

A worker that dies is none of the notebook's business: the scheduler hands what it had to others, as often as its
`allowed-failures` says. It cannot tell which of a worker's notebooks was at fault, so one that comes to the end of that
is tried again while nothing else is under way; where workers die then too, its test cells say so and wait for a person.
"""

from __future__ import annotations

import functools
import pickle
import threading
import time
from collections import deque
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

import dask
from dask.utils import parse_timedelta
from distributed import Client, KilledWorker, get_worker
from distributed.exceptions import WorkerStartTimeoutError

from .pool import Job, Pool, failed
from .provenance import installation
from .sandbox import SandboxError
from .secret import course_secret

PATIENCE = "60s"  # without any worker, where Dask's own setting says nothing
LOOK = 1.0  # seconds between two looks at which workers there are


class ClusterError(SandboxError):
    """There is no scheduler, it has no workers, or they are not fit to grade."""


# ---------------------------------------------------------------- on a worker


@functools.cache
def _pool() -> Pool:
    return Pool(get_worker().state.nthreads)


def execute(data: bytes, expected: dict[str, str]) -> bytes:
    """Execute a job on a worker, in a process of the worker's pool.

    Parameters
    ----------
    data : bytes
        A pickled `pool.Job`.
    expected : dict of str to str
        What the grader is installed as; see `provenance.installation`.

    Returns
    -------
    bytes
        ``b"+"`` and the executed notebook, or ``b"-"`` and why this worker cannot execute any. It raises nothing: Dask
        would write the arguments into the worker's log.
    """
    try:
        job = pickle.loads(data)  # noqa: S301  (from our own grader)
        here = installation(job.packages)
        if here == expected:
            hidden = (str(Path.cwd().resolve()), str(Path(__file__).resolve().parents[1]))
            return b"+" + _pool().submit(replace(job, hidden=hidden)).result().encode()
        problem = f"it is not installed as the grader is: {_difference(here, expected)}"
    except Exception as error:  # noqa: BLE001
        problem = str(error) if isinstance(error, SandboxError) else f"{type(error).__name__}: {error}"
    return f"-the worker {get_worker().address} does not grade: {problem}".encode()


def _difference(here: dict[str, str], expected: dict[str, str]) -> str:
    names = [name for name in sorted(here | expected) if here.get(name) != expected.get(name)]
    return "; ".join(f"{name} {here.get(name, 'none')}, not {expected.get(name, 'none')}" for name in names)


# ---------------------------------------------------------------- at the grader


@dataclass
class _Item:
    """A job, who waits for it, and whether nothing may run beside it."""

    job: Job
    future: Future[str] = field(default_factory=Future)
    alone: bool = False


class ClusterPool:
    """Workers of a scheduler that execute jobs; a context manager with the methods of `pool.Pool`.

    Parameters
    ----------
    scheduler : str
        Its address, such as ``tcp://10.0.0.5:8786``; all else is Dask's own configuration.

    Attributes
    ----------
    size : int
        How many jobs the workers execute at a time, at the last look.

    Raises
    ------
    ClusterError
        If there is no scheduler, or no worker in time.
    """

    def __init__(self, scheduler: str) -> None:
        self.scheduler, self.size = scheduler, 1
        setting = dask.config.get("distributed.scheduler.no-workers-timeout", None) or PATIENCE
        self._patience = parse_timedelta(setting)
        self._secret = course_secret()
        # All below belongs to the thread, which takes jobs, finished tasks and, to end, None.
        self._events: SimpleQueue[Any] = SimpleQueue()
        self._waiting: deque[_Item] = deque()
        self._suspects: deque[_Item] = deque()
        self._running: dict[Any, _Item] = {}
        self._lost: ClusterError | None = None
        self._seen = self._looked = time.monotonic()
        self._client = None
        try:
            self._client = Client(scheduler, set_as_default=False)
            self._client.wait_for_workers(1, timeout=self._patience)
            self._look()
        except WorkerStartTimeoutError as error:
            self._close()
            raise self._nobody() from error
        except Exception as error:
            self._close()
            raise ClusterError(f"no scheduler at {scheduler}: {type(error).__name__}: {error}") from error
        self._thread = threading.Thread(target=self._serve, name="cluster", daemon=True)
        self._thread.start()

    def __enter__(self) -> ClusterPool:  # noqa: PYI034
        return self

    def __exit__(self, *_: object) -> None:
        self._events.put(None)
        self._thread.join()
        self._close()

    def _close(self) -> None:
        if self._client is not None:
            with suppress(Exception):  # of a scheduler that is gone
                self._client.close()

    def submit(self, job: Job) -> Future[str]:
        """Execute a job on some worker; see `pool.Pool.submit`."""
        item = _Item(job)
        item.future.set_running_or_notify_cancel()
        self._events.put(item)
        return item.future

    def _serve(self) -> None:
        """Hand jobs to the workers, and results to who waits for them."""
        while True:
            try:
                event = self._events.get(timeout=LOOK)
            except Empty:
                event = LOOK
            if event is None:
                break
            try:
                if isinstance(event, _Item):
                    self._waiting.append(event)
                elif event in self._running:
                    self._settle(event)
                if time.monotonic() - self._looked > LOOK:
                    self._look()
                self._feed()
            except Exception as error:  # noqa: BLE001  (whatever it is, nobody may wait for ever)
                self._give_up(self._error(error))
        if self._running:
            with suppress(Exception):
                self._client.cancel(list(self._running), force=True)

    def _look(self) -> None:
        """See which workers there are."""
        now = self._looked = time.monotonic()
        if threads := sum(self._client.nthreads().values()):
            self._seen, self.size = now, threads
        elif now - self._seen > self._patience:
            raise self._nobody()

    def _feed(self) -> None:
        """Hand out as many jobs as are executed at a time, so that a worker which dies has no others with it."""
        if self._lost:
            self._give_up(self._lost)
        if any(item.alone for item in self._running.values()):
            return
        while self._waiting and len(self._running) < self.size:
            self._start(self._waiting.popleft())
        if self._suspects and not self._running:
            self._start(replace(self._suspects.popleft(), alone=True))

    def _start(self, item: _Item) -> None:
        data = pickle.dumps(replace(item.job, secret=self._secret))
        # pure=False: a name without meaning, so the scheduler's page and logs say nothing of a student.
        task = self._client.submit(execute, data, installation(item.job.packages), pure=False)
        self._running[task] = item
        task.add_done_callback(self._events.put)

    def _settle(self, task: Any) -> None:
        item = self._running[task]
        try:
            answer = task.result()
        except KilledWorker as error:
            if item.alone:
                reason = (
                    f"{error.allowed_failures + 1} workers died while they had this notebook and no other"
                )
                item.future.set_result(failed(item.job, reason))
            else:
                self._suspects.append(item)
        else:
            text = answer[1:].decode()
            if answer[:1] != b"+":
                raise ClusterError(text)
            item.future.set_result(text)
        del self._running[task]

    def _nobody(self) -> ClusterError:
        return ClusterError(f"no workers at {self.scheduler} for {self._patience:g} s")

    def _error(self, error: Exception) -> ClusterError:
        """Say in one line why no notebook can be graded any more."""
        if isinstance(error, ClusterError):
            return error
        if isinstance(error, (CancelledError, OSError)):
            return ClusterError(f"the scheduler {self.scheduler} is lost")
        return ClusterError(f"{self.scheduler}: {type(error).__name__}: {error}")

    def _give_up(self, error: ClusterError) -> None:
        """Let nobody wait: with one reason, now and later."""
        self._lost = error
        for item in [*self._running.values(), *self._waiting, *self._suspects]:
            item.future.set_exception(error)
        self._running.clear()
        self._waiting.clear()
        self._suspects.clear()
