"""The notebook split-and-merge: its cells and points, its derivation, and its closing run."""

from __future__ import annotations

import matplotlib as mpl
import pytest
from worked import Worked, outputs_of, run

mpl.use("Agg")
IT = Worked(
    "line-extraction",
    "split-and-merge",
    "from-a-scan-to-walls",
    tuple(f"derive-walls-{tag}" for tag in ("bend", "far", "cut")),
    {
        "step-tilt-test": 2,
        "step-far-test": 2,
        "split-test": 7,
        "merge-test": 6,
        "segments-test": 5,
        "extract-test": 4,
        "choice-answer": 6,
    },
)
CELLS = ("imports", "split", "merge", "segments", "extract", "own-fit", "table")


def closing_run(grade_id):
    """Run the stages and the closing run with one cell as it is released; return the last cell that was begun."""
    stub, notebook, ran, space = IT.stub(grade_id), IT.source(), [], {}
    places = {cell.id: i for i, cell in enumerate(notebook.cells)}
    end = next(i for i, cell in enumerate(notebook.cells) if "## 9. A scan" in cell.source)
    tools = [
        cell for cell in notebook.cells[:end] if "def scanned" in cell.source or "import Lidar" in cell.source
    ]
    kept = [notebook.cells[places[name]] for name in CELLS] + tools + notebook.cells[end:]
    with pytest.raises(NotImplementedError):  # noqa: PT012 - which of the cells is what the test is about
        for cell in (cell for cell in kept if cell.cell_type == "code"):
            ran.append(cell.source)
            exec(stub if cell.id == grade_id else cell.source, space)  # noqa: S102 - the notebook's own cells
    return ran[-1]


def test_grade_cells_are_as_announced():
    """The graded cells, their points, and 32 points in all, as the notebook's first cell says."""
    IT.hold_points()


def test_mark_scheme_adds_up():
    """The points of the mark scheme are those of the question, part by part."""
    assert IT.mark_schemes() == {"choice": [2, 2, 2]}


def test_derivation_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order."""
    IT.hold_derivation()


def test_the_solution_runs_and_earns_every_point(tmp_path):
    """The source notebook runs from top to bottom, draws runs and walls, and its hidden tests give all points."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=2)
    text = "".join(output.get("text", "") for output in outputs_of(notebook))
    assert "86 merged first, 76 dropped first" in text
    assert text.count("beams ") == 7


@pytest.mark.parametrize("stage", ["split", "merge", "segments", "extract", "own-fit"])
def test_the_closing_run_fails_visibly_without_a_stage(stage):
    """With one function as it is released, the closing run stops where the scan of the arena is looked at."""
    assert "scanned(pose, 7)" in closing_run(stage)


def test_the_release_stops_at_the_first_open_answer(tmp_path):
    """A release run as it is stops at the first cell that asks for an answer, after the whole derivation."""
    IT.hold_release_stops(tmp_path, "derive-walls-cut-2", "step-tilt")
