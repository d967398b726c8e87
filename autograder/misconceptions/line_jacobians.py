"""Wrong versions of `line_jacobians`: how a line follows an error of one beam, as people write it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception

if TYPE_CHECKING:
    from collections.abc import Callable

_STAGE = "extraction.line_jacobians"


def _local(theta: np.ndarray, rho: np.ndarray, alpha: float, r: float) -> tuple:
    """Return n, t, cosine and sine of all beams, seen from the line."""
    c, s = np.cos(theta - alpha), np.sin(theta - alpha)
    return rho * c - r, rho * s, c, s


def _follow(lever: np.ndarray, n: np.ndarray, t: np.ndarray, step: tuple, size: float) -> np.ndarray:
    """Return how alpha and r follow steps across and along the line."""
    across, along = step
    turn = -(lever * across + n * along) / size
    return np.array([turn, across / len(t) + t.mean() * turn])


def lever_from_the_foot(theta: np.ndarray, rho: np.ndarray, alpha: float, r: float) -> tuple:
    """Take the lever from the foot of the perpendicular, not from the middle of the points."""
    n, t, c, s = _local(theta, rho, alpha, r)
    size = t @ t - n @ n
    return _follow(t, n, t, (-t, rho * c), size), _follow(t, n, t, (c, s), size)


def foot_stays(theta: np.ndarray, rho: np.ndarray, alpha: float, r: float) -> tuple:
    """Let r follow the mean error alone."""
    n, t, c, s = _local(theta, rho, alpha, r)
    lever = t - t.mean()
    size = lever @ lever - n @ n
    by_theta = _follow(lever, n, t, (-t, rho * c), size)
    by_rho = _follow(lever, n, t, (c, s), size)
    by_theta[1], by_rho[1] = -t / len(t), c / len(t)
    return by_theta, by_rho


def incidence_ignored(theta: np.ndarray, rho: np.ndarray, alpha: float, r: float) -> tuple:
    """Let an error of a range go across the wall in full length."""
    n, t, c, _ = _local(theta, rho, alpha, r)
    lever = t - t.mean()
    size = lever @ lever - n @ n
    straight = (np.ones(len(t)), np.zeros(len(t)))
    return _follow(lever, n, t, (-t, rho * c), size), _follow(lever, n, t, straight, size)


def bearing_by_the_range(theta: np.ndarray, rho: np.ndarray, alpha: float, r: float) -> tuple:
    """Let an error of a bearing go across the wall in full length."""
    n, t, c, s = _local(theta, rho, alpha, r)
    lever = t - t.mean()
    size = lever @ lever - n @ n
    return _follow(lever, n, t, (-rho, 0 * rho), size), _follow(lever, n, t, (c, s), size)


def gap_left_out(theta: np.ndarray, rho: np.ndarray, alpha: float, r: float) -> tuple:
    """Take all points to be on the line."""
    _, t, c, s = _local(theta, rho, alpha, r)
    lever = t - t.mean()
    none, size = 0 * t, lever @ lever
    return _follow(lever, none, t, (-t, rho * c), size), _follow(lever, none, t, (c, s), size)


def size_along_alone(theta: np.ndarray, rho: np.ndarray, alpha: float, r: float) -> tuple:
    """Divide by the scatter along the line, without that across it."""
    n, t, c, s = _local(theta, rho, alpha, r)
    lever = t - t.mean()
    size = lever @ lever
    return _follow(lever, n, t, (-t, rho * c), size), _follow(lever, n, t, (c, s), size)


def turn_reversed(theta: np.ndarray, rho: np.ndarray, alpha: float, r: float) -> tuple:
    """Let the line turn to the other side."""
    n, t, c, s = _local(theta, rho, alpha, r)
    lever = t - t.mean()
    size = n @ n - lever @ lever
    return _follow(lever, n, t, (-t, rho * c), size), _follow(lever, n, t, (c, s), size)


def not_a_mean(theta: np.ndarray, rho: np.ndarray, alpha: float, r: float) -> tuple:
    """Let r follow each error in full, as if there were one beam."""
    n, t, c, s = _local(theta, rho, alpha, r)
    lever = t - t.mean()
    size = lever @ lever - n @ n
    by_theta = _follow(lever, n, t, (-t, rho * c), size)
    by_rho = _follow(lever, n, t, (c, s), size)
    by_theta[1] += t / len(t) - t
    by_rho[1] += c - c / len(t)
    return by_theta, by_rho


def rows_exchanged(theta: np.ndarray, rho: np.ndarray, alpha: float, r: float) -> tuple:
    """Put the row of r before that of alpha."""
    n, t, c, s = _local(theta, rho, alpha, r)
    lever = t - t.mean()
    size = lever @ lever - n @ n
    by_theta = _follow(lever, n, t, (-t, rho * c), size)
    return by_theta[::-1], _follow(lever, n, t, (c, s), size)[::-1]


def bearings_overwritten(theta: np.ndarray, rho: np.ndarray, alpha: float, r: float) -> tuple:
    """Turn the caller's bearings into the frame of the line."""
    n, t, c, s = _local(theta, rho, alpha, r)
    theta -= alpha
    lever = t - t.mean()
    size = lever @ lever - n @ n
    return _follow(lever, n, t, (-t, rho * c), size), _follow(lever, n, t, (c, s), size)


def _item(name: str, explanation: str, hint: str, function: Callable[..., tuple]) -> Misconception:
    return Misconception(name, _STAGE, explanation, hint, function)


_MOVE = "Move one beam by a little, fit again, and compare the change of the line with your column."
MISCONCEPTIONS = (
    _item(
        "levers from the foot",
        "The levers are counted from the foot of the perpendicular. The line turns about the middle of the points, "
        "which may be far from there: a piece of wall to the side then seems to have a far better direction.",
        "About which point does the best line turn when only one beam is off?",
        lever_from_the_foot,
    ),
    _item(
        "the foot does not move",
        "r follows the mean error alone. Where the points are beside the foot of the perpendicular, a line that "
        "turns about their middle also changes its distance from the scanner.",
        "Turn a wall a little about a point 4 m beside the foot: what does that do to r?",
        foot_stays,
    ),
    _item(
        "angle of incidence ignored",
        "An error of a range is taken to go across the wall in full length. It goes along the beam, and a beam that "
        "meets the wall at a flat angle moves its point mostly along the wall.",
        "A beam meets a wall at a flat angle and is 1 cm too long: how far from the wall does it end?",
        incidence_ignored,
    ),
    _item(
        "bearing errors across in full",
        "An error of a bearing is taken to move the point across the wall by the range times the error. It moves it "
        "at a right angle to the beam, which for the beam to the foot of the perpendicular is along the wall.",
        "Turn the beam that meets the wall at a right angle by a little: does its point leave the wall?",
        bearing_by_the_range,
    ),
    _item(
        "distances from the line left out",
        "The terms with the points' own distances from the line are left out, as if all were on it. They are small, "
        "but a derivative has them, and rough walls show them.",
        "Which terms of the derivation vanish only where every point is on the line?",
        gap_left_out,
    ),
    _item(
        "scatter along the line alone",
        "The turn is divided by the scatter along the line. What stands there is the determinant of two conditions, "
        "and the scatter across the line is in it too.",
        "Look at the determinant once more: it has two sums.",
        size_along_alone,
    ),
    _item(
        "line turned to the other side",
        "The line turns to the wrong side when a beam is off: the sign of the derivative of alpha is lost on the way "
        "from the two conditions to their solution.",
        _MOVE,
        turn_reversed,
    ),
    _item(
        "sum in the place of a mean",
        "r follows each single error in full. The line goes through the mean point, which each of N beams moves by "
        "an N-th of its error.",
        "Where does the mean of ten numbers go when one of them grows by 1?",
        not_a_mean,
    ),
    _item(
        "row of r first",
        "The rows are exchanged: that of r comes first. A line of this course is alpha, r, and so is its derivative.",
        "Which row has entries in rad per rad, and which in m per rad?",
        rows_exchanged,
    ),
    _item(
        "bearings turned in place",
        "The function subtracts alpha from the caller's bearings. In Python an array that is handed over is not "
        "copied: the next function gets the turned ones.",
        "An array that is handed over is not copied; which operation makes a new one?",
        bearings_overwritten,
    ),
)
