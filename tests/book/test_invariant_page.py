"""The page on the invariant filter: what its derivation binds, and that it does not answer its notebook."""

import numpy as np
import pytest
import sympy as sp
from page import Page, steps

from roboloc import se2
from roboloc.four_filters import load
from roboloc_reference import invariant

TAGS = steps("invariant", "exp adjoint error landmark back look")
PAGE = Page("the-invariant-filter", "four-filters/invariant-ekf", TAGS)


def at(name, **values):
    """Return a matrix of the page at some values, as floats."""
    matrix = PAGE.bound[name].subs({PAGE.bound[key]: value for key, value in values.items()})
    return np.array(matrix, dtype=float)


def test_the_page_is_a_derivation_with_a_notebook():
    """Its tagged cells assert what they say, and the notebook is there to download."""
    PAGE.hold()


def test_the_derivation_is_what_the_package_computes():
    """The exponential and the adjoint of the page are those of the package."""
    found = at("E", v_1=0.7, v_2=-0.4, omega=0.9, t=1.0)
    x, y, theta = se2.exp([0.7, -0.4, 0.9])
    assert found[:2, 2] == pytest.approx([x, y], abs=1e-12)
    assert found[0, 0] == pytest.approx(np.cos(theta))
    Ad = at("Ad", x=2.0, y=-1.0, c=np.cos(0.6), s=np.sin(0.6))
    assert np.allclose(Ad, se2.adjoint([2.0, -1.0, 0.6]), atol=1e-12)


def test_h_is_that_of_the_reference():
    """One correction written with the page's H is the reference's."""
    X, P, N = np.eye(3), np.diag([0.2, 0.3, 0.1]), 0.05 * np.eye(2)
    H = at("H", m_x=3.0, m_y=1.5)
    S = H @ P @ H.T + N
    _, after = invariant.correct(X, P, [[2.9, 1.4, 1.0]], [[3.0, 1.5]], N)
    assert np.allclose(after, P - P @ H.T @ np.linalg.solve(S, H @ P), atol=1e-12)


def test_both_filters_have_one_mean_while_they_drive_blind():
    """The page says that only the claims differ."""
    found = load("unsure")
    blind = found["EKF"].times < 4.1
    one, other = (found[name].poses[:, blind] for name in ("EKF", "InEKF"))
    assert np.abs(one - other).max() < 1e-5


def test_the_page_does_not_answer_the_notebook():
    """No cell of the page has the left error, a pose with an angle as its symbol, or an antenna."""
    names = {value.name for value in PAGE.bound.values() if isinstance(value, sp.Symbol)}
    assert not names & {"theta", "phi", "a"}
    for words in ("F_left", "H_antenna", "B_left", "antenna"):
        assert words not in PAGE.text
