"""Run `visit.mjs`: open pages in Chromium and say what happened. Its header documents jobs and reports."""

import fcntl
import json
import os
import shutil
import subprocess
from contextlib import contextmanager
from pathlib import Path

SCRIPT = Path(__file__).with_name("visit.mjs")


def visit(visits, parallel=2, timeout=600):
    """Open pages and return their reports, in order.

    A missing browser or Node.js is a failure, never a reason to skip: the promises of the book and the grader
    are about what a browser shows.

    Parameters
    ----------
    visits : list of dict
        As in the header of `visit.mjs`.
    parallel : int
        Pages open at a time.
    timeout : float
        Limit for all of them [s].

    Returns
    -------
    list of dict
        One report for each visit, or for each of its views.

    Raises
    ------
    RuntimeError
        If Chromium or Node.js is missing, or the browser did not do its work.
    """
    chromium, node = shutil.which("chromium"), shutil.which("node")
    for name, found in (("chromium", chromium), ("node", node)):
        if found is None:
            raise RuntimeError(f"{name} is not on the path; `make setup` installs it")
    job = json.dumps({"chromium": chromium, "visits": visits, "parallel": parallel})
    done = subprocess.run(
        [node, str(SCRIPT)], input=job, capture_output=True, text=True, timeout=timeout, check=False
    )
    if done.returncode:
        raise RuntimeError(f"the browser failed: {done.stderr.strip()}")
    return json.loads(done.stdout)["visits"]


@contextmanager
def locked(tmp_path_factory, name):
    """Give a folder that the parallel processes of one test run share, to one of them at a time.

    Parameters
    ----------
    tmp_path_factory : pytest.TempPathFactory
        Of the test session.
    name : str
        What the folder is for.

    Yields
    ------
    pathlib.Path
        The folder; new in each test run.
    """
    run = os.environ.get("PYTEST_XDIST_TESTRUNUID")
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if run else base) / f"shared-{name}"
    folder.mkdir(exist_ok=True)
    with (folder / ".lock").open("w") as handle:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield folder
