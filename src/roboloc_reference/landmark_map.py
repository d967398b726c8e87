"""A robot in a map of points: the layout of its state, what it sees of it, and how far it is from the truth.

A pose and k landmarks are one vector, (x, y, theta, l_x, l_y, l_x', l_y', ...), and what is seen of all landmarks is
another, bearing and range in turn. Two filters share this: the one of :mod:`roboloc_reference.landmarks`, whose error
is estimate minus truth and which derives the formulas, and the one of :mod:`roboloc_reference.invariant_slam`.

Source: CMU 16-833 (Robot Localization and Mapping), homework 2, problems 1.4 to 1.6 and 2.
"""

from math import atan2, hypot
from operator import index

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import wrap
from roboloc.validation import as_array


def measurement(x: ArrayLike, j: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Predict how landmark j is seen, with the derivatives by the pose and by the landmark.

    Parameters
    ----------
    x : (3 + 2k,) array_like
        Pose and landmarks [m, m, rad, m, m, ...].
    j : int
        Which landmark, from 0 to k - 1.

    Returns
    -------
    z : (2,) ndarray
        Bearing, in [-pi, pi), and range [rad, m].
    Hp : (2, 3) ndarray
        Derivative of z by the pose.
    Hl : (2, 2) ndarray
        Derivative of z by the landmark.

    Raises
    ------
    ValueError
        If x has another shape or is not finite, if there is no landmark j, or if it lies on the robot, where a
        bearing has no meaning.

    Notes
    -----
    Source: CMU 16-833, homework 2, problem 1.4 to 1.6.

    Examples
    --------
    A landmark 4 m to the left: a robot that moves 1 m ahead sees it fall back by about a quarter of a radian.

    >>> z, Hp, Hl = measurement([0.0, 0.0, 0.0, 0.0, 4.0], 0)
    >>> float(z[1]), float(z[0] / np.pi), float(Hp[0, 0])
    (4.0, 0.5, 0.25)
    """
    x = as_state(x)
    count = (x.size - 3) // 2
    try:
        j = index(j)
    except TypeError as error:
        raise ValueError(f"j: expected a whole number, got {type(j).__name__}") from error
    if not 0 <= j < count:
        raise ValueError(f"j: expected a landmark from 0 to k - 1 with k = {count}, got {j}")

    px, py, theta = x[:3].tolist()
    lx, ly = x[3 + 2 * j : 5 + 2 * j].tolist()
    dx, dy = lx - px, ly - py
    r = hypot(dx, dy)
    if not r:
        raise ValueError(f"x: expected landmark {j} off the robot, got both at ({px}, {py})")
    c, s = dx / r, dy / r  # divided before they are multiplied, a range of 1e-200 does no harm
    Hl = np.array([[-s / r, c / r], [c, s]])
    Hp = np.array([[s / r, -c / r, -1.0], [-c, -s, 0.0]])
    return np.array([wrap(atan2(dy, dx) - theta), r]), Hp, Hl


def innovation(x: ArrayLike, z: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Compare a look at every landmark with its prediction; stack the differences and their derivatives.

    Parameters
    ----------
    x : (3 + 2k,) array_like
        Pose and landmarks [m, m, rad, m, m, ...].
    z : (2k,) array_like
        Bearing and range of each landmark, in their order [rad, m, rad, m, ...].

    Returns
    -------
    v : (2k,) ndarray
        Observation minus prediction, bearings in [-pi, pi) [rad, m, rad, m, ...].
    H : (2k, 3 + 2k) ndarray
        Derivative of the prediction by the state.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if a landmark lies on the robot.

    Notes
    -----
    Source: CMU 16-833, homework 2, problem 2.

    Examples
    --------
    A landmark behind, expected just left of straight back and seen just right of it, is off by 0.002 rad.

    >>> v, H = innovation([0.0, 0.0, 0.0, -2.0, 0.002], [-np.pi + 0.001, 2.0])
    >>> round(float(v[0]), 5), H.shape
    (0.002, (2, 5))
    """
    x = as_state(x)
    n = x.size
    k = (n - 3) // 2
    z = as_array("z", z, (2 * k,)).reshape(k, 2)

    v, H = np.zeros((k, 2)), np.zeros((k, 2, n))
    for j in range(k):
        h, H[j, :, :3], H[j, :, 3 + 2 * j : 5 + 2 * j] = measurement(x, j)
        v[j] = z[j] - h
    v[:, 0] = wrap(v[:, 0])
    return v.ravel(), H.reshape(2 * k, n)


def evaluate(x: ArrayLike, Sigma: ArrayLike, truth: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Compare the map with the truth: in metres, and in standard deviations of its own claim.

    Parameters
    ----------
    x : (3 + 2k,) array_like
        Pose and landmarks [m, m, rad, m, m, ...].
    Sigma : (3 + 2k, 3 + 2k) array_like
        Their covariance, symmetric, positive definite in the block of each landmark.
    truth : (2k,) array_like
        Where the landmarks are, in their order [m].

    Returns
    -------
    euclidean : (k,) ndarray
        Distance of each landmark from its true place [m].
    mahalanobis : (k,) ndarray
        The same in standard deviations: the root of e' S^-1 e, whose square is chi-square with two degrees of
        freedom where the filter is honest.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if a landmark has no positive definite covariance.

    Notes
    -----
    Source: CMU 16-833, homework 2, problem 2.4.

    Examples
    --------
    A landmark 0.2 m off in a direction in which it is known to 0.1 m is two standard deviations off.

    >>> Sigma = np.diag([0.0, 0.0, 0.0, 0.01, 0.0001])
    >>> euclidean, mahalanobis = evaluate([0.0, 0.0, 0.0, 5.0, 1.0], Sigma, [5.2, 1.0])
    >>> euclidean.round(12).tolist(), mahalanobis.round(12).tolist()
    ([0.2], [2.0])
    """
    x = as_state(x)
    n = x.size
    k = (n - 3) // 2
    Sigma = as_array("Sigma", Sigma, (n, n))
    error = x[3:].reshape(k, 2) - as_array("truth", truth, (2 * k,)).reshape(k, 2)
    j = np.arange(k)
    S = Sigma[3:, 3:].reshape(k, 2, k, 2)[j, :, j, :]
    try:
        whitened = np.linalg.solve(np.linalg.cholesky(S), error[..., None])[..., 0]
    except np.linalg.LinAlgError as failure:
        raise ValueError(
            "Sigma: expected each landmark's block positive definite, got one that is not"
        ) from failure
    return np.hypot(error[:, 0], error[:, 1]), np.hypot(whitened[:, 0], whitened[:, 1])


def as_state(x: ArrayLike) -> np.ndarray:
    """Return x as a pose followed by pairs."""
    x = as_array("x", x, ("n",))
    if x.size < 3 or x.size % 2 == 0:
        raise ValueError(f"x: expected shape (3 + 2k,), got shape ({x.size},)")
    return x


def as_pairs(name: str, value: ArrayLike) -> np.ndarray:
    """Return a vector of even length as an array (k, 2)."""
    array = as_array(name, value, ("2k",))
    if array.size % 2:
        raise ValueError(f"{name}: expected shape (2k,), got shape ({array.size},)")
    return array.reshape(-1, 2)


def block_diagonal(blocks: np.ndarray) -> np.ndarray:
    """Put (k, 2, 2) blocks on the diagonal of a (2k, 2k) matrix; k = 0 gives (0, 0)."""
    k = len(blocks)
    matrix = np.zeros((k, 2, k, 2))
    j = np.arange(k)
    matrix[j, :, j, :] = blocks
    return matrix.reshape(2 * k, 2 * k)
