r"""A bouncing ball that is not known: the restitution is part of the state.

How much of its speed a ball keeps at an impact cannot be seen while it flies. After an impact it can: the ball
rises as fast, and as high, as e says. So the filter of :mod:`roboloc_reference.ballistic` gets a fifth number, which
the motion leaves alone; all that is new is the column of the Jacobian that says what e does to height and speed.

.. math:: G = \begin{pmatrix} G_x & \partial g / \partial e \\ 0 & 1 \end{pmatrix}

After n impacts the ball starts with speed e^n s, and the last impact was e + ... + e^(n-1) flights after the first,
each of 2 s / g. Both change with e, so the more impacts lie behind, the sharper e shows. Before the first impact the
column is 0, and no observation says anything about e.

Source: an extension of Stanford AA274A (2021), problem set 4, extra problem; the enlarged state is that of any book
on the extended Kalman filter, for example A. Gelb (ed.), *Applied Optimal Estimation*, section 9.4.
"""

import numpy as np
from numpy.typing import ArrayLike

from roboloc.validation import as_array, as_floats, as_number
from roboloc_reference.ballistic import vertical_motion
from roboloc_reference.gaussian import conditioned, symmetric


def motion(x: ArrayLike, dt: float, gravity: float) -> tuple[np.ndarray, np.ndarray]:
    """Move a ball through flight and impacts, and differentiate the result.

    Parameters
    ----------
    x : (5,) array_like
        State px, py, vx, vy, e [m, m, m/s, m/s, 1]; a py below the ground counts as 0, and an e outside [0, 1] as
        the nearest inside.
    dt : float
        Duration of the step [s], not negative.
    gravity : float
        Acceleration downwards [m/s^2], positive.

    Returns
    -------
    g : (5,) ndarray
        State at the end; e is what it was.
    G : (5, 5) ndarray
        Derivative of g by the state.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if dt is negative, or gravity not positive.

    Examples
    --------
    Dropped from 5 m with g = 10 m/s^2, a ball of e = 0.5 is on its way up 0.1 s after its impact. With e = 0.6 it
    would be a decimetre higher and a metre per second faster.

    >>> g, G = motion([0.0, 5.0, 0.0, 0.0, 0.5], 1.1, 10.0)
    >>> g.round(12).tolist()
    [0.0, 0.45, 0.0, 4.0, 0.5]
    >>> (0.1 * G[:, 4]).round(12).tolist()
    [0.0, 0.1, 0.0, 1.0, 0.1]
    """
    px, py, vx, vy, e = as_floats("x", x, 5)
    dt = as_number("dt", dt, minimum=0.0)
    gravity = as_number("gravity", gravity)
    if gravity <= 0:
        raise ValueError(f"gravity: expected a number above 0, got {gravity}")

    py, vy, slope = vertical_motion(max(py, 0.0), vy, dt, gravity, min(max(e, 0.0), 1.0))
    G = np.eye(5)
    G[0, 2] = dt
    G[np.ix_([1, 3], [1, 3, 4])] = slope
    return np.array([px + vx * dt, py, vx, vy, e]), G


def predict(
    x: ArrayLike, Sigma: ArrayLike, dt: float, gravity: float, Q: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Push a belief about ball and restitution through a step.

    Parameters
    ----------
    x : (5,) array_like
        Mean px, py, vx, vy, e [m, m, m/s, m/s, 1].
    Sigma : (5, 5) array_like
        Its covariance, symmetric.
    dt : float
        Duration of the step [s], not negative.
    gravity : float
        Acceleration downwards [m/s^2], positive.
    Q : (5, 5) array_like
        Covariance that the step adds at its end, symmetric; it is not multiplied by dt.

    Returns
    -------
    x : (5,) ndarray
        Predicted mean.
    Sigma : (5, 5) ndarray
        Predicted covariance, exactly symmetric.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or is out of the range that :func:`motion` states.

    Examples
    --------
    All is certain but e, 0.5 give or take 0.1: 0.1 s after an impact at 10 m/s the height is open to 0.1 m.

    >>> x, Sigma = predict([0, 5, 0, 0, 0.5], np.diag([0, 0, 0, 0, 0.01]), 1.1, 10.0, np.zeros((5, 5)))
    >>> np.sqrt(np.diag(Sigma)).round(12).tolist()
    [0.0, 0.1, 0.0, 1.0, 0.1]
    """
    Sigma = as_array("Sigma", Sigma, (5, 5))
    Q = as_array("Q", Q, (5, 5))
    g, G = motion(x, dt, gravity)
    return g, symmetric(G @ Sigma @ G.T + Q)


def correct(x: ArrayLike, Sigma: ArrayLike, z: ArrayLike, R: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Condition a belief about ball and restitution on an observed position.

    Parameters
    ----------
    x : (5,) array_like
        Mean px, py, vx, vy, e [m, m, m/s, m/s, 1].
    Sigma : (5, 5) array_like
        Its covariance, symmetric.
    z : (2,) array_like
        Observed position [m].
    R : (2, 2) array_like
        Covariance of the observation, symmetric, positive definite.

    Returns
    -------
    x : (5,) ndarray
        Corrected mean.
    Sigma : (5, 5) ndarray
        Corrected covariance, exactly symmetric.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if the covariance of the innovation is singular.

    Examples
    --------
    The ball is seen 0.1 m higher than expected, and if only e can be to blame, e was too small by 0.1.

    >>> x, Sigma = predict([0, 5, 0, 0, 0.5], np.diag([0, 0, 0, 0, 0.01]), 1.1, 10.0, np.zeros((5, 5)))
    >>> x, Sigma = correct(x, Sigma, [0.0, 0.55], 1e-12 * np.eye(2))
    >>> x[4].round(6).item()
    0.6
    """
    x = as_array("x", x, (5,))
    Sigma = as_array("Sigma", Sigma, (5, 5))
    z = as_array("z", z, (2,))
    R = as_array("R", R, (2, 2))
    try:
        return conditioned(x, Sigma, z - x[:2], R, np.eye(2, 5))
    except ValueError as error:
        raise ValueError("R: expected a covariance that makes S positive definite, got S singular") from error
