"""Wrong versions of the symbolic answers of *landmark-slam*: a robot that turns first, with its sensor on a mast."""

from __future__ import annotations

import numpy as np

from autograder.checks import mast
from autograder.misconceptions.model import Misconception


def _without(values: dict[str, float], *names: str) -> dict[str, float]:
    return values | dict.fromkeys(names, 0.0)


def _drive_first(values: dict[str, float]) -> np.ndarray:
    step = mast.pose_next(_without(values, "alpha"))
    return step + np.array([[0.0], [0.0], [values["alpha"]]])


def _way_in_the_heading(values: dict[str, float]) -> np.ndarray:
    return mast.pose_next(values) + np.array([[0.0], [0.0], [values["d"] - values["alpha"]]])


def _noise(values: dict[str, float], heading: float) -> np.ndarray:
    """Return the noise of a step, turned by a heading."""
    c, s = np.cos(heading), np.sin(heading)
    L = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return L @ mast.step_cov(values) @ L.T


def _carried(values: dict[str, float]) -> np.ndarray:
    return mast.Sigma_next(_without(values, "sigma_1", "sigma_2", "sigma_3"))


def _noise_before_the_turn(values: dict[str, float]) -> np.ndarray:
    return _carried(values) + _noise(values, values["theta"])


def _noise_in_the_world(values: dict[str, float]) -> np.ndarray:
    return _carried(values) + _noise(values, 0.0)


def _first_error_thrice(values: dict[str, float]) -> np.ndarray:
    return mast.Sigma_next(values | {"sigma_3": values["sigma_1"]})


def _heading_not_carried(values: dict[str, float]) -> np.ndarray:
    return mast.Sigma_next(values | {"d": 0.0})


def _bearing_from_north(values: dict[str, float]) -> np.ndarray:
    ray = values["r"] * np.array([np.cos(values["beta"]), np.sin(values["beta"])])
    return (mast.mast(values)[:2] + ray).reshape(2, 1)


def _no_mast(values: dict[str, float]) -> np.ndarray:
    return mast.l_seen(_without(values, "a"))


def _no_correlation(_values: dict[str, float]) -> np.ndarray:
    return np.zeros((2, 3))


def _shift_alone(values: dict[str, float]) -> np.ndarray:
    return np.eye(2, 3) @ mast.pose_cov(values)


def _mast_without_lever(values: dict[str, float]) -> np.ndarray:
    return mast.cross(_without(values, "a"))


def _difference(values: dict[str, float]) -> tuple[float, float, float]:
    dx, dy = np.array([values["l_x"], values["l_y"]]) - mast.mast(values)[:2]
    return dx, dy, dx * dx + dy * dy


def _look(bearing: float, values: dict[str, float]) -> np.ndarray:
    return np.array([[bearing - values["theta"]], [np.sqrt(_difference(values)[2])]])


def _backwards(values: dict[str, float]) -> np.ndarray:
    dx, dy, _ = _difference(values)
    return _look(np.arctan2(-dy, -dx), values)


def _arguments_exchanged(values: dict[str, float]) -> np.ndarray:
    dx, dy, _ = _difference(values)
    return _look(np.arctan2(dx, dy), values)


def _quotient(values: dict[str, float]) -> np.ndarray:
    dx, dy, _ = _difference(values)
    return _look(np.arctan(dy / dx), values)


def _seen_from_the_robot(values: dict[str, float]) -> np.ndarray:
    return mast.z_mast(_without(values, "a"))


def _range_row_positive(values: dict[str, float]) -> np.ndarray:
    return mast.Hp_mast(values) * [[1.0], [-1.0]]


def _turn_divided(values: dict[str, float]) -> np.ndarray:
    dx, dy, q = _difference(values)
    J = np.array([[dy / q, -dx / q, -1.0 / q], [-dx / np.sqrt(q), -dy / np.sqrt(q), 0.0]])
    return J @ mast.lever(values)


def _no_lever(values: dict[str, float]) -> np.ndarray:
    return mast.look(values)[1]


def _place_for_difference(values: dict[str, float]) -> np.ndarray:
    _, _, q = _difference(values)
    lx, ly = values["l_x"], values["l_y"]
    return np.array([[-ly / q, lx / q], [lx / np.sqrt(q), ly / np.sqrt(q)]])


def _signs_of_the_pose(values: dict[str, float]) -> np.ndarray:
    return -mast.Hl_mast(values)


def _over_the_range(values: dict[str, float]) -> np.ndarray:
    return mast.Hl_mast(values) * [[np.sqrt(_difference(values)[2])], [1.0]]


_ORDER = "Which comes first here, the turn or the drive?"
_DRAW = "Draw a robot that faces up the page, and its error ellipse: which of its axes is up?"
_LEVER = "A robot that turns on its spot: where does the top of its mast go?"
_FROM = "Stand at the mast and point at the landmark: which difference is that?"
MISCONCEPTIONS = (
    Misconception(
        "drive before the turn",
        "mast.pose_next",
        "The robot drives along its old heading. That is the robot of the chapter; this one turns first.",
        _ORDER,
        _drive_first,
    ),
    Misconception(
        "way added to the heading",
        "mast.pose_next",
        "The third row adds the way d to the heading, and not the turn. Metres are no radians.",
        "Which unit has each of the three rows?",
        _way_in_the_heading,
    ),
    Misconception(
        "errors along the heading before the turn",
        "mast.Sigma_next",
        "The errors of the step are turned into the world by the heading before the turn. Along and across are meant "
        "as the robot stands while it drives.",
        _ORDER,
        _noise_before_the_turn,
    ),
    Misconception(
        "errors along the axes of the world",
        "mast.Sigma_next",
        "The variances along and across the way are added to x and y as they are. That holds for a robot that faces "
        "along x, and for no other.",
        _DRAW,
        _noise_in_the_world,
    ),
    Misconception(
        "first error named in the place of the third",
        "mast.Sigma_next",
        "The variance of the heading is that of the error along the way. Three errors have three names.",
        "Which of the three variances has the unit of an angle?",
        _first_error_thrice,
    ),
    Misconception(
        "doubt about the heading stays in the heading",
        "mast.Sigma_next",
        "The doubt about the heading does not reach the place. A robot that drives in a direction it doubts ends at a "
        "place it doubts.",
        "Two robots start at one point and face a little apart. Where are they after a metre?",
        _heading_not_carried,
    ),
    Misconception(
        "bearing counted from the world's x axis",
        "mast.l_seen",
        "The heading is not added to the bearing. A bearing is counted from where the robot faces.",
        "The robot turns on its spot and still sees the landmark at bearing 0. Has the landmark moved?",
        _bearing_from_north,
    ),
    Misconception(
        "landmark seen from the robot's own point",
        "mast.l_seen",
        "The mast is forgotten: bearing and range are counted from the point whose pose is kept.",
        "Where does the sensor stand?",
        _no_mast,
    ),
    Misconception(
        "landmark independent of the robot that saw it",
        "mast.cross",
        "The covariance of landmark and pose is taken to be zero. The place of the landmark was computed from the "
        "pose, so that it is wrong with it.",
        "The robot is 10 cm further to the left than it believes. What is then wrong with the landmark?",
        _no_correlation,
    ),
    Misconception(
        "landmark shifted with the robot and not turned",
        "mast.cross",
        "A doubt about the place of the robot reaches the landmark, a doubt about its heading does not.",
        "The robot is turned by a little. Which way does a landmark go that is r ahead?",
        _shift_alone,
    ),
    Misconception(
        "mast left out of the turn",
        "mast.cross",
        "When the robot turns, the ray turns, but the mast stays where it was.",
        _LEVER,
        _mast_without_lever,
    ),
    Misconception(
        "robot seen from the landmark",
        "mast.z_mast",
        "The difference is taken from the landmark to the sensor. The range does not notice, the bearing is half a "
        "turn off.",
        _FROM,
        _backwards,
    ),
    Misconception(
        "arguments of the arctangent exchanged",
        "mast.z_mast",
        "The arctangent gets x first and y second, and counts from the y axis the wrong way round.",
        "Try a landmark exactly along x: what must the direction be?",
        _arguments_exchanged,
    ),
    Misconception(
        "direction from a quotient",
        "mast.z_mast",
        "The arctangent of a quotient cannot tell a landmark from its mirror image through the sensor.",
        "Which function takes the two numbers apart?",
        _quotient,
    ),
    Misconception(
        "look from the robot's own point",
        "mast.z_mast",
        "The mast is forgotten: bearing and range are those from the point whose pose is kept.",
        _LEVER,
        _seen_from_the_robot,
    ),
    Misconception(
        "root that falls as q grows",
        "mast.Hp_mast",
        "The row of the range has the wrong sign: the derivative of the root of q by q is taken to be negative, or the "
        "minus of the inner derivative is lost.",
        "The robot moves a centimetre towards the landmark. Does the range grow?",
        _range_row_positive,
    ),
    Misconception(
        "turn divided by q with the rest",
        "mast.Hp_mast",
        "A common factor 1/q stands before the matrix, and the entry of the heading was not multiplied by q to make up "
        "for it.",
        "The robot turns by 0.1 rad on its spot. By how much does a bearing change, near and far?",
        _turn_divided,
    ),
    Misconception(
        "turn about the mast",
        "mast.Hp_mast",
        "The column of the heading is that of a sensor on the spot about which the robot turns.",
        _LEVER,
        _no_lever,
    ),
    Misconception(
        "place of the landmark for the difference",
        "mast.Hl_mast",
        "The coordinates of the landmark stand where the difference of landmark and sensor belongs. The two agree only "
        "for a sensor at the origin.",
        "Move robot and landmark together by a metre: may the derivative change?",
        _place_for_difference,
    ),
    Misconception(
        "derivative by the pose once more",
        "mast.Hl_mast",
        "These are the derivatives by the place of the robot. What is seen depends on the difference of two places.",
        "The landmark moves away by a centimetre, and the robot stays. Does the range grow?",
        _signs_of_the_pose,
    ),
    Misconception(
        "bearing over the range and not its square",
        "mast.Hl_mast",
        "The row of the bearing is divided by the range once. An angle is a length across, divided by the distance, "
        "and "
        "the difference is a length already.",
        "Which unit must each entry of the row of the bearing have?",
        _over_the_range,
    ),
)
