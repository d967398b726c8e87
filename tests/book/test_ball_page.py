"""The page on the bouncing ball: what its derivation binds, and that it is the reference's."""

from pathlib import Path

import jupytext
import numpy as np
import pytest
import sympy as sp

from roboloc_reference.ballistic import motion

PAGE = Path(__file__).resolve().parents[2] / "book" / "a-ball-that-bounces.md"
DERIVATION = ["flight", "time", "through", "saltation", "rest"]


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
        if any(tag.startswith("derive-ball-") for tag in tags):
            exec(source, space)  # noqa: S102 - the book's own cells
    return space


def test_derivation_of_the_ball_binds_what_the_notebook_uses(derived):
    """The tagged cells come in the notebook's order and bind the symbols by their names, G and Xi."""
    tags = [tag for found, _ in code_cells() for tag in found if tag.startswith("derive-ball-")]
    assert list(dict.fromkeys(tags)) == [f"derive-ball-{name}" for name in DERIVATION]
    assert all(derived[name] == sp.Symbol(name, real=True) for name in ("px", "py", "vx", "vy", "t", "dt"))
    assert all(derived[name] == sp.Symbol(name, positive=True) for name in ("g", "e"))
    assert {derived[name].shape for name in ("G", "F", "Xi", "without")} == {(4, 4)}
    assert derived["v"] == sp.Symbol("v", negative=True)


def test_derivation_of_the_ball_is_what_the_reference_computes(derived):
    """State and Jacobian behind one impact agree with the reference at random points."""
    rng = np.random.default_rng(3)
    symbols = [derived[name] for name in ("px", "py", "vx", "vy", "dt", "g", "e")]
    forms = sp.lambdify(symbols, [derived["after"], derived["G"]])
    for _ in range(20):
        x, g, e = rng.uniform([-2, 0.5, -2, -2], [2, 3, 2, 2]), rng.uniform(5, 15), rng.uniform(0.3, 0.9)
        s = np.sqrt(x[3] ** 2 + 2 * g * x[1])
        dt = (x[3] + s) / g + rng.uniform(0.1, 0.9) * 2 * e * s / g
        state, slope = (np.array(form, dtype=float) for form in forms(*x, dt, g, e))
        right, right_slope = motion(x, dt, g, e)
        np.testing.assert_allclose(state.ravel(), right, atol=1e-11)
        np.testing.assert_allclose(slope, right_slope, atol=1e-11)


def test_each_step_of_the_derivation_asserts():
    """Each of the tagged steps asserts something."""
    for name in DERIVATION:
        assert any("assert " in source for tags, source in code_cells() if f"derive-ball-{name}" in tags)


def test_the_page_of_the_ball_does_not_answer_the_notebook():
    """No slope is derived on the page: neither its angle nor a normal but the level ground's."""
    for _, source in code_cells():
        assert "alpha" not in source.replace("alpha=0.4", "")
        assert "sp.cos" not in source
        assert "sp.sin" not in source
