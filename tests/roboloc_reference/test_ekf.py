import numpy as np
import pytest

from roboloc import filters
from roboloc.simulation import figure_eight, simulate_motion
from roboloc_reference.ekf import STAGES, Ekf


def test_without_noise_the_filter_drives_where_the_robot_drives():
    """Predictions alone follow a figure-eight exactly, and certainty stays certain."""
    us = figure_eight()
    xs = simulate_motion([1.0, 2.0, 0.3], us, 0.1)
    ekf = Ekf(xs[0], np.zeros((3, 3)), np.zeros((2, 2)))
    for u, x in zip(us, xs[1:], strict=True):
        ekf.transition_update(u, 0.1)
        np.testing.assert_allclose(ekf.x, x, atol=1e-12)
    np.testing.assert_array_equal(ekf.Sigma, np.zeros((3, 3)))


def test_prediction_spreads_as_the_simulation_does():
    """Over a short drive with small noise the covariance is that of 4000 robots, within 10 percent."""
    us, dt, R = np.tile([0.5, 0.3], (20, 1)), 0.1, np.diag([0.02, 0.02])
    ekf = Ekf(np.zeros(3), np.zeros((3, 3)), R)
    for u in us:
        ekf.transition_update(u, dt)
    rng = np.random.default_rng(11)
    ends = np.array([simulate_motion(np.zeros(3), us, dt, R, rng)[-1] for _ in range(4000)])
    scale = np.sqrt(np.outer(np.diag(ekf.Sigma), np.diag(ekf.Sigma)))
    assert np.abs((np.cov(ends.T) - ekf.Sigma) / scale).max() < 0.1


def test_correction_pulls_towards_the_observation():
    """Position fixes shrink the covariance and bring the mean to the truth."""
    ekf = Ekf([0.0, 0.0, 0.0], np.eye(3), np.eye(2))
    H, Q = np.eye(2, 3), 1e-4 * np.eye(2)
    for _ in range(3):
        ekf.measurement_update(np.array([0.5, -0.2]) - ekf.x[:2], Q, H)
    np.testing.assert_allclose(ekf.x[:2], [0.5, -0.2], atol=1e-4)
    assert np.all(np.diag(ekf.Sigma)[:2] < 1e-4)


def test_the_reference_filter_is_the_shell_with_the_reference_stages():
    """The same constructor and methods; a keyword still replaces what supplies the functions."""
    ekf, shell = (
        kind(np.zeros(3), np.eye(3), np.eye(2), **k)
        for kind, k in ((Ekf, {}), (filters.Ekf, {"stages": STAGES}))
    )
    for one in (ekf, shell):
        one.transition_update([0.5, 0.1], 0.2)
    np.testing.assert_array_equal(ekf.Sigma, shell.Sigma)
    empty = Ekf(np.zeros(3), np.eye(3), np.eye(2), stages={})
    with pytest.raises(filters.MissingStageError, match="compute_dynamics"):
        empty.transition_update([0, 0], 0.1)
