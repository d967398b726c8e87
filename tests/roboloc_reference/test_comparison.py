from dataclasses import fields

import numpy as np
import pytest

from roboloc.angles import wrap
from roboloc.metrics import chi2_band
from roboloc.velocity_logs import VelocityLog
from roboloc_reference import comparison, particle, ukf
from roboloc_reference.comparison import Row, compare, follow, to_markdown
from roboloc_reference.contenders import Extended, Invariant, Particles, Unscented, four_filters
from roboloc_reference.scenarios import ALPHAS, LANDMARKS, SIGMA0, Q, simulate
from roboloc_reference.velocity import jacobians, motion, noise, range_bearings

NAMES = ["EKF", "UKF", "PF", "InEKF"]


def beliefs(scenario, make):
    """Return mean poses (N, 3) and, where the filter has one in poses, covariances (N, 3, 3) after each step."""
    estimator, means, covariances = make(scenario), [], []
    for u, z, landmarks, _ in scenario.steps():
        estimator.predict(u)
        estimator.correct(z, landmarks)
        means.append(estimator.pose())
        covariances.append(getattr(estimator, "Sigma", None))
    return np.array(means), np.array(covariances)


def apart(a, b):
    """Return the difference of poses, the headings on the circle."""
    d = a - b
    d[:, 2] = wrap(d[:, 2])
    return d


# ---------------------------------------------------------------- the scenario


def test_a_run_is_drawn_as_it_says():
    """Start, controls and observations of 100 runs scatter as told: 8 sums of squares at 4 deviations each (5e-4)."""
    start, driven, seen = [], [], []
    for seed in range(100):
        run = simulate(np.random.default_rng(seed))
        start.append(run.truth[0] - run.x0)
        x, end, u = run.truth[40], run.truth[41], run.us[40]
        _, W = jacobians(x, u, run.dt)
        driven.append(np.linalg.solve(W, end - motion(x, u, run.dt)))
        z = run.zs[40] - range_bearings(end[None], run.landmarks[run.seen[40]]).ravel()
        z[::2] = wrap(z[::2])
        seen.append(z[:2])
    M = noise(simulate(None).us[40], ALPHAS)
    for drawn, covariance in ((start, SIGMA0), (driven, M), (seen, Q)):
        share = np.mean(np.square(drawn), axis=0) / np.diag(covariance)
        np.testing.assert_allclose(share, 1.0, atol=4 * np.sqrt(2 / 100))


def test_a_seed_is_a_run():
    """The same seed gives the same run and another one another; no number of it can be written to."""
    first, again, other = (simulate(np.random.default_rng(seed)) for seed in (3, 3, 4))
    for field in fields(VelocityLog):
        np.testing.assert_array_equal(getattr(first, field.name), getattr(again, field.name))
    assert np.abs(first.zs - other.zs).max() > 0.01
    assert not any(getattr(first, f.name).flags.writeable for f in fields(VelocityLog) if f.name != "dt")
    assert np.hypot(*(first.truth[:, None, :2] - LANDMARKS).T).min() > 0.5


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan])
def test_a_wrong_scale_is_named(scale):
    """The scale of the noise is a positive number."""
    with pytest.raises(ValueError, match=r"^scale: expected .*, got "):
        simulate(None, scale)


# ---------------------------------------------------------------- the filters agree where they must


@pytest.mark.parametrize("make", [Extended, Invariant])
def test_without_noise_the_error_is_zero(make):
    """Where nothing is drawn, the linearized filters stay at the truth, to 1e-12, whatever noise they expect."""
    track = follow(simulate(None), make(simulate(None)))
    assert np.abs(track.errors).max() < 1e-12
    assert track.nees.max() < 1e-20


def test_with_vanishing_noise_sampling_filters_are_exact_too():
    """With everything certain to a millionth, points and particles of a noiseless run are within a millionth."""
    run = simulate(None, 1e-6)
    for make in (Unscented, lambda run: Particles(run, np.random.default_rng(0), 200)):
        assert np.abs(follow(run, make(run)).errors).max() < 1e-6


@pytest.mark.parametrize("make", [Unscented, Invariant])
def test_filters_become_one_as_the_noise_goes_to_zero(make):
    """A tenth of the noise makes the means differ by a hundredth of it: to first order all are the EKF."""
    gaps = []
    for scale in (1.0, 0.1, 0.01):
        run = simulate(np.random.default_rng(5), scale)
        (ekf, _), (other, _) = (beliefs(run, each) for each in (Extended, make))
        gaps.append(np.abs(apart(other, ekf)).max() / scale)
    assert gaps[1] < 0.15 * gaps[0]
    assert gaps[2] < 0.15 * gaps[1]
    assert gaps[2] < 1e-3


def test_covariances_become_one_as_the_noise_goes_to_zero():
    """The UKF's covariance goes to the EKF's too, relative to its size."""
    gaps = []
    for scale in (1.0, 0.1, 0.01):
        run = simulate(np.random.default_rng(6), scale)
        (_, ekf), (_, other) = (beliefs(run, each) for each in (Extended, Unscented))
        size = np.sqrt(np.einsum("kii,kjj->kij", ekf, ekf))
        gaps.append(np.max(np.abs(other - ekf) / size))
    assert gaps[1] < 0.15 * gaps[0]
    assert gaps[2] < 0.15 * gaps[1]


def test_the_cloud_goes_to_the_kalman_filter():
    """With a tenth of the noise and 16 times the particles the mean is four times nearer to the EKF's, and near."""
    run = simulate(np.random.default_rng(7), 0.1)
    ekf, covariances = beliefs(run, Extended)
    sigma = np.sqrt(np.einsum("kii->ki", covariances))
    gaps = []
    for count in (500, 8000):
        cloud, _ = beliefs(run, lambda run, count=count: Particles(run, np.random.default_rng(8), count))
        gaps.append(np.sqrt(np.mean((apart(cloud, ekf) / sigma) ** 2)))
    assert gaps[1] < 0.5 * gaps[0]
    assert gaps[1] < 0.1


# ---------------------------------------------------------------- the table


@pytest.fixture(scope="module")
def rows():
    """Return the table of ten runs."""
    runs = [simulate(np.random.default_rng(seed)) for seed in range(10)]
    return compare(runs, four_filters(np.random.default_rng(100)))


def test_the_table_has_all_four(rows):
    """All four are near 6 cm and 1.3 degrees, within a tenth of each other, and none is far from honest."""
    assert [row.name for row in rows] == NAMES
    for row in rows:
        assert row.position == pytest.approx(rows[0].position, rel=0.1)
        assert row.heading == pytest.approx(rows[0].heading, rel=0.1)
        assert 0.03 < row.position < 0.1
        # Ten runs, neighbouring steps not independent: as if each run had but ten independent poses.
        low, high = chi2_band(3, 0.999, 100)
        assert low < row.nees < high * (1.2 if row.name == "PF" else 1.0)
    assert [(row.motions, row.sightings) for row in rows] == [(1, 2), (13, 14), (1000, 2000), (1, 2)]


def test_costs_are_what_is_called(monkeypatch):
    """The counts of points and particles are the rows that the models are really given."""
    moved, looked = {}, {}

    def spy(module, name, counts):
        inner = getattr(module, name)

        def counted(xs, *rest):
            counts[module] = counts.get(module, 0) + len(xs)
            return inner(xs, *rest)

        monkeypatch.setattr(module, name, counted)

    spy(ukf, "motions", moved)
    spy(particle, "motions", moved)
    spy(particle, "range_bearings", looked)
    run = simulate(np.random.default_rng(9))
    unscented = follow(run, Unscented(run))
    particles = follow(run, Particles(run, np.random.default_rng(10), 50))
    assert (unscented.motions, particles.motions) == (moved[ukf], moved[particle])
    assert particles.sightings == 2 * looked[particle]
    assert unscented.sightings == len(run.us) * 2 * len(ukf.sigma_points(run.x0, run.Sigma0, 2.0)[0])


def test_markdown_has_a_line_for_each(rows):
    """The table has a header, a rule and four lines with as many columns; numbers are those of the rows."""
    lines = to_markdown(rows).split("\n")
    assert len(lines) == 6
    assert len({line.count("|") for line in lines}) == 1
    assert lines[2].split("|")[1].strip() == "EKF"
    assert float(lines[2].split("|")[2]) == pytest.approx(rows[0].position, abs=1e-4)
    assert to_markdown([Row("x", *[0.0] * 5)]).count("\n") == 2


def test_particles_are_resampled_when_few_are_left():
    """Above a threshold of 0 nothing is resampled, below 1 nearly always, and at a half now and then."""
    run = simulate(np.random.default_rng(11))
    times = []
    for threshold in (0.0, 0.5, 1.0):
        cloud = Particles(run, np.random.default_rng(12), 300, threshold)
        for u, z, landmarks, _ in run.steps():
            cloud.predict(u)
            cloud.correct(z, landmarks)
        times.append(cloud.resamplings)
    assert times[0] == 0
    assert 20 < times[1] < times[2] == len(run.us) - 1


def test_a_turn_on_the_spot_reaches_every_filter():
    """A control that asks for gamma turns all four filters alike, without noise to the truth."""
    run = simulate(None, 1e-6)
    u = np.array([0.5, 0.2, 0.7])
    for make in four_filters(np.random.default_rng(13), 50).values():
        estimator = make(run)
        estimator.predict(u)
        np.testing.assert_allclose(estimator.pose(), motion(run.x0, u, run.dt), atol=1e-5)


def test_errors_are_on_the_circle():
    """After more than a turn the invariant filter's heading, in one turn, is still compared with the truth's."""
    run = simulate(np.random.default_rng(14))
    assert run.truth[:, 2].max() > np.pi
    assert np.abs(comparison.follow(run, Invariant(run)).errors[:, 2]).max() < 0.2
