"""The notebook tracking: its cells and points, its derivation, its throw, and what stops it."""

from __future__ import annotations

import pytest
from nbclient.exceptions import CellExecutionError
from worked import Worked, outputs_of, run

IT = Worked(
    "bouncing-ball",
    "tracking",
    "a-ball-that-bounces",
    (
        "derive-ball-flight",
        "derive-ball-time",
        "derive-ball-through",
        "derive-ball-saltation",
        "derive-ball-rest",
    ),
    {
        "slope-time-test": 2,
        "slope-velocity-test": 2,
        "slope-saltation-test": 3,
        "predict-test": 10,
        "correct-test": 6,
        "impact-answer": 3,
        "honesty-answer": 4,
    },
)


def test_grade_cells_of_tracking_are_as_announced():
    """The graded cells, their points, and 30 points in all, as the notebook's first cell says."""
    IT.hold_points()


def test_mark_schemes_of_tracking_add_up():
    """The points of a mark scheme are those of its question, part by part."""
    assert list(IT.mark_schemes()) == ["impact", "honesty"]


def test_derivation_of_tracking_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order."""
    IT.hold_derivation()


def test_the_solution_tracks_the_ball_and_earns_every_point(tmp_path):
    """The source runs to its end: all points, two pictures, and numbers that tell the three filters apart."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=2)
    outputs = outputs_of(notebook)
    assert not [output for output in outputs if output.output_type == "stream"]
    texts = [output.data["text/plain"] for output in outputs if output.output_type == "execute_result"]
    (off,) = [text for text in texts if "behind the box" in text]
    assert max(float(word) for word in off.split() if word.startswith("0.")) < 0.1
    (errors,) = [eval(text)["error of height [m]"] for text in texts if "end of the step" in text]  # noqa: S307
    assert errors["your filter"] < 0.05
    assert abs(errors["jump alone"] - errors["your filter"]) < 0.005
    assert errors["end of the step"] > 0.2


@pytest.mark.parametrize("stage", ["predict", "correct"])
def test_the_throw_stops_without_a_stage(stage, tmp_path):
    """With one stage as it is released, the closing run stops where it calls it, and no other takes its place."""
    notebook = IT.without(stage)
    with pytest.raises(CellExecutionError, match="NotImplementedError"):
        run(notebook, tmp_path)
    ran = [cell.source for cell in notebook.cells if cell.get("execution_count")]
    assert ran[-1].startswith("truth, zs = throw")


def test_the_release_of_tracking_stops_at_the_first_open_answer(tmp_path):
    """A release run as it is stops at the first cell that asks for an answer, after the whole derivation."""
    IT.hold_release_stops(tmp_path, "derive-ball-rest-1", "slope-time")
