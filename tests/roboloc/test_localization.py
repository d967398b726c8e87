from types import SimpleNamespace

import numpy as np
import pytest
from oracles import read_only

from roboloc.filters import EkfLocalization, MissingStageError


def predict(x, map_lines, tf):
    """Shift the map by all that was given, so that a wrong argument shows."""
    return map_lines + x[:2, None] + tf[:2, None], np.tile(x[2] * np.ones((2, 3)), (map_lines.shape[1], 1, 1))


def match(z_raw, Q_raw, hs, Hs, Sigma, g):
    """Give the first observation to the first line, its covariance made of all arguments."""
    return (z_raw - hs[:, :1]).T[:1], Q_raw[:1] + g * Sigma[:2, :2], Hs[:1]


def stack(v, Q, H):
    """Stack the one line that there is."""
    return v.ravel(), Q[0], H[0]


def update(x, Sigma, z, Q, H):
    """Combine all arguments, so that a wrong one shows."""
    return x + H.T @ z, Sigma + H.T @ Q @ H


STAGES = {
    "compute_predicted_measurements": predict,
    "compute_innovations": match,
    "measurement_model": stack,
    "measurement_update": update,
}
MAP, TF = np.array([[0.1, 0.2], [3.0, 4.0]]), np.array([0.01, 0.02, 0.03])
Z, Q = np.array([[0.5, 0.6, 0.7], [1.0, 2.0, 3.0]]), np.tile(0.1 * np.eye(2), (3, 1, 1))


def make(**changes):
    """Return a filter with the stages above, some replaced."""
    return EkfLocalization([1, 2, 3], np.eye(3), np.eye(2), MAP, TF, 2.0, stages={**STAGES, **changes})


@pytest.mark.parametrize("given", [list(Q), Q], ids=["list", "array"])
def test_the_shell_calls_the_stages_with_its_belief(given):
    """Each stage gets the right arguments, and the update's results become the belief."""
    ekf = make()
    hs, Hs = ekf.compute_predicted_measurements()
    np.testing.assert_array_equal(Hs, np.full((2, 2, 3), 3.0))
    np.testing.assert_allclose(hs, [[1.11, 1.21], [5.02, 6.02]])
    v, Qs, H = ekf.compute_innovations(Z, given)
    assert H.shape == (1, 2, 3)
    np.testing.assert_allclose(v, [[-0.61, -4.02]])
    np.testing.assert_allclose(Qs, [2.1 * np.eye(2)])
    z, Qz, Hz = ekf.measurement_model(Z, given)
    np.testing.assert_array_equal(z, v[0])
    np.testing.assert_array_equal(ekf.x, [1, 2, 3])
    ekf.measurement_update(Z, given)
    np.testing.assert_allclose(ekf.x, [1, 2, 3] + Hz.T @ z)
    np.testing.assert_allclose(ekf.Sigma, np.eye(3) + Hz.T @ Qz @ Hz)


def test_stages_may_come_from_an_object():
    """What works for a mapping works for a module or a namespace."""
    ekf = EkfLocalization([1, 2, 3], np.eye(3), np.eye(2), MAP, TF, 2.0, stages=SimpleNamespace(**STAGES))
    ekf.measurement_update(Z, Q)
    assert ekf.x[0] != 1


def unwritten(*arguments):
    """Stand for a cell that was released and never filled in."""
    raise NotImplementedError


@pytest.mark.parametrize(
    ("stage", "why"),
    [(None, "not supplied"), (unwritten, "not written yet"), (lambda *_: None, "returns None")],
)
@pytest.mark.parametrize("name", list(STAGES))
def test_a_missing_stage_is_named_and_nothing_is_stored(name, stage, why):
    """A stage that is absent, unwritten or silent raises an error with its name; the belief is as before."""
    ekf = make(**{name: stage})
    with pytest.raises(MissingStageError, match=f"^stage {name}: {why}"):
        ekf.measurement_update(Z, Q)
    np.testing.assert_array_equal(ekf.x, [1, 2, 3])
    np.testing.assert_array_equal(ekf.Sigma, np.eye(3))


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("compute_predicted_measurements", (MAP.T[:1], np.zeros((2, 2, 3))), r"hs: expected shape \(2, 2\)"),
        ("compute_predicted_measurements", (MAP, np.zeros((2, 3, 2))), r"Hs: expected shape \(2, 2, 3\)"),
        ("compute_innovations", ([1.0], Q, np.zeros((3, 2, 3))), r"v: expected shape \(K, 2\)"),
        ("compute_innovations", (Z.T, Q[:2], np.zeros((3, 2, 3))), r"Q: expected shape \(3, 2, 2\)"),
        ("compute_innovations", ([], [], np.zeros((1, 2, 3))), r"H: expected shape \(0, 2, 3\)"),
        ("measurement_model", (np.zeros(3), np.eye(2), np.zeros((2, 3))), r"z: expected shape \(2,\)"),
        ("measurement_update", (np.zeros(3), np.eye(2)), r"Sigma: expected shape \(3, 3\)"),
    ],
)
def test_an_unusable_result_names_the_stage(name, values, message):
    """A stage that returns something of another shape is told so by name."""
    with pytest.raises(ValueError, match=f"^stage {name}: {message}, got "):
        make(**{name: lambda *_: values}).measurement_update(Z, Q)


@pytest.mark.parametrize("nothing", [[], np.zeros((0, 2, 2))], ids=["list", "array"])
def test_a_scan_without_lines_goes_through_all_stages(nothing):
    """Stages see empty arrays of the right shape, and may return empty lists."""
    shapes = []

    def match_none(z_raw, Q_raw, hs, Hs, Sigma, g):
        shapes.append((z_raw.shape, Q_raw.shape))
        return [], [], []

    def stack_none(v, Q, H):
        shapes.append((v.shape, Q.shape, H.shape))
        return [], np.zeros((0, 0)), np.zeros((0, 3))

    ekf = make(compute_innovations=match_none, measurement_model=stack_none)
    ekf.measurement_update(np.zeros((2, 0)), nothing)
    assert shapes == [((2, 0), (0, 2, 2)), ((0, 2), (0, 2, 2), (0, 2, 3))]
    np.testing.assert_array_equal(ekf.x, [1, 2, 3])


def test_stages_that_write_to_their_arguments_change_nothing_else():
    """Every stage gets copies: of the belief, of the map and of the observation."""

    def vandal(stage):
        def spoil(*arguments):
            results = [np.array(a) for a in stage(*arguments)]
            for argument in arguments:
                if isinstance(argument, np.ndarray):
                    argument[:] = 99.0
            return results

        return spoil

    (z, q), honest = read_only(Z, Q), make()
    ekf = make(**{name: vandal(stage) for name, stage in STAGES.items()})
    for one in (ekf, honest):
        one.measurement_update(z, q)
        one.measurement_update(z, q)
    np.testing.assert_array_equal(ekf.x, honest.x)
    np.testing.assert_array_equal(ekf.Sigma, honest.Sigma)
    np.testing.assert_array_equal(ekf.map_lines, MAP)


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"x0": np.zeros(4)}, "x0"),
        ({"Sigma0": np.eye(2)}, "Sigma0"),
        ({"R": np.eye(3)}, "R"),
        ({"map_lines": MAP[:1]}, "map_lines"),
        ({"tf_base_to_camera": [0, 0]}, "tf_base_to_camera"),
        ({"g": -1}, "g"),
    ],
)
def test_a_wrong_start_is_named(changes, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    right = {"x0": np.zeros(3), "Sigma0": np.eye(3), "R": np.eye(2), "map_lines": MAP}
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        EkfLocalization(**{**right, "tf_base_to_camera": TF, "g": 3.0, **changes})


@pytest.mark.parametrize(
    ("z", "q", "name"), [(Z.T, Q, "z_raw"), (Z, Q[:2], "Q_raw"), (Z, [], "Q_raw"), (Z * np.nan, Q, "z_raw")]
)
def test_a_wrong_observation_is_named(z, q, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        make().measurement_update(z, q)
