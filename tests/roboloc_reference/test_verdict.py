"""What judges filters: coverage and precision of honest, made-up filters, by laws that hold for them."""

import numpy as np
import pytest
from scipy.stats import chi2

from roboloc_reference.verdict import coverage, mean_and_error, paired_interval, rms_errors


def test_honest_claims_hold_the_truth_as_often_as_they_say():
    """Of Gaussian errors with the claimed covariance, as many are inside as the probability says."""
    rng = np.random.default_rng(1)
    for n, probability in ((1, 0.5), (2, 0.9), (3, 0.95)):
        L = np.tril(rng.uniform(0.5, 1.0, (4000, 2, n, n)))
        errors = (L @ rng.normal(size=(4000, 2, n, 1)))[..., 0]
        share = coverage(errors, L @ np.swapaxes(L, -1, -2), probability)
        assert np.abs(share - probability).max() < 5 * np.sqrt(probability * (1 - probability) / 4000)


def test_too_small_a_claim_holds_what_the_formula_says():
    """Errors k times too large, in the plane: 1 - (1 - p)^(1 / k^2), as the tail of two squares says."""
    rng = np.random.default_rng(2)
    share = coverage(rng.normal(size=(4000, 3, 2)) * 2, np.tile(np.eye(2), (4000, 3, 1, 1)), 0.95)
    expected = chi2.cdf(chi2.ppf(0.95, 2) / 4, 2)
    assert expected == pytest.approx(1 - 0.05**0.25)
    assert np.abs(share - expected).max() < 0.04


def test_the_standard_error_is_the_scatter_of_the_mean():
    """Over many sets of runs whose instants hang together, it is the deviation that the mean really has."""
    rng = np.random.default_rng(3)
    pairs = [mean_and_error(rng.normal(size=(20, 1)) + 0.3 * rng.normal(size=(20, 30))) for _ in range(500)]
    means, claimed = np.transpose(pairs)
    assert np.sqrt(np.mean(claimed**2)) == pytest.approx(means.std(), rel=0.12)


def test_the_paired_interval_holds_the_difference():
    """For 40 runs and a difference of 0.5, about 95 of a hundred intervals do, though the runs differ by far more."""
    rng = np.random.default_rng(4)
    held = 0
    for _ in range(100):
        hard = 20 * rng.normal(size=40)
        a, b = hard + 0.5 + rng.normal(size=40), hard + rng.normal(size=40)
        low, high = paired_interval(a, b, rng.integers(0, 40, (300, 40)), 0.95)
        held += low <= 0.5 <= high
        assert high - low < 2
    assert held >= 87


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: mean_and_error(np.ones((1, 5))), "values: expected two runs at least, got one"),
        (lambda: coverage(np.ones((2, 1, 2)), np.ones((2, 1, 3, 3)), 0.9), "covs"),
        (lambda: coverage(np.ones((2, 1, 1)), np.ones((2, 1, 1, 1)), 1.0), "probability: expected a number"),
        (
            lambda: paired_interval([1.0, 2], [1.0, 2], [[0, 2]], 0.9),
            "picks: expected whole numbers from 0 to 1",
        ),
        (lambda: paired_interval([1.0, 2], [1.0, 2], [[0, 0.5]], 0.9), "picks: expected whole"),
        (lambda: rms_errors(np.ones((2, 1, 3)), np.ones((2, 2, 3))), "truth"),
    ],
)
def test_what_cannot_be_judged_is_refused(call, words):
    """One run, other shapes, probabilities of 1 and picks that are no runs are refused by name."""
    with pytest.raises(ValueError, match=words):
        call()
