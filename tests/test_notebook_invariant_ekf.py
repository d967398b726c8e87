"""The notebook invariant-ekf: its cells and points, its derivation, and its recorded drives."""

from __future__ import annotations

import re

import matplotlib as mpl
import pytest
from worked import Worked, outputs_of, run

mpl.use("Agg")
IT = Worked(
    "four-filters",
    "invariant-ekf",
    "the-invariant-filter",
    tuple(f"derive-invariant-{tag}" for tag in ("exp", "adjoint", "error", "landmark", "back")),
    {
        "f-left-test": 3, "h-antenna-test": 3, "b-left-test": 2, "predict-test": 6, "correct-test": 8,
        "transposed-answer": 4, "worth-answer": 4,
    },
)  # fmt: skip


def drive(**changes):
    """Run both stages and the recorded drives, some cells changed."""
    IT.play(("imports", "poses", "predict", "correct"), range(6, 7), changes)


def test_grade_cells_are_as_announced():
    """The graded cells, their points, and 30 points in all, as the notebook's first cell says."""
    IT.hold_points()


def test_mark_schemes_add_up():
    """The points of the mark schemes are those of the questions, part by part."""
    assert IT.mark_schemes() == {"transposed": [2, 2], "worth": [2, 2]}


def test_derivation_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the notebook's order."""
    IT.hold_derivation()


def test_the_solution_runs_and_earns_every_point(tmp_path):
    """The source runs to its end, is honest while blind and misled once, and its hidden tests give all points."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=1)
    text = "".join(output.get("text", "") for output in outputs_of(notebook))
    line = r"^(blind|first look|all) +NEES +([\d.]+), EKF +([\d.]+); error ([\d.]+) m, EKF ([\d.]+) m$"
    table = {name: tuple(map(float, row)) for name, *row in re.findall(line, text, re.MULTILINE)}
    assert 4.5 > table["blind"][0] < table["blind"][1] / 4
    assert table["first look"][0] > 5 * table["first look"][1]
    assert table["first look"][2] < table["first look"][3]
    assert abs(table["all"][2] - table["all"][3]) < 0.01
    looks = re.findall(r"([\d.]+) left, ([\d.]+) = e - sin e, ([\d.]+) claimed", text)
    assert len(looks) == 4
    assert all(abs(float(left) - float(rest)) < 3e-4 for left, rest, _ in looks)
    doubts = [float(level) for level in re.findall(r"doubt +\d+: NEES +([\d.]+)", text)]
    assert table["first look"][0] > 5 * doubts[0]
    assert doubts[0] > 6 > doubts[1]


@pytest.mark.parametrize("stage", ["predict", "correct"])
def test_the_drives_fail_visibly_without_a_stage(stage):
    """With one stage as it is released, the drives stop."""
    stub = IT.stub(stage)
    with pytest.raises(NotImplementedError):
        drive(**{stage: lambda _: stub})


@pytest.mark.parametrize(
    ("stage", "was", "wrong"),
    [("predict", "twist * dt", "0 * twist"), ("correct", "L @ off", "0 * L @ off")],
    ids=["no motion", "no correction"],
)
def test_the_drives_stop_where_a_stage_is_far_off(stage, was, wrong):
    """A filter that does not follow the robot is said not to."""

    def spoiled(text):
        assert was in text
        return text.replace(was, wrong)

    with pytest.raises(AssertionError, match="does not follow the robot"):
        drive(**{stage: spoiled})


def test_the_release_stops_at_the_first_open_answer(tmp_path):
    """A release run as it is stops at the first answer, after the derivation."""
    IT.hold_release_stops(tmp_path, "derive-invariant-back-1", "f-left")
