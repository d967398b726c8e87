"""The step that touches only what changes is the readable one, and faster for a reason that can be counted."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import read_only

from roboloc.angles import wrap
from roboloc_reference import slam
from roboloc_reference.association import measurement_model
from roboloc_reference.gaussian import measurement_update, transition_update
from roboloc_reference.slam_blocks import BlockEkfSlam

law = settings(deadline=None, derandomize=True, max_examples=60)
R, TF, DT = np.diag([0.01, 0.02]), np.array([0.12, -0.05, 0.2]), 0.1


def belief(rng, J, fixed=0):
    """Draw a state of J lines and a covariance with correlations everywhere, 0 for the first few lines."""
    map_lines = np.stack([rng.uniform(-np.pi, np.pi, J), rng.uniform(0, 10, J)], axis=1)
    x = np.concatenate([rng.uniform(-5, 5, 3), map_lines.ravel()])
    root = 0.1 * rng.normal(size=(x.size, x.size)) / np.sqrt(x.size)
    root[3 : 3 + 2 * fixed] = 0.0
    return x, root @ root.T + np.diag(0.001 * (root != 0).any(axis=1))


def scan(rng, x, lines):
    """Draw observations of some lines of a state and their covariances."""
    root = 0.02 * rng.normal(size=(len(lines), 2, 2))
    z_raw = slam.compute_predicted_measurements(x, TF, fixed=0)[0][:, lines]
    return z_raw + 0.02 * rng.normal(size=z_raw.shape), root @ root.swapaxes(1, 2) + 1e-4 * np.eye(2)


def readable(x, Sigma, u, lines, z_raw, Q_raw):
    """Make a step with the stages."""
    x, Sigma = transition_update(*slam.transition_model(x, u, DT), Sigma, R, DT)
    hs, Hs = slam.compute_predicted_measurements(x, TF, fixed=0)
    v = (z_raw - hs[:, lines]).T
    v[:, 0] = wrap(v[:, 0])
    return measurement_update(x, Sigma, *measurement_model(v, Q_raw, Hs[lines]))


@law
@given(st.integers(1, 12), st.integers(0, 5), st.integers(0, 3), st.integers(0, 999))
def test_the_fast_step_is_the_readable_one(J, K, fixed, seed):
    """Three steps in a row, with lines that are certain or seen twice or not at all, agree to 1e-12."""
    rng = np.random.default_rng(seed)
    x, Sigma = belief(rng, J, min(fixed, J))
    ekf = BlockEkfSlam(x, Sigma, R, TF)
    for _ in range(3):
        u, lines = rng.uniform(-1, 1, 2), rng.integers(0, J, K)
        z_raw, Q_raw = scan(rng, x, lines)
        x, Sigma = readable(x, Sigma, u, lines, z_raw, Q_raw)
        ekf.transition_update(u, DT)
        ekf.correct(lines, z_raw, Q_raw)
        np.testing.assert_allclose(ekf.x, x, rtol=0, atol=1e-12)
        np.testing.assert_allclose(ekf.Sigma, Sigma, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(ekf.Sigma, ekf.Sigma.T)


def test_a_long_run_on_a_large_map_stays_a_covariance():
    """After 200 steps on 100 lines, no eigenvalue is below the rounding, and the belief is still the readable one."""
    rng = np.random.default_rng(1)
    x, Sigma = belief(rng, 100)
    ekf = BlockEkfSlam(x, Sigma, R, TF)
    for _ in range(200):
        u, lines = rng.uniform(-1, 1, 2), rng.choice(100, 3, replace=False)
        z_raw, Q_raw = scan(rng, x, lines)
        x, Sigma = readable(x, Sigma, u, lines, z_raw, Q_raw)
        ekf.transition_update(u, DT)
        ekf.correct(lines, z_raw, Q_raw)
    eigenvalues = np.linalg.eigvalsh(ekf.Sigma)
    assert eigenvalues[0] >= -x.size * np.finfo(float).eps * eigenvalues[-1]
    np.testing.assert_allclose(ekf.x, x, rtol=0, atol=1e-9)
    np.testing.assert_allclose(ekf.Sigma, Sigma, rtol=0, atol=1e-11)


def test_the_covariance_is_corrected_in_place():
    """The one pass over the triangle writes where the covariance is: no second matrix of that size is made."""
    rng = np.random.default_rng(2)
    x, Sigma = belief(rng, 40)
    ekf = BlockEkfSlam(x, Sigma, R, TF)
    before = ekf._lower
    z_raw, Q_raw = scan(rng, x, [3, 7])
    ekf.transition_update([0.5, 0.1], DT)
    ekf.correct([3, 7], z_raw, Q_raw)
    assert np.shares_memory(before, ekf._lower)


def test_without_a_map_or_without_an_observation():
    """J = 0: the pose moves as by the stages; nothing observed changes nothing."""
    x, Sigma = belief(np.random.default_rng(3), 0)
    ekf = BlockEkfSlam(x, Sigma, R, TF)
    ekf.transition_update([0.5, 0.1], DT)
    moved = transition_update(*slam.transition_model(x, [0.5, 0.1], DT), Sigma, R, DT)
    for nothing in ([], np.zeros(0)):
        ekf.correct(nothing, np.zeros((2, 0)), [])
        np.testing.assert_allclose(ekf.x, moved[0], rtol=0, atol=1e-15)
        np.testing.assert_allclose(ekf.Sigma, moved[1], rtol=0, atol=1e-15)


def test_arguments_are_read_only_and_stay_the_callers():
    """Read-only arrays are accepted, and what the filter writes to is its own."""
    rng = np.random.default_rng(4)
    x, Sigma = belief(rng, 5)
    z_raw, Q_raw = scan(rng, x, [1, 4])
    x, Sigma, z_raw, Q_raw, R_, TF_, u, lines = read_only(x, Sigma, z_raw, Q_raw, R, TF, [0.5, 0.1], [1, 4])
    for given_Sigma in (Sigma, np.asfortranarray(Sigma)):
        ekf = BlockEkfSlam(x, given_Sigma, R_, TF_)
        ekf.transition_update(u, DT)
        ekf.correct(lines, z_raw, Q_raw)
        np.testing.assert_array_equal(given_Sigma, Sigma)
        ekf.Sigma[:] = 7.0
        assert ekf.Sigma.max() < 1.0


X, S = np.array([0.0, 0, 0, 0, 3]), np.eye(5)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ((X[:4], np.eye(4), R, TF), "x0"),
        ((X[:1], np.eye(1), R, TF), "x0"),
        ((X * np.nan, S, R, TF), "x0"),
        ((X, np.eye(4), R, TF), "Sigma0"),
        ((X, S, np.eye(3), TF), "R"),
        ((X, S, R, [0, 0]), "tf_base_to_camera"),
    ],
)
def test_a_wrong_start_is_named(arguments, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        BlockEkfSlam(*arguments)


@pytest.mark.parametrize(
    ("method", "arguments", "name"),
    [
        ("transition_update", ([1.0], DT), "u"),
        ("transition_update", ([1.0, 0.0], -DT), "dt"),
        ("correct", ([1], [[0.0], [3.0]], [np.eye(2)]), "lines"),
        ("correct", ([-1], [[0.0], [3.0]], [np.eye(2)]), "lines"),
        ("correct", ([0.5], [[0.0], [3.0]], [np.eye(2)]), "lines"),
        ("correct", ("a", [[0.0], [3.0]], [np.eye(2)]), "lines"),
        ("correct", ([0], [[0.0, 1.0], [3.0, 1.0]], [np.eye(2)]), "z_raw"),
        ("correct", ([0], [[0.0], [3.0]], []), "Q_raw"),
        ("correct", ([0], [[0.0], [3.0]], [-9.0 * np.eye(2)]), "Q_raw"),
    ],
)
def test_a_wrong_argument_is_named_and_the_belief_stays(method, arguments, name):
    """ValueError says which argument is wrong, what was expected and what came; nothing is stored."""
    ekf = BlockEkfSlam(X, S, R, TF)
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        getattr(ekf, method)(*arguments)
    np.testing.assert_array_equal(ekf.x, X)
    np.testing.assert_array_equal(ekf.Sigma, S)
