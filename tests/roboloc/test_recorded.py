import numpy as np
import pytest

from roboloc.filters import Ekf, EkfLocalization, MissingStageError, MonteCarloLocalization, run
from roboloc.logs import Log

LOG = Log(
    control_times=[0.0, 1.0, 2.0],
    controls=[[1.0, 0.0], [2.0, 0.0], [4.0, 0.0]],
    scan_times=[0.0, 0.5, 2.5],
    bearings=[0.0],
    scans=np.full((3, 1), np.nan),
    z_raw=[np.ones((2, 2)), np.ones((2, 1)), np.ones((2, 0))],
    Q_raw=[np.tile(np.eye(2), (2, 1, 1)), [np.eye(2)], np.zeros((0, 2, 2))],
    truth_times=[0.0, 2.5],
    truth=np.zeros((2, 3)),
    x0=np.zeros(3),
    Sigma0=np.eye(3),
    R=np.eye(2),
    tf_base_to_camera=np.zeros(3),
    world="nowhere",
)


def observe(v, Q, H):
    """Stack by the definition."""
    k = len(v)
    stacked = np.zeros((2 * k, 2 * k))
    for i in range(k):
        stacked[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = Q[i]
    return v.ravel(), stacked, H.reshape(2 * k, 3)


def add_up(x, u, dt):
    """Add up the speed in x."""
    return x + u[0] * dt * np.eye(3)[0], np.eye(3), np.zeros((3, 2))


def keep(g, Gx, Gu, Sigma, R, dt):
    """Be as certain as before."""
    return g, Sigma


def first(z_raw, Q_raw, hs, Hs, Sigma, g):
    """Give the first observation, if there is one, to the only line."""
    return (z_raw.T[:1] - hs.T, Q_raw[:1], Hs) if z_raw.size else ([], [], [])


def count(x, Sigma, z, Q, H):
    """Add 100 to y for each line that was matched, and double the covariance."""
    return x + 50 * len(z) * np.eye(3)[1], 2 * Sigma


STAGES = {
    "compute_dynamics": add_up,
    "transition_update": keep,
    "compute_predicted_measurements": lambda *arguments: (arguments[1], np.ones((1, 2, 3))),
    "compute_innovations": first,
    "measurement_model": observe,
    "measurement_update": count,
}


def localization(**changes):
    """Return a filter with the stages above, some replaced."""
    stages = {**STAGES, **changes}
    return EkfLocalization(np.zeros(3), np.eye(3), np.eye(2), [[0.0], [3.0]], np.zeros(3), 3.0, stages=stages)


def test_controls_and_scans_are_processed_in_time_order():
    """Positions add up the control that held; corrections come at the times of the scans."""
    ekf = localization()
    found = run(ekf, LOG)
    np.testing.assert_array_equal(found.times, [0, 0, 0.5, 1, 2, 2.5])
    np.testing.assert_allclose(found.xs[:, 0], [0, 0, 0.5, 1, 3, 5])
    np.testing.assert_allclose(found.xs[:, 1], [0, 100, 200, 200, 200, 200])
    np.testing.assert_allclose(found.Sigmas[:, 0, 0], [1, 2, 4, 4, 4, 8])
    np.testing.assert_array_equal(found.scans, [1, 2, 5])
    np.testing.assert_array_equal(ekf.x, found.xs[-1])


def test_innovations_are_those_before_the_correction():
    """Each scan has its lines, how many matched, the innovation and its covariance H Sigma H^T + Q."""
    found = run(localization(), LOG)
    np.testing.assert_array_equal(found.observed, [2, 1, 0])
    np.testing.assert_array_equal(found.associated, [1, 1, 0])
    assert [v.shape for v in found.v] == [(2,), (2,), (0,)]
    for k, (v, S) in enumerate(zip(found.v[:2], found.S[:2], strict=True)):
        np.testing.assert_allclose(v, [1, -2])
        np.testing.assert_allclose(S, 3 * 2**k + np.eye(2))
        assert found.nis[k] == pytest.approx(v @ np.linalg.inv(S) @ v)
    assert found.nis[2] == 0


@pytest.mark.parametrize("kind", ["localization", "plain"])
def test_without_corrections_the_filter_only_predicts(kind):
    """Then the measurement stages are not needed, and any Ekf will do."""
    ekf = localization() if kind == "localization" else Ekf(np.zeros(3), np.eye(3), np.eye(2), stages=STAGES)
    found = run(ekf, LOG, correct=False)
    np.testing.assert_array_equal(found.xs[-1], [5, 0, 0])
    np.testing.assert_array_equal(found.scans, [1, 2, 5])
    np.testing.assert_array_equal(found.associated, [0, 0, 0])
    np.testing.assert_array_equal(found.observed, [2, 1, 0])
    np.testing.assert_array_equal(found.nis, [0, 0, 0])


class Growing(EkfLocalization):
    """A filter to whose state each scan adds an entry; it keeps its own way of correcting."""

    def measurement_update(self, z_raw, Q_raw):
        """Correct, then grow."""
        super().measurement_update(z_raw, Q_raw)
        self.x = np.append(self.x, 7.0)
        self.Sigma = np.pad(self.Sigma, (0, 1), constant_values=8.0)


def test_a_state_that_grows_is_nan_before():
    """The correction is the filter's own, and what a state did not have yet is NaN, in mean and covariance."""
    log = LOG.changed(
        scan_times=LOG.scan_times[:1], scans=LOG.scans[:1], z_raw=LOG.z_raw[:1], Q_raw=LOG.Q_raw[:1]
    )
    stages = {
        **STAGES,
        "compute_dynamics": lambda x, u, dt: (x + dt * u[0], np.eye(x.size), np.zeros((x.size, 2))),
    }
    found = run(
        Growing(np.zeros(3), np.eye(3), np.eye(2), [[0.0], [3.0]], np.zeros(3), 3.0, stages=stages), log
    )
    np.testing.assert_array_equal(found.times, [0, 0, 1, 2])
    np.testing.assert_array_equal(found.xs[:, 3], [np.nan, 7, 8, 10])
    np.testing.assert_array_equal(found.Sigmas[:, 3, 3], [np.nan, 8, 8, 8])
    np.testing.assert_array_equal(found.Sigmas[:, 0, 3], [np.nan, 8, 8, 8])
    assert np.isfinite(found.xs[:, :3]).all()
    assert np.isfinite(found.Sigmas[:, :3, :3]).all()


@pytest.mark.parametrize("correct", [True, False])
def test_a_cloud_goes_through_a_run_too(correct):
    """Mean and covariance of the particles are recorded; there is no innovation that all of them share."""
    stages = {
        "transition_model": lambda xs, us, dt: xs + us[:, :1] * dt * np.eye(3)[0],
        "compute_predicted_measurements": lambda xs, map_lines, _: np.tile(map_lines, (len(xs), 1, 1)),
        "compute_innovations": lambda z_raw, _, hs: np.zeros((len(hs), z_raw.size)),
        "measurement_weights": lambda vs, _, ws: np.array([1.0, 0.0]) if vs.size else ws,
    }
    x0, rng = [[0.0, 1.0, 0.0], [0.0, 3.0, 0.0]], np.random.default_rng(0)
    pf = MonteCarloLocalization(
        x0, np.zeros((2, 2)), [[0.0], [3.0]], np.zeros(3), 3.0, rng, stages=stages, threshold=0.0
    )
    found = run(pf, LOG, correct=correct)
    np.testing.assert_allclose(found.xs[:, 0], [0, 0, 0.5, 1, 3, 5], atol=1e-12)
    np.testing.assert_allclose(found.xs[1:, 1], np.full(5, 1.0 if correct else 2.0))
    np.testing.assert_allclose(found.Sigmas[:, 1, 1], [1] + 5 * [0.0 if correct else 1.0])
    np.testing.assert_array_equal(found.observed, [2, 1, 0])
    np.testing.assert_array_equal(found.associated, [0, 0, 0])


def test_a_missing_stage_is_named():
    """The run stops at the first stage that is not there."""
    with pytest.raises(MissingStageError, match=r"^stage measurement_model: not supplied"):
        run(localization(measurement_model=None), LOG)
