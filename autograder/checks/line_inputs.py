"""What the hidden checks of *line-measurements* draw and allow: poses and lines, equal forms, rounding.

`any_turn` and `one_turn` say which forms of a line are equal, the tolerances what rounding may cost, and the rest
draws inputs without special values.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.checks.circle import nearest_turn
from roboloc_reference.lines import transform_line_to_scanner_frame

if TYPE_CHECKING:
    from numpy.random import Generator

_ROUNDING = 200 * np.finfo(float).eps
_EDGE = 1e-9  # how far beyond one turn, and how far below 0 m, rounding may lead
_CLEAR = 0.25  # the least sine or cosine of an angle that is drawn [1]
NEAREST = 0.3  # the least distance of a line from the scanner [m]
# Differences of angles are brought into a turn that is cut where no plausible mistake lies, neither 0 nor pi.
_CUT = 2.2


def any_turn(right: dict[str, Any], got: dict[str, Any]) -> dict[str, Any]:
    """Accept the angle of a line in any turn."""
    h = got["h"]
    if h is None:
        return got
    return got | {"h": np.array([nearest_turn(h[0], right["h"][0], _CUT), h[1]])}


def one_turn(right: dict[str, Any], got: dict[str, Any]) -> dict[str, Any]:
    """Accept both ends of the turn [-pi, pi), and where r is 0 both names of a line.

    The outputs are a line (2,) with its derivative (2, n), or lines (2, J) with theirs (J, 2, n).
    """
    (line, slope) = right
    lines, slopes = got[line], got[slope]
    if lines is None:
        return got
    wanted = right[line].reshape(2, -1)
    alpha, r = np.array(lines.reshape(2, -1))
    other = (np.abs(wanted[1]) < _EDGE) & (np.abs(r) < _EDGE) & (np.cos(alpha - wanted[0]) < 0)
    alpha = np.where(other, alpha - math.pi, alpha)
    inside = other | (np.abs(alpha) <= math.pi + _EDGE)
    alpha = np.where(inside, nearest_turn(alpha, wanted[0], _CUT), alpha)
    result = {line: np.array([alpha, np.where(other, -r, r)]).reshape(lines.shape), slope: slopes}
    if slopes is not None:
        rows = np.array(slopes.reshape(-1, *slopes.shape[-2:]))
        rows[other, 1] *= -1
        result[slope] = rows.reshape(slopes.shape)
    return result


def transform_tolerance(line: np.ndarray, x: np.ndarray, tf: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bound the error that rounding may cause in the transform of one line."""
    angles = 1 + abs(line[0]) + abs(x[2]) + abs(tf[2])
    lengths = 1 + abs(line[1]) + np.abs(x[:2]).sum() + np.abs(tf[:2]).sum()
    h = _ROUNDING * angles * np.array([1.0, lengths])
    return h, np.full((2, 3), _ROUNDING * angles * lengths)


def normalize_tolerance(h: np.ndarray, Hx: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bound the error that rounding may cause: of the angle alone."""
    return _ROUNDING * np.array([1 + abs(h[0]), abs(h[1]) + 1]), _ROUNDING * (1 + np.abs(Hx))


def predicted_tolerance(
    x: np.ndarray, map_lines: np.ndarray, tf: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Bound the error that rounding may cause in the prediction of a map."""
    each_line = [transform_tolerance(line, x, tf) for line in map_lines.T]
    hs, Hs = (np.array(part) for part in zip(*each_line, strict=True))
    return hs.T, Hs


def clear(*angles: float) -> bool:
    """Whether no angle is near a multiple of a quarter turn."""
    return all(min(abs(math.sin(a)), abs(math.cos(a))) > _CLEAR for a in angles)


def mounting(rng: Generator, *, turned: bool = True) -> np.ndarray:
    """Draw where the scanner sits: off the centre by unlike amounts, and turned."""
    x_cam, y_cam = rng.permutation([rng.uniform(0.15, 0.3), rng.uniform(0.4, 0.7)]) * rng.choice([-1, 1], 2)
    return np.array([x_cam, y_cam, _clear_angle(rng, 0.9) if turned else 0.0])


def _clear_angle(rng: Generator, largest: float) -> float:
    while not clear(angle := rng.uniform(-largest, largest)):
        pass
    return angle


def pose(rng: Generator) -> np.ndarray:
    """Draw a pose whose coordinates are unlike and not near 0.

    The robot faces between 0.9 and 2.4 to the left of the direction in which it stands, seen from the origin: it can
    then have crossed lines of which the angle, and the angle plus pi, are inside one turn.
    """
    while True:
        xy = rng.permutation([rng.uniform(0.6, 1.2), rng.uniform(1.8, 3.0)]) * rng.choice([-1, 1], 2)
        theta = _clear_angle(rng, 1.4)
        if 0.9 < theta - math.atan2(xy[1], xy[0]) < 2.4:
            return np.array([*xy, theta])


def line_seen_from(rng: Generator, x: np.ndarray, tf: np.ndarray, *, crossed: bool = False) -> np.ndarray:
    """Draw a line of a map, at least 0.2 m from its origin, with the scanner at `tf` on either side of it.

    The angle at which the scanner sees it, with and without a change of side, is inside (-pi, pi).
    """
    while True:
        alpha = rng.uniform(-3.0, 3.0)
        seen = alpha - x[2] - tf[2]
        offset, _ = transform_line_to_scanner_frame([alpha, 0.0], x, tf)
        r = rng.uniform(NEAREST, 3.0) * (-1 if crossed else 1) - offset[1]
        inside = (-3.0 < seen < -0.14) if crossed else abs(seen) < 3.0
        if r > 0.2 and inside and clear(alpha, alpha - x[2], seen):
            return np.array([alpha, r])
