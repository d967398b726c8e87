r"""Motion of a differential-drive robot: state, control, and what their errors become.

The robot drives with forward speed V and turning rate omega, both constant for a time dt, along an arc:

.. math:: \dot x = V \cos\theta, \quad \dot y = V \sin\theta, \quad \dot\theta = \omega.

The integral has omega in the denominator, its derivative by omega has omega squared, and both lose all digits
as omega goes to 0. With the half angle h = omega dt / 2 and the direction of the chord phi = theta + h it is

.. math:: \Delta x = V\,\Delta t\; s(h) \cos\varphi, \quad \Delta y = V\,\Delta t\; s(h) \sin\varphi,
          \quad s(h) = \frac{\sin h}{h},

where s needs no care but at h = 0, and only its derivative s'(h) = (cos h - s) / h is evaluated by a series
where h is small. One formula serves every omega, 0 included; there is no threshold to be chosen.

Source: Stanford AA274A (2021), problem set 4, problem 1 (i) and (ii). Derived in the book, *Motion and the
limit*; the tests hold it against SymPy with 50 digits.
"""

from math import cos, sin

import numpy as np
from numpy.typing import ArrayLike

from roboloc.validation import as_floats, as_number

EPSILON_OMEGA = 1e-3
"""The handout's threshold [rad/s] below which a student may use the limits; nothing here uses it."""

# Up to this h**2 the series of s' is accurate to the last digit, and beyond it the closed form is.
_SERIES_H2 = 0.25


def compute_dynamics(xvec: ArrayLike, u: ArrayLike, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Move a pose along the arc of a control, and differentiate the result.

    Parameters
    ----------
    xvec : (3,) array_like
        Pose x, y, theta [m, m, rad].
    u : (2,) array_like
        Control V, omega [m/s, rad/s].
    dt : float
        Duration of the control [s].

    Returns
    -------
    g : (3,) ndarray
        Pose at the end [m, m, rad]; the heading is not wrapped.
    Gx : (3, 3) ndarray
        Derivative of g by the pose.
    Gu : (3, 2) ndarray
        Derivative of g by the control.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Notes
    -----
    Source: Stanford AA274A (2021), problem set 4, problem 1 (i) and (ii).

    Examples
    --------
    A quarter circle of radius 1 m to the left ends 1 m ahead and 1 m to the left, facing left.

    >>> g, Gx, Gu = compute_dynamics([0.0, 0.0, 0.0], [np.pi / 2, np.pi / 2], 1.0)
    >>> g.round(12).tolist()
    [1.0, 1.0, 1.570796326795]

    Driving straight for 2 s at 1 m/s, an error of 0.1 rad/s in the turning rate shows sideways: 0.2 m.

    >>> g, Gx, Gu = compute_dynamics([0.0, 0.0, 0.0], [1.0, 0.0], 2.0)
    >>> g.tolist(), (Gu @ [0.0, 0.1]).round(12).tolist()
    ([2.0, 0.0, 0.0], [0.0, 0.2, 0.2])
    """
    x, y, theta = as_floats("xvec", xvec, 3)
    V, omega = as_floats("u", u, 2)
    dt = as_number("dt", dt)

    dx, dy, dx_dV, dy_dV, dx_domega, dy_domega = arc(theta, V, omega, dt)
    g = np.array([x + dx, y + dy, theta + omega * dt])
    # NumPy makes an array of a flat list in half the time of nested ones.
    Gx = np.array([1.0, 0.0, -dy, 0.0, 1.0, dx, 0.0, 0.0, 1.0]).reshape(3, 3)
    Gu = np.array([dx_dV, dx_domega, dy_dV, dy_domega, 0.0, dt]).reshape(3, 2)
    return g, Gx, Gu


def arc(theta: float, V: float, omega: float, dt: float) -> tuple[float, float, float, float, float, float]:
    """Return how far an arc leads, and the derivatives of that by V and by omega, for checked floats.

    Parameters
    ----------
    theta : float
        Heading at the start [rad].
    V, omega : float
        Speed and turning rate [m/s, rad/s].
    dt : float
        Duration [s].

    Returns
    -------
    dx, dy, dx_dV, dy_dV, dx_domega, dy_domega : float
        Distances [m] and their derivatives.

    Examples
    --------
    Straight ahead for 2 s at 3 m/s.

    >>> arc(0.0, 3.0, 0.0, 2.0)[:2]
    (6.0, 0.0)
    """
    h = omega * dt / 2
    s = sin(h) / h if h else 1.0
    h2 = h * h
    if h2 > _SERIES_H2:
        ds = (cos(h) - s) / h
    else:  # the Taylor series of s', seven terms
        ds = 1 / 518918400 - h2 / 93405312000
        ds = ds * h2 - 1 / 3991680
        ds = ds * h2 + 1 / 45360
        ds = ds * h2 - 1 / 840
        ds = ds * h2 + 1 / 30
        ds = h * (ds * h2 - 1 / 3)
    c_phi, s_phi = cos(theta + h), sin(theta + h)
    dx_dV, dy_dV = dt * s * c_phi, dt * s * s_phi
    k = V * dt * dt / 2
    dx_domega, dy_domega = k * (ds * c_phi - s * s_phi), k * (ds * s_phi + s * c_phi)
    return V * dx_dV, V * dy_dV, dx_dV, dy_dV, dx_domega, dy_domega
