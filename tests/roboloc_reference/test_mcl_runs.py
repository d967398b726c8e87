"""Whole runs of Monte Carlo localization in the arena, by the shell with the reference stages.

The robot drives a circle to the left and one to the right, by controls drawn as the filter assumes, and sees three
of the six walls at a time, with noise drawn from the covariance that the filter is told. All runs are seeded.
"""

import numpy as np
import pytest
from scipy.stats import binom, chi2

from roboloc import logs
from roboloc.filters import run
from roboloc.metrics import nees, pose_error
from roboloc.simulation import figure_eight, simulate_motion
from roboloc.worlds import arena, scatter
from roboloc_reference.ekf import EkfLocalization
from roboloc_reference.lines import compute_predicted_measurements
from roboloc_reference.mcl import STAGES, MonteCarloLocalization
from roboloc_reference.motion import compute_dynamics

WORLD, TF, DT, SEEN = arena(), np.array([0.12, -0.05, 0.2]), 0.2, 3
R = np.diag([0.02, 0.05])  # as drawn: 6 cm/s and 0.1 rad/s in a step of 0.2 s
Q = np.array([[0.1**2, 0.3 * 0.1 * 0.15], [0.3 * 0.1 * 0.15, 0.15**2]])


def anywhere(count, rng):
    """Return poses from the whole arena."""
    return scatter(WORLD, count, rng)


def drive(rng, start, steps, kidnapped_at=None, scale=1.0):
    """Yield for each step the command, the true pose after it, and the walls that are seen from there."""
    pose, root = np.array(start, dtype=float), np.linalg.cholesky(scale * Q)
    for k in range(steps):
        if k == kidnapped_at:
            pose = pose * [-1, -1, 1] + [0, 0, np.pi]
        u = np.array([0.4, 0.6 if k < steps // 2 else -0.6])
        pose = compute_dynamics(pose, rng.multivariate_normal(u, scale * DT * R), DT)[0]
        walls = rng.choice(WORLD.map_lines.shape[1], SEEN, replace=False)
        z_raw = compute_predicted_measurements(pose, WORLD.map_lines, TF)[0][:, walls]
        yield u, pose, z_raw + root @ rng.normal(size=z_raw.shape)


def localize(cloud, steps, rng, **options):
    """Take a filter through the steps of a drive; return its errors, position [m] plus heading [rad]."""
    mcl = MonteCarloLocalization(cloud, R, WORLD.map_lines, TF, 3.0, rng, **options)
    off = []
    for u, pose, z_raw in steps:
        mcl.transition_update(u, DT)
        mcl.measurement_update(z_raw, [Q] * SEEN)
        dx, dy, dtheta = pose_error(mcl.x, pose)
        off.append(np.hypot(dx, dy) + abs(dtheta))
    return np.array(off)


@pytest.mark.parametrize("threshold", [1.0, 0.5])
def test_a_robot_that_knows_nothing_finds_itself(threshold):
    """From 2000 poses anywhere in the arena at least 13 of 15 runs end within 0.4 (m + rad) of the truth."""
    ends = []
    for seed in range(15):
        rng = np.random.default_rng(seed)
        start = scatter(WORLD, 1, rng)[0] * [0.4, 0.4, 1.0]
        off = localize(anywhere(2000, rng), drive(rng, start, 30), rng, threshold=threshold)
        ends.append(off[-5:].max())
    assert np.sum(np.array(ends) < 0.4) >= 13


def test_the_recorded_run_of_the_arena_is_followed():
    """A thousand particles are never more than 5 cm off, and 5 mm on average."""
    log, rng = logs.load("arena"), np.random.default_rng(0)
    cloud = rng.multivariate_normal(log.x0, log.Sigma0, 1000)
    mcl = MonteCarloLocalization(
        cloud, log.R, WORLD.map_lines, log.tf_base_to_camera, 3.0, rng, threshold=0.5
    )
    found = run(mcl, log)
    dx, dy, _ = pose_error(found.xs[found.scans], log.truth_at(log.scan_times)).T
    assert np.hypot(dx, dy).max() < 0.05
    assert np.hypot(dx, dy).mean() < 0.005


def kidnapped(fresh):
    """Return the errors of 12 runs, with or without fresh particles: the robot is carried away in step 15."""
    runs = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        start = np.array([1.2, 0.3, rng.uniform(-3, 3)])
        cloud = start + rng.normal(size=(1000, 3)) * 0.1
        options = {"fresh": anywhere, "share": 0.1} if fresh else {}
        runs.append(localize(cloud, drive(rng, start, 60, kidnapped_at=15), rng, **options))
    return np.array(runs)


def test_a_kidnapped_robot_finds_itself_with_fresh_particles():
    """All 12 runs are tracked before, and at least 11 end within 0.4 (m + rad)."""
    off = kidnapped(fresh=True)
    assert (off[:, 5:15] < 0.4).all()
    assert np.sum(off[:, -5:].max(axis=1) < 0.4) >= 11


def test_a_kidnapped_robot_without_fresh_particles_stays_lost():
    """The same runs without fresh particles are tracked and then lost, and at most 2 end within 0.4 (m + rad)."""
    off = kidnapped(fresh=False)
    assert (off[:, 5:15] < 0.4).all()
    assert (off[:, 15] > 1.0).all()
    assert np.sum(off[:, -5:].max(axis=1) < 0.4) <= 2


def test_without_noise_a_cloud_of_certain_particles_follows_exactly():
    """With R = 0 and all particles at the start, a figure-eight with exact scans ends at the truth, to 1e-12."""
    us = figure_eight(dt=DT)
    truth = simulate_motion(WORLD.start, us, DT)
    mcl = MonteCarloLocalization(
        np.tile(WORLD.start, (5, 1)), np.zeros((2, 2)), WORLD.map_lines, TF, 3.0, np.random.default_rng(0)
    )
    for u, pose in zip(us, truth[1:], strict=True):
        mcl.transition_update(u, DT)
        mcl.measurement_update(compute_predicted_measurements(pose, WORLD.map_lines, TF)[0], [Q] * 6)
    assert np.abs(pose_error(mcl.x, truth[-1])).max() < 1e-12


def test_the_mean_goes_to_that_of_the_ekf_as_the_cloud_grows():
    """In a nearly linear case, with walls well apart, the two means differ as 1 / sqrt(M)."""
    # The difference in standard deviations, its root mean square over 60 clouds and the entries of the pose. Its
    # exponent comes out with a standard error of 0.02.
    scale, start, Sigma0 = 1 / 400, np.array([0.2, 0.0, 0.5]), 2e-5 * np.eye(3)
    steps = list(drive(np.random.default_rng(0), start, 3, scale=scale))
    ekf = EkfLocalization(start, Sigma0, scale * R, WORLD.map_lines, TF, 10.0)
    for u, _, z_raw in steps:
        ekf.transition_update(u, DT)
        ekf.measurement_update(z_raw, [scale * Q] * SEEN)

    sizes, differences = np.array([100, 400, 1600, 6400]), []
    for M in sizes:
        squares = []
        for seed in range(60):
            rng = np.random.default_rng(seed)
            cloud = rng.multivariate_normal(start, Sigma0, M)
            mcl = MonteCarloLocalization(cloud, scale * R, WORLD.map_lines, TF, 10.0, rng, threshold=0.5)
            for u, _, z_raw in steps:
                mcl.transition_update(u, DT)
                mcl.measurement_update(z_raw, [scale * Q] * SEEN)
            squares.append(pose_error(mcl.x, ekf.x) ** 2 / np.diag(ekf.Sigma))
        differences.append(np.sqrt(np.mean(squares)))
    exponent = np.polyfit(np.log(sizes), np.log(differences), 1)[0]
    assert abs(exponent + 0.5) < 0.1
    assert differences[-1] < 0.05


# ---------------------------------------------------------------- coverage

RUNS, FALSE_ALARM, PROBABILITY = 400, 1e-3, 0.95


def inside(stages=STAGES, M=1500):
    """Return in how many of 400 runs the true pose is in the region that shall hold it with 95 percent.

    The region is the ellipsoid about the mean of the cloud, in its covariance, that holds 95 percent of a normal
    distribution; the true start is drawn from what the cloud is drawn from.
    """
    count, scale, Sigma0 = 0, 1 / 4, np.diag([0.05, 0.05, 0.05]) ** 2
    for seed in range(RUNS):
        rng = np.random.default_rng([1, seed])
        mean = np.array([0.2, 0.0, rng.uniform(-3, 3)])
        start, *cloud = rng.multivariate_normal(mean, Sigma0, M + 1)
        mcl = MonteCarloLocalization(
            cloud, scale * R, WORLD.map_lines, TF, 3.0, rng, stages=stages, threshold=0.5
        )
        steps = list(drive(rng, start, 3, scale=scale))
        for u, _, z_raw in steps:
            mcl.transition_update(u, DT)
            mcl.measurement_update(z_raw, [scale * Q] * SEEN)
        count += nees(pose_error(mcl.x, steps[-1][1]), mcl.Sigma) < chi2.ppf(PROBABILITY, 3)
    return count


LOW, HIGH = binom.ppf([FALSE_ALARM / 2, 1 - FALSE_ALARM / 2], RUNS, PROBABILITY)


def squared(vs, Q_raw, ws):
    """Weigh twice by the same observation."""
    return STAGES["measurement_weights"](vs, Q_raw, STAGES["measurement_weights"](vs, Q_raw, ws))


def timid(vs, Q_raw, ws):
    """Weigh as if the observation had four times its covariance."""
    return STAGES["measurement_weights"](vs, 4 * Q_raw, ws)


def test_the_truth_is_in_the_region_as_often_as_it_shall_be():
    """The number of runs is binomial with 95 percent, with a false alarm of 1e-3."""
    assert LOW <= inside() <= HIGH


@pytest.mark.parametrize(
    "fault",
    [
        {"stages": {**STAGES, "measurement_weights": squared}},
        {"stages": {**STAGES, "measurement_weights": timid}},
        {"M": 60},
    ],
    ids=["likelihood squared", "covariance four times too large", "too few particles"],
)
def test_a_wrong_cloud_is_found(fault):
    """Likelihoods that count twice or too little leave the band, and so do 60 particles, which are too few."""
    assert not LOW <= inside(**fault) <= HIGH
