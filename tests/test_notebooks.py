"""The released notebooks: fresh, empty of answers, and working from top to bottom once they are filled in."""

from __future__ import annotations

import ast
import filecmp
import re
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

import notebooks

ROOT = Path(__file__).resolve().parents[1]
NAME = "ekf-localization/motion-model.ipynb"
RELEASED = sorted(path.relative_to(ROOT / "notebooks") for path in (ROOT / "notebooks").glob("*/*.ipynb"))
LONGEST = 10
IMPORTS = {"roboloc", "numpy", "sympy", "matplotlib"}


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Build everything from the sources into a fresh folder."""
    folder = tmp_path_factory.mktemp("build")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PATH", "")
        notebooks.build(folder / "source", folder / "notebooks")
    return folder


def read(path):
    """Read a notebook as it is."""
    return nbformat.read(path, as_version=4)


def run(notebook, folder):
    """Run a notebook to its end, errors and all, with a fixed secret."""
    client = NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(folder)}})
    return client.execute(env={"ROBOLOC_SECRET": "a course", "PATH": "/usr/bin:/bin", "HOME": str(folder)})


def meta(cell):
    """Return nbgrader's metadata of a cell."""
    return cell.metadata.get("nbgrader", {})


def text_of(path):
    """Return everything a reader of the file can see."""
    return path.read_text(encoding="utf-8")


def test_committed_releases_are_fresh(built):
    """Building again gives the committed files, byte for byte, and no other file."""
    new = sorted(path.relative_to(built / "notebooks") for path in (built / "notebooks").glob("*/*"))
    assert new == RELEASED != []
    assert all(
        filecmp.cmp(built / "notebooks" / path, ROOT / "notebooks" / path, shallow=False) for path in new
    )


def test_building_twice_gives_the_same_bytes(built, tmp_path):
    """Nothing random and no time of day gets into a build."""
    notebooks.build(tmp_path / "source", tmp_path / "notebooks")
    for kind in ("source", "notebooks"):
        assert filecmp.cmp(built / kind / NAME, tmp_path / kind / NAME, shallow=False)


def test_every_source_has_a_release():
    """Each text source leads to one notebook of the same name."""
    sources = [
        path.relative_to(ROOT / "solutions").with_suffix(".ipynb") for path in ROOT.glob("solutions/*/*.md")
    ]
    assert sorted(sources) == RELEASED


@pytest.mark.parametrize("path", RELEASED, ids=str)
def test_releases_hold_nothing_to_hide(path):
    """A release has no outputs, no solution, no hidden test, no mark scheme and no name of the grader's."""
    notebook = read(ROOT / "notebooks" / path)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(cell.outputs == [] and cell.execution_count is None for cell in code)
    text = text_of(ROOT / "notebooks" / path)
    for word in (
        "SOLUTION",
        "HIDDEN TEST",
        "MARK SCHEME",
        "autograder",
        "roboloc_reference",
        "grade_expression",
    ):
        assert word not in text, word
    for cell in notebook.cells:
        if meta(cell).get("solution"):
            assert "YOUR CODE HERE" in cell.source or cell.source == "YOUR ANSWER HERE"


@pytest.mark.parametrize("path", RELEASED, ids=str)
def test_no_line_of_a_solution_is_released(path, built):
    """No line of code between the solution markers is anywhere in the release."""
    text = text_of(ROOT / "notebooks" / path)
    count = 0
    for cell in read(built / "source" / path).cells:
        for body in re.findall(
            r"BEGIN (?:SOLUTION|MARK SCHEME)[^\n]*\n(.*?)[^\n]*END", cell.source, re.DOTALL
        ):
            for line in filter(lambda line: len(line) > 20, map(str.strip, body.splitlines())):
                count += 1
                assert line.replace("\\", "\\\\").replace('"', '\\"') not in text, line
    assert count > 20


@pytest.mark.parametrize("path", RELEASED, ids=str)
def test_cells_are_short(path, built):
    """A cell has at most ten lines of code to read, its docstring and blank lines aside, and a solution ten."""
    for cell in read(ROOT / "notebooks" / path).cells:
        if cell.cell_type == "code":
            assert len(cell.source.splitlines()) <= LONGEST, cell.source
    for cell in read(built / "source" / path).cells:
        for body in re.findall(r"### BEGIN SOLUTION\n(.*?)### END SOLUTION", cell.source, re.DOTALL):
            assert len(body.rstrip().splitlines()) <= LONGEST, cell.source


@pytest.mark.parametrize("path", RELEASED, ids=str)
def test_students_need_only_what_they_may_import(path):
    """The released cells import roboloc, numpy, sympy and matplotlib, and nothing else."""
    cells = [cell.source for cell in read(ROOT / "notebooks" / path).cells if cell.cell_type == "code"]
    found = set()
    for node in (node for source in cells for node in ast.walk(ast.parse(source))):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module.partition(".")[0])
    assert found == IMPORTS


def test_grade_cells_are_as_announced(built):
    """The graded cells, their points, and 30 points in all, as the notebook's first cell says."""
    cells = {meta(cell)["grade_id"]: cell for cell in read(built / "source" / NAME).cells if meta(cell)}
    graded = {name: meta(cell)["points"] for name, cell in cells.items() if meta(cell)["grade"]}
    assert graded == {
        "wheels-g-test": 2,
        "wheels-gx-test": 2,
        "wheels-gu-test": 2,
        "wheels-limit-test": 3,
        "dynamics-test": 10,
        "transition-test": 6,
        "switch-answer": 5,
    }
    for name, points in graded.items():
        if name.endswith("-test"):
            assert f"Tested here ({points} points)" in cells[name].source
            assert f"points={points})" in cells[name].source
    assert f"{sum(graded.values())} points in all" in read(built / "source" / NAME).cells[0].source
    assert meta(cells["switch-question"])["task"]


def test_derivation_is_that_of_the_page():
    """The locked cells of the derivation are the page's cells, in the page's order."""
    page = notebooks.read(ROOT / "book" / "motion-and-the-limit.md")
    tags = ("derive-symbols", "derive-g", "derive-jacobians", "derive-limits")
    expected = [cell.source for tag in tags for cell in page.cells if tag in cell.metadata.get("tags", [])]
    cells = [
        cell
        for cell in read(ROOT / "notebooks" / NAME).cells
        if meta(cell).get("grade_id", "").startswith("derive")
    ]
    assert [cell.source for cell in cells] == expected
    assert all(meta(cell)["locked"] and cell.metadata.editable is False for cell in cells)


def test_the_solution_runs_and_earns_every_point(built, tmp_path):
    """The source notebook runs from top to bottom, draws the drive, and its hidden tests give all points."""
    notebook = run(read(built / "source" / NAME), tmp_path)
    scores = {}
    for cell in notebook.cells:
        if meta(cell).get("grade") and cell.cell_type == "code":
            (result,) = [output for output in cell.outputs if output.output_type == "execute_result"]
            scores[meta(cell)["grade_id"]] = float(result.data["text/plain"])
            assert scores[meta(cell)["grade_id"]] == meta(cell)["points"]
    assert len(scores) == 6
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 1
    assert not [output for output in outputs if output.output_type in {"stream", "error"}]


@pytest.mark.parametrize("stage", ["dynamics", "transition"])
def test_the_drive_fails_visibly_without_a_stage(stage, built, tmp_path):
    """With one stage as it is released, the closing run stops and names that stage."""
    source, released = read(built / "source" / NAME), read(built / "notebooks" / NAME)
    stub = next(cell for cell in released.cells if meta(cell).get("grade_id") == stage)
    for cell in source.cells:
        if meta(cell).get("grade_id") == stage:
            cell.source = stub.source
    # The hidden tests and public checks say it too; here the drive itself must.
    source.cells = [
        cell for cell in source.cells if not meta(cell).get("grade") and "check(" not in cell.source
    ]
    function = {"dynamics": "compute_dynamics", "transition": "transition_update"}[stage]
    with pytest.raises(CellExecutionError, match=f"stage {function}: not written yet"):
        run(source, tmp_path)


def test_the_release_stops_at_the_first_open_answer(built, tmp_path):
    """A release run as it is stops at the first cell that asks for an answer, after the whole derivation."""
    notebook = read(built / "notebooks" / NAME)
    with pytest.raises(CellExecutionError, match="NotImplementedError"):
        run(notebook, tmp_path)
    ran = [meta(cell).get("grade_id") for cell in notebook.cells if cell.get("execution_count")]
    assert "derive-limits-3" in ran
    assert ran[-1] == "wheels-g"


def page(folder, text):
    """Write a page of one tagged cell and return a notebook with the given markdown cell."""
    (folder / "page.md").write_text(
        "---\njupytext:\n  text_representation:\n    format_name: myst\n---\n\n"
        "```{code-cell} ipython3\n:tags: [one]\nx = 1\n```\n"
    )
    return nbformat.v4.new_notebook(cells=[nbformat.v4.new_markdown_cell(text)])


def test_splice_puts_the_cell_in_place(tmp_path):
    """A marker becomes a locked code cell with a name made of its tag."""
    (cell,) = notebooks.splice(page(tmp_path, "<!-- splice: page.md one -->"), tmp_path).cells
    assert (cell.cell_type, cell.source, meta(cell)["grade_id"]) == ("code", "x = 1", "one-1")
    assert meta(cell)["locked"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<!-- splice: page.md two -->", "expected a code cell tagged two, got none"),
        ("<!-- splice: other.md one -->", "expected a page of the book, got other.md"),
        ("See <!-- splice: page.md one -->", "expected a marker alone in its cell"),
    ],
)
def test_splice_refuses_what_it_cannot_follow(text, message, tmp_path):
    """A marker that leads nowhere stops the build and says why."""
    notebook = page(tmp_path, text)
    with pytest.raises(ValueError, match=message):
        notebooks.splice(notebook, tmp_path)


def test_release_reports_what_nbgrader_reports(tmp_path):
    """A solution region in a cell that is no solution cell stops the release with nbgrader's reason."""
    cell = nbformat.v4.new_code_cell("### BEGIN SOLUTION\nx = 1\n### END SOLUTION")
    (tmp_path / "source" / "a").mkdir(parents=True)
    notebook = notebooks.name_cells(nbformat.v4.new_notebook(cells=[cell]))
    nbformat.write(notebook, tmp_path / "source" / "a" / "n.ipynb")
    with pytest.raises(RuntimeError, match="nbgrader could not release a"):
        notebooks.release(tmp_path / "source", tmp_path / "out", ["a"])
    assert not (tmp_path / "out").exists()


def test_the_gradebook_is_touched_only_when_asked(tmp_path):
    """With --db the given gradebook learns of the assignment, without it none is made."""
    options = ["--source", str(tmp_path / "source"), "--output", str(tmp_path / "out")]
    assert notebooks.main(options) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "source"]
    assert notebooks.main([*options, "--db", f"sqlite:///{tmp_path}/gradebook.db"]) == 0
    assert (tmp_path / "gradebook.db").stat().st_size > 0
