"""The page on a cloud of robots: what its derivation binds, and that it is the reference's."""

from pathlib import Path

import jupytext
import numpy as np
import pytest

from autograder.checks.thin_cloud import share
from roboloc_reference.particle import effective_sample_size

PAGE = Path(__file__).resolve().parents[2] / "book" / "a-cloud-of-robots.md"
TAGS = ["derive-thin-logs", "derive-thin-mean", "derive-thin-share"]


def code_cells():
    """Return the code cells of the page as (tags, source)."""
    return [
        (c.metadata.get("tags", []), c.source) for c in jupytext.read(PAGE).cells if c.cell_type == "code"
    ]


def test_the_derivation_is_what_the_reference_computes():
    """The tagged cells assert, and their size and share are those of the reference and of the hidden checks."""
    tags = [tag for found, _ in code_cells() for tag in found if tag.startswith("derive-")]
    assert list(dict.fromkeys(tags)) == TAGS
    space = {}
    for tag in TAGS:
        sources = [source for found, source in code_cells() if tag in found]
        assert any("assert " in source for source in sources)
        for source in sources:
            exec(source, space)  # noqa: S102 - the book's own cells
    ws = np.random.default_rng(2).uniform(0.1, 2.0, 4)
    size = float(space["n_eff"].subs(dict(zip(space["w"], ws, strict=True))))
    assert size == pytest.approx(effective_sample_size(ws))
    left = float(space["share"].subs({space["s"]: 0.7, space["q"]: 0.3}))
    assert left == pytest.approx(float(share(0.49, 0.09, 0.0)))


def test_the_page_does_not_print_what_is_asked():
    """The page's share has no observation off the middle, and its weights no two kinds."""
    text = PAGE.read_text(encoding="utf-8")
    assert "share_off" not in text
    assert "n_two" not in text


def test_the_page_links_its_notebook():
    """The page has a download link to the released notebook."""
    assert "</notebooks/four-filters/particle-filter.ipynb>" in PAGE.read_text(encoding="utf-8")
