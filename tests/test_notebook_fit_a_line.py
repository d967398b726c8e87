"""The notebook fit-a-line: its cells and points, its derivation, and its closing run."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import nbformat
import pytest
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

import notebooks
from roboloc.plotting import COLORS, plot_pose

mpl.use("Agg")
ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "solutions" / "line-extraction" / "fit-a-line.md"
RELEASE = ROOT / "notebooks" / "line-extraction" / "fit-a-line.ipynb"
PAGE = ROOT / "book" / "fitting-lines-to-a-scan.md"
TAGS = ("symbols", "conditions", "distance", "direction", "by-line", "by-beam")
POINTS = {
    "bent-line-test": 2,
    "by-left-test": 2,
    "fan-covariance-test": 3,
    "parameters-test": 6,
    "jacobians-test": 7,
    "fit-test": 5,
    "honest-answer": 5,
}
STAGES = ("parameters", "jacobians", "fit")


def source():
    """Return the source notebook."""
    return notebooks.name_cells(notebooks.splice(notebooks.read(SOURCE), ROOT))


def release():
    """Return the released notebook."""
    return nbformat.read(RELEASE, as_version=4)


def meta(cell):
    """Return nbgrader's metadata of a cell."""
    return cell.metadata.get("nbgrader", {})


def run(notebook, folder):
    """Run a notebook to its end or its first error, with a fixed secret."""
    client = NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(folder)}})
    return client.execute(env={"ROBOLOC_SECRET": "a course", "PATH": "/usr/bin:/bin", "HOME": str(folder)})


@pytest.fixture
def closing_run():
    """Return a function that runs the stages and the closing run, some cells changed; it keeps what it has run."""
    ran = []

    def play(**changes):
        notebook = source()
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
    cells = {meta(cell)["grade_id"]: cell for cell in source().cells if meta(cell)}
    graded = {name: meta(cell)["points"] for name, cell in cells.items() if meta(cell)["grade"]}
    assert graded == POINTS
    for name, points in graded.items():
        if name.endswith("-test"):
            assert f"Tested here ({points} points)" in cells[name].source
            assert f"points={points})" in cells[name].source
    assert f"{sum(graded.values())} points in all" in source().cells[0].source
    assert meta(cells["honest-question"])["task"]
    assert "(5 points, marked by a person)" in cells["honest-question"].source


def test_mark_scheme_adds_up():
    """The points of the mark scheme are those of the question, part by part."""
    (question,) = [c.source for c in source().cells if meta(c).get("grade_id") == "honest-question"]
    scheme = question.split("BEGIN MARK SCHEME")[1]
    assert [int(line.split()[1]) for line in scheme.splitlines() if line.startswith("* ")] == [2, 2, 1]


def test_derivation_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order."""
    page = notebooks.read(PAGE)
    tags = [f"derive-fit-{tag}" for tag in TAGS]
    expected = [cell.source for tag in tags for cell in page.cells if tag in cell.metadata.get("tags", [])]
    cells = [cell for cell in release().cells if meta(cell).get("grade_id", "").startswith("derive")]
    assert [cell.source for cell in cells] == expected
    assert all(meta(cell)["locked"] and cell.metadata.editable is False for cell in cells)


def test_the_solution_runs_and_earns_every_point(tmp_path):
    """The source notebook runs from top to bottom, draws slopes and walls, and its hidden tests give all points."""
    notebook = run(source(), tmp_path)
    scores = {}
    for cell in notebook.cells:
        if meta(cell).get("grade") and cell.cell_type == "code":
            (result,) = [output for output in cell.outputs if output.output_type == "execute_result"]
            scores[meta(cell)["grade_id"]] = float(result.data["text/plain"])
    assert scores == {name: points for name, points in POINTS.items() if name.endswith("-test")}
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 2
    assert not [output for output in outputs if output.output_type == "error"]
    assert not [output for output in outputs if output.get("name") == "stderr"]
    text = "".join(output.get("text", "") for output in outputs)
    assert "on a circle 3.1" in text
    assert text.count("known to") == 5


@pytest.mark.parametrize("stage", STAGES)
def test_the_closing_run_fails_visibly_without_a_stage(stage, closing_run):
    """With one stage as it is released, the closing run stops where the first line is to be drawn."""
    (stub,) = [cell.source for cell in release().cells if meta(cell).get("grade_id") == stage]
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
    notebook = release()
    with pytest.raises(CellExecutionError, match="NotImplementedError"):
        run(notebook, tmp_path)
    ran = [meta(cell).get("grade_id") for cell in notebook.cells if cell.get("execution_count")]
    assert "derive-fit-by-beam-1" in ran
    assert ran[-1] == "bent-line"
