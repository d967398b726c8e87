"""The notebook association-and-update: its points, its derivation, its run, and what stops it."""

from __future__ import annotations

import pytest
from worked import Worked, meta, run

import sample_class

IT = Worked(
    "ekf-localization",
    "association-and-update",
    "ekf-localization-with-lines",
    ("derive-distance", "derive-gate", "derive-gain"),
    {
        "gate-share-test": 2,
        "wall-gain-test": 2,
        "wall-covariance-test": 3,
        "innovations-test": 8,
        "stack-test": 4,
        "update-test": 6,
        "motions-answer": 5,
    },
)


def text_of(cell):
    """Return what a cell wrote and raised."""
    outputs = cell.get("outputs", [])
    return "".join(output.get("text", "") + output.get("evalue", "") for output in outputs)


def test_grade_cells_of_association_are_as_announced():
    """The graded cells, their points, and 30 points in all, as the notebook's first cell says."""
    IT.hold_points()


def test_mark_scheme_of_association_adds_up():
    """The points of the mark scheme are those of the question."""
    assert list(IT.mark_schemes()) == ["motions"]


def test_derivation_of_association_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order, all six of them."""
    IT.hold_derivation()
    derived = [c for c in IT.release().cells if meta(c).get("grade_id", "").startswith("derive")]
    assert len(derived) == 6


def test_the_solution_earns_every_point_and_finds_its_way(tmp_path):
    """The source runs to its end: all points, the maze to centimetres, one row of pictures, and a table that tells."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=1)
    texts = [text_of(cell) for cell in notebook.cells]
    (matched,) = [text for text in texts if text.endswith("lines matched a wall\n")]
    few, many = (int(word) for word in matched.split() if word.isdigit())
    assert few > 0.97 * many > 1000
    (ends,) = [text for text in texts if "open loop: " in text]
    worst = {line.partition(":")[0]: float(line.split(": ")[1].split()[0]) for line in ends.splitlines()}
    assert worst["EKF"] < 0.1
    assert worst["open loop"] > 1
    (table,) = [text for text in texts if "claimed [m]" in text]
    miss = {line[35:].strip(): float(line.split()[0]) for line in table.splitlines()[1:]}
    right = [name for name, error in miss.items() if error < 0.02]
    assert [name for name in right if "raised" in name] == [name for name in miss if "raised" in name] != []
    assert right[0] == "as recorded"
    assert len(right) == 4
    assert len(miss) == 8


@pytest.mark.parametrize(
    ("missing", "words"),
    [
        (
            ["earlier-lines"],
            "stage compute_predicted_measurements: not written yet (it is written in the notebook line-",
        ),
        (
            ["earlier-dynamics"],
            "stage compute_dynamics: not written yet (it is written in the notebook motion-model)",
        ),
        (["innovations"], "stage compute_innovations: not written yet"),
    ],
)
def test_a_missing_stage_stops_the_run_and_names_its_notebook(missing, words, tmp_path):
    """Nothing stands in for a stage that is not there, and the points of the others do not depend on it."""
    answers = sample_class.solutions(IT.source())
    notebook = IT.release()
    for cell in notebook.cells:
        name = meta(cell).get("grade_id")
        if name in answers and name not in missing:
            cell.source = answers[name]
    executed = run(notebook, tmp_path, allow_errors=True)
    (stopped,) = [cell for cell in executed.cells if cell.source.startswith("def localize")]
    assert words in text_of(stopped)
