"""The notebook growing-the-map: its cells and points, its derivation, its map from nothing, and what stops it."""

from __future__ import annotations

import matplotlib as mpl
import pytest
from worked import Worked, outputs_of, run

from roboloc.filters import MissingStageError

mpl.use("Agg")
TAGS = ("symbols", "line", "jacobians", "covariance", "again")
IT = Worked(
    "ekf-slam",
    "growing-the-map",
    "growing-a-map",
    tuple(f"derive-grow-{tag}" for tag in TAGS),
    {
        "newborn-foot-test": 2,
        "newborn-cross-test": 2,
        "newborn-two-test": 3,
        "world-test": 6,
        "augment-test": 8,
        "recognize-test": 4,
        "newborn-answer": 5,
    },
)
EARLIER = (
    "earlier-motion",
    "earlier-lines",
    "earlier-transition-update",
    "earlier-innovations",
    "earlier-stack",
    "earlier-update",
)


def drive(**changes):
    """Run the student's cells and the first cells of the closing run, some of them changed."""
    notebook = IT.source()
    cells = {cell.id: cell.source for cell in notebook.cells}
    starts = ("from roboloc import filters", "class Growing", "class Mapping", "seen, here", "def grow")
    closing = [cell.source for cell in notebook.cells if cell.source.startswith(starts)]
    space = {}
    for name in ("growing-imports", "world", "augment", "recognize", *EARLIER):
        exec(changes.get(name, cells[name]), space)  # noqa: S102 - the notebook's own cells
    for source in closing:
        exec(source, space)  # noqa: S102
    space["log"] = space["log"].until(2.0)
    return space["grow"]()


def test_grade_cells_are_as_announced():
    """The graded cells, their points, and 30 points in all, as the notebook's first cell says."""
    IT.hold_points()


def test_mark_scheme_adds_up():
    """The points of the mark scheme are those of its question, part by part."""
    assert IT.mark_schemes() == {"newborn": [2, 1, 2]}


def test_derivation_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order."""
    IT.hold_derivation()


def test_the_solution_earns_every_point_and_makes_a_map(tmp_path):
    """The source runs to its end: all points, six lines, one row of pictures, and a table that tells."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=1)
    text = "".join(output.get("text", "") for output in outputs_of(notebook))
    assert "6 lines for 6 walls" in text
    rows = [line.split(maxsplit=4) for line in text.partition("mean NEES\n")[2].splitlines()[:4]]
    lines = {name: int(count) for count, *_, name in rows}
    claims = {name: float(claimed) for _, _, claimed, _, name in rows}
    nees = {name: float(value) for *_, value, name in rows}
    assert lines["as it was"] == lines["cross-covariances 0"] == 6
    assert lines["one gate"] > 6
    assert claims["cross-covariances 0"] < 0.75 * claims["as it was"]
    assert nees["cross-covariances 0"] > 1.5 * nees["as it was"]


@pytest.mark.parametrize("cell", EARLIER)
def test_a_missing_stage_stops_the_run_and_names_its_notebook(cell):
    """Nothing stands in for a stage of another notebook that is not there."""
    with pytest.raises(MissingStageError, match=r"not written yet \(it is written in the notebook"):
        drive(**{cell: IT.stub(cell)})


@pytest.mark.parametrize("cell", ["world", "augment", "recognize"])
def test_a_missing_answer_stops_the_run(cell):
    """Nothing stands in for a stage of this notebook that is not there."""
    with pytest.raises(NotImplementedError):
        drive(**{cell: IT.stub(cell)})


def test_the_run_stops_where_two_functions_disagree():
    """A line that is placed elsewhere by one of the two stops the run, which says so."""
    cell = {cell.id: cell.source for cell in IT.source().cells}["world"]
    with pytest.raises(AssertionError, match="put one line in two places"):
        drive(world=cell.replace("z[1] + scanner.real)])", "z[1] + robot.real)])"))


def test_the_closing_run_is_the_students_own():
    """A recognize for which all is new makes a map of everything that is seen."""
    everything = "def recognize(z, Q, hs, Hs, Sigma, g, newness):\n    return -1 if hs.shape[1] < 9 else -2"
    good, bad = drive()[0], drive(recognize=everything)[0]
    assert good.map_lines.shape[1] <= 6
    assert bad.map_lines.shape[1] == 9


def test_the_release_stops_at_the_first_open_answer(tmp_path):
    """A release run as it is stops at the first cell that asks for an answer, after the whole derivation."""
    IT.hold_release_stops(tmp_path, "derive-grow-again-1", "newborn-foot")
