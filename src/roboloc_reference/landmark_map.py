r"""The state of a map of points: how it is laid out, and how far it is from the truth.

A pose and k landmarks are one vector, (x, y, theta, l_x, l_y, l_x', l_y', ...), and what is seen of all landmarks is
another, bearing and range in turn. Two filters share this layout: the one of :mod:`roboloc_reference.landmarks`,
whose error is estimate minus truth, and the one of :mod:`roboloc_reference.invariant_slam`.

Source: CMU 16-833 (Robot Localization and Mapping), homework 2, problem 2.4 for the evaluation.
"""

import numpy as np
from numpy.typing import ArrayLike

from roboloc.validation import as_array


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
