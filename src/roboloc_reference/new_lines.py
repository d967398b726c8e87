r"""A line that nobody knew: where it is in the world, and whether it is new at all.

:func:`line_in_world` is the way back from what the scanner sees, with its derivatives: the first half of
:func:`roboloc_reference.slam.augment`. :func:`recognize` decides with two gates: inside the narrow one an observation
is of a known line, outside the wide one it is new, and between the two nothing can be said.

Source: Stanford AA274A (2021), problem set 4, problem 2 (ii), which leaves both out. Derived in the book; the tests
hold them against `slam.augment` and `association.compute_innovations`.
"""

from math import cos, pi, sin

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import wrap
from roboloc.validation import as_array, as_floats, as_number
from roboloc_reference import lines

NEW, DOUBT = -1, -2


def line_in_world(
    z: ArrayLike, x: ArrayLike, tf_base_to_camera: ArrayLike
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Put a line that is seen into the world, and differentiate the result.

    Parameters
    ----------
    z : (2,) array_like
        The line that is seen: alpha, r in the frame of the scanner [rad, m].
    x : (3,) array_like
        Pose x, y, theta of the robot [m, m, rad].
    tf_base_to_camera : (3,) array_like
        Pose x, y, theta of the scanner in the frame of the robot [m, m, rad].

    Returns
    -------
    line : (2,) ndarray
        The line in the world, normalised: r >= 0 and alpha in [-pi, pi).
    by_pose : (2, 3) ndarray
        Its derivative by the pose.
    by_z : (2, 2) ndarray
        Its derivative by the observation.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Examples
    --------
    A robot 1 m from the origin sees a wall 2 m ahead: it is 3 m from the origin. If the robot is in fact 0.1 m
    farther on, so is the wall.

    >>> line, by_pose, by_z = line_in_world([0.0, 2.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    >>> line.tolist(), (by_pose @ [0.1, 0.0, 0.0]).tolist()
    ([0.0, 3.0], [0.0, 0.1])
    """
    alpha, r = as_floats("z", z, 2)
    px, py, theta = as_floats("x", x, 3)
    x_cam, y_cam, theta_cam = as_floats("tf_base_to_camera", tf_base_to_camera, 3)

    beta = alpha + theta_cam  # the normal in the frame of the robot
    alpha = beta + theta
    c_alpha, s_alpha = cos(alpha), sin(alpha)
    c_beta, s_beta = cos(beta), sin(beta)
    turn = py * c_alpha - px * s_alpha
    line = [alpha, r + px * c_alpha + py * s_alpha + x_cam * c_beta + y_cam * s_beta]
    slopes = [  # by the pose, then by z
        [0.0, 0.0, 1.0, 1.0, 0.0],
        [c_alpha, s_alpha, turn, turn + y_cam * c_beta - x_cam * s_beta, 1.0],
    ]
    line, slopes = lines.normalize_line_parameters(line, slopes)
    return line, slopes[:, :3], slopes[:, 3:]


def squared_distances(
    z: ArrayLike, Q: ArrayLike, hs: ArrayLike, Hs: ArrayLike, Sigma: ArrayLike
) -> np.ndarray:
    """Return the squared distance of an observation from each line, under the better of its two names.

    Parameters
    ----------
    z : (2,) array_like
        The observed line alpha, r in the frame of the scanner [rad, m].
    Q : (2, 2) array_like
        Its covariance, symmetric.
    hs : (2, J) array_like
        Predicted lines alpha, r in the frame of the scanner [rad, m].
    Hs : (J, 2, n) array_like
        Their derivatives by the state.
    Sigma : (n, n) array_like
        Covariance of the state, symmetric.

    Returns
    -------
    (J,) ndarray
        Squared distances in units of the covariance of the innovation.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Examples
    --------
    A wall is expected at 2 m, give or take 0.3 m, and seen at 2.5 m, give or take 0.4 m: one standard deviation.

    >>> Q, Sigma = np.diag([1.0, 0.16]), np.diag([0.0, 0.09])
    >>> squared_distances([0.0, 2.5], Q, [[0.0], [2.0]], [np.eye(2)], Sigma).round(12).tolist()
    [1.0]
    """
    z, Q = as_array("z", z, (2,)), as_array("Q", Q, (2, 2))
    hs = as_array("hs", hs, (2, "J"))
    Hs = as_array("Hs", Hs, (hs.shape[1], 2, "n"))
    Sigma = as_array("Sigma", Sigma, (Hs.shape[2], Hs.shape[2]))
    S = Hs @ Sigma @ Hs.transpose(0, 2, 1)
    found = []
    for side, turn in ((1.0, 0.0), (-1.0, pi)):
        v = np.stack([wrap(z[0] + turn - hs[0]), side * z[1] - hs[1]], axis=1)
        whole = S + Q * np.array([[1.0, side], [side, 1.0]])
        found.append(np.sum(v * np.linalg.solve(whole, v[:, :, None])[:, :, 0], axis=1))
    return np.minimum(*found)


def recognize(
    z: ArrayLike, Q: ArrayLike, hs: ArrayLike, Hs: ArrayLike, Sigma: ArrayLike, g: float, newness: float
) -> int:
    """Say which line is seen, or that it is new, or that this is in doubt.

    Parameters
    ----------
    z : (2,) array_like
        The observed line alpha, r in the frame of the scanner [rad, m]; either name of the line will do.
    Q : (2, 2) array_like
        Its covariance, symmetric.
    hs : (2, J) array_like
        Predicted lines alpha, r in the frame of the scanner [rad, m]; J may be 0.
    Hs : (J, 2, n) array_like
        Their derivatives by the state.
    Sigma : (n, n) array_like
        Covariance of the state, symmetric.
    g : float
        Validation gate in standard deviations, not negative.
    newness : float
        How many standard deviations a new line is away from all others, not below g.

    Returns
    -------
    int
        The number of the nearest line if it is within g; -1 if no line is within newness; -2 otherwise.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if a gate is outside its limits.

    Examples
    --------
    A wall is expected at 2 m, give or take 0.1 m, and the scan is exact. Seen at 2.1 m it is this one, at 3 m it is
    another, and at 2.4 m nobody knows.

    >>> known = [[0.0], [2.0]], [np.eye(2)], np.diag([0.01, 0.01])
    >>> [recognize([0.0, r], np.zeros((2, 2)), *known, 3.0, 5.0) for r in (2.1, 3.0, 2.4)]
    [0, -1, -2]
    """
    g = as_number("g", g, minimum=0.0)
    newness = as_number("newness", newness, minimum=g)
    d2 = squared_distances(z, Q, hs, Hs, Sigma)
    least = d2.min(initial=np.inf)
    if least < g * g:
        return int(d2.argmin())
    return DOUBT if least < newness * newness else NEW
