"""The public checks of the bouncing ball: what they accept, and how they say what is wrong."""

import numpy as np
import pytest
from public import Public, words_in

from roboloc.checks import ballistic
from roboloc_reference.ballistic import predict

STAGES = ("ballistic.predict", "ballistic.correct")
# What each mistake must be told by, at least: the name of one check.
FINDINGS = {
    "Jacobian of the jump alone": "Sigma follows the mean, through an impact",
    "covariance of a ball that never lands": "Sigma follows the mean, through an impact",
    "sign of the delay": "Sigma follows the mean, through three",
    "slowed down along the ground too": "bounces once, to a quarter of the height",
    "flight through the ground": "bounces once, to a quarter of the height",
    "impact at the end of the step": "two steps are one",
    "first impact only": "bounces twice in one step",
    "mean multiplied by the Jacobian": "falls",
    "doubt about a ball at rest": "comes to rest",
    "start below the ground": "starts below the ground as on the ground",
    "Jacobian transposed": "Sigma follows the mean, in the air",
    "Q multiplied by dt": "Q is added once",
    "the caller's covariance overwritten by the prediction": "leaves its arguments as they were",
    "position corrected and velocity not": "the velocity is corrected along",
    "error of the camera left out": "a useless camera changes nothing",
    "error of the camera in the place of S": "a sharp camera is believed",
    "each direction on its own": "two numbers together are two one by one",
    "state in another order": "seen as expected, the ball stays",
    "height cut off at the ground": "a ball may be a little below the ground",
    "covariance larger after the picture": "Sigma is symmetric and grows in no direction",
    "the caller's mean overwritten by the correction": "leaves its arguments as they were",
}
PUBLIC = Public(STAGES, FINDINGS)


@pytest.mark.parametrize("stage", STAGES)
def test_right_functions_pass_and_wrong_ones_are_told(stage):
    """Correct ways pass, every known mistake fails a check, which has a message, and no line is right by default."""

    def elastic_only_lost(x, Sigma, dt, gravity, restitution, Q):
        return predict(x, Sigma, dt, gravity, min(restitution, 0.99), Q)

    others = [elastic_only_lost] if stage == "ballistic.predict" else []
    PUBLIC.hold(stage, lambda *_: (np.zeros(1), np.zeros(1)), *others)


def test_no_answer_of_the_ball_is_stored():
    """No flight, no root and no gain stands in the checks."""
    assert words_in("sqrt( solve( inv( roboloc_reference", ballistic) == []
