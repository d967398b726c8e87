"""The hidden checks of Monte Carlo localization: what they catch, and what they let pass."""

from __future__ import annotations

import numpy as np
import pytest
from matrix import hold_matrix

import kill_matrix
from autograder import loops, remote
from autograder.checks import STAGES
from autograder.checks.cloud_inputs import many_moved
from autograder.grading import grade
from autograder.vectorised import judged
from roboloc_reference import mcl

pytestmark = pytest.mark.filterwarnings("ignore:no particle:RuntimeWarning")
SECRETS = [f"course-{number}" for number in range(3)]
# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    "mcl.transition_model": {
        "straight step": ({1, 3, 4, 5, 6, 7}, 3),
        "turn first, then drive": ({1, 3, 4, 5, 6, 7}, 3),
        "one control for all": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "mean control for all": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "one formula for the whole cloud": ({3}, 16),
        "headings wrapped": ({4}, 18),
        "the caller's cloud overwritten": ({6}, 18.5),
    },
    "mcl.compute_predicted_measurements": {
        "scanner at the robot's centre": ({2, 3}, 13),
        "mounting not turned with the robot": ({2, 3}, 13),
        "distance left negative": ({3}, 16),
        "absolute value alone": ({3}, 16),
        "angles not wrapped": ({4, 5}, 15),
        "heading added": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "axes exchanged by reshape": ({1, 2, 3, 4, 5}, 2),
    },
    "mcl.compute_innovations": {
        "angles subtracted as numbers": ({4}, 16),
        "expected minus seen": (set(range(1, 9)), 0),
        "radians and metres alike": ({2}, 17),
        "covariance not inverted": ({2}, 17),
        "one covariance for all observations": ({3}, 17),
        "one association for the whole cloud": (set(range(1, 9)), 0),
        "angles first, then distances": ({1, 2, 3, 4, 5, 6}, 2),
        "gated": ({5}, 18),
    },
    "mcl.measurement_weights": {
        "weights before forgotten": ({3, 5, 6}, 12),
        "likelihoods multiplied as they are": ({4}, 17),
        "likelihoods added": ({2, 3, 4, 5, 7, 8}, 7),
        "half lost in the exponent": ({1, 2, 3, 4, 5, 7, 8}, 3),
        "weighed by the covariance itself": ({1, 2, 3, 4, 5, 7, 8}, 3),
        "mean over the observations": ({2, 3, 4, 5, 7, 8}, 7),
        "correlation ignored": ({1, 2, 3, 4, 5, 7, 8}, 3),
        "nobody left": ({6}, 17),
        "total not 1": (set(range(1, 9)), 0),
    },
}


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix(name):
    """Every wrong version fails just its checks and is named, every correct one passes, whatever the secret."""
    hold_matrix(EXPECTED[name], {"mcl_complex", "mcl_loops", "mcl_matrices"}, name, SECRETS)


def test_lists_and_views_are_results(published):
    """A list of lists, and a view in another order of memory, are as good as an array."""
    assert grade("mcl.transition_model", lambda *args: mcl.transition_model(*args).tolist(), 20) == 20
    assert (
        grade("mcl.transition_model", lambda *args: np.asfortranarray(mcl.transition_model(*args)), 20) == 20
    )


@pytest.mark.parametrize("name", EXPECTED)
def test_alternatives_earn_extra_credit_unless_they_loop(name):
    """Complex numbers and matrices run as many lines for any cloud, and their text has no loop; loops earn nothing."""
    stage = STAGES[name]
    for title, function in kill_matrix.alternatives(stage).items():
        reasons, _ = judged(stage, function)
        if title == "mcl_loops":
            assert any("goes from particle to particle" in reason for reason in reasons), title
        else:
            assert reasons == [], title


def test_the_clouds_that_count_lines_are_no_secret():
    """The arguments for counting are the same with any secret, and as many as asked for."""
    for one, other in zip(many_moved(10), many_moved(10), strict=True):
        np.testing.assert_array_equal(one, other)
    assert len(many_moved(1000)[0]) == 1000
    assert loops.Length.CLOUD > loops.Length.SMALL
    assert remote.line_events(mcl.transition_model, many_moved(100), 1000)[0] < 1000
