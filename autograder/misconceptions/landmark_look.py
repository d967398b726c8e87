"""Wrong versions of `landmarks.measurement`: bearing, range and their derivatives as people write them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.landmarks import measurement

if TYPE_CHECKING:
    from collections.abc import Callable

_STAGE = "landmarks.measurement"


def _delta(x: np.ndarray, j: int) -> tuple[float, float, float]:
    """Return landmark minus robot, and the square of its length."""
    dx, dy = x[3 + 2 * j] - x[0], x[4 + 2 * j] - x[1]
    return dx, dy, dx * dx + dy * dy


def _one_turn(angle: float) -> float:
    """Return an angle in [-pi, pi)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def _slopes(dx: float, dy: float, q: float) -> tuple[np.ndarray, np.ndarray]:
    """Return both derivatives of a difference."""
    s = np.sqrt(q)
    Hl = np.array([[-dy / q, dx / q], [dx / s, dy / s]])
    return np.column_stack([-Hl, [-1.0, 0.0]]), Hl


def pose_minus_landmark(x: np.ndarray, j: int) -> tuple:
    """Take the difference the other way round."""
    dx, dy, q = _delta(x, j)
    z = np.array([_one_turn(np.arctan2(-dy, -dx) - x[2]), np.sqrt(q)])
    return z, *_slopes(-dx, -dy, q)


def arguments_exchanged(x: np.ndarray, j: int) -> tuple:
    """Give the arctangent x first."""
    dx, dy, q = _delta(x, j)
    z = np.array([_one_turn(np.arctan2(dx, dy) - x[2]), np.sqrt(q)])
    return z, *_slopes(dx, dy, q)


def quotient(x: np.ndarray, j: int) -> tuple:
    """Take the arctangent of a quotient."""
    dx, dy, q = _delta(x, j)
    z = np.array([_one_turn(np.arctan(dy / dx) - x[2]), np.sqrt(q)])
    return z, *_slopes(dx, dy, q)


def direction_in_the_world(x: np.ndarray, j: int) -> tuple:
    """Leave the heading out, in the bearing and in its derivative."""
    dx, dy, q = _delta(x, j)
    Hp, Hl = _slopes(dx, dy, q)
    Hp[0, 2] = 0.0
    return np.array([np.arctan2(dy, dx), np.sqrt(q)]), Hp, Hl


def not_wrapped(x: np.ndarray, j: int) -> tuple:
    """Leave the bearing in the turn in which it comes out."""
    dx, dy, q = _delta(x, j)
    return np.array([np.arctan2(dy, dx) - x[2], np.sqrt(q)]), *_slopes(dx, dy, q)


def falling_root(x: np.ndarray, j: int) -> tuple:
    """Differentiate the root with the wrong sign, by the pose."""
    z, Hp, Hl = measurement(x, j)
    return z, Hp * np.array([[1.0], [-1.0]]), Hl


def turn_divided(x: np.ndarray, j: int) -> tuple:
    """Leave the common factor before the entry of the heading."""
    z, Hp, Hl = measurement(x, j)
    return z, Hp / np.array([[1.0, 1.0, z[1] ** 2], [1.0, 1.0, 1.0]]), Hl


def over_the_range(x: np.ndarray, j: int) -> tuple:
    """Divide the row of the bearing by the range once."""
    z, Hp, Hl = measurement(x, j)
    Hp[0, :2] *= z[1]
    Hl[0] *= z[1]
    return z, Hp, Hl


def place_for_difference(x: np.ndarray, j: int) -> tuple:
    """Put the landmark's place where the difference belongs, by the landmark."""
    z, Hp, _ = measurement(x, j)
    _, _, q = _delta(x, j)
    return z, Hp, _slopes(x[3 + 2 * j], x[4 + 2 * j], q)[1]


def same_signs(x: np.ndarray, j: int) -> tuple:
    """Take the derivative by the landmark for that by the place of the robot."""
    z, Hp, _ = measurement(x, j)
    return z, Hp, Hp[:, :2]


def range_first(x: np.ndarray, j: int) -> tuple:
    """Return range and bearing in that order."""
    z, Hp, Hl = measurement(x, j)
    return z[::-1], Hp[::-1], Hl[::-1]


def squared_range(x: np.ndarray, j: int) -> tuple:
    """Forget the root, in the range and in its derivative."""
    z, Hp, Hl = measurement(x, j)
    r = z[1]
    return np.array([z[0], r * r]), Hp * np.array([[1.0], [2.0 * r]]), Hl * np.array([[1.0], [2.0 * r]])


def counted_by_numbers(x: np.ndarray, j: int) -> tuple:
    """Begin landmark j one number after the one before it."""
    shifted = np.concatenate([x[:3], x[3 + j : 5 + j]])
    return measurement(shifted, 0)


def robot_at_the_origin(x: np.ndarray, j: int) -> tuple:
    """Move the caller's landmarks into a frame at the robot."""
    found = measurement(x, j)
    x[3::2] -= x[0]
    x[4::2] -= x[1]
    return found


_AHEAD = "Put a landmark 2 m along x and 1 m along y from the robot: what are bearing and range, by hand?"
_NUDGE = (
    "Move the robot by a centimetre towards the landmark, and to its side. What changes, and by how much?"
)


def _item(name: str, explanation: str, hint: str, function: Callable[..., tuple]) -> Misconception:
    return Misconception(name, _STAGE, explanation, hint, function)


MISCONCEPTIONS = (
    _item(
        "pose minus landmark",
        "The difference is taken from the landmark to the robot. The range does not notice; the bearing points the "
        "other way, and the derivatives change their signs.",
        "Stand at the robot and point at the landmark: which difference is that?",
        pose_minus_landmark,
    ),
    _item(
        "arctangent with x first",
        "np.arctan2 takes y first. With the arguments exchanged it counts from the y axis, clockwise.",
        _AHEAD,
        arguments_exchanged,
    ),
    _item(
        "arctangent of a quotient",
        "The arctangent of a quotient cannot tell a landmark from its mirror image through the robot.",
        "Try landmarks on all four sides. Which function takes the two numbers apart?",
        quotient,
    ),
    _item(
        "direction in the world",
        "The heading is not subtracted: this is the direction of the landmark on the map, and it does not change "
        "when the robot turns.",
        "The robot turns to the left by 0.1 rad. What happens to the bearing?",
        direction_in_the_world,
    ),
    _item(
        "bearing not wrapped",
        "The bearing is the difference of two angles and may come out beyond half a turn. A heading that has gone "
        "through several laps makes it worse.",
        "A landmark just behind the robot: compare the bearing on its left with that on its right.",
        not_wrapped,
    ),
    _item(
        "range that grows as one comes nearer",
        "The row of the range has the wrong sign by the pose: the derivative of the root is taken to be negative, or "
        "the minus of the inner derivative is lost.",
        _NUDGE,
        falling_root,
    ),
    _item(
        "common factor left before the heading",
        "A factor of 1/q was taken out of the matrix, and the entry of the heading was not multiplied by q to make "
        "up for it.",
        "The robot turns by 0.1 rad on its spot. By how much does the bearing change, near and far?",
        turn_divided,
    ),
    _item(
        "bearing over the range once",
        "The row of the bearing is divided by the range, not by its square. The difference is a length already; a "
        "bearing changes by a length across over a distance.",
        "Twice as far away, how much less does the bearing change for a step of 1 cm across? Try it with your numbers.",
        over_the_range,
    ),
    _item(
        "landmark for the difference",
        "The derivative by the landmark has the landmark's own coordinates where the difference to the robot "
        "belongs. They agree for a robot at the origin alone.",
        "Move robot and landmark together by a metre: may any derivative change?",
        place_for_difference,
    ),
    _item(
        "signs of the pose in Hl",
        "The derivative by the landmark is that by the robot's place. What is seen depends on their difference.",
        "The landmark moves away by a centimetre and the robot stays. Does the range grow?",
        same_signs,
    ),
    _item(
        "range in the first row",
        "Range and bearing come in the other order. Some sheets write them so; here the bearing is the first row.",
        "Read in the docstring in which order z is.",
        range_first,
    ),
    _item(
        "square of the range",
        "The root is forgotten: q is the square of the range, in m^2, and its derivative grows with the range.",
        _AHEAD,
        squared_range,
    ),
    _item(
        "landmarks counted by numbers",
        "Landmark j is taken to begin j numbers after the pose. Each landmark has two numbers; the first one comes "
        "out right, the others are made of halves.",
        "Write the indices of x for three landmarks on paper.",
        counted_by_numbers,
    ),
    _item(
        "the caller's landmarks moved to the robot",
        "The place of the robot is subtracted from the landmarks in the array that the caller handed over.",
        "x[3::2] -= ... writes into the array that was handed over. Take new names for the differences.",
        robot_at_the_origin,
    ),
)
