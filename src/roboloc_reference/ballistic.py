r"""An extended Kalman filter for a bouncing ball: flight, impact, flight again.

The state is px, py, vx, vy: position and velocity, y upwards, the ground at py = 0. In the air the ball falls
freely. At an impact py stays 0 and vy becomes -e vy, with the restitution e; vx does not change. Impacts happen
inside a step, at times that are solved for. With s the speed of the first impact,

.. math:: s = \sqrt{v_y^2 + 2 g p_y}, \qquad t_1 = \frac{v_y + s}{g},

the ball leaves the m-th impact with e^m s, and the flight behind it takes 2 e^m s / g. So the number of impacts
within a step has a closed form, and the state after them too. For e < 1 all flights together take a finite
time, after which the ball lies on the ground.

The Jacobian is more than that of the pieces: an error of the state shifts the time of the impact, so between
the two impacts one ball already rises while the other still falls. What belongs between the two flights is the
saltation matrix, on (py, vy)

.. math:: \Xi = \begin{pmatrix} -e & 0 \\ -(1+e)\,g/v_- & -e \end{pmatrix}

with v_- < 0 the speed of impact, and not the jump's own derivative diag(1, -e). Differentiating the closed form
gives the product of flights and saltations; the tests multiply it out.

Source: Stanford AA274A (2021), problem set 4, extra problem (announced there, not printed); N. J. Kong and others,
*Saltation matrices: the essential tool for linearizing hybrid dynamical systems*.
"""

from math import expm1, floor, inf, log, log1p, sqrt

import numpy as np
from numpy.typing import ArrayLike

from roboloc.validation import as_array, as_floats, as_number
from roboloc_reference.gaussian import measurement_update


def motion(x: ArrayLike, dt: float, gravity: float, restitution: float) -> tuple[np.ndarray, np.ndarray]:
    """Move a ball through flight and impacts, and differentiate the result.

    Parameters
    ----------
    x : (4,) array_like
        State px, py, vx, vy [m, m, m/s, m/s]; a py below the ground counts as 0.
    dt : float
        Duration of the step [s], not negative.
    gravity : float
        Acceleration downwards [m/s^2], positive.
    restitution : float
        Share e of the speed that an impact leaves, in [0, 1].

    Returns
    -------
    g : (4,) ndarray
        State at the end. An impact at that very instant belongs to the next step.
    Gx : (4, 4) ndarray
        Derivative of g by the state. Once the ball lies on the ground, the rows of py and vy are 0.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if dt is negative, gravity not positive, or
        restitution not in [0, 1].

    Notes
    -----
    Source: Stanford AA274A (2021), problem set 4, extra problem.

    Examples
    --------
    Dropped from 5 m with g = 10 m/s^2 a ball needs 1 s to the ground, and with e = 0.5 it is, half a second
    later, at the top of its bounce: a quarter of the height.

    >>> g, Gx = motion([0.0, 5.0, 2.0, 0.0], 1.5, 10.0, 0.5)
    >>> g.tolist()
    [3.0, 1.25, 2.0, 0.0]
    """
    px, py, vx, vy = as_floats("x", x, 4)
    dt = as_number("dt", dt, minimum=0.0)
    gravity = as_number("gravity", gravity)
    if gravity <= 0:
        raise ValueError(f"gravity: expected a number above 0, got {gravity}")
    e = as_number("restitution", restitution, minimum=0.0)
    if e > 1:
        raise ValueError(f"restitution: expected a number not above 1, got {e}")

    py, vy, slope = vertical_motion(max(py, 0.0), vy, dt, gravity, e)
    g = np.array([px + vx * dt, py, vx, vy])
    Gx = np.eye(4)
    Gx[0, 2] = dt
    Gx[1::2, 1::2] = slope[:, :2]
    return g, Gx


def predict(
    x: ArrayLike, Sigma: ArrayLike, dt: float, gravity: float, restitution: float, Q: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Push a belief about the ball through a step, impacts included.

    Parameters
    ----------
    x : (4,) array_like
        Mean px, py, vx, vy [m, m, m/s, m/s].
    Sigma : (4, 4) array_like
        Its covariance, symmetric.
    dt : float
        Duration of the step [s], not negative.
    gravity : float
        Acceleration downwards [m/s^2], positive.
    restitution : float
        Share of the speed that an impact leaves, in [0, 1].
    Q : (4, 4) array_like
        Covariance that the step adds at its end, symmetric; it is not multiplied by dt.

    Returns
    -------
    x : (4,) ndarray
        Predicted mean.
    Sigma : (4, 4) ndarray
        Predicted covariance, exactly symmetric.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or is out of the range that :func:`motion` states.

    Notes
    -----
    Source: Stanford AA274A (2021), problem set 4, extra problem.

    Examples
    --------
    A ball 5 m up, its height known to 0.1 m, is predicted across its impact. Where the old error said higher, the
    new one says lower: the higher ball comes later, and has had less time to rise.

    >>> x, Sigma = predict([0, 5, 0, 0], np.diag([0, 0.01, 0, 0]), 1.1, 10.0, 1.0, np.zeros((4, 4)))
    >>> x.round(12).tolist(), Sigma[1, 1].round(12).item()
    ([0.0, 0.95, 0.0, 9.0], 0.0064)
    """
    Sigma = as_array("Sigma", Sigma, (4, 4))
    Q = as_array("Q", Q, (4, 4))
    g, Gx = motion(x, dt, gravity, restitution)
    predicted = Gx @ Sigma @ Gx.T + Q
    return g, (predicted + predicted.T) / 2


def correct(x: ArrayLike, Sigma: ArrayLike, z: ArrayLike, R: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Condition a belief on an observed position of the ball.

    Parameters
    ----------
    x : (4,) array_like
        Mean px, py, vx, vy [m, m, m/s, m/s].
    Sigma : (4, 4) array_like
        Its covariance, symmetric.
    z : (2,) array_like
        Observed position [m].
    R : (2, 2) array_like
        Covariance of the observation, symmetric, positive definite.

    Returns
    -------
    x : (4,) ndarray
        Corrected mean. Its py may lie below the ground by an error of the observation.
    Sigma : (4, 4) ndarray
        Corrected covariance, exactly symmetric.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if the covariance of the innovation is singular.

    Notes
    -----
    Source: Stanford AA274A (2021), problem set 4, extra problem.

    Examples
    --------
    Expected at 5 m and seen at 6 m, both to 1 m, the ball is half way.

    >>> x, Sigma = correct([0.0, 5.0, 0.0, 0.0], np.eye(4), [0.0, 6.0], np.eye(2))
    >>> x.tolist()
    [0.0, 5.5, 0.0, 0.0]
    """
    x = as_array("x", x, (4,))
    Sigma = as_array("Sigma", Sigma, (4, 4))
    z = as_array("z", z, (2,))
    R = as_array("R", R, (2, 2))
    try:
        return measurement_update(x, Sigma, z - x[:2], R, np.eye(2, 4))
    except ValueError as error:
        raise ValueError("R: expected a covariance that makes S positive definite, got S singular") from error


def vertical_motion(y: float, v: float, dt: float, g: float, e: float) -> tuple[float, float, np.ndarray]:
    """Move the vertical part of a ball, for checked floats.

    Parameters
    ----------
    y : float
        Height [m], not negative.
    v : float
        Speed upwards [m/s].
    dt : float
        Duration of the step [s].
    g : float
        Acceleration downwards [m/s^2].
    e : float
        Restitution, in [0, 1].

    Returns
    -------
    y, v : float
        Height and speed at the end.
    slope : (2, 3) ndarray
        Their derivatives by height, speed and restitution; 0 once the ball lies on the ground.

    Examples
    --------
    Right after an impact at 10 m/s, a restitution greater by 0.1 is a speed greater by 1 m/s.

    >>> _, v, slope = vertical_motion(5.0, 0.0, 1.0 + 1e-9, 10.0, 0.5)
    >>> round(v, 6), (0.1 * slope[1, 2]).round(6).item()
    (5.0, 1.0)
    """
    s = sqrt(v * v + 2 * g * y)
    # The time of the first impact, without cancellation for either sign of v.
    t1 = (v + s) / g if v > 0 else (2 * y / (s - v) if s > 0 else 0.0)
    left = dt - t1
    if left <= 0:
        slope = np.array([[1.0, dt, 0.0], [0.0, 1.0, 0.0]])
        return max(y + (v - g * dt / 2) * dt, 0.0), v - g * dt, slope

    bounces, shares = _bounces(left * g / (2 * s) if s > 0 else inf, e)
    if bounces == 0:
        return 0.0, 0.0, np.zeros((2, 3))
    # After the last impact: a start with speed a s, and tau to go. All three depend on y, v (by s and t1) and e.
    a = e**bounces
    tau = max(left - shares * 2 * s / g, 0.0)
    ds = np.array([g / s, v / s, 0.0])
    da = np.array([0.0, 0.0, bounces * e ** (bounces - 1)])
    dshares = np.array([0.0, 0.0, _shares_slope(bounces - 1, shares, e)])
    dtau = -np.array([1.0 / s, t1 / s, 0.0]) - (2 / g) * (shares * ds + s * dshares)
    speed = a * s - g * tau
    dstart = a * ds + s * da
    slope = np.stack([tau * dstart + speed * dtau, dstart - g * dtau])
    return max((a * s - g * tau / 2) * tau, 0.0), speed, slope


def _bounces(q: float, e: float) -> tuple[int, float]:
    """Count impacts: the first one, and those after it within q flights of its own incoming speed.

    Returns their number, 0 if the ball has come to rest, and the sum e + ... + e^(number - 1): the time from the
    first impact to the last, in such flights.
    """
    if e == 1 and q < inf:
        more = floor(q)
        return 1 + more, float(more)
    if e == 1 or q * (1 - e) >= e:
        return 0, 0.0
    more = floor(log1p(-q * (1 - e) / e) / log(e))
    return 1 + more, -e * expm1(more * log(e)) / (1 - e)


def _shares_slope(k: int, shares: float, e: float) -> float:
    """Return the derivative of shares = e + ... + e^k by e; for e next to 1, where the closed form cancels, at 1."""
    if 1 - e < 1e-7:
        return k * (k + 1) / 2
    return (shares + 1 - (k + 1) * e**k) / (1 - e)
