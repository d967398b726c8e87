"""The page on the unscented filter: what its derivation binds, and that it is the reference's."""

from pathlib import Path

import jupytext
import numpy as np
import pytest
import sympy as sp

from roboloc_reference import velocity

PAGE = Path(__file__).resolve().parents[2] / "book" / "the-unscented-filter.md"
DERIVATION = [f"derive-vel-{part}" for part in ("symbols", "motion", "w", "limits", "h", "points")]


def code_cells():
    """Return the code cells of the page as (tags, source)."""
    return [
        (c.metadata.get("tags", []), c.source) for c in jupytext.read(PAGE).cells if c.cell_type == "code"
    ]


@pytest.fixture(scope="module")
def derived():
    """Run the tagged cells alone, in order, and return what they bind."""
    space = {}
    for tags, source in code_cells():
        if set(tags) & set(DERIVATION):
            exec(source, space)  # noqa: S102 - the book's own cells
    return space


def test_derivation_comes_in_the_notebooks_order_and_asserts():
    """The tags are in order, and each step but the choice of symbols asserts something."""
    tags = [tag for found, _ in code_cells() for tag in found if tag.startswith("derive-")]
    assert list(dict.fromkeys(tags)) == DERIVATION
    for tag in DERIVATION[1:]:
        assert any("assert " in source for tags, source in code_cells() if tag in tags)


def test_derivation_is_what_the_reference_computes(derived):
    """Motion, F, W, H and their limits agree with the reference at random points."""
    names = ("x", "y", "theta", "v", "omega", "gamma", "dt", "m_x", "m_y")
    forms = sp.lambdify(
        [derived[name] for name in names], [derived[name] for name in ("f", "F", "W", "h", "H")]
    )
    limits = sp.lambdify([derived[name] for name in names], [derived[name] for name in ("f_0", "F_0", "W_0")])
    rng = np.random.default_rng(4)
    for _ in range(20):
        pose, control, landmark = rng.uniform(-1.5, 1.5, 3), rng.uniform(0.3, 1.2, 3), rng.uniform(2, 4, 2)
        step = rng.uniform(0.2, 1.5)
        f, F, W, h, H = forms(*pose, *control, step, *landmark)
        np.testing.assert_allclose(np.ravel(f), velocity.motion(pose, control, step), atol=1e-12)
        for mine, theirs in zip((F, W), velocity.jacobians(pose, control, step), strict=True):
            np.testing.assert_allclose(np.array(mine, dtype=float), theirs, atol=1e-11)
        z, J = velocity.range_bearing(pose, landmark)
        np.testing.assert_allclose(np.exp(1j * h[0, 0]), np.exp(1j * z[0]), atol=1e-12)
        np.testing.assert_allclose(np.array(H, dtype=float), J, atol=1e-12)
        control[1] = 0.0
        f, F, W = limits(*pose, *control, step, *landmark)
        np.testing.assert_allclose(np.ravel(f), velocity.motion(pose, control, step), atol=1e-12)
        np.testing.assert_allclose(
            np.array(W, dtype=float), velocity.jacobians(pose, control, step)[1], atol=1e-12
        )


def test_the_page_does_not_answer_the_notebook():
    """Nothing on the page starts an arc from a turned heading, or puts a sensor in front of the robot."""
    for _, source in code_cells():
        assert "theta + gamma" not in source
        assert " a * sp" not in source.replace("omega * sp", "")


def test_the_page_links_its_notebook():
    """The page has a download link to the released notebook."""
    assert "</notebooks/four-filters/ekf-and-ukf.ipynb>" in PAGE.read_text(encoding="utf-8")
