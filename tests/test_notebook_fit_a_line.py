"""The notebook fit-a-line: its cells and points, its derivation, and its closing run."""

from __future__ import annotations

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
from worked import Worked, outputs_of, run

from roboloc.plotting import COLORS, plot_pose

mpl.use("Agg")
TAGS = ("symbols", "conditions", "distance", "direction", "by-line", "by-beam")
IT = Worked(
    "line-extraction",
    "fit-a-line",
    "fitting-lines-to-a-scan",
    tuple(f"derive-fit-{tag}" for tag in TAGS),
    {
        "bent-line-test": 2,
        "by-left-test": 2,
        "fan-covariance-test": 3,
        "parameters-test": 6,
        "jacobians-test": 7,
        "fit-test": 5,
        "honest-answer": 5,
    },
)
STAGES = ("parameters", "jacobians", "fit")


@pytest.fixture
def closing_run():
    """Return a function that runs the stages and the closing run, some cells changed; it keeps what it has run."""
    ran = []

    def play(**changes):
        notebook = IT.source()
        places = {cell.id: i for i, cell in enumerate(notebook.cells)}
        end = next(i for i, cell in enumerate(notebook.cells) if "## 9. A scan" in cell.source)
        space = {"plt": plt, "COLORS": COLORS, "plot_pose": plot_pose}
        kept = [notebook.cells[places[name]] for name in ("imports", *STAGES)] + notebook.cells[end:]
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
    assert IT.mark_schemes() == {"honest": [2, 2, 1]}


def test_derivation_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order."""
    IT.hold_derivation()


def test_the_solution_runs_and_earns_every_point(tmp_path):
    """The source notebook runs from top to bottom, draws slopes and walls, and its hidden tests give all points."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=2)
    text = "".join(output.get("text", "") for output in outputs_of(notebook))
    assert "on a circle 3.1" in text
    assert text.count("known to") == 5


@pytest.mark.parametrize("stage", STAGES)
def test_the_closing_run_fails_visibly_without_a_stage(stage, closing_run):
    """With one stage as it is released, the closing run stops where the first line is to be drawn."""
    stub = IT.stub(stage)
    play, ran = closing_run
    with pytest.raises(NotImplementedError):
        play(**{stage: lambda _: stub})
    assert ran[-1].startswith("fig, ax = plt.subplots")


@pytest.mark.parametrize(
    ("stage", "was", "wrong", "words"),
    [
        (
            "parameters",
            "0.5 * np.arctan2",
            "np.arctan2",
            "your functions put the foot of one line .* m apart",
        ),
        ("jacobians", "t - t.mean()", "t", "C of fit_line is not what line_jacobians makes it"),
    ],
)
def test_the_closing_run_stops_where_two_functions_disagree(stage, was, wrong, words, closing_run):
    """A mistake in one of the parts stops the run, which says what disagrees."""
    play, _ = closing_run
    with pytest.raises(AssertionError, match=words):
        play(**{stage: lambda text: text.replace(was, wrong)})


def test_the_release_stops_at_the_first_open_answer(tmp_path):
    """A release run as it is stops at the first cell that asks for an answer, after the whole derivation."""
    IT.hold_release_stops(tmp_path, "derive-fit-by-beam-1", "bent-line")
