"""Rigid motions of the plane, SE(2).

A pose ``[x, y, theta]`` is the position and heading of a frame in another frame, and just as well the rigid
motion that carries one to the other. A twist ``[v1, v2, omega]`` is a velocity in the moving frame (forwards,
to the left, counter-clockwise) held for unit time; ``exp`` follows it, ``log`` recovers it. The tangent order
is v1, v2, omega everywhere.

Headings are added, never wrapped, so a robot that has turned twice has a heading of 4 pi; only ``log``, whose
answer is the shortest turn, takes the heading in [-pi, pi). With h = omega / 2 both maps are free of
cancellation: exp needs sin(h) / h alone, log needs h / tan(h) alone.

Source: E. Eade, *Lie Groups for 2D and 3D Transformations*; T. D. Barfoot, *State Estimation for Robotics*,
chapter 8. The half-angle form is derived in the book, *Motion and the limit*.
"""

from math import cos, sin, tan

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import wrap
from roboloc.validation import as_floats


def compose(a: ArrayLike, b: ArrayLike) -> np.ndarray:
    """Return the pose `b`, given in the frame `a`, in the frame of `a`.

    Parameters
    ----------
    a, b : (3,) array_like
        Poses [m, m, rad].

    Returns
    -------
    (3,) ndarray
        The pose a b [m, m, rad], the heading not wrapped.

    Raises
    ------
    ValueError
        If an argument is not three finite numbers.

    Examples
    --------
    At (1, 0) and facing left, one metre ahead is (1, 1).

    >>> compose([1.0, 0.0, np.pi / 2], [1.0, 0.0, 0.0]).round(12).tolist()
    [1.0, 1.0, 1.570796326795]
    """
    ax, ay, atheta = as_floats("a", a, 3)
    bx, by, btheta = as_floats("b", b, 3)
    c, s = cos(atheta), sin(atheta)
    return np.array([ax + c * bx - s * by, ay + s * bx + c * by, atheta + btheta])


def inverse(a: ArrayLike) -> np.ndarray:
    """Return the pose of the outer frame in the frame `a`.

    Parameters
    ----------
    a : (3,) array_like
        Pose [m, m, rad].

    Returns
    -------
    (3,) ndarray
        The pose that composes with `a` to [0, 0, 0].

    Raises
    ------
    ValueError
        If the argument is not three finite numbers.

    Examples
    --------
    A robot 2 m ahead of the door, facing away from it, has the door 2 m behind.

    >>> inverse([2.0, 0.0, 0.0]).tolist()
    [-2.0, 0.0, 0.0]
    """
    x, y, theta = as_floats("a", a, 3)
    c, s = cos(theta), sin(theta)
    return np.array([-c * x - s * y, s * x - c * y, -theta]) + 0.0  # + 0.0 turns -0 into 0


def exp(twist: ArrayLike) -> np.ndarray:
    """Return the pose reached by following a twist for unit time.

    Parameters
    ----------
    twist : (3,) array_like
        Velocity [v1, v2, omega] in the moving frame, times the time [m, m, rad].

    Returns
    -------
    (3,) ndarray
        Pose [m, m, rad], the heading not wrapped.

    Raises
    ------
    ValueError
        If the argument is not three finite numbers.

    Examples
    --------
    A quarter of a circle of radius 1 m to the left ends 1 m ahead and 1 m to the left.

    >>> exp([np.pi / 2, 0.0, np.pi / 2]).round(12).tolist()
    [1.0, 1.0, 1.570796326795]
    """
    v1, v2, omega = as_floats("twist", twist, 3)
    h = omega / 2
    chord = sin(h) / h if h else 1.0
    c, s = chord * cos(h), chord * sin(h)
    return np.array([c * v1 - s * v2, s * v1 + c * v2, omega])


def log(a: ArrayLike) -> np.ndarray:
    """Return the twist whose exponential is the pose `a`.

    Parameters
    ----------
    a : (3,) array_like
        Pose [m, m, rad].

    Returns
    -------
    (3,) ndarray
        Twist [v1, v2, omega] [m, m, rad] with omega in [-pi, pi).

    Raises
    ------
    ValueError
        If the argument is not three finite numbers.

    Examples
    --------
    To come out 1 m ahead and 1 m to the left, facing left, drive a quarter circle: pi / 2 metres.

    >>> log([1.0, 1.0, np.pi / 2]).round(12).tolist()
    [1.570796326795, 0.0, 1.570796326795]
    """
    x, y, theta = as_floats("a", a, 3)
    omega = wrap(theta)
    h = omega / 2
    k = h / tan(h) if h else 1.0
    return np.array([k * x + h * y, k * y - h * x, omega])


def adjoint(a: ArrayLike) -> np.ndarray:
    """Return the matrix that carries a twist of the frame `a` to the outer frame.

    It holds exp(adjoint(a) t) = a exp(t) a^-1 for every twist t.

    Parameters
    ----------
    a : (3,) array_like
        Pose [m, m, rad].

    Returns
    -------
    (3, 3) ndarray
        Acts on twists [v1, v2, omega].

    Raises
    ------
    ValueError
        If the argument is not three finite numbers.

    Examples
    --------
    A robot at (2, 0) that spins at 1 rad/s moves the point that is carried past the origin at -2 m/s in y.

    >>> (adjoint([2.0, 0.0, 0.0]) @ [0.0, 0.0, 1.0]).tolist()
    [0.0, -2.0, 1.0]
    """
    x, y, theta = as_floats("a", a, 3)
    c, s = cos(theta), sin(theta)
    return np.array([[c, -s, y], [s, c, -x], [0.0, 0.0, 1.0]])
