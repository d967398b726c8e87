"""The page on Monte Carlo localization: its numbers by hand, and that they are the reference's."""

import numpy as np
import pytest
from page import Page

from roboloc_reference import mcl

PAGE = Page("monte-carlo-localization", "particle-filters/monte-carlo-localization", ())


@pytest.fixture(scope="module")
def short():
    """Run the page's cells before the run in the arena, and return what they bind."""
    space = {}
    for source in PAGE.code[: next(i for i, source in enumerate(PAGE.code) if "glue" in source)]:
        exec(source, space)  # noqa: S102 - the book's own cells
    return space


def test_the_page_derives_nothing_and_has_a_notebook():
    """No cell is the notebook's, too, and the notebook is there to download."""
    PAGE.hold()


def test_numbers_by_hand_are_those_of_the_reference(short):
    """The table's two particles, alike after one wall and 0.989 to 0.011 after the second."""
    one = mcl.measurement_weights(short["scan"][:, :2], [short["Q"]], [0.5, 0.5])
    np.testing.assert_allclose(one, [0.5, 0.5])
    for printed in (f"{after:.3f}" for after in short["after"]):
        assert f" {printed}" in PAGE.text
    assert f"| likelihood, without its factor | {np.exp(-0.5):.3f} |" in PAGE.text


def test_two_squares_are_the_distance_of_the_reference(short):
    """The nearest line by the sum of two squares is the one that the reference takes."""
    names = ("v_a", "v_r", "q_aa", "q_rr", "q_ar")
    form = short["sp"].lambdify([short[name] for name in names], short["squares"])
    Q, z = np.array([[0.02, 0.012], [0.012, 0.03]]), np.array([[0.1], [2.0]])
    hs = np.random.default_rng(2).normal(size=(50, 2, 4)) * 0.3 + [[0.1], [2.0]]
    v = z - hs
    nearest = form(v[:, 0], v[:, 1], Q[0, 0], Q[1, 1], Q[0, 1]).argmin(axis=1)
    expected = np.take_along_axis(v, nearest[:, None, None], axis=2)[..., 0]
    np.testing.assert_allclose(mcl.compute_innovations(z, [Q], hs), expected, atol=1e-12)
