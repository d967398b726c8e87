"""The released notebooks: fresh, empty of answers, and working from top to bottom once they are filled in."""

from __future__ import annotations

import ast
import filecmp
import re
from pathlib import Path

import nbformat
import pytest
from worked import meta

import notebooks

ROOT = Path(__file__).resolve().parents[1]
NAME = "ekf-localization/motion-model.ipynb"
RELEASED = sorted(path.relative_to(ROOT / "notebooks") for path in (ROOT / "notebooks").glob("*/*.ipynb"))
LONGEST = 10
IMPORTS = {"roboloc", "numpy", "sympy", "matplotlib", "math", "warnings"}
SCIPY = "four-filters/comparison.ipynb"  # the quantile of chi-squared; SciPy comes with roboloc


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


def text_of(path):
    """Return everything a reader of the file can see."""
    return path.read_text(encoding="utf-8")


def test_committed_releases_are_fresh(built):
    """Building again gives the committed files, byte for byte, and no other file."""
    new = sorted(path.relative_to(built / "notebooks") for path in (built / "notebooks").glob("*/*"))
    advice = "notebooks/ is not what solutions/ gives: run make notebooks and commit"
    assert new == RELEASED != [], advice
    assert all(
        filecmp.cmp(built / "notebooks" / path, ROOT / "notebooks" / path, shallow=False) for path in new
    ), advice


def test_building_twice_gives_the_same_bytes(built, tmp_path):
    """Nothing random and no time of day gets into a build."""
    notebooks.build(tmp_path / "source", tmp_path / "notebooks", only=[Path(NAME).parent.name])
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
    """The released cells import roboloc and, of the rest, numpy, sympy, matplotlib and warnings at most, one scipy."""
    cells = [cell.source for cell in read(ROOT / "notebooks" / path).cells if cell.cell_type == "code"]
    found = set()
    for node in (node for source in cells for node in ast.walk(ast.parse(source))):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module.partition(".")[0])
    allowed = IMPORTS | {"scipy"} if path == Path(SCIPY) else IMPORTS
    assert {"roboloc", "numpy"} <= found <= allowed


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
    folders = ["--source", str(tmp_path / "source"), "--output", str(tmp_path / "out")]
    options = [*folders, "--assignment", "bouncing-ball"]
    assert notebooks.main(options) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "source"]
    assert notebooks.main([*options, "--db", f"sqlite:///{tmp_path}/gradebook.db"]) == 0
    assert (tmp_path / "gradebook.db").stat().st_size > 0
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["bouncing-ball"]


def test_an_assignment_that_is_not_there_is_refused(tmp_path):
    """A misspelt assignment is named, and so are those there are."""
    with pytest.raises(ValueError, match=r"assignment: expected some of bouncing-ball, .* got bouncing"):
        notebooks.build(tmp_path / "source", tmp_path / "out", only=["bouncing"])
