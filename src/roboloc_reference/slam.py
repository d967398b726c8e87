r"""Localization and mapping at once: the lines of the map are part of the state.

The state is the pose followed by the lines, (x, y, theta, alpha_1, r_1, ..., alpha_J, r_J), and its covariance
says what an error of the pose has to do with an error of each line. Walls stand still, so that the motion is that
of the pose beside an identity:

.. math::

    g = \begin{pmatrix} g_{pose} \\ m \end{pmatrix}, \qquad
    G_x = \begin{pmatrix} G_{pose} & 0 \\ 0 & I \end{pmatrix}, \qquad
    G_u = \begin{pmatrix} G_{u,pose} \\ 0 \end{pmatrix}.

A line j is predicted as in localization; new are the derivatives by the line itself, and they need no new
calculation. Robot and wall turned together about the origin of the world, or shifted together along the normal,
show the scanner the same line, so that both sums of derivatives are 0:

.. math::

    \frac{\partial h}{\partial \alpha} - y \frac{\partial h}{\partial x} + x \frac{\partial h}{\partial y}
    + \frac{\partial h}{\partial \theta} = 0, \qquad
    \frac{\partial h}{\partial r} + \cos\alpha \frac{\partial h}{\partial x}
    + \sin\alpha \frac{\partial h}{\partial y} = 0.

The same two motions are why a map made by the robot alone has no place in the world: something must hold it. The
handout fixes the first two lines, which must not be parallel; a map made from nothing is held by a start that is
known, with covariance 0.

A line that is seen for the first time enters by `augment`. In the world it is

.. math::

    \alpha = \alpha_z + \theta_{cam} + \theta, \qquad
    r = r_z + x \cos\alpha + y \sin\alpha + x_{cam} \cos\beta + y_{cam} \sin\beta, \quad
    \beta = \alpha_z + \theta_{cam},

and it inherits the error of the pose, hence a covariance with everything that the pose has one with. Without these
cross-covariances the filter counts the same error as two, and becomes too sure of itself.

Source: Stanford AA274A (2021), problem set 4, problem 2. Derived in the book; the tests hold it against mpmath
with 50 digits.
"""

from math import cos, sin
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from roboloc import filters
from roboloc.validation import as_array, as_floats, as_number
from roboloc_reference import lines
from roboloc_reference.association import compute_innovations, measurement_model
from roboloc_reference.gaussian import measurement_update, transition_update
from roboloc_reference.motion import compute_dynamics


def transition_model(x: ArrayLike, u: ArrayLike, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Move the robot along the arc of a control, leave the lines, and differentiate the result.

    Parameters
    ----------
    x : (3 + 2J,) array_like
        Pose x, y, theta and lines alpha, r of the world, one after another [m, m, rad, rad, m, ...].
    u : (2,) array_like
        Control V, omega [m/s, rad/s].
    dt : float
        Duration of the control [s].

    Returns
    -------
    g : (3 + 2J,) ndarray
        State at the end; neither the heading nor the lines are wrapped.
    Gx : (3 + 2J, 3 + 2J) ndarray
        Derivative of g by the state: the identity but for the pose.
    Gu : (3 + 2J, 2) ndarray
        Derivative of g by the control, 0 for the lines.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Notes
    -----
    Source: Stanford AA274A (2021), problem set 4, problem 2 (i).

    Examples
    --------
    Driving 1 m ahead brings the robot nearer to the wall 3 m ahead, but the wall stays.

    >>> g, Gx, Gu = transition_model([0.0, 0.0, 0.0, 0.0, 3.0], [0.5, 0.0], 2.0)
    >>> g.tolist(), Gu[3:].tolist()
    ([1.0, 0.0, 0.0, 0.0, 3.0], [[0.0, 0.0], [0.0, 0.0]])

    An error of 0.1 rad in the heading is one of 0.1 m sideways on the way, and none of the wall.

    >>> (Gx @ [0.0, 0.0, 0.1, 0.0, 0.0]).tolist()
    [0.0, 0.1, 0.1, 0.0, 0.0]
    """
    x = _as_state(x)
    n = x.size
    g, Gx, Gu = x.copy(), np.eye(n), np.zeros((n, 2))
    g[:3], Gx[:3, :3], Gu[:3] = compute_dynamics(x[:3], u, dt)
    return g, Gx, Gu


def compute_predicted_measurements(
    x: ArrayLike, tf_base_to_camera: ArrayLike, fixed: int = 2
) -> tuple[np.ndarray, np.ndarray]:
    """Predict every line of the state as the scanner would report it, with the derivatives by the state.

    Parameters
    ----------
    x : (3 + 2J,) array_like
        Pose x, y, theta and lines alpha, r of the world, one after another [m, m, rad, rad, m, ...]. J = 0 gives
        empty results.
    tf_base_to_camera : (3,) array_like
        Pose x, y, theta of the scanner in the frame of the robot [m, m, rad].
    fixed : int
        How many lines, counted from the first, are certain: nothing observed is to move them, and the
        derivatives by them are 0. All of them if there are fewer.

    Returns
    -------
    hs : (2, J) ndarray
        Lines alpha, r in the frame of the scanner, normalised [rad, m].
    Hs : (J, 2, 3 + 2J) ndarray
        Derivative of each by the state: by the pose, by the line itself, and 0 elsewhere.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if `fixed` is no whole number or negative.

    Notes
    -----
    The certain lines need a covariance of 0 with everything, themselves included; setting their columns to 0
    then changes nothing, and without it the filter is wrong. Source: Stanford AA274A (2021), problem set 4,
    problem 2 (ii).

    Examples
    --------
    Two walls, 3 m ahead and 2 m to the left of a robot 1 m from the origin. If the wall ahead is 0.1 m farther
    away than thought, so it is seen, and the wall on the left is where it was.

    >>> x, tf = [1.0, 0.0, 0.0, 0.0, 4.0, np.pi / 2, 2.0], [0.0, 0.0, 0.0]
    >>> hs, Hs = compute_predicted_measurements(x, tf, fixed=0)
    >>> hs[1].tolist(), (Hs[:, 1] @ [0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0]).tolist()
    ([3.0, 2.0], [0.1, 0.0])

    Fixed, it cannot be.

    >>> hs, Hs = compute_predicted_measurements(x, tf, fixed=1)
    >>> (Hs[:, 1] @ [0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0]).tolist()
    [0.0, 0.0]
    """
    x = _as_state(x)
    map_lines = x[3:].reshape(-1, 2).T
    fixed = _as_count("fixed", fixed)

    hs, by_pose = lines.compute_predicted_measurements(x[:3], map_lines, tf_base_to_camera)
    J = hs.shape[1]
    Hs = np.zeros((J, 2, x.size))
    Hs[:, :, :3] = by_pose

    j = np.arange(fixed, J)
    alpha, (by_x, by_y, by_theta) = map_lines[0, fixed:, None], np.moveaxis(by_pose[fixed:], 2, 0)
    Hs[j, :, 3 + 2 * j] = x[1] * by_x - x[0] * by_y - by_theta
    Hs[j, :, 4 + 2 * j] = np.rint(-np.cos(alpha) * by_x - np.sin(alpha) * by_y)  # exactly 0 and 1 or -1
    return hs, Hs


def augment(
    x: ArrayLike, Sigma: ArrayLike, z: ArrayLike, Q: ArrayLike, tf_base_to_camera: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Let a line that is seen for the first time enter the state, with all its cross-covariances.

    Parameters
    ----------
    x : (3 + 2J,) array_like
        Pose x, y, theta and lines alpha, r of the world, one after another [m, m, rad, rad, m, ...].
    Sigma : (3 + 2J, 3 + 2J) array_like
        Covariance of the state, symmetric.
    z : (2,) array_like
        The line that is seen: alpha, r in the frame of the scanner [rad, m].
    Q : (2, 2) array_like
        Its covariance, symmetric; its error has nothing to do with that of the state.
    tf_base_to_camera : (3,) array_like
        Pose x, y, theta of the scanner in the frame of the robot [m, m, rad].

    Returns
    -------
    x : (5 + 2J,) ndarray
        The state, unchanged, and the new line, normalised: r >= 0 and alpha in [-pi, pi).
    Sigma : (5 + 2J, 5 + 2J) ndarray
        The covariance, unchanged, and what the new line adds to it: its own, and that with the rest.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Notes
    -----
    Whether the line is new is for the caller to know. Source: Stanford AA274A (2021), problem set 4, problem 2
    (ii), which gives the filter a map to begin with and leaves this out.

    Examples
    --------
    A robot 1 m from the origin, give or take 0.1 m, sees a wall 2 m ahead, give or take 0.01 m. The wall is 3 m
    from the origin, its place is as uncertain as that of the robot, and both are wrong together.

    >>> Sigma, Q = np.diag([0.01, 0.0, 0.0]), np.diag([0.0, 0.0001])
    >>> x, Sigma = augment([1.0, 0.0, 0.0], Sigma, [0.0, 2.0], Q, [0.0, 0.0, 0.0])
    >>> x.tolist(), Sigma[[0, 4], 4].round(12).tolist()
    ([1.0, 0.0, 0.0, 0.0, 3.0], [0.01, 0.0101])
    """
    x = _as_state(x)
    n = x.size
    Sigma = as_array("Sigma", Sigma, (n, n))
    alpha, r = as_floats("z", z, 2)
    Q = as_array("Q", Q, (2, 2))
    x_cam, y_cam, theta_cam = as_floats("tf_base_to_camera", tf_base_to_camera, 3)
    px, py, theta = x[:3].tolist()

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
    by_pose, by_z = slopes[:, :3], slopes[:, 3:]

    own = by_pose @ Sigma[:3, :3] @ by_pose.T + by_z @ Q @ by_z.T
    grown = np.empty((n + 2, n + 2))
    grown[:n, :n] = Sigma
    grown[n:, :n] = by_pose @ Sigma[:3]
    grown[:n, n:] = grown[n:, :n].T
    grown[n:, n:] = (own + own.T) / 2
    return np.concatenate([x, line]), grown


STAGES = MappingProxyType(
    {
        "transition_model": transition_model,
        "transition_update": transition_update,
        "compute_predicted_measurements": compute_predicted_measurements,
        "compute_innovations": compute_innovations,
        "measurement_model": measurement_model,
        "measurement_update": measurement_update,
        "augment": augment,
    }
)
"""The reference stages of SLAM by name."""


class EkfSlam(filters.EkfSlam):
    """EKF SLAM with the reference stages; see :class:`roboloc.filters.EkfSlam`.

    Examples
    --------
    Of a wall believed 2 m ahead and seen 1.9 m ahead, both give or take 10 cm, by a robot that knows where it is,
    it is the wall that moves half way.

    >>> Sigma0, Q = np.diag([0.0, 0.0, 0.0, 0.0, 0.01]), np.diag([0.01, 0.01])
    >>> slam = EkfSlam([0.0, 0.0, 0.0, 0.0, 2.0], Sigma0, np.eye(2), [0.0, 0.0, 0.0], 3.0, fixed=0)
    >>> slam.measurement_update([[0.0], [1.9]], [Q])
    >>> slam.x.round(12).tolist()
    [0.0, 0.0, 0.0, 0.0, 1.95]
    """

    def __init__(
        self,
        x0: ArrayLike,
        Sigma0: ArrayLike,
        R: ArrayLike,
        tf_base_to_camera: ArrayLike,
        g: float,
        fixed: int = 2,
        stages: Any = STAGES,
    ) -> None:
        super().__init__(x0, Sigma0, R, tf_base_to_camera, g, fixed, stages=stages)


def _as_state(x: ArrayLike) -> np.ndarray:
    """Return a pose followed by whole lines as an array, or raise ValueError."""
    x = as_array("x", x, ("3 + 2J",))
    if x.size < 3 or x.size % 2 == 0:
        raise ValueError(f"x: expected shape (3 + 2J,), got shape ({x.size},)")
    return x


def _as_count(name: str, value: int) -> int:
    """Return a whole number that is not negative, or raise ValueError."""
    number = as_number(name, value, minimum=0.0)
    if number != int(number):
        raise ValueError(f"{name}: expected a whole number, got {number}")
    return int(number)
