"""The public checks of SLAM with points: what they accept, and how they say what is wrong."""

import numpy as np
import pytest
from public import Public, words_in

from roboloc.checks import landmark_update, landmarks
from roboloc_reference import landmarks as reference

STAGES = tuple(
    f"landmarks.{name}" for name in ("init_landmarks", "predict", "measurement", "update", "evaluate")
)
# What each of these mistakes must be told by, at least: the name of one check.
FINDINGS = {
    "blocks on the diagonal alone": "Sigma follows your own x, a robot in doubt",
    "range before bearing": "a landmark straight ahead",
    "bearing noise without the range": "Sigma follows your own x, a robot that knows its pose",
    "heading grows by the way": "drives along its heading, then turns",
    "landmarks driven along": "landmarks stay",
    "noise along the axes of the world": "noise along the way and across it",
    "noise turned the wrong way": "a turned world gives a turned result",
    "covariance with the landmarks not carried": "Sigma follows your own x",
    "the caller's covariance overwritten": "leaves its arguments as they were",
    "pose minus landmark": "a landmark behind to the right",
    "bearing not wrapped": "the bearing is in one turn",
    "range that grows as one comes nearer": "Hp agrees with small changes of x",
    "landmark for the difference": "Hl agrees with small changes of x",
    "landmarks counted by numbers": "a landmark ahead and one to the left",
    "innovation not wrapped": "a landmark straight behind",
    "expected minus observed": "half and half",
    "correlations dropped before the look": "what two landmarks share is learnt of both",
    "linearized anew for each landmark": "the order of the landmarks makes no difference",
    "map taken for certain": "the map learns too",
    "looks without noise": "looks that say nothing change nothing",
    "covariance of x and y of a landmark dropped": "an ellipse that leans",
    "blocks counted from the pose": "each landmark has its own part of Sigma",
    "sum of the two coordinates": "distances in metres",
    "square of the Mahalanobis distance": "distances in standard deviations",
}
PUBLIC = Public(STAGES, FINDINGS)


@pytest.mark.parametrize("stage", STAGES)
def test_right_functions_pass_and_wrong_ones_are_told(stage):
    """Correct ways pass, every known mistake fails a check, which has a message, and no line is right by default."""

    def raw(x, Sigma, z, Q):
        v, H = reference.innovation(x, z)
        v = v + np.tile([0.1 * x[2], 0.0], len(z) // 2)
        K = np.linalg.solve(H @ Sigma @ H.T + np.kron(np.eye(len(z) // 2), Q), H @ Sigma).T
        return x + K @ v + [0.01, *np.zeros(len(x) - 1)], Sigma - K @ H @ Sigma

    def nothing_in_sight(z, Q, pose, pose_cov):
        x, Sigma = reference.init_landmarks(z, Q, pose, pose_cov)
        return x, Sigma if len(z) else 0 * Sigma

    others = {"landmarks.update": [raw], "landmarks.init_landmarks": [nothing_in_sight]}.get(stage, [])
    PUBLIC.hold(stage, lambda *_: (np.zeros(1), np.zeros(1)), *others)


def test_no_answer_about_landmarks_is_stored():
    """No angle is computed, no root taken and nothing solved in the checks."""
    words = "sqrt( solve( inv( arctan atan2 hypot cos( sin( roboloc_reference"
    assert words_in(words, landmarks, landmark_update) == []
