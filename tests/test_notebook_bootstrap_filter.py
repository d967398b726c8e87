"""The notebook bootstrap-filter: its cells and points, its worked example, and its closing run."""

from __future__ import annotations

import re

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
from nbclient.exceptions import CellExecutionError
from worked import Worked, outputs_of, run

mpl.use("Agg")
IT = Worked(
    "particle-filters",
    "bootstrap-filter",
    "particles",
    tuple(f"derive-boot-{tag}" for tag in ("draw", "support", "comb")),
    {"motion-test": 7, "bearing-test": 5, "resample-test": 6, "step-test": 5, "cloud-answer": 7},
)
STAGES = ("motion", "bearing", "resample", "step")


@pytest.fixture
def closing_run():
    """Return a function that runs the stages and the closing run, some cells changed; it keeps what it has run."""
    ran = []

    def play(**changes):
        notebook = IT.source()
        places = {cell.id: i for i, cell in enumerate(notebook.cells)}
        begin, end = (
            next(i for i, cell in enumerate(notebook.cells) if title in cell.source)
            for title in ("## 7. Around", "## 8. What breaks")
        )
        space = {}
        kept = [notebook.cells[places[name]] for name in ("imports", *STAGES)] + notebook.cells[begin:end]
        for cell in (cell for cell in kept if cell.cell_type == "code"):
            ran.append(cell.source)
            exec(changes.get(cell.id, str)(cell.source), space)  # noqa: S102 - the notebook's own cells

    yield play, ran
    plt.close("all")


def test_grade_cells_are_as_announced():
    """The graded cells, their points, and 30 points in all, as the notebook's first cell says."""
    IT.hold_points()


def test_mark_scheme_adds_up():
    """The points of the mark scheme are those of the question, part by part."""
    assert IT.mark_schemes() == {"cloud": [1, 2, 1, 2, 1]}


def test_derivation_is_that_of_the_page():
    """The locked cells of the worked example are the page's cells, in the page's order."""
    IT.hold_derivation()


def test_the_solution_runs_and_earns_every_point(tmp_path):
    """The source notebook runs from top to bottom, follows the robot, and its hidden tests give all points."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=1)
    text = "".join(output.get("text", "") for output in outputs_of(notebook))
    assert float(re.search(r"error of the mean after five steps: ([\d.]+) m", text)[1]) < 0.4
    few, *_, many = (float(found) for found in re.findall(r"particles: ([\d.]+) m", text))
    assert few > 2 * many
    assert re.search(r"step 42: +[1-5] different particles, too sure", text)


@pytest.mark.parametrize("stage", STAGES)
def test_the_closing_run_fails_visibly_without_a_stage(stage, closing_run):
    """With one stage as it is released, the closing run stops where the stage is first needed."""
    stub = IT.stub(stage)
    play, ran = closing_run
    with pytest.raises(NotImplementedError):
        play(**{stage: lambda _: stub})
    first_use = {"bearing": "looking, not_looking", "resample": "fig, ax"}
    assert ran[-1].startswith(first_use.get(stage, "truth, seen = world(2)"))


@pytest.mark.parametrize(
    ("was", "wrong"),
    [("(len(xs), 3)))\n", "(len(xs), 3))) * 0\n"), ("-(v**2)", "-(0 * v**2)")],
    ids=["no motion", "no weighing"],
)
def test_the_closing_run_stops_where_the_step_leaves_something_out(was, wrong, closing_run):
    """A step without motion or without weighing explains no more than driving blind, and the run says so."""
    play, _ = closing_run

    def spoiled(text):
        assert was in text
        return text.replace(was, wrong)

    with pytest.raises(AssertionError, match="hardly better than a cloud that drives blind"):
        play(step=spoiled)


def test_the_release_stops_where_the_drive_begins(tmp_path):
    """A release run as it is says at each check what is not written, and stops at the first step of the drive."""
    notebook = IT.release()
    with pytest.raises(CellExecutionError, match="NotImplementedError"):
        run(notebook, tmp_path)
    last = [cell for cell in notebook.cells if cell.get("execution_count")][-1]
    assert last.source.startswith("truth, seen = world(2)")
    reports = "".join(str(output.get("data", "")) for output in outputs_of(notebook))
    assert reports.count("The function is not written yet") >= len(STAGES)
