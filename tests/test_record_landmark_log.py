import numpy as np
from scipy.stats import chi2

import record_landmark_log as tool
from roboloc import landmark_logs
from roboloc.angles import wrap

ROUNDING = 1e-6


def test_recording_again_gives_the_shipped_run():
    """Every number is that of the file, to its six digits."""
    log, truth = tool.record()
    shipped, shipped_truth = landmark_logs.load(), landmark_logs.load_truth()
    np.testing.assert_allclose(log.observations, shipped.observations, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(log.controls, shipped.controls, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(truth.landmarks, shipped_truth.landmarks, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(truth.poses, shipped_truth.poses, rtol=0, atol=ROUNDING)


def test_the_script_writes_log_and_truth(tmp_path, capsys):
    """Into the folder that it is given, and it says so."""
    tool.main([str(tmp_path / "data")])
    assert landmark_logs.read(tmp_path / "data" / "landmarks.txt").controls.shape == (36, 2)
    assert landmark_logs.read_truth(tmp_path / "data" / "landmarks-truth.txt").poses.shape == (37, 3)
    said = capsys.readouterr().out
    assert "landmarks.txt: " in said
    assert "landmarks-truth.txt: " in said


def test_without_noise_the_oval_closes_and_all_is_seen_where_it_is():
    """The robot ends where it began, and each bearing and range leads to its landmark, to 1e-12."""
    log, truth = tool.record(noise=0.0)
    np.testing.assert_allclose(truth.poses[-1], [0.0, 0.0, 4.0 * np.pi], atol=1e-12)
    beta, r = log.observations[:, ::2] + truth.poses[:, 2:], log.observations[:, 1::2]
    places = truth.poses[:, None, :2] + r[..., None] * np.stack([np.cos(beta), np.sin(beta)], axis=-1)
    np.testing.assert_allclose(places.reshape(37, 12) - truth.landmarks, 0.0, atol=1e-12)


def test_the_shipped_run_is_as_noisy_as_it_says():
    """The squared errors of steps and looks, in units of their covariance, are chi-square, each sum with 1e-3."""
    log, truth = landmark_logs.load(), landmark_logs.load_truth()
    c, s = np.cos(truth.poses[:-1, 2]), np.sin(truth.poses[:-1, 2])
    dx, dy, turn = np.diff(truth.poses, axis=0).T
    steps = np.stack(
        [c * dx + s * dy - log.controls[:, 0], c * dy - s * dx, turn - log.controls[:, 1]], axis=-1
    )
    delta = truth.landmarks.reshape(6, 2) - truth.poses[:, None, :2]
    bearings = np.arctan2(delta[..., 1], delta[..., 0]) - truth.poses[:, 2:]
    looks = log.observations.reshape(37, 6, 2) - np.stack([bearings, np.linalg.norm(delta, axis=-1)], axis=-1)
    looks[..., 0] = wrap(looks[..., 0])
    for errors, covariance in ((steps, landmark_logs.CONTROL_COV), (looks, landmark_logs.OBSERVATION_COV)):
        total, freedom = np.sum(errors**2 / np.diag(covariance)), errors.size
        assert chi2.ppf(5e-4, freedom) < total < chi2.ppf(1 - 5e-4, freedom)
