"""The table of what the course covers, held against the notebooks in both directions."""

import re
from pathlib import Path
from typing import NamedTuple

import jupytext
import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "book" / "coverage.md"
NONE = "–"
STANFORD = ["1 (i)", "1 (ii)", "1 (iii)", "1 (iv)", "1 (v)", "1 (vi)", "1 (vii)"]
PARTICLES = ["3 (i)", "3 (ii)", "3 (iii)", "3 (iv)"]
SLAM_AND_PARTICLES = ["2 (i)", "2 (ii)", "2 (iii)", *PARTICLES]

# The parts of the sources, in their order.
PARTS = {
    "Stanford AA274A, problem set 4 (2021)": [
        *STANFORD,
        "1 (viii)",
        "1 (ix)",
        *SLAM_AND_PARTICLES,
        "3, extra credit",
        "extra problem",
    ],
    "Stanford AA274A, problem set 4 (2020), the derivations": [*STANFORD, *SLAM_AND_PARTICLES],
    "Stanford AA274A, problem set 3: line extraction": ["fit", "covariance", "split", "merge", "extract"],
    "CMU 16-833, homework 2": [
        *("1.1", "1.2", "1.3", "1.4", "1.5", "1.6"),
        *("2.1", "2.2", "2.3", "2.4", "3.1", "3.2", "3.3"),
    ],
    "Flinders University, Instrumentation, tutorial 6": [
        *("1 (a)", "1 (b)", "1 (c)", "1 (d)"),
        *("2 (a)", "2 (b)", "2 (c)"),
    ],
    "Michigan ROB530, homework 5": ["1 (A)", "1 (B)", "1 (C)", "1 (D)", "2", "bonus"],
    "What no source asks": ["variant"],
}


class Row(NamedTuple):
    """One line of a table."""

    source: str
    part: str
    asks: str
    notebook: str
    cell: str
    points: str
    check: str


def rows():
    """Return the lines of all tables of the page."""
    found = []
    for section in re.split(r"^## ", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]:
        source, _, text = section.partition("\n")
        lines = [line for line in text.splitlines() if line.startswith("|")]
        assert lines[0] == "| part | asks for | notebook | cell | points | checked by |"
        found += [Row(source, *(part.strip() for part in line[1:-1].split("|"))) for line in lines[2:]]
    return found


@pytest.fixture(scope="module")
def graded():
    """Return what each graded cell of the solutions is checked by, and its points."""
    found = {}
    for path in sorted((ROOT / "solutions").glob("*/*.md")):
        for cell in jupytext.read(path).cells:
            metadata = cell.metadata.get("nbgrader", {})
            if metadata.get("grade"):
                names = re.findall(r'\bgrade(?:_expression|_vectorised)?\(\s*"([\w.]+)"', cell.source)
                assert len(names) == (0 if metadata["solution"] else 1), metadata["grade_id"]
                key = path.stem, metadata["grade_id"]
                assert key not in found
                found[key] = (*(names or ["rubric"]), float(metadata["points"]))
    return found


def test_each_row_is_a_graded_cell(graded):
    """A row that names a cell names its notebook, its check and its points as they are."""
    wrong = [
        row
        for row in rows()
        if row.cell != NONE and graded.get((row.notebook, row.cell)) != (row.check, float(row.points))
    ]
    assert wrong == []


def test_each_graded_cell_has_a_row(graded):
    """No graded cell of a notebook is missing from the tables, and none is given twice for one part."""
    named = [(row.source, row.part, row.notebook, row.cell) for row in rows() if row.cell != NONE]
    assert len(set(named)) == len(named)
    assert {key[2:] for key in named} == set(graded)


def test_a_row_without_a_cell_says_why(graded):
    """What is not graded is done in a notebook that there is: no part of a source is left out."""
    notebooks = {notebook for notebook, _ in graded}
    for row in rows():
        if row.cell == NONE:
            assert row.points == NONE
            assert row.asks
            assert row.notebook in notebooks, row
            assert row.check != "not yet", row


def test_each_part_of_the_sources_is_there():
    """Every part of every source has its row, in order, and the first row of each says what it asks for."""
    found = {}
    for row in rows():
        parts = found.setdefault(row.source, [])
        if row.part not in parts:
            parts.append(row.part)
            assert row.asks
        assert parts[-1] == row.part
    assert found == PARTS
