r"""The two steps of the extended Kalman filter on a Gaussian belief.

A belief is a mean x (n,) and a covariance Sigma (n, n). Prediction pushes it through a motion linearized by
Gx and Gu, correction conditions it on an innovation z = observation - prediction with Jacobian H:

.. math::

    \Sigma &\leftarrow G_x \Sigma G_x^T + \Delta t\, G_u R\, G_u^T \\
    S &= H \Sigma H^T + Q, \qquad K = \Sigma H^T S^{-1} \\
    x &\leftarrow x + K z, \qquad
    \Sigma \leftarrow (I - K H)\, \Sigma\, (I - K H)^T + K Q K^T

The last form is Joseph's. It is a sum of two products A P A^T, so it has no negative eigenvalue beyond
rounding whatever the error of K; the shorter forms Sigma - K S K^T and (I - K H) Sigma, equal to it on paper,
lose that on ill-conditioned updates. R is the covariance of the control, Q of the observation, as in the
handout; many books swap the letters.

The noise term is the handout's. Since Gu is itself proportional to dt, the term is a control error drawn once
per step with covariance dt R; continuous white noise would need Gu R Gu^T / dt instead.

Source: Stanford AA274A (2021), problem set 4, problem 1 (iii) and (vii); P. D. Joseph and R. S. Bucy,
*Filtering for Stochastic Processes with Applications to Guidance*.
"""

from functools import cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg.lapack import dgesv

from roboloc.validation import as_array, as_number


def transition_update(
    g: ArrayLike, Gx: ArrayLike, Gu: ArrayLike, Sigma: ArrayLike, R: ArrayLike, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Predict: push a belief through a motion step.

    Parameters
    ----------
    g : (n,) array_like
        The mean after the motion.
    Gx : (n, n) array_like
        Derivative of the motion by the state.
    Gu : (n, 2) array_like
        Derivative of the motion by the control.
    Sigma : (n, n) array_like
        Covariance before the motion, symmetric.
    R : (2, 2) array_like
        Covariance of the control, symmetric.
    dt : float
        Duration of the step [s], not negative.

    Returns
    -------
    x : (n,) ndarray
        Predicted mean: a copy of g.
    Sigma : (n, n) ndarray
        Predicted covariance, exactly symmetric.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if dt is negative.

    Notes
    -----
    Source: Stanford AA274A (2021), problem set 4, problem 1 (iii).

    Examples
    --------
    A robot that does not know its heading to 0.1 rad and drives 1 m ahead does not know its side to 0.1 m.

    >>> Gx = [[1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]]
    >>> Sigma = np.diag([0.0, 0.0, 0.1**2])
    >>> x, Sigma = transition_update([1.0, 0.0, 0.0], Gx, np.zeros((3, 2)), Sigma, np.eye(2), 1.0)
    >>> np.sqrt(np.diag(Sigma)).round(12).tolist()
    [0.0, 0.1, 0.1]
    """
    g = as_array("g", g, ("n",))
    n = g.size
    Gx = as_array("Gx", Gx, (n, n))
    Gu = as_array("Gu", Gu, (n, 2))
    Sigma = as_array("Sigma", Sigma, (n, n))
    R = as_array("R", R, (2, 2))
    dt = as_number("dt", dt, minimum=0.0)

    return g.copy(), symmetric(Gx @ Sigma @ Gx.T + dt * (Gu @ R @ Gu.T))


def measurement_update(
    x: ArrayLike, Sigma: ArrayLike, z: ArrayLike, Q: ArrayLike, H: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Correct: condition a belief on an innovation.

    Parameters
    ----------
    x : (n,) array_like
        Mean before the observation.
    Sigma : (n, n) array_like
        Covariance before the observation, symmetric.
    z : (k,) array_like
        Innovation: observation minus what x predicts, angles already wrapped. k = 0 changes nothing.
    Q : (k, k) array_like
        Covariance of the observation, symmetric, positive definite.
    H : (k, n) array_like
        Derivative of the prediction by the state.

    Returns
    -------
    x : (n,) ndarray
        Corrected mean.
    Sigma : (n, n) ndarray
        Corrected covariance, exactly symmetric, no eigenvalue negative beyond rounding: in 2000 ill-conditioned
        updates of the tests none is below -n eps times the largest one before.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if H Sigma H^T + Q is singular.

    Notes
    -----
    Source: Stanford AA274A (2021), problem set 4, problem 1 (vii).

    Examples
    --------
    Two equally good opinions, the prior and an observation 2 m off it, meet half way, with half the variance.

    >>> x, Sigma = measurement_update([0.0], [[1.0]], [2.0], [[1.0]], [[1.0]])
    >>> x.tolist(), Sigma.tolist()
    ([1.0], [[0.5]])
    """
    x = as_array("x", x, ("n",))
    n = x.size
    Sigma = as_array("Sigma", Sigma, (n, n))
    z = as_array("z", z, ("k",))
    k = z.size
    Q = as_array("Q", Q, (k, k))
    H = as_array("H", H, (k, n))

    return conditioned(x, Sigma, z, Q, H)


def conditioned(
    x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, H: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Condition a belief on an innovation: :func:`measurement_update` for arguments that are checked already.

    `dot` and not `@`: for matrices this small most of the time goes into finding out what to do.
    """
    if not z.size:
        return x.copy(), symmetric(Sigma)
    HSigma = H.dot(Sigma)
    try:
        K = gain(HSigma.dot(H.T) + Q, HSigma)
    except np.linalg.LinAlgError as error:
        raise ValueError("Q: expected H Sigma H^T + Q positive definite, got it singular") from error
    A = _identity(x.size) - K.dot(H)
    return x + K.dot(z), symmetric(A.dot(Sigma).dot(A.T) + K.dot(Q).dot(K.T))


def gain(S: np.ndarray, C: np.ndarray) -> np.ndarray:
    """Return the Kalman gain C^T S^-1.

    It is `numpy.linalg.solve` without what that spends around LAPACK, most of the time for a small matrix.

    Parameters
    ----------
    S : (k, k) ndarray
        Covariance of the innovation, symmetric; k is not 0.
    C : (k, n) ndarray
        Covariance of innovation and state, H Sigma.

    Returns
    -------
    (n, k) ndarray
        The gain.

    Raises
    ------
    numpy.linalg.LinAlgError
        If S is singular.

    Examples
    --------
    An innovation that is half due to the state and half to the sensor is believed by half.

    >>> gain(np.array([[2.0]]), np.array([[1.0]])).tolist()
    [[0.5]]
    """
    _, _, K, info = dgesv(S, C)
    if info:
        raise np.linalg.LinAlgError("singular matrix")
    return K.T


@cache
def _identity(n: int) -> np.ndarray:
    """Return the identity, one for all calls: it is only read."""
    identity = np.eye(n)
    identity.flags.writeable = False
    return identity


def symmetric(matrix: np.ndarray) -> np.ndarray:
    """Return the mean of a matrix and its transpose: symmetric to the last bit.

    The copy pays: NumPy adds small arrays of one layout in a third of the time of two layouts.

    Examples
    --------
    Rounding made two entries differ that are one covariance.

    >>> symmetric(np.array([[1.0, 0.25], [0.75, 1.0]])).tolist()
    [[1.0, 0.5], [0.5, 1.0]]
    """
    return 0.5 * (matrix + matrix.T.copy())
