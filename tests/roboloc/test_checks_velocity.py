"""The public checks of the velocity model and the unscented filter: what they accept, what they find wrong."""

import numpy as np
import pytest
from public import Public, words_in

from autograder.checks import STAGES as GRADED
from roboloc.checks import unscented, velocity

STAGES = (
    *(f"velocity.{name}" for name in ("motion", "jacobians", "noise", "range_bearing")),
    *(f"ukf.{name}" for name in ("sigma_points", "predict", "correct")),
)
PUBLIC = Public(STAGES, {})


@pytest.mark.parametrize("stage", STAGES)
def test_right_functions_pass_and_wrong_ones_are_told(stage):
    """Correct ways pass, every known mistake fails a check, which has a message, and no line is right by default."""
    reference = GRADED[stage].reference

    def overwrites(*args):
        result = reference(*args)
        args[0][...] = 7.0
        return result

    def few_digits(x, u, dt):
        return reference(x, np.add(u, [0, 1e-3 * (u[1] != 0), 0]), dt)

    def changed_by_nothing(mean, cov, *_):
        return mean + 1, cov

    others = {"velocity.jacobians": [few_digits], "ukf.correct": [changed_by_nothing]}.get(stage, [])
    PUBLIC.hold(stage, overwrites, *others)


def test_numbers_worked_by_hand_are_right():
    """The average of the points' views in the correction's example is that of three views, by hand."""
    y = np.array([0.0, 0.5 * np.sqrt(3), -0.5 * np.sqrt(3)])
    bearings, ranges = np.arctan2(2 - y, 2), np.hypot(2, 2 - y)
    weights = np.array([4, 1, 1]) / 6
    np.testing.assert_allclose([weights @ bearings, weights @ ranges], (0.769819, 2.851281), atol=1e-6)


def test_no_answer_is_stored():
    """No sine, cosine, arctangent or root of a matrix stands in the checks."""
    assert words_in("sin( cos( arctan atan cholesky hypot", velocity, unscented) == []
