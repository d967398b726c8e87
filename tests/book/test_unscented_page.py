"""The page on the unscented filter: what its derivation binds, and that it is the reference's."""

import numpy as np
import sympy as sp
from page import Page, steps

from roboloc_reference import velocity

PAGE = Page(
    "the-unscented-filter",
    "four-filters/ekf-and-ukf",
    steps("vel", "symbols motion w limits h points"),
    choices=1,
)


def test_the_page_is_a_derivation_with_a_notebook():
    """Its tagged cells come in the notebook's order, assert what they say, and the notebook is there to download."""
    PAGE.hold()


def test_derivation_is_what_the_reference_computes():
    """Motion, F, W, H and their limits agree with the reference at random points."""
    names = ("x", "y", "theta", "v", "omega", "gamma", "dt", "m_x", "m_y")
    forms = sp.lambdify(
        [PAGE.bound[name] for name in names], [PAGE.bound[name] for name in ("f", "F", "W", "h", "H")]
    )
    limits = sp.lambdify(
        [PAGE.bound[name] for name in names], [PAGE.bound[name] for name in ("f_0", "F_0", "W_0")]
    )
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
    for source in PAGE.code:
        assert "theta + gamma" not in source
        assert " a * sp" not in source.replace("omega * sp", "")
