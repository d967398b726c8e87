"""What a notebook may use, and the clocks that tell."""

from __future__ import annotations

import contextlib
import resource
import time
from dataclasses import asdict, dataclass, fields


@dataclass(frozen=True)
class Limits:
    """Bounds for one notebook.

    Attributes
    ----------
    call_cpu, cell_cpu, notebook_cpu : float
        Processor time of one call, one cell (all calls of a test cell together) and the notebook [s].
    wall_factor, wall_extra : float
        The wall clock may run this many times longer, plus this many seconds [s], before a process is ended.
    memory : int
        Address space of a process [bytes].
    notebook_memory : int
        What all processes of the notebook hold together [bytes]; see `autograder.memory`.
    processes : int
        Processes and threads of the notebook together.
    file_size : int
        Largest file [bytes].
    disk : int
        All files of the notebook together [bytes].
    """

    call_cpu: float = 5.0
    cell_cpu: float = 30.0
    notebook_cpu: float = 120.0
    wall_factor: float = 3.0
    wall_extra: float = 10.0
    memory: int = 4 * 1024**3
    notebook_memory: int = 4 * 1024**3
    processes: int = 128
    file_size: int = 64 * 1024**2
    disk: int = 256 * 1024**2

    def wall(self, cpu: float) -> float:
        """Return the wall time that goes with an amount of processor time [s]."""
        return self.wall_factor * cpu + self.wall_extra

    def to_list(self) -> list[float]:
        """Return the values in order, for the wire."""
        return list(asdict(self).values())

    @classmethod
    def from_list(cls, values: list[float]) -> Limits:
        """Return limits from the output of :meth:`to_list`."""
        return cls(**{field.name: value for field, value in zip(fields(cls), values, strict=True)})


def apply(limits: Limits) -> None:
    """Set the limits that the kernel keeps for each process of a notebook."""
    whole = int(limits.notebook_cpu) + 5
    for what, value in (
        (resource.RLIMIT_AS, limits.memory),
        (resource.RLIMIT_NPROC, limits.processes),
        (resource.RLIMIT_FSIZE, limits.file_size),
        (resource.RLIMIT_CPU, whole),
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_NOFILE, 128),
    ):
        _, hard = resource.getrlimit(what)
        bound = int(value) if hard == resource.RLIM_INFINITY else min(int(value), hard)
        resource.setrlimit(what, (bound, bound))


def process_cpu(pid: int) -> float | None:
    """Return the processor time another process of this namespace has used [s], None if it is gone."""
    with contextlib.suppress(OSError):
        return time.clock_gettime((~pid << 3) | 2)
    return None
