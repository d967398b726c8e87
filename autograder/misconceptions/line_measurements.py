"""Wrong versions of `compute_predicted_measurements`: of a whole map."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.lines import compute_predicted_measurements

_STAGE = "lines.compute_predicted_measurements"


def first_line_for_all(x: np.ndarray, map_lines: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Use line 0 at every turn of the loop."""
    return compute_predicted_measurements(
        x, np.repeat(map_lines[:, :1], map_lines.shape[1], axis=1), tf_base_to_camera
    )


def last_derivative_for_all(x: np.ndarray, map_lines: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Keep one matrix through the loop, so that every layer shows the last one."""
    hs, Hs = compute_predicted_measurements(x, map_lines, tf_base_to_camera)
    return hs, np.repeat(Hs[-1:], len(Hs), axis=0)


def sorted_by_distance(x: np.ndarray, map_lines: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Sort the lines by their distance from the scanner."""
    hs, Hs = compute_predicted_measurements(x, map_lines, tf_base_to_camera)
    order = np.argsort(hs[1])
    return hs[:, order], Hs[order]


def not_normalized(x: np.ndarray, map_lines: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Transform every line, and leave it at that, but for a wrap."""
    hs, Hs = compute_predicted_measurements(x, map_lines, tf_base_to_camera)
    seen = map_lines[0] - x[2] - tf_base_to_camera[2]
    side = np.where(np.cos(hs[0] - seen) < 0, -1.0, 1.0)
    Hs[:, 1] = side[:, None] * Hs[:, 1]
    return np.array([(seen + np.pi) % (2 * np.pi) - np.pi, side * hs[1]]), Hs


def absolute_value_of_the_map(x: np.ndarray, map_lines: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Take the absolute value of r where a line was crossed, and leave the rest (ERRATA A4)."""
    hs, Hs = compute_predicted_measurements(x, map_lines, tf_base_to_camera)
    seen = map_lines[0] - x[2] - tf_base_to_camera[2]
    side = np.where(np.cos(hs[0] - seen) < 0, -1.0, 1.0)
    Hs[:, 1] = side[:, None] * Hs[:, 1]
    return np.array([(seen + np.pi) % (2 * np.pi) - np.pi, hs[1]]), Hs


def derivatives_not_normalized(x: np.ndarray, map_lines: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Normalise the lines, and keep the derivatives from before."""
    hs, Hs = compute_predicted_measurements(x, map_lines, tf_base_to_camera)
    seen = map_lines[0] - x[2] - tf_base_to_camera[2]
    side = np.where(np.cos(hs[0] - seen) < 0, -1.0, 1.0)
    Hs[:, 1] = side[:, None] * Hs[:, 1]
    return hs, Hs


def map_not_wrapped(x: np.ndarray, map_lines: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Flip the lines, and leave the angles in whatever turn they are."""
    hs, Hs = compute_predicted_measurements(x, map_lines, tf_base_to_camera)
    seen = map_lines[0] - x[2] - tf_base_to_camera[2]
    return np.array([np.where(np.cos(hs[0] - seen) < 0, seen + np.pi, seen), hs[1]]), Hs


def mounting_ignored(x: np.ndarray, map_lines: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Predict what a scanner at the robot's centre would see."""
    return compute_predicted_measurements(x, map_lines, 0 * tf_base_to_camera)


def pose_and_mounting_exchanged(x: np.ndarray, map_lines: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Hand over the pose in the place of the mounting, and the mounting in that of the pose."""
    return compute_predicted_measurements(tf_base_to_camera, map_lines, x)


def map_overwritten(x: np.ndarray, map_lines: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Write the predictions over the caller's map."""
    hs, Hs = compute_predicted_measurements(x, map_lines, tf_base_to_camera)
    map_lines[...] = hs
    return map_lines, Hs


_LOOP = "Print column j of your hs beside what the transform gives for line j alone."
_SIDE = "Take one point of the wall and test it: is x cos(alpha) + y sin(alpha) equal to r, before and after?"
_RANGE = "Print alpha for a line that is far outside one turn, on either side."
_ARRAYS = "An array that is handed over is not copied; which operation makes a new one?"
MISCONCEPTIONS = (
    Misconception(
        "one line for all",
        _STAGE,
        "Every column belongs to the first line of the map: inside the loop, or the indexing, the number of "
        "the line is not used.",
        _LOOP,
        first_line_for_all,
    ),
    Misconception(
        "one derivative for all lines",
        _STAGE,
        "The lines are right, and every layer of Hs shows the derivative of the last line. That happens "
        "where one matrix is made before the loop and written to in it: a list then holds the same matrix "
        "many times.",
        "Where is the matrix made that you put into Hs, before the loop or in it?",
        last_derivative_for_all,
    ),
    Misconception(
        "lines sorted by distance",
        _STAGE,
        "The predictions come in another order than the map. Column j has to belong to line j, or nobody "
        "knows which wall a prediction is of.",
        _LOOP,
        sorted_by_distance,
    ),
    Misconception(
        "predictions not normalised",
        _STAGE,
        "The lines are transformed and not normalised: r is negative where the robot has crossed a line, and "
        "such a prediction never meets its observation.",
        "Which stage comes between the transform and the comparison with a scan?",
        not_normalized,
    ),
    Misconception(
        "bare absolute value of a crossed line",
        _STAGE,
        "Where the robot has crossed a line the sign of r is dropped and nothing else is done. That is "
        "another line, on the opposite side of the scanner.",
        _SIDE,
        absolute_value_of_the_map,
    ),
    Misconception(
        "derivatives not normalised",
        _STAGE,
        "The lines are normalised and their derivatives are those of before: of the two results of the "
        "normalisation one is used.",
        "What does the normalisation return, and which part of it do you keep?",
        derivatives_not_normalized,
    ),
    Misconception(
        "angles not wrapped",
        _STAGE,
        "The angles of the predictions are left in whatever turn they come. A difference of a whole turn to "
        "an observation would be taken for an error.",
        _RANGE,
        map_not_wrapped,
    ),
    Misconception(
        "mounting ignored",
        _STAGE,
        "The predictions are those of a scanner at the robot's centre that looks ahead: tf_base_to_camera is "
        "not used.",
        "Which of the arguments does your function not use?",
        mounting_ignored,
    ),
    Misconception(
        "pose and mounting exchanged",
        _STAGE,
        "The pose of the robot stands in the place of the mounting, and the mounting in that of the pose. "
        "Both have three numbers, and with a scanner at the centre only the heading part of Hs shows it.",
        "Compare the order of the arguments in your call with the order in the docstring.",
        pose_and_mounting_exchanged,
    ),
    Misconception(
        "the caller's map overwritten",
        _STAGE,
        "The predictions are written into map_lines. The map is wrong when the function returns, and the "
        "next prediction starts from it.",
        _ARRAYS,
        map_overwritten,
    ),
)
