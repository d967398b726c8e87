"""The notebook line-measurements: its cells and points, its derivation, and its closing run."""

from __future__ import annotations

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

import notebooks

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "solutions" / "ekf-localization" / "line-measurements.md"
RELEASE = ROOT / "notebooks" / "ekf-localization" / "line-measurements.ipynb"
PAGE = ROOT / "book" / "lines-seen-from-a-robot.md"
TAGS = ("derive-line-symbols", "derive-line-h", "derive-line-jacobian", "derive-line-sides")
POINTS = {
    "upside-h-test": 2,
    "upside-hx-test": 2,
    "upside-mount-test": 3,
    "transform-test": 8,
    "normalize-test": 5,
    "predicted-test": 5,
    "doorway-answer": 5,
}
FUNCTIONS = {
    "transform": "transform_line_to_scanner_frame",
    "normalize": "normalize_line_parameters",
    "predicted": "compute_predicted_measurements",
}


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


def without_tests(notebook):
    """Take out hidden tests and public checks, which would say first what is wrong."""
    notebook.cells = [c for c in notebook.cells if not meta(c).get("grade") and "check(" not in c.source]
    return notebook


def replaced(name, text):
    """Return the source notebook with another answer in one cell, its tests taken out."""
    notebook = source()
    for cell in notebook.cells:
        if meta(cell).get("grade_id") == name:
            cell.source = text(cell.source)
    return without_tests(notebook)


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
    assert meta(cells["doorway-question"])["task"]
    assert "(5 points, marked by a person)" in cells["doorway-question"].source


def test_mark_scheme_adds_up():
    """The points of the mark scheme are those of the question, part by part."""
    (question,) = [c.source for c in source().cells if meta(c).get("grade_id") == "doorway-question"]
    scheme = question.split("BEGIN MARK SCHEME")[1]
    assert [int(line.split()[1]) for line in scheme.splitlines() if line.startswith("* ")] == [1, 2, 2]


def test_derivation_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order."""
    page = notebooks.read(PAGE)
    expected = [cell.source for tag in TAGS for cell in page.cells if tag in cell.metadata.get("tags", [])]
    cells = [cell for cell in release().cells if meta(cell).get("grade_id", "").startswith("derive")]
    assert [cell.source for cell in cells] == expected
    assert all(meta(cell)["locked"] and cell.metadata.editable is False for cell in cells)


def test_the_solution_runs_and_earns_every_point(tmp_path):
    """The source notebook runs from top to bottom, draws the doorway, and its hidden tests give all points."""
    notebook = run(source(), tmp_path)
    scores = {}
    for cell in notebook.cells:
        if meta(cell).get("grade") and cell.cell_type == "code":
            (result,) = [output for output in cell.outputs if output.output_type == "execute_result"]
            scores[meta(cell)["grade_id"]] = float(result.data["text/plain"])
    assert scores == {name: points for name, points in POINTS.items() if name.endswith("-test")}
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 1
    assert not [output for output in outputs if output.output_type in {"stream", "error"}]


@pytest.mark.parametrize("stage", FUNCTIONS)
def test_the_closing_run_fails_visibly_without_a_stage(stage, tmp_path):
    """With one stage as it is released, the closing run stops; of the last one the filter shell says its name."""
    (stub,) = [cell.source for cell in release().cells if meta(cell).get("grade_id") == stage]
    notebook = replaced(stage, lambda _: stub)
    words = (
        "compute_predicted_measurements: not written yet" if stage == "predicted" else "NotImplementedError"
    )
    with pytest.raises(CellExecutionError, match=words):
        run(notebook, tmp_path)
    ran = [cell.source for cell in notebook.cells if cell.get("execution_count")]
    assert ran[-1].startswith("rng = np.random.default_rng")


def test_the_closing_run_stops_where_two_functions_disagree(tmp_path):
    """A normalisation that keeps the angle stops the run, which says at which line two functions disagree."""
    notebook = replaced(
        "normalize", lambda text: text.replace("angle = h[0] + np.pi * beyond", "angle = h[0]")
    )
    with pytest.raises(CellExecutionError, match=r"line \d+: your functions predict feet .* m apart"):
        run(notebook, tmp_path)


def test_the_release_stops_at_the_first_open_answer(tmp_path):
    """A release run as it is stops at the first cell that asks for an answer, after the whole derivation."""
    notebook = release()
    with pytest.raises(CellExecutionError, match="NotImplementedError"):
        run(notebook, tmp_path)
    ran = [meta(cell).get("grade_id") for cell in notebook.cells if cell.get("execution_count")]
    assert "derive-line-sides-1" in ran
    assert ran[-1] == "upside-h"
