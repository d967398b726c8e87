"""The hidden checks of the velocity model and the unscented filter: what they catch, what they let pass."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from matrix import hold_matrix

from autograder.check import Recorder, run_stage
from autograder.checks import STAGES
from autograder.checks.velocity_model import aligned_bearing
from autograder.grading import grade, grade_expression
from roboloc_reference import velocity

SECRETS = [f"course-{number}" for number in range(3)]
MOTION, JACOBIANS, NOISE, SIGHTING = (
    f"velocity.{name}" for name in ("motion", "jacobians", "noise", "range_bearing")
)
POINTS, PREDICT, CORRECT = (f"ukf.{name}" for name in ("sigma_points", "predict", "correct"))
NAMES = (MOTION, JACOBIANS, NOISE, SIGHTING, POINTS, PREDICT, CORRECT)

# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    MOTION: {
        "gamma left out": ({1, 2, 3, 4, 5, 6}, 0),
        "turned before the arc": ({1, 2, 3, 5, 6}, 2),
        "turned on the arc": ({1, 2, 3, 5, 6}, 2),
        "along the first heading": ({1, 5, 6}, 8),
        "gamma taken for an angle": ({1, 2, 3, 4, 5, 6}, 0),
        "heading of the motion wrapped": ({4}, 18),
        "no drive straight ahead": ({2}, 16),
        "the caller's pose overwritten": ({5}, 18),
    },
    JACOBIANS: {
        "second column of W as it is printed": ({2, 4, 5}, 7),
        "end of the arc not differentiated": ({2, 4, 5}, 7),
        "omega set to 0 before the derivative": ({4, 5}, 13),
        "derivatives of a straight drive": ({1, 2, 4, 5, 6, 7}, 2),
        "F and W transposed": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "no column for gamma": ({2, 4, 5}, 7),
        "gamma moves the robot": ({2, 4, 5}, 7),
        "rates without dt": ({2, 4, 5}, 7),
        "F taken for the identity": ({1, 3, 5}, 12),
        "third column of F with the other sign": ({1, 3, 5}, 12),
    },
    NOISE: {
        "standard deviations in M": ({1, 2, 3, 4, 5}, 0),
        "speeds not squared": ({1, 2, 3, 4, 5}, 0),
        "alphas of v and omega exchanged": ({1, 2, 3, 4, 5}, 0),
        "alphas read in another order": ({1, 2, 3, 4, 5}, 0),
        "noise of gamma grows with gamma": ({3, 4, 5}, 12),
        "gamma without noise": ({1, 2, 3, 4, 5}, 0),
        "alphas squared": ({1, 2, 3, 4, 5}, 0),
    },
    SIGHTING: {
        "second row of H divided twice": ({2, 4}, 9),
        "first row of H divided once": ({2, 4}, 9),
        "bearing not wrapped": ({3, 4}, 14),
        "bearing from 0 to 2 pi": ({1, 3, 4}, 10),
        "direction in the world": ({1, 3, 4}, 10),
        "arguments of the arctangent exchanged": ({1, 3, 4}, 10),
        "robot seen from the landmark": ({1, 3, 4}, 10),
        "range before bearing": ({1, 2, 3, 4, 5, 6}, 0),
        "derivative by the landmark": ({2, 4}, 9),
        "bearing that does not follow the heading": ({2, 4}, 9),
    },
    POINTS: {
        "root not scaled by n + kappa": ({1, 3, 4}, 9),
        "root scaled by n + kappa itself": ({1, 3, 4}, 9),
        "rows of the root": ({1, 3, 4}, 9),
        "standard deviations alone": ({1, 3, 4}, 9),
        "symmetric root": ({1, 3, 4}, 9),
        "plus and minus in turns": ({1, 3, 4}, 9),
        "weights not halved": ({2, 3, 4}, 9),
        "equal weights": ({2, 3, 4}, 9),
        "negative weight cut off": ({4}, 17),
    },
    PREDICT: {
        "mean moved alone": ({1, 3, 5}, 11),
        "control without noise": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "noise of the control added to the pose": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "control left out of the points": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "noise multiplied by dt": ({1, 2, 3, 4, 5, 6, 7}, 0),
        "squares about the mean with a negative weight": ({4, 5}, 14),
        "squares about the centre with positive weights": ({2, 5}, 11),
        "headings averaged as wrapped numbers": ({5}, 17),
        "the caller's covariance overwritten": ({6}, 19),
    },
    CORRECT: {
        "innovation not wrapped": ({3, 4}, 13),
        "bearings averaged as numbers": ({3, 4}, 13),
        "residuals not wrapped": ({3, 4}, 13),
        "bearings averaged as vectors": ({1, 3, 4, 5}, 7),
        "expected from the centre alone": ({1, 3, 4, 5}, 7),
        "noise of the sensor left out of S": ({1, 2, 3, 4, 5, 7, 8}, 1),
        "innovation in the place of the noise": ({1, 2, 3, 4, 5, 7, 8}, 1),
        "standard deviations of the sensor": ({1, 2, 3, 4, 5, 7, 8}, 1),
        "squares of the views about their mean with a negative weight": ({4}, 17),
        "expected minus seen": ({1, 3, 4, 5}, 7),
        "covariance as before": ({2, 3, 4, 5}, 7),
        "covariance larger than before": ({2, 3, 4, 5}, 7),
        "first landmark alone": ({1, 2, 3, 4, 5, 7, 8}, 1),
        "the caller's mean overwritten": ({7}, 19),
    },
    "turn_first.W_first": {
        "turn at the end after all": ({1}, 0),
        "columns of v and omega from the old heading": ({1}, 0),
        "gamma changes the heading alone": ({1}, 0),
        "second column of W as with a fixed end": ({1}, 0),
    },
    "turn_first.W_straight": {
        "limit before the derivative": ({1}, 0),
        "limit of the robot that turns last": ({1}, 0),
        "limit without the way that turns with gamma": ({1}, 0),
    },
    "turn_first.H_ahead": {
        "sensor in the middle of the robot": ({1}, 0),
        "arm of the sensor left out of the derivative": ({1}, 0),
        "row of the range divided twice": ({1}, 0),
    },
}
CORRECT_VERSIONS = {
    **{name: {"velocity_complex", "velocity_matrices"} for name in (MOTION, JACOBIANS, NOISE, SIGHTING)},
    **{name: {"unscented_loops", "unscented_tensors"} for name in (POINTS, PREDICT, CORRECT)},
}


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix_of_ekf_and_ukf(name):
    """Every wrong version fails just its checks and is named, every correct one passes, with 3 secrets."""
    hold_matrix(EXPECTED[name], CORRECT_VERSIONS.get(name, set()), name, SECRETS)


def calls_of(name):
    """Return all calls that the checks of a stage make of the reference."""
    recorder = Recorder(STAGES[name].reference)
    run_stage(STAGES[name], recorder, "s")
    return recorder.calls


def test_a_stage_of_one_output_returns_it(published):
    """A pose or a covariance in a tuple of one is no answer, a list of numbers is."""
    assert grade(MOTION, lambda *args: (velocity.motion(*args),), 10) == 0
    assert grade(MOTION, lambda *args: velocity.motion(*args).tolist(), 10) == 10
    assert grade(NOISE, lambda *args: (velocity.noise(*args),), 10) == 0
    assert grade(NOISE, lambda *args: velocity.noise(*args).tolist(), 10) == 10


def test_limits_near_zero_are_accepted(published):
    """The limits below the handout's threshold, with the closed form above it, get all points."""

    def switched(stage):
        def function(x, u, dt):
            if abs(u[1]) < 1e-3:
                result = STAGES[stage].reference(x, [u[0], 0.0, u[2]], dt)
                if stage == MOTION:
                    result[2] += u[1] * dt
                return result
            return STAGES[stage].reference(x, u, dt)

        return function

    for stage in (MOTION, JACOBIANS):
        assert grade(stage, switched(stage), 20) == 20


def test_a_bearing_at_the_cut_may_be_on_either_side(published):
    """Half a turn to the left is half a turn to the right, but no bearing may be a whole turn off."""
    right, left = {"z": np.array([np.pi, 1.0])}, {"z": np.array([-np.pi, 1.0]), "H": None}
    assert aligned_bearing(right, left)["z"][0] == pytest.approx(np.pi)
    ahead = {"z": np.array([0.3, 1.0])}
    assert aligned_bearing(ahead, {"z": np.array([0.3 + 2 * np.pi, 1.0])})["z"][0] > 6
    assert aligned_bearing(ahead, {"z": None})["z"] is None


def test_hidden_inputs_cover_what_the_notebook_promises():
    """Both directions and no turn, kappas of all signs, landmarks behind, none to three of them."""
    omegas = np.array([call.args[1][1] for call in calls_of(MOTION)])
    assert (omegas > 0.1).any() and (omegas < -0.1).any() and (omegas == 0).any()  # noqa: PT018
    assert (np.abs(omegas[omegas != 0]) < 1e-8).any()
    assert {np.sign(call.args[2]) for call in calls_of(POINTS)} == {-1.0, 0.0, 1.0}
    assert {len(call.args[0]) for call in calls_of(POINTS)} == {2, 3, 4}
    for name, place in ((PREDICT, 5), (CORRECT, 5)):
        assert {np.sign(call.args[place]) for call in calls_of(name)} == {-1.0, 0.0, 1.0}
    assert {len(call.args[3]) for call in calls_of(CORRECT)} == {0, 1, 2, 3}
    assert any(np.abs(call.args[2][::2]).max(initial=0) > 2.9 for call in calls_of(CORRECT))
    assert any(call.args[2][1] == 0 for call in calls_of(PREDICT))
    west = [call for call in calls_of(CORRECT) if len(call.args[2])]
    west = [(call.args[3] - call.args[0][:2])[0] @ [1, 1j] for call in west]
    assert sum(abs(np.angle(-direction)) < 0.06 for direction in west) >= 3


def test_predictions_are_beyond_the_tangent():
    """Beliefs are so wide that a prediction by the tangent is no answer, and none by the points is."""
    for call in calls_of(PREDICT):
        mean, _, u, _, dt, _ = call.args
        off = np.abs(call.returned[0] - velocity.motion(mean, u, dt)).max()
        assert off > 1e-4


theta, v, omega, gamma, dt = sp.symbols("theta v omega gamma dt", real=True)
x, y, m_x, m_y, a = sp.symbols("x y m_x m_y a", real=True)


def answers():
    """Derive the answers by another route than the notebook: an integral over the step, and the chain rule."""
    tau, w = sp.symbols("tau w", real=True, nonzero=True)
    start = theta + gamma * dt
    way = [sp.integrate(v * fun(start + w * tau), (tau, 0, dt)) for fun in (sp.cos, sp.sin)]
    end = sp.Matrix([*way, start + w * dt])
    full = end.jacobian([v, w, gamma])
    straight = full.applyfunc(lambda entry: sp.limit(entry, w, 0))
    sensor = sp.Matrix([x + a * sp.cos(theta), y + a * sp.sin(theta), theta])
    s_x, s_y, s_t = sp.symbols("s_x s_y s_t", real=True)
    away = sp.Matrix([m_x - s_x, m_y - s_y])
    seen = sp.Matrix([sp.atan2(away[1], away[0]) - s_t, sp.sqrt(away.dot(away))])
    at = dict(zip((s_x, s_y, s_t), sensor, strict=True))
    H = seen.jacobian([s_x, s_y, s_t]).subs(at) * sensor.jacobian([x, y, theta])
    return {"W_first": full.subs(w, omega), "W_straight": straight, "H_ahead": H}


ANSWERS = answers()


@pytest.mark.parametrize("answer", ANSWERS)
def test_every_way_of_writing_an_expression_is_accepted(answer, published):
    """By an integral or the chain rule, mutable or not: the points are the same."""
    right = ANSWERS[answer]
    for form in (right, right.as_immutable()):
        assert grade_expression(f"turn_first.{answer}", form, 3) == 3
