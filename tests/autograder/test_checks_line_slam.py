"""The hidden checks of SLAM with lines: what they catch, what they let pass, and what a mistake elsewhere costs."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from matrix import hold_matrix

from autograder.check import Recorder, run_stage
from autograder.checks import STAGES
from autograder.grading import grade, grade_expression
from autograder.misconceptions.motion_model import euler_step
from roboloc_reference.slam import compute_predicted_measurements, transition_model

SECRETS = [f"course-{number}" for number in range(3)]
TRANSITION = "slam.transition_model"
PREDICTED = "slam.compute_predicted_measurements"

# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    TRANSITION: {
        "lines turned with the robot": ({1, 8, 9}, 15),
        "derivative of the lines 0": ({3, 8}, 15),
        "identity of the lines times dt": ({3, 8}, 15),
        "identity for the pose too": ({4, 7}, 17),
        "heading looked for at the end": ({3, 4, 7, 8}, 12),
        "lines turned by the control": ({5, 8}, 17),
        "pose taken from the end of the state": (set(range(1, 12)), 0),
        "lines wrapped": ({9}, 19),
        "the caller's state overwritten": ({10}, 19),
    },
    PREDICTED: {
        "map taken for certain": ({3, 5, 6, 7, 8}, 8),
        "distance taken not to follow alpha": ({3, 5, 6, 8}, 10),
        "sign of the derivative by alpha": ({3, 5, 6, 8}, 10),
        "lever of the robot's centre": ({5}, 18),
        "block of the line not normalised": ({6}, 18),
        "all blocks in one place": ({3, 4, 5, 6, 7}, 7),
        "numbers fixed, not lines": ({7, 8}, 17),
        "nothing fixed": ({7, 8}, 17),
        "last lines fixed": ({7}, 18),
        "fixed lines teach nothing": ({7, 8}, 17),
        "the caller's lines overwritten": ({9}, 19.5),
    },
    "foot_map.H_foot": {
        "derivative by alpha and r": ({1}, 0),
        "angle not divided by the distance": ({1}, 0),
        "robot taken to be at the origin": ({1}, 0),
    },
    "foot_map.N_foot": {
        "wall left behind": ({1}, 0),
        "foot shifted like a point": ({1}, 0),
        "turn about the robot": ({1}, 0),
    },
    "foot_map.Sigma_xy": {
        "information in the place of a covariance": ({1}, 0),
        "x and y taken to be independent": ({1}, 0),
        "rows inverted once": ({1}, 0),
    },
}
CORRECT = {name: {"slam_complex", "slam_loops", "slam_matrices"} for name in (TRANSITION, PREDICTED)}


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix(name):
    """Every wrong version fails just its checks and is named, every correct one passes, whatever the secret."""
    hold_matrix(EXPECTED[name], CORRECT.get(name, set()), name, SECRETS)


def recorded(stage):
    """Return the calls that the checks of a stage make."""
    recorder = Recorder(STAGES[stage].reference)
    run_stage(STAGES[stage], recorder, "s")
    return recorder.calls


def test_a_mistake_in_the_motion_costs_its_own_share(published):
    """Lines that are right beside a pose that drives straight keep two thirds of the points."""

    def straight(x, u, dt):
        g, Gx, Gu = transition_model(x, u, dt)
        for whole, part in zip((g, Gx, Gu), euler_step(x[:3], u, dt), strict=True):
            whole[tuple(map(slice, np.shape(part)))] = part
        return g, Gx, Gu

    assert grade(TRANSITION, straight, 20) == 13


def test_derivatives_by_the_pose_that_are_wrong_cost_their_own_share(published):
    """Blocks of the lines that are right keep their points beside columns of the pose that are wrong."""

    def no_lever(x, tf, fixed=2):
        hs, Hs = compute_predicted_measurements(x, tf, fixed)
        Hs[:, 1, :2] *= -1
        return hs, Hs

    assert grade(PREDICTED, no_lever, 20) == 13


def test_fixed_is_left_out_of_some_calls():
    """The default is called for, and every number of fixed lines from none to more than there are."""
    calls = recorded(PREDICTED)
    assert {len(call.args) for call in calls} == {2, 3}
    told = {(call.args[2], (call.args[0].size - 3) // 2) for call in calls if len(call.args) == 3}
    assert {fixed for fixed, _ in told} == {0, 1, 2, 3}
    assert any(fixed > J for fixed, J in told)


def test_hidden_inputs_cover_what_the_notebook_promises():
    """No line, one and many; straight, slow and fast; turned around; lines crossed, scanners everywhere."""
    motions, seen = recorded(TRANSITION), recorded(PREDICTED)
    assert {call.args[0].size for call in motions} >= {3, 5, 17}
    omegas = np.array([call.args[1][1] for call in motions])
    assert (omegas == 0).any()
    assert ((np.abs(omegas) < 1e-6) & (omegas != 0)).any()
    assert max(np.abs(call.args[0][3::2]).max(initial=0) for call in motions) > 20
    assert all(abs(call.args[2] - 1) > 0.3 for call in motions)
    assert {call.args[0].size for call in seen} >= {5, 9, 13}
    assert any(np.abs(call.args[1]).max() > 0 for call in seen)
    crossed = [call.returned[1][j, 1, 4 + 2 * j] for call in seen for j in range(call.returned[0].shape[1])]
    assert {-1.0, 1.0} <= set(crossed)


def test_both_ends_of_the_turn_are_right(published):
    """Angles in (-pi, pi] are accepted where rounding decides, and nowhere else is another turn."""

    def turned(x, tf, fixed=2):
        hs, Hs = compute_predicted_measurements(x, tf, fixed)
        return np.add(hs, [[2 * np.pi], [0]]), Hs

    assert grade(PREDICTED, turned, 20) < 15


x, y, theta, a, b, phi = sp.symbols("x y theta a b phi", real=True)
q = sp.Symbol("q", positive=True)


def answers():
    """Derive the answers by another route: a projection, finite motions of points, and a formula for an inverse."""
    foot, place = sp.Matrix([a, b]), sp.Matrix([x, y])
    n = foot / foot.norm()
    H = sp.Matrix([[-b, a]]) / foot.dot(foot)
    H = H.col_join((foot - place + n * n.dot(place)).T / foot.norm())
    dx, dy, turn = sp.symbols("dx dy turn", real=True)
    R = sp.Matrix([[sp.cos(turn), -sp.sin(turn)], [sp.sin(turn), sp.cos(turn)]])
    shift = sp.Matrix([dx, dy])
    new_foot = R * foot + (R * n) * (R * n).dot(shift)
    moved = (R * place + shift).col_join(sp.Matrix([theta + turn])).col_join(new_foot)
    N = moved.jacobian([dx, dy, turn]).subs({dx: 0, dy: 0, turn: 0})
    cot = 1 / sp.tan(phi)
    Sigma = q * sp.Matrix([[1, -cot], [-cot, 1 + 2 * cot**2]])
    return {"H_foot": H, "N_foot": N, "Sigma_xy": Sigma}


ANSWERS = answers()


@pytest.mark.parametrize("answer", ANSWERS)
def test_every_way_of_writing_an_expression_is_accepted(answer, published):
    """Derived by another route, mutable or not: the points are the same."""
    right = ANSWERS[answer]
    for form in (right, right.as_immutable()):
        assert grade_expression(f"foot_map.{answer}", form, 3) == 3
