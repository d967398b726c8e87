"""The notebook line-measurements: its cells and points, its derivation, and its closing run."""

from __future__ import annotations

import pytest
from nbclient.exceptions import CellExecutionError
from worked import Worked, outputs_of, run

IT = Worked(
    "ekf-localization",
    "line-measurements",
    "lines-seen-from-a-robot",
    ("derive-line-symbols", "derive-line-h", "derive-line-jacobian", "derive-line-sides"),
    {
        "upside-h-test": 2,
        "upside-hx-test": 2,
        "upside-mount-test": 3,
        "transform-test": 8,
        "normalize-test": 5,
        "predicted-test": 5,
        "doorway-answer": 5,
    },
)


def test_grade_cells_are_as_announced():
    """The graded cells, their points, and 30 points in all, as the notebook's first cell says."""
    IT.hold_points()


def test_mark_scheme_adds_up():
    """The points of the mark scheme are those of the question, part by part."""
    assert IT.mark_schemes() == {"doorway": [1, 2, 2]}


def test_derivation_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order."""
    IT.hold_derivation()


def test_the_solution_runs_and_earns_every_point(tmp_path):
    """The source notebook runs from top to bottom, draws the doorway, and its hidden tests give all points."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=1)
    assert not [output for output in outputs_of(notebook) if output.output_type == "stream"]


@pytest.mark.parametrize("stage", ["transform", "normalize", "predicted"])
def test_the_closing_run_fails_visibly_without_a_stage(stage, tmp_path):
    """With one stage as it is released, the closing run stops; of the last one the filter shell says its name."""
    notebook = IT.without(stage)
    words = (
        "compute_predicted_measurements: not written yet" if stage == "predicted" else "NotImplementedError"
    )
    with pytest.raises(CellExecutionError, match=words):
        run(notebook, tmp_path)
    ran = [cell.source for cell in notebook.cells if cell.get("execution_count")]
    assert ran[-1].startswith("rng = np.random.default_rng")


def test_the_closing_run_stops_where_two_functions_disagree(tmp_path):
    """A normalisation that keeps the angle stops the run, which says at which line two functions disagree."""
    notebook = IT.untested(
        "normalize", lambda text: text.replace("angle = h[0] + np.pi * beyond", "angle = h[0]")
    )
    with pytest.raises(CellExecutionError, match=r"line \d+: your functions predict feet .* m apart"):
        run(notebook, tmp_path)


def test_the_release_stops_at_the_first_open_answer(tmp_path):
    """A release run as it is stops at the first cell that asks for an answer, after the whole derivation."""
    IT.hold_release_stops(tmp_path, "derive-line-sides-1", "upside-h")
