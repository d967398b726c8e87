"""The page on SLAM with points: what its derivation binds, and that it is the reference's."""

from pathlib import Path

import jupytext
import numpy as np
import pytest
import sympy as sp

from roboloc_reference.landmarks import init_landmarks, measurement, predict

PAGE = Path(__file__).resolve().parents[2] / "book" / "slam-with-points.md"
PARTS = ("symbols", "step", "noise", "sighting", "start", "look", "by-pose", "by-landmark")
DERIVATION = [f"derive-points-{part}" for part in PARTS]


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


def form(derived, name, names):
    """Return a form of the page as a function of numbers."""
    return sp.lambdify([derived[symbol] for symbol in names], derived[name])


def test_derivation_of_points_comes_in_the_notebooks_order():
    """The tagged cells come in the notebook's order, and each step after the symbols asserts something."""
    tags = [tag for found, _ in code_cells() for tag in found if tag.startswith("derive-")]
    assert list(dict.fromkeys(tags)) == DERIVATION
    for tag in DERIVATION[1:]:
        assert any("assert " in source for found, source in code_cells() if tag in found)


def test_derivation_of_points_is_what_the_reference_computes(derived):
    """Step, noise, place, look and their derivatives agree with the reference at random points."""
    rng = np.random.default_rng(3)
    pose_names, sigmas = ["x", "y", "theta"], ["sigma_1", "sigma_2", "sigma_3"]
    for _ in range(20):
        pose, (d, alpha), stds = rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 2), rng.uniform(0.1, 1, 3)
        moved, added = predict(pose, np.zeros((3, 3)), [d, alpha], np.diag(stds**2))
        carried = predict(pose, np.eye(3), [d, alpha], np.zeros((3, 3)))[1]
        g, G = (form(derived, name, [*pose_names, "d", "alpha"])(*pose, d, alpha) for name in ("g", "G"))
        np.testing.assert_allclose(np.ravel(g), moved, atol=1e-14)
        np.testing.assert_allclose(G @ G.T, carried, atol=1e-14)
        np.testing.assert_allclose(
            form(derived, "noise", ["theta", *sigmas])(pose[2], *stds), added, atol=1e-14
        )
        beta, r = rng.uniform(-1, 1), rng.uniform(1, 3)
        names = [*pose_names, "beta", "r"]
        place, J_pose, J_z = (
            form(derived, name, names)(*pose, beta, r) for name in ("place", "J_pose", "J_z")
        )
        x, Sigma = init_landmarks([beta, r], np.diag([0.1, 0.2]), pose, np.diag([0.3, 0.4, 0.5]))
        np.testing.assert_allclose(np.ravel(place), x[3:], atol=1e-14)
        np.testing.assert_allclose(J_pose @ np.diag([0.3, 0.4, 0.5]), Sigma[3:, :3], atol=1e-14)
        own = J_pose @ np.diag([0.3, 0.4, 0.5]) @ J_pose.T + J_z @ np.diag([0.1, 0.2]) @ J_z.T
        np.testing.assert_allclose(own, Sigma[3:, 3:], atol=1e-14)
        names = [*pose_names, "l_x", "l_y"]
        looks = [form(derived, name, names)(*x) for name in ("h", "H_p", "H_l")]
        for mine, theirs in zip(looks, measurement(x, 0), strict=True):
            np.testing.assert_allclose(np.reshape(mine, theirs.shape), theirs, atol=1e-13)


def test_the_page_on_points_does_not_answer_the_notebook():
    """Nothing in a cell is about a mast, nor about a robot that turns before it drives."""
    for _, source in code_cells():
        assert "mast" not in source
        assert "theta + alpha" not in source
        assert "sigma_theta" not in source


def test_the_page_on_points_links_its_notebook():
    """The page has a download link to the released notebook."""
    assert "</notebooks/ekf-slam/landmark-slam.ipynb>" in PAGE.read_text(encoding="utf-8")
