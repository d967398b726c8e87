"""Wrong versions of SLAM with points, and the diagnosis that names them."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis import found, observed

from autograder.check import copied
from autograder.checks import STAGES
from autograder.misconceptions import landmark_correction, landmark_look, landmark_start, of_stage
from roboloc_reference import landmarks
from roboloc_reference.landmark_map import innovation

# The faults of the published answers that this notebook knows by name, and where they are made.
ERRATA = {
    "C1": {"heading grows by the way", "way added to the heading"},
    "C2": {"first error in the place of the third", "first error named in the place of the third"},
    "C3": {"noise of the look not turned into the world"},
    "C4": {"pose minus landmark", "robot seen from the landmark"},
    "C5": {"arctangent with x first", "arguments of the arctangent exchanged"},
    "C6": {"range that grows as one comes nearer", "root that falls as q grows"},
    "C7": {"common factor left before the heading", "turn divided by q with the rest"},
    "C8": {
        "landmark for the difference",
        "place of the landmark for the difference",
        "bearing over the range once",
    },
    "C10": {"blocks on the diagonal alone", "landmark independent of the robot that saw it"},
}
HERE = ["mast.pose_next", "mast.Sigma_next", "mast.cross", "mast.z_mast", "mast.Hp_mast", "mast.Hl_mast"]
HERE += [name for name in STAGES if name.startswith("landmarks.")]


def named(stage, title):
    """Return a wrong version by its name."""
    (item,) = (item for item in of_stage(stage) if item.name == title)
    return item.function


def scene():
    """Return a state with its covariance, and a look at both landmarks that is a little off."""
    rng = np.random.default_rng(4)
    A = rng.normal(size=(7, 7))
    x = np.array([1.0, 2.0, 0.4, 4.0, 6.0, -1.0, 1.0])
    z = np.concatenate([landmarks.measurement(x, j)[0] for j in (0, 1)]) + 0.05
    return x, 0.01 * A @ A.T, z, np.array([[0.01, 0.002], [0.002, 0.04]])


def test_all_that_the_errata_say_of_the_homework_is_known():
    """Each fault of the published answers has a wrong version."""
    known = {item.name for stage in HERE for item in of_stage(stage)}
    assert all(titles <= known for titles in ERRATA.values())


def test_the_right_parts_behind_the_wrong_versions_are_right():
    """What the wrong versions are made from is the reference, as long as nothing is spoilt."""
    x, Sigma, z, Q = scene()
    v, H = landmark_correction._stack(x, z)
    right_v, right_H = innovation(x, z)
    np.testing.assert_allclose(v, right_v, atol=1e-12)
    np.testing.assert_allclose(H, right_H, atol=1e-12)
    after = landmark_correction._condition(x, Sigma, v, H, landmark_correction._noises(Q, 2))
    for mine, theirs in zip(after, landmarks.update(x, Sigma, z, Q), strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-10)
    Hp, Hl = landmark_look._slopes(*landmark_look._delta(x, 1))
    np.testing.assert_allclose(Hp, landmarks.measurement(x, 1)[1], atol=1e-12)
    np.testing.assert_allclose(Hl, landmarks.measurement(x, 1)[2], atol=1e-12)
    started = landmark_start._made(z, Q, x[:3], Sigma[:3, :3], landmark_start._right)
    for mine, theirs in zip(started, landmarks.init_landmarks(z, Q, x[:3], Sigma[:3, :3]), strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-12)


@pytest.mark.parametrize(
    ("title", "bearing"),
    [("pose minus landmark", -2.514), ("arctangent with x first", 0.3435)],
)
def test_published_bearings_are_what_the_errata_say(title, bearing):
    """ERRATA C4, C5: from (1, 2, .3) the landmark (4, 6) is at .6273, and the wrong versions are off as published."""
    z, _, _ = named("landmarks.measurement", title)(np.array([1.0, 2.0, 0.3, 4.0, 6.0]), 0)
    assert z[0] == pytest.approx(bearing, abs=5e-4)


def test_a_mistake_in_mean_and_one_in_covariance_are_both_named():
    """A step with the turn forgotten in the way beside noise along the world's axes: each output has its own name."""

    def both(*args):
        after, _ = named("landmarks.predict", "landmarks driven along")(*copied(args))
        return after, named("landmarks.predict", "noise along the axes of the world")(*copied(args))[1]

    assert found("landmarks.predict", both) == [
        ("landmarks driven along", ("x",)),
        ("noise along the axes of the world", ("Sigma",)),
    ]


def test_right_stages_have_no_diagnosis():
    """Nothing is said about functions that pass."""
    for name in ("init_landmarks", "predict", "measurement", "update", "evaluate"):
        right = getattr(landmarks, name)
        assert (
            found(f"landmarks.{name}", lambda *args, right=right: [part.tolist() for part in right(*args)])
            == []
        )


def test_an_unknown_mistake_in_a_look_is_located():
    """A mistake that nobody knows is described by where it is: here the range is in centimetres."""

    def centimetres(x, j):
        z, Hp, Hl = landmarks.measurement(x, j)
        return z * [1, 100], Hp, Hl

    (sentence,) = observed("landmarks.measurement", centimetres)
    assert "range" in sentence
    assert "about 1e+02" in sentence
