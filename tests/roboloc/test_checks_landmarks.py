"""The public checks of SLAM with points: what they accept, and how they say what is wrong."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from autograder.misconceptions import of_stage
from roboloc.checks import STAGES as PUBLIC
from roboloc.checks import check, landmark_update
from roboloc.checks import landmarks as public
from roboloc_reference import landmarks as reference

STAGES = ("init_landmarks", "predict", "measurement", "update", "evaluate")
ALTERNATIVES = Path(__file__).resolve().parents[1] / "autograder" / "alternatives" / "landmark_slam"


def alternatives(stage):
    """Load the other right ways to write a stage."""
    for path in sorted(ALTERNATIVES.glob("*.py")):
        spec = importlib.util.spec_from_file_location(f"public_{path.stem}", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        yield getattr(module, stage)


@pytest.mark.parametrize("stage", STAGES)
def test_right_landmarks_pass(stage):
    """Every correct way passes: the reference, complex numbers, differences, one number after the other."""
    for function in (getattr(reference, stage), *alternatives(stage)):
        report = check(function, stage=f"landmarks.{stage}")
        assert report, str(report)


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


@pytest.mark.parametrize("stage", STAGES)
def test_wrong_landmarks_are_told_what_is_wrong(stage):
    """Every mistake in the catalogue fails a public check, which has a message; and every check can fail."""

    def short(*_):
        return np.zeros(1), np.zeros(1)

    def raw(x, Sigma, z, Q):
        v, H = landmark_raw(x, z)
        K = np.linalg.solve(H @ Sigma @ H.T + np.kron(np.eye(len(z) // 2), Q), H @ Sigma).T
        return x + K @ v + [0.01, *np.zeros(len(x) - 1)], Sigma - K @ H @ Sigma

    def landmark_raw(x, z):
        v, H = reference.innovation(x, z)
        return v + np.tile([0.1 * x[2], 0.0], len(z) // 2), H

    def nothing_in_sight(z, Q, pose, pose_cov):
        x, Sigma = reference.init_landmarks(z, Q, pose, pose_cov)
        return x, Sigma if len(z) else 0 * Sigma

    extra = {"update": [raw], "init_landmarks": [nothing_in_sight]}.get(stage, [])
    failed = set()
    for name, function in [
        *((item.name, item.function) for item in of_stage(f"landmarks.{stage}")),
        *(("", function) for function in (short, *extra)),
    ]:
        report = check(function, stage=f"landmarks.{stage}")
        messages = {one.name: one.message for one in report.items if one.passed is False}
        assert messages, name
        assert all(messages.values()), name
        assert FINDINGS.get(name, next(iter(messages))) in messages, name
        failed |= set(messages)
    assert failed == {one.name for one in PUBLIC[f"landmarks.{stage}"]}


def test_every_finding_is_about_a_known_mistake_with_landmarks():
    """The table above names no mistake that does not exist."""
    assert set(FINDINGS) <= {item.name for stage in STAGES for item in of_stage(f"landmarks.{stage}")}


def test_no_answer_about_landmarks_is_stored():
    """No angle is computed, no root taken and nothing solved in the checks."""
    for module in (public, landmark_update):
        source = Path(module.__file__).read_text(encoding="utf-8")
        for word in (
            "sqrt(",
            "solve(",
            "inv(",
            "arctan",
            "atan2",
            "hypot",
            "cos(",
            "sin(",
            "roboloc_reference",
        ):
            assert word not in source
