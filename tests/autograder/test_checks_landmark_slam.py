"""The hidden checks of SLAM with points: what they catch, what they let pass, which forms are equal."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from matrix import hold_matrix

from autograder.check import Recorder, run_stage
from autograder.checks import EXPRESSIONS, STAGES
from autograder.grading import grade, grade_expression
from autograder.secret import generator
from roboloc_reference import landmarks

SECRETS = [f"course-{number}" for number in range(3)]
NAMES = ("init_landmarks", "predict", "measurement", "update", "evaluate")
STAGES_HERE = [f"landmarks.{name}" for name in NAMES]

# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    "landmarks.init_landmarks": {
        "blocks on the diagonal alone": ({4, 5}, 12),
        "landmarks independent of each other": ({5}, 16),
        "landmarks of a robot without doubt": ({4, 5}, 12),
        "one triangle of the covariance": ({4, 5}, 12),
        "bearing from the world's x axis": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "range before bearing": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "noise of the look not turned into the world": ({3, 4, 5}, 8),
        "bearing noise without the range": ({3, 4, 5}, 8),
        "landmarks not turned with the robot": ({4, 5}, 12),
        "landmarks turned against the robot": ({4, 5}, 12),
        "the caller's bearings turned in place": ({6}, 18),
    },
    "landmarks.predict": {
        "heading grows by the way": ({1}, 16),
        "turn before the drive": ({1, 2, 3, 4, 5, 6}, 0),
        "landmarks driven along": ({1}, 16),
        "first error in the place of the third": ({3, 4}, 12),
        "noise along the axes of the world": ({3, 4}, 12),
        "noise turned the wrong way": ({3, 4}, 12),
        "covariance with the landmarks not carried": ({2, 4}, 11),
        "derivative of the step transposed": ({2, 4}, 11),
        "doubt before the step not carried": ({2, 4}, 11),
        "derivatives at the heading after the turn": ({2, 3, 4}, 7),
        "the caller's covariance overwritten": ({5}, 18),
    },
    "landmarks.measurement": {
        "pose minus landmark": ({1, 2, 3, 4, 5, 6, 7, 8}, 0),
        "arctangent with x first": ({1, 2, 6}, 12),
        "arctangent of a quotient": ({2, 6}, 15),
        "direction in the world": ({1, 2, 3, 5, 6}, 6),
        "bearing not wrapped": ({6}, 18),
        "range that grows as one comes nearer": ({3, 5}, 14),
        "common factor left before the heading": ({3, 5}, 14),
        "bearing over the range once": ({3, 4, 5}, 10),
        "landmark for the difference": ({4, 5}, 14),
        "signs of the pose in Hl": ({4, 5}, 14),
        "range in the first row": ({1, 2, 3, 4, 5, 6, 7, 8}, 0),
        "square of the range": ({1, 2, 3, 4, 5, 6, 7, 8}, 0),
        "landmarks counted by numbers": ({2, 5, 6}, 13),
        "the caller's landmarks moved to the robot": ({7}, 19),
    },
    "landmarks.update": {
        "innovation not wrapped": ({5}, 17),
        "expected minus observed": ({1, 3, 5}, 10),
        "noise of the range first": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "looks without noise": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "correlations dropped before the look": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "linearized anew for each landmark": ({3, 4, 5, 6, 7}, 6),
        "all landmarks in the columns of the first": ({3, 4, 5, 6, 7}, 6),
        "map taken for certain": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "pose corrected and map not": ({1, 3, 5}, 10),
        "covariance as before the look": ({2, 4}, 13),
        "noise of the looks left out of the covariance": ({2, 4}, 13),
        "the caller's state corrected in place": ({6}, 18),
    },
    "landmarks.evaluate": {
        "square of the Mahalanobis distance": ({2, 3}, 8),
        "square of the Euclidean distance": ({1}, 15),
        "sum of the two coordinates": ({1}, 15),
        "covariance not inverted": ({2, 3}, 8),
        "covariance of x and y of a landmark dropped": ({2, 3}, 8),
        "blocks counted from the pose": ({2, 3}, 8),
        "one spread for all directions": ({2, 3}, 8),
        "doubt about the robot added": ({2, 3}, 8),
        "the caller's truth overwritten": ({4}, 18),
    },
    "mast.pose_next": {
        "drive before the turn": ({1}, 0),
        "way added to the heading": ({1}, 0),
    },
    "mast.Sigma_next": {
        "errors along the heading before the turn": ({1}, 0),
        "errors along the axes of the world": ({1}, 0),
        "first error named in the place of the third": ({1}, 0),
        "doubt about the heading stays in the heading": ({1}, 0),
    },
    "mast.l_seen": {
        "bearing counted from the world's x axis": ({1}, 0),
        "landmark seen from the robot's own point": ({1}, 0),
    },
    "mast.cross": {
        "landmark independent of the robot that saw it": ({1}, 0),
        "landmark shifted with the robot and not turned": ({1}, 0),
        "mast left out of the turn": ({1}, 0),
    },
    "mast.z_mast": {
        "robot seen from the landmark": ({1}, 0),
        "arguments of the arctangent exchanged": ({1}, 0),
        "direction from a quotient": ({1}, 0),
        "look from the robot's own point": ({1}, 0),
    },
    "mast.Hp_mast": {
        "root that falls as q grows": ({1}, 0),
        "turn divided by q with the rest": ({1}, 0),
        "turn about the mast": ({1}, 0),
    },
    "mast.Hl_mast": {
        "place of the landmark for the difference": ({1}, 0),
        "derivative by the pose once more": ({1}, 0),
        "bearing over the range and not its square": ({1}, 0),
    },
}
CORRECT = {name: {"points_complex", "points_differences", "points_one_by_one"} for name in STAGES_HERE}


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix_of_landmark_slam(name):
    """Every wrong version fails just its checks and is named, every correct one passes, whatever the secret."""
    hold_matrix(EXPECTED[name], CORRECT.get(name, set()), name, SECRETS)


def recorded(stage):
    """Return the calls that the checks of a stage make."""
    recorder = Recorder(STAGES[stage].reference)
    run_stage(STAGES[stage], recorder, "s")
    return recorder.calls


@pytest.mark.parametrize("name", ["init_landmarks", "predict", "update"])
@pytest.mark.parametrize("laps", [-3, 1])
def test_a_heading_may_be_in_any_turn(name, laps, published):
    """A heading some turns on gets all points; one that is off by half a turn gets none of x."""
    right = getattr(landmarks, name)

    def turned(*args):
        x, Sigma = right(*args)
        x[2] += 2 * np.pi * laps
        return x, Sigma

    def half(*args):
        x, Sigma = right(*args)
        x[2] += np.pi
        return x, Sigma

    assert grade(f"landmarks.{name}", turned, 10) == 10
    assert grade(f"landmarks.{name}", half, 10) <= 8


def test_a_belief_without_covariance_earns_its_part(published):
    """Stages that return None for Sigma keep the points of x."""
    for name, points in (("init_landmarks", 5), ("predict", 4), ("update", 10)):
        right = getattr(landmarks, name)
        assert grade(f"landmarks.{name}", lambda *args, right=right: (right(*args)[0], None), 20) >= points


def test_hidden_states_are_what_the_notebook_promises():
    """None to three landmarks, headings beyond a turn, bearings in all quarters, and no ambiguous angle."""
    sizes = {name: {np.size(call.args[0]) for call in recorded(f"landmarks.{name}")} for name in NAMES}
    assert sizes["init_landmarks"] == {2, 4, 6}
    assert sizes["predict"] == {3, 5, 7, 9}
    assert sizes["update"] == sizes["evaluate"] == {5, 7, 9}
    looks = recorded("landmarks.measurement")
    assert {call.args[1] for call in looks} == {0, 1, 2}
    assert max(abs(call.args[0][2]) for call in looks) > 4 * np.pi - 3
    assert max(abs(call.returned[0][0]) for call in looks) < np.pi - 0.1
    directions = [
        np.arctan2(*(call.args[0][3 + 2 * call.args[1] :][:2] - call.args[0][:2])[::-1]) for call in looks
    ]
    assert {int(direction // (np.pi / 2)) for direction in directions} == {-2, -1, 0, 1}
    innovations = [
        landmarks.innovation(call.args[0], call.args[2])[0][::2] for call in recorded("landmarks.update")
    ]
    assert max(np.abs(v).max() for v in innovations) < 0.3


def test_every_entry_of_a_hidden_state_covariance_counts():
    """Covariances are full, so that a missing correlation shows."""
    for call in recorded("landmarks.update"):
        size = np.sqrt(np.diag(call.args[1]))
        assert np.abs(call.args[1] / np.outer(size, size)).min() > 0.02


x, y, theta, d, alpha, beta, l_x, l_y = sp.symbols("x y theta d alpha beta l_x l_y", real=True)
r, a = sp.symbols("r a", positive=True)
sigma = {name: sp.Symbol(f"sigma_{name}", positive=True) for name in ("x", "y", "theta", "1", "2", "3")}


def answers():
    """Derive the answers by another route than the notebook: homogeneous matrices, and the frame of the robot."""

    def frame(px, py, angle):
        c, s = sp.cos(angle), sp.sin(angle)
        return sp.Matrix([[c, -s, px], [s, c, py], [0, 0, 1]])

    e = sp.symbols("e_1:4")
    spun = frame(x, y, theta) * frame(0, 0, alpha)
    after = spun * sp.Matrix([d + e[0], e[1], 1])
    moved = sp.Matrix([after[0], after[1], theta + alpha + e[2]])
    J = moved.jacobian([theta, *e]).subs(dict.fromkeys(e, 0))
    Sigma = J * sp.diag(*[sigma[name] ** 2 for name in ("theta", "1", "2", "3")]) * J.T
    seen = (frame(x, y, theta) * sp.Matrix([a + r * sp.cos(beta), r * sp.sin(beta), 1]))[:2, :]
    pose = [x, y, theta]
    cross = seen.jacobian(pose) * sp.diag(*[sigma[name] ** 2 for name in ("x", "y", "theta")])
    c, s = sp.cos(theta), sp.sin(theta)
    local = sp.Matrix([[c, s], [-s, c]]) * sp.Matrix([l_x - x, l_y - y]) - sp.Matrix([a, 0])
    z = sp.Matrix([sp.atan2(local[1], local[0]), local.norm()])
    return {
        "pose_next": moved.subs(dict.fromkeys(e, 0)),
        "Sigma_next": Sigma,
        "l_seen": seen,
        "cross": cross,
        "z_mast": z,
        "Hp_mast": z.jacobian(pose),
        "Hl_mast": z.jacobian([l_x, l_y]),
    }


ANSWERS = answers()


@pytest.mark.parametrize("answer", ANSWERS)
def test_every_way_of_writing_an_answer_about_the_mast_is_accepted(answer, published):
    """In the frame of the robot or in the world, mutable or not: the points are the same."""
    for form in (ANSWERS[answer], ANSWERS[answer].as_immutable()):
        assert grade_expression(f"mast.{answer}", form, 2) == 2


def test_no_hidden_angle_of_the_mast_is_ambiguous():
    """An answer that subtracts the heading and one that turns the plane agree at every hidden point."""
    for number in range(200):
        values = EXPRESSIONS["mast.z_mast"].point(generator(f"secret {number}"))
        bearing = values["beta"]
        direction = bearing + values["theta"]
        assert abs(bearing) < 1.5
        assert abs(direction) < 2.8
