r"""Lines seen from a robot: a wall of the map in the frame of the scanner.

A line is a column [alpha, r]: the points p with p . n = r, where n = (cos alpha, sin alpha). So r is the distance
of the origin from the line, measured along the normal n. The scanner sits at (x_cam, y_cam, theta_cam) in the
frame of the robot, which stands at (x, y, theta) in the world. A change of frame turns n by the headings and
moves the origin to the scanner:

.. math::

    h_\alpha &= \alpha - \theta - \theta_{cam} \\
    h_r &= r - (x \cos\alpha + y \sin\alpha) - (x_{cam} \cos\beta + y_{cam} \sin\beta), \quad \beta = \alpha - \theta

with beta the normal in the frame of the robot. Both formulas are smooth in the pose, so that they can be
differentiated; the price is that h_r is negative where the scanner has crossed the line. (alpha, r) and
(alpha + pi, -r) are the same line, and a scan reports the one with r >= 0, so the prediction is normalised after
it is differentiated: r flips, alpha gains pi, and the derivative of r flips with r. At r = 0 both are right, and
the line is left as it is.

Source: Stanford AA274A (2021), problem set 4, problem 1 (iv). Derived in the book, *Lines seen from a robot*; the
tests hold it against SymPy with 50 digits.
"""

from math import cos, sin

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import wrap
from roboloc.validation import as_array, as_floats


def transform_line_to_scanner_frame(
    line: ArrayLike, x: ArrayLike, tf_base_to_camera: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Express a line of the world in the frame of the scanner, and differentiate it by the pose.

    Parameters
    ----------
    line : (2,) array_like
        Line alpha, r in the world [rad, m].
    x : (3,) array_like
        Pose x, y, theta of the robot in the world [m, m, rad].
    tf_base_to_camera : (3,) array_like
        Pose x, y, theta of the scanner in the frame of the robot [m, m, rad].

    Returns
    -------
    h : (2,) ndarray
        The line alpha, r in the frame of the scanner [rad, m]: alpha is not wrapped, r may be negative.
    Hx : (2, 3) ndarray
        Derivative of h by the pose.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Notes
    -----
    Source: Stanford AA274A (2021), problem set 4, problem 1 (iv).

    Examples
    --------
    A wall 3 m ahead is 2 m ahead after driving 1 m; a scanner mounted 0.5 m in front is 1.5 m from it.

    >>> transform_line_to_scanner_frame([0.0, 3.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0])[0].tolist()
    [0.0, 2.0]
    >>> h, Hx = transform_line_to_scanner_frame([0.0, 3.0], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0])
    >>> h.tolist()
    [0.0, 1.5]

    Each centimetre driven towards the wall is a centimetre less.

    >>> (Hx @ [0.01, 0.0, 0.0]).tolist()
    [0.0, -0.01]
    """
    alpha, r = as_floats("line", line, 2)
    x, y, theta = as_floats("x", x, 3)
    x_cam, y_cam, theta_cam = as_floats("tf_base_to_camera", tf_base_to_camera, 3)

    beta = alpha - theta  # the normal in the frame of the robot
    c_alpha, s_alpha = cos(alpha), sin(alpha)
    c_beta, s_beta = cos(beta), sin(beta)

    h = np.array([beta - theta_cam, r - x * c_alpha - y * s_alpha - x_cam * c_beta - y_cam * s_beta])
    Hx = np.array([[0.0, 0.0, -1.0], [-c_alpha, -s_alpha, y_cam * c_beta - x_cam * s_beta]])
    return h, Hx


def normalize_line_parameters(h: ArrayLike, Hx: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Write a line with r >= 0 and alpha in [-pi, pi), and its derivative to match.

    Parameters
    ----------
    h : (2,) array_like
        Line alpha, r [rad, m].
    Hx : (2, n) array_like
        Derivative of h by a state of any size.

    Returns
    -------
    h : (2,) ndarray
        The same line; where r was negative, r has changed sign and alpha has gained pi.
    Hx : (2, n) ndarray
        Derivative of the new h: where r was negative, row 2 has changed sign.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Notes
    -----
    Source: Stanford AA274A (2021), problem set 4, problem 1 (iv).

    Examples
    --------
    A wall -2 m ahead is a wall 2 m behind: a step forward takes it farther away.

    >>> h, Hx = normalize_line_parameters([0.0, -2.0], [[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    >>> h.round(12).tolist(), (Hx @ [0.1, 0.0, 0.0]).tolist()
    ([-3.14159265359, 2.0], [0.0, 0.1])
    """
    alpha, r = as_floats("h", h, 2)
    Hx = np.array(as_array("Hx", Hx, (2, "n")))

    if r < 0:
        alpha, r = alpha + np.pi, -r
        Hx[1] = -Hx[1]
    return np.array([wrap(alpha), abs(r)]), Hx  # abs turns -0 into 0


def compute_predicted_measurements(
    x: ArrayLike, map_lines: ArrayLike, tf_base_to_camera: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Predict every line of a map as the scanner would report it, with the derivatives by the pose.

    All lines at once; equal, line by line, to `transform_line_to_scanner_frame` followed by
    `normalize_line_parameters`.

    Parameters
    ----------
    x : (3,) array_like
        Pose x, y, theta of the robot in the world [m, m, rad].
    map_lines : (2, J) array_like
        Lines alpha, r of the map in the world, one a column [rad, m]. J = 0 gives empty results.
    tf_base_to_camera : (3,) array_like
        Pose x, y, theta of the scanner in the frame of the robot [m, m, rad].

    Returns
    -------
    hs : (2, J) ndarray
        Lines alpha, r in the frame of the scanner, normalised [rad, m].
    Hs : (J, 2, 3) ndarray
        Derivative of each by the pose.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Notes
    -----
    Source: Stanford AA274A (2021), problem set 4, problem 1 (iv).

    Examples
    --------
    In a corridor with walls 1 m to the left and to the right, moving 0.2 m to the left brings one wall to 0.8 m
    and the other to 1.2 m.

    >>> walls = [[np.pi / 2, -np.pi / 2], [1.0, 1.0]]
    >>> hs, Hs = compute_predicted_measurements([0.0, 0.2, 0.0], walls, [0.0, 0.0, 0.0])
    >>> hs[1].round(12).tolist(), Hs[:, 1, 1].tolist()
    ([0.8, 1.2], [-1.0, 1.0])
    """
    x, y, theta = as_floats("x", x, 3)
    alpha, r = as_array("map_lines", map_lines, (2, "J"))
    x_cam, y_cam, theta_cam = as_floats("tf_base_to_camera", tf_base_to_camera, 3)

    beta = alpha - theta
    c_alpha, s_alpha = np.cos(alpha), np.sin(alpha)
    c_beta, s_beta = np.cos(beta), np.sin(beta)
    r = r - x * c_alpha - y * s_alpha - x_cam * c_beta - y_cam * s_beta
    crossed = r < 0
    sign = np.where(crossed, -1.0, 1.0)

    hs = np.array([wrap(beta - theta_cam + np.where(crossed, np.pi, 0.0)), np.abs(r)])
    Hs = np.zeros((r.size, 2, 3))
    Hs[:, 0, 2] = -1.0
    Hs[:, 1, 0] = -sign * c_alpha
    Hs[:, 1, 1] = -sign * s_alpha
    Hs[:, 1, 2] = sign * (y_cam * c_beta - x_cam * s_beta)
    return hs, Hs
