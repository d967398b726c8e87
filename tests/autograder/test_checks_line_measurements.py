"""The hidden checks of line measurements: what they catch, what they let pass, which forms are equal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from matrix import hold_matrix

from autograder.check import Recorder, run_stage
from autograder.checks import STAGES
from autograder.checks.line_inputs import any_turn, one_turn
from autograder.grading import grade, grade_expression
from roboloc_reference.lines import (
    compute_predicted_measurements,
    transform_line_to_scanner_frame,
)

ROOT = Path(__file__).resolve().parents[2]
SECRETS = [f"course-{number}" for number in range(5)]
TRANSFORM = "lines.transform_line_to_scanner_frame"
NORMALIZE = "lines.normalize_line_parameters"
PREDICTED = "lines.compute_predicted_measurements"
EVERY = {1, 2, 3, 4, 5, 6, 7, 8, 9}

# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    TRANSFORM: {
        "scanner taken to be at the robot's centre": ({2, 6}, 14),
        "mounting not turned with the robot": ({2, 6}, 14),
        "x_cam in the row of y": ({2, 6}, 14),
        "mounting on the other side": ({2, 6}, 14),
        "heading of the mounting forgotten": ({3}, 18),
        "scanner turned the wrong way": ({3}, 18),
        "heading of the robot not taken off": (EVERY, 0),
        "heading added": (EVERY, 0),
        "derivative by the heading without the lever arm": ({6}, 17),
        "sign of the lever arm": ({6}, 17),
        "sign of the derivative of the distance": ({5, 6, 7}, 13),
        "sign of the distance": (EVERY, 0),
        "range before angle": (EVERY, 0),
        "angles taken for degrees": (EVERY, 0),
        "normalised too early": ({4, 7}, 18),
        "the caller's line overwritten": ({8}, 18),
    },
    NORMALIZE: {
        "bare absolute value": ({3, 4, 5}, 9),
        "angle not shifted": ({3, 5, 7}, 12),
        "derivative of r not flipped": ({4, 7}, 15),
        "whole derivative flipped": ({4, 7}, 15),
        "derivative of alpha flipped": ({4, 7}, 15),
        "angle not wrapped": ({5}, 17),
        "angle wrapped by one turn at most": ({5}, 17),
        "angle from 0 to 2 pi": ({1, 5, 7}, 14),
        "r left negative": ({3, 4, 5}, 9),
        "sign of 0": ({7}, 19),
        "the caller's derivative overwritten": ({8}, 18),
    },
    PREDICTED: {
        "one line for all": ({1, 2, 3, 4, 5, 6, 7, 9, 10}, 1),
        "one derivative for all lines": ({2, 4, 6}, 13),
        "lines sorted by distance": ({1, 2, 3, 4, 5, 6, 7, 9, 10}, 1),
        "predictions not normalised": ({5, 6}, 16),
        "bare absolute value of a crossed line": ({5, 6}, 16),
        "derivatives not normalised": ({6}, 18),
        "angles not wrapped": ({7}, 18),
        "mounting ignored": ({3, 4, 6}, 14),
        "pose and mounting exchanged": ({2, 3, 4, 6, 8}, 10),
        "the caller's map overwritten": ({9}, 18),
    },
    "upside_down.h": {
        "scanner taken for upright": ({1}, 0),
        "distance mirrored too": ({1}, 0),
        "front and back exchanged": ({1}, 0),
    },
    "upside_down.H_x": {"scanner taken for upright": ({1}, 0), "distance mirrored too": ({1}, 0)},
    "upside_down.H_mount": {
        "scanner taken for upright": ({1}, 0),
        "distance mirrored too": ({1}, 0),
        "mounting in the frame of the world": ({1}, 0),
        "derivative by the pose": ({1}, 0),
    },
}
CORRECT = {
    name: {"line_complex", "line_loops", "line_matrices"} for name in (TRANSFORM, NORMALIZE, PREDICTED)
}


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix(name):
    """Every wrong version fails just its checks and is named, every correct one passes, with several secrets."""
    hold_matrix(EXPECTED[name], CORRECT.get(name, set()), name, SECRETS)


@pytest.mark.parametrize("turns", [-3, -1, 1, 4])
def test_the_transform_may_use_any_turn(turns, published):
    """The transform's angle in another turn gets all points."""

    def turned(*args):
        h, Hx = transform_line_to_scanner_frame(*args)
        return [h[0] + 2 * np.pi * turns, h[1]], Hx

    assert grade(TRANSFORM, turned, 8) == 8


def test_wrapping_early_is_no_mistake(published):
    """A transform that wraps its angle gets all points."""

    def wrapped(*args):
        h, Hx = transform_line_to_scanner_frame(*args)
        return [np.angle(np.exp(1j * h[0])), h[1]], Hx

    assert grade(TRANSFORM, wrapped, 8) == 8


def test_both_ends_of_the_turn_are_right():
    """Where rounding decides between pi and -pi either is accepted, and an angle beyond a turn is not."""
    right = {"h": np.array([-np.pi, 1.0]), "Hx": np.ones((2, 3))}
    assert one_turn(right, {"h": np.array([np.pi, 1.0]), "Hx": None})["h"] == pytest.approx(right["h"])
    assert one_turn(right, {"h": np.array([3 * np.pi, 1.0]), "Hx": None})["h"][0] == 3 * np.pi


@pytest.mark.parametrize("n", [2, 3, 9])
def test_a_line_through_the_scanner_has_two_right_names(n):
    """At r = 0 the other name is accepted with its own derivative, and not with that of the first name."""
    rows = np.arange(1.0, 2 * n + 1).reshape(2, n)
    right = {"h": np.array([-1.0, 0.0]), "Hx": rows}
    other = {"h": np.array([np.pi - 1.0, -0.0]), "Hx": np.diag([1, -1]) @ rows}
    assert all(np.allclose(one_turn(right, other)[name], right[name], rtol=0, atol=1e-15) for name in right)
    mixed = {"h": other["h"], "Hx": rows}
    assert not np.allclose(one_turn(right, mixed)["Hx"], rows)


def test_away_from_zero_a_line_has_one_right_name():
    """The other name of a line that is 1 mm away is not accepted: r is negative there."""
    right = {"h": np.array([-1.0, 1e-3]), "Hx": np.ones((2, 3))}
    got = one_turn(right, {"h": np.array([np.pi - 1.0, -1e-3]), "Hx": np.ones((2, 3))})
    assert got["h"].tolist() == [np.pi - 1.0, -1e-3]


def test_one_line_of_a_map_may_have_its_other_name():
    """Of three lines the one through the scanner alone is rewritten, its layer with it."""
    lines = np.array([[0.1, 0.2, 0.3], [1.0, 0.0, 2.0]])
    layers = np.arange(18.0).reshape(3, 2, 3) + 1
    got, other = lines.copy(), layers.copy()
    got[0, 1] -= np.pi
    other[1, 1] *= -1
    result = one_turn({"hs": lines, "Hs": layers}, {"hs": got, "Hs": other})
    np.testing.assert_allclose(result["hs"], lines, atol=1e-15)
    np.testing.assert_array_equal(result["Hs"], layers)


def test_equal_forms_change_no_argument_and_need_no_partner():
    """What came back is not written to, and one output is looked at though the other is missing."""
    got = {"h": np.array([np.pi - 1.0, 0.0]), "Hx": np.ones((2, 3))}
    for rewrite in (any_turn, one_turn):
        rewrite({"h": np.array([-1.0, 0.0]), "Hx": np.ones((2, 3))}, got)
        assert got["h"].tolist() == [np.pi - 1.0, 0.0]
        assert (got["Hx"] == 1).all()
        empty = {"h": None, "Hx": got["Hx"]}
        assert rewrite({"h": np.zeros(2), "Hx": np.ones((2, 3))}, empty)["h"] is None


def test_lists_of_lists_and_of_arrays_are_arrays(published):
    """Predictions collected in lists, of numbers or of matrices, get all points."""

    def collected(*args):
        hs, Hs = compute_predicted_measurements(*args)
        return list(hs), list(Hs)

    assert grade(PREDICTED, collected, 5) == 5


def test_hidden_inputs_cover_what_the_notebook_promises():
    """Lines on both sides, a scanner at the centre, off it and turned, many turns, other sizes, one line and many."""
    calls = {}
    for stage in (TRANSFORM, NORMALIZE, PREDICTED):
        recorder = Recorder(STAGES[stage].reference)
        run_stage(STAGES[stage], recorder, "s")
        calls[stage] = recorder.calls
    r = np.array([call.returned[0][1] for call in calls[TRANSFORM]])
    assert (r > 0.2).any()
    assert (r < -0.2).any()
    assert not (np.abs(r) < 0.2).any()
    tf = np.array([call.args[2] for call in calls[TRANSFORM]])
    assert (tf == 0).all(axis=1).any()
    assert ((tf[:, :2] != 0).all(axis=1) & (tf[:, 2] != 0)).any()
    assert all(call.args[0][1] > 0 for call in calls[TRANSFORM])
    h = np.array([call.args[0] for call in calls[NORMALIZE]])
    assert np.abs(h[:, 0]).max() > 5 * np.pi
    assert (h[:, 1] == 0).any()
    assert (h[:, 1] < 0).any()
    assert {call.args[1].shape[1] for call in calls[NORMALIZE]} == {2, 3, 5, 9}
    assert {call.args[1].shape[1] for call in calls[PREDICTED]} == {1, 4, 5, 6}
    for call in calls[PREDICTED]:
        assert (call.args[1][1] > 0.2).all()
        assert (np.abs(call.args[1][0]) < np.pi).all()


def test_no_entry_of_a_hidden_line_is_nearly_zero():
    """A sine or cosine near 0 would hide a wrong sign: no entry that the inputs decide is nearly 0."""
    for secret in SECRETS[:5]:
        recorder = Recorder(transform_line_to_scanner_frame)
        run_stage(STAGES[TRANSFORM], recorder, secret)
        for call in recorder.calls:
            h, Hx = call.returned
            assert np.abs(h).min() > 0.01
            assert np.abs(Hx[1, :2]).min() > 0.2


SYMBOLS = alpha, r, x, y, theta, x_cam, y_cam, theta_cam = sp.symbols(
    "alpha r x y theta x_cam y_cam theta_cam", real=True
)


def upside_down():
    """Derive the three answers by another route than the notebook: mirror the frame, and read the line off points."""
    c, s = sp.cos(theta), sp.sin(theta)
    ahead, left = sp.symbols("ahead left")
    turn = sp.Matrix([[sp.cos(theta_cam), -sp.sin(theta_cam)], [sp.sin(theta_cam), sp.cos(theta_cam)]])
    seen = sp.Matrix([x_cam, y_cam]) + turn * sp.Matrix([ahead, -left])
    point = sp.Matrix([x, y]) + sp.Matrix([[c, -s], [s, c]]) * seen
    equation = sp.expand(point[0] * sp.cos(alpha) + point[1] * sp.sin(alpha))
    distance = r - equation.subs({ahead: 0, left: 0})
    angle = sp.atan2(equation.coeff(left), equation.coeff(ahead))
    h = sp.Matrix([angle, distance])
    return {
        "h": h,
        "H_x": h.jacobian([x, y, theta]),
        "H_mount": h.jacobian([x_cam, y_cam, theta_cam]),
    }


ANSWERS = upside_down()


@pytest.mark.parametrize("answer", ANSWERS)
def test_every_way_of_writing_an_expression_is_accepted(answer, published):
    """By an arctangent, immutable, or simplified: the points are the same."""
    right = ANSWERS[answer]
    for form in (right, right.as_immutable(), right.applyfunc(sp.simplify)):
        assert grade_expression(f"upside_down.{answer}", form, 3) == 3
