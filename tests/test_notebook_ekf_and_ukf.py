"""The notebook ekf-and-ukf: its cells and points, its derivation, and its closing run."""

from __future__ import annotations

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
from worked import Worked, outputs_of, run

mpl.use("Agg")
TAGS = ("symbols", "motion", "w", "limits", "h", "points")
IT = Worked(
    "four-filters",
    "ekf-and-ukf",
    "the-unscented-filter",
    tuple(f"derive-vel-{tag}" for tag in TAGS),
    {
        "w-first-test": 3,
        "w-straight-test": 2,
        "h-ahead-test": 3,
        "motion-test": 3,
        "jacobians-test": 6,
        "noise-test": 2,
        "sighting-test": 5,
        "points-test": 4,
        "predict-test": 6,
        "correct-test": 8,
        "formulas-answer": 4,
        "choice-answer": 4,
    },
)
# What runs when each stage is first needed: the example beside the extended filter, or the closing run.
NEEDED = {
    "motion": "origin = np.zeros(3)",
    "jacobians": "origin = np.zeros(3)",
    "sighting": "origin = np.zeros(3)",
    "extended": "origin = np.zeros(3)",
    "noise": "filters = {",
    "predict": "filters = {",
    "correct": "filters = {",
}


@pytest.fixture
def closing_run():
    """Return a function that runs the stages and the closing run, some cells changed; it keeps what it has run."""
    ran = []

    def play(**changes):
        notebook = IT.source()
        places = {cell.id: i for i, cell in enumerate(notebook.cells)}
        end = next(i for i, cell in enumerate(notebook.cells) if "## 12. Both filters" in cell.source)
        example = next(cell for cell in notebook.cells if cell.source.startswith("origin = np.zeros(3)"))
        stages = ("imports", "motion", "jacobians", "noise", "sighting", "predict", "correct", "extended")
        kept = [notebook.cells[places[name]] for name in stages] + [example] + notebook.cells[end:]
        space = {}
        for cell in (cell for cell in kept if cell.cell_type == "code"):
            ran.append(cell.source)
            source = changes.get(cell.id, str)(cell.source)
            exec(source.replace('load("eight")[0]', 'load("unsure")[0]'), space)  # noqa: S102 - the notebook's own

    yield play, ran
    plt.close("all")


def test_grade_cells_are_as_announced():
    """The graded cells, their points, and 50 points in all, as the notebook's first cell says."""
    IT.hold_points()


def test_mark_scheme_adds_up():
    """The points of the mark schemes are those of the questions, part by part."""
    assert IT.mark_schemes() == {"formulas": [2, 2], "choice": [2, 2]}


def test_derivation_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order."""
    IT.hold_derivation()


def test_the_solution_runs_and_earns_every_point(tmp_path):
    """The source notebook runs from top to bottom, draws track and errors, and its hidden tests give all points."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=2)
    text = "".join(output.get("text", "") for output in outputs_of(notebook))
    means = {
        line.split()[0]: float(line.split()[3].rstrip(",")) for line in text.splitlines() if "worst" in line
    }
    assert means["extended"] > 1.5 * means["unscented"]
    assert "as numbers   -1.05  by residuals -3.14" in text


@pytest.mark.parametrize("stage", NEEDED)
def test_the_closing_run_fails_visibly_without_a_stage(stage, closing_run):
    """With one stage as it is released, the notebook stops where the stage is first needed."""
    stub = IT.stub(stage)
    play, ran = closing_run
    with pytest.raises(NotImplementedError):
        play(**{stage: lambda _: stub})
    assert ran[-1].startswith(NEEDED[stage])


def test_a_wrong_gain_of_the_extended_filter_is_seen(closing_run):
    """The example beside the extended filter stops a correction that believes the sensor outright."""
    play, _ = closing_run
    with pytest.raises(AssertionError, match="ekf_correct: the middle of two equally good guesses"):
        play(extended=lambda text: text.replace("H @ Sigma @ H.T + R", "H @ Sigma @ H.T + 1e-9 * R"))


def test_the_release_stops_at_the_first_open_answer(tmp_path):
    """A release run as it is stops at the first cell that asks for an answer, after the derivation so far."""
    IT.hold_release_stops(tmp_path, "derive-vel-h-1", "w-first")
