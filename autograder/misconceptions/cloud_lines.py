"""Wrong versions of `mcl.compute_predicted_measurements`: of what a cloud expects to see."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc.angles import wrap
from roboloc_reference.mcl import compute_predicted_measurements

_STAGE = "mcl.compute_predicted_measurements"


def _raw(xs: np.ndarray, map_lines: np.ndarray, tf: np.ndarray, *, rotated: bool = True) -> tuple:
    """Return angle and signed distance of every line for every particle, (M, J) each."""
    alpha, r = map_lines
    turn = np.exp(1j * xs[:, 2]) if rotated else np.ones(len(xs))
    place = xs[:, 0] + 1j * xs[:, 1] + turn * complex(tf[0], tf[1])
    return alpha - xs[:, 2:] - tf[2], r - (place[:, None] * np.exp(-1j * alpha)).real


def _normal(angle: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    return np.stack([wrap(angle + np.pi * (ahead < 0)), np.abs(ahead)], axis=1)


def scanner_at_the_centre(xs: np.ndarray, map_lines: np.ndarray, tf: np.ndarray) -> np.ndarray:
    """Forget where the scanner sits."""
    return compute_predicted_measurements(xs, map_lines, 0 * tf)


def mounting_not_turned(xs: np.ndarray, map_lines: np.ndarray, tf: np.ndarray) -> np.ndarray:
    """Add the mounting to the pose without turning it."""
    return _normal(*_raw(xs, map_lines, tf, rotated=False))


def signed_distance(xs: np.ndarray, map_lines: np.ndarray, tf: np.ndarray) -> np.ndarray:
    """Leave r negative."""
    angle, ahead = _raw(xs, map_lines, tf)
    return np.stack([wrap(angle), ahead], axis=1)


def bare_absolute(xs: np.ndarray, map_lines: np.ndarray, tf: np.ndarray) -> np.ndarray:
    """Take the absolute value of r alone."""
    angle, ahead = _raw(xs, map_lines, tf)
    return np.stack([wrap(angle), np.abs(ahead)], axis=1)


def not_wrapped(xs: np.ndarray, map_lines: np.ndarray, tf: np.ndarray) -> np.ndarray:
    """Leave the angles in any turn."""
    angle, ahead = _raw(xs, map_lines, tf)
    return np.stack([angle + np.pi * (ahead < 0), np.abs(ahead)], axis=1)


def heading_added(xs: np.ndarray, map_lines: np.ndarray, tf: np.ndarray) -> np.ndarray:
    """Turn the lines with the robot instead of against it."""
    angle, ahead = _raw(xs, map_lines, tf)
    return _normal(angle + 2 * xs[:, 2:] + 2 * tf[2], ahead)


def axes_by_reshape(xs: np.ndarray, map_lines: np.ndarray, tf: np.ndarray) -> np.ndarray:
    """Bring (2, M, J) to (M, 2, J) by reshape."""
    hs = compute_predicted_measurements(xs, map_lines, tf)
    return hs.transpose(1, 0, 2).reshape(hs.shape)


MISCONCEPTIONS = (
    Misconception(
        "scanner at the robot's centre",
        _STAGE,
        "A pose is that of the robot's base, the ranges are counted from the scanner, and for many robots the two"
        " are nearly one place.",
        "What is the third argument for?",
        scanner_at_the_centre,
    ),
    Misconception(
        "mounting not turned with the robot",
        _STAGE,
        "Adding x_cam to x puts the scanner ahead of the robot only while the robot looks along the x axis.",
        "A robot with the scanner 1 m ahead looks along the y axis. Where is the scanner?",
        mounting_not_turned,
    ),
    Misconception(
        "distance left negative",
        _STAGE,
        "The formula is right for the line itself, and gives the other of its two names when it has been crossed."
        " No scanner reports that one.",
        "Which sign has r of a line that particle m has driven across?",
        signed_distance,
    ),
    Misconception(
        "absolute value alone",
        _STAGE,
        "A distance is positive, so np.abs seems enough. The line is then on the other side of the scanner.",
        "In which direction is a wall behind the robot seen?",
        bare_absolute,
    ),
    Misconception(
        "angles not wrapped",
        _STAGE,
        "Differences of three angles look like angles. Some leave the turn in which the scanner reports.",
        "What is the range of alpha after the subtraction?",
        not_wrapped,
    ),
    Misconception(
        "heading added",
        _STAGE,
        "The robot turns by theta, so the line seems to. What it sees turns the other way.",
        "A robot turns to the left. To which side of it does a wall ahead move?",
        heading_added,
    ),
    Misconception(
        "axes exchanged by reshape",
        _STAGE,
        "np.array([alphas, rs]) is (2, M, J), and reshape(M, 2, J) makes the asked shape without complaint. It "
        "does not move axes, it cuts the numbers into new rows.",
        "Print hs[0] for two particles far apart: is all of it the first particle's?",
        axes_by_reshape,
    ),
)
