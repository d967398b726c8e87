from types import SimpleNamespace

import numpy as np
import pytest
from oracles import read_only

from roboloc.filters import Ekf, MissingStageError


def drift(x, u, dt):
    """Move by the control in x and heading; not a robot, only something to tell arguments apart."""
    return x + dt * np.array([u[0], 0, u[1]]), 2 * np.eye(3), np.array([[1.0, 0], [0, 0], [0, 1]])


def spread(g, Gx, Gu, Sigma, R, dt):
    """Combine all arguments, so that a wrong one shows."""
    return g, Gx @ Sigma + dt * Gu @ R @ Gu.T


def halve(x, Sigma, z, Q, H):
    """Combine all arguments, so that a wrong one shows."""
    return x + H.T @ z, Sigma / 2 + H.T @ Q @ H


STAGES = {"compute_dynamics": drift, "transition_update": spread, "measurement_update": halve}
SUPPLIED = [STAGES, SimpleNamespace(**STAGES)]


@pytest.mark.parametrize("stages", SUPPLIED)
def test_the_shell_calls_the_stages_with_its_belief(stages):
    """From a mapping or an object, each stage gets the right arguments and its results become the belief."""
    ekf = Ekf([1, 2, 3], np.eye(3), np.diag([0.5, 0.25]), stages=stages)
    ekf.transition_update([2.0, 1.0], 0.5)
    np.testing.assert_allclose(ekf.x, [2, 2, 3.5])
    np.testing.assert_allclose(ekf.Sigma, np.diag([2.25, 2, 2.125]))
    ekf.measurement_update([0.5], [[4.0]], [[0.0, 1.0, 0.0]])
    np.testing.assert_allclose(ekf.x, [2, 2.5, 3.5])
    np.testing.assert_allclose(ekf.Sigma, np.diag([1.125, 5, 1.0625]))


def test_transition_model_changes_nothing():
    """The model is evaluated at the mean, and the belief stays."""
    ekf = Ekf([1, 2, 3], np.eye(3), np.eye(2), stages=STAGES)
    g, Gx, Gu = ekf.transition_model([2.0, 1.0], 0.5)
    np.testing.assert_allclose(g, [2, 2, 3.5])
    assert (Gx.shape, Gu.shape) == ((3, 3), (3, 2))
    np.testing.assert_array_equal(ekf.x, [1, 2, 3])


def unwritten(*arguments):
    """Stand for a cell that was released and never filled in."""
    raise NotImplementedError


def silent(*arguments):
    """Stand for a function without a return."""


@pytest.mark.parametrize(
    ("stage", "why"),
    [(None, "not supplied"), (unwritten, "not written yet"), (silent, "returns None")],
)
@pytest.mark.parametrize("name", list(STAGES))
def test_a_missing_stage_is_named_and_nothing_is_stored(name, stage, why):
    """A stage that is absent, unwritten or silent raises an error with its name; the belief is as before."""
    ekf = Ekf([1, 2, 3], np.eye(3), np.eye(2), stages={**STAGES, name: stage})
    calls = {"measurement_update": lambda: ekf.measurement_update([0.5], [[4.0]], [[0.0, 1.0, 0.0]])}
    call = calls.get(name, lambda: ekf.transition_update([2.0, 1.0], 0.5))
    with pytest.raises(MissingStageError, match=f"^stage {name}: {why}"):
        call()
    np.testing.assert_array_equal(ekf.x, [1, 2, 3])
    np.testing.assert_array_equal(ekf.Sigma, np.eye(3))


@pytest.mark.parametrize("stages", [None, {}, SimpleNamespace()])
def test_without_stages_nothing_works(stages):
    """No stage is ever replaced by one of ours."""
    ekf = Ekf([1, 2, 3], np.eye(3), np.eye(2), stages=stages)
    with pytest.raises(MissingStageError, match="compute_dynamics"):
        ekf.transition_model([0, 0], 0.1)
    with pytest.raises(MissingStageError, match="measurement_update"):
        ekf.measurement_update([0.5], [[4.0]], [[0.0, 1.0, 0.0]])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (7, "expected x, Sigma, got int"),
        ((1, 2, 3), "expected x, Sigma, got 3 values"),
        (([1, 2], np.eye(3)), r"x: expected shape \(3,\), got shape \(2,\)"),
        (([1, 2, np.nan], np.eye(3)), "x: expected finite numbers"),
        (([1, 2, 3], None), "Sigma: expected numbers"),
    ],
)
def test_an_unusable_result_names_the_stage(values, message):
    """A stage that returns something else than asked for is told so by name."""
    ekf = Ekf([1, 2, 3], np.eye(3), np.eye(2), stages={**STAGES, "transition_update": lambda *_: values})
    with pytest.raises(ValueError, match=f"^stage transition_update: {message}"):
        ekf.transition_update([0, 0], 0.1)


def test_an_error_inside_a_stage_passes_through():
    """The shell hides no error of a stage."""
    ekf = Ekf([1, 2, 3], np.eye(3), np.eye(2), stages={"compute_dynamics": lambda *_: 1 / 0})
    with pytest.raises(ZeroDivisionError):
        ekf.transition_model([0, 0], 0.1)


def test_a_stage_that_writes_to_its_arguments_cannot_change_the_belief():
    """Stages get copies, and what they keep of their results is not the belief."""
    kept = []

    def vandal(x, Sigma, z, Q, H):
        for argument in (x, Sigma, z, Q, H):
            argument[:] = 99.0
        kept.extend((np.zeros(3), np.eye(3)))
        return kept[0], kept[1]

    z, Q, H = read_only([0.5], [[4.0]], [[0.0, 1.0, 0.0]])
    ekf = Ekf([1, 2, 3], np.eye(3), np.eye(2), stages={"measurement_update": vandal})
    ekf.measurement_update(z, Q, H)
    kept[0][:] = kept[1][:] = 77.0
    np.testing.assert_array_equal(ekf.x, np.zeros(3))
    np.testing.assert_array_equal(ekf.Sigma, np.eye(3))


def test_the_start_is_copied():
    """The arrays that the caller gave stay the caller's."""
    x0, Sigma0 = np.zeros(3), np.eye(3)
    ekf = Ekf(x0, Sigma0, np.eye(2))
    x0[:], Sigma0[:] = 5, 5
    np.testing.assert_array_equal(ekf.x, np.zeros(3))
    np.testing.assert_array_equal(ekf.Sigma, np.eye(3))


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ((None, np.eye(3), np.eye(2)), "x0"),
        ((np.zeros(3), np.eye(2), np.eye(2)), "Sigma0"),
        ((np.zeros(3), -np.eye(3), np.eye(2)), "Sigma0"),
        ((np.zeros(3), np.eye(3), np.eye(3)), "R"),
        ((np.zeros(3), np.eye(3), [[1, 1], [0, 1]]), "R"),
    ],
)
def test_a_wrong_start_is_named(arguments, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        Ekf(*arguments)
