"""The notebook comparison: its cells and points, its derivation, and its run over the recorded estimates."""

from __future__ import annotations

import re

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
from worked import Worked, outputs_of, run

mpl.use("Agg")
IT = Worked(
    "four-filters",
    "comparison",
    "four-filters-one-run",
    ("derive-claims",),
    {
        **{f"{name}-test": 2 for name in ("e-nees", "p-inside", "var-difference")},
        "rms-test": 5,
        "coverage-test": 5,
        "mean-test": 4,
        "paired-test": 5,
        "better-answer": 4,
        "printed-answer": 4,
    },
)
STAGES = ("rms", "coverage", "mean", "paired")


@pytest.fixture
def judge():
    """Return a function that runs the stages and section 6 up to its table, some cells changed."""

    def play(**changes):
        notebook = IT.source()
        places = {cell.id: cell for cell in notebook.cells}
        space = {}
        for name in ("imports", *STAGES):
            exec(changes.get(name, places[name].source), space)  # noqa: S102 - the notebook's own cells
        for cell in notebook.cells:
            if cell.source.startswith(("import matplotlib", "def away", "for name in")):
                exec(cell.source, space)  # noqa: S102

    yield play
    plt.close("all")


def test_grade_cells_are_as_announced():
    """The graded cells, their points, and 33 points in all, as the notebook's first cell says."""
    IT.hold_points()


def test_mark_schemes_add_up():
    """The points of the mark schemes are those of the questions, part by part."""
    assert IT.mark_schemes() == {"better": [2, 2], "printed": [2, 2]}


def test_derivation_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order."""
    IT.hold_derivation()


def test_the_solution_runs_and_earns_every_point(tmp_path):
    """The source runs to its end, judges four filters twice, and its hidden tests give all points."""
    notebook = run(IT.source(), tmp_path)
    IT.hold_full_marks(notebook, pictures=1)
    text = "".join(output.get("text", "") for output in outputs_of(notebook))
    line = r"^(eight|unsure) +(\w+) .*NEES +([\d.]+) .*inside ([\d.]+), .* ([+-]\S+) to (\S+) cm2$"
    rows = re.findall(line, text, re.MULTILINE)
    table = {(name, key): tuple(map(float, numbers)) for name, key, *numbers in rows}
    assert len(table) == 8
    for key in ("EKF", "UKF", "PF", "InEKF"):
        assert table["eight", key][1] > 0.9 > table["unsure", key][1] + 0.05
    assert table["eight", "EKF"][2:] == (0, 0)
    assert table["eight", "UKF"][2] <= 0 <= table["eight", "UKF"][3]
    assert all(table["eight", key][2] > 0 for key in ("PF", "InEKF"))
    parts = re.findall(r"^(\w+) +NEES blind +([\d.]+) .* then +([\d.]+)", text, re.MULTILINE)
    blind, after = ({key: float(row[i]) for key, *row in parts} for i in (0, 1))
    assert blind["EKF"] > blind["UKF"] > 5 > max(blind["PF"], blind["InEKF"])
    assert min(after["PF"], after["InEKF"]) > 10 > max(after["EKF"], after["UKF"])
    told = r"\+- ([\d.]+) as if independent, \+- ([\d.]+) from the runs; .* (\S+) to (\S+) cm2"
    broken = [tuple(map(float, row)) for row in re.findall(told, text)]
    assert len(broken) == 4
    assert broken[0][1] > 3 * broken[0][0]
    assert all(alone < runs and low < 0 < high for alone, runs, low, high in broken)


@pytest.mark.parametrize("stage", STAGES)
def test_the_table_fails_visibly_without_a_stage(stage, judge):
    """With one stage as it is released, the table stops."""
    with pytest.raises(NotImplementedError):
        judge(**{stage: IT.stub(stage)})


def test_the_table_is_made_by_the_students_own_stages(judge, capsys):
    """A coverage of a half is printed as a half."""
    judge(coverage="def coverage(errors, covs, probability):\n    return np.full(errors.shape[1], 0.5)")
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 8
    assert all("inside 0.500" in line for line in lines)


def test_the_release_stops_at_the_first_open_answer(tmp_path):
    """A release run as it is stops at the first answer, after the derivation."""
    IT.hold_release_stops(tmp_path, "derive-claims-2", "e-nees")
