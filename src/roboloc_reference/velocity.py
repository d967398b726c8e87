r"""A robot driven by velocities that are never quite what was asked, and a landmark seen by bearing and range.

The control is u = (v, omega, gamma). The robot follows the arc of v and omega for a time dt, and then turns on
the spot by gamma dt: without that third number three errors would have to hide in two, and every pose behind
the arc would be impossible. The control that is asked for has gamma = 0; all three numbers carry noise, which
grows with the speed and with the turning rate:

.. math:: M = \mathrm{diag}(\alpha_1 v^2 + \alpha_2 \omega^2,\; \alpha_3 v^2 + \alpha_4 \omega^2,\;
          \alpha_5 v^2 + \alpha_6 \omega^2).

F and W are the derivatives by the pose and by the control, so a covariance becomes F Sigma F^T + W M W^T. The
arc is the one of :mod:`roboloc_reference.motion` and as accurate for every omega, 0 included.

Source: Michigan ROB530, homework 5, problem 1 (A); its printed W and H are wrong (the second column of W lacks
two terms and a factor, the second row of H is divided by the range once too often).
"""

from math import atan2, hypot, pi, remainder

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import TURN, wrap
from roboloc.validation import as_array, as_floats, as_number
from roboloc_reference.motion import compute_dynamics


def motion(x: ArrayLike, u: ArrayLike, dt: float) -> np.ndarray:
    """Move a pose along the arc of a control, then turn it.

    Parameters
    ----------
    x : (3,) array_like
        Pose x, y, theta [m, m, rad].
    u : (3,) array_like
        Control v, omega, gamma [m/s, rad/s, rad/s].
    dt : float
        Duration of the control [s].

    Returns
    -------
    (3,) ndarray
        Pose at the end [m, m, rad]; the heading is not wrapped.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Notes
    -----
    Source: Michigan ROB530, homework 5, problem 1.

    Examples
    --------
    A quarter circle of radius 1 m to the left ends 1 m ahead and 1 m to the left; the turn gamma brings the
    robot back to its first heading.

    >>> motion([0.0, 0.0, 0.0], [np.pi / 2, np.pi / 2, -np.pi / 2], 1.0).round(12).tolist()
    [1.0, 1.0, 0.0]
    """
    v, omega, gamma = as_floats("u", u, 3)
    dt = as_number("dt", dt)
    g, _, _ = compute_dynamics(as_array("x", x, (3,)), (v, omega), dt)
    g[2] += gamma * dt
    return g


def motions(xs: ArrayLike, us: ArrayLike, dt: float) -> np.ndarray:
    """Move many poses, each by a control of its own: :func:`motion` row by row, without a loop.

    Parameters
    ----------
    xs : (M, 3) array_like
        Poses [m, m, rad].
    us : (M, 3) array_like
        Controls v, omega, gamma [m/s, rad/s, rad/s].
    dt : float
        Duration of the controls [s].

    Returns
    -------
    (M, 3) ndarray
        Poses at the end [m, m, rad]; the headings are not wrapped.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Examples
    --------
    Of two robots that drive 1 m, the one that faces left ends on the left.

    >>> poses = motions([[0.0, 0.0, 0.0], [0.0, 0.0, np.pi / 2]], [[1.0, 0.0, 0.0]] * 2, 1.0)
    >>> poses[:, :2].round(12).tolist()
    [[1.0, 0.0], [0.0, 1.0]]
    """
    xs = as_array("xs", xs, ("M", 3))
    us = as_array("us", us, (len(xs), 3))
    dt = as_number("dt", dt)

    v, omega, gamma = us.T
    h = omega * dt / 2
    sinc = np.ones(len(xs))
    np.divide(np.sin(h), h, out=sinc, where=h != 0)
    chord, phi = v * dt * sinc, xs[:, 2] + h
    moved = xs.copy()
    moved[:, 0] += chord * np.cos(phi)
    moved[:, 1] += chord * np.sin(phi)
    moved[:, 2] += (omega + gamma) * dt
    return moved


def jacobians(x: ArrayLike, u: ArrayLike, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Differentiate the motion.

    Parameters
    ----------
    x : (3,) array_like
        Pose x, y, theta [m, m, rad].
    u : (3,) array_like
        Control v, omega, gamma [m/s, rad/s, rad/s].
    dt : float
        Duration of the control [s].

    Returns
    -------
    F : (3, 3) ndarray
        Derivative of the motion by the pose.
    W : (3, 3) ndarray
        Derivative of the motion by the control.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Notes
    -----
    Source: Michigan ROB530, homework 5, problem 1 (A).

    Examples
    --------
    Driving straight for 2 s at 1 m/s, an error of 0.1 rad/s in omega shows sideways, 0.2 m; the same error in
    gamma, which turns the robot at the end only, does not.

    >>> F, W = jacobians([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 2.0)
    >>> (W @ [0.0, 0.1, 0.0]).round(12).tolist(), (W @ [0.0, 0.0, 0.1]).round(12).tolist()
    ([0.0, 0.2, 0.2], [0.0, 0.0, 0.2])
    """
    v, omega, _ = as_floats("u", u, 3)
    dt = as_number("dt", dt)
    _, F, Gu = compute_dynamics(as_array("x", x, (3,)), (v, omega), dt)
    W = np.zeros((3, 3))
    W[:, :2], W[2, 2] = Gu, dt
    return F, W


def noise(u: ArrayLike, alphas: ArrayLike) -> np.ndarray:
    """Return the covariance of a control.

    Parameters
    ----------
    u : (3,) array_like
        Control v, omega, gamma [m/s, rad/s, rad/s]; gamma adds no noise.
    alphas : (6,) array_like
        Shares of v**2 and omega**2 in the variances of v (first two), omega (next two) and gamma, none negative.

    Returns
    -------
    (3, 3) ndarray
        Covariance M of the control, diagonal.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if an alpha is negative.

    Notes
    -----
    Source: Michigan ROB530, homework 5, problem 1.

    Examples
    --------
    With alpha_1 = 0.01 a speed of 2 m/s is kept to 0.2 m/s, and a robot at rest is certain to be.

    >>> np.sqrt(noise([2.0, 0.0, 0.0], [0.01, 0.0, 0.0, 0.0, 0.0, 0.0])[0, 0]).round(12).item()
    0.2
    >>> noise([0.0, 0.0, 0.0], [0.01] * 6).any().item()
    False
    """
    v, omega, _ = as_floats("u", u, 3)
    a1, a2, a3, a4, a5, a6 = a = as_floats("alphas", alphas, 6)
    if min(a) < 0:
        raise ValueError(f"alphas: expected no negative number, got {min(a)}")
    v2, omega2 = v * v, omega * omega
    M = np.zeros((3, 3))
    M[0, 0], M[1, 1], M[2, 2] = a1 * v2 + a2 * omega2, a3 * v2 + a4 * omega2, a5 * v2 + a6 * omega2
    return M


def range_bearing(x: ArrayLike, landmark: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Predict how a landmark is seen, and differentiate that by the pose.

    Parameters
    ----------
    x : (3,) array_like
        Pose x, y, theta [m, m, rad].
    landmark : (2,) array_like
        Position of the landmark [m].

    Returns
    -------
    z : (2,) ndarray
        Bearing in the robot's frame, in [-pi, pi), and range [rad, m].
    H : (2, 3) ndarray
        Derivative of z by the pose.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if the landmark is where the robot is: it has no
        bearing there.

    Notes
    -----
    Source: Michigan ROB530, homework 5, problem 1 (A).

    Examples
    --------
    A landmark 3 m to the east and 4 m to the north is 5 m away. One metre towards the east takes 0.6 m off that.

    >>> z, H = range_bearing([0.0, 0.0, 0.0], [3.0, 4.0])
    >>> float(z[1]), H[1].tolist()
    (5.0, [-0.6, -0.8, 0.0])
    """
    z, H = sightings(as_floats("x", x, 3), [as_floats("landmark", landmark, 2)])
    return np.array(z), np.array(H)


def sightings(
    x: list[float], landmarks: list[list[float]]
) -> tuple[list[float], list[tuple[float, float, float]]]:
    """Predict how landmarks are seen: :func:`range_bearing`, one below the other, for checked floats.

    Parameters
    ----------
    x : list of 3 float
        Pose x, y, theta [m, m, rad].
    landmarks : list of k lists of 2 float
        Positions of the landmarks [m].

    Returns
    -------
    z : list of 2k float
        Bearing, range, bearing, range, ... [rad, m].
    H : list of 2k tuples of 3 float
        Rows of the derivative of z by the pose.

    Raises
    ------
    ValueError
        If a landmark is where the robot is.

    Examples
    --------
    One landmark 2 m straight behind and one 3 m to the left.

    >>> z, H = sightings([0.0, 0.0, 0.0], [[-2.0, 0.0], [0.0, 3.0]])
    >>> np.round(z, 3).tolist()
    [-3.142, 2.0, 1.571, 3.0]
    """
    px, py, theta = x
    z, H = [], []
    for mx, my in landmarks:
        dx, dy = mx - px, my - py
        r = hypot(dx, dy)
        if r == 0:
            raise ValueError(
                f"landmark: expected a point away from the robot, got the robot's own [{mx}, {my}]"
            )
        c, s = dx / r, dy / r
        z += wrap_float(atan2(dy, dx) - theta), r
        H += (s / r, -c / r, -1.0), (-c, -s, 0.0)
    return z, H


def wrap_float(a: float) -> float:
    """Wrap one angle to [-pi, pi): :func:`roboloc.angles.wrap` for a float, in a hundredth of its time.

    Examples
    --------
    Half a turn to the left is half a turn to the right.

    >>> wrap_float(np.pi) == wrap_float(-np.pi) == -np.pi
    True
    """
    a = remainder(a, TURN)
    return a if a < pi else -pi


def range_bearings(xs: ArrayLike, landmarks: ArrayLike) -> np.ndarray:
    """Predict how every landmark is seen from every pose.

    Parameters
    ----------
    xs : (M, 3) array_like
        Poses [m, m, rad].
    landmarks : (k, 2) array_like
        Positions of the landmarks [m].

    Returns
    -------
    (M, k, 2) ndarray
        Bearings in [-pi, pi) and ranges [rad, m]. Seen from its own place a landmark is straight east.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Examples
    --------
    From the origin and from 2 m further ahead, a landmark in between is seen in front and behind.

    >>> range_bearings([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]], [[1.0, 0.0]])[:, 0].round(6).tolist()
    [[0.0, 1.0], [-3.141593, 1.0]]
    """
    xs = as_array("xs", xs, ("M", 3))
    landmarks = as_array("landmarks", landmarks, ("k", 2))
    dx = landmarks[:, 0] - xs[:, :1]
    dy = landmarks[:, 1] - xs[:, 1:2]
    return np.stack([wrap(np.arctan2(dy, dx) - xs[:, 2:]), np.hypot(dx, dy)], axis=-1)
