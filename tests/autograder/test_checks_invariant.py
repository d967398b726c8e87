"""The hidden checks of the right-invariant filter: what they catch, what they let pass, which forms are equal."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from matrix import hold_matrix

from autograder.check import Recorder, run_stage
from autograder.checks import STAGES
from autograder.grading import grade, grade_expression
from autograder.misconceptions import of_stage
from roboloc_reference.invariant import correct, predict

SECRETS = [f"course-{number}" for number in range(3)]
PREDICT, CORRECT = "invariant.predict", "invariant.correct"
F, H, B = (f"other_error.{name}" for name in ("F_left", "H_antenna", "B_left"))
POSE, NOISE, BOTH = ({1, 3}, 12), ({2, 3}, 11), ({2, 3, 4}, 8)
POSE_SEEN, COV_SEEN, ALL_SEEN = ({1, 3}, 11), ({2, 3}, 11), ({1, 2, 3, 5, 6}, 2)

# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    PREDICT: {
        "noise left in the robot's frame": NOISE,
        "noise turned and not shifted": NOISE,
        "pose in the place of its adjoint": NOISE,
        "adjoint transposed": NOISE,
        "adjoint of the pose after the step": NOISE,
        "last column of the adjoint with the other sign": NOISE,
        "adjoint with omega first": NOISE,
        "prediction of the left-invariant error": BOTH,
        "covariance carried as in the extended filter": BOTH,
        "motion on the left of the pose": POSE,
        "way along the first heading": POSE,
        "twist not multiplied by dt": POSE,
        "noise multiplied by dt": NOISE,
        "the caller's pose overwritten": ({5}, 18),
    },
    CORRECT: {
        "transpose of the pose in the innovation": POSE_SEEN,
        "transpose of the error in H": ALL_SEEN,
        "correction the wrong way": POSE_SEEN,
        "both signs of the turn alike": ALL_SEEN,
        "H of what is seen": ALL_SEEN,
        "turn about the robot in H": ALL_SEEN,
        "innovation in the robot's frame": POSE_SEEN,
        "noise not turned into the world": ALL_SEEN,
        "noise turned the other way": ALL_SEEN,
        "correction on the right of the pose": POSE_SEEN,
        "correction added to x, y and theta": POSE_SEEN,
        "noise left out of the covariance after": COV_SEEN,
        "covariance as before": COV_SEEN,
        "first landmark alone": ALL_SEEN,
        "the caller's covariance overwritten": ({5}, 18),
    },
    F: dict.fromkeys(
        (
            "left error taken for unchanged",
            "error carried forwards",
            "matrix of the way back in the place of its adjoint",
            "error turned and not shifted",
        ),
        ({1}, 0),
    ),
    H: dict.fromkeys(
        (
            "antenna with the sign of a landmark",
            "antenna turned about the robot",
            "antenna at the centre of the robot",
            "antenna ahead whichever way the robot faces",
            "antenna for the left error",
        ),
        ({1}, 0),
    ),
    B: dict.fromkeys(
        ("axes of the robot turned the other way", "left error taken for one of the numbers"), ({1}, 0)
    ),
}


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix(name):
    """Every wrong version fails just its checks and is named, every correct one passes, whatever the secret."""
    alternatives = {"invariant_complex", "invariant_expm"} if name in STAGES else set()
    hold_matrix(EXPECTED[name], alternatives, name, SECRETS)


def recorded(stage):
    """Return the arguments of the calls that the checks of a stage make."""
    recorder = Recorder(STAGES[stage].reference)
    run_stage(STAGES[stage], recorder, "s")
    return [call.args for call in recorder.calls]


def test_hidden_inputs_cover_what_the_notebook_promises():
    """Turns to both sides, none and nearly none, no noise at all; one, two, three landmarks and no landmark."""
    omegas = np.array([args[2][2] for args in recorded(PREDICT)])
    assert omegas.min() < -0.4
    assert omegas.max() > 0.4
    assert 0.0 in omegas
    assert ((omegas != 0) & (abs(omegas) < 1e-8)).any()
    assert any(not args[3].any() for args in recorded(PREDICT))
    assert {len(args[3]) for args in recorded(CORRECT)} == {0, 1, 2, 3}
    for X, *_ in recorded(PREDICT) + recorded(CORRECT):
        assert np.abs(X[:2]).min() > 0.2


def test_at_the_origin_nothing_shows():
    """Noise that is not carried at all is right for a robot at the origin that is not turned: no such input is used."""
    (uncarried,) = (item for item in of_stage(PREDICT) if item.name == "noise left in the robot's frame")
    args = np.eye(3), np.eye(3), np.array([1.0, 0.0, 0.5]), np.diag([0.1, 0.2, 0.3]), 1.0
    for one, other in zip(uncarried.function(*args), predict(*args), strict=True):
        assert np.allclose(one, other, atol=1e-12)


def test_what_is_handed_back_as_it_came_scores_next_to_nothing(published):
    """A prediction and a correction that do nothing get the points of arguments untouched and no landmark alone."""
    assert grade(PREDICT, lambda X, P, *_: (X, P), 20) <= 6
    assert grade(CORRECT, lambda X, P, *_: (X, P), 20) <= 5


def test_lists_are_results(published):
    """Lists are as good as arrays, and a list of two as good as a tuple."""
    for name, stage in ((PREDICT, predict), (CORRECT, correct)):
        assert grade(name, lambda *args, stage=stage: [part.tolist() for part in stage(*args)], 6) == 6


x, y, theta, p, q, phi = sp.symbols("x y theta p q phi", real=True)
a = sp.Symbol("a", positive=True)


def pose(east, north, angle):
    """Return the matrix of a pose."""
    c, s = sp.cos(angle), sp.sin(angle)
    return sp.Matrix([[c, -s, east], [s, c, north], [0, 0, 1]])


def answers():
    """Derive the answers by another route than the notebook: the generators, one by one, conjugated and applied."""
    generators = [sp.zeros(3) for _ in range(3)]
    generators[0][0, 2] = generators[1][1, 2] = generators[2][1, 0] = 1
    generators[2][0, 1] = -1

    def vee(M):
        return sp.Matrix([M[0, 2], M[1, 2], M[1, 0]])

    step, estimate = pose(p, q, phi), pose(x, y, theta)
    way_back = pose(-p * sp.cos(phi) - q * sp.sin(phi), p * sp.sin(phi) - q * sp.cos(phi), -phi)
    report = estimate * sp.Matrix([a, 0, 1])
    return {
        F: sp.Matrix.hstack(*(vee(way_back * G * step) for G in generators)),
        H: sp.Matrix.hstack(*((G * report)[:2, :] for G in generators)),
        B: sp.Matrix.hstack(*((estimate * G)[:, 2] + sp.Matrix([0, 0, G[1, 0]]) for G in generators)),
    }


def in_exponentials(entry):
    """Return an expression without a sine or cosine."""
    return entry.rewrite(sp.exp)


ANSWERS = answers()


@pytest.mark.parametrize("name", ANSWERS)
def test_every_way_of_writing_an_expression_is_accepted(name, published):
    """By conjugated generators, expanded or in exponentials: the points are the same."""
    for form in (ANSWERS[name], sp.expand(ANSWERS[name]), ANSWERS[name].applyfunc(in_exponentials)):
        assert grade_expression(name, form, 2) == 2
