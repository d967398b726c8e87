"""The page on particles: what its worked example binds, and that it is the reference's."""

import numpy as np
from page import Page, steps

from roboloc_reference.odometry import bearing_likelihood, sample_motion
from roboloc_reference.resampling import systematic_resample

PAGE = Page("particles", "particle-filters/bootstrap-filter", steps("boot", "draw support comb"))


class Told(np.random.Generator):
    """A generator that draws the numbers of the example."""

    def __init__(self, numbers):
        super().__init__(np.random.PCG64(0))
        self.numbers = np.array(numbers)

    def standard_normal(self, size):
        """Return them, whatever is asked for."""
        return np.broadcast_to(self.numbers, size)


def test_the_page_is_a_derivation_with_a_notebook():
    """Its tagged cells come in the notebook's order, assert what they say, and the notebook is there to download."""
    PAGE.hold()


def test_the_example_is_what_the_reference_computes():
    """Sample, support and comb are those of the reference."""
    space = PAGE.bound
    spread = np.array([space[name] for name in ("sigma1", "sigma", "sigma2")])
    odometry, alphas = (
        [space[name] for name in names.split()] for names in ("rot1 trans rot2", "a1 a2 a3 a4")
    )
    rng = Told(np.array([0.0156, -0.0072, -0.0055]) / spread)
    moved = sample_motion([[0.5377, 1.8339, -0.3942]], odometry, alphas, rng)
    np.testing.assert_allclose(moved, [[space[name] for name in ("x1", "y1", "theta1")]], rtol=1e-12)
    (support,) = bearing_likelihood(moved, [0.0, 10.0], np.pi / 2, np.pi / 9)
    assert abs(support - space["density"]) < 1e-12
    assert (systematic_resample(space["ten"], 0.0097) + 1).tolist() == space["under"]


def test_the_numbers_are_those_of_the_audit():
    """ERRATA F8 and F10 to the printed digits, and what F2, F3, F4, F6 and F11 put right."""
    space = PAGE.bound
    assert [round(float(space[name]), 4) for name in ("x1", "y1", "theta1")] == [0.6305, 1.8312, -0.2096]
    assert round(float(space["expected"]), 4) == 1.8574
    assert round(0.1 * float(space["density"]), 4) == 0.0816
    assert space["under"] == [1, 1, 3, 6, 6, 7, 7, 8, 9, 9]
    assert space["rot1"] > 0 > space["rot2"]
    assert round(float(space["way"]), 4) == 0.0928
    assert round(float(space["sigma"]), 5) == 0.01024
    assert abs(space["wrapped"]) < np.pi < abs(space["gap"])
    assert (space["fresh"], space["names"]) == (["x1", "x1", "x2"], ["x1"] * 3)


def test_worked_cells_assert():
    """Every worked cell is followed by assertions."""
    for tag in PAGE.tags:
        assert all("assert " in source for tags, source in PAGE.cells if tag in tags)
