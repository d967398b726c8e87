"""Wrong versions of `slam.recognize`: of whether a line is known, new, or neither."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception

_STAGE = "slam.recognize"


def _decide(d2: np.ndarray, near: float, far: float) -> int:
    """Decide by two thresholds."""
    if not len(d2):
        return -1
    if d2.min() < near:
        return int(np.argmin(d2))
    return -2 if d2.min() < far else -1


def _off(z: np.ndarray, hs: np.ndarray, side: float, wrap: bool) -> np.ndarray:
    """Return the differences from all lines, under one name of the observation."""
    v = np.array([z[0] + (side < 0) * np.pi - hs[0], side * z[1] - hs[1]]).T
    if wrap:
        v[:, 0] = (v[:, 0] + np.pi) % (2 * np.pi) - np.pi
    return v


def _squared(
    z: np.ndarray, Q: np.ndarray, hs: np.ndarray, S: np.ndarray, wrap: bool, both: bool
) -> np.ndarray:
    """Return the squared distances from all lines; S is without Q."""
    found = []
    for side in (1.0, -1.0) if both else (1.0,):
        v = _off(z, hs, side, wrap)
        whole = S + Q * np.array([[1.0, side], [side, 1.0]])
        found.append(np.sum(v * np.linalg.solve(whole, v[:, :, None])[:, :, 0], axis=1))
    return np.min(found, axis=0)


def _spread(Hs: np.ndarray, Sigma: np.ndarray) -> np.ndarray:
    return Hs @ Sigma @ np.swapaxes(Hs, 1, 2)


def gates_not_squared(z, Q, hs, Hs, Sigma, g, newness) -> int:  # noqa: ANN001 - as in the stage
    """Compare the squared distance with the gates themselves."""
    return _decide(_squared(z, Q, hs, _spread(Hs, Sigma), True, True), g, newness)


def one_gate(z, Q, hs, Hs, Sigma, g, newness) -> int:  # noqa: ANN001, ARG001 - as in the stage
    """Take whatever is outside the narrow gate for new."""
    return _decide(_squared(z, Q, hs, _spread(Hs, Sigma), True, True), g**2, g**2)


def wide_gate(z, Q, hs, Hs, Sigma, g, newness) -> int:  # noqa: ANN001, ARG001 - as in the stage
    """Take whatever is not new for known."""
    return _decide(_squared(z, Q, hs, _spread(Hs, Sigma), True, True), newness**2, newness**2)


def map_taken_for_certain(z, Q, hs, Hs, Sigma, g, newness) -> int:  # noqa: ANN001 - as in the stage
    """Measure the distance by the error of the observation alone."""
    return _decide(_squared(z, Q, hs, 0 * _spread(Hs, Sigma), True, True), g**2, newness**2)


def scan_taken_for_exact(z, Q, hs, Hs, Sigma, g, newness) -> int:  # noqa: ANN001 - as in the stage
    """Measure the distance by the error of the belief alone."""
    return _decide(_squared(z, 0 * Q, hs, _spread(Hs, Sigma), True, True), g**2, newness**2)


def angle_not_wrapped(z, Q, hs, Hs, Sigma, g, newness) -> int:  # noqa: ANN001 - as in the stage
    """Leave the difference of the angles in whatever turn it comes."""
    return _decide(_squared(z, Q, hs, _spread(Hs, Sigma), False, True), g**2, newness**2)


def one_name(z, Q, hs, Hs, Sigma, g, newness) -> int:  # noqa: ANN001 - as in the stage
    """Ask for the observation under the name that it has."""
    return _decide(_squared(z, Q, hs, _spread(Hs, Sigma), True, False), g**2, newness**2)


def first_inside(z, Q, hs, Hs, Sigma, g, newness) -> int:  # noqa: ANN001 - as in the stage
    """Take the first line inside the gate."""
    d2 = _squared(z, Q, hs, _spread(Hs, Sigma), True, True)
    inside = np.flatnonzero(d2 < g**2)
    return int(inside[0]) if len(inside) else _decide(d2, 0.0, newness**2)


_PRINT = "Print the squared distances beside both gates."
MISCONCEPTIONS = (
    Misconception(
        "gates not squared",
        _STAGE,
        "A squared distance is compared with the gates themselves. The gates are standard deviations.",
        _PRINT,
        gates_not_squared,
    ),
    Misconception(
        "one gate for both",
        _STAGE,
        "Whatever is not within the narrow gate is new. A right observation is outside it once in some dozens of "
        "times, and each time the same wall would enter the map again.",
        "What becomes of an observation between the two gates?",
        one_gate,
    ),
    Misconception(
        "never in doubt",
        _STAGE,
        "Whatever is not new is taken for known, up to the wide gate. The narrow one is there to keep wrong pairs out.",
        "What becomes of an observation between the two gates?",
        wide_gate,
    ),
    Misconception(
        "belief taken for certain",
        _STAGE,
        "The distance is measured by the error of the observation alone. A robot that is lost would take every wall "
        "for a new one.",
        "Of which two parts does the covariance of an innovation consist?",
        map_taken_for_certain,
    ),
    Misconception(
        "scan taken for exact",
        _STAGE,
        "The distance is measured by the error of the belief alone: Q is not used.",
        "Of which two parts does the covariance of an innovation consist?",
        scan_taken_for_exact,
    ),
    Misconception(
        "difference of angles not wrapped",
        _STAGE,
        "The difference of two angles is left in whatever turn it comes. A wall behind the robot, seen at -3.1 and "
        "expected at 3.1, would be new.",
        "Print the difference of the angles for a wall behind the robot.",
        angle_not_wrapped,
    ),
    Misconception(
        "one name asked for",
        _STAGE,
        "The observation is compared under one name. A line nearly through the scanner may be seen from either side of "
        "it, and would enter the map a second time.",
        "Which other pair of numbers is the same line?",
        one_name,
    ),
    Misconception(
        "first line inside the gate",
        _STAGE,
        "The first line inside the gate is taken. There may be a nearer one behind it.",
        _PRINT,
        first_inside,
    ),
)
