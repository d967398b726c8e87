r"""Which wall a scanned line belongs to, and the one measurement that all of them make.

An observation i is a line z_i = (alpha, r) in the scanner's frame with covariance Q_i; wall j of the map
predicts h_j there, with Jacobian H_j by the state. How well they agree is judged by the innovation and by the
covariance that it would have if they were one wall:

.. math::

    v_{ij} = z_i - h_j, \qquad S_{ij} = H_j \Sigma H_j^T + Q_i, \qquad
    d^2_{ij} = v_{ij}^T S_{ij}^{-1} v_{ij},

with the angle in v wrapped to [-pi, pi). Each observation goes to the wall with the least d2 and is kept only
inside the gate, d2 < g squared: for two numbers and the right wall, d2 is chi-square with two degrees of
freedom, so the gate lets a share 1 - exp(-g**2 / 2) of the right pairs pass. The handout calls d2 itself the
Mahalanobis distance; the distance is its root, and g is compared with that.

Every observation chooses for itself, so two pieces of one wall may share it. What is kept is stacked into
one vector, its covariance has the Q_i on its diagonal, and the update sees it as a single measurement.

All pairs are one array operation here: I observations and J walls make I x J systems of two equations.

Source: Stanford AA274A (2021), problem set 4, problem 1 (v) and (vi).
"""

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import wrap
from roboloc.validation import as_array, as_number


def compute_innovations(
    z_raw: ArrayLike, Q_raw: ArrayLike, hs: ArrayLike, Hs: ArrayLike, Sigma: ArrayLike, g: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Give each observed line to its nearest wall, and keep what falls inside the gate.

    Parameters
    ----------
    z_raw : (2, I) array_like
        Observed lines, columns alpha, r in the scanner's frame [rad, m].
    Q_raw : (I, 2, 2) array_like
        Their covariances, symmetric; an array or a list of I matrices.
    hs : (2, J) array_like
        The lines that the map predicts, columns alpha, r in the scanner's frame [rad, m].
    Hs : (J, 2, n) array_like
        Derivatives of the predicted lines by the state.
    Sigma : (n, n) array_like
        Covariance of the state, symmetric.
    g : float
        Validation gate in standard deviations, not negative.

    Returns
    -------
    v : (K, 2) ndarray
        Innovations of the observations that were kept, in their order; the angle wrapped to [-pi, pi).
    Q : (K, 2, 2) ndarray
        Covariances of these observations.
    H : (K, 2, n) ndarray
        Derivatives of the lines that they were given to.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if g is negative, or if an H Sigma H^T + Q is
        singular.

    Notes
    -----
    Of two walls equally near, the one that comes first in the map is taken. Source: Stanford AA274A (2021),
    problem set 4, problem 1 (v).

    Examples
    --------
    Walls are expected 2 m ahead and 3 m to the left. A line 1.9 m ahead is the first of them, 0.1 m nearer than
    it should be; a line 7 m behind is no wall of the map, and is dropped.

    >>> hs, Hs = [[0.0, np.pi / 2], [2.0, 3.0]], np.zeros((2, 2, 3))
    >>> z_raw, Q_raw = [[0.0, -np.pi], [1.9, 7.0]], [np.diag([0.01, 0.01])] * 2
    >>> v, Q, H = compute_innovations(z_raw, Q_raw, hs, Hs, np.zeros((3, 3)), 3.0)
    >>> v.round(12).tolist()
    [[0.0, -0.1]]
    """
    z_raw = as_array("z_raw", z_raw, (2, "I"))
    count = z_raw.shape[1]
    Q_raw = as_array("Q_raw", Q_raw if count else np.zeros((0, 2, 2)), (count, 2, 2))
    hs = as_array("hs", hs, (2, "J"))
    Hs = as_array("Hs", Hs, (hs.shape[1], 2, "n"))
    n = Hs.shape[2]
    Sigma = as_array("Sigma", Sigma, (n, n))
    g = as_number("g", g, minimum=0.0)
    if not hs.shape[1]:
        return np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros((0, 2, n))

    v = z_raw.T[:, None, :] - hs.T[None, :, :]
    v[..., 0] = wrap(v[..., 0])
    S = (Hs @ Sigma @ Hs.swapaxes(1, 2))[None] + Q_raw[:, None]
    try:
        d2 = np.sum(v * np.linalg.solve(S, v[..., None])[..., 0], axis=-1)
    except np.linalg.LinAlgError as error:
        raise ValueError("Q_raw: expected H Sigma H^T + Q positive definite, got it singular") from error

    i = np.arange(count)
    j = np.argmin(d2, axis=1)
    kept = d2[i, j] < g * g
    i, j = i[kept], j[kept]
    return v[i, j], Q_raw[i], Hs[j]


def measurement_model(v: ArrayLike, Q: ArrayLike, H: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stack the innovations of several lines into one measurement.

    Parameters
    ----------
    v : (K, 2) array_like
        Innovations [rad, m].
    Q : (K, 2, 2) array_like
        Their covariances, symmetric.
    H : (K, 2, n) array_like
        Their derivatives by the state.

    Returns
    -------
    z : (2K,) ndarray
        The innovations one after another: alpha, r, alpha, r, ... [rad, m].
    Q : (2K, 2K) ndarray
        The covariances as blocks on the diagonal, 0 elsewhere.
    H : (2K, n) ndarray
        The derivatives one below another.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Notes
    -----
    K = 0 gives (0,), (0, 0) and (0, n): a measurement that changes nothing. Source: Stanford AA274A (2021),
    problem set 4, problem 1 (vi).

    Examples
    --------
    Two lines are four numbers, and the error of one line says nothing about the other.

    >>> Q = [[[1.0, 0.5], [0.5, 2.0]], [[3.0, 0.0], [0.0, 4.0]]]
    >>> z, Q, H = measurement_model([[0.1, 0.2], [0.3, 0.4]], Q, np.zeros((2, 2, 3)))
    >>> z.tolist(), H.shape
    ([0.1, 0.2, 0.3, 0.4], (4, 3))
    >>> Q.tolist()
    [[1.0, 0.5, 0.0, 0.0], [0.5, 2.0, 0.0, 0.0], [0.0, 0.0, 3.0, 0.0], [0.0, 0.0, 0.0, 4.0]]
    """
    v = as_array("v", v, ("K", 2))
    count = len(v)
    Q = as_array("Q", Q, (count, 2, 2))
    H = as_array("H", H, (count, 2, "n"))

    blocks = np.zeros((count, 2, count, 2))
    i = np.arange(count)
    blocks[i, :, i, :] = Q
    return v.flatten(), blocks.reshape(2 * count, 2 * count), H.reshape(2 * count, H.shape[2]).copy()
