"""Build the student notebooks: text sources in, releases out, byte for byte the same every time.

``solutions/<assignment>/<name>.md`` is the source of a problem. Four steps, in this order, make a release:

1. *read*: jupytext turns the text into a notebook; cell metadata come along.
2. *splice*: a marker ``<!-- splice: book/page.md tag -->`` becomes the code cells of that page that carry the
   tag. A derivation has one home, and the notebook shows the very cells of the page. They are locked, so that
   the code of the hidden tests meets the symbols it expects.
3. *name*: every cell gets an id made from its place and name; a random one would change with each build.
   The result is ``build/source/<assignment>/<name>.ipynb``, which nbgrader reads.
4. *release*: ``nbgrader generate_assignment`` itself removes solutions, hidden tests and mark schemes and
   computes the checksums, into ``notebooks/<assignment>/<name>.ipynb``. Without ``--db`` it writes to a
   gradebook of its own that is thrown away, and the course's is left alone.

Usage: ``python tools/notebooks.py [--db URL] [--output FOLDER] [--source FOLDER]``
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

import jupytext
import nbformat
from nbformat import NotebookNode
from nbgrader.apps import NbGraderAPI
from traitlets.config import Config

ROOT = Path(__file__).resolve().parents[1]
_SPLICE = re.compile(r"^<!-- splice: (?P<page>\S+) (?P<tag>\S+) -->$")
_KERNEL = {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"}


def read(path: Path) -> NotebookNode:
    """Read a MyST text notebook."""
    return jupytext.read(path, fmt="md:myst")


def tagged_cells(page: Path, tag: str) -> list[str]:
    """Return the sources of a page's code cells that carry a tag, in order.

    Raises
    ------
    ValueError
        If there is none.
    """
    cells = [cell for cell in read(page).cells if cell.cell_type == "code"]
    found = [cell.source for cell in cells if tag in cell.metadata.get("tags", [])]
    if not found:
        raise ValueError(f"{page.name}: expected a code cell tagged {tag}, got none")
    return found


def splice(notebook: NotebookNode, root: Path) -> NotebookNode:
    """Put the cells of a page in the place of every marker.

    Raises
    ------
    ValueError
        If a marker names a page or a tag that is not there, or shares its cell with other text.
    """
    cells = []
    for cell in notebook.cells:
        match = _SPLICE.match(cell.source.strip()) if cell.cell_type == "markdown" else None
        if match is None:
            if "<!-- splice:" in cell.source:
                raise ValueError(f"splice: expected a marker alone in its cell, got {cell.source[:60]!r}")
            cells.append(cell)
            continue
        page = root / match["page"]
        if not page.is_file():
            raise ValueError(f"splice: expected a page of the book, got {match['page']}")
        for number, source in enumerate(tagged_cells(page, match["tag"]), start=1):
            meta = {"grade": False, "grade_id": f"{match['tag']}-{number}", "locked": True, "solution": False}
            meta |= {"schema_version": 3, "task": False}
            metadata = {"deletable": False, "editable": False, "nbgrader": meta}
            cells.append(nbformat.v4.new_code_cell(source, metadata=metadata))
    notebook.cells = cells
    return notebook


def name_cells(notebook: NotebookNode) -> NotebookNode:
    """Give every cell an id that depends on its place, kind and name alone, and the notebook its kernel."""
    for number, cell in enumerate(notebook.cells):
        grade_id = cell.metadata.get("nbgrader", {}).get("grade_id")
        text = f"{number}:{cell.cell_type}"
        cell["id"] = grade_id or f"cell-{number:02d}-{hashlib.sha256(text.encode()).hexdigest()[:6]}"
        if "nbgrader" in cell.metadata:
            cell.metadata.nbgrader.setdefault("cell_type", cell.cell_type)
    notebook.metadata = NotebookNode(kernelspec=NotebookNode(_KERNEL))
    notebook.nbformat, notebook.nbformat_minor = 4, 5
    nbformat.validate(notebook)
    return notebook


def build_sources(solutions: Path, target: Path, root: Path = ROOT) -> list[str]:
    """Write the source notebooks of all assignments that nbgrader releases from.

    Parameters
    ----------
    solutions : Path
        Folder of ``<assignment>/<name>.md``.
    target : Path
        Where ``<assignment>/<name>.ipynb`` go; emptied first.
    root : Path
        Folder that the markers' page names start from.

    Returns
    -------
    list of str
        The assignments, sorted.
    """
    shutil.rmtree(target, ignore_errors=True)
    for path in sorted(solutions.glob("*/*.md")):
        notebook = name_cells(splice(read(path), root))
        output = target / path.parent.name / f"{path.stem}.ipynb"
        output.parent.mkdir(parents=True, exist_ok=True)
        nbformat.write(notebook, output)
    return sorted(folder.name for folder in target.iterdir())


def release(source: Path, output: Path, assignments: list[str], db_url: str | None = None) -> None:
    """Make the student version of every assignment with nbgrader.

    Parameters
    ----------
    source, output : Path
        Folders of the source notebooks and of the releases; an assignment's old release is replaced.
    assignments : list of str
        What to release.
    db_url : str, optional
        Gradebook that learns of the assignments; one that is thrown away if not given.

    Raises
    ------
    RuntimeError
        If nbgrader reports an error.
    """
    # nbgrader looks for alembic on the PATH, and finds none where the environment is not activated.
    found = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
    os.environ["PATH"] = found
    with tempfile.TemporaryDirectory(prefix="roboloc-release-") as folder:
        config = Config()
        config.CourseDirectory.root = folder
        config.CourseDirectory.source_directory = str(source.resolve())
        config.CourseDirectory.release_directory = str(Path(folder) / "release")
        config.CourseDirectory.db_url = db_url or f"sqlite:///{folder}/gradebook.db"
        for assignment in assignments:
            result = NbGraderAPI(config=config).generate_assignment(assignment, force=True)
            if not result["success"]:
                raise RuntimeError(f"nbgrader could not release {assignment}:\n{result.get('log')}")
            target = output / assignment
            shutil.rmtree(target, ignore_errors=True)
            shutil.copytree(Path(folder) / "release" / assignment, target)


def build(source: Path, output: Path, db_url: str | None = None, only: list[str] | None = None) -> list[str]:
    """Build releases and return the assignments.

    Parameters
    ----------
    source : Path
        Where the intermediate notebooks go.
    output : Path
        Where the releases go.
    db_url : str, optional
        Gradebook that learns of the assignments.
    only : list of str, optional
        The assignments to release; all if not given.

    Returns
    -------
    list of str
        The assignments, sorted.

    Raises
    ------
    ValueError
        If there is no such assignment.
    """
    there = build_sources(ROOT / "solutions", source)
    if unknown := set(only or ()) - set(there):
        raise ValueError(f"assignment: expected some of {', '.join(there)}, got {', '.join(sorted(unknown))}")
    assignments = [name for name in there if not only or name in only]
    release(source, output, assignments, db_url)
    return assignments


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Build the student notebooks from solutions/.")
    parser.add_argument("--assignment", action="append", help="only this one; may be given again")
    parser.add_argument("--db", help="address of a gradebook that shall learn of the assignments")
    parser.add_argument("--output", type=Path, default=ROOT / "notebooks", help="folder of the releases")
    parser.add_argument("--source", type=Path, default=ROOT / "build" / "source", help="folder in between")
    options = parser.parse_args(arguments)
    for assignment in build(options.source, options.output, options.db, options.assignment):
        for path in sorted((options.output / assignment).glob("*.ipynb")):
            print(path.relative_to(ROOT) if path.is_relative_to(ROOT) else path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
