"""What the release binds is never a submission's to bind, wherever its cells stand, and whether they stand at all."""

from __future__ import annotations

import pytest

from autograder.layout import Layout, read_layout

FAKE = """
class np:
    allclose = staticmethod(lambda *_: True)
np = np()
"""
WRONG = "def f(x):\n    return 'nonsense'"
TEST = ("test", "### BEGIN HIDDEN TESTS\nassert np.allclose([f(3.0)], [9.0])\n### END HIDDEN TESTS")
ANSWER = ("answer", FAKE + WRONG, "def f(x): ...")
RIGHT = ("answer", "def f(x):\n    return x * x", "def f(x): ...")
NUMPY = "import numpy as np"


def test_a_given_cell_that_was_moved_counts_where_the_release_has_it(execute):
    """A locked import at the end of a file is still the instructor's, for right answers and for wrong ones."""
    order = Layout(("given-2", "answer-0", "test-1"))
    for answer, score in ((ANSWER, 0), (RIGHT, 2)):
        assert execute(answer, TEST, ("given", NUMPY), layout=order).scores == [score]


def test_a_given_cell_after_a_test_says_nothing_in_it(execute):
    """What the instructor binds later is the student's before, with the order on record and without."""
    cells = [("answer", "data = [2]", ""), ("test", "assert data == [2]"), ("given", "data = [3]")]
    for order in ((), ("answer-0", "test-1", "given-2")):
        assert execute(*cells, layout=Layout(order)).scores == [2]


@pytest.mark.parametrize("stub", [NUMPY + "\ndef f(x): ...", "from numpy import linalg as np"])
def test_an_answer_that_was_deleted_takes_no_import_along(execute, stub):
    """What the released answer cell imports is imported for the test, though the submission has no such cell."""
    test = ("test", "### BEGIN HIDDEN TESTS\nassert np.norm([3.0, 4.0]) == 5 + f(1)\n### END HIDDEN TESTS")
    run = execute(
        ("plain", "def f(x): return 0\nclass np:\n    norm = lambda x: 5\nnp = np()"), test, gone={"a": stub}
    )
    assert run.scores == [2 if "linalg" in stub else 0]


def test_imports_of_plain_cells_are_those_of_the_release(execute):
    """A cell that nbgrader does not keep track of can be changed, but not what its imports are for a test."""
    for layout, score in ((Layout(plain=(NUMPY,)), 0), (Layout(), 2)):
        assert execute(("plain", NUMPY), ANSWER, TEST, layout=layout).scores == [score]
    assert execute(("plain", NUMPY), RIGHT, TEST, layout=Layout(plain=(NUMPY,))).scores == [2]


def test_a_file_beside_the_notebook_is_imported_there(execute):
    """A module that is not installed for the grader is that of the sandbox, as before."""
    files = {"helpers.py": (b"def double(x): return 2 * x", 0o644)}
    cells = [
        ("plain", "import sys; sys.path.append('.')\nfrom helpers import double"),
        ("test", "assert double(2) == 4"),
    ]
    run = execute(*cells, files=files, layout=Layout(plain=("from helpers import double",)))
    assert run.scores == [2], run.error()


FAULT = """
import sys
WireError = next(m.WireError for n, m in sys.modules.items() if n.endswith(".wire"))
def f(x):
    if x == 2.0:
        raise WireError("does not cross")
    return 0.0
"""


def test_data_beside_a_call_that_does_not_cross_are_the_instructors(execute):
    """Of a given cell that calls the submission, only the statement that fails is taken from the sandbox."""
    given = ("given", "import numpy as np\nprint(f(2.0)); wanted = [9.0]\nmade = f(2.0) if True else 1")
    run = execute(
        ("answer", FAULT, "def f(x): ..."), given, ("plain", "wanted = [0.0]"),
        ("test", "### BEGIN HIDDEN TESTS\nassert np.allclose([f(3.0)], wanted)\n### END HIDDEN TESTS"),
    )  # fmt: skip
    assert run.flags != [""] or run.scores == [0]


def test_a_given_cell_goes_no_further_than_its_error(execute):
    """Where a call of the submission raises in a given cell, what stands after it is not bound, as in the sandbox."""
    answer = ("answer", "def f(x):\n    return 1 / 0", "def f(x): ...")
    run = execute(
        answer, ("given", "before = 1\nf(2.0)\nafter = 2"), ("test", "assert before == 1\nassert after == 2")
    )
    assert run.error()[0] == "NameError"
    assert "after" in run.error()[1]


def test_layout_of_a_file_and_of_a_record(tmp_path):
    """A released file has names and plain cells; where it is gone, the order on record is all there is."""
    path = tmp_path / "x.ipynb"
    assert read_layout(path) == Layout()
    assert read_layout(path, ["a", "b"]) == Layout(("a", "b"))
    path.write_text(
        '{"cells": [{"cell_type": "code", "metadata": {}, "source": ["import a\\n", "import b"]},'
        ' {"cell_type": "markdown", "metadata": {}, "source": "text"},'
        ' {"cell_type": "code", "metadata": {"nbgrader": {"grade_id": "q"}}, "source": "x"}]}',
        encoding="utf-8",
    )
    assert read_layout(path, ["a"]) == Layout(("q",), ("import a\nimport b",))


@pytest.mark.parametrize(
    ("later", "test"),
    [("result = 15", "assert result == 15"), ("def result(): return 1", "assert result() == 1")],
)
def test_an_answer_by_a_name_of_an_earlier_test_is_for_a_person(execute, later, test):
    """A test's own variables are its own, so an answer of that name is not seen: a right one is not graded zero."""
    first = ("test", "result = 8\nassert result == 8")
    run = execute(("plain", "x = 1"), first, ("plain", later), ("test", test))
    assert run.flags[0] == ""
    assert "result" in run.flags[1]
    assert execute(("plain", "x = 1"), first, ("plain", "x = 2"), ("test", test)).flags == ["", ""]


def test_a_file_beside_the_notebook_can_be_imported(execute):
    """As in Jupyter, without a change to the path; but it takes no library's place."""
    files = dict.fromkeys(("helpers.py", "select.py", "numpy.py"), (b"def double(x): return 2 * x", 420))
    own = "from helpers import double\nimport numpy, select\ndef f(x): return double(x) + numpy.zeros(1)[0]"
    run = execute(("answer", own, "def f(x): ..."), ("test", "assert f(2) == 4"), files=files)
    assert run.scores == [2], run.error()
