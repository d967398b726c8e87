"""Wrong versions of `landmarks.init_landmarks`: a first map that claims too much, or lies elsewhere."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.landmarks import init_landmarks

if TYPE_CHECKING:
    from collections.abc import Callable

_STAGE = "landmarks.init_landmarks"


def _blocks(Sigma: np.ndarray) -> np.ndarray:
    """Tell which entries of a covariance belong to one landmark, or to the pose."""
    owner = np.concatenate([[-1, -1, -1], np.arange(len(Sigma) - 3) // 2])
    return owner[:, None] == owner


def blocks_alone(z: np.ndarray, Q: np.ndarray, pose: np.ndarray, pose_cov: np.ndarray) -> tuple:
    """Keep the blocks on the diagonal alone."""
    x, Sigma = init_landmarks(z, Q, pose, pose_cov)
    return x, np.where(_blocks(Sigma), Sigma, 0.0)


def landmarks_apart(z: np.ndarray, Q: np.ndarray, pose: np.ndarray, pose_cov: np.ndarray) -> tuple:
    """Leave out what two landmarks have in common."""
    x, Sigma = init_landmarks(z, Q, pose, pose_cov)
    keep = _blocks(Sigma)
    keep[:3] = keep[:, :3] = True
    return x, np.where(keep, Sigma, 0.0)


def certain_robot(z: np.ndarray, Q: np.ndarray, pose: np.ndarray, pose_cov: np.ndarray) -> tuple:
    """Give landmarks the noise of their look alone."""
    x, Sigma = init_landmarks(z, Q, pose, np.zeros((3, 3)))
    Sigma[:3, :3] = pose_cov
    return x, Sigma


def one_triangle(z: np.ndarray, Q: np.ndarray, pose: np.ndarray, pose_cov: np.ndarray) -> tuple:
    """Fill the rows of the landmarks and forget the columns."""
    x, Sigma = init_landmarks(z, Q, pose, pose_cov)
    Sigma[:3, 3:] = 0.0
    return x, Sigma


def _made(z: np.ndarray, Q: np.ndarray, pose: np.ndarray, pose_cov: np.ndarray, forms: Callable) -> tuple:
    """Start a map with other forms of a ray and of its two derivatives."""
    k = len(z) // 2
    J, N, x = np.zeros((3 + 2 * k, 3)), np.zeros((3 + 2 * k, 3 + 2 * k)), np.array([*pose, *np.zeros(2 * k)])
    J[:3] = np.eye(3)
    for j in range(k):
        at = slice(3 + 2 * j, 5 + 2 * j)
        ray, J_theta, J_z = forms(z[2 * j], z[2 * j + 1], pose[2])
        x[at], J[at] = pose[:2] + ray, np.column_stack([np.eye(2), J_theta])
        N[at, at] = J_z @ Q @ J_z.T
    return x, J @ pose_cov @ J.T + N


def _right(beta: float, r: float, theta: float) -> tuple:
    """Return the ray from the robot to a landmark, and its derivatives by heading and look."""
    along = np.array([np.cos(theta + beta), np.sin(theta + beta)])
    across = np.array([-along[1], along[0]])
    return r * along, r * across, np.column_stack([r * across, along])


def _ray_in_the_world(beta: float, r: float, _theta: float) -> tuple:
    return _right(beta, r, 0.0)


def _ray_range_first(one: float, two: float, theta: float) -> tuple:
    return _right(two, one, theta)


def _ray_plain_noise(beta: float, r: float, theta: float) -> tuple:
    ray, J_theta, _ = _right(beta, r, theta)
    return ray, J_theta, np.eye(2)


def _ray_short_lever(beta: float, r: float, theta: float) -> tuple:
    ray, J_theta, J_z = _right(beta, r, theta)
    return ray, J_theta, J_z / np.array([r, 1.0])


def _ray_not_turned(beta: float, r: float, theta: float) -> tuple:
    ray, J_theta, J_z = _right(beta, r, theta)
    return ray, 0.0 * J_theta, J_z


def _ray_turned_back(beta: float, r: float, theta: float) -> tuple:
    ray, J_theta, J_z = _right(beta, r, theta)
    return ray, -J_theta, J_z


def bearing_in_the_world(z: np.ndarray, Q: np.ndarray, pose: np.ndarray, pose_cov: np.ndarray) -> tuple:
    """Count bearings from the world's x axis."""
    return _made(z, Q, pose, pose_cov, _ray_in_the_world)


def range_first(z: np.ndarray, Q: np.ndarray, pose: np.ndarray, pose_cov: np.ndarray) -> tuple:
    """Read z as range and bearing."""
    return _made(z, Q, pose, pose_cov, _ray_range_first)


def noise_as_it_is(z: np.ndarray, Q: np.ndarray, pose: np.ndarray, pose_cov: np.ndarray) -> tuple:
    """Add the noise of bearing and range to x and y."""
    return _made(z, Q, pose, pose_cov, _ray_plain_noise)


def bearing_without_lever(z: np.ndarray, Q: np.ndarray, pose: np.ndarray, pose_cov: np.ndarray) -> tuple:
    """Let an error of the bearing move a landmark by a radian for a metre, near or far."""
    return _made(z, Q, pose, pose_cov, _ray_short_lever)


def heading_forgotten(z: np.ndarray, Q: np.ndarray, pose: np.ndarray, pose_cov: np.ndarray) -> tuple:
    """Shift the landmarks with the robot, and do not turn them."""
    return _made(z, Q, pose, pose_cov, _ray_not_turned)


def heading_other_way(z: np.ndarray, Q: np.ndarray, pose: np.ndarray, pose_cov: np.ndarray) -> tuple:
    """Turn the landmarks against the robot."""
    return _made(z, Q, pose, pose_cov, _ray_turned_back)


def look_overwritten(z: np.ndarray, Q: np.ndarray, pose: np.ndarray, pose_cov: np.ndarray) -> tuple:
    """Turn the caller's bearings into directions in place."""
    x, Sigma = init_landmarks(z, Q, pose, pose_cov)
    z[::2] += pose[2]
    return x, Sigma


_LEFT = "The robot is 10 cm further to the left than it believes. Where is each landmark?"
_FAR = "What does 0.1 rad do to a landmark 1 m away, and to one 5 m away?"


def _item(name: str, explanation: str, hint: str, function: Callable[..., tuple]) -> Misconception:
    return Misconception(name, _STAGE, explanation, hint, function)


MISCONCEPTIONS = (
    _item(
        "blocks on the diagonal alone",
        "Pose and landmarks are taken to err independently: all covariances between them are zero. But each landmark "
        "was "
        "placed from the pose, so an error of the pose is in all of them.",
        _LEFT,
        blocks_alone,
    ),
    _item(
        "landmarks independent of each other",
        "The covariance of each landmark with the pose is there, that of two landmarks is not. They were placed by one "
        "robot, whose error they share.",
        _LEFT,
        landmarks_apart,
    ),
    _item(
        "landmarks of a robot without doubt",
        "The landmarks have the noise of their look alone, as if the pose were known. A map is not better known than "
        "the robot that drew it.",
        "Let the look be perfect: how well is the landmark known then?",
        certain_robot,
    ),
    _item(
        "one triangle of the covariance",
        "The rows of the landmarks hold their covariance with the pose, the columns hold zeros. A covariance equals "
        "its transpose.",
        "Compare your Sigma with Sigma.T.",
        one_triangle,
    ),
    _item(
        "bearing from the world's x axis",
        "The heading of the robot is not added to the bearing. What a robot calls ahead depends on where it faces.",
        "The robot turns on its spot and keeps the landmark at bearing 0. Has the landmark moved?",
        bearing_in_the_world,
    ),
    _item(
        "range before bearing",
        "z is read as range and bearing. Some sheets write them in that order; here the bearing comes first.",
        "Read in the docstring in which order z is.",
        range_first,
    ),
    _item(
        "noise of the look not turned into the world",
        "Q is added to the block of the landmark as it is. It is a covariance of an angle and a length, not of x and "
        "y.",
        _FAR,
        noise_as_it_is,
    ),
    _item(
        "bearing noise without the range",
        "An error of the bearing moves the landmark by as many metres as it has radians, however far away it is.",
        _FAR,
        bearing_without_lever,
    ),
    _item(
        "landmarks not turned with the robot",
        "The derivative of a landmark by the heading is zero: the map moves with the robot and does not turn with it.",
        "The robot is turned by 0.1 rad more than it believes. Where is a landmark 5 m ahead?",
        heading_forgotten,
    ),
    _item(
        "landmarks turned against the robot",
        "The derivative of a landmark by the heading has the wrong sign.",
        "The robot is turned to the left more than it believes. On which side of its place in the map is a landmark "
        "ahead?",
        heading_other_way,
    ),
    _item(
        "the caller's bearings turned in place",
        "The heading is added to the bearings in the array that the caller handed over, which holds bearings no "
        "longer.",
        "z[::2] += ... writes into the array that was handed over; what does z[::2] + ... do?",
        look_overwritten,
    ),
)
