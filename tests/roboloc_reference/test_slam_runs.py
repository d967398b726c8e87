"""SLAM with lines end to end: the recorded runs from a wrong map and from none, and what a filter must be at its edges.

Errors of lines that were fitted to points and chosen by a gate are not exactly Gaussian, and a map from nothing hangs
on few of them, so that the NEES is held in wide limits here; tests/roboloc_reference/test_consistency_line_slam.py
asks for more, of drawn observations.
"""

from functools import cache

import numpy as np
import pytest

from roboloc import logs, worlds
from roboloc.angles import wrap
from roboloc.filters import run
from roboloc.metrics import nees, pose_error
from roboloc_reference import lines
from roboloc_reference.association import measurement_model
from roboloc_reference.ekf import EkfLocalization
from roboloc_reference.gaussian import measurement_update
from roboloc_reference.mapping import EkfMapping
from roboloc_reference.slam import EkfSlam, augment, compute_predicted_measurements

NAMES = ["arena", "maze"]
DEVIATIONS = np.array([0.02, 0.05])  # of a wrong map: 1.1 degrees, 5 cm


def map_of(name):
    """Return the true lines of a world."""
    return getattr(worlds, name)().map_lines


def with_map(x, map_lines):
    """Return the state of a pose and a map."""
    return np.concatenate([x, np.asarray(map_lines).T.ravel()])


def off_the_map(map_lines, truth):
    """Return the errors (2, J) of lines, each written as the true one is, next to which it lies."""
    error = map_lines - truth
    other = np.abs(wrap(error[0])) > np.pi / 2
    r = np.where(other, -map_lines[1], map_lines[1])
    return np.array([wrap(error[0] + np.pi * other), r - truth[1]])


def walls_of(map_lines, truth):
    """Return to which true line each line of a map is nearest."""
    pairs = [off_the_map(line[:, None] + 0 * truth, truth) for line in map_lines.T]
    return [int(np.argmin(np.hypot(3 * alpha, r))) for alpha, r in pairs]


class Watched(EkfMapping):
    """The filter, with its map after each scan."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.maps = []

    def measurement_update(self, z_raw, Q_raw):
        """Correct, and write the map down."""
        super().measurement_update(z_raw, Q_raw)
        self.maps.append(self.map_lines)


def from_a_wrong_map(log, truth):
    """Return a filter with two certain lines and all others wrong, seed 0."""
    wrong = np.random.default_rng(0).normal(size=truth.shape) * DEVIATIONS[:, None]
    variances = np.tile(DEVIATIONS**2, truth.shape[1])
    wrong[:, :2], variances[:4] = 0.0, 0.0
    Sigma0 = np.zeros((3 + truth.size, 3 + truth.size))
    Sigma0[:3, :3], Sigma0[3:, 3:] = log.Sigma0, np.diag(variances)
    return EkfSlam(with_map(log.x0, truth + wrong), Sigma0, log.R, log.tf_base_to_camera, 3.0)


def from_two_lines(log, truth):
    """Return a filter that has two certain lines, and has to find the others."""
    Sigma0 = np.zeros((7, 7))
    Sigma0[:3, :3] = log.Sigma0
    return Watched(with_map(log.x0, truth[:, :2]), Sigma0, log.R, log.tf_base_to_camera, 3.0, fixed=2)


def from_no_map(log, truth):
    """Return a filter that knows where it starts and nothing else; that holds the map."""
    return Watched(log.truth_at([log.start_time])[0], np.zeros((3, 3)), log.R, log.tf_base_to_camera, 3.0)


@cache
def driven(name, start):
    """Return a log, the true map, and filter and run at the end."""
    log, truth = logs.load(name), map_of(name)
    ekf = start(log, truth)
    return log, truth, ekf, run(ekf, log)


def errors(log, found):
    """Return the pose errors at the scans."""
    return pose_error(found.xs[found.scans, :3], log.truth_at(log.scan_times))


# ---------------------------------------------------------------- the recorded runs


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("start", [from_a_wrong_map, from_two_lines])
def test_with_two_certain_lines_pose_and_map_become_exact(name, start):
    """The pose ends within 5 mm and 2 mrad, each line within 5 mm and 5 mrad, if wrong or missing at the start."""
    log, truth, ekf, found = driven(name, start)
    error = errors(log, found)
    assert np.hypot(*error[-1, :2]) < 0.005
    assert abs(error[-1, 2]) < 0.002
    assert np.hypot(*error[:, :2].T).max() < 0.2
    if start is from_a_wrong_map:
        assert np.abs(off_the_map(found.xs[0, 3:].reshape(-1, 2).T, truth)).max() > 0.05
    np.testing.assert_array_equal(ekf.map_lines[:, :2], truth[:, :2])
    assert np.abs(off_the_map(ekf.map_lines, truth[:, walls_of(ekf.map_lines, truth)])).max() < 0.005


@pytest.mark.parametrize(
    ("name", "pose", "heading", "walls"), [("arena", 0.03, 0.01, 0.04), ("maze", 0.1, 0.01, 0.1)]
)
def test_from_no_map_pose_and_map_are_right(name, pose, heading, walls):
    """In the frame of its start the robot is right within 3 cm in the arena, 10 cm in the maze, and the walls are."""
    log, truth, ekf, found = driven(name, from_no_map)
    error = errors(log, found)
    assert np.hypot(*error[-1, :2]) < pose
    assert abs(error[-1, 2]) < heading
    alpha, r = off_the_map(ekf.map_lines, truth[:, walls_of(ekf.map_lines, truth)])
    assert np.abs(alpha).max() < heading
    assert np.abs(r).max() < walls

    # Without the scans it would not: the controls alone are several times as wrong.
    alone = errors(log, run(from_no_map(log, truth), log, correct=False))
    assert np.hypot(*alone[:, :2].T).mean() > 5 * np.hypot(*error[:, :2].T).mean()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("start", [from_two_lines, from_no_map])
def test_every_wall_is_found_once_and_keeps_its_number(name, start):
    """The map ends with each wall, none twice; at no time does a line of the map stand for another wall than later."""
    _, truth, ekf, _ = driven(name, start)
    walls = walls_of(ekf.map_lines, truth)
    assert sorted(walls) == list(range(truth.shape[1]))
    assert ekf.x.size == 3 + truth.size  # nobody rides along

    assert [m.shape[1] for m in ekf.maps] == sorted(m.shape[1] for m in ekf.maps)
    assert all(walls_of(m, truth) == walls[: m.shape[1]] for m in ekf.maps[::10])


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("start", [from_a_wrong_map, from_two_lines, from_no_map])
def test_nearly_all_lines_are_matched_and_the_filter_is_about_as_wrong_as_it_says(name, start):
    """At least 95 percent match, with a NIS of 2 a line; the NEES of the pose, 3 if all were Gaussian, is 1 to 6."""
    log, _, _, found = driven(name, start)
    assert found.associated.sum() > 0.95 * found.observed.sum()
    assert 0.85 < found.nis.sum() / (2 * found.associated.sum()) < 1.15
    later = found.scans[10:]  # a start that is certain has no covariance to divide by
    mean = nees(errors(log, found)[10:], found.Sigmas[later, :3, :3]).mean()
    assert 1 < mean < 6


# ---------------------------------------------------------------- localization is the special case


@pytest.mark.parametrize("fixed", [0, 2, 6])
def test_with_a_certain_map_slam_is_localization(fixed):
    """Over the run in the arena, beliefs, innovations and matches are those of localization, to 1e-9."""
    log, truth = logs.load("arena"), map_of("arena")
    Sigma0 = np.zeros((15, 15))
    Sigma0[:3, :3] = log.Sigma0
    ekf = EkfSlam(with_map(log.x0, truth), Sigma0, log.R, log.tf_base_to_camera, 3.0, fixed)
    other = EkfLocalization(log.x0, log.Sigma0, log.R, truth, log.tf_base_to_camera, 3.0)
    found, expected = run(ekf, log), run(other, log)
    np.testing.assert_array_equal(found.associated, expected.associated)
    np.testing.assert_allclose(found.xs[:, :3], expected.xs, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.Sigmas[:, :3, :3], expected.Sigmas, rtol=0, atol=1e-11)
    np.testing.assert_allclose(found.nis, expected.nis, rtol=1e-6)
    np.testing.assert_array_equal(ekf.map_lines, truth)
    np.testing.assert_array_equal(ekf.Sigma[3:], 0.0)


# ---------------------------------------------------------------- edges

MAP, TF, R = map_of("arena"), np.array([0.12, -0.05, 0.2]), np.diag([0.01, 0.01])
POSE, Q = np.array([0.2, 0.1, 0.3]), np.diag([0.01, 0.02]) ** 2


def filter_in_the_arena(seed=0):
    """Return a filter whose belief has covariances everywhere, and what it would see without noise."""
    rng = np.random.default_rng(seed)
    root = 0.02 * rng.normal(size=(15, 15)) / np.sqrt(15)
    ekf = EkfSlam(with_map(POSE, MAP), root @ root.T + 1e-5 * np.eye(15), R, TF, 3.0, fixed=0)
    return ekf, ekf.compute_predicted_measurements()[0]


def assert_equal_beliefs(ekf, other, atol):
    """Compare mean and covariance."""
    np.testing.assert_allclose(ekf.x, other.x, rtol=0, atol=atol)
    np.testing.assert_allclose(ekf.Sigma, other.Sigma, rtol=0, atol=atol)


@pytest.mark.parametrize("fixed", [0, 2])
def test_without_a_map_nothing_is_corrected(fixed):
    """J = 0: the filter moves as localization without a map does, and no line is one of its map."""
    ekf = EkfSlam(POSE, 1e-4 * np.eye(3), R, TF, 3.0, fixed)
    other = EkfLocalization(POSE, 1e-4 * np.eye(3), R, MAP[:, :0], TF, 3.0)
    for one in (ekf, other):
        one.transition_update([0.5, 0.2], 0.1)
        one.measurement_update([[0.1], [2.0]], [Q])
    assert_equal_beliefs(ekf, other, 0.0)
    assert ekf.map_lines.shape == (2, 0)


def test_what_is_not_observed_or_outside_the_gate_changes_nothing():
    """An empty scan, and one of which no line is near a line of the map, leave the belief bit by bit."""
    ekf, _ = filter_in_the_arena()
    x, Sigma = ekf.x, ekf.Sigma
    far = np.array([[0.0, 1.0, -2.0], [40.0, 50.0, 60.0]])
    for z_raw, Q_raw in ((np.zeros((2, 0)), []), (far, [Q] * 3)):
        assert [len(part) for part in ekf.measurement_model(z_raw, Q_raw)] == [0, 0, 0]
        ekf.measurement_update(z_raw, Q_raw)
        np.testing.assert_array_equal(ekf.x, x)
        np.testing.assert_array_equal(ekf.Sigma, Sigma)


def test_two_observations_of_one_line_are_one_with_half_the_covariance():
    """Two pieces of a wall both correct, and are worth their mean with Q / 2, to 1e-12."""
    (twice, hs), (once, _) = filter_in_the_arena(), filter_in_the_arena()
    z, off = hs[:, [2]], np.array([[0.002], [0.004]])
    twice.measurement_update(np.hstack([z + off, z + 3 * off]), [Q, Q])
    once.measurement_update(z + 2 * off, [Q / 2])
    assert np.abs(twice.x - with_map(POSE, MAP)).max() > 1e-4
    assert_equal_beliefs(twice, once, 1e-12)


def test_batch_and_sequence_agree_where_the_prediction_is_right():
    """A scan without noise corrects the covariance the same, at once or line by line in any order, to 1e-12."""
    # What is seen is what is predicted, so that the mean and with it the derivatives stay as they are.
    batch, hs = filter_in_the_arena()
    batch.measurement_update(hs, [Q] * 6)
    for order in (range(6), [4, 1, 5, 0, 3, 2]):
        sequence, _ = filter_in_the_arena()
        for j in order:
            sequence.measurement_update(hs[:, [j]], [Q])
        assert_equal_beliefs(batch, sequence, 1e-12)


def test_batch_and_sequence_agree_with_the_same_derivatives():
    """With noise too, if the lines that come later are linearized where the first one was; else they differ."""
    rng = np.random.default_rng(3)
    ekf, _ = filter_in_the_arena()
    _, Hs = ekf.compute_predicted_measurements()
    v = rng.multivariate_normal(np.zeros(2), Q, 6)
    x, Sigma = ekf.x, ekf.Sigma
    whole = measurement_update(x, Sigma, *measurement_model(v, [Q] * 6, Hs))
    one_by_one, mean = (x, Sigma), x
    for v_j, H in zip(v, Hs, strict=True):
        one_by_one = measurement_update(*one_by_one, v_j - H @ (one_by_one[0] - mean), Q, H)
    for part, other in zip(whole, one_by_one, strict=True):
        np.testing.assert_allclose(part, other, rtol=0, atol=1e-12)

    z_raw = compute_predicted_measurements(x, TF, fixed=0)[0] + v.T
    for j in range(6):
        ekf.measurement_update(z_raw[:, [j]], [Q])
    assert 1e-9 < np.abs(ekf.x - whole[0]).max() < 1e-3


def test_the_filter_is_its_stages():
    """A new line enters the belief of the filter as it enters that of the stages, and is corrected from then on."""
    ekf = EkfSlam(POSE, np.zeros((3, 3)), R, TF, 3.0, fixed=0)
    ekf.transition_update([0.5, 0.2], 0.1)
    z_raw = lines.compute_predicted_measurements(ekf.x, MAP[:, [1]], TF)[0]
    ekf.x, ekf.Sigma = augment(ekf.x, ekf.Sigma, z_raw[:, 0], Q, TF)
    np.testing.assert_allclose(off_the_map(ekf.map_lines, MAP[:, [1]]), 0.0, atol=1e-12)
    before = np.diag(ekf.Sigma)
    ekf.measurement_update(z_raw, [Q])
    assert (np.diag(ekf.Sigma)[3:] < before[3:]).all()
