r"""The extended Kalman filter on poses, driven by velocities and corrected by bearings and ranges.

It is the plain answer to the problem whose other answers are in :mod:`roboloc_reference.ukf`,
:mod:`roboloc_reference.particle` and :mod:`roboloc_reference.invariant`: the motion and the observation are
replaced by their tangents at the mean,

.. math::

    \Sigma &\leftarrow F \Sigma F^T + W M W^T \\
    S &= H \Sigma H^T + \mathrm{diag}(Q, \dots, Q), \qquad K = \Sigma H^T S^{-1} \\
    x &\leftarrow x + K v, \qquad
    \Sigma \leftarrow (I - K H)\, \Sigma\, (I - K H)^T + K\, \mathrm{diag}(Q, \dots, Q)\, K^T

with F and W of :mod:`roboloc_reference.velocity`, and H and the innovation v, its bearings wrapped, stacked
over the landmarks that are seen at once. All tangents are taken at the same mean; one landmark after the other
would take each at a mean of its own.

Source: Michigan ROB530, homework 5, problem 1 (A); its printed S adds the innovation where the noise belongs.
"""

import numpy as np
from numpy.typing import ArrayLike

from roboloc.validation import as_array, as_floats, as_number
from roboloc_reference.gaussian import conditioned, symmetric
from roboloc_reference.motion import arc
from roboloc_reference.velocity import sightings, wrap_float


def predict(
    x: ArrayLike, Sigma: ArrayLike, u: ArrayLike, M: ArrayLike, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Push a belief through the motion.

    Parameters
    ----------
    x : (3,) array_like
        Mean pose [m, m, rad].
    Sigma : (3, 3) array_like
        Its covariance, symmetric.
    u : (3,) array_like
        Control v, omega, gamma [m/s, rad/s, rad/s].
    M : (3, 3) array_like
        Covariance of the control, symmetric; see :func:`roboloc_reference.velocity.noise`.
    dt : float
        Duration of the step [s], not negative.

    Returns
    -------
    x : (3,) ndarray
        Predicted mean; the heading is not wrapped.
    Sigma : (3, 3) ndarray
        Predicted covariance, exactly symmetric.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if dt is negative.

    Notes
    -----
    Source: Michigan ROB530, homework 5, problem 1 (A).

    Examples
    --------
    A robot drives 1 m ahead at a speed kept to 0.1 m/s, and does not know its heading to 0.2 rad: that is 0.1 m
    ahead and 0.2 m to the side.

    >>> M = np.diag([0.1**2, 0.0, 0.0])
    >>> x, Sigma = predict([0.0, 0.0, 0.0], np.diag([0.0, 0.0, 0.2**2]), [1.0, 0.0, 0.0], M, 1.0)
    >>> x.tolist(), np.sqrt(np.diag(Sigma)).round(12).tolist()
    ([1.0, 0.0, 0.0], [0.1, 0.2, 0.2])
    """
    px, py, theta = as_floats("x", x, 3)
    Sigma = as_array("Sigma", Sigma, (3, 3))
    v, omega, gamma = as_floats("u", u, 3)
    M = as_array("M", M, (3, 3))
    dt = as_number("dt", dt, minimum=0.0)

    dx, dy, dx_dv, dy_dv, dx_domega, dy_domega = arc(theta, v, omega, dt)
    # F and W side by side, and the covariance of pose and control: one product for both terms.
    FW = np.array(
        [
            [1.0, 0.0, -dy, dx_dv, dx_domega, 0.0],
            [0.0, 1.0, dx, dy_dv, dy_domega, 0.0],
            [0.0, 0.0, 1.0, 0.0, dt, dt],
        ]
    )
    joint = np.zeros((6, 6))
    joint[:3, :3], joint[3:, 3:] = Sigma, M
    g = np.array([px + dx, py + dy, theta + (omega + gamma) * dt])
    return g, symmetric(FW.dot(joint).dot(FW.T))


def correct(
    x: ArrayLike, Sigma: ArrayLike, z: ArrayLike, landmarks: ArrayLike, Q: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Condition a belief on the bearings and ranges of known landmarks.

    Parameters
    ----------
    x : (3,) array_like
        Mean pose [m, m, rad].
    Sigma : (3, 3) array_like
        Its covariance, symmetric.
    z : (2k,) array_like
        Observations: bearing, range, bearing, range, ... [rad, m]. k = 0 changes nothing.
    landmarks : (k, 2) array_like
        Positions of the landmarks seen [m].
    Q : (2, 2) array_like
        Covariance of one observation, symmetric, positive definite.

    Returns
    -------
    x : (3,) ndarray
        Corrected mean; the heading is not wrapped.
    Sigma : (3, 3) ndarray
        Corrected covariance, exactly symmetric.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if a landmark is where the mean is, or if the
        covariance of the innovation is singular.

    Notes
    -----
    Source: Michigan ROB530, homework 5, problem 1 (A).

    Examples
    --------
    A landmark expected 2 m ahead is seen at 1 m. As sure of its place as of the observation, and sure of its
    heading, the robot moves up by half a metre.

    >>> x, Sigma = correct([0.0, 0.0, 0.0], np.diag([1.0, 0.0, 0.0]), [0.0, 1.0], [[2.0, 0.0]], np.eye(2))
    >>> x.tolist(), Sigma[0, 0].item()
    ([0.5, 0.0, 0.0], 0.5)
    """
    x = as_array("x", x, (3,))
    Sigma = as_array("Sigma", Sigma, (3, 3))
    landmarks = as_array("landmarks", landmarks if np.size(landmarks) else np.zeros((0, 2)), ("k", 2))
    k = len(landmarks)
    z = as_array("z", z, (2 * k,))
    Q = as_array("Q", Q, (2, 2))

    h, H = sightings(x.tolist(), landmarks.tolist())
    v = [a - b for a, b in zip(z.tolist(), h, strict=True)]
    v[::2] = map(wrap_float, v[::2])
    R = np.zeros((2 * k, 2 * k))
    for i in range(0, 2 * k, 2):
        R[i : i + 2, i : i + 2] = Q
    return conditioned(x, Sigma, np.array(v), R, np.array(H))
