"""The notebook landmark-slam: its cells and points, its derivation, its runs, and what stops them."""

from __future__ import annotations

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from worked import Worked, outputs_of, run

mpl.use("Agg")
TAGS = ("symbols", "step", "noise", "sighting", "start", "look", "by-pose", "by-landmark")
IT = Worked(
    "ekf-slam",
    "landmark-slam",
    "slam-with-points",
    tuple(f"derive-points-{tag}" for tag in TAGS),
    {
        "mast-step-test": 1,
        "mast-noise-test": 2,
        "mast-sighting-test": 1,
        "mast-cross-test": 2,
        "mast-look-test": 1,
        "mast-by-pose-test": 2,
        "mast-by-landmark-test": 1,
        "init-test": 6,
        "predict-test": 6,
        "measurement-test": 6,
        "update-test": 8,
        "evaluate-test": 4,
        "correlation-answer": 4,
        "run-answer": 4,
        "noise-answer": 4,
        "scale-answer": 2,
    },
)
STAGES = ("init", "predict", "measurement", "update", "evaluate")


@pytest.fixture
def closing_run():
    """Return a function that runs the stages and the run over the log, one cell changed; it keeps what it has run."""
    ran = []

    def play(**changes):
        notebook = IT.source()
        places = {cell.id: i for i, cell in enumerate(notebook.cells)}
        first, last = (
            next(i for i, cell in enumerate(notebook.cells) if title in cell.source)
            for title in ("## 9. A run", "## 11. A study")
        )
        space = {}
        kept = [notebook.cells[places[name]] for name in ("imports", *STAGES)] + notebook.cells[first:last]
        for cell in (cell for cell in kept if cell.cell_type == "code"):
            ran.append(cell.source)
            exec(changes.get(cell.id, str)(cell.source), space)  # noqa: S102 - the notebook's own cells
        return space

    yield play, ran
    plt.close("all")


def test_grade_cells_of_landmark_slam_are_as_announced():
    """The graded cells, their points, and 54 points in all, as the notebook's first cell says."""
    IT.hold_points()


def test_mark_schemes_of_landmark_slam_add_up():
    """The points of a mark scheme are those of its question, part by part."""
    schemes = {"correlation": [2, 1, 1], "run": [1, 1, 1, 1], "noise": [1, 1, 1, 1], "scale": [1, 1]}
    assert IT.mark_schemes() == schemes


def test_derivation_of_landmark_slam_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order."""
    IT.hold_derivation()


def test_the_solution_finds_the_landmarks_and_earns_every_point(tmp_path):
    """The source runs to its end: all points, four pictures, and a study in which noise told too small does harm."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=4)
    text = "".join(output.get("text", "") for output in outputs_of(notebook))
    rows = [line.split() for line in text.splitlines() if line.startswith(("as it", "steps", "looks"))]
    off = {" ".join(row[:-5]): [float(word) for word in row[-5:]] for row in rows}
    assert set(off) == {"as it is", "steps x 10", "steps / 10", "looks x 10", "looks / 10"}
    for name, (map_off, claimed, mahalanobis, _, _) in off.items():
        assert (map_off > 0.5 and mahalanobis > 5 and claimed < 0.1) == name.endswith("/ 10")
    (inside,) = [
        output.data["text/plain"]
        for output in outputs_of(notebook)
        if "after the last step" in str(output.get("data"))
    ]
    assert int(inside.split("%")[0].split()[-1]) < 80


@pytest.mark.parametrize("stage", STAGES)
def test_the_run_over_the_log_fails_visibly_without_a_stage(stage, closing_run):
    """With one stage as it is released, the run stops before anything is drawn, and no other takes its place."""
    stub = IT.stub(stage)
    play, ran = closing_run
    with pytest.raises(NotImplementedError):
        play(**{stage: lambda _: stub})
    assert ran[-1].startswith("corrected, predicted = slam()")


def test_the_run_over_the_log_takes_what_a_student_returns(closing_run):
    """Stages that return lists run as well, and end at the same place."""
    play, _ = closing_run
    arrays, lists = play(), None

    def listed(text):
        return text.replace("return x + step, ", "return (x + step).tolist(), ")

    lists = play(predict=listed)
    np.testing.assert_array_equal(arrays["x_end"], lists["x_end"])


def test_the_release_of_landmark_slam_stops_at_the_first_open_answer(tmp_path):
    """A release run as it is stops at the first cell that asks for an answer, after the whole derivation."""
    IT.hold_release_stops(tmp_path, "derive-points-by-landmark-1", "mast-step")
