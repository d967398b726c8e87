"""The notebook motion-model: its cells and points, its derivation, and its drive."""

from __future__ import annotations

import pytest
from nbclient.exceptions import CellExecutionError
from worked import Worked, outputs_of, run

IT = Worked(
    "ekf-localization",
    "motion-model",
    "motion-and-the-limit",
    ("derive-symbols", "derive-g", "derive-jacobians", "derive-limits"),
    {
        "wheels-g-test": 2,
        "wheels-gx-test": 2,
        "wheels-gu-test": 2,
        "wheels-limit-test": 3,
        "dynamics-test": 10,
        "transition-test": 6,
        "switch-answer": 5,
    },
)


def test_grade_cells_of_the_motion_model_are_as_announced():
    """The graded cells, their points, and 30 points in all, as the notebook's first cell says."""
    IT.hold_points()


def test_mark_scheme_of_the_motion_model_adds_up():
    """The points of the mark scheme are those of the question."""
    assert list(IT.mark_schemes()) == ["switch"]


def test_derivation_of_the_motion_model_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order."""
    IT.hold_derivation()


def test_the_solution_drives_and_earns_every_point(tmp_path):
    """The source notebook runs from top to bottom, draws the drive, and its hidden tests give all points."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=1)
    assert not [output for output in outputs_of(notebook) if output.output_type == "stream"]


@pytest.mark.parametrize(
    ("stage", "function"), [("dynamics", "compute_dynamics"), ("transition", "transition_update")]
)
def test_the_drive_fails_visibly_without_a_stage(stage, function, tmp_path):
    """With one stage as it is released, the closing run stops and names that stage."""
    with pytest.raises(CellExecutionError, match=f"stage {function}: not written yet"):
        run(IT.without(stage), tmp_path)


def test_the_release_of_the_motion_model_stops_at_the_first_open_answer(tmp_path):
    """A release run as it is stops at the first cell that asks for an answer, after the whole derivation."""
    IT.hold_release_stops(tmp_path, "derive-limits-3", "wheels-g")
