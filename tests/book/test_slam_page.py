"""The page on SLAM with lines: what its derivation binds, and that it is the reference's."""

from pathlib import Path

import jupytext
import numpy as np
import sympy as sp

from roboloc_reference.slam import compute_predicted_measurements, transition_model

PAGE = Path(__file__).resolve().parents[2] / "book" / "slam-with-lines.md"
DERIVATION = [
    f"derive-slam-{part}" for part in ("symbols", "motion", "line", "gauge", "observability", "fixed")
]


def code_cells():
    """Return the code cells of the page as (tags, source)."""
    return [
        (c.metadata.get("tags", []), c.source) for c in jupytext.read(PAGE).cells if c.cell_type == "code"
    ]


def derived():
    """Run the tagged cells alone, in order, and return what they bind."""
    space = {}
    for tags, source in code_cells():
        if set(tags) & set(DERIVATION):
            exec(source, space)  # noqa: S102 - the book's own cells
    return space


def test_derivation_is_what_the_reference_computes():
    """The tagged cells come in the notebook's order; lines, their derivatives and the gauge are the reference's."""
    tags = [tag for found, _ in code_cells() for tag in found if tag.startswith("derive-")]
    assert list(dict.fromkeys(tags)) == DERIVATION
    space, rng = derived(), np.random.default_rng(3)
    symbols = [space[name] for name in ("x", "y", "theta", "alpha", "r", "x_cam", "y_cam", "theta_cam")]
    forms = sp.lambdify(symbols, [space["h"], space["H"], space["N"]])
    for _ in range(20):
        pose, tf, alpha = rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 3), rng.uniform(-1, 1)
        state = np.array([*pose, alpha, 6.0])
        h, H, N = forms(*state, *tf)
        hs, Hs = compute_predicted_measurements(state, tf, fixed=0)
        np.testing.assert_allclose(hs, h, atol=1e-12)
        np.testing.assert_allclose(Hs[0], H, atol=1e-12)
        g, Gx, _ = transition_model(state, rng.uniform(-1, 1, 2), 0.7)
        np.testing.assert_allclose(Gx @ N, forms(*g, *tf)[2], atol=1e-12)


def test_derivation_cells_assert():
    """Each step of the derivation but the choice of symbols is followed by assertions."""
    for tag in DERIVATION[1:]:
        assert any("assert " in source for tags, source in code_cells() if tag in tags)


def test_the_page_does_not_answer_the_notebook():
    """Nothing on the page is about a map of feet, or the covariance of a place from two distances."""
    text = PAGE.read_text(encoding="utf-8")
    assert "a**2" not in text
    assert not any(
        word in source for _, source in code_cells() for word in ("foot", ".inv()", "a * x + b * y")
    )


def test_the_page_links_its_notebook():
    """The page has a download link to the released notebook."""
    assert "</notebooks/ekf-slam/line-slam.ipynb>" in PAGE.read_text(encoding="utf-8")
