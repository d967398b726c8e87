"""The page on fitting lines: what its derivation binds, and that it is the reference's."""

import numpy as np
import sympy as sp
from page import Page, steps

from autograder.checks.fit_a_line import line_jacobians
from roboloc_reference.extraction import fit_line

PAGE = Page(
    "fitting-lines-to-a-scan",
    "line-extraction/fit-a-line",
    steps("fit", "symbols conditions distance direction by-line by-beam"),
    choices=1,
)


def test_the_page_is_a_derivation_with_a_notebook():
    """Its tagged cells come in the notebook's order, assert what they say, and the notebook is there to download."""
    PAGE.hold()


def test_derivation_is_what_the_reference_computes():
    """Conditions and derivatives hold for the reference's fit."""
    space, rng = PAGE.bound, np.random.default_rng(3)
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


def test_the_page_does_not_answer_the_notebook():
    """Nothing on the page is about a fan of three beams with an angle beta, or a point that is e too far away."""
    assert "beta" not in PAGE.text
    assert not any("sigma_rho" in source for source in PAGE.code)
