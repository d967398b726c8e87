"""The notebook association-and-update: its points, its derivation, its run, and what stops it."""

from __future__ import annotations

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

import notebooks
import sample_class

ROOT = Path(__file__).resolve().parents[1]
NAME = "association-and-update"


def meta(cell):
    """Return nbgrader's metadata of a cell."""
    return cell.metadata.get("nbgrader", {})


@pytest.fixture
def source():
    """Build the source notebook from the text."""
    text = notebooks.read(ROOT / "solutions" / "ekf-localization" / f"{NAME}.md")
    return notebooks.name_cells(notebooks.splice(text, ROOT))


def run(notebook, folder, *, allow_errors=False):
    """Run a notebook to its end with a fixed secret."""
    resources = {"metadata": {"path": str(folder)}}
    client = NotebookClient(notebook, timeout=300, resources=resources, allow_errors=allow_errors)
    return client.execute(env={"ROBOLOC_SECRET": "a course", "PATH": "/usr/bin:/bin", "HOME": str(folder)})


def text_of(cell):
    """Return what a cell wrote and raised."""
    outputs = cell.get("outputs", [])
    return "".join(output.get("text", "") + output.get("evalue", "") for output in outputs)


def test_grade_cells_of_association_are_as_announced(source):
    """The graded cells, their points, and 30 points in all, as the notebook's first cell says."""
    cells = {meta(cell)["grade_id"]: cell for cell in source.cells if meta(cell)}
    graded = {name: meta(cell)["points"] for name, cell in cells.items() if meta(cell)["grade"]}
    assert graded == {
        "gate-share-test": 2,
        "wall-gain-test": 2,
        "wall-covariance-test": 3,
        "innovations-test": 8,
        "stack-test": 4,
        "update-test": 6,
        "motions-answer": 5,
    }
    for name, points in graded.items():
        if name.endswith("-test"):
            assert f"Tested here ({points} points)" in cells[name].source
            assert f"points={points})" in cells[name].source
    assert f"{sum(graded.values())} points in all" in source.cells[0].source
    assert meta(cells["motions-question"])["task"]


def test_derivation_of_association_is_that_of_the_page(source):
    """The locked cells of the derivation are the page's cells, in the page's order."""
    page = notebooks.read(ROOT / "book" / "ekf-localization-with-lines.md")
    tags = ("derive-distance", "derive-gate", "derive-gain")
    expected = [cell.source for tag in tags for cell in page.cells if tag in cell.metadata.get("tags", [])]
    cells = [cell for cell in source.cells if meta(cell).get("grade_id", "").startswith("derive")]
    assert [cell.source for cell in cells] == expected
    assert len(expected) == 6
    assert all(meta(cell)["locked"] and cell.metadata.editable is False for cell in cells)


def test_the_solution_earns_every_point_and_finds_its_way(source, tmp_path):
    """The source runs to its end: all points, the maze to centimetres, one row of pictures, and a table that tells."""
    notebook = run(source, tmp_path)
    scores = {}
    for cell in notebook.cells:
        if meta(cell).get("grade") and cell.cell_type == "code":
            (result,) = [output for output in cell.outputs if output.output_type == "execute_result"]
            scores[meta(cell)["grade_id"]] = float(result.data["text/plain"])
            assert scores[meta(cell)["grade_id"]] == meta(cell)["points"]
    assert len(scores) == 6
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 1
    texts = [text_of(cell) for cell in notebook.cells]
    (matched,) = [text for text in texts if text.endswith("lines matched a wall\n")]
    few, many = (int(word) for word in matched.split() if word.isdigit())
    assert few > 0.97 * many > 1000
    (ends,) = [text for text in texts if "open loop: " in text]
    worst = {line.partition(":")[0]: float(line.split(": ")[1].split()[0]) for line in ends.splitlines()}
    assert worst["EKF"] < 0.1
    assert worst["open loop"] > 1
    (table,) = [text for text in texts if "claimed [m]" in text]
    miss = {line[35:].strip(): float(line.split()[0]) for line in table.splitlines()[1:]}
    right = [name for name, error in miss.items() if error < 0.02]
    assert [name for name in right if "raised" in name] == [name for name in miss if "raised" in name] != []
    assert right[0] == "as recorded"
    assert len(right) == 4
    assert len(miss) == 8


@pytest.mark.parametrize(
    ("missing", "words"),
    [
        (
            ["earlier-lines"],
            "stage compute_predicted_measurements: not written yet (it is written in the notebook line-",
        ),
        (
            ["earlier-dynamics"],
            "stage compute_dynamics: not written yet (it is written in the notebook motion-model)",
        ),
        (["innovations"], "stage compute_innovations: not written yet"),
    ],
)
def test_a_missing_stage_stops_the_run_and_names_its_notebook(missing, words, tmp_path, source):
    """Nothing stands in for a stage that is not there, and the points of the others do not depend on it."""
    answers = sample_class.solutions(source)
    notebook = nbformat.read(ROOT / "notebooks" / "ekf-localization" / f"{NAME}.ipynb", as_version=4)
    for cell in notebook.cells:
        name = meta(cell).get("grade_id")
        if name in answers and name not in missing:
            cell.source = answers[name]
    executed = run(notebook, tmp_path, allow_errors=True)
    (stopped,) = [cell for cell in executed.cells if cell.source.startswith("def localize")]
    assert words in text_of(stopped)
