"""The page on fitting lines: what its derivation binds, and that it is the reference's."""

from pathlib import Path

import jupytext
import numpy as np
import sympy as sp

from autograder.checks.fit_a_line import line_jacobians
from roboloc_reference.extraction import fit_line

PAGE = Path(__file__).resolve().parents[2] / "book" / "fitting-lines-to-a-scan.md"
DERIVATION = [
    f"derive-fit-{part}" for part in ("symbols", "conditions", "distance", "direction", "by-line", "by-beam")
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
    """The tagged cells come in the notebook's order; conditions and derivatives hold for the reference's fit."""
    tags = [tag for found, _ in code_cells() for tag in found if tag.startswith("derive-")]
    assert list(dict.fromkeys(tags)) == DERIVATION
    space, rng = derived(), np.random.default_rng(3)
    third = {space["w1"]: sp.Rational(1, 3), space["w2"]: sp.Rational(1, 3)}
    symbols = (space["alpha"], space["r"], space["theta"], space["rho"])
    column = space["turn"].col_join(space["shift"]) / space["D"]
    forms = sp.lambdify(symbols, [space["f"].subs(third), column.subs(third), space["D"].subs(third)])
    for _ in range(20):
        theta, rho = rng.uniform(-1, 1, 3), rng.uniform(1, 3, 3)
        alpha, r, _ = fit_line(theta, rho, 0.0, 0.0)
        conditions, first, size = forms(alpha, r, theta, rho)
        np.testing.assert_allclose(conditions, np.zeros((2, 1)), atol=1e-12)
        assert size > 0  # the least, not the largest
        J_theta, J_rho = line_jacobians(theta, rho, alpha, r)
        np.testing.assert_allclose(
            first, np.stack([J_rho[:, 0], J_theta[:, 0]], axis=1), rtol=1e-9, atol=1e-12
        )


def test_derivation_cells_assert():
    """Each step of the derivation but the choice of symbols is followed by assertions."""
    for tag in DERIVATION[1:]:
        assert any("assert " in source for tags, source in code_cells() if tag in tags)


def test_the_page_does_not_answer_the_notebook():
    """Nothing on the page is about a fan of three beams with an angle beta, or a point that is e too far away."""
    text = PAGE.read_text(encoding="utf-8")
    assert "beta" not in text
    assert not any("sigma_rho" in source for _, source in code_cells())


def test_the_page_links_its_notebook():
    """The page has a download link to the released notebook."""
    assert "</notebooks/line-extraction/fit-a-line.ipynb>" in PAGE.read_text(encoding="utf-8")
