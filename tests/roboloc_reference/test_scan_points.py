import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboloc_reference.extraction import fit_line
from roboloc_reference.scan_points import ScanPoints

law = settings(deadline=None, derandomize=True, max_examples=50)
seed = st.integers(0, 2**32 - 1)


def draw(seed, N):
    """Draw beams that fall anywhere."""
    rng = np.random.default_rng(seed)
    return np.sort(rng.uniform(-3, 3, N)), rng.uniform(0.5, 4, N)


def distances(theta, rho):
    """Return the distances of beams from the line fitted to them, point by point."""
    if theta.size < 2:
        return np.zeros(theta.size)
    alpha, r, _ = fit_line(theta, rho, 0.0, 0.0)
    return rho * np.cos(theta - alpha) - r


@law
@given(seed, st.integers(2, 40))
def test_corner_is_the_best_of_all_cuts(seed, N):
    """The vectorised search ends where fitting both sides of every cut, one after the other, ends."""
    theta, rho = draw(seed, N)
    cuts = range(1, N)
    sums = [sum((distances(theta[a:b], rho[a:b]) ** 2).sum() for a, b in ((0, k), (k, N))) for k in cuts]
    k = ScanPoints(theta, rho, 0.1, 1.0).corner(0, N, 1)
    assert sums[k - 1] == pytest.approx(min(sums), rel=1e-9, abs=1e-11)


@law
@given(seed, st.integers(2, 40))
def test_distance_is_that_of_the_fit(seed, N):
    """The largest distance is the one that the fitted line gives."""
    theta, rho = draw(seed, N)
    expected = np.abs(distances(theta, rho)).max()
    assert ScanPoints(theta, rho, 0.1, 1.0).distance(0, N) == pytest.approx(expected, abs=1e-12)


def test_each_side_of_a_corner_keeps_its_least():
    """A corner is never cut so close to an end that one side has fewer points than asked."""
    theta = np.linspace(-0.5, 0.5, 11)
    rho = 1.0 / np.cos(theta)
    rho[8:] = 0.25 / np.sin(theta[8:])  # the last three beams fall on a wall to the left
    scan = ScanPoints(theta, rho, 0.1, 5.0)
    assert scan.corner(0, 11, 1) == 8
    assert scan.corner(0, 11, 4) <= 7


def test_runs_that_do_not_touch_are_never_one():
    """Neither beams left out nor a gap is bridged."""
    theta = np.linspace(-0.5, 0.5, 11)
    rho = 1.0 / np.cos(theta)
    rho[6:] += 1.0
    scan = ScanPoints(theta, rho, 10.0, 0.5)
    assert scan.runs() == [(0, 6), (6, 11)]
    assert scan.joint_distance((0, 3), (3, 6)) < 1e-12
    assert scan.joint_distance((0, 3), (4, 6)) == np.inf
    assert scan.joint_distance((0, 6), (6, 11)) == np.inf


def test_no_points_are_no_runs():
    """An empty scan has no run."""
    assert ScanPoints(np.zeros(0), np.zeros(0), 0.1, 1.0).runs() == []
