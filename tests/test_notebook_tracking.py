"""The notebook tracking: its cells and points, its derivation, its throw, and what stops it."""

from __future__ import annotations

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

import notebooks

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "solutions" / "bouncing-ball" / "tracking.md"
RELEASE = ROOT / "notebooks" / "bouncing-ball" / "tracking.ipynb"
PAGE = ROOT / "book" / "a-ball-that-bounces.md"
TAGS = (
    "derive-ball-flight",
    "derive-ball-time",
    "derive-ball-through",
    "derive-ball-saltation",
    "derive-ball-rest",
)
POINTS = {
    "slope-time-test": 2,
    "slope-velocity-test": 2,
    "slope-saltation-test": 3,
    "predict-test": 10,
    "correct-test": 6,
    "impact-answer": 3,
    "honesty-answer": 4,
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


def test_grade_cells_of_tracking_are_as_announced():
    """The graded cells, their points, and 30 points in all, as the notebook's first cell says."""
    cells = {meta(cell)["grade_id"]: cell for cell in source().cells if meta(cell)}
    graded = {name: meta(cell)["points"] for name, cell in cells.items() if meta(cell)["grade"]}
    assert graded == POINTS
    for name, points in graded.items():
        if name.endswith("-test"):
            assert f"Tested here ({points} points)" in cells[name].source
            assert f"points={points})" in cells[name].source
        else:
            question = cells[name.replace("answer", "question")]
            assert meta(question)["task"]
            assert f"({points} points, marked by a person)" in question.source
    assert f"{sum(graded.values())} points in all" in source().cells[0].source


def test_mark_schemes_of_tracking_add_up():
    """The points of a mark scheme are those of its question, part by part."""
    for name in ("impact", "honesty"):
        (question,) = [c.source for c in source().cells if meta(c).get("grade_id") == f"{name}-question"]
        scheme = question.split("BEGIN MARK SCHEME")[1]
        parts = [int(line.split()[1]) for line in scheme.splitlines() if line.startswith("* ")]
        assert sum(parts) == POINTS[f"{name}-answer"]


def test_derivation_of_tracking_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order."""
    page = notebooks.read(PAGE)
    expected = [cell.source for tag in TAGS for cell in page.cells if tag in cell.metadata.get("tags", [])]
    cells = [cell for cell in release().cells if meta(cell).get("grade_id", "").startswith("derive")]
    assert [cell.source for cell in cells] == expected
    assert all(meta(cell)["locked"] and cell.metadata.editable is False for cell in cells)


def test_the_solution_tracks_the_ball_and_earns_every_point(tmp_path):
    """The source runs to its end: all points, two pictures, and numbers that tell the three filters apart."""
    notebook = run(source(), tmp_path)
    scores, texts = {}, []
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            assert output.output_type not in {"stream", "error"}
            if output.output_type == "execute_result":
                text = output.data["text/plain"]
                texts.append(text)
                if meta(cell).get("grade"):
                    scores[meta(cell)["grade_id"]] = float(text)
    assert scores == {name: points for name, points in POINTS.items() if name.endswith("-test")}
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 2
    (off,) = [text for text in texts if "behind the box" in text]
    assert max(float(word) for word in off.split() if word.startswith("0.")) < 0.1
    (errors,) = [eval(text)["error of height [m]"] for text in texts if "end of the step" in text]  # noqa: S307
    assert errors["your filter"] < 0.05
    assert abs(errors["jump alone"] - errors["your filter"]) < 0.005
    assert errors["end of the step"] > 0.2


@pytest.mark.parametrize("stage", ["predict", "correct"])
def test_the_throw_stops_without_a_stage(stage, tmp_path):
    """With one stage as it is released, the closing run stops where it calls it, and no other takes its place."""
    (stub,) = [cell.source for cell in release().cells if meta(cell).get("grade_id") == stage]
    notebook = source()
    for cell in notebook.cells:
        if meta(cell).get("grade_id") == stage:
            cell.source = stub
    notebook = without_tests(notebook)
    with pytest.raises(CellExecutionError, match="NotImplementedError"):
        run(notebook, tmp_path)
    ran = [cell.source for cell in notebook.cells if cell.get("execution_count")]
    assert ran[-1].startswith("truth, zs = throw")


def test_the_release_of_tracking_stops_at_the_first_open_answer(tmp_path):
    """A release run as it is stops at the first cell that asks for an answer, after the whole derivation."""
    notebook = release()
    with pytest.raises(CellExecutionError, match="NotImplementedError"):
        run(notebook, tmp_path)
    ran = [meta(cell).get("grade_id") for cell in notebook.cells if cell.get("execution_count")]
    assert "derive-ball-rest-1" in ran
    assert ran[-1] == "slope-time"
