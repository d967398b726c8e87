"""The page on splitting and merging: what its derivation binds, and that scans agree with it."""

import numpy as np
from page import Page, steps

from roboloc_reference.extraction import fit_line

PAGE = Page("from-a-scan-to-walls", "line-extraction/split-and-merge", steps("walls", "bend far cut"))


def test_the_page_is_a_derivation_with_a_notebook():
    """Its tagged cells come in the notebook's order, assert what they say, and the notebook is there to download."""
    PAGE.hold()


def test_derivation_is_what_the_reference_computes():
    """Many points on a bend have the distances and misfits that they derive."""
    space = PAGE.bound
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


def test_the_page_does_not_answer_the_notebook():
    """Nothing on the page is about a step between two parallel walls."""
    assert "parallel walls" not in PAGE.text
    assert not any("atan2" in source for source in PAGE.code)
