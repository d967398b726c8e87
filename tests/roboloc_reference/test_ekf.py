import numpy as np
import pytest

from roboloc import filters
from roboloc.simulation import figure_eight, simulate_motion
from roboloc.worlds import maze
from roboloc_reference.ekf import STAGES, Ekf, EkfLocalization
from roboloc_reference.lines import compute_predicted_measurements


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


TF, MAP = np.array([0.1, 0.02, 0.05]), maze().map_lines


def test_without_noise_and_error_localization_changes_nothing():
    """Lines observed exactly as predicted leave the mean where it is and shrink the covariance."""
    x0 = np.array([-6.0, -4.0, 0.4])
    ekf = EkfLocalization(x0, 1e-4 * np.eye(3), np.eye(2), MAP, TF, 3.0)
    hs, _ = compute_predicted_measurements(x0, MAP, TF)
    ekf.measurement_update(hs[:, :4], [1e-4 * np.eye(2)] * 4)
    np.testing.assert_allclose(ekf.x, x0, atol=1e-12)
    assert np.all(np.linalg.eigvalsh(ekf.Sigma) < 1e-4)


def test_localization_finds_the_true_pose():
    """From a pose 5 cm and 1 degree off, exact lines in all directions bring the filter to the truth."""
    truth = np.array([1.0, 2.5, -2.0])
    ekf = EkfLocalization(truth + np.array([0.05, -0.04, 0.017]), 1e-2 * np.eye(3), np.eye(2), MAP, TF, 3.0)
    hs, _ = compute_predicted_measurements(truth, MAP, TF)
    for _ in range(4):
        ekf.measurement_update(hs, [1e-6 * np.eye(2)] * MAP.shape[1])
    np.testing.assert_allclose(ekf.x, truth, atol=1e-4)


def test_a_scan_without_lines_changes_nothing():
    """No line, no information."""
    ekf = EkfLocalization(np.zeros(3), np.eye(3), np.eye(2), MAP, TF, 3.0)
    ekf.measurement_update(np.zeros((2, 0)), [])
    np.testing.assert_array_equal(ekf.x, np.zeros(3))
    np.testing.assert_array_equal(ekf.Sigma, np.eye(3))
