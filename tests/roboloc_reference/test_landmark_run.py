from functools import cache

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import chi2

import record_landmark_log as tool
from roboloc import landmark_logs, se2
from roboloc.angles import wrap
from roboloc.landmark_logs import CONTROL_COV, OBSERVATION_COV, START, START_COV
from roboloc.metrics import nees, pose_error
from roboloc_reference import invariant_slam, landmarks

FILTERS = [landmarks, invariant_slam]


def run(stages, log):
    """Take a filter through a log; return means and covariances of estimate minus truth at each observation."""
    x, P = stages.init_landmarks(log.observations[0], OBSERVATION_COV, START, START_COV)
    beliefs = [(x, P)]
    for control, z in zip(log.controls, log.observations[1:], strict=True):
        x, P = stages.predict(x, P, control, CONTROL_COV)
        x, P = stages.update(x, P, z, OBSERVATION_COV)
        beliefs.append((x, P))
    return [(x, invariant_slam.to_ordinary(x, P) if stages is invariant_slam else P) for x, P in beliefs]


@cache
def smoothed():
    """Return all poses (37, 3) and the landmarks (12,) that explain the shipped log best, by least squares."""
    log = landmark_logs.load()

    def residuals(unknown):
        poses, places = unknown[:111].reshape(37, 3), unknown[111:].reshape(6, 2)
        c, s = np.cos(poses[:-1, 2]), np.sin(poses[:-1, 2])
        dx, dy, turn = np.diff(poses, axis=0).T
        steps = np.stack([c * dx + s * dy, c * dy - s * dx, turn], axis=-1)
        steps[:, [0, 2]] -= log.controls
        delta = places - poses[:, None, :2]
        looks = np.stack(
            [np.arctan2(delta[..., 1], delta[..., 0]) - poses[:, 2:], np.hypot(*delta.T).T], axis=-1
        )
        looks = log.observations.reshape(37, 6, 2) - looks
        looks[..., 0] = wrap(looks[..., 0])
        parts = ((poses[0] - START, START_COV), (steps, CONTROL_COV), (looks, OBSERVATION_COV))
        return np.concatenate([(part / np.sqrt(np.diag(cov))).ravel() for part, cov in parts])

    beliefs = run(landmarks, log)
    first = np.concatenate([np.array([x[:3] for x, _ in beliefs]).ravel(), beliefs[-1][0][3:]])
    found = least_squares(residuals, first, xtol=1e-12, ftol=1e-12)
    assert found.success
    last = [*range(108, 111), *range(111, 123)]
    return found.x[last], np.linalg.inv(found.jac.T @ found.jac)[np.ix_(last, last)]


def test_the_run_ends_where_the_robot_is():
    """No landmark is 0.3 m off, and none, nor the pose, further than in one run of a thousand; controls alone are."""
    log, truth = landmark_logs.load(), landmark_logs.load_truth()
    told = START
    for d, alpha in log.controls:
        told = se2.compose(told, [d, 0.0, alpha])
    assert np.hypot(*(told - truth.poses[-1])[:2]) > 0.5
    for stages in FILTERS:
        x, Sigma = run(stages, log)[-1]
        euclidean, mahalanobis = landmarks.evaluate(x, Sigma, truth.landmarks)
        assert euclidean.shape == mahalanobis.shape == (6,)
        assert euclidean.max() < 0.3
        assert mahalanobis.max() < np.sqrt(chi2.ppf(1 - 1e-3, 2))
        assert nees(pose_error(x[:3], truth.poses[-1]), Sigma[:3, :3]) < chi2.ppf(1 - 1e-3, 3)


def test_the_invariant_filter_ends_where_least_squares_over_the_whole_run_does():
    """A step at a time it finds the state to 0.05 of a standard deviation, and the standard deviations to 0.5 %."""
    best, C = smoothed()
    x, Sigma = run(invariant_slam, landmark_logs.load())[-1]
    std = np.sqrt(np.diag(C))
    np.testing.assert_allclose((x - best) / std, 0.0, atol=0.05)
    np.testing.assert_allclose(np.sqrt(np.diag(Sigma)) / std, 1.0, atol=0.005)


def test_the_standard_filter_claims_a_heading_that_the_data_do_not_give():
    """Least squares ends with no less than the first doubt of the heading, as it must, the filter with 0.9 of it."""
    _, C = smoothed()
    _, Sigma = run(landmarks, landmark_logs.load())[-1]
    assert C[2, 2] > START_COV[2, 2]
    assert Sigma[2, 2] < 0.9**2 * START_COV[2, 2]


@pytest.mark.parametrize("stages", FILTERS)
def test_a_run_without_noise_has_no_error(stages):
    """Filters that expect noise where there is none are right at every step, to 1e-10, pose and map."""
    log, truth = tool.record(noise=0.0)
    for (x, Sigma), pose in zip(run(stages, log), truth.poses, strict=True):
        np.testing.assert_allclose(x, [*pose, *truth.landmarks], atol=1e-10)
        for distances in landmarks.evaluate(x, Sigma, truth.landmarks):
            assert distances.max() < 1e-7
