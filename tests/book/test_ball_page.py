"""The page on the bouncing ball: what its derivation binds, and that it is the reference's."""

import numpy as np
import sympy as sp
from page import Page, steps

from roboloc_reference.ballistic import motion

PAGE = Page(
    "a-ball-that-bounces",
    "bouncing-ball/tracking",
    steps("ball", "flight time through saltation rest"),
)


def test_the_page_is_a_derivation_with_a_notebook():
    """Its tagged cells come in the notebook's order, assert what they say, and the notebook is there to download."""
    PAGE.hold()


def test_derivation_of_the_ball_binds_what_the_notebook_uses():
    """The tagged cells bind the symbols by their names, G and Xi."""
    assert all(PAGE.bound[name] == sp.Symbol(name, real=True) for name in ("px", "py", "vx", "vy", "t", "dt"))
    assert all(PAGE.bound[name] == sp.Symbol(name, positive=True) for name in ("g", "e"))
    assert {PAGE.bound[name].shape for name in ("G", "F", "Xi", "without")} == {(4, 4)}
    assert PAGE.bound["v"] == sp.Symbol("v", negative=True)


def test_derivation_of_the_ball_is_what_the_reference_computes():
    """State and Jacobian behind one impact agree with the reference at random points."""
    rng = np.random.default_rng(3)
    symbols = [PAGE.bound[name] for name in ("px", "py", "vx", "vy", "dt", "g", "e")]
    forms = sp.lambdify(symbols, [PAGE.bound["after"], PAGE.bound["G"]])
    for _ in range(20):
        x, g, e = rng.uniform([-2, 0.5, -2, -2], [2, 3, 2, 2]), rng.uniform(5, 15), rng.uniform(0.3, 0.9)
        s = np.sqrt(x[3] ** 2 + 2 * g * x[1])
        dt = (x[3] + s) / g + rng.uniform(0.1, 0.9) * 2 * e * s / g
        state, slope = (np.array(form, dtype=float) for form in forms(*x, dt, g, e))
        right, right_slope = motion(x, dt, g, e)
        np.testing.assert_allclose(state.ravel(), right, atol=1e-11)
        np.testing.assert_allclose(slope, right_slope, atol=1e-11)


def test_the_page_of_the_ball_does_not_answer_the_notebook():
    """No slope is derived on the page: neither its angle nor a normal but the level ground's."""
    for source in PAGE.code:
        assert "alpha" not in source.replace("alpha=0.4", "")
        assert "sp.cos" not in source
        assert "sp.sin" not in source
