"""One call of every public function of roboloc and roboloc_reference, for tests that hold for all of them.

A new public function needs an entry here: its full name and the positional arguments of a call that works. A
`numpy.random.Generator` among them is made anew for each call from `RNG`, axes from `AX`. A function that modules of
the package share and whose callers have checked the arguments stands in `UNCHECKED` besides, with the reason; an
argument that may contain NaN, or that may be None, in `ALLOWED`.
"""

from pathlib import Path

import numpy as np

from roboloc import checks, logs, worlds
from roboloc.filters import Run
from roboloc_reference.contenders import four_filters
from roboloc_reference.ekf import EkfLocalization
from roboloc_reference.extraction import Params
from roboloc_reference.scenarios import simulate

RNG, AX = object(), object()


def spread(*variances):
    """Return a covariance with these variances and a correlation of 0.2 between neighbours."""
    s = np.sqrt(variances)
    n = len(variances)
    return np.outer(s, s) * (np.eye(n) + 0.2 * np.eye(n, k=1) + 0.2 * np.eye(n, k=-1))


POSE, TF, DT = np.array([0.5, -0.3, 2.0]), np.array([0.1, -0.05, 0.3]), 0.1
U, TWIST = np.array([0.4, 0.5]), np.array([0.4, 0.1, 0.5])
P2, P3, P5 = spread(0.01, 0.02), spread(0.01, 0.02, 0.03), spread(0.01, 0.02, 0.03, 0.04, 0.05)
LINES = np.array([[0.0, 1.5, -2.0], [2.0, 3.0, 1.0]])
JACOBIANS = np.array([[[0.0, 0.0, -1.0], [-np.cos(a), -np.sin(a), 0.0]] for a in LINES[0]])
CLOUD = POSE + np.arange(12.0).reshape(4, 3) / 20
WEIGHTS = np.array([0.1, 0.2, 0.3, 0.4])
RUNS, PICKS = np.stack([CLOUD, CLOUD + 0.1], axis=1), np.array([[0, 1, 2, 3], [3, 3, 0, 1], [2, 1, 1, 2]])
LANDMARKS = np.array([[4.0, 1.0], [-2.0, 3.0]])
SEEN = np.array([0.2, 3.0, -1.0, 2.0])
ALPHAS4, ALPHAS6 = np.array([0.1, 0.02, 0.03, 0.04]), np.array([0.1, 0.02, 0.03, 0.04, 0.05, 0.06])
X = np.array([[np.cos(2.0), -np.sin(2.0), 0.5], [np.sin(2.0), np.cos(2.0), -0.3], [0.0, 0.0, 1.0]])
BALL, P4 = np.array([0.0, 1.0, 2.0, -3.0]), spread(0.01, 0.02, 0.03, 0.04)
BEARINGS = np.radians(np.arange(-60.0, 61.0, 4.0))
RANGES = 2.0 / np.cos(BEARINGS)
PARAMS = Params(min_segment_length=0.3, line_point_distance=0.06, max_point_gap=0.8, min_points=4)
POINT_MAP, LINE_MAP = np.concatenate([POSE, [4.0, 1.0]]), np.concatenate([POSE, LINES.T.ravel()])
SCENARIO, DATA = simulate(np.random.default_rng(0)), Path(worlds.__file__).parent / "data"
LOG = logs.load("arena").until(1.0)
RUN = Run(
    *(np.arange(2.0), np.stack([POSE, POSE]), np.stack([P3, P3])),
    *(np.zeros(0, dtype=int), np.zeros(0, dtype=int), np.zeros(0, dtype=int), (), ()),
)


def log_filter():
    """Return a filter at the start of the log."""
    return EkfLocalization(LOG.x0, LOG.Sigma0, LOG.R, worlds.arena().map_lines, LOG.tf_base_to_camera, 3.0)


EXAMPLES = {
    "roboloc.angles.circular_mean": (BEARINGS, RANGES),
    "roboloc.angles.circular_std": (BEARINGS, RANGES),
    "roboloc.angles.difference": (4.0 * BEARINGS, BEARINGS),
    "roboloc.angles.resultant_length": (BEARINGS, RANGES),
    "roboloc.angles.wrap": (4.0 * BEARINGS,),
    "roboloc.checks.check": (lambda *arguments: arguments, "compute_dynamics"),
    "roboloc.checks.report.run": ("a stage", abs, ()),
    "roboloc.checks.report.show": (checks.Report("a stage", ()),),
    "roboloc.checks.report.text": (P3,),
    "roboloc.filters.recorded.run": (log_filter(), LOG),
    "roboloc.landmark_logs.load": (),
    "roboloc.landmark_logs.load_truth": (),
    "roboloc.landmark_logs.read": (DATA / "landmarks.txt",),
    "roboloc.landmark_logs.read_truth": (DATA / "landmarks-truth.txt",),
    "roboloc.lidar.cast_rays": (worlds.arena().segments, POSE, BEARINGS, 3.5),
    "roboloc.logs.load": ("arena",),
    "roboloc.four_filters.load": ("unsure",),
    "roboloc.logs.read": (DATA / "arena.npz",),
    "roboloc.metrics.chi2_band": (3, 0.95, 200),
    "roboloc.metrics.credible_ellipse": (P2, 0.95),
    "roboloc.metrics.nees": (POSE, P3),
    "roboloc.metrics.nis": (U, P2),
    "roboloc.metrics.pose_error": (CLOUD, CLOUD[::-1]),
    "roboloc.plotting.plot_covariance_ellipse": (AX, POSE, P3),
    "roboloc.plotting.plot_pose": (AX, POSE),
    "roboloc.plotting.plot_run": (AX, RUN, CLOUD),
    "roboloc.plotting.plot_scan": (AX, POSE, BEARINGS, RANGES, TF),
    "roboloc.plotting.plot_trajectory": (AX, CLOUD),
    "roboloc.plotting.plot_world": (AX, worlds.arena()),
    "roboloc.se2.adjoint": (POSE,),
    "roboloc.se2.compose": (POSE, TF),
    "roboloc.se2.exp": (TWIST,),
    "roboloc.se2.inverse": (POSE,),
    "roboloc.se2.log": (POSE,),
    "roboloc.simulation.figure_eight": (1.0, 0.5, 0.5),
    "roboloc.simulation.simulate_motion": (POSE, np.stack([U, U, U]), DT, P2, RNG),
    "roboloc.validation.as_array": ("value", POSE, (3,)),
    "roboloc.validation.as_covariance": ("value", P3, 3),
    "roboloc.validation.as_floats": ("value", POSE, 3),
    "roboloc.validation.as_number": ("value", np.array(1.5)),
    "roboloc.velocity_logs.load": ("unsure",),
    "roboloc.velocity_logs.read": (DATA / "unsure.npz",),
    "roboloc.worlds.arena": (),
    "roboloc.worlds.lines_of": (worlds.maze().segments,),
    "roboloc.worlds.maze": (),
    "roboloc.worlds.scatter": (worlds.arena(), 5, RNG),
    "roboloc_reference.association.compute_innovations": (
        LINES,
        np.stack([P2] * 3),
        LINES,
        JACOBIANS,
        P3,
        3.0,
    ),
    "roboloc_reference.association.measurement_model": (LINES.T, np.stack([P2] * 3), JACOBIANS),
    "roboloc_reference.ballistic.correct": (BALL, P4, U, P2),
    "roboloc_reference.ballistic.motion": (BALL, DT, 9.81, 0.8),
    "roboloc_reference.ballistic.predict": (BALL, P4, DT, 9.81, 0.8, P4),
    "roboloc_reference.ballistic.vertical_motion": (1.0, -3.0, DT, 9.81, 0.8),
    "roboloc_reference.cloud_weights.weigh": (CLOUD, WEIGHTS, LINES, np.stack([P2] * 3), LINES, TF),
    "roboloc_reference.comparison.compare": ([SCENARIO], four_filters(np.random.default_rng(0), 50)),
    "roboloc_reference.comparison.follow": (
        SCENARIO,
        four_filters(np.random.default_rng(0))["EKF"](SCENARIO),
    ),
    "roboloc_reference.comparison.to_markdown": ((),),
    "roboloc_reference.contenders.four_filters": (RNG, 50),
    "roboloc_reference.extraction.extract_lines": (BEARINGS, RANGES, PARAMS, 1e-6, 1e-4),
    "roboloc_reference.extraction.merge": (BEARINGS, RANGES, np.array([[0, 9], [9, 31]]), PARAMS),
    "roboloc_reference.extraction.split": (BEARINGS, RANGES, PARAMS),
    "roboloc_reference.gaussian.conditioned": (POSE, P3, U, P2, JACOBIANS[0]),
    "roboloc_reference.gaussian.gain": (P2, JACOBIANS[0]),
    "roboloc_reference.gaussian.measurement_update": (POSE, P3, U, P2, JACOBIANS[0]),
    "roboloc_reference.gaussian.symmetric": (X,),
    "roboloc_reference.gaussian.transition_update": (POSE, P3, JACOBIANS[0].T, P3, P2, DT),
    "roboloc_reference.invariant.correct": (X, P3, np.c_[LANDMARKS, [1.0, 1.0]], LANDMARKS, P2),
    "roboloc_reference.invariant.predict": (X, P3, TWIST, P3, DT),
    "roboloc_reference.invariant_slam.init_landmarks": (SEEN, P2, POSE, P3),
    "roboloc_reference.invariant_slam.invariant_error": (POINT_MAP, POINT_MAP + 0.1),
    "roboloc_reference.invariant_slam.predict": (POINT_MAP, P5, U, P3),
    "roboloc_reference.invariant_slam.to_invariant": (POINT_MAP, P5),
    "roboloc_reference.invariant_slam.to_ordinary": (POINT_MAP, P5),
    "roboloc_reference.invariant_slam.update": (POINT_MAP, P5, SEEN[:2], P2),
    "roboloc_reference.landmark_map.as_pairs": ("value", SEEN),
    "roboloc_reference.landmark_map.as_state": (POINT_MAP,),
    "roboloc_reference.landmark_map.block_diagonal": (np.stack([P2, P2]),),
    "roboloc_reference.landmark_map.evaluate": (POINT_MAP, P5, U),
    "roboloc_reference.landmark_map.innovation": (POINT_MAP, SEEN[:2]),
    "roboloc_reference.landmark_map.measurement": (POINT_MAP, 0),
    "roboloc_reference.landmarks.init_landmarks": (SEEN, P2, POSE, P3),
    "roboloc_reference.landmarks.predict": (POINT_MAP, P5, U, P3),
    "roboloc_reference.landmarks.update": (POINT_MAP, P5, SEEN[:2], P2),
    "roboloc_reference.line_fit.as_beams": (BEARINGS, RANGES),
    "roboloc_reference.line_fit.fit_line": (BEARINGS, RANGES, 1e-6, 1e-4),
    "roboloc_reference.line_fit.fit_runs": (BEARINGS, RANGES, np.array([9, 22]), 1e-6, 1e-4),
    "roboloc_reference.lines.compute_predicted_measurements": (POSE, LINES, TF),
    "roboloc_reference.lines.normalize_line_parameters": (-U, JACOBIANS[0]),
    "roboloc_reference.lines.transform_line_to_scanner_frame": (U, POSE, TF),
    "roboloc_reference.mcl.compute_innovations": (LINES, np.stack([P2] * 3), np.stack([LINES] * 4)),
    "roboloc_reference.mcl.compute_predicted_measurements": (CLOUD, LINES, TF),
    "roboloc_reference.mcl.measurement_weights": (np.ones((4, 2)), P2[None], WEIGHTS),
    "roboloc_reference.mcl.transition_model": (CLOUD, np.stack([U] * 4), DT),
    "roboloc_reference.motion.arc": (2.0, 0.4, 0.5, DT),
    "roboloc_reference.motion.compute_dynamics": (POSE, U, DT),
    "roboloc_reference.new_lines.line_in_world": (U, POSE, TF),
    "roboloc_reference.new_lines.recognize": (U, P2, LINES, JACOBIANS, P3, 3.0, 5.0),
    "roboloc_reference.new_lines.squared_distances": (U, P2, LINES, JACOBIANS, P3),
    "roboloc_reference.odometry.bearing_likelihood": (CLOUD, LANDMARKS[0], 0.2, 0.3),
    "roboloc_reference.odometry.bootstrap_step": (
        *(CLOUD, WEIGHTS, TWIST, ALPHAS4, LANDMARKS[0], 0.2, 0.3),
        RNG,
    ),
    "roboloc_reference.odometry.sample_motion": (CLOUD, TWIST, ALPHAS4, RNG),
    "roboloc_reference.particle.correct": (CLOUD, WEIGHTS, SEEN, LANDMARKS, P2),
    "roboloc_reference.particle.effective_sample_size": (WEIGHTS,),
    "roboloc_reference.particle.predict": (CLOUD, TWIST, ALPHAS6, DT, RNG),
    "roboloc_reference.resampling.systematic_resample": (WEIGHTS, 0.1),
    "roboloc_reference.restitution.correct": (np.append(BALL, 0.8), P5, U, P2),
    "roboloc_reference.restitution.motion": (np.append(BALL, 0.8), DT, 9.81),
    "roboloc_reference.restitution.predict": (np.append(BALL, 0.8), P5, DT, 9.81, P5),
    "roboloc_reference.scenarios.simulate": (RNG, 1.0),
    "roboloc_reference.slam.augment": (LINE_MAP, np.eye(9), U, P2, TF),
    "roboloc_reference.slam.compute_predicted_measurements": (LINE_MAP, TF),
    "roboloc_reference.slam.transition_model": (LINE_MAP, U, DT),
    "roboloc_reference.ukf.correct": (POSE, P3, SEEN, LANDMARKS, P2, 0.0),
    "roboloc_reference.ukf.predict": (POSE, P3, TWIST, P3, DT, -3.0),
    "roboloc_reference.ukf.sigma_points": (POSE, P3, 0.5),
    "roboloc_reference.velocity.jacobians": (POSE, TWIST, DT),
    "roboloc_reference.velocity.motion": (POSE, TWIST, DT),
    "roboloc_reference.velocity.motions": (CLOUD, np.stack([TWIST] * 4), DT),
    "roboloc_reference.velocity.noise": (TWIST, ALPHAS6),
    "roboloc_reference.velocity.range_bearing": (POSE, LANDMARKS[0]),
    "roboloc_reference.velocity.range_bearings": (CLOUD, LANDMARKS),
    "roboloc_reference.velocity.sightings": (POSE.tolist(), LANDMARKS.tolist()),
    "roboloc_reference.velocity.wrap_float": (4.0,),
    "roboloc_reference.velocity_ekf.correct": (POSE, P3, SEEN, LANDMARKS, P2),
    "roboloc_reference.velocity_ekf.predict": (POSE, P3, TWIST, P3, DT),
    "roboloc_reference.verdict.coverage": (RUNS, np.tile(P3, (4, 2, 1, 1)), 0.9),
    "roboloc_reference.verdict.mean_and_error": (CLOUD,),
    "roboloc_reference.verdict.paired_interval": (WEIGHTS, WEIGHTS[::-1] / 2, PICKS, 0.8),
    "roboloc_reference.verdict.rms_errors": (RUNS, RUNS[::-1]),
}

UNCHECKED = {
    "roboloc_reference.ballistic.vertical_motion": "gets floats that its callers have checked",
    "roboloc_reference.gaussian.conditioned": "gets what measurement_update and others have checked",
    "roboloc_reference.gaussian.gain": "gets two products of checked matrices",
    "roboloc_reference.gaussian.symmetric": "gets what was computed from checked matrices",
    "roboloc_reference.motion.arc": "gets floats that its callers have checked",
    "roboloc_reference.velocity.sightings": "gets lists of floats that its callers have checked",
    "roboloc_reference.velocity.wrap_float": "gets a float that was computed from checked ones",
    "roboloc_reference.line_fit.as_beams": "checks two arguments of its callers and returns them",
    "roboloc_reference.line_fit.fit_runs": "gets the beams and variances that its callers have checked",
    "roboloc_reference.landmark_map.as_pairs": "checks an argument of its callers and returns a view of it",
    "roboloc_reference.landmark_map.as_state": "checks an argument of its callers and returns it",
    "roboloc_reference.landmark_map.block_diagonal": "gets the covariance that its callers have checked",
}

# Name of the function, the argument, and what else it may be: "NaN".
ALLOWED = {("roboloc_reference.extraction.extract_lines", "rho", "NaN")}
