"""The hidden checks of the bouncing ball: what they catch, what they let pass, whom they name."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from matrix import hold_matrix

from autograder.check import Recorder, run_stage
from autograder.checks import STAGES
from autograder.checks.ball_on_a_slope import saltation
from autograder.grading import grade, grade_expression
from autograder.misconceptions import of_stage
from roboloc_reference.ballistic import motion, predict

SECRETS = [f"course-{number}" for number in range(5)]
PREDICT, CORRECT = "ballistic.predict", "ballistic.correct"

# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    PREDICT: {
        "Jacobian of the jump alone": ({4, 6, 7}, 13),
        "covariance of a ball that never lands": ({4, 6, 7}, 13),
        "delay without a change of velocity": ({4, 6, 7}, 13),
        "sign of the delay": ({4, 6, 7}, 13),
        "slowed down along the ground too": ({3, 4, 5, 6, 9}, 8),
        "flight through the ground": ({3, 4, 5, 6, 7, 8, 9}, 6),
        "impact at the end of the step": ({3, 4, 5, 6, 7, 8, 9}, 6),
        "first impact only": ({5, 6, 7}, 15),
        "restitution taken for a share of energy": ({3, 4, 5, 6, 8, 9}, 7),
        "nothing lost at an impact": ({3, 4, 5, 6, 8, 9}, 7),
        "mean multiplied by the Jacobian": ({1, 3, 5, 7, 9}, 11),
        "doubt about a ball at rest": ({8}, 19),
        "start below the ground": ({9}, 19),
        "Jacobian transposed": ({2, 4, 6, 7, 8}, 10),
        "old doubt not moved": ({2, 4, 6, 7, 8}, 10),
        "Q multiplied by dt": ({2, 4, 6, 7, 8}, 10),
        "the caller's covariance overwritten by the prediction": ({10}, 19),
    },
    CORRECT: {
        "position corrected and velocity not": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "camera believed outright": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "error of the camera left out": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "error of the camera in the place of S": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "each direction on its own": ({3, 4, 6, 7}, 9),
        "state in another order": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "expected minus seen": ({1, 3, 5}, 10),
        "expectation not subtracted": ({1, 3, 5}, 10),
        "height cut off at the ground": ({5}, 17),
        "covariance as before the picture": ({2, 4}, 13),
        "covariance larger after the picture": ({2, 4}, 13),
        "noise of the gain left out": ({2, 4}, 13),
        "the caller's mean overwritten by the correction": ({6}, 18),
    },
    "slope.t_hit": {
        "time to a level ground": ({1}, 0),
        "ground under the start": ({1}, 0),
        "all of gravity across the slope": ({1}, 0),
        "earlier root": ({1}, 0),
    },
    "slope.v_after": {
        "bounce of a level ground": ({1}, 0),
        "whole velocity reversed": ({1}, 0),
        "part across the slope only reduced": ({1}, 0),
        "slope to the other side": ({1}, 0),
    },
    "slope.Xi_slope": {
        "derivative of the jump on the slope": ({1}, 0),
        "saltation of a level ground": ({1}, 0),
        "all of gravity in the saltation": ({1}, 0),
    },
}
CORRECT_VERSIONS = {
    name: {"ball_closed_form", "ball_differences", "ball_events"} for name in (PREDICT, CORRECT)
}


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix_of_the_ball(name):
    """Every wrong version fails just its checks and is named, every correct one passes, with several secrets."""
    hold_matrix(EXPECTED[name], CORRECT_VERSIONS.get(name, set()), name, SECRETS)


def calls_of(name):
    """Return all calls that the checks of a stage make of the reference."""
    recorder = Recorder(STAGES[name].reference)
    run_stage(STAGES[name], recorder, "s")
    return recorder.calls


def test_an_impact_found_to_a_hundred_millionth_is_right(published):
    """An impact time that is off by 1e-9 s gets all points: the answer does not ask for the last digits."""

    def nearly(x, Sigma, dt, gravity, restitution, Q):
        after, Sigma = predict(x, Sigma, dt, gravity, restitution, Q)
        return after + 1e-9 * np.array([0, after[3], 0, -gravity]) * (after[1] > 0), Sigma

    assert grade(PREDICT, nearly, 10) == 10


def test_hidden_steps_are_what_the_notebook_promises():
    """No impact, one, several, a ball that loses nothing, one at rest, one below the ground; nothing at an impact."""
    impacts = set()
    for call in calls_of(PREDICT):
        x, _, dt, gravity, restitution, _ = call.args
        after = call.returned[0]
        if after[1] == 0 and after[3] == 0:
            impacts.add("rest")
            continue
        s = np.sqrt(x[3] ** 2 + 2 * gravity * max(x[1], 0.0))
        flights = (x[3] + s) / gravity + 2 * s / gravity * np.cumsum([0, *restitution ** np.arange(1, 9)])
        assert np.abs(flights - dt).min() > 0.02, "an impact at the end of the step"
        impacts.add(int((flights < dt).sum()))
        impacts |= {"elastic"} & ({"elastic"} if restitution == 1 else set())
        impacts |= {"below"} & ({"below"} if x[1] < 0 else set())
    assert impacts >= {0, 1, 2, 3, 4, 5, "rest", "elastic", "below"}


def test_gravity_and_restitution_change_from_call_to_call():
    """A function that uses its own gravity or restitution is right in hardly a call."""
    calls = calls_of(PREDICT)
    for i in (3, 4):
        assert len({call.args[i] for call in calls}) > 10


def test_every_entry_of_a_hidden_covariance_counts():
    """Covariances before and after are full, so that a missing correlation shows."""
    for call in calls_of(PREDICT)[:20]:
        assert np.abs(call.args[1]).min() > 1e-4
        assert np.abs(call.args[5]).min() > 1e-5


def test_some_corrected_balls_are_below_the_ground():
    """Where a check is about the ground, the right height is below it."""
    heights = [call.returned[0][1] for call in calls_of(CORRECT)]
    assert sum(height < -0.02 for height in heights) >= 4


def test_each_stage_of_the_ball_has_four_wrong_versions():
    """At least four misconceptions of each stage, and three wrong forms of each symbolic answer."""
    assert all(len(of_stage(name)) >= 4 for name in (PREDICT, CORRECT))
    assert all(len(of_stage(name)) >= 3 for name in EXPECTED if name.startswith("slope"))


px, py, vx, vy, alpha = sp.symbols("px py vx vy alpha", real=True)
g, e = sp.symbols("g e", positive=True)
STATE = sp.Matrix([px, py, vx, vy])


def on_a_slope():
    """Derive the three answers in axes along and across the slope, and turn them back."""
    turn = sp.Matrix([[sp.cos(alpha), sp.sin(alpha)], [-sp.sin(alpha), sp.cos(alpha)]])
    place, velocity = turn * sp.Matrix([px, py]), turn * sp.Matrix([vx, vy])
    pull = g * sp.cos(alpha)
    t_hit = velocity[1] / pull + sp.sqrt((velocity[1] / pull) ** 2 + 2 * place[1] / pull)
    v_after = turn.T * sp.Matrix([velocity[0], -e * velocity[1]])
    level = sp.diag(1, -e, 1, -e)
    level[3, 1] = -(1 + e) * pull / velocity[1]
    whole = sp.diag(turn, turn)
    return {"t_hit": t_hit, "v_after": v_after, "Xi_slope": whole.T * level * whole}


ANSWERS = on_a_slope()


@pytest.mark.parametrize("answer", ANSWERS)
def test_every_way_of_writing_an_answer_is_accepted(answer, published):
    """As derived by another route, expanded, and simplified: the values are the same."""
    right = ANSWERS[answer]
    forms = [right, right.expand(), sp.simplify(right)]
    for form in forms:
        assert grade_expression(f"slope.{answer}", form, 3) == 3


def test_the_hidden_saltation_of_a_level_ground_is_the_references():
    """With no slope the hidden matrix is the one between the flights of the reference's Jacobian."""
    x, dt = np.array([0.3, 2.0, 1.0, -1.0]), 0.9
    s = np.sqrt(x[3] ** 2 + 2 * 9.81 * x[1])
    first = (x[3] + s) / 9.81
    Xi = saltation({"alpha": 0.0, "g": 9.81, "e": 0.7, "vx": 1.0, "vy": -s})
    fly = [np.eye(4) + t * np.eye(4, k=2) for t in (first, dt - first)]
    np.testing.assert_allclose(fly[1] @ Xi @ fly[0], motion(x, dt, 9.81, 0.7)[1], atol=1e-12)
