from types import SimpleNamespace

import numpy as np
import pytest
from oracles import read_only

from roboloc.filters import EkfSlam, MissingStageError


def drift(x, u, dt):
    """Move by the control in x and heading; not a robot, only something to tell arguments apart."""
    n = x.size
    return x + dt * np.eye(n)[0] * u[0], 2 * np.eye(n), u[1] * np.ones((n, 2))


def spread(g, Gx, Gu, Sigma, R, dt):
    """Combine all arguments, so that a wrong one shows."""
    return g, Gx @ Sigma + dt * Gu @ R @ Gu.T


def predict(x, tf, fixed):
    """Shift the lines of the state by all that was given, so that a wrong argument shows."""
    J = (x.size - 3) // 2
    return x[3:].reshape(J, 2).T + x[:2, None] + tf[:2, None], np.full((J, 2, x.size), float(fixed))


def match(z_raw, Q_raw, hs, Hs, Sigma, g):
    """Give the first observation to the first line, its covariance made of all arguments."""
    return (z_raw - hs[:, :1]).T[:1], Q_raw[:1] + g * Sigma[:2, :2], Hs[:1]


def stack(v, Q, H):
    """Stack the one line that there is."""
    return v.ravel(), Q[0], H[0]


def update(x, Sigma, z, Q, H):
    """Combine all arguments, so that a wrong one shows."""
    return x + H.T @ z, Sigma + H.T @ Q @ H


MOTION = {"transition_model": drift, "transition_update": spread}
SIGHT = {
    "compute_predicted_measurements": predict,
    "compute_innovations": match,
    "measurement_model": stack,
    "measurement_update": update,
}
STAGES = {**MOTION, **SIGHT}
X, TF = np.array([1.0, 2.0, 3.0, 0.1, 4.0, 0.2, 5.0]), np.array([0.01, 0.02, 0.03])
Z, Q = np.array([[0.5, 0.6, 0.7], [1.0, 2.0, 3.0]]), np.tile(0.1 * np.eye(2), (3, 1, 1))


def make(**changes):
    """Return a filter with the stages above, some replaced."""
    return EkfSlam(X, np.eye(7), np.eye(2), TF, 2.0, fixed=1, stages={**STAGES, **changes})


def test_the_shell_predicts_with_its_whole_belief():
    """The model of the motion is that of the whole state, called transition_model, and changes nothing by itself."""
    slam = make()
    g, Gx, Gu = slam.transition_model([2.0, 3.0], 0.5)
    np.testing.assert_array_equal(g, X + np.eye(7)[0])
    assert (Gx.shape, Gu.tolist()) == ((7, 7), np.full((7, 2), 3.0).tolist())
    np.testing.assert_array_equal(slam.x, X)
    slam.transition_update([2.0, 3.0], 0.5)
    np.testing.assert_array_equal(slam.x, g)
    np.testing.assert_allclose(slam.Sigma, 2 * np.eye(7) + 0.5 * 18 * np.ones((7, 7)))


@pytest.mark.parametrize("given", [list(Q), Q], ids=["list", "array"])
@pytest.mark.parametrize("supplied", [STAGES, SimpleNamespace(**STAGES)], ids=["mapping", "object"])
def test_the_shell_corrects_with_its_whole_belief(given, supplied):
    """Each stage gets the right arguments, and the update's results become the belief, of pose and map."""
    slam = EkfSlam(X, np.eye(7), np.eye(2), TF, 2.0, fixed=1, stages=supplied)
    hs, Hs = slam.compute_predicted_measurements()
    np.testing.assert_array_equal(Hs, np.ones((2, 2, 7)))
    np.testing.assert_allclose(hs, [[1.11, 1.21], [6.02, 7.02]])
    v, Qs, H = slam.compute_innovations(Z, given)
    assert H.shape == (1, 2, 7)
    np.testing.assert_allclose(v, [[-0.61, -5.02]])
    np.testing.assert_allclose(Qs, [2.1 * np.eye(2)])
    z, Qz, Hz = slam.measurement_model(Z, given)
    np.testing.assert_array_equal(z, v[0])
    np.testing.assert_array_equal(slam.x, X)
    slam.measurement_update(Z, given)
    np.testing.assert_allclose(slam.x, X + Hz.T @ z)
    np.testing.assert_allclose(slam.Sigma, np.eye(7) + Hz.T @ Qz @ Hz)
    np.testing.assert_array_equal(slam.map_lines, slam.x[3:].reshape(2, 2).T)


def test_two_lines_are_fixed_unless_told_otherwise():
    """The default is the handout's, and it reaches the stage."""
    slam = EkfSlam(X, np.eye(7), np.eye(2), TF, 2.0, stages=STAGES)
    assert slam.fixed == 2
    np.testing.assert_array_equal(slam.compute_predicted_measurements()[1], np.full((2, 2, 7), 2.0))


def test_what_is_given_and_what_is_returned_is_copied():
    """Neither the caller's arrays nor the map that it is handed are the belief."""
    x0, Sigma0, tf = X.copy(), np.eye(7), TF.copy()
    slam = EkfSlam(x0, Sigma0, np.eye(2), tf, 2.0, stages=STAGES)
    for array in (x0, Sigma0, tf, slam.map_lines):
        array[:] = 99.0
    np.testing.assert_array_equal(slam.x, X)
    np.testing.assert_array_equal(slam.Sigma, np.eye(7))
    np.testing.assert_array_equal(slam.tf_base_to_camera, TF)
    np.testing.assert_array_equal(slam.map_lines, X[3:].reshape(2, 2).T)


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
    slam = make(**{name: stage})
    method, arguments = (
        ("transition_update", ([2.0, 3.0], 0.5)) if name in MOTION else ("measurement_update", (Z, Q))
    )
    with pytest.raises(MissingStageError, match=f"^stage {name}: {why}"):
        getattr(slam, method)(*arguments)
    np.testing.assert_array_equal(slam.x, X)
    np.testing.assert_array_equal(slam.Sigma, np.eye(7))


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        (
            "compute_predicted_measurements",
            (X[None, 3:], np.zeros((2, 2, 7))),
            r"hs: expected shape \(2, 2\)",
        ),
        (
            "compute_predicted_measurements",
            (Z[:, :2], np.zeros((2, 2, 3))),
            r"Hs: expected shape \(2, 2, 7\)",
        ),
        ("compute_innovations", ([1.0], Q, np.zeros((3, 2, 7))), r"v: expected shape \(K, 2\)"),
        ("compute_innovations", (Z.T, Q, np.zeros((3, 2, 3))), r"H: expected shape \(3, 2, 7\)"),
        ("measurement_model", (np.zeros(2), np.eye(2), np.zeros((2, 3))), r"H: expected shape \(2, 7\)"),
        ("measurement_update", (np.zeros(3), np.eye(3)), r"x: expected shape \(7,\)"),
    ],
)
def test_an_unusable_result_names_the_stage(name, values, message):
    """A stage that returns something of another shape, such as that of localization, is told so by name."""
    with pytest.raises(ValueError, match=f"^stage {name}: {message}, got "):
        make(**{name: lambda *_: values}).measurement_update(Z, Q)


def test_a_motion_of_the_pose_alone_is_told_so():
    """A stage that forgets the lines of the state is named, with the shape that was expected."""
    slam = make(transition_model=lambda *_: (X[:3], np.eye(3), np.zeros((3, 2))))
    with pytest.raises(
        ValueError, match=r"^stage transition_model: g: expected shape \(7,\), got shape \(3,\)"
    ):
        slam.transition_update([0, 0], 1)


@pytest.mark.parametrize("nothing", [[], np.zeros((0, 2, 2))], ids=["list", "array"])
def test_a_scan_without_lines_goes_through_all_stages(nothing):
    """Stages see empty arrays of the right shape, and may return empty lists."""
    shapes = []

    def match_none(z_raw, Q_raw, hs, Hs, Sigma, g):
        shapes.append((z_raw.shape, Q_raw.shape))
        return [], [], []

    def stack_none(v, Q, H):
        shapes.append((v.shape, Q.shape, H.shape))
        return [], np.zeros((0, 0)), np.zeros((0, 7))

    slam = make(compute_innovations=match_none, measurement_model=stack_none)
    slam.measurement_update(np.zeros((2, 0)), nothing)
    assert shapes == [((2, 0), (0, 2, 2)), ((0, 2), (0, 2, 2), (0, 2, 7))]
    np.testing.assert_array_equal(slam.x, X)


def test_stages_that_write_to_their_arguments_change_nothing_else():
    """Every stage gets copies: of the belief, of the mounting and of the observation."""

    def vandal(stage):
        def spoil(*arguments):
            results = [np.array(a) for a in stage(*arguments)]
            for argument in arguments:
                if isinstance(argument, np.ndarray):
                    argument[:] = 99.0
            return results

        return spoil

    (u, z, q), honest = read_only([2.0, 3.0], Z, Q), make()
    slam = make(**{name: vandal(stage) for name, stage in STAGES.items()})
    for one in (slam, honest):
        for _ in range(2):
            one.transition_update(u, 0.5)
            one.measurement_update(z, q)
    np.testing.assert_array_equal(slam.x, honest.x)
    np.testing.assert_array_equal(slam.Sigma, honest.Sigma)
    np.testing.assert_array_equal(slam.tf_base_to_camera, TF)
    np.testing.assert_array_equal(slam.R, np.eye(2))


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"x0": np.zeros(4)}, "x0"),
        ({"x0": np.zeros(1)}, "x0"),
        ({"x0": np.zeros((3, 1))}, "x0"),
        ({"x0": [0, 0, 0, np.nan, 1]}, "x0"),
        ({"Sigma0": np.eye(3)}, "Sigma0"),
        ({"Sigma0": -np.eye(7)}, "Sigma0"),
        ({"R": np.eye(3)}, "R"),
        ({"tf_base_to_camera": [0, 0]}, "tf_base_to_camera"),
        ({"g": -1}, "g"),
        ({"fixed": -1}, "fixed"),
        ({"fixed": 1.5}, "fixed"),
        ({"fixed": "two"}, "fixed"),
    ],
)
def test_a_wrong_start_is_named(changes, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    right = {"x0": X, "Sigma0": np.eye(7), "R": np.eye(2), "tf_base_to_camera": TF, "g": 3.0}
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        EkfSlam(**{**right, **changes})


@pytest.mark.parametrize(
    ("z", "q", "name"), [(Z.T, Q, "z_raw"), (Z, Q[:2], "Q_raw"), (Z, [], "Q_raw"), (Z * np.nan, Q, "z_raw")]
)
def test_a_wrong_observation_is_named(z, q, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        make().measurement_update(z, q)
