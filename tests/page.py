"""What every page of the book with a derivation is held to: its order, its assertions, what it binds, its notebook."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jupytext

BOOK = Path(__file__).resolve().parents[1] / "book"


@dataclass(frozen=True)
class Page:
    """A page of the book as its author says it is.

    Attributes
    ----------
    name : str
        The page.
    notebook : str
        The notebook that it belongs to, as `assignment/name`.
    tags : tuple of str
        The tags of the derivation's cells, in order.
    choices : int
        How many of the tags, from the first, only choose symbols: their cells need assert nothing.
    """

    name: str
    notebook: str
    tags: tuple[str, ...]
    choices: int = 0

    @functools.cached_property
    def text(self) -> str:
        """The page as it is written."""
        return (BOOK / f"{self.name}.md").read_text(encoding="utf-8")

    @functools.cached_property
    def cells(self) -> list[tuple[list[str], str]]:
        """Tags and source of each code cell."""
        cells = jupytext.reads(self.text, fmt="md:myst").cells
        return [(cell.metadata.get("tags", []), cell.source) for cell in cells if cell.cell_type == "code"]

    @property
    def code(self) -> list[str]:
        """The source of each code cell."""
        return [source for _, source in self.cells]

    @functools.cached_property
    def bound(self) -> dict[str, Any]:
        """What the tagged cells bind, run alone, in order."""
        space: dict[str, Any] = {}
        for tags, source in self.cells:
            if set(tags) & set(self.tags):
                exec(source, space)  # noqa: S102 - the book's own cells
        return space

    def hold(self) -> None:
        """Assert that the derivation comes in order, asserts what it says, and has its notebook to download."""
        found = [tag for tags, _ in self.cells for tag in tags if tag.startswith("derive-")]
        assert tuple(dict.fromkeys(found)) == self.tags
        for tag in self.tags[self.choices :]:
            assert any("assert " in source for tags, source in self.cells if tag in tags), tag
        assert f"</notebooks/{self.notebook}.ipynb>" in self.text


def steps(subject: str, names: str) -> tuple[str, ...]:
    """Return the tags of the steps of a derivation, given by their names with spaces between them."""
    return tuple(f"derive-{subject}-{name}" for name in names.split())
