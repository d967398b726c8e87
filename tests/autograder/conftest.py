"""One warm sandbox for all tests of the grader, and short ways to run cells in it."""

from __future__ import annotations

import os
from dataclasses import dataclass

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_notebook
from nbgrader.utils import determine_grade
from starts import STARTS

from autograder.execute import Execution
from autograder.grading import grading_run
from autograder.roles import REVIEW
from autograder.sandbox import Sandbox
from autograder.session import Session
from autograder.worker.limits import Limits
from autograder.worker.shell import NotebookShell

LIMITS = Limits(
    call_cpu=2.0,
    cell_cpu=3.0,
    notebook_cpu=20.0,
    wall_factor=2.0,
    wall_extra=4.0,
    memory=3 * 1024**3,
    processes=40,
    file_size=4 * 1024**2,
    disk=16 * 1024**2,
)


@pytest.fixture(scope="session")
def sandbox():
    """Start the sandbox once; without bubblewrap every test that asks for it fails."""
    with Sandbox() as running:
        yield running


@pytest.fixture(scope="session")
def unfiltered():
    """Start the sandbox once without its filter of system calls, to see the other defences alone."""
    with Sandbox(filtered=False) as running:
        yield running


@pytest.fixture(autouse=True, scope="module")
def no_shell_stays():
    """Leave no IPython shell of the trusted side to later tests, which would take this process for a notebook."""
    yield
    NotebookShell.clear_instance()


@pytest.fixture
def limits():
    """Return the small limits of these tests."""
    return LIMITS


@pytest.fixture(scope="module", params=STARTS)
def either(request, sandbox):
    """Give the sandbox as it starts here, and as it starts for a grader who is not root."""
    if request.param != "user":
        yield sandbox if request.param == "as it is" else request.getfixturevalue("unfiltered")
        return
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "geteuid", lambda: 1000)
        running = Sandbox()
    with running:
        assert running.mode == "user"
        yield running


@pytest.fixture
def inside(either, limits):
    """Run one cell in a new notebook of either sandbox and return what it printed."""
    sessions = []

    def run(source, files=None):
        session = Session(either, limits, files)
        sessions.append(session)
        result = session.cell(source)
        assert result.succeeded, (result.ended, result.outputs)
        return "".join(o["text"] for o in result.outputs if o["output_type"] == "stream")

    yield run
    for session in sessions:
        session.close()


@pytest.fixture
def open_session(sandbox):
    """Open notebooks in the shared sandbox; each is seen to end."""
    opened = []

    def open_one(limits=LIMITS, files=None):
        opened.append(Session(sandbox, limits, files))
        return opened[-1]

    yield open_one
    for session in opened:
        session.close()


@dataclass(frozen=True)
class Run:
    """What became of a notebook: its code cells in order."""

    cells: list
    source: tuple = ()

    @property
    def tests(self):
        """Return the test cells."""
        return [cell for cell in self.cells if cell.metadata.get("nbgrader", {}).get("grade")]

    @property
    def scores(self):
        """Return nbgrader's own reading of the test cells' outputs."""
        return [determine_grade(cell)[0] for cell in self.tests]

    @property
    def flags(self):
        """Return for each test cell why a person must look at it; empty where nobody must."""
        return [cell.metadata.get(REVIEW, "") for cell in self.tests]

    def error(self, test=0):
        """Return class and text of a test cell's exception; empty where it has none."""
        return next(
            ((o.ename, o.evalue) for o in self.tests[test].outputs if o.output_type == "error"), ("", "")
        )

    def printed(self, cell):
        """Return what a cell printed."""
        return "".join(o.text for o in self.cells[cell].outputs if o.output_type == "stream")

    @property
    def text(self):
        """Return everything that the submission's own cells show."""
        return "\n".join(
            str(dict(o)) for cell in self.cells if cell not in self.tests for o in cell.get("outputs", [])
        )


_METADATA = {
    "plain": None,
    "given": {"locked": True, "grade": False, "solution": False},
    "answer": {"locked": False, "grade": False, "solution": True},
    "test": {"locked": True, "grade": True, "solution": False, "points": 2},
}


def build(cells):
    """Make notebook and release of cells ``(role, source)`` or ``("answer", source, released source)``."""
    nodes, release = [], {}
    for number, (role, source, *stub) in enumerate(cells):
        node = new_code_cell(source, id=f"cell-{number}")
        if _METADATA[role] is not None:
            name = f"{role}-{number}"
            node.metadata["nbgrader"] = _METADATA[role] | {"grade_id": name, "schema_version": 3}
            release[name] = stub[0] if stub else ("" if role == "answer" else source)
        nodes.append(node)
    return new_notebook(cells=nodes), release


@pytest.fixture
def build_notebook():
    """Return :func:`build`."""
    return build


@pytest.fixture
def execute(sandbox):
    """Execute notebooks of cells ``(role, source)`` in the shared sandbox; `gone` are cells that were deleted."""

    def run(*cells, limits=LIMITS, files=None, gone=None, layout=None):
        notebook, release = build(cells)
        Execution(notebook, release | (gone or {}), sandbox, limits, files or {}, layout=layout).run()
        nbformat.validate(notebook)
        return Run([cell for cell in notebook.cells if cell.cell_type == "code"], cells)

    return run


@pytest.fixture
def published():
    """Grade with a fixed secret and keep what a student would be shown."""
    shown = []
    with grading_run(secret="course-0", run_id="run-7", publish=shown.append):  # noqa: S106
        yield shown
