"""Workers of Dask whose notebooks wait where a test says so, and can be killed meanwhile."""

from __future__ import annotations

import os
import signal

from distributed import Status
from processes import children

# What workers run at their start: the notebooks of some students wait, of *kills* for ever.
TROUBLE = """
import os, pathlib, time
from autograder.pool import Pool
HERE = pathlib.Path({folder!r})
os.environ["ROBOLOC_SECRET"] = "of-the-worker"
submit = getattr(Pool, "submit_itself", Pool.submit)  # Dask loads this twice

def with_trouble(self, job):
    student = job.key.partition("/")[0]
    while student == "kills" or student == "long" and (HERE / "wait").exists():
        (HERE / f"held-{{student}}-{{os.getpid()}}").touch()
        time.sleep(0.02)
    return submit(self, job)

Pool.submit_itself, Pool.submit = submit, with_trouble
"""


class Workers:
    """Workers in processes of their own, and what they are told to do."""

    def __init__(self, folder, running=None, address=""):
        self.folder, self.running, self.address = folder, running, address
        self.preload = folder / "trouble.py"
        self.preload.write_text(TROUBLE.format(folder=str(folder)), encoding="utf-8")
        self.below = []  # what ran below the killed ones
        self.killed = {}  # student by process

    def hold(self):
        """Let the notebook of *long* wait until `go`."""
        for path in self.folder.glob("held-long-*"):
            path.unlink()
        (self.folder / "wait").touch()

    def go(self):
        """Let it go on."""
        (self.folder / "wait").unlink(missing_ok=True)

    def held(self):
        """Return student and process of the notebooks that wait in a worker."""
        found = [path.name.split("-") for path in self.folder.glob("held-*")]
        return [(student, int(pid)) for _, student, pid in found if int(pid) not in self.killed]

    def kill(self):
        """Kill the workers in which a notebook waits; their nannies, once up themselves, start them again."""
        processes = [nanny.process for nanny in self.running.workers.values() if nanny.process]
        up = [process.pid for process in processes if process.status is Status.running]
        for student, pid in self.held():
            if pid in up:
                self.killed[pid] = student
                self.below += children(pid)
                os.kill(pid, signal.SIGKILL)
                if student == "long":
                    self.go()
