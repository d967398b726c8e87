"""The locked cells with which notebooks begin are run once in a sandbox, and no notebook can tell."""

from __future__ import annotations

import pytest

from autograder.sandbox import Sandbox
from autograder.session import Session

ONCE = "import itertools\nbirth = object()\nnumbers = [1, 2]\nprint('begun')\nnumbers"


@pytest.fixture
def begin(sandbox, limits):
    """Open notebooks that begin with the given cells, run those, and return their sessions."""
    opened = []

    def open_one(*beginning, files=None):
        session = Session(sandbox, limits, files, beginning)
        opened.append(session)
        results = [session.cell(source, careful=False) for source in beginning]
        return session, results

    yield open_one
    for session in opened:
        session.close()


def shown(result):
    """Return what a cell printed and what its last line is worth."""
    return [output.get("text") or output.get("data", {}).get("text/plain") for output in result.outputs]


def test_notebooks_go_on_from_one_run_of_the_beginning(begin):
    """The cells' outputs are there in each notebook, and its names are those of the one run."""
    first, (one,) = begin(ONCE)
    second, (other,) = begin(ONCE)
    assert shown(one) == shown(other) == ["begun\n", "[1, 2]"]
    assert shown(first.cell("id(birth)")) == shown(second.cell("id(birth)"))
    assert first.left == first.limits.notebook_cpu or first.left > first.limits.notebook_cpu - 1


def test_what_one_notebook_does_to_the_beginning_no_other_sees(begin):
    """Each notebook has a copy: what it changes in the names and modules of the beginning stays with it."""
    spoiler, _ = begin(ONCE)
    spoiler.cell("numbers.append(3)\nitertools.count = None\nimport builtins\nbuiltins.len = None")
    other, _ = begin(ONCE)
    assert shown(other.cell("numbers, itertools.count is None, len(numbers)")) == ["([1, 2], False, 2)"]


def test_the_same_cell_later_is_run(begin):
    """Only the first cells of a notebook have run already: the same text further down is a cell like any other."""
    session, _ = begin("n = 0", "n = n + 1\nn")
    assert shown(session.cell("n = n + 1\nn")) == ["2"]


def test_state_survives_a_cell_that_dies(begin):
    """Where a cell ends its process, the next one finds the names of the beginning."""
    session, _ = begin(ONCE)
    assert session.cell("import os\nos._exit(0)").ended
    assert shown(session.cell("numbers")) == ["[1, 2]"]


@pytest.mark.parametrize(
    "cell",
    [
        "seen = open('data.txt').read()\nseen",
        "open('/tmp/note', 'w').write('x')\nopen('/tmp/note').read()",
    ],
    ids=["a file", "a temporary file"],
)
def test_a_beginning_that_cannot_be_shared_runs_in_each_notebook(begin, cell):
    """A file of the notebook's folder or a temporary file is there in each notebook."""
    files = {"data.txt": (b"ours", 0o644)}
    for _ in range(2):
        session, (first, second) = begin(cell, "here = object()\nid(here)", files=files)
        assert first.succeeded
        assert second.succeeded
        if "data" in cell:
            assert shown(session.cell("seen")) == ["'ours'"]
        else:
            assert shown(session.cell("open('/tmp/note').read()")) == ["'x'"]


def test_beginnings_are_not_collected_without_end(limits):
    """Past a number of them, notebooks with a beginning of their own run it themselves."""
    with Sandbox(("ipython", "msgpack", "numpy")) as sandbox:
        for number in range(11):
            session = Session(sandbox, limits, {}, [f"n = {number}"])
            assert session.cell(f"n = {number}", careful=False).succeeded
            assert shown(session.cell("n")) == [str(number)]
            assert session.close()
