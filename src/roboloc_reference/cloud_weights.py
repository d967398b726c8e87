r"""The weights of a cloud after a scan, without what lies between.

Prediction, association and weighing are stages of their own in :mod:`roboloc_reference.mcl`, and between them stand
the lines that each particle predicts and the innovations of those that it chose. A filter needs neither: of all the
lines that particle m may give an observation i to, only the least squared distance counts,

.. math:: w_m \leftarrow \eta\, w_m \exp\left(-\tfrac12 \sum_i \min_j v_{mij}^T Q_i^{-1} v_{mij}\right).

So nothing is wrapped until the innovation is, nothing is chosen or fetched, and a covariance is factored once. With W
the inverse of Cholesky's factor of Q, w = (W_aa / W_rr)^2 and b = -W_ra / W_rr, what is added up is
W_rr^2 (w v_alpha^2 + (v_r - b v_alpha)^2). Angles are counted in turns, half a turn too large: what floor leaves is in
[0, 1) then, and stands for [-pi, pi).

The tests hold the result against the stages one after the other.
"""

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import TURN
from roboloc.validation import as_array, as_floats
from roboloc_reference._clouds import as_weights, blocks, posterior, scratch, whitening


def weigh(
    xs: ArrayLike,
    ws: ArrayLike,
    z_raw: ArrayLike,
    Q_raw: ArrayLike,
    map_lines: ArrayLike,
    tf_base_to_camera: ArrayLike,
) -> np.ndarray:
    """Multiply the weights of a cloud by the likelihoods of a scan, given the map.

    Parameters
    ----------
    xs : (M, 3) array_like
        Poses x, y, theta, one a row, at least one [m, m, rad].
    ws : (M,) array_like
        Weights before, not negative, of any total.
    z_raw : (2, I) array_like
        Observed lines alpha, r in the frame of the scanner [rad, m].
    Q_raw : (I, 2, 2) array_like
        Their covariances, symmetric, positive definite.
    map_lines : (2, J) array_like
        Lines alpha, r of the map in the world, one a column [rad, m].
    tf_base_to_camera : (3,) array_like
        Pose x, y, theta of the scanner in the frame of the robot [m, m, rad].

    Returns
    -------
    (M,) ndarray
        Weights after, of total 1. Where every particle is impossible they are all 1/M; where nothing is seen, or
        nothing is in the map, they are as before.

    Warns
    -----
    RuntimeWarning
        If every particle is impossible: all weights are 0, or all innovations beyond what a number can hold.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if there is no particle, if a weight is negative, or
        if a covariance is not positive definite.

    Notes
    -----
    Source: Stanford AA274A (2021), problem set 4, problem 3 (ii).

    Examples
    --------
    A wall is 1.9 m ahead. Of two robots the one that expects it at 2 m is a standard deviation off and loses,
    exp(-1/2) to 1.

    >>> xs, scan, wall = [[0, 0, 0], [0.1, 0, 0]], [[0.0], [1.9]], [[0.0], [2.0]]
    >>> weigh(xs, [0.5, 0.5], scan, [np.diag([0.01, 0.01])], wall, [0, 0, 0]).round(4).tolist()
    [0.3775, 0.6225]
    """
    ws = as_weights(ws)
    x, y, theta = as_array("xs", xs, (ws.size, 3)).T
    z_raw = as_array("z_raw", z_raw, (2, "I"))
    W = whitening(Q_raw, z_raw.shape[1])
    alpha, r = as_array("map_lines", map_lines, (2, "J"))
    x_cam, y_cam, theta_cam = as_floats("tf_base_to_camera", tf_base_to_camera, 3)

    c, s = np.cos(theta), np.sin(theta)
    scanners = np.ones((4, x.size))
    scanners[0] = x + x_cam * c - y_cam * s
    scanners[1] = y + x_cam * s + y_cam * c
    scanners[2] = theta + theta_cam
    J = alpha.size
    linear = np.zeros((2, J, 4))
    linear[0, :, 2], linear[0, :, 3] = 1.0 / TURN, 0.5 - alpha / TURN
    linear[1, :, 0], linear[1, :, 1], linear[1, :, 3] = -np.cos(alpha), -np.sin(alpha), r

    d2 = np.zeros(x.size)
    with np.errstate(over="ignore", invalid="ignore"):
        for block in blocks(x.size, 4 * J) if J else ():
            _add_distances(linear.reshape(2 * J, 4), scanners[:, block], z_raw, W, d2[block])
    return posterior(ws, d2)


def _add_distances(
    linear: np.ndarray, scanners: np.ndarray, z_raw: np.ndarray, W: np.ndarray, d2: np.ndarray
) -> None:
    """Add to d2, (B,), the least squared distance of each observation from the lines that B scanners predict.

    `linear`, (2J, 4), makes of X, Y, heading and 1 what turns the negative angles and the distances of the lines.
    """
    J, B = len(linear) // 2, d2.size
    memory = scratch(4, J, B)
    turns, h_r, t, rest = memory
    np.matmul(linear, scanners, out=memory[:2].reshape(2 * J, B))
    behind = h_r < 0.0
    if behind.any():
        np.add(turns, 0.5, out=turns, where=behind)
        np.abs(h_r, out=h_r)

    factors = W[:, 0, 0] * TURN, -TURN * W[:, 1, 0] / W[:, 1, 1], W[:, 1, 1]
    for z_alpha, z_r, (w_aa, slope, w_rr) in zip(
        z_raw[0] / TURN, z_raw[1], np.transpose(factors), strict=True
    ):
        np.add(turns, z_alpha, out=t)
        t -= np.floor(t, out=rest)
        t -= 0.5
        if slope:
            np.multiply(t, slope, out=rest)
            rest += h_r
            rest -= z_r
        else:
            np.subtract(h_r, z_r, out=rest)
        memory[2:] *= memory[2:]
        t *= (w_aa / w_rr) ** 2
        t += rest
        d2 += t.min(axis=0) * w_rr**2
