"""nbgrader's formgrader on a free port of this machine, for the browser tests of it."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

from nbgrader.api import Gradebook
from temporary_course import ASSIGNMENT, NOTEBOOK, environment

SCREENSHOTS = Path(__file__).resolve().parents[2] / "build" / "screenshots"
TOKEN = "formgrader-test"  # noqa: S105  (of a server that lives for one test)
# The first lines of a script for a page with one submission: waits until grades and comments are there.
READY = """
const pause = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));
const until = async (what) => { for (let i = 0; i < 200 && !what(); i++) await pause(50); };
await until(() => window.formgrader?.grades?.loaded && formgrader.comments?.loaded);
"""


@contextmanager
def serve(course, folder):
    """Serve a course, with nothing of this user's own configuration.

    Parameters
    ----------
    course : Course
        Of `temporary_course`.
    folder : pathlib.Path
        For configuration and log.

    Yields
    ------
    str
        The address, without a slash at its end.
    """
    variables = {f"JUPYTER_{kind}_DIR": str(folder / kind.lower()) for kind in ("CONFIG", "DATA", "RUNTIME")}
    arguments = [
        "--ip=127.0.0.1", "--port=0", "--no-browser", f"--IdentityProvider.token={TOKEN}",
        f"--ServerApp.root_dir={course.root}",
        "--ServerApp.jpserver_extensions={'nbgrader.server_extensions.formgrader': True}",
        *(["--allow-root"] if os.geteuid() == 0 else []),
    ]  # fmt: skip
    log = folder / "log"
    with log.open("w") as sink:
        process = subprocess.Popen(
            [sys.executable, "-m", "jupyter_server", *arguments],
            cwd=course.root, env=environment(**variables, HOME=str(folder)), stdin=subprocess.DEVNULL, stdout=sink,
            stderr=sink,
        )  # fmt: skip
    try:
        end = time.monotonic() + 90
        while not (found := re.search(r"http://127\.0\.0\.1:(\d+)/", log.read_text())):
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < end, log.read_text()
            time.sleep(0.1)
        yield f"http://127.0.0.1:{found[1]}"
    finally:
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
    assert "Traceback" not in log.read_text()


def submission(course, student):
    """Return the id under which the formgrader shows a notebook."""
    with Gradebook(course.db_url) as gradebook:
        return gradebook.find_submission_notebook(NOTEBOOK, ASSIGNMENT, student).id


def page(server, path, **more):
    """Describe a visit."""
    return {"url": f"{server}/login?token={TOKEN}&next=/formgrader/{path}"} | more


def local(report):
    """Return the requests of a visit that were answered by the server itself, and failed."""
    return [r for r in report["requests"] if r["failure"] and r["url"].startswith("http://127.0.0.1")]
