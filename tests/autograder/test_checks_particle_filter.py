"""The hidden checks of the particle filter: what they catch, what they let pass, and how often they err."""

from __future__ import annotations

import numpy as np
import pytest
from matrix import hold_matrix

from autograder.check import run_stage
from autograder.checks import EXPRESSIONS, STAGES, thin_cloud, velocity_cloud
from autograder.grading import grade
from roboloc_reference.particle import effective_sample_size, predict

SECRETS = [f"course-{number}" for number in range(3)]
PREDICT, CORRECT, SIZE = (f"particle.{name}" for name in ("predict", "correct", "effective_sample_size"))
TWO, OFF = "thin_cloud.n_two", "thin_cloud.share_off"
MOST, ALL, SIX = {1, 2, 3, 4, 5, 7, 8}, set(range(1, 9)), set(range(1, 7))

# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    PREDICT: {
        "variances drawn as deviations": ({3, 4, 6}, 11),
        "errors scaled with the time": ({3, 4, 6}, 11),
        "alphas of v and omega exchanged in the cloud": ({3, 4, 6}, 11),
        "speeds not squared in the cloud": ({3, 4, 6}, 11),
        "gamma without an error": ({3, 4, 5, 6}, 9),
        "one control for all particles": ({2, 3, 4, 5, 6}, 7),
        "one number for three controls": ({5}, 18),
        "errors added to the pose": ({2, 3, 4, 5, 6}, 7),
        "cloud along the first heading": ({1, 2, 3, 4, 5, 6}, 2),
        "cloud turned before the arc": ({1, 3, 4, 5, 6}, 4),
        "cloud moved in place": ({7}, 18),
    },
    CORRECT: {
        "earlier weights dropped": (ALL, 0),
        "bearing's innovation not wrapped": ({3}, 17),
        "likelihoods without logarithms": ({4}, 18),
        "likelihoods of landmarks added": ({2, 3, 4, 5}, 10),
        "first of the landmarks alone": ({2, 3, 4, 5}, 10),
        "half of the exponent missing": (MOST, 1),
        "correlation of the sensor left out": (MOST, 1),
        "Q taken for deviations": (MOST, 1),
        "weights not normalised": (ALL, 0),
        "range taken for the bearing": (MOST, 1),
        "heading left out of the bearing": (MOST, 1),
        "small number added to the weights": (ALL, 0),
        "weights overwritten": ({7}, 18),
    },
    SIZE: {
        "sum of the weights taken for 1 in the size": ({2, 4, 5}, 12),
        "sum not squared": ({2, 4, 5}, 12),
        "root of the size": (SIX, 0),
        "share in the place of a size": (SIX, 0),
        "living particles counted": (SIX, 0),
        "inverse of the largest weight": (SIX, 0),
        "exponential of the entropy": (SIX, 0),
        "squared before scaled": ({4}, 18),
        "weights normalised on the way": ({5}, 18),
    },
    TWO: dict.fromkeys(("large weights alone", "others counted twice", "large weight not squared"), ({1}, 0)),
    OFF: dict.fromkeys(("observation in the middle", "quotient turned round", "mean weight alone"), ({1}, 0)),
}


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix(name):
    """Every wrong version fails just its checks and is named, every correct one passes, whatever the secret."""
    correct = set() if name in EXPRESSIONS else {"cloud_loops", "cloud_complex"}
    hold_matrix(EXPECTED[name], correct, name, SECRETS)


def test_correct_clouds_are_not_rejected():
    """A thousand runs of the reference with other seeds: none is rejected, and none comes near."""
    stage = velocity_cloud.PREDICT
    cases = [
        make(np.random.default_rng(5))[i]
        for i, make in enumerate((velocity_cloud.by_speed, velocity_cloud.by_turning))
    ]
    worst = 0.0
    for seed in range(1000):
        for case in cases:
            args = (*case.args[:-1], np.random.default_rng([seed, 17]))
            found = stage.summary(args, predict(*args))
            for value, right, allowed in zip(found, case.expected, case.tolerance, strict=True):
                worst = max(worst, float(np.max(np.abs(value - right) / allowed)))
    assert worst < 0.8


def test_headings_may_be_in_any_turn(published):
    """Headings that are some turns on get all points."""
    assert grade(PREDICT, lambda *args: predict(*args) + np.array([0, 0, 6 * np.pi]), 6) == 6


def test_nothing_explains_what_is_meant_to_be_unlikely():
    """Of the unlikely observations every density is 0 in floating point, and more than one particle matters."""
    for case in velocity_cloud.unlikely(np.random.default_rng(3)):
        assert velocity_cloud.underflows(case)
        assert effective_sample_size(case.expected[0]) > 1.01


def test_what_is_handed_back_as_it_came_scores_nothing(published):
    """Particles that never moved, weights that never changed and the number of them are no answer."""
    assert grade(PREDICT, lambda xs, *_: xs, 10) == 0
    assert grade(CORRECT, lambda _xs, ws, *_: ws, 10) == 0
    assert grade(SIZE, len, 10) == 0


def test_draws_from_elsewhere_are_seen():
    """A generator of one's own costs the one check that asks for the given one."""
    own = np.random.default_rng(5)
    outcome = run_stage(STAGES[PREDICT], lambda *args: predict(*args[:-1], own), "s")
    assert [result.check.name for result in outcome.failed] == ["draws from rng alone"]


def test_the_share_is_that_of_a_large_cloud():
    """The symbolic answers are the effective sizes of weights, counted."""
    rng = np.random.default_rng(8)
    s, q, z = 0.8, 0.5, 1.1
    ws = np.exp(-0.5 * ((rng.normal(0, s, 400_000) - z) / q) ** 2)
    assert effective_sample_size(ws) / ws.size == pytest.approx(
        float(thin_cloud.share(s**2, q**2, z)), rel=0.02
    )
    two = thin_cloud.of_two_kinds({"M": 7.0, "k": 2.0, "a": 3.0})
    assert float(two) == pytest.approx(effective_sample_size([3, 3, 1, 1, 1, 1, 1]))
