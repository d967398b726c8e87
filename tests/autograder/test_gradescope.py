"""The script for Gradescope that stands in the instructor guide, run in a scratch tree of the same shape."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from temporary_course import NOTEBOOK, Course, environment

GUIDE = Path(__file__).resolve().parents[2] / "book" / "instructor-guide.md"
# What Gradescope's documentation lists.
OF_RESULTS = {
    "score", "execution_time", "output", "output_format", "test_output_format", "test_name_format", "visibility",
    "stdout_visibility", "extra_data", "tests", "leaderboard",
}  # fmt: skip
OF_TESTS = {
    "score", "max_score", "status", "name", "name_format", "number", "output", "output_format", "tags",
    "visibility", "extra_data",
}  # fmt: skip
FORMATS, SEEN = (
    {"text", "html", "simple_format", "md", "ansi"},
    {"hidden", "after_due_date", "after_published", "visible"},
)


def scripts():
    """Return the two scripts of the guide."""
    return re.findall(r"^```bash\n(#!.*?)^```$", GUIDE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    """Lay out a tree as Gradescope does, a course in its folder of sources, and return how the script ends there."""
    root = tmp_path_factory.mktemp("gradescope") / "autograder"
    course = Course.create(root / "source")
    course.submit("student", square="def square(x):\n    return 2 * x")
    (root / "submission").mkdir()
    (root / "results").mkdir()
    shutil.move(course.folder("student") / f"{NOTEBOOK}.ipynb", root / "submission")
    python = root / "source" / ".venv" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    python.chmod(0o755)
    _, script = scripts()
    path = root / "run_autograder"
    path.write_text(script.replace("/autograder/", f"{root}/"))
    path.chmod(0o755)

    def run():
        return subprocess.run(
            [path], cwd="/", env=environment(), capture_output=True, text=True, timeout=180, check=False
        )

    return root, run


def test_the_script_of_the_guide_writes_valid_results(machine):
    """What it writes has the fields that Gradescope knows, with values that it knows, and the right score."""
    root, run = machine
    done = run()
    assert done.returncode == 0, done.stderr
    results = json.loads((root / "results" / "results.json").read_text(encoding="utf-8"))
    assert results.keys() <= OF_RESULTS
    assert results["score"] == 3
    assert {results["output_format"], results["test_output_format"], results["test_name_format"]} <= FORMATS
    assert {results["visibility"], results["stdout_visibility"]} <= SEEN
    assert [test["name"] for test in results["tests"]] == ["square-test", "cube-test", "why"]
    for test in results["tests"]:
        assert test.keys() <= OF_TESTS
        assert test.get("status", "passed") in {"passed", "failed"}
        assert test["output_format"] in FORMATS
        assert test["visibility"] in SEEN
        assert ("score" in test) == ("max_score" in test) == ("status" in test)
    assert sum(test.get("score", 0) for test in results["tests"]) == results["score"]


def test_without_a_notebook_there_are_no_results(machine):
    """Nothing handed in ends in an error that names it, and no results that could count as points."""
    root, run = machine
    (root / "results" / "results.json").unlink(missing_ok=True)
    (handed_in,) = (root / "submission").iterdir()
    handed_in.unlink()
    done = run()
    assert done.returncode != 0
    assert "expected a notebook, got no such file or directory" in done.stderr
    assert not list((root / "results").iterdir())


def test_the_set_up_of_the_guide_names_what_is_there():
    """The other script calls files of the repository, with parts that they know."""
    setup, _ = scripts()
    root = GUIDE.parents[1]
    assert re.findall(r"tools/\S+", setup) == ["tools/setup.sh", "tools/notebooks.py"]
    assert all((root / name).is_file() for name in re.findall(r"tools/\S+", setup))
    assert "tools/setup.sh [system] [python] [vendor]" in (root / "tools" / "setup.sh").read_text(
        encoding="utf-8"
    )
    assert subprocess.run(["bash", "-n"], input=setup, text=True, check=False).returncode == 0
