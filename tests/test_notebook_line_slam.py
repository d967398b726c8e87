"""The notebook line-slam: its cells and points, its derivation, its run in the arena, and what stops it."""

from __future__ import annotations

import matplotlib as mpl
import pytest
from worked import Worked, outputs_of, run

from roboloc.filters import MissingStageError

mpl.use("Agg")
TAGS = ("symbols", "motion", "line", "gauge", "observability", "fixed")
IT = Worked(
    "ekf-slam",
    "line-slam",
    "slam-with-lines",
    tuple(f"derive-slam-{tag}" for tag in TAGS),
    {
        "foot-h-test": 2,
        "foot-n-test": 3,
        "foot-position-test": 2,
        "transition-test": 7,
        "predicted-test": 8,
        "gauge-answer": 4,
        "arena-answer": 4,
    },
)
EARLIER = ("earlier-transition-update", "earlier-innovations", "earlier-stack", "earlier-update")


def drive(**changes):
    """Run the cells of the student's functions and the first cells of the closing run, some of them changed."""
    notebook = IT.source()
    cells = {cell.id: cell.source for cell in notebook.cells}
    closing = [
        c.source for c in notebook.cells if c.source.startswith(("from roboloc import filters", "def slam"))
    ]
    space = {}
    for name in ("slam-imports", "transition", "predicted", *EARLIER):
        exec(changes.get(name, cells[name]), space)  # noqa: S102 - the notebook's own cells
    for source in closing:
        exec(source, space)  # noqa: S102
    space["log"] = space["log"].until(2.0)
    return space["slam"]()


def test_grade_cells_are_as_announced():
    """The graded cells, their points, and 30 points in all, as the notebook's first cell says."""
    IT.hold_points()


def test_mark_schemes_add_up():
    """The points of each mark scheme are those of its question, part by part."""
    assert IT.mark_schemes() == {"gauge": [1, 1, 1, 1], "arena": [2, 1, 1]}


def test_derivation_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order."""
    IT.hold_derivation()


def table(texts):
    """Return the numbers of the experiments by name."""
    text = "".join(texts).partition("off [m]")[2]
    rows = {}
    for line in text.splitlines()[1:]:
        *numbers, matched, _, total, name = line.split(maxsplit=8)
        rows[name] = [float(number) for number in numbers] + [int(matched) / int(total)]
    return rows


def test_the_solution_earns_every_point_and_corrects_the_map(tmp_path):
    """The source runs to its end: all points, a map right to millimetres, one row of pictures, a table that tells."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=1)
    texts = [output.get("text", "") for output in outputs_of(notebook)]
    (found,) = [text for text in texts if "map at the end" in text]
    start, end = (line.split("up to ")[1].split() for line in found.splitlines()[-2:])
    assert float(start[0]) > 0.1
    assert float(end[0]) < 0.002
    assert float(end[3]) < 0.005
    rows = table(texts)
    assert len(rows) == 6
    right = rows["as it was"]
    assert rows["columns of the certain lines kept"] == right
    assert right[0] < 0.005
    assert right[3] < 0.002
    free = rows["nothing certain"]
    assert free[2] > 11.3  # once in a hundred, if the filter were honest
    assert free[3] > 20 * free[4]  # turned, as a whole
    far = rows["both certain lines 10 cm too far"]
    assert far[0] > 0.1 > 10 * far[1]
    assert far[5] > 0.98
    assert rows["the second certain line turned by 0.1"][5] < 0.9


@pytest.mark.parametrize(
    ("cell", "words"),
    [
        ("transition", "stage transition_model: not written yet (it is written in the notebook line-slam)"),
        (
            "predicted",
            "stage compute_predicted_measurements: not written yet (it is written in the notebook line-s",
        ),
        (
            "earlier-transition-update",
            "stage transition_update: not written yet (it is written in the notebook motion",
        ),
        (
            "earlier-innovations",
            "stage compute_innovations: not written yet (it is written in the notebook assoc",
        ),
        ("earlier-stack", "stage measurement_model: not written yet (it is written in the notebook assoc"),
        ("earlier-update", "stage measurement_update: not written yet (it is written in the notebook assoc"),
    ],
)
def test_a_missing_stage_stops_the_run_and_names_its_notebook(cell, words):
    """Nothing stands in for a stage that is not there."""
    with pytest.raises(MissingStageError) as stopped:
        drive(**{cell: IT.stub(cell)})
    assert str(stopped.value).startswith(words)


def test_the_closing_run_is_the_students_own():
    """With a mistake in the student's function the run goes on, and shows it: the map stays as it is."""
    padded = """
right = compute_predicted_measurements


def compute_predicted_measurements(x, tf, fixed=2):
    hs, Hs = right(x, tf, fixed)
    Hs[:, :, 3:] = 0
    return hs, Hs
"""
    cells = {cell.id: cell.source for cell in IT.source().cells}
    good, bad = drive(), drive(predicted=cells["predicted"] + padded)
    assert abs(good.xs[-1] - good.xs[0])[7:].max() > 0.1
    assert abs(bad.xs[-1] - bad.xs[0])[7:].max() < 1e-12


def test_the_release_stops_at_the_first_open_answer(tmp_path):
    """A release run as it is stops at the first cell that asks for an answer, after the whole derivation."""
    IT.hold_release_stops(tmp_path, "derive-slam-fixed-1", "foot-h")
