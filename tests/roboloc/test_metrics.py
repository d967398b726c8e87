import numpy as np
import pytest
from oracles import read_only
from scipy.stats import chi2

from roboloc.metrics import chi2_band, credible_ellipse, nees, nis, pose_error


def test_the_heading_error_is_wrapped():
    """Whole turns make no error, in single poses and in lists of them."""
    rng = np.random.default_rng(1)
    x = rng.uniform(-3, 3, size=(50, 3))
    turns = 2 * np.pi * rng.integers(-3, 4, size=50)
    truth = x - [0.1, -0.2, 0.3] + np.stack([0 * turns, 0 * turns, turns], axis=1)
    errors = pose_error(x, truth)
    np.testing.assert_allclose(errors, np.tile([0.1, -0.2, 0.3], (50, 1)), atol=1e-12)
    np.testing.assert_array_equal(errors[7], pose_error(x[7], truth[7]))
    assert pose_error([0, 0, np.pi], [0, 0, 0])[2] == -np.pi


@pytest.mark.parametrize("function", [nees, nis])
def test_normalized_squares_equal_the_formula(function):
    """Alone or stacked, the value is that of the formula with the inverse matrix."""
    rng = np.random.default_rng(2)
    A = rng.normal(size=(6, 3, 3))
    v, S = read_only(rng.normal(size=(6, 3)), A @ A.transpose(0, 2, 1) + np.eye(3))
    right = [e @ np.linalg.inv(P) @ e for e, P in zip(v, S, strict=True)]
    np.testing.assert_allclose(function(v, S), right)
    np.testing.assert_allclose([function(e, P) for e, P in zip(v, S, strict=True)], right)
    assert isinstance(function(v[0], S[0]), float)


def test_nothing_observed_is_nothing_wrong():
    """An empty innovation has the square 0."""
    assert nis(np.zeros(0), np.zeros((0, 0))) == 0


def test_gaussian_errors_stay_in_the_band():
    """The mean NEES of 400 errors drawn from their covariance is in the band; fixed seed, false alarm 1e-3."""
    Sigma = np.array([[2.0, 0.5, 0.1], [0.5, 1.0, -0.3], [0.1, -0.3, 0.4]])
    errors = np.random.default_rng(3).multivariate_normal(np.zeros(3), Sigma, size=400)
    low, high = chi2_band(3, 0.999, runs=400)
    assert low < nees(errors, np.broadcast_to(Sigma, (400, 3, 3))).mean() < high
    assert not low < nees(errors, np.broadcast_to(Sigma / 2, (400, 3, 3))).mean() < high


@pytest.mark.parametrize("dof", [1, 3, 8])
@pytest.mark.parametrize("runs", [1, 200])
@pytest.mark.parametrize("probability", [0.5, 0.95, 0.999])
def test_band_equals_that_of_scipys_distribution(dof, runs, probability):
    """Both ends are quantiles of the mean of chi-squared numbers."""
    tails = [(1 - probability) / 2, (1 + probability) / 2]
    np.testing.assert_allclose(chi2_band(dof, probability, runs), chi2.ppf(tails, dof * runs) / runs)


@pytest.mark.parametrize("probability", [1e-6, 0.5, 0.95, 0.999])
def test_outline_has_the_distance_of_the_probability(probability):
    """Every point of the outline has the Mahalanobis distance whose square is scipy's quantile, any Sigma."""
    rng = np.random.default_rng(4)
    for A in rng.normal(size=(20, 2, 2)) * 10.0 ** rng.uniform(-3, 3, size=(20, 1, 1)):
        (Sigma,) = read_only(A @ A.T)
        half_axes, angle = credible_ellipse(Sigma, probability)
        assert half_axes[0] >= half_axes[1]
        assert -np.pi / 2 <= angle < np.pi / 2
        phi = np.linspace(0, 2 * np.pi, 13)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        outline = (turn @ (half_axes[:, None] * [np.cos(phi), np.sin(phi)])).T
        d2 = nees(outline, np.broadcast_to(Sigma, (13, 2, 2)))
        np.testing.assert_allclose(d2, chi2.ppf(probability, 2), rtol=1e-6)


def test_an_ellipse_may_be_a_line_or_a_point():
    """A direction without variance, or with what rounding left of it, has no width."""
    half_axes, angle = credible_ellipse([[1.0, 1.0], [1.0, 1.0]], 1 - np.exp(-0.5))
    np.testing.assert_allclose(half_axes, [2**0.5, 0], atol=1e-7)
    assert angle == pytest.approx(np.pi / 4)
    np.testing.assert_array_equal(credible_ellipse(-1e-18 * np.eye(2))[0], [0, 0])
    assert credible_ellipse(np.diag([0.0, 1.0]))[1] == -np.pi / 2


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: credible_ellipse(np.eye(3)), "Sigma"),
        (lambda: credible_ellipse(np.nan * np.eye(2)), "Sigma"),
        (lambda: credible_ellipse(np.eye(2), 0.0), "probability"),
        (lambda: credible_ellipse(np.eye(2), 1.0), "probability"),
        (lambda: pose_error([1, 2], [1, 2]), "x"),
        (lambda: pose_error([1, 2, 3], [1, 2]), "truth"),
        (lambda: pose_error([1, 2, 3], [[1, 2, 3]]), "truth"),
        (lambda: nees(np.ones(3), np.eye(2)), "Sigma"),
        (lambda: nees(np.ones(3), np.zeros((3, 3))), "Sigma"),
        (lambda: nees(np.ones((2, 3)), np.eye(3)), "Sigma"),
        (lambda: nis(1.0, np.eye(1)), "v"),
        (lambda: nis([np.nan], np.eye(1)), "v"),
        (lambda: chi2_band(0, 0.9), "dof"),
        (lambda: chi2_band(3, 1.0), "probability"),
        (lambda: chi2_band(3, 0.9, 0), "runs"),
    ],
)
def test_a_wrong_argument_is_named(call, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        call()
