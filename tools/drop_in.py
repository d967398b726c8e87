"""nbgrader's own tests of `nbgrader autograde`, run with our plug-in in between.

nbgrader ships its tests. They know nothing of us: a folder on `JUPYTER_CONFIG_PATH` holds an `nbgrader_config.py` with
the two lines that turn the plug-in on, and every command of every test reads it. What then fails must stand in
`DEVIATIONS`, with the reason, and what stands there must fail.

Usage: ``python tools/drop_in.py [TEST...]``, the names of tests; all if none is given. It takes some minutes.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

if TYPE_CHECKING:
    from collections.abc import Sequence

MODULE = "nbgrader.tests.apps.test_nbgrader_autograde"
TWO_LINES = "from autograder.plugin import configure\nconfigure(get_config())\n"
REPAIRED = "What was handed in is brought into the shape of the release and graded; stock nbgrader stops with an error."
PYTHON = "Cells run in the sandbox's Python; a kernel that a file names is not started, nor missed."
DEVIATIONS = {
    "test_handle_failure": REPAIRED,
    "test_handle_failure_single_notebook": REPAIRED,
    "test_missing_source_kernelspec": PYTHON,
    "test_incorrect_source_kernelspec": PYTHON,
    "test_no_execute": "--no-execute is not followed: what a student wrote as the output of a test would be the score.",
    "test_missing_files": "A folder without a notebook is a submission: it gets its rows, 0 with the reason.",
    "test_grade_missing_notebook": "A notebook that was not handed in is made from the release, says so, and scores 0.",
    "test_autograde_timeout": "Limits are of processor time, and IsolatedExecute's: Execute.timeout does nothing.",
    "test_side_effects": "A file that a submission writes is gone with its sandbox; stock nbgrader leaves it beside "
    "the graded notebook, where the next run, or a person, finds it.",
}


WHOLE_FILES = "It compares whole files, and ours hold the seconds that grading took."
UNSTEADY = {  # deviations that show in some runs only
    "test_force_single_notebook": WHOLE_FILES,
    "test_update_newer_single_notebook": WHOLE_FILES,
}


def run(tests: Sequence[str]) -> dict[str, bool]:
    """Run tests of nbgrader's; return which of them passed.

    Parameters
    ----------
    tests : sequence of str
        Their names; all if there is none.

    Raises
    ------
    RuntimeError
        If pytest could not do its work.
    """
    with tempfile.TemporaryDirectory(prefix="drop-in-") as name:
        folder = Path(name)
        (folder / "config").mkdir()
        (folder / "config" / "nbgrader_config.py").write_text(TWO_LINES, encoding="utf-8")
        home = {
            "JUPYTER_CONFIG_PATH": str(folder / "config"),
            "JUPYTER_CONFIG_DIR": str(folder / "none"),
            "PYTHONDONTWRITEBYTECODE": "1",
            "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)]),
        }
        report = folder / "report.xml"
        done = subprocess.run(
            [
                sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-c", os.devnull,
                f"--junitxml={report}", "--pyargs", MODULE, *(["-k", " or ".join(tests)] if tests else []),
            ],
            cwd=folder, env=os.environ | home, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
        if done.returncode > 1 or not report.exists():
            raise RuntimeError(f"nbgrader's tests did not run:\n{done.stdout[-3000:]}")
        cases = ET.parse(report).iter("testcase")  # noqa: S314  (of our own pytest)
        return {
            case.get("name"): case.find("failure") is None and case.find("error") is None
            for case in cases
            if case.find("skipped") is None
        }


def faults(passed: dict[str, bool]) -> list[str]:
    """Say where the results and the list of deviations do not agree.

    Parameters
    ----------
    passed : dict of str to bool
        See `run`.

    Returns
    -------
    list of str
        Sentences; none if all is as it should be.
    """
    return [
        f"{name}: {'is listed as a deviation, and passes' if well else 'fails, and is no known deviation'}"
        for name, well in passed.items()
        if name not in UNSTEADY and well == (name in DEVIATIONS)
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return 1 where results and list do not agree."""
    parser = argparse.ArgumentParser(description="Run nbgrader's own tests of autograding with our plug-in.")
    parser.add_argument("tests", nargs="*", metavar="TEST", help="names of tests (default: all)")
    passed = run(parser.parse_args(arguments).tests)
    for name, reason in (DEVIATIONS | UNSTEADY).items():
        if name in passed:
            print(f"{name}: {reason}")
    wrong = faults(passed)
    print(*wrong, f"{len(passed)} tests of nbgrader's, {sum(passed.values())} passed.", sep="\n")
    return 1 if wrong or not passed else 0


if __name__ == "__main__":
    sys.exit(main())
