"""The hidden checks of a map that grows: what they catch, and what they let pass."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from matrix import hold_matrix

from autograder.check import Recorder, run_stage
from autograder.checks import STAGES
from autograder.grading import grade, grade_expression
from roboloc_reference.association import compute_innovations
from roboloc_reference.new_lines import line_in_world, recognize, squared_distances
from roboloc_reference.slam import augment

SECRETS = [f"course-{number}" for number in range(5)]
WORLD, AUGMENT, RECOGNIZE = "slam.line_in_world", "slam.augment", "slam.recognize"

# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    WORLD: {
        "heading left out": (set(range(1, 9)), 0),
        "mounting left out": ({4}, 16),
        "mounting added in the frame of the world": ({4}, 16),
        "new line with r below 0": ({5}, 17),
        "new line with the bare absolute value": ({5}, 17),
        "derivatives of the other name": ({5}, 17),
        "r taken not to follow the heading": ({2, 4, 5}, 9),
        "r taken not to follow the angle that is seen": ({3, 4, 5}, 10),
        "sign of the prediction": ({2, 4, 5}, 9),
        "new angle not wrapped": ({6}, 19),
        "the caller's observation overwritten": ({7}, 19.5),
    },
    AUGMENT: {
        "new line independent": ({3, 4, 6, 7}, 10),
        "new line taken for the place of the robot": ({3, 4, 6, 7}, 10),
        "covariance with the map left out": ({4, 6, 7}, 14),
        "covariance on one side": ({3, 4, 6, 7}, 10),
        "new line from a certain pose": ({5, 6, 7}, 14),
        "new line from an exact scan": ({5, 6, 7}, 14),
        "Q not carried into the world": ({5, 6, 7}, 14),
        "new line in front of the map": (set(range(1, 10)), 0),
        "line appended as it is seen": ({1, 6, 7}, 15),
        "the caller's Q overwritten": ({8}, 19.5),
    },
    RECOGNIZE: {
        "gates not squared": ({1, 3, 4, 5, 6, 7}, 6),
        "one gate for both": ({3}, 16),
        "never in doubt": ({3}, 16),
        "belief taken for certain": ({1, 3, 5, 6, 7}, 8),
        "scan taken for exact": ({1, 3, 4, 5, 6, 7}, 6),
        "difference of angles not wrapped": ({5, 7}, 17),
        "one name asked for": ({7}, 19),
        "first line inside the gate": ({6}, 19),
    },
    "newborn_walls.foot_new": {
        "foot in the frame of the robot": ({1}, 0),
        "point nearest to the robot": ({1}, 0),
        "heading of the robot forgotten": ({1}, 0),
    },
    "newborn_walls.Sigma_cross": {
        "derivative for a covariance": ({1}, 0),
        "turn of the heading without a lever": ({1}, 0),
    },
    "newborn_walls.Sigma_12": {
        "newborn walls independent": ({1}, 0),
        "two walls without levers": ({1}, 0),
        "covariance of the first wall": ({1}, 0),
    },
}
CORRECT = {name: {"grow_loops", "grow_matrices"} for name in (WORLD, AUGMENT)}
CORRECT[RECOGNIZE] = {"recognize_loops", "recognize_matrices"}


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix(name):
    """Every wrong version fails just its checks and is named, every correct one passes, whatever the secret."""
    hold_matrix(EXPECTED[name], CORRECT.get(name, set()), name, SECRETS)


def recorded(stage):
    """Return the calls that the checks of a stage make."""
    recorder = Recorder(STAGES[stage].reference)
    run_stage(STAGES[stage], recorder, "s")
    return recorder.calls


def test_a_line_in_the_world_is_that_of_the_reference():
    """Line and derivatives are those that the reference's augment uses, read off its covariances."""
    for call in recorded(WORLD):
        z, x, tf = call.args
        line, by_pose, by_z = call.returned
        state, Sigma = augment(x, np.eye(3), z, np.zeros((2, 2)), tf)
        np.testing.assert_allclose(state[3:], line, rtol=0, atol=1e-13)
        np.testing.assert_allclose(Sigma[3:, :3], by_pose, rtol=0, atol=1e-13)
        own = augment(x, np.zeros((3, 3)), z, np.eye(2), tf)[1][3:, 3:]
        np.testing.assert_allclose(own, by_z @ by_z.T, rtol=0, atol=1e-12)
        assert by_z[0].tolist() == [1.0, 0.0]


def test_recognition_is_that_of_the_reference():
    """The nearest line, and whether it is inside a gate, are those of the reference's association."""
    flip = np.diag([1.0, -1.0])
    for call in recorded(RECOGNIZE):
        z, Q, hs, Hs, Sigma, g, newness = call.args
        both = np.stack([z, flip @ z + [np.pi, 0.0]], axis=1), np.stack([Q, flip @ Q @ flip])
        inside = [len(compute_innovations(*both, hs, Hs, Sigma, gate)[0]) > 0 for gate in (g, newness)]
        j = call.returned
        assert inside == [j >= 0, j != -1]
        if j >= 0:
            assert len(compute_innovations(*both, hs[:, [j]], Hs[[j]], Sigma, g)[0]) > 0


def test_no_decision_hangs_by_rounding():
    """Squared distances are at least a tenth away from both gates, and from each other if they decide."""
    for call in recorded(RECOGNIZE):
        *given, g, newness = call.args
        d2 = np.sort(squared_distances(*given))
        if not d2.size:
            continue
        for gate in (g * g, newness * newness):
            assert abs(d2[0] / gate - 1) > 0.1
        if d2[0] < newness * newness:  # of a new line nobody asks which is the nearest
            assert d2[1] > 1.15 * d2[0]


def test_hidden_inputs_cover_what_the_notebook_promises():
    """Walls on both sides of the origin, mountings, wraps; maps of every size; all three answers; no line."""
    worlds, grown, asked = recorded(WORLD), recorded(AUGMENT), recorded(RECOGNIZE)
    assert {float(call.returned[2][1, 1]) for call in worlds} == {1.0, -1.0}
    assert any(np.abs(call.args[2]).max() > 0 for call in worlds)
    assert max(abs(call.args[0][0] + call.args[1][2]) for call in worlds) > np.pi
    assert {call.args[0].size for call in grown} >= {3, 5, 7, 15}
    assert {-1, -2, 0, 1, 2, 3} == {call.returned for call in asked}
    assert {call.args[2].shape[1] for call in asked} == {0, 4}


@pytest.mark.parametrize("answer", [-1, -2, 0])
def test_a_guess_earns_next_to_nothing(answer, published):
    """Whoever always gives the same answer gets the two checks that ask for the same again, and no other."""
    assert grade(RECOGNIZE, lambda *_: answer, 20) <= 1


x, y, theta, alpha_z, r_z, alpha, gamma = sp.symbols("x y theta alpha_z r_z alpha gamma", real=True)
p, s = sp.symbols("p s", positive=True)


def answers():
    """Derive the answers by another route: points of the wall, and errors written out as random numbers."""
    R = sp.Matrix([[sp.cos(theta), -sp.sin(theta)], [sp.sin(theta), sp.cos(theta)]])
    towards, across = (sp.Matrix([sp.cos(alpha_z + k), sp.sin(alpha_z + k)]) for k in (0, sp.pi / 2))
    point, way = R * r_z * towards + sp.Matrix([x, y]), R * across
    foot = point - way * way.dot(point)
    rows = [
        sp.Matrix([[0, 0, 1], [sp.cos(a), sp.sin(a), sp.im((x + sp.I * y) * sp.exp(-sp.I * a))]])
        for a in (alpha, gamma)
    ]
    ex, ey, et = errors = sp.symbols("ex ey et")
    first, second = (row * sp.Matrix(errors) for row in rows)

    def mean(e):
        return sum(e.expand().coeff(one, 2) * var for one, var in ((ex, p), (ey, p), (et, s)))

    cross = sp.Matrix(2, 3, lambda i, k: mean(first[i] * errors[k]))
    return {
        "foot_new": foot,
        "Sigma_cross": cross,
        "Sigma_12": sp.Matrix(2, 2, lambda i, k: mean(first[i] * second[k])),
    }


ANSWERS = answers()


@pytest.mark.parametrize("answer", ANSWERS)
def test_every_way_of_writing_an_expression_is_accepted(answer, published):
    """Derived by another route, mutable or not: the points are the same."""
    right = ANSWERS[answer]
    for form in (right, right.as_immutable()):
        assert grade_expression(f"newborn_walls.{answer}", form, 3) == 3


def test_a_number_may_be_of_any_kind(published):
    """An index as a NumPy integer or a float is the same index."""
    for kind in (int, float, np.int64, np.array):
        assert grade(RECOGNIZE, lambda *args, kind=kind: kind(recognize(*args)), 4) == 4


def test_a_line_may_be_a_list(published):
    """Lists in the place of arrays are right."""
    assert grade(WORLD, lambda *args: [part.tolist() for part in line_in_world(*args)], 6) == 6
