"""Feedback shows what was tested and how it went, and nothing that was hidden."""

# ruff: noqa: E501  (likewise: messages)

from __future__ import annotations

import nbformat
import pytest
from nbconvert import HTMLExporter
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

from autograder.feedback import PLACEHOLDER, LeakFreeFeedback
from autograder.repair import NOTICE
from autograder.vectorised import ExtraReport

HIDDEN = "### BEGIN HIDDEN TESTS\nassert f(987654) == 123456\n### END HIDDEN TESTS"
INFO = {"grade": True, "locked": True, "solution": False, "grade_id": "t", "points": 1, "schema_version": 3}


def shown(source, outputs, **metadata):
    """Return a test cell as a student sees it."""
    cell = new_code_cell(source, outputs=outputs, metadata={"nbgrader": INFO})
    notebook = new_notebook(cells=[cell], metadata=metadata)
    result, resources = LeakFreeFeedback().preprocess(notebook, {"kept": 1})
    assert resources == {"kept": 1}
    return result


def failure(ename, evalue):
    """Return an error output with a traceback that shows the hidden test."""
    return new_output("error", ename=ename, evalue=evalue, traceback=["assert f(987654) == 123456", evalue])


@pytest.mark.parametrize(
    "ename",
    ["AssertionError", "ValueError", "NameError", "TypeError", "StudentError", "BlockingIOError", "987654"],
)
def test_nothing_of_a_hidden_test_is_left(ename):
    """Source, traceback, message and prints of a hidden test are gone; which error it was stays."""
    outputs = [
        new_output("stream", name="stdout", text="987654 gives 123456"),
        new_output("stream", name="stderr", text="987654"),
        failure(ename, "f(987654) is not 123456"),
    ]
    cell = shown(f"x = 1\n{HIDDEN}", outputs).cells[0]
    assert cell.source == f"x = 1\n{PLACEHOLDER}"
    assert "123456" not in str(cell)
    ordinary = ename in {
        "AssertionError",
        "ValueError",
        "NameError",
        "TypeError",
    }  # of all others one could say a code
    assert [output.ename for output in cell.outputs] == [ename if ordinary else "Error"]
    assert "987654" not in str(cell)


def test_what_the_grader_could_not_judge_is_told_to_a_person_alone():
    """The reason why a cell waits may have words of the submission's in it, chosen by a hidden input."""
    reason = "the test uses len on an object of type called_with_987654"
    cell = shown(HIDDEN, [failure("GraderError", reason)]).cells[0]
    assert "987654" not in str(cell)
    assert "a person will look at this cell" in str(cell)


@pytest.mark.parametrize(
    "evalue",
    [
        "name '987654' is not defined", "name 'x987654' is not defined", "name 'f' is not defined 987654", "name '987654' is not defined; name 'x' is not defined", "987654",
        "name 'x\n987654' is not defined", "name 'a' is not defined or 987654 and name 'b' is not defined",
    ],
    ids=range(7),
)  # fmt: skip
def test_a_forged_name_error_shows_nothing(evalue):
    """Only the message Python itself gives for a missing name is shown: a submission cannot put an input into one."""
    cell = shown(HIDDEN, [failure("NameError", evalue)]).cells[0]
    assert "987654" not in str(cell)


def test_what_a_student_may_know():
    """Reports, scores, a missing name and the grader's own reasons are shown."""
    outputs = [
        new_output("display_data", data={"text/plain": "9 of 10 checks passed"}),
        new_output("execute_result", data={"text/plain": "9.0"}, execution_count=1),
        failure("NameError", "name 'f' is not defined"),
        new_output("error", ename="ProcessDied", evalue="it ended its own process", traceback=[HIDDEN]),
    ]
    cell = shown(HIDDEN, outputs).cells[0]
    assert [o.output_type for o in cell.outputs] == ["display_data", "execute_result", "error", "error"]
    assert cell.outputs[2].evalue == "name 'f' is not defined"
    assert "123456" not in str(cell)
    assert cell.outputs[3].evalue == "it ended its own process"


def test_extra_credit_is_said():
    """What a stage without loops has earned is on the page, in words."""
    report = ExtraReport("mcl.transition_model", 2.0, 2.0, ("Both the text and the count of lines say so.",))
    outputs = [new_output("display_data", data=report.bundle())]
    notebook = shown("# Extra credit (2 points).\n" + HIDDEN, outputs)
    page, _ = HTMLExporter().from_notebook_node(notebook)
    assert "without loops over particles: 2 of 2 extra points" in page
    assert "123456" not in page


def test_visible_tests_and_other_cells_stay():
    """A test without a hidden part, and every other cell, is shown as it is."""
    outputs = [failure("AssertionError", "f(3) is 8"), new_output("stream", name="stdout", text="3")]
    cell = shown("assert f(3) == 9", outputs).cells[0]
    assert cell.source == "assert f(3) == 9"
    assert cell.outputs == outputs
    plain = new_notebook(cells=[new_code_cell(HIDDEN, outputs=outputs), new_markdown_cell("text")])
    result, _ = LeakFreeFeedback().preprocess(plain, {})
    assert [c.source for c in result.cells] == [HIDDEN, "text"]


def test_notes_on_the_file_are_plain_text():
    """What repair mended is listed on top, as text: a name that a submission chose is no markup."""
    notice = "a cell of the unknown name '<script>alert(1)</script>[x](javascript:y)`z`' was taken"
    result = shown(HIDDEN, [], **{NOTICE: ["the cell q1 was missing", notice]})
    text = result.cells[0].source
    assert "the cell q1 was missing" in text
    assert not set("<>[]`#*!") & set(text.split("\n\n", 1)[1].replace("* ", ""))


def test_the_mark_scheme_is_not_shown():
    """A rubric that nbgrader restored into a task cell is for the grader; the question around it stays."""
    text = "Why?\n\n=== BEGIN MARK SCHEME ===\n* 2 points for the answer\n=== END MARK SCHEME ===\n\nIn your words."
    notebook = nbformat.from_dict(
        {"cells": [{"cell_type": "markdown", "source": text, "metadata": {}}], "metadata": {}, "nbformat": 4}
    )
    shown, _ = LeakFreeFeedback().preprocess(notebook, {})
    assert "2 points" not in shown.cells[0].source
    assert "Why?" in shown.cells[0].source
    assert "In your words." in shown.cells[0].source
