"""What an assistant is shown of a grade, and nobody else."""

from __future__ import annotations

import re

import nbformat
import numpy as np
import pytest
from nbformat.v4 import new_code_cell, new_notebook, new_output
from temporary_course import NOTEBOOK, Course, cell, hidden, solution

from autograder.check import run_stage
from autograder.checks import EXPRESSIONS, STAGES
from autograder.explain import details
from autograder.feedback import LeakFreeFeedback
from autograder.grading import grade, grading_run
from autograder.report import Report
from autograder.roles import EXPLANATION
from autograder.standalone import grade_files

SECRET = "a course"  # noqa: S105  (of this test)
DYNAMICS = STAGES["motion.compute_dynamics"]


def explained(stage, function, points=10.0):
    """Return the explanation of a stage's report."""
    outcome = run_stage(stage, function, SECRET)
    return outcome, Report(outcome, (), points, points * outcome.share).explanation()


def zeroed(xvec, u, dt):
    """Have no derivative by omega, in slow turns alone."""
    g, Gx, Gu = DYNAMICS.reference(xvec, u, dt)
    if abs(u[1]) < 1e-3:
        Gu[:2, 1] = 0.0
    return g, Gx, Gu


def test_the_points_of_the_checks_add_up():
    """Each check has its share of the points, and the passed ones together the score."""
    outcome, text = explained(DYNAMICS, zeroed)
    found = re.findall(r"^  (passed|failed)  .*\n +([\d.]+) points?, (\d+) calls?$", text, re.MULTILINE)
    assert len(found) == len(DYNAMICS.checks)
    assert sum(float(points) for _, points, _ in found) == pytest.approx(10.0)
    passed = sum(float(points) for word, points, _ in found if word == "passed")
    assert passed == pytest.approx(10.0 * outcome.share)
    assert 0 < passed < 10
    assert sum(int(calls) for *_, calls in found) == len(outcome.calls) > 20


def test_the_first_call_at_fault_is_shown():
    """Of a failed check the arguments are shown, what is right and what came back, and only what is off."""
    outcome, _ = explained(DYNAMICS, zeroed)
    (failed, *_) = outcome.failed
    _, where, *lines = details(outcome, failed, 10.0)
    assert where == f"Call 1 of {len(failed.calls)}, the first at fault:"
    call = failed.calls[0]
    assert [line.split(" = ")[0].strip() for line in lines[:3]] == ["xvec", "u", "dt"]
    assert f"{call.args[1][0]:.6g}, {call.args[1][1]:.6g}" in lines[1]
    right = np.asarray(DYNAMICS.reference(*call.args)[2])
    assert len(lines) == 5
    assert lines[3].startswith("  Gu expected ")
    assert f"{right[0, 1]:.6g}" in lines[3]
    assert lines[4].startswith("  Gu got ")
    assert f"{right[0, 1]:.6g}" not in lines[4]


def test_a_call_that_raised_or_changed_its_argument_is_named():
    """An error has its kind, a changed argument its name; what a repeated call gives anew is that call's."""

    def raises(xvec, u, dt):
        raise KeyError("text of a submission's")

    _, text = explained(DYNAMICS, raises)
    assert "raised KeyError" in text
    assert "text of a submission's" not in text

    def writes(xvec, u, dt):
        right = DYNAMICS.reference(xvec, u, dt)
        xvec += 1.0
        return right

    _, text = explained(DYNAMICS, writes)
    assert "changed its argument xvec" in text
    calls, last = [], len(explained(DYNAMICS, DYNAMICS.reference)[0].calls)

    def remembers(xvec, u, dt):
        calls.append(1)
        g, Gx, Gu = DYNAMICS.reference(xvec, u, dt)
        return g + (len(calls) == last), Gx, Gu

    outcome, text = explained(DYNAMICS, remembers)
    assert [result.check.name for result in outcome.failed] == ["same call, same result"]
    assert "the first at fault:" in text


def test_a_long_value_is_cut():
    """What a submission returns takes a line, however much it is and whatever it is."""
    _, text = explained(DYNAMICS, lambda *_: ("x\n" * 10_000, None, object))
    assert "got      ('x\\nx" in text
    assert max(map(len, text.splitlines())) < 800


def test_symbolic_answers_are_explained():
    """The values of the symbols are shown, and the value of the answer."""
    expression = next(iter(EXPRESSIONS.values()))
    outcome, text = explained(expression.stage(), lambda values: expression.value(values) + 1.0, 2.0)
    assert not outcome.share
    assert "Call 1 of 6, the first at fault:" in text
    assert " got " in text


def test_only_who_asks_is_shown_it():
    """A report has the explanation only in a run that asks for it, and feedback never has it."""
    bundles = []
    for asked in (False, True):
        with grading_run(secret=SECRET, publish=bundles.append, explain=asked):
            grade("motion.compute_dynamics", zeroed, points=10)
    plain, full = bundles
    assert plain.keys() == {"text/plain", "text/html"}
    assert {kind: full[kind] for kind in plain} == plain
    assert "expected" in full[EXPLANATION]
    meta = {"grade": True, "locked": True, "solution": False, "task": False, "grade_id": "a", "points": 10}
    for source in ("grade()", "# BEGIN HIDDEN TESTS\ngrade()\n# END HIDDEN TESTS"):
        output = new_output("display_data", data=dict(full))
        made = new_code_cell(source, outputs=[output], metadata={"nbgrader": meta | {"schema_version": 3}})
        shown, _ = LeakFreeFeedback().preprocess(new_notebook(cells=[made]), {})
        assert shown.cells[0].outputs[0].data == plain


def test_a_notebook_is_explained(tmp_path):
    """Where it is asked for, a stage's hidden calls are told, and the text of another course's hidden assertion."""
    test = {"grade": True, "locked": True, "points": 2}
    call = "from autograder import grade\ngrade('motion.compute_dynamics', compute_dynamics, points=2)"
    cells = [
        cell(new_code_cell, solution("def compute_dynamics(xvec, u, dt):\n    pass"), "a", solution=True),
        cell(new_code_cell, hidden(call), "stage-test", **test),
        cell(
            new_code_cell, hidden("assert compute_dynamics(1, 2, 3), 'seen at 1, 2, 3'"), "plain-test", **test
        ),
    ]
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    course = Course.create(tmp_path / "course", new_notebook(cells=cells, metadata=kernel))
    notebook = course.released()
    notebook.cells[0].source = "def compute_dynamics(xvec, u, dt):\n    pass"
    course.submit_file("wrong", nbformat.writes(notebook))
    file = str(course.folder("wrong") / f"{NOTEBOOK}.ipynb")
    for explain in (True, False):
        (grade,) = grade_files([file], root=course.root, explain=explain)
        stage, plain = grade.cells
        assert (stage.score, plain.score) == (0, 0)
        assert ("g got      None" in stage.explanation) == explain
        assert ("seen at 1, 2, 3" in plain.explanation) == explain
        assert "expected" not in stage.report.replace("expected g, Gx, Gu", "")
        assert "seen" not in plain.report
