"""The public checks of the right-invariant filter: what they accept, and how they say what is wrong."""

import pytest
from public import Public, words_in, writes

from autograder.checks import STAGES as GRADED
from roboloc.checks import invariant

STAGES = ("invariant.predict", "invariant.correct")
# What each mistake must be told by, at least: the name of one check.
FINDINGS = {
    "noise left in the robot's frame": "a turn of the robot is one of the world, worked by hand",
    "noise turned and not shifted": "a turn of the robot is one of the world, worked by hand",
    "adjoint of the pose after the step": "an error at the start of the step",
    "prediction of the left-invariant error": "without noise the error stays as it is",
    "covariance carried as in the extended filter": "without noise the error stays as it is",
    "motion on the left of the pose": "drives ahead, whichever way it faces",
    "way along the first heading": "a quarter circle",
    "the caller's pose overwritten": "leaves its arguments as they were",
    "transpose of the pose in the innovation": "what is expected is no news",
    "transpose of the error in H": "a landmark nearer than expected",
    "correction the wrong way": "a landmark nearer than expected",
    "H of what is seen": "a world that is turned back, the robot with it",
    "turn about the robot in H": "a world that is turned back, the robot with it",
    "innovation in the robot's frame": "a world that is turned back, the robot with it",
    "noise not turned into the world": "noise along the robot's axes",
    "noise turned the other way": "noise along the robot's axes",
    "correction on the right of the pose": "a world that is turned back, the robot with it",
    "correction added to x, y and theta": "a world that is turned back, the robot with it",
    "first landmark alone": "two landmarks nearer than expected",
    "the caller's covariance overwritten": "leaves its arguments as they were",
}
PUBLIC = Public(STAGES, FINDINGS)


def _slow_lost(X, P, twist, W, dt):
    """Predict, but lose the way of a robot that hardly turns."""
    if 0 < abs(twist[2]) < 1e-6:
        twist = twist * [0.0, 0.0, 1.0]
    return GRADED["invariant.predict"].reference(X, P, twist, W, dt)


def _blind_lost(X, P, Y, landmarks, N):
    """Correct, but forget everything where nothing is seen."""
    after, Sigma = GRADED["invariant.correct"].reference(X, P, Y, landmarks, N)
    return (after, Sigma) if len(landmarks) else (after, 2 * Sigma)


@pytest.mark.parametrize(("stage", "other"), list(zip(STAGES, (_slow_lost, _blind_lost), strict=True)))
def test_right_functions_pass_and_wrong_ones_are_told(stage, other):
    """Correct ways pass, every known mistake fails a check, which has a message, and no line is right by default."""
    PUBLIC.hold(stage, other, lambda *_: None, writes(GRADED[stage].reference))


def test_no_answer_is_stored():
    """The checks know no exponential, no adjoint, no gain and no product with a transpose."""
    assert words_in("se2 expm adjoint solve inv( .T kron", invariant) == []
