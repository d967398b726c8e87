"""The notebook particle-filter: its cells and points, its derivation, and its recorded drive."""

from __future__ import annotations

import re

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
from worked import Worked, outputs_of, run

mpl.use("Agg")
IT = Worked(
    "four-filters",
    "particle-filter",
    "a-cloud-of-robots",
    tuple(f"derive-thin-{tag}" for tag in ("mean", "share", "logs")),
    {
        "n-two-test": 2, "share-off-test": 3, "predict-test": 6, "correct-test": 8, "size-test": 3,
        "when-answer": 4, "thin-answer": 4,
    },
)  # fmt: skip
STAGES = ("predict", "correct", "size")


@pytest.fixture
def drive():
    """Return a function that runs the stages and the recorded drive, some cells changed."""
    yield lambda **changes: IT.play(("imports", *STAGES), range(7, 8), changes)
    plt.close("all")


def test_grade_cells_are_as_announced():
    """The graded cells, their points, and 30 points in all, as the notebook's first cell says."""
    IT.hold_points()


def test_mark_schemes_add_up():
    """The points of the mark schemes are those of the questions, part by part."""
    assert IT.mark_schemes() == {"when": [2, 2], "thin": [2, 2]}


def test_derivation_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the notebook's order."""
    IT.hold_derivation()


def test_the_solution_runs_and_earns_every_point(tmp_path):
    """The source runs to its end, follows the robot, shows both deaths, and its hidden tests give all points."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=1)
    text = "".join(output.get("text", "") for output in outputs_of(notebook))
    assert float(re.search(r"error ([\d.]+) m; resampled", text)[1]) < 0.1
    never, half, _ = (
        (float(a), float(b)) for a, b in re.findall(r"error ([\d.]+) m, size .* +([\d.]+)\n", text)
    )
    assert never[0] > 2 * half[0]
    assert never[1] < 5
    assert half[1] > 100
    (right, wide), *_, (sure, thin) = (
        (float(a), float(b)) for a, b in re.findall(r"error +(\d+) cm, the cloud is +([\d.]+) cm", text)
    )
    assert sure > 5 * right
    assert thin < wide / 8


@pytest.mark.parametrize("stage", STAGES)
def test_the_drive_fails_visibly_without_a_stage(stage, drive):
    """With one stage as it is released, the drive stops."""
    stub = IT.stub(stage)
    with pytest.raises(NotImplementedError):
        drive(**{stage: lambda _: stub})


@pytest.mark.parametrize(
    ("stage", "was", "wrong"),
    [("predict", "phi = v * dt", "phi = 0 * v"), ("correct", "- 0.5 *", "- 0.0 *")],
    ids=["no motion", "no weighing"],
)
def test_the_drive_stops_where_a_stage_is_far_off(stage, was, wrong, drive):
    """A cloud that does not follow the robot is said not to."""

    def spoiled(text):
        assert was in text
        return text.replace(was, wrong)

    with pytest.raises(AssertionError, match="does not follow the robot"):
        drive(**{stage: spoiled})


def test_the_release_stops_at_the_first_open_answer_that_is_needed(tmp_path):
    """A release run as it is stops at the first answer, after the derivation."""
    IT.hold_release_stops(tmp_path, "derive-thin-share-2", "n-two")
