"""Whole runs of SLAM with lines without noise: from the map, from no map, and from a wrong one."""

import numpy as np
from line_states import (
    DT,
    MAP,
    TF,
    with_map,
)

from roboloc.angles import wrap
from roboloc.simulation import figure_eight, simulate_motion
from roboloc_reference import lines
from roboloc_reference.association import compute_innovations, measurement_model
from roboloc_reference.gaussian import measurement_update, transition_update
from roboloc_reference.slam import augment, compute_predicted_measurements, transition_model


def run(truth, us, x, Sigma, Q, fixed):
    """Drive SLAM without noise, all lines seen, those not known entering; return state, covariance, worst error."""
    worst = 0.0
    for u, pose in zip(us, truth[1:], strict=True):
        x, Sigma = transition_update(*transition_model(x, u, DT), Sigma, 1e-3 * np.eye(2), DT)
        z_raw = lines.compute_predicted_measurements(pose, MAP, TF)[0]
        v, Qs, H = compute_innovations(
            z_raw, [Q] * MAP.shape[1], *compute_predicted_measurements(x, TF, fixed), Sigma, 3.0
        )
        assert x.size == 3 or len(v) == MAP.shape[1]
        x, Sigma = measurement_update(x, Sigma, *measurement_model(v, Qs, H))
        if x.size == 3:
            for z in z_raw.T:
                x, Sigma = augment(x, Sigma, z, Q, TF)
        worst = max(worst, np.abs(errors(x, pose)).max())
    return x, Sigma, worst


def errors(x, pose):
    """Return the error of a state, angles on the circle."""
    error = x - with_map(pose)
    error[2] = wrap(error[2])
    error[3::2] = wrap(error[3::2])
    return error


def test_noiseless_run_from_the_map_has_no_error():
    """From the true map and pose, uncertain as they are, a figure-eight in the arena stays true to 1e-9."""
    us = figure_eight()
    truth = simulate_motion([0.2, 0.0, 0.0], us, DT)
    Sigma = np.diag(np.r_[[1e-3] * 3, [0.0] * 4, [1e-3] * 8])
    assert run(truth, us, with_map(truth[0]), Sigma, 1e-4 * np.eye(2), fixed=2)[2] < 1e-9


def test_noiseless_run_from_no_map_has_no_error():
    """From a start that is known, all lines enter when first seen, and pose and map stay true to 1e-9."""
    us = figure_eight()
    truth = simulate_motion([0.2, 0.0, 0.0], us, DT)
    x, Sigma, worst = run(truth, us, truth[0], np.zeros((3, 3)), 1e-4 * np.eye(2), fixed=0)
    assert x.size == 3 + 2 * MAP.shape[1]
    assert worst < 1e-9
    assert np.linalg.eigvalsh(Sigma)[0] > 0


def test_a_wrong_map_is_put_right():
    """With two lines certain and four wrong by some centimetres and degrees, pose and map end within 1 mm and mrad."""
    rng = np.random.default_rng(2)
    us = figure_eight()
    truth = simulate_motion([0.2, 0.0, 0.0], us, DT)
    x = with_map(truth[0]) + np.r_[[0.02, -0.02, 0.01], [0.0] * 4, rng.normal(0, 0.03, 8)]
    Sigma = np.diag(np.r_[[0.03] * 3, [0.0] * 4, [0.05] * 8]) ** 2
    assert np.abs(errors(x, truth[0])).max() > 0.02
    x, Sigma, _ = run(truth, us, x, Sigma, 1e-4 * np.eye(2), fixed=2)
    assert np.abs(errors(x, truth[-1])).max() < 1e-3
    np.testing.assert_array_equal(x[3:7], MAP.T.ravel()[:4])
