"""The built book, for the tests beside this file."""

import subprocess
import sys
from pathlib import Path

import pytest
from browser.browser import locked

ROOT = Path(__file__).resolve().parents[2]
HTML = ROOT / "_build" / "html"
SOURCES = ["book", "src", "notebooks", "_config.yml", "_toc.yml", "build/vendor"]


def _newest(*paths):
    """Return the time of the latest change among files and all files of folders."""
    files = [f for p in paths for f in ([p] if p.is_file() else p.rglob("*")) if f.is_file()]
    return max(f.stat().st_mtime for f in files if "__pycache__" not in f.parts)


@pytest.fixture(scope="session")
def html(tmp_path_factory):
    """Give the folder of the built book, built with the stock command if a source is newer than it."""
    with locked(tmp_path_factory, "book"):
        done = HTML / "search.html"
        if not done.is_file() or done.stat().st_mtime < _newest(*(ROOT / source for source in SOURCES)):
            command = [
                Path(sys.executable).with_name("jupyter-book"),
                "build",
                "-W",
                "-n",
                "--keep-going",
                ".",
            ]
            run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
            if run.returncode:
                pytest.fail(
                    f"the book does not build:\n{run.stdout[-3000:]}\n{run.stderr[-3000:]}", pytrace=False
                )
    return HTML
