"""The page of faults in print: that every one is there, and is met where the page says."""

from __future__ import annotations

import re
from pathlib import Path

import jupytext

from autograder.misconceptions import MISCONCEPTIONS

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "book" / "faults-in-print.md"
NUMBERS = {"H": 9, "A": 5, "C": 10, "F": 11, "R": 8}


def rows():
    """Return fault, what is printed and where it is met, of every line of the tables."""
    lines = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("|")]
    found = [tuple(part.strip() for part in line[1:-1].split("|")) for line in lines]
    return [row for row in found if not set(row[0]) <= {"-"} and row[0] != "fault"]


def test_every_fault_is_there_once():
    """The faults are counted through in every source, and each has words."""
    assert [name for name, _, _ in rows()] == [
        f"{letter}{i}" for letter, count in NUMBERS.items() for i in range(1, count + 1)
    ]
    assert all(len(printed) > 20 for _, printed, _ in rows())


def test_every_fault_is_met_where_the_page_says():
    """A wrong version is in the catalogue, a question in its notebook, and words on their page."""
    known = {f"{item.stage}: {item.name}" for item in MISCONCEPTIONS}
    for name, _, place in rows():
        if page := re.fullmatch(r'page ([\w-]+): "(.+)"', place):
            text = " ".join((ROOT / "book" / f"{page[1]}.md").read_text(encoding="utf-8").split())
            assert page[2] in text, name
        elif question := re.fullmatch(r"question ([\w-]+): ([\w-]+-answer)", place):
            (path,) = ROOT.glob(f"solutions/*/{question[1]}.md")
            cells = [cell.metadata.get("nbgrader", {}) for cell in jupytext.read(path).cells]
            assert question[2] in [meta.get("grade_id") for meta in cells], name
        elif place != "not used here":
            assert place in known, name
    assert {name for name, _, place in rows() if place == "not used here"} == {"H7"}  # a command of ROS
