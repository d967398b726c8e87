"""The page on splitting and merging: what its derivation binds, and that scans agree with it."""

from pathlib import Path

import jupytext
import numpy as np

from roboloc_reference.extraction import fit_line

PAGE = Path(__file__).resolve().parents[2] / "book" / "from-a-scan-to-walls.md"
DERIVATION = [f"derive-walls-{part}" for part in ("bend", "far", "cut")]


def code_cells():
    """Return the code cells of the page as (tags, source)."""
    return [
        (c.metadata.get("tags", []), c.source) for c in jupytext.read(PAGE).cells if c.cell_type == "code"
    ]


def test_derivation_is_what_the_reference_computes():
    """The tagged cells come in order; many points on a bend have the distances and misfits that they derive."""
    tags = [tag for found, _ in code_cells() for tag in found if tag.startswith("derive-")]
    assert list(dict.fromkeys(tags)) == DERIVATION
    space = {}
    for found, source in code_cells():
        if set(found) & set(DERIVATION):
            exec(source, space)  # noqa: S102 - the book's own cells
    along = (np.arange(4000) + 0.5) / 2000 - 1
    for turned in (0.05, 0.4):
        z = 3 + along * 1.5 * np.cos(turned) - 1j * (np.abs(along) * 1.5 * np.sin(turned) - 2)
        alpha, r, _ = fit_line(np.angle(z), np.abs(z), 0.0, 0.0)
        off = (z * np.exp(-1j * alpha)).real - r
        far = float(space["far"].subs({space["L"]: 1.5, space["beta"]: turned}))
        np.testing.assert_allclose(abs(off[[0, 2000, -1]]), far, rtol=2e-3)
        assert abs(off).max() < 1.002 * far
    x, slope, beyond = (np.arange(4000) + 0.5) / 4000 * 1.3 - 1, 0.01, 0.3
    y = slope * np.maximum(x, 0.0)
    residual = y - np.polyval(np.polyfit(x, y, 1), x)
    values = {space["L"]: 1.0, space["m"]: slope, space["c"]: beyond}
    np.testing.assert_allclose(np.mean(residual**2) * 1.3, float(space["least"].subs(values)), rtol=1e-3)


def test_derivation_cells_assert():
    """Each step of the derivation is followed by assertions."""
    for tag in DERIVATION:
        assert any("assert " in source for tags, source in code_cells() if tag in tags)


def test_the_page_does_not_answer_the_notebook():
    """Nothing on the page is about a step between two parallel walls."""
    text = PAGE.read_text(encoding="utf-8")
    assert "parallel walls" not in text
    assert not any("atan2" in source for _, source in code_cells())


def test_the_page_links_its_notebook():
    """The page has a download link to the released notebook."""
    assert "</notebooks/line-extraction/split-and-merge.ipynb>" in PAGE.read_text(encoding="utf-8")
