"""Wrong versions of `slam.compute_predicted_measurements`: of the columns that belong to lines."""

from __future__ import annotations

from typing import TYPE_CHECKING

from autograder.misconceptions.model import Misconception
from roboloc_reference.slam import compute_predicted_measurements

if TYPE_CHECKING:
    import numpy as np

_STAGE = "slam.compute_predicted_measurements"


def padded_with_zeros(x: np.ndarray, tf: np.ndarray, fixed: int = 2) -> tuple:
    """Take the derivative of localization, and zeros for all lines."""
    hs, Hs = compute_predicted_measurements(x, tf, fixed)
    Hs[:, :, 3:] = 0.0
    return hs, Hs


def identity_blocks(x: np.ndarray, tf: np.ndarray, fixed: int = 2) -> tuple:
    """Take r as it is seen not to depend on alpha."""
    hs, Hs = compute_predicted_measurements(x, tf, fixed)
    for j in range(len(Hs)):
        Hs[j, 1, 3 + 2 * j] = 0.0
    return hs, Hs


def lever_reversed(x: np.ndarray, tf: np.ndarray, fixed: int = 2) -> tuple:
    """Take the derivative of r by alpha with the other sign."""
    hs, Hs = compute_predicted_measurements(x, tf, fixed)
    for j in range(len(Hs)):
        Hs[j, 1, 3 + 2 * j] *= -1
    return hs, Hs


def lever_to_the_robot(x: np.ndarray, tf: np.ndarray, fixed: int = 2) -> tuple:
    """Take the lever of the robot's centre for that of the scanner."""
    hs, Hs = compute_predicted_measurements(x, tf, fixed)
    for j in range(fixed, len(Hs)):
        Hs[j, 1, 3 + 2 * j] += Hs[j, 1, 2]
    return hs, Hs


def blocks_not_flipped(x: np.ndarray, tf: np.ndarray, fixed: int = 2) -> tuple:
    """Normalise the line and its derivative by the pose, and not that by the line."""
    hs, Hs = compute_predicted_measurements(x, tf, fixed)
    for j in range(fixed, len(Hs)):
        Hs[j, 1, 3:] *= Hs[j, 1, 4 + 2 * j]
    return hs, Hs


def columns_of_the_first_free(x: np.ndarray, tf: np.ndarray, fixed: int = 2) -> tuple:
    """Put all blocks into the columns of one line."""
    hs, Hs = compute_predicted_measurements(x, tf, fixed)
    for j in range(fixed, len(Hs)):
        block = Hs[j, :, 3 + 2 * j : 5 + 2 * j].copy()
        Hs[j, :, 3:] = 0.0
        Hs[j, :, 3 + 2 * fixed : 5 + 2 * fixed] = block
    return hs, Hs


def counted_without_the_fixed(x: np.ndarray, tf: np.ndarray, fixed: int = 2) -> tuple:
    """Zero as many columns as there are fixed lines, though a line has two."""
    hs, Hs = compute_predicted_measurements(x, tf, 0)
    Hs[:, :, 3 : 3 + fixed] = 0.0
    return hs, Hs


def nothing_fixed(x: np.ndarray, tf: np.ndarray, fixed: int = 2) -> tuple:
    """Never use `fixed`."""
    return compute_predicted_measurements(x, tf, 0 * fixed)


def last_lines_fixed(x: np.ndarray, tf: np.ndarray, fixed: int = 2) -> tuple:
    """Zero the columns of the last lines."""
    hs, Hs = compute_predicted_measurements(x, tf, 0)
    Hs[max(len(Hs) - fixed, 0) :, :, 3:] = 0.0
    return hs, Hs


def fixed_lines_unseen(x: np.ndarray, tf: np.ndarray, fixed: int = 2) -> tuple:
    """Zero the whole derivative of the fixed lines, the columns of the pose too."""
    hs, Hs = compute_predicted_measurements(x, tf, fixed)
    Hs[:fixed] = 0.0
    return hs, Hs


def state_overwritten(x: np.ndarray, tf: np.ndarray, fixed: int = 2) -> tuple:
    """Write the predictions into the caller's state."""
    hs, Hs = compute_predicted_measurements(x, tf, fixed)
    x[3:] = hs.T.ravel()
    return hs, Hs


_NUDGE = "Change one number of a line a little: what does your own hs do? Compare with the column."
_COLUMNS = "Print for each line j which columns of your Hs[j] are not 0."
MISCONCEPTIONS = (
    Misconception(
        "map taken for certain",
        _STAGE,
        "The derivative is that of localization, with zeros for all lines. Whatever is seen then moves the robot, and "
        "the map stays as wrong as it is.",
        _NUDGE,
        padded_with_zeros,
    ),
    Misconception(
        "distance taken not to follow alpha",
        _STAGE,
        "The block of a line is a diagonal one, as if alpha of the map made alpha of the scan and r made r. A wall "
        "that turns about the origin of the world comes nearer to a robot on one side of its foot, and goes away from "
        "one on the other.",
        _NUDGE,
        identity_blocks,
    ),
    Misconception(
        "sign of the derivative by alpha",
        _STAGE,
        "The derivative of the distance by alpha has the wrong sign: the minus of the formula for r, or of the "
        "derivative of the cosine, was lost.",
        _NUDGE,
        lever_reversed,
    ),
    Misconception(
        "lever of the robot's centre",
        _STAGE,
        "The derivative of the distance by alpha is that for a scanner at the robot's centre. It is right where the "
        "scanner sits there, and nowhere else.",
        "Which point has its distance from the wall measured?",
        lever_to_the_robot,
    ),
    Misconception(
        "block of the line not normalised",
        _STAGE,
        "Where the robot has crossed a line, the sign of r changes: the row of r is flipped in the columns of the pose "
        "and not in those of the line.",
        "When do you fill in the block of the line, before the normalisation or after it?",
        blocks_not_flipped,
    ),
    Misconception(
        "all blocks in one place",
        _STAGE,
        "The block of every line stands in the columns of the same line. What is seen of one wall would move another.",
        _COLUMNS,
        columns_of_the_first_free,
    ),
    Misconception(
        "numbers fixed, not lines",
        _STAGE,
        "As many columns are 0 as there are fixed lines. A line has two numbers.",
        _COLUMNS,
        counted_without_the_fixed,
    ),
    Misconception(
        "nothing fixed",
        _STAGE,
        "fixed is not used. With a covariance of 0 for these lines that makes no difference; but then nobody notices "
        "when the covariance is not 0.",
        "Which of the arguments does your function not use?",
        nothing_fixed,
    ),
    Misconception(
        "last lines fixed",
        _STAGE,
        "The columns of the last lines are 0. The certain lines are the first ones.",
        _COLUMNS,
        last_lines_fixed,
    ),
    Misconception(
        "fixed lines teach nothing",
        _STAGE,
        "The whole derivative of the fixed lines is 0, the columns of the pose too. But it is from them that the robot "
        "learns where it is.",
        "What should a robot do that sees a certain wall nearer than predicted?",
        fixed_lines_unseen,
    ),
    Misconception(
        "the caller's lines overwritten",
        _STAGE,
        "The predictions are written into the state. Its lines are then those of the scanner, and the next prediction "
        "starts from them.",
        "An array that is handed over is not copied, and a part of it neither; which operation makes a new one?",
        state_overwritten,
    ),
)
