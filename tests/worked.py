"""What every graded notebook is held to: its points, its derivation, full marks, and where it stops."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import nbformat
import pytest
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

import notebooks
from autograder.roles import EXTRA

if TYPE_CHECKING:
    from collections.abc import Callable

    from nbformat import NotebookNode

ROOT = Path(__file__).resolve().parents[1]


def meta(cell: NotebookNode) -> NotebookNode:
    """Return nbgrader's metadata of a cell."""
    return cell.metadata.get("nbgrader", {})


def run(notebook: NotebookNode, folder: Path, *, allow_errors: bool = False) -> NotebookNode:
    """Run a notebook to its end, or its first error, with a fixed secret."""
    resources = {"metadata": {"path": str(folder)}}
    client = NotebookClient(notebook, timeout=300, resources=resources, allow_errors=allow_errors)
    places = {"PATH": "/usr/bin:/bin", "HOME": str(folder)}
    return client.execute(env=places | {"ROBOLOC_SECRET": "a course", "OPENBLAS_NUM_THREADS": "1"})


def outputs_of(notebook: NotebookNode) -> list[NotebookNode]:
    """Return all outputs of a notebook."""
    return [output for cell in notebook.cells for output in cell.get("outputs", [])]


@dataclass(frozen=True)
class Worked:
    """A notebook as its author says it is.

    Attributes
    ----------
    assignment, name : str
        Which.
    page : str
        The page of the book that holds its derivation.
    tags : tuple of str
        The tags of the derivation's cells on that page, in order.
    points : dict of str to int
        Points of its graded cells, tests and written answers, in order.
    extra : dict of str to int
        What its cells of 0 points give as extra credit.
    """

    assignment: str
    name: str
    page: str
    tags: tuple[str, ...]
    points: dict[str, int]
    extra: dict[str, int] = field(default_factory=dict)

    def source(self) -> NotebookNode:
        """Return the source notebook, made anew."""
        text = notebooks.read(ROOT / "solutions" / self.assignment / f"{self.name}.md")
        return notebooks.name_cells(notebooks.splice(text, ROOT))

    def release(self) -> NotebookNode:
        """Return the released notebook."""
        return nbformat.read(ROOT / "notebooks" / self.assignment / f"{self.name}.ipynb", as_version=4)

    def stub(self, grade_id: str) -> str:
        """Return what the release holds in a cell of the student's."""
        (found,) = [cell.source for cell in self.release().cells if meta(cell).get("grade_id") == grade_id]
        return found

    def untested(self, grade_id: str, change: Callable[[str], str]) -> NotebookNode:
        """Return the source with another answer in one cell.

        Hidden tests and public checks are taken out: they would say first what is wrong.
        """
        notebook = self.source()
        for cell in notebook.cells:
            if meta(cell).get("grade_id") == grade_id:
                cell.source = change(cell.source)
        notebook.cells = [c for c in notebook.cells if not meta(c).get("grade") and "check(" not in c.source]
        return notebook

    def without(self, grade_id: str) -> NotebookNode:
        """Return the source with one cell as it is released, tests taken out."""
        stub = self.stub(grade_id)
        return self.untested(grade_id, lambda _: stub)

    def play(self, given: tuple[str, ...], sections: range, changes: dict[str, Callable[[str], str]]) -> None:
        """Run some cells by grade id and then whole sections, by their numbers, some cells changed."""
        cells = self.source().cells
        titles = [cell.source.partition("\n")[0] for cell in cells]
        begin, end = (
            next(i for i, title in enumerate(titles) if title.startswith(f"## {number}. "))
            for number in (sections.start, sections.stop)
        )
        places = {cell.id: cell for cell in cells}
        space: dict = {}
        for cell in [places[name] for name in given] + cells[begin:end]:
            if cell.cell_type == "code":
                exec(changes.get(cell.id, str)(cell.source), space)  # noqa: S102 - the notebook's own cells

    def hold_points(self) -> None:
        """Assert that graded cells, points and their sum are as announced, also in the notebook's own words."""
        notebook = self.source()
        cells = {meta(cell)["grade_id"]: cell for cell in notebook.cells if meta(cell)}
        graded = {name: meta(cell)["points"] for name, cell in cells.items() if meta(cell)["grade"]}
        assert graded == self.points | dict.fromkeys(self.extra, 0)
        for name, points in graded.items():
            if name in self.extra:
                assert f"Extra credit ({self.extra[name]} points)" in cells[name].source
                assert f"extra={self.extra[name]})" in cells[name].source
            elif name.endswith("-test"):
                assert f"Tested here ({points} points)" in cells[name].source
                assert f"points={points})" in cells[name].source
            else:
                question = cells[name.replace("answer", "question")]
                assert meta(question)["task"]
                assert f"({points} points, marked by a person)" in question.source
        assert f"{sum(graded.values())} points in all" in notebook.cells[0].source
        credit = f"{sum(self.extra.values())} points of extra credit"
        assert (credit in notebook.cells[0].source) == bool(self.extra)

    def mark_schemes(self) -> dict[str, list[int]]:
        """Return the points of the parts of each written question, having asserted that they add up."""
        sources = {meta(cell).get("grade_id"): cell.source for cell in self.source().cells}
        found = {}
        for name in (name for name in self.points if name.endswith("-answer")):
            scheme = sources[name.replace("answer", "question")].split("BEGIN MARK SCHEME")[1]
            lines = [line for line in scheme.splitlines() if line.startswith("* ")]
            found[name.removesuffix("-answer")] = parts = [int(line.split()[1]) for line in lines]
            assert sum(parts) == self.points[name]
        return found

    def hold_derivation(self) -> None:
        """Assert that the locked cells of the derivation are the page's cells, in the page's order."""
        page = notebooks.read(ROOT / "book" / f"{self.page}.md")
        expected = [
            cell.source for tag in self.tags for cell in page.cells if tag in cell.metadata.get("tags", [])
        ]
        cells = [cell for cell in self.release().cells if meta(cell).get("grade_id", "").startswith("derive")]
        assert [cell.source for cell in cells] == expected != []
        assert all(meta(cell)["locked"] and cell.metadata.editable is False for cell in cells)

    def hold_full_marks(self, executed: NotebookNode, pictures: int) -> None:
        """Assert that each hidden test of an executed notebook gives its points and extra credit, and what is drawn."""
        scores, extra = {}, {}
        for cell in executed.cells:
            if meta(cell).get("grade") and cell.cell_type == "code":
                (result,) = [output for output in cell.outputs if output.output_type == "execute_result"]
                scores[meta(cell)["grade_id"]] = float(result.data["text/plain"])
                given = [output.data[EXTRA] for output in cell.outputs if EXTRA in output.get("data", {})]
                extra |= {meta(cell)["grade_id"]: credit["earned"] for credit in given}
        tested = {name: points for name, points in self.points.items() if name.endswith("-test")}
        assert scores == tested | dict.fromkeys(self.extra, 0)
        assert extra == self.extra
        outputs = outputs_of(executed)
        assert sum("image/png" in output.get("data", {}) for output in outputs) == pictures
        assert not [output for output in outputs if output.output_type == "error"]
        assert not [output for output in outputs if output.get("name") == "stderr"]

    def hold_release_stops(self, folder: Path, derived: str, first: str) -> None:
        """Assert that a release run as it is stops at the first open answer, after the whole derivation."""
        notebook = self.release()
        with pytest.raises(CellExecutionError, match="NotImplementedError"):
            run(notebook, folder)
        ran = [meta(cell).get("grade_id") for cell in notebook.cells if cell.get("execution_count")]
        assert derived in ran
        assert ran[-1] == first
