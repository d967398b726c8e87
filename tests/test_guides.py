"""What the guides of the book show is what the project says and does."""

import re
from dataclasses import asdict
from pathlib import Path

import pytest
from nbgrader.apps.nbgraderapp import NbGraderApp
from traitlets.config import Config
from traitlets.utils.importstring import import_item

from autograder.grading import grade, grading_run
from autograder.misconceptions.motion_model import heading_frozen
from autograder.sandbox import REMEDY
from autograder.worker.limits import Limits

ROOT = Path(__file__).resolve().parents[1]
STUDENT, INSTRUCTOR = (
    (ROOT / "book" / f"{name}-guide.md").read_text(encoding="utf-8") for name in ("student", "instructor")
)


def blocks(text, language):
    """Return the fenced blocks of a language, without indentation."""
    found = re.findall(rf"^( *)```{language}\n(.*?)^ *```$", text, re.MULTILINE | re.DOTALL)
    return [re.sub(rf"^{indent}", "", body, flags=re.MULTILINE) for indent, body in found]


def test_example_of_feedback_is_what_the_grader_says():
    """The list that the student guide explains is, to the last word before the record, what the grader writes."""
    shown = []
    with grading_run(secret="any", run_id="3f9c52ab1d07", publish=shown.append):  # noqa: S106  (of no course)
        grade("motion.compute_dynamics", heading_frozen, 10)
    (example,) = blocks(STUDENT, "text")
    record = re.compile(
        r"Checks [0-9a-f]{12}; roboloc \S+, numpy \S+, scipy \S+, sympy \S+; run 3f9c52ab1d07"
    )
    *said, last = shown[0]["text/plain"].splitlines()
    *expected, quoted = example.splitlines()
    count = re.compile(r"about 1e-\d+|wrong in \d+ of \d+ cases")  # they go by the secret
    assert [count.sub("", line) for line in said] == [count.sub("", line) for line in expected]
    assert record.fullmatch(last)
    assert record.fullmatch(quoted)


def test_remedy_is_the_graders():
    """The refusal that the instructor guide shows is the grader's."""
    (shown,) = blocks(INSTRUCTOR, "text")
    assert shown == REMEDY.format(problem="it is not installed") + "\n"


def test_limits_are_the_graders():
    """The table of limits names every one, with what it is by default."""
    units = {"s": 1, "": 1, "MiB": 2**20, "GiB": 2**30}
    table = INSTRUCTOR.split("| `IsolatedExecute.` |")[1].split("\n\n")[0]
    shown = {}
    for names, values in re.findall(r"^\| (`.*?) \| (.*?) \|", table, re.MULTILINE):
        found = [(float(number), units[unit]) for number, unit in re.findall(r"(\d+) ?(\w*)", values)]
        shown |= dict(zip(re.findall(r"`(\w+)`", names), [n * unit for n, unit in found], strict=True))
    assert shown == asdict(Limits())


def test_settings_are_real():
    """Every line of the settings block names a class and an option that are there, with a value that they take."""
    (block,) = blocks(INSTRUCTOR, "python")
    config = Config()
    exec(block, {"c": config})  # noqa: S102  (our own page)
    homes = {
        "Exchange": "nbgrader.exchange.default.Exchange",
        "AssignLatePenalties": "nbgrader.preprocessors.AssignLatePenalties",
        "PenaltyPerDay": config.AssignLatePenalties.plugin_class,
        "ZipCollectApp": "nbgrader.apps.zipcollectapp.ZipCollectApp",
    }
    assert set(config) == set(homes)
    for name, options in config.items():
        kind = import_item(homes[name])
        assert kind.__name__ == name
        for option, value in options.items():
            made = kind(config=Config({name: {option: value}}))
            found = getattr(made, option)
            assert found == (import_item(value) if isinstance(found, type) else value)


@pytest.mark.parametrize("text", [STUDENT, INSTRUCTOR], ids=["student", "instructor"])
def test_commands_are_there(text):
    """Every `make` target and `nbgrader` command of the pages is one, and every file of the kit has our version."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    commands = "\n".join([*blocks(text, "sh"), *re.findall(r"`([^`\n]+)`", text)])
    for target in re.findall(r"^make ([a-z-]+)", commands, re.MULTILINE):
        assert f"\n{target}:" in makefile, target
    known = {name.replace("-", "_") for name in NbGraderApp.subcommands}
    for command in re.findall(r"^nbgrader ([a-z_]+)", commands, re.MULTILINE):
        assert command in known, command
    version = re.search(
        r'^version = "(.*)"', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.MULTILINE
    )[1]
    assert set(re.findall(r"roboloc-(?:notebooks-|student-)?(\d[\d.]*\d)", text)) <= {version}
