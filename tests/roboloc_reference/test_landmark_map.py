from math import hypot

import numpy as np
import pytest
from landmark_forms import covariance
from oracles import read_only
from scipy.stats import chi2

from roboloc_reference import landmarks
from roboloc_reference.landmark_map import evaluate


def test_distances_are_metres_and_standard_deviations():
    """The Mahalanobis distance is a root, uses each landmark's own correlated block, and nothing else."""
    rng = np.random.default_rng(13)
    x, Sigma, truth = rng.normal(size=9), covariance(rng, 9), rng.normal(size=6)
    euclidean, mahalanobis = evaluate(x, Sigma, truth)
    for j in range(3):
        at = slice(3 + 2 * j, 5 + 2 * j)
        e = x[at] - truth[2 * j : 2 * j + 2]
        assert euclidean[j] == pytest.approx(hypot(*e), rel=1e-12)
        assert mahalanobis[j] == pytest.approx(np.sqrt(e @ np.linalg.inv(Sigma[at, at]) @ e), rel=1e-12)


def test_distances_of_an_honest_map_are_chi_square():
    """Of 5,000 errors drawn from the covariance, 10, 50 and 90 % lie below its quantiles, each to 5 sigma."""
    rng, N = np.random.default_rng(14), 5_000
    Sigma = covariance(rng, 5)
    errors = rng.multivariate_normal(np.zeros(2), Sigma[3:, 3:], N)
    distances = np.array([evaluate([0.0, 0.0, 0.0, *e], Sigma, [0.0, 0.0])[1][0] for e in errors])
    for share in (0.1, 0.5, 0.9):
        below = np.mean(distances**2 < chi2.ppf(share, 2))
        assert abs(below - share) < 5 * np.sqrt(share * (1 - share) / N)


def test_arguments_are_read_only_and_the_name_is_that_of_the_stage():
    """Read-only arrays are accepted, no landmark gives two empty arrays, and `landmarks.evaluate` is this one."""
    x, Sigma, truth = read_only(np.ones(7), np.eye(7), np.zeros(4))
    for distances in evaluate(x, Sigma, truth):
        np.testing.assert_allclose(distances, np.sqrt(2), rtol=1e-15)
    assert [part.shape for part in evaluate(x[:3], Sigma[:3, :3], [])] == [(0,), (0,)]
    assert landmarks.evaluate is evaluate


@pytest.mark.parametrize(
    ("x", "Sigma", "truth", "message"),
    [
        (np.zeros(4), np.eye(4), [1.0], r"x: expected shape \(3 \+ 2k,\), got shape \(4,\)"),
        (np.zeros(5), np.eye(3), [1.0, 2.0], "Sigma: expected shape"),
        (np.zeros(5), np.eye(5), [1.0], "truth: expected shape"),
        (
            np.zeros(5),
            np.zeros((5, 5)),
            [1.0, 2.0],
            "Sigma: expected each landmark's block positive definite",
        ),
    ],
)
def test_a_wrong_argument_is_named(x, Sigma, truth, message):
    """A wrong argument is an error with its name, what was expected and what came."""
    with pytest.raises(ValueError, match=message):
        evaluate(x, Sigma, truth)
