"""The page on a map that grows: what its derivation binds, and that it is the reference's."""

from pathlib import Path

import jupytext
import numpy as np
import sympy as sp

from roboloc_reference.slam import augment

PAGE = Path(__file__).resolve().parents[2] / "book" / "growing-a-map.md"
DERIVATION = [f"derive-grow-{part}" for part in ("symbols", "line", "jacobians", "covariance", "again")]


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
    """The tagged cells come in the notebook's order; line and covariance are those of the reference."""
    tags = [tag for found, _ in code_cells() for tag in found if tag.startswith("derive-")]
    assert list(dict.fromkeys(tags)) == DERIVATION
    space, rng = derived(), np.random.default_rng(3)
    names = ("x", "y", "theta", "alpha_z", "r_z", "x_cam", "y_cam", "theta_cam")
    symbols = [space[name] for name in names]
    forms = sp.lambdify(symbols, [space["line"], space["J_pose"], space["J_z"]])
    for _ in range(20):
        pose, tf = rng.uniform(-0.5, 0.5, 3), rng.uniform(-0.5, 0.5, 3)
        z = np.array([rng.uniform(-0.5, 0.5), 3.0])
        line, J_pose, J_z = forms(*pose, *z, *tf)
        root = rng.normal(size=(5, 5))
        Sigma, Q = root @ root.T, np.array([[0.4, 0.1], [0.1, 0.3]])
        x, grown = augment(np.concatenate([pose, [0.3, 2.0]]), Sigma, z, Q, tf)
        np.testing.assert_allclose(x[5:], np.ravel(line), atol=1e-12)
        np.testing.assert_allclose(grown[5:, :5], J_pose @ Sigma[:3], atol=1e-11)
        own = J_pose @ Sigma[:3, :3] @ J_pose.T + J_z @ Q @ J_z.T
        np.testing.assert_allclose(grown[5:, 5:], own, atol=1e-11)


def test_derivation_cells_assert():
    """Each step of the derivation but the choice of symbols is followed by assertions."""
    for tag in DERIVATION[1:]:
        assert any("assert " in source for tags, source in code_cells() if tag in tags)


def test_the_page_does_not_answer_the_notebook():
    """Nothing on the page is about feet in the world, or two walls with the angles alpha and gamma."""
    assert not any(word in source for _, source in code_cells() for word in ("foot", "gamma", "diag(p"))


def test_the_page_links_its_notebook():
    """The page has a download link to the released notebook."""
    assert "</notebooks/ekf-slam/growing-the-map.ipynb>" in PAGE.read_text(encoding="utf-8")
