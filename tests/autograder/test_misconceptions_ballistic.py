"""Wrong versions of the bouncing ball, and the diagnosis that names them."""

from __future__ import annotations

import numpy as np
from diagnosis import found, observed

from autograder.check import copied
from autograder.misconceptions import ball_prediction, of_stage
from roboloc_reference.ballistic import correct, motion, predict

PREDICT, CORRECT = "ballistic.predict", "ballistic.correct"


def test_the_right_loop_behind_the_wrong_versions_is_right():
    """The loop that the wrong versions are made from is the reference, as long as nothing is spoilt."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        x = rng.uniform([-2, 0.5, -2, -2], [2, 3, 2, 2])
        dt, g, e = rng.uniform(0, 3), rng.uniform(6, 15), rng.uniform(0.5, 0.95)
        state, J = ball_prediction._journey(x, dt, g, e, ball_prediction.saltation)
        right, slope = motion(x, dt, g, e)
        np.testing.assert_allclose(state, right, atol=1e-8)
        np.testing.assert_allclose(J, slope, atol=1e-6)


def test_mistakes_in_mean_and_covariance_are_both_named():
    """A mean without restitution beside a covariance of the jump alone: each output has its own name."""
    jump = next(item for item in of_stage(PREDICT) if item.name == "Jacobian of the jump alone")
    late = next(item for item in of_stage(PREDICT) if item.name == "first impact only")

    def both(*args):
        return late.function(*copied(args))[0], jump.function(*copied(args))[1]

    assert found(PREDICT, both) == [("first impact only", ("x",)), ("Jacobian of the jump alone", ("Sigma",))]


def test_a_right_ball_has_no_diagnosis():
    """Nothing is said about functions that pass."""
    assert found(PREDICT, lambda *args: tuple(value.tolist() for value in predict(*args))) == []
    assert found(CORRECT, correct) == []


def test_an_unknown_mistake_is_located():
    """A mistake that nobody knows is described by where it is: here the place along the ground."""

    def stays(x, Sigma, dt, gravity, restitution, Q):
        after, Sigma = predict(x, Sigma, dt, gravity, restitution, Q)
        return np.array([x[0], *after[1:]]), Sigma

    (sentence,) = observed(PREDICT, stays)
    assert "px" in sentence
