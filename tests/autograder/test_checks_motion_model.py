"""The hidden checks of the motion model: what they catch, what they let pass, what they give away."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from matrix import hold_matrix

import kill_matrix
from autograder.check import Check, Recorder, run_stage
from autograder.checks import STAGES, motion_model
from autograder.compare import compare
from autograder.grading import grade_expression
from roboloc_reference.gaussian import transition_update
from roboloc_reference.motion import EPSILON_OMEGA, compute_dynamics

ROOT = Path(__file__).resolve().parents[2]
SECRETS = [f"course-{number}" for number in range(5)]
DYNAMICS, TRANSITION = STAGES["motion.compute_dynamics"], STAGES["gaussian.transition_update"]

# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    "motion.compute_dynamics": {
        "division by zero": ({2, 3, 6, 7, 9, 10}, 12),
        "limits at exactly zero only": ({3, 7, 10}, 15),
        "Euler step": ({1, 5, 8, 9, 10}, 9),
        "midpoint step": ({1, 5, 8}, 12),
        "Jacobians of the straight step": ({5, 8, 9, 10}, 12),
        "derivative by omega set to 0": ({9, 10}, 17),
        "heading frozen at small omega": ({3}, 18),
        "derivative of 1 / omega alone, without V": ({8}, 17),
        "half of the product rule": ({8}, 17),
        "headings taken for degrees": ({1, 2, 3, 5, 6, 7, 8, 9, 10, 11, 12}, 1),
        "Gx transposed": ({5, 6, 7}, 16),
        "derivative at the new heading": ({5}, 18),
        "columns of Gu exchanged": ({8, 9, 10}, 14),
        "sign of the cosine": ({1, 2, 3, 5, 6, 7, 8, 9, 10, 11, 12}, 1),
        "heading wrapped": ({4}, 19),
        "duration ignored": ({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, 0),
        "the caller's pose overwritten": ({11}, 18),
    },
    "gaussian.transition_update": {
        "dt missing": ({3, 4, 5, 6, 7}, 8),
        "dt squared": ({3, 4, 5, 6, 7}, 8),
        "divided by dt": ({3, 4, 5, 6, 7}, 8),
        "R squared": ({3, 4, 5, 6, 7}, 8),
        "transpose on the wrong side": ({2, 4, 5, 6, 7}, 8),
        "old uncertainty not moved": ({2, 4, 5, 6, 7}, 8),
        "old uncertainty forgotten": ({2, 4, 5, 6, 7}, 8),
        "elementwise product": ({2, 4, 5, 6, 7}, 8),
        "correlation of the control dropped": ({3, 4, 5, 6, 7}, 8),
        "mean moved twice": ({1, 5}, 16),
        "the caller's covariance overwritten": ({6}, 19),
    },
    **{
        f"differential_drive.{answer}": {
            "wheels exchanged": ({1}, 0),
            "distance to the middle taken for the track width": ({1}, 0),
            "half the track width": ({1}, 0),
            "speeds added": ({1}, 0),
        }
        for answer in ("g", "G_x", "G_u", "G_u0")
    },
}
EXPECTED["differential_drive.G_u0"]["limit before derivative"] = ({1}, 0)
CORRECT = {
    "motion.compute_dynamics": {"complex_numbers", "handout_switch", "matrix_exponential", "series"},
    "gaussian.transition_update": {"einstein_sum", "one_matrix", "square_root"},
}


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix(name):
    """Every wrong version fails just its checks and is named, every correct one passes, with several secrets."""
    hold_matrix(EXPECTED[name], CORRECT.get(name, set()), name, SECRETS)


def test_kill_matrix_notices_a_blunt_check():
    """With a tolerance of a tenth of the scale, wrong versions pass, and the matrix says so."""
    blunt = [
        case._replace(tolerance=tuple(np.full(np.shape(t), 10.0) for t in case.tolerance))
        for case in motion_model.slow(np.random.default_rng(1))
    ]
    check = Check("blunt", 1, lambda function, _rng: compare(function, blunt))
    stage = dataclasses.replace(DYNAMICS, checks=(check,))
    row = next(row for row in kill_matrix.rows(stage, ["s"]) if row.name == "derivative by omega set to 0")
    assert not row.holds


def test_truncation_bounds_are_bounds_and_not_generous():
    """The handout's limits stay below the bound everywhere and reach half of it just below the threshold."""
    alternative = kill_matrix.alternatives(DYNAMICS)["handout_switch"]
    rng = np.random.default_rng(5)
    worst = 0.0
    for _ in range(300):
        args = (
            rng.uniform(-3, 3, 3),
            np.array([rng.uniform(0.2, 2), 0.999 * EPSILON_OMEGA]),
            rng.uniform(0.1, 2),
        )
        pairs = zip(alternative(*args), compute_dynamics(*args), DYNAMICS.tolerance(*args), strict=True)
        ratios = [float((np.abs(got - right) / tolerance).max()) for got, right, tolerance in pairs]
        assert max(ratios) <= 1
        worst = max(worst, *ratios)
    assert worst > 0.5


def test_hidden_inputs_cover_what_the_notebook_promises():
    """Both signs of omega and V, omega zero and tiny, dt short and long and never 1, headings beyond a turn."""
    recorder = Recorder(compute_dynamics)
    run_stage(DYNAMICS, recorder, "s")
    theta, V, omega, dt = np.array([[c.args[0][2], *c.args[1], c.args[2]] for c in recorder.calls]).T
    kinds = (omega > 0.1, omega < -0.1, omega == 0, (np.abs(omega) < 1e-11) & (omega != 0), V < 0, V > 0)
    assert all(kind.any() for kind in (*kinds, dt < 0.1, dt > 1.5))
    assert not (np.abs(dt - 1) < 1e-6).any()
    assert (V != 0).all()
    assert np.abs(theta).max() > 6
    recorder = Recorder(transition_update)
    run_stage(TRANSITION, recorder, "s")
    assert {len(call.args[0]) for call in recorder.calls} >= {3, 9}
    for g, Gx, _, Sigma, R, _ in (call.args for call in recorder.calls):
        assert np.array_equal(Sigma, Sigma.T)
        assert np.array_equal(R, R.T)
        assert not np.allclose(Gx, Gx.T)
        assert len(g) == len(Sigma)


x, y, theta, v_left, v_right = sp.symbols("x y theta v_left v_right", real=True)
b, dt = sp.symbols("b dt", positive=True)


def wheel_answers():
    """Derive the four answers by another route than the notebook: integrate the rates in wheel speeds."""
    tau, difference = sp.symbols("tau difference", positive=True)
    rate = difference / b
    speed = v_left + difference / 2
    rates = sp.Matrix([speed * sp.cos(theta + rate * tau), speed * sp.sin(theta + rate * tau), rate])
    unequal = (sp.Matrix([x, y, theta]) + rates.integrate((tau, 0, dt))).subs(difference, v_right - v_left)
    by_wheels = unequal.jacobian([v_left, v_right])
    limit = by_wheels.subs(v_right, v_left + difference).applyfunc(
        lambda entry: sp.limit(entry, difference, 0)
    )
    return {"g": unequal, "G_x": unequal.jacobian([x, y, theta]), "G_u": by_wheels, "G_u0": limit}


ANSWERS = wheel_answers()


@pytest.mark.parametrize("answer", ANSWERS)
def test_every_way_of_writing_an_expression_is_accepted(answer, published):
    """Expanded, in exponentials, as an immutable matrix or with numbers as floats: the points are the same."""
    right = ANSWERS[answer]
    exponentials = right.applyfunc(lambda entry: entry.rewrite(sp.exp))
    for form in (right, right.expand(trig=True), exponentials, right.as_immutable(), right.evalf(20)):
        assert grade_expression(f"differential_drive.{answer}", form, 3) == 3


@pytest.mark.parametrize(
    "wrong",
    [
        ANSWERS["g"][0],
        ANSWERS["g"].subs(theta, sp.Symbol("phi")),
        ANSWERS["g"] + sp.Matrix([0, 0, sp.Rational(1, 10**6)]),
        ANSWERS["g"] * (1 + sp.I / 10**6),
        ANSWERS["g"] + sp.Matrix([0, 0, 1 / (b - b)]),
    ],
    ids=["one entry", "own symbol", "slightly off", "slightly complex", "infinite"],
)
def test_what_is_nearly_right_scores_nothing(wrong, published):
    """A part of the answer, another name, a small error: 0 points and a reason."""
    assert grade_expression("differential_drive.g", wrong, 3) == 0
    assert "failed" in published[0]["text/plain"]


def test_an_expression_that_cannot_be_evaluated_is_called_so(published):
    """An answer with a symbol of its own is not said to be a failed call."""
    assert grade_expression("differential_drive.g", ANSWERS["g"].subs(theta, sp.Symbol("phi")), 3) == 0
    assert "evaluating the answer raised" in published[0]["text/plain"]


def test_importing_the_package_needs_no_reference():
    """The worker in the sandbox imports autograder where there are neither checks nor reference."""
    code = "import autograder, sys; print([m for m in sys.modules if 'reference' in m or 'checks' in m])"
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert result.stdout.strip() == "[]"
