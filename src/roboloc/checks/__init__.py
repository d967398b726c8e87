"""Public checks: say what is right about a student's stage, and what is not yet.

``check(compute_dynamics)`` calls the function and holds it against worked numbers, against laws that every
correct answer obeys, and against itself: a Jacobian must agree with differences of the function's own g. No
answer is stored here, so passing is necessary and not quite sufficient; the graded tests look further. What a
function prints while it is checked is not shown.
"""

from collections.abc import Callable
from typing import Any

from roboloc.checks import (
    association,
    ballistic,
    bootstrap,
    cloud,
    extraction,
    fit,
    gaussian,
    invariant,
    landmark_update,
    landmarks,
    lines,
    mapping,
    motion,
    odometry,
    resampling,
    slam,
    unscented,
    velocity,
    velocity_cloud,
    verdict,
)
from roboloc.checks.report import Check, Item, Report, run, show

__all__ = ["STAGES", "Item", "Report", "check"]

STAGES: dict[str, tuple[Check, ...]] = {
    "motion.compute_dynamics": motion.COMPUTE_DYNAMICS,
    "gaussian.transition_update": gaussian.TRANSITION_UPDATE,
    "lines.transform_line_to_scanner_frame": lines.TRANSFORM,
    "lines.normalize_line_parameters": lines.NORMALIZE,
    "lines.compute_predicted_measurements": lines.PREDICTED,
    "association.compute_innovations": association.COMPUTE_INNOVATIONS,
    "association.measurement_model": association.MEASUREMENT_MODEL,
    "gaussian.measurement_update": gaussian.MEASUREMENT_UPDATE,
    "extraction.line_parameters": fit.PARAMETERS,
    "extraction.line_jacobians": fit.JACOBIANS,
    "extraction.fit_line": fit.FIT,
    "extraction.split": extraction.SPLIT,
    "extraction.merge": extraction.MERGE,
    "extraction.segments": extraction.SEGMENTS,
    "extraction.extract_lines": extraction.EXTRACT,
    "slam.transition_model": slam.TRANSITION,
    "slam.compute_predicted_measurements": slam.PREDICTED,
    "slam.line_in_world": mapping.LINE_IN_WORLD,
    "slam.augment": mapping.AUGMENT,
    "slam.recognize": mapping.RECOGNIZE,
    "odometry.sample_motion": odometry.SAMPLE_MOTION,
    "odometry.bearing_likelihood": odometry.BEARING_LIKELIHOOD,
    "resampling.systematic_resample": resampling.SYSTEMATIC_RESAMPLE,
    "odometry.bootstrap_step": bootstrap.BOOTSTRAP_STEP,
    "ballistic.predict": ballistic.PREDICT,
    "ballistic.correct": ballistic.CORRECT,
    "mcl.transition_model": cloud.TRANSITION,
    "mcl.compute_predicted_measurements": cloud.PREDICTED,
    "mcl.compute_innovations": cloud.INNOVATIONS,
    "mcl.measurement_weights": cloud.WEIGHTS,
    "landmarks.init_landmarks": landmarks.INIT,
    "landmarks.predict": landmarks.PREDICT,
    "landmarks.measurement": landmarks.MEASUREMENT,
    "landmarks.update": landmark_update.UPDATE,
    "landmarks.evaluate": landmark_update.EVALUATE,
    "velocity.motion": velocity.MOTION,
    "velocity.jacobians": velocity.JACOBIANS,
    "velocity.noise": velocity.NOISE,
    "velocity.range_bearing": velocity.RANGE_BEARING,
    "ukf.sigma_points": unscented.SIGMA_POINTS,
    "ukf.predict": unscented.PREDICT,
    "ukf.correct": unscented.CORRECT,
    "particle.predict": velocity_cloud.PREDICT,
    "particle.correct": velocity_cloud.CORRECT,
    "particle.effective_sample_size": velocity_cloud.EFFECTIVE_SAMPLE_SIZE,
    "verdict.rms_errors": verdict.RMS_ERRORS,
    "verdict.coverage": verdict.COVERAGE,
    "verdict.mean_and_error": verdict.MEAN_AND_ERROR,
    "verdict.paired_interval": verdict.PAIRED_INTERVAL,
    "invariant.predict": invariant.PREDICT,
    "invariant.correct": invariant.CORRECT,
}
"""The checks of each stage, in the order in which they are made.

Two stages may bear the same name in two problems: the name alone then means the first of them.
"""


def check(function: Callable, stage: str | None = None) -> Report:
    """Check a stage, show the report, and return it.

    Parameters
    ----------
    function : callable
        The student's function. Whatever it does, the check does not fail because of it: a function that
        raises, or returns nothing, is told so.
    stage : str, optional
        Name of the stage, where the function's own name is another, or where other problems have a stage of
        that name too: ``"lines.compute_predicted_measurements"``.

    Returns
    -------
    Report
        True as a condition when everything is right. In Jupyter it is displayed, elsewhere it is written to
        standard output.

    Examples
    --------
    A robot that never moves obeys the laws of motion, but it gets nowhere.

    >>> import numpy as np
    >>> def compute_dynamics(xvec, u, dt):
    ...     return np.array(xvec), np.eye(3), np.zeros((3, 2))
    >>> report = check(compute_dynamics)  # doctest: +ELLIPSIS
    compute_dynamics: 9 of 16 right
      [right]   returns g (3,), Gx (3, 3), Gu (3, 2)
      [not yet] drives straight ahead
                From x, y, theta = [1, 2, 0] with V, omega = [1.5, 0] for dt = 2 s
                expected g = [4, 2, 0], got [1, 2, 0]
    ...
    >>> bool(report)
    False
    """
    report = _report(function, stage)
    show(report)
    return report


def _report(function: Any, stage: str | None) -> Report:
    name = stage if stage is not None else getattr(function, "__name__", None)
    name = name if isinstance(name, str) else type(function).__name__
    short = name.rsplit(".", 1)[-1]
    if not callable(function):
        got = "None: has its cell been run?" if function is None else f"{type(function).__name__}."
        return Report(
            short, (Item("is a function", passed=False, message=f"Expected a function, got {got}"),)
        )
    known = [known for known in STAGES if known == name or known.endswith(f".{name}")]
    if not known:
        message = f"There is no public check of that name. There are: {', '.join(STAGES)}.\nFor a function of"
        message += f' another name say which stage it is:\ncheck({short}, stage="{next(iter(STAGES))}").'
        return Report(short, (Item("is a known stage", passed=False, message=message),))
    return run(short, function, STAGES[known[0]])
