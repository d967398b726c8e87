"""The page on SLAM with points: what its derivation binds, and that it is the reference's."""

import numpy as np
import sympy as sp
from page import Page, steps

from roboloc_reference.landmarks import init_landmarks, measurement, predict

PAGE = Page(
    "slam-with-points",
    "ekf-slam/landmark-slam",
    steps("points", "symbols step noise sighting start look by-pose by-landmark"),
    choices=1,
)


def form(name, names):
    """Return a form of the page as a function of numbers."""
    return sp.lambdify([PAGE.bound[symbol] for symbol in names], PAGE.bound[name])


def test_the_page_is_a_derivation_with_a_notebook():
    """Its tagged cells come in the notebook's order, assert what they say, and the notebook is there to download."""
    PAGE.hold()


def test_derivation_of_points_is_what_the_reference_computes():
    """Step, noise, place, look and their derivatives agree with the reference at random points."""
    rng = np.random.default_rng(3)
    pose_names, sigmas = ["x", "y", "theta"], ["sigma_1", "sigma_2", "sigma_3"]
    for _ in range(20):
        pose, (d, alpha), stds = rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 2), rng.uniform(0.1, 1, 3)
        moved, added = predict(pose, np.zeros((3, 3)), [d, alpha], np.diag(stds**2))
        carried = predict(pose, np.eye(3), [d, alpha], np.zeros((3, 3)))[1]
        g, G = (form(name, [*pose_names, "d", "alpha"])(*pose, d, alpha) for name in ("g", "G"))
        np.testing.assert_allclose(np.ravel(g), moved, atol=1e-14)
        np.testing.assert_allclose(G @ G.T, carried, atol=1e-14)
        np.testing.assert_allclose(form("noise", ["theta", *sigmas])(pose[2], *stds), added, atol=1e-14)
        beta, r = rng.uniform(-1, 1), rng.uniform(1, 3)
        names = [*pose_names, "beta", "r"]
        place, J_pose, J_z = (form(name, names)(*pose, beta, r) for name in ("place", "J_pose", "J_z"))
        x, Sigma = init_landmarks([beta, r], np.diag([0.1, 0.2]), pose, np.diag([0.3, 0.4, 0.5]))
        np.testing.assert_allclose(np.ravel(place), x[3:], atol=1e-14)
        np.testing.assert_allclose(J_pose @ np.diag([0.3, 0.4, 0.5]), Sigma[3:, :3], atol=1e-14)
        own = J_pose @ np.diag([0.3, 0.4, 0.5]) @ J_pose.T + J_z @ np.diag([0.1, 0.2]) @ J_z.T
        np.testing.assert_allclose(own, Sigma[3:, 3:], atol=1e-14)
        names = [*pose_names, "l_x", "l_y"]
        looks = [form(name, names)(*x) for name in ("h", "H_p", "H_l")]
        for mine, theirs in zip(looks, measurement(x, 0), strict=True):
            np.testing.assert_allclose(np.reshape(mine, theirs.shape), theirs, atol=1e-13)


def test_the_page_on_points_does_not_answer_the_notebook():
    """Nothing in a cell is about a mast, nor about a robot that turns before it drives."""
    for source in PAGE.code:
        assert "mast" not in source
        assert "theta + alpha" not in source
        assert "sigma_theta" not in source
