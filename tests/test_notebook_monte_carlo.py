"""The notebook monte-carlo-localization: cells, points and extra credit, its run in the arena, and what stops it."""

from __future__ import annotations

import re

import matplotlib as mpl
import pytest
from nbclient.exceptions import CellExecutionError
from worked import Worked, outputs_of, run

from roboloc.filters import MissingStageError

mpl.use("Agg")
STAGES = ("transition", "predicted", "innovations", "weights", "resample")
CLOUD = STAGES[:-1]
IT = Worked(
    "particle-filters",
    "monte-carlo-localization",
    "monte-carlo-localization",
    (),
    {
        **{f"{name}-test": points for name, points in zip(STAGES, (5, 7, 7, 6, 5), strict=True)},
        "weights-answer": 5,
        "cloud-answer": 5,
    },
    {f"{name}-extra": 2 for name in CLOUD},
)


def drive(**changes):
    """Run the student's cells, some of them changed, and the first second of the closing run; return the error [m]."""
    notebook = IT.source()
    cells = {cell.id: cell.source for cell in notebook.cells}
    begins = ("import matplotlib", "world, log", "def anywhere", "def new_filter", "def localize")
    space = {}
    for name in ("imports", *STAGES):
        exec(changes.get(name, cells[name]), space)  # noqa: S102 - the notebook's own cells
    for cell in notebook.cells:
        if cell.source.startswith(begins):
            exec(cell.source, space)  # noqa: S102
    off, _ = space["localize"](space["new_filter"](), space["log"].until(1.0))
    return off[-1]


def test_grade_cells_are_as_announced():
    """The graded cells, their points, 40 points and 8 points of extra credit in all, as the first cell says."""
    IT.hold_points()


def test_mark_schemes_add_up():
    """The points of each mark scheme are those of its question, part by part."""
    assert IT.mark_schemes() == {"weights": [1, 1, 2, 1], "cloud": [1, 2, 1, 1]}


def test_the_solution_earns_every_point_and_finds_the_robot(tmp_path):
    """The source runs to its end: all points and extra credit, the robot found, and a table that tells."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=1)
    text = "".join(output.get("text", "") for output in outputs_of(notebook))
    start, end = map(float, re.search(r"first scan ([\d.]+) m off, at the end ([\d.]+) m", text).groups())
    assert start > 0.3
    assert end < 0.2
    table = text.partition("different poses\n")[2].splitlines()
    rows = {
        name: (int(lost), float(off), int(poses))
        for lost, off, poses, name in (r.split(maxsplit=3) for r in table)
    }
    assert len(rows) == 6
    lost = {name: row[0] for name, row in rows.items()}
    assert lost["3,000 particles"] == 0 < lost["300 particles"]
    assert lost["1,000, carried away"] == 3 > lost["1,000, carried away, fresh"]
    assert rows["1,000, no noise"][2] < 10 < rows["1,000 particles"][2]


@pytest.mark.parametrize("cell", STAGES)
def test_a_missing_stage_stops_the_run_and_is_named(cell):
    """Nothing stands in for a stage that is not there."""
    stub = IT.stub(cell)
    (name,) = re.findall(r"^def (\w+)", stub, re.MULTILINE)
    words = f"stage {name}: not written yet \\(it is written in the notebook monte-carlo-localization\\)"
    with pytest.raises(MissingStageError, match=words):
        drive(**{cell: stub})


def test_the_closing_run_is_the_students_own():
    """With lines that are expected at random the run goes on, and the cloud does not get to the robot."""
    padded = """
right = compute_predicted_measurements


def compute_predicted_measurements(xs, *rest):
    return np.roll(right(xs, *rest), 1, axis=0)
"""
    cells = {cell.id: cell.source for cell in IT.source().cells}
    assert drive(predicted=cells["predicted"] + padded) > 0.5


def test_the_release_stops_where_the_run_begins(tmp_path):
    """A release run as it is says at each check what is not written, and stops at the first step of the run."""
    notebook = IT.release()
    with pytest.raises(CellExecutionError, match="MissingStageError"):
        run(notebook, tmp_path)
    last = [cell for cell in notebook.cells if cell.get("execution_count")][-1]
    assert last.source.startswith("off, clouds = localize")
    reports = "".join(str(output.get("data", "")) for output in outputs_of(notebook))
    assert reports.count("The function is not written yet") >= len(STAGES)
