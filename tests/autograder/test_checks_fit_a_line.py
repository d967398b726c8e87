"""The hidden checks of the line fit: what they catch, what they let pass, which forms are equal."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from matrix import hold_matrix

from autograder.check import Recorder, run_stage
from autograder.checks import STAGES
from autograder.checks.fit_a_line import any_name, line_jacobians, line_parameters
from autograder.grading import grade, grade_expression
from roboloc_reference.extraction import fit_line

SECRETS = [f"course-{number}" for number in range(3)]
PARAMETERS = "extraction.line_parameters"
JACOBIANS = "extraction.line_jacobians"
FIT = "extraction.fit_line"
EVERY = set(range(1, 10))
EIGHT = set(range(1, 9))

# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    PARAMETERS: {
        "errors measured along y": (EVERY - {5, 7}, 2),
        "errors measured along x": (EVERY - {5, 7}, 2),
        "direction along the wall": (EVERY, 0),
        "sums about the scanner": (EVERY, 0),
        "angle not halved": (EVERY, 0),
        "arctangent of a quotient": ({3, 4, 5, 6, 7}, 10),
        "sign of the mixed sum": (EVERY - {5}, 1),
        "mean of the bearings": (EVERY, 0),
        "mean of the ranges": ({2, 4, 5, 6, 7}, 11),
        "shortest range": ({2, 4, 5, 6, 7}, 11),
        "ranges turned into x in place": ({8}, 18),
    },
    JACOBIANS: {
        "levers from the foot": (EIGHT, 0),
        "the foot does not move": (EIGHT, 0),
        "angle of incidence ignored": ({1, 3, 5, 6}, 10),
        "bearing errors across in full": ({2, 4, 5, 6}, 10),
        "distances from the line left out": ({3, 4, 5}, 14),
        "scatter along the line alone": ({3, 4, 5}, 14),
        "line turned to the other side": (EIGHT, 0),
        "sum in the place of a mean": (EIGHT, 0),
        "row of r first": (EIGHT, 0),
        "bearings turned in place": ({7}, 18),
    },
    FIT: {
        "fit with r below 0": ({3, 4, 5}, 11),
        "fit with the bare absolute value": ({3, 5}, 15),
        "covariance of the other name": ({4}, 16),
        "half a turn beyond the turn": ({5}, 18),
        "fit with angles from 0 to 2 pi": ({1, 5, 6}, 14),
        "variances exchanged": ({2, 4, 6}, 11),
        "variances squared": ({2, 4, 6}, 11),
        "bearings without error": ({2, 4, 6}, 11),
        "correlation dropped": ({2, 4, 6}, 11),
        "divided by N once more": ({2, 4, 6}, 11),
        "variance of r first": ({2, 4, 6}, 11),
        "the caller's bearings sorted": ({7}, 18),
    },
    "leaning_wall.line_e": {
        "double angle of the bent wall": ({1}, 0),
        "regression through the bent wall": ({1}, 0),
        "bent wall through its middle point": ({1}, 0),
        "one arctangent for the bent wall": ({1}, 0),
    },
    "leaning_wall.by_left": {
        "beam taken to meet the wall straight": ({1}, 0),
        "wall leans to the wrong side": ({1}, 0),
        "derivative by the bearing": ({1}, 0),
    },
    "leaning_wall.C_fan": {
        "standard deviations not squared": ({1}, 0),
        "fan with certain bearings": ({1}, 0),
        "middle beam left out": ({1}, 0),
    },
}
CORRECT = {
    name: {"fit_complex", "fit_differences", "fit_loops", "fit_matrices"}
    for name in (PARAMETERS, JACOBIANS, FIT)
}


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix(name):
    """Every wrong version fails just its checks and is named, every correct one passes, whatever the secret."""
    hold_matrix(EXPECTED[name], CORRECT.get(name, set()), name, SECRETS)


def recorded(stage):
    """Return the calls that the checks of a stage make."""
    recorder = Recorder(STAGES[stage].reference)
    run_stage(STAGES[stage], recorder, "s")
    return recorder.calls


def test_parts_are_parts_of_the_fit():
    """The line and the derivatives that the checks hold right make the line and the covariance of the reference."""
    for call in recorded(FIT):
        theta, rho, var_theta, var_rho = call.args
        alpha, r, C = call.returned
        np.testing.assert_allclose(line_parameters(theta, rho), (alpha, r), rtol=1e-12)
        J_theta, J_rho = line_jacobians(theta, rho, alpha, r)
        parts = var_theta * J_theta @ J_theta.T + var_rho * J_rho @ J_rho.T
        np.testing.assert_allclose(parts, C, rtol=1e-11)


def test_derivatives_are_those_of_the_reference():
    """Central differences of the reference's line agree with the derivatives, under both names of the line."""
    for call in recorded(JACOBIANS):
        theta, rho, alpha, r = call.args
        near, side = fit_line(theta, rho, 0, 0)[0], np.sign(r)
        for which, J in enumerate(call.returned):
            for i in range(theta.size):
                ends = []
                for step in (1e-6, -1e-6):
                    beams = [theta.copy(), rho.copy()]
                    beams[which][i] += step
                    line = fit_line(*beams, 0.0, 0.0)
                    ends.append([np.angle(np.exp(1j * (line[0] - near))), side * line[1]])
                np.testing.assert_allclose(
                    (np.array(ends[0]) - ends[1]) / 2e-6, J[:, i], rtol=1e-5, atol=1e-7
                )
        assert abs(np.exp(1j * (alpha - near)) - side) < 1e-12


@pytest.mark.parametrize("halves", [-3, -1, 1, 2, 5])
def test_a_line_may_have_any_name(halves, published):
    """The line under its other name, or some turns on, gets all points of the first stage."""

    def named(theta, rho):
        alpha, r = line_parameters(theta, rho)
        return [alpha + halves * np.pi, r * (-1) ** halves]

    assert grade(PARAMETERS, named, 6) == 6


def test_half_of_another_name_is_no_name():
    """The distance of the one name with the angle of the other is another line."""
    right = {"alpha": np.array(0.4), "r": np.array(2.0)}
    whole = any_name(right, {"alpha": np.array(0.4 - np.pi), "r": np.array(-2.0)})
    assert whole["alpha"] == pytest.approx(0.4)
    assert whole["r"] == 2.0
    assert any_name(right, {"alpha": np.array(0.4 - np.pi), "r": np.array(2.0)})["r"] == -2.0
    assert any_name(right, {"alpha": None, "r": np.array(2.0)})["r"] == 2.0
    assert any_name(right, {"alpha": np.array(0.4), "r": None})["r"] is None


def test_a_number_has_no_entries(published):
    """What is off in a single number is said without an index, in the check and in the diagnosis."""
    assert (
        grade(PARAMETERS, lambda *args: (line_parameters(*args)[0], 2 * line_parameters(*args)[1]), 20) < 20
    )
    text = published[0]["text/plain"]
    assert "r is off by about" in text
    assert "The value of r: off by the same factor everywhere, about 2" in text
    assert "[]" not in text


def test_the_fit_has_one_right_name(published):
    """The last stage refuses the other name of a line, though its covariance belongs to it."""

    def named(*args):
        alpha, r, C = fit_line(*args)
        return alpha - np.pi * np.sign(alpha), -r, C * [[1, -1], [-1, 1]]

    assert grade(FIT, named, 20) == 0


def test_a_line_without_covariance_earns_its_part(published):
    """A fit that returns None for C keeps the points of alpha and r."""
    assert grade(FIT, lambda *args: (*fit_line(*args)[:2], None), 20) == 11


def test_hidden_inputs_cover_what_the_notebook_promises():
    """Walls all around and along the axes, beams not in order, two and many, lines named with r < 0."""
    parameters, jacobians, fits = (recorded(stage) for stage in (PARAMETERS, JACOBIANS, FIT))
    alphas = np.array([call.returned[0] for call in parameters])
    # Which of pi and -pi a wall behind the robot has is up to the processor's last digit.
    assert {min(int(quarter), 1) for quarter in (alphas // (np.pi / 2))} == {-2, -1, 0, 1}
    assert min(call.returned[1] for call in parameters) < 0.1
    assert any(abs(np.cos(alpha)) < 1e-9 for alpha in alphas)
    assert {call.args[0].size for call in parameters} >= {2, 9}
    assert any((np.diff(call.args[0]) < 0).any() for call in parameters)
    assert {float(np.sign(call.args[3])) for call in jacobians} == {1.0, -1.0}
    assert {call.args[0].size for call in jacobians} >= {2}
    assert {call.args[0].size for call in fits} >= {2}
    for call in fits:
        alpha, r, _ = call.returned
        assert abs(alpha) < 2.9
        assert r > 0.3
        assert 0 < call.args[2] < call.args[3]


h, b, e, beta, sigma_rho, sigma_theta = sp.symbols("h b e beta sigma_rho sigma_theta", positive=True)


def answers():
    """Derive the answers by another route than the notebook: an eigenvector, and derivatives of twice the angle."""
    points = sp.Matrix([[h, -b], [h, 0], [h + e, b]])
    mean = sp.ones(1, 3) * points / 3
    centred = points - sp.ones(3, 1) * mean
    S = centred.T * centred
    gap, cross = S[1, 1] - S[0, 0], 2 * S[0, 1]
    normal = sp.Matrix([sp.sqrt(gap**2 + cross**2) + gap, -cross])
    alpha = sp.atan(normal[1] / normal[0])
    line = sp.Matrix([alpha, mean[0] * sp.cos(alpha) + mean[1] * sp.sin(alpha)])
    theta, rho = sp.symbols("theta1:4"), sp.symbols("rho1:4", positive=True)
    z = [p * sp.exp(sp.I * phi) for p, phi in zip(rho, theta, strict=True)]
    middle = sum(z) / 3
    sums = sum((point - middle) ** 2 for point in z)
    at = dict(zip((*theta, *rho), (-beta, 0, beta, h / sp.cos(beta), h, h / sp.cos(beta)), strict=True))
    columns = []
    for beam in (*theta, *rho):
        turn = sp.im((sp.diff(sums, beam) / sums).subs(at).rewrite(sp.cos)) / 2
        columns.append([turn, sp.re(sp.diff(middle, beam).subs(at).rewrite(sp.cos))])
    J = sp.Matrix(columns).T
    noise = sp.diag(*[sigma_theta**2] * 3, *[sigma_rho**2] * 3)
    return {"line_e": line, "by_left": J[:, 5], "C_fan": J * noise * J.T}


ANSWERS = answers()


@pytest.mark.parametrize("answer", ANSWERS)
def test_every_way_of_writing_an_expression_is_accepted(answer, published):
    """By an eigenvector or complex numbers, mutable or not: the points are the same."""
    right = ANSWERS[answer]
    for form in (right, right.as_immutable()):
        assert grade_expression(f"leaning_wall.{answer}", form, 3) == 3
