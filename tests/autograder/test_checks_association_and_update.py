"""The hidden checks of association and update: what they catch, what they let pass, whom they name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matrix import hold_matrix

from autograder.check import Recorder, run_stage
from autograder.checks import EXPRESSIONS, STAGES
from autograder.checks.association_inputs import distances
from autograder.checks.correction import ill_conditioned, short_form
from autograder.diagnose import diagnose
from autograder.misconceptions import of_stage
from roboloc_reference.association import compute_innovations, measurement_model
from roboloc_reference.gaussian import measurement_update

ROOT = Path(__file__).resolve().parents[2]
SECRETS = [f"course-{number}" for number in range(5)]
INNOVATIONS = STAGES["association.compute_innovations"]
STACK = STAGES["association.measurement_model"]
UPDATE = STAGES["gaussian.measurement_update"]

# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    "association.compute_innovations": {
        "squared distance in a gate of g": ({4}, 17),
        "no gate": ({4, 8}, 16),
        "noise of the observation left out": ({4, 5}, 14),
        "doubt about the pose left out": ({4, 5}, 14),
        "innovation not wrapped": ({6}, 18),
        "angles wrapped to [0, 2 pi)": ({1, 2, 3, 4, 5, 6, 7, 9, 10, 11}, 1),
        "expected minus observed": ({1, 4, 5, 6, 7, 9}, 6),
        "nearest in plain distance": ({5}, 17),
        "S not inverted": ({4, 5, 8}, 13),
        "first wall inside the gate": ({5}, 17),
        "each wall only once": ({7}, 18),
        "derivative of the wall looked at last": ({3, 5, 7, 9}, 12),
        "least distance not reset": ({1, 2, 3, 5, 6, 7, 9, 10, 11}, 4),
        "S returned for Q": ({2, 4, 5, 7, 9}, 9),
        "lines in the order of the map": ({1, 2, 3, 4, 5, 6, 7, 9, 10, 11}, 1),
        "covariances not gated": ({4}, 17),
        "the caller's observations overwritten": ({10}, 19.5),
    },
    "association.measurement_model": {
        "all angles first": ({1, 6}, 15),
        "correlations of a line dropped": ({2, 4, 6}, 12),
        "every block from the last line": ({2, 6}, 14),
        "lines vary together": ({2, 6}, 14),
        "inverse covariances": ({2, 4, 6}, 12),
        "rows of H sorted by kind": ({3, 6}, 15),
        "numbers of H reshaped out of order": ({3, 4, 6}, 13),
        "block diagonal of nothing": ({5}, 17),
        "the caller's innovations overwritten": ({7}, 18.5),
    },
    "gaussian.measurement_update": {
        "a variance can become negative": ({6}, 18),
        "noise of the observation left out of S": ({1, 2, 3, 4, 7, 8}, 3),
        "Q inverted in the place of S": ({1, 2, 3, 4, 6, 7, 8}, 1),
        "S inverted entry by entry": ({2, 3, 4, 6}, 6),
        "mean moved the wrong way": ({1, 2, 4}, 11),
        "expectation subtracted twice": ({1, 2, 4}, 11),
        "mean not corrected": ({1, 2, 4}, 11),
        "covariance not corrected": ({1, 3, 4, 6}, 9),
        "covariance grows": ({1, 3, 4, 6}, 9),
        "Q in the place of S in the covariance": ({1, 3, 4, 6}, 9),
        "half of Joseph's form": ({1, 3, 4}, 11),
        "K H Sigma kept, not taken away": ({1, 3, 4, 5, 6}, 8),
        "the caller's mean overwritten": ({7}, 18.5),
    },
    "single_wall.K": {
        "gain away from the wall": ({1}, 0),
        "noise of the observation left out of the gain": ({1}, 0),
        "weights exchanged": ({1}, 0),
    },
    "single_wall.Sigma": {
        "position known along the wall too": ({1}, 0),
        "noise of the observation left out of the covariance": ({1}, 0),
        "variance grows across the wall": ({1}, 0),
    },
    "single_wall.share": {
        "share of two numbers": ({1}, 0),
        "one side of the gate": ({1}, 0),
        "square compared with g": ({1}, 0),
    },
}
CORRECT = {
    "association.compute_innovations": {"association_loops", "association_whitened"},
    "association.measurement_model": {"association_loops", "association_whitened"},
    "gaussian.measurement_update": {"update_information", "update_joseph", "update_square_root"},
}


def calls_of(stage):
    """Return the arguments of all calls that the checks of a stage make."""
    recorder = Recorder(stage.reference)
    run_stage(stage, recorder, "s")
    return [call.args for call in recorder.calls]


def titles(stage, function, secret=SECRETS[0]):
    """Return the names that a function's mistakes are given."""
    return [item.title for item in diagnose(run_stage(stage, function, secret), of_stage(stage.name))]


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix_of_association_and_update(name):
    """Every wrong version fails just its checks and is named, every correct one passes, with several secrets."""
    hold_matrix(EXPECTED[name], CORRECT.get(name, set()), name, SECRETS)


def test_each_stage_has_four_wrong_and_two_right_versions():
    """At least four misconceptions and two alternatives of each stage, two wrong forms of each symbolic answer."""
    assert all(len(of_stage(name)) >= 4 for name in CORRECT)
    assert all(len(CORRECT[name]) >= 2 for name in CORRECT)
    assert all(len(of_stage(name)) >= 2 for name in EXPRESSIONS if name.startswith("single_wall"))


def test_an_association_that_keeps_nothing_earns_only_what_keeps_nothing():
    """Empty arrays of the right width pass the check for them and no other."""

    def keeps_nothing(_z_raw, _Q_raw, _hs, Hs, _Sigma, _g):
        return np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros((0, 2, Hs.shape[2]))

    outcome = run_stage(INNOVATIONS, keeps_nothing, "s")
    assert [result.check.name for result in outcome.results if result.passed] == ["nothing to keep"]


def test_the_hidden_scenes_hold_their_traps():
    """Gates above and below 1, walls across the cut, shared walls, no line at all, states of four sizes."""
    scenes = calls_of(INNOVATIONS)
    gates = [args[5] for args in scenes]
    assert min(gates) < 1
    assert max(gates) > 2.5
    assert {len(args[4]) for args in scenes} >= {2, 3, 5, 9}
    assert any(args[0].shape[1] == 0 for args in scenes)
    nearest = [distances(*args[:5])["right"].argmin(axis=1) for args in scenes]
    assert any(len(set(j.tolist())) < len(j) for j in nearest)
    turns = [
        np.abs(args[0][0] - args[2][0, j]).max(initial=0) for args, j in zip(scenes, nearest, strict=True)
    ]
    assert max(turns) > 5.5
    for z_raw, Q_raw, hs, _, Sigma, _ in scenes:
        assert np.array_equal(Sigma, Sigma.T)
        assert np.array_equal(Q_raw, Q_raw.swapaxes(1, 2))
        assert (np.abs(np.append(z_raw[0], hs[0])) <= np.pi).all()


def test_choices_do_not_hang_on_rounding():
    """Scenes moved by 1e-9 lead to the same choices, so another order of the products cannot."""
    rng = np.random.default_rng(3)
    for *parts, g in calls_of(INNOVATIONS):
        moved = [part + 1e-9 * rng.uniform(-1, 1, part.shape) for part in parts]
        v, _, H = compute_innovations(*parts, g)
        v_moved, _, H_moved = compute_innovations(*moved, g)
        np.testing.assert_allclose(v, v_moved, atol=1e-8)
        np.testing.assert_allclose(H, H_moved, atol=1e-8)


def textbook(x, Sigma, z, Q, H):
    """Multiply Sigma by I - K H, the other short form."""
    K = Sigma @ H.T @ np.linalg.inv(H @ Sigma @ H.T + Q)
    return x + K @ z, (np.eye(len(x)) - K @ H) @ Sigma


def symmetrized(*args):
    """Symmetrize a short form, which makes no negative variance positive."""
    x, Sigma = short_form(*args)
    return x, (Sigma + Sigma.T) / 2


@pytest.mark.parametrize("form", [textbook, symmetrized])
def test_audit_h8_every_short_form_is_told_why(form):
    """ERRATA H8: the short forms earn all points but those of the check for it, and are told why."""
    for secret in SECRETS:
        outcome = run_stage(UPDATE, form, secret)
        assert [result.check.name for result in outcome.failed] == ["a covariance stays one"]
        assert titles(UPDATE, form, secret) == ["a variance can become negative"]


def test_ordinary_updates_are_ordinary():
    """Only the sharp updates are ill-conditioned, and in these the innovation is 0."""
    sharp = [args for args in calls_of(UPDATE) if ill_conditioned(args)]
    assert len(sharp) == 12
    assert not any(args[2].any() for args in sharp)
    assert all((np.abs(args[2]) > 0.2).all() for args in calls_of(UPDATE) if not ill_conditioned(args))


def test_two_mistakes_in_two_outputs_are_both_told():
    """S in the place of Q beside the derivative of the last wall gives both names."""

    def both(*args):
        v, Q, H = compute_innovations(*args)
        return v, H @ args[4] @ H.swapaxes(1, 2) + Q, np.repeat(args[3][-1:], len(H), axis=0)

    assert titles(INNOVATIONS, both) == ["S returned for Q", "derivative of the wall looked at last"]


def test_an_unknown_mistake_in_stacks_of_all_sizes_is_described():
    """A factor on an output that comes in several shapes is seen; shapes that are off are left to the checks."""
    assert titles(STACK, lambda *a: (2 * measurement_model(*a)[0], *measurement_model(*a)[1:])) == [
        "What can be seen"
    ]
    assert titles(STACK, lambda *a: (measurement_model(*a)[0][:-1], *measurement_model(*a)[1:])) == []


def test_a_lopsided_update_is_no_covariance():
    """A covariance that is not symmetric is told to be none."""

    def lopsided(*args):
        x, Sigma = measurement_update(*args)
        return x, Sigma + np.triu(Sigma, 1)

    outcome = run_stage(UPDATE, lopsided, "s")
    (found,) = diagnose(outcome, of_stage(UPDATE.name))
    assert found.explanation == "Sigma is not symmetric, and a covariance is."


def test_a_mistake_that_shows_only_without_a_line_is_left_to_its_check():
    """Empty lists, which have no width, fail the check for nothing to keep; there is nothing else to say."""

    def lists(*args):
        return tuple(part if len(part) else np.array([]) for part in compute_innovations(*args))

    outcome = run_stage(INNOVATIONS, lists, "s")
    assert [result.check.name for result in outcome.failed] == ["nothing to keep"]
    assert titles(INNOVATIONS, lists) == []
