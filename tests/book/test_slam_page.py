"""The page on SLAM with lines: what its derivation binds, and that it is the reference's."""

import numpy as np
import sympy as sp
from page import Page, steps

from roboloc_reference.slam import compute_predicted_measurements, transition_model

PAGE = Page(
    "slam-with-lines",
    "ekf-slam/line-slam",
    steps("slam", "symbols motion line gauge observability fixed"),
    choices=1,
)


def test_the_page_is_a_derivation_with_a_notebook():
    """Its tagged cells come in the notebook's order, assert what they say, and the notebook is there to download."""
    PAGE.hold()


def test_derivation_is_what_the_reference_computes():
    """Lines, their derivatives and the gauge are the reference's."""
    space, rng = PAGE.bound, np.random.default_rng(3)
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


def test_the_page_does_not_answer_the_notebook():
    """Nothing on the page is about a map of feet, or the covariance of a place from two distances."""
    assert "a**2" not in PAGE.text
    assert not any(word in source for source in PAGE.code for word in ("foot", ".inv()", "a * x + b * y"))
