"""Stock nbgrader commands in a course elsewhere: two lines of configuration isolate them."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import nbgrader.apps.api
import nbgrader.apps.autogradeapp
import pytest
from temporary_course import ASSIGNMENT, GRADED, HIDDEN, Course
from traitlets.config import Config

from autograder.parallel import ParallelAutograde
from autograder.plugin import AUTOGRADE, SANITIZE, configure

SECRET = "what only the grader knows"  # noqa: S105  (of this test)
SCRIPT = "<script>document.title = 'stolen'</script><img src=x onerror=\"document.title = 'stolen'\">"
LOOK = """
import os
from pathlib import Path
seen = [dict(os.environ)]
for path in {paths!r}:
    try:
        seen.append(Path(path).read_bytes()[:200000])
    except OSError as error:
        print(type(error).__name__)
for name in ("environ", "cmdline", "mem"):
    for pid in ("self", "1", str(os.getppid())):
        try:
            seen.append(Path("/proc", pid, name).read_bytes()[:200000])
        except OSError as error:
            pass
found = repr(seen)
print("secret", {secret!r}[::-1] in found, "hidden", {hidden!r}[::-1] in found)
try:
    import roboloc_reference
    print("reference")
except ImportError:
    print("no reference")
"""


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """Make a course with an honest student and one who looks around, and grade it with the stock command."""
    made = Course.create(tmp_path_factory.mktemp("plugin") / "course")
    (made.root / "notes.txt").write_text(SECRET, encoding="utf-8")
    paths = [
        str(made.root / name) for name in ("notes.txt", "gradebook.db", f"source/{ASSIGNMENT}/powers.ipynb")
    ]
    look = LOOK.format(paths=paths, secret=SECRET[::-1], hidden=HIDDEN[0][::-1])
    made.submit("honest")
    made.submit("looker", square="def square(x):\n    return 1", more=[look], why=f"Because.\n\n{SCRIPT}")
    return made


@pytest.fixture(scope="module")
def graded(course):
    """Run `nbgrader autograde` with a secret in its environment."""
    course.nbgrader("autograde", ASSIGNMENT, GRADER_SECRET=SECRET)
    return course


def printed(notebook):
    """Return what the cells of a notebook printed."""
    return "".join(o.text for c in notebook.cells for o in c.get("outputs", ()) if o.output_type == "stream")


def test_two_lines_isolate_the_stock_command(graded):
    """A submission that reads the grader's environment, files, processes and reference gets nothing."""
    said = printed(graded.graded("looker"))
    assert "secret False hidden False" in said
    assert "no reference" in said
    assert said.count("FileNotFoundError") == 3
    assert SECRET not in graded.folder("looker", "autograded").joinpath("powers.ipynb").read_text("utf-8")


def test_scores_of_the_stock_command(graded):
    """Both students have a row for every graded cell, and the written answers wait for a person."""
    rows = graded.rows()
    assert rows["honest"] == {"square-test": (2, False), "cube-test": (3, False), "why": (None, True)}
    assert rows["looker"] == {"square-test": (0, False), "cube-test": (3, False), "why": (None, True)}
    assert all(set(row) == set(GRADED) for row in rows.values())


def test_trust_is_an_explicit_way_back(course, graded, tmp_path):
    """With trust_submissions nbgrader's own Execute runs the same notebooks to the same scores; the looker sees all."""
    trusting = course.copy(tmp_path / "trusting")
    shutil.rmtree(trusting.root / "autograded")
    before = trusting.rows()
    looked = trusting.folder("looker") / "powers.ipynb"
    looked.write_text(
        looked.read_text("utf-8").replace(str(course.root), str(trusting.root)), encoding="utf-8"
    )
    trusting.nbgrader(
        "autograde", ASSIGNMENT, "--IsolatedExecute.trust_submissions=True", GRADER_SECRET=SECRET
    )
    assert trusting.rows() == before
    said = printed(trusting.graded("looker"))
    assert "secret True hidden True" in said
    assert "FileNotFoundError" not in said


def test_missing_bubblewrap_refuses(course, graded, tmp_path):
    """Without bubblewrap the command fails with one message that names the remedy, and no cell gets a score."""
    bare = course.copy(tmp_path / "bare")
    shutil.rmtree(bare.root / "autograded")
    (bare.root / "gradebook.db").unlink()
    with bare.api() as api:
        assert api.generate_assignment(ASSIGNMENT, force=True)["success"]
    commands = tmp_path / "commands"
    commands.mkdir()
    (commands / "alembic").symlink_to(Path(sys.executable).parent / "alembic")
    done = bare.nbgrader("autograde", ASSIGNMENT, check=False, PATH=str(commands))
    assert done.returncode != 0
    assert done.stderr.count("apt-get install bubblewrap") == 1
    assert "trust_submissions=True grades WITHOUT protection" in done.stderr
    assert "Traceback" not in done.stderr
    assert bare.rows() == {}
    assert not (bare.root / "autograded").exists()


def feedback(course, student="looker"):
    """Make feedback anew and return the page."""
    with course.api() as api:
        result = api.generate_feedback(ASSIGNMENT, student, force=True)
    assert result["success"], result.get("log")
    return (course.folder(student, "feedback") / "powers.html").read_text(encoding="utf-8")


def scripts(page):
    """Return the traces of the submission's script that a browser would run."""
    return [
        trace
        for trace in ("<script>document.title", '<img src="x" onerror', "<img src=x onerror")
        if trace in page
    ]


def test_feedback_hides_tests_and_runs_no_script(graded):
    """Feedback names the failed hidden test and nothing in it; a script in a written answer is gone."""
    page = feedback(graded)
    assert "a hidden test failed" in page
    assert "hidden tests" in page
    assert not [secret for secret in HIDDEN if secret in page]
    assert not scripts(page)
    with graded.api() as api:
        del api.config.HTMLExporter["filters"]  # what is left is nbconvert's own sanitize_html
        assert api.generate_feedback(ASSIGNMENT, "looker", force=True)["success"]
    assert scripts((graded.folder("looker", "feedback") / "powers.html").read_text(encoding="utf-8"))


def test_configure_replaces_execution_wherever_nbgrader_looks():
    """The command line, the formgrader and the programming interface all get our grader; Execute is nowhere."""
    config = Config()
    configure(config)
    assert nbgrader.apps.api.Autograde is nbgrader.apps.autogradeapp.Autograde is ParallelAutograde
    steps = [kind.__name__ for kind in config.Autograde.autograde_preprocessors]
    assert steps == [name.rpartition(".")[2] for name in AUTOGRADE]
    assert "Execute" not in steps
    assert steps.index("FlagForReview") > steps.index("SaveGrades")
    sanitizing = [kind.__name__ for kind in config.Autograde.sanitize_preprocessors]
    assert sanitizing == [name.rpartition(".")[2] for name in SANITIZE]
