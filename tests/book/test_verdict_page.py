"""The page that compares four filters: what it binds, and that it does not answer its notebook."""

import pytest
import sympy as sp
from page import Page
from scipy.stats import norm

PAGE = Page("four-filters-one-run", "four-filters/comparison", ("derive-claims",))


def test_the_page_is_a_derivation_with_a_notebook():
    """Its tagged cells assert what they say, and the notebook is there to download."""
    PAGE.hold()


@pytest.mark.parametrize("k", [0.7, 1.0, 3.0])
def test_the_share_of_one_number_is_that_of_the_normal_distribution(k):
    """What is inside z deviations of the claim, for errors k times as large."""
    held = PAGE.bound["held"].subs({PAGE.bound["claim_k"]: k, PAGE.bound["z"]: 1.3})
    assert float(held) == pytest.approx(1 - 2 * norm.sf(1.3 / k))


def test_the_page_does_not_answer_the_notebook():
    """Nothing on the page has a share in the plane, a bias, or the variance of a difference as a formula."""
    symbols = {name for name, value in PAGE.bound.items() if isinstance(value, sp.Symbol)}
    assert symbols == {"claim_k", "z", "e"}
    for words in ("(1 - p)", "E_nees", "b_x", r"2 \\rho", "sqrt(len(", "chi2.ppf"):
        assert words not in PAGE.text
