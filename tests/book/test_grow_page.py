"""The page on a map that grows: what its derivation binds, and that it is the reference's."""

import numpy as np
import sympy as sp
from page import Page, steps

from roboloc_reference.slam import augment

PAGE = Page(
    "growing-a-map",
    "ekf-slam/growing-the-map",
    steps("grow", "symbols line jacobians covariance again"),
    choices=1,
)


def test_the_page_is_a_derivation_with_a_notebook():
    """Its tagged cells come in the notebook's order, assert what they say, and the notebook is there to download."""
    PAGE.hold()


def test_derivation_is_what_the_reference_computes():
    """Line and covariance are those of the reference."""
    space, rng = PAGE.bound, np.random.default_rng(3)
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


def test_the_page_does_not_answer_the_notebook():
    """Nothing on the page is about feet in the world, or two walls with the angles alpha and gamma."""
    assert not any(word in source for source in PAGE.code for word in ("foot", "gamma", "diag(p"))
