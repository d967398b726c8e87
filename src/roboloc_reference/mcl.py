r"""Monte Carlo localization: a cloud of poses, each judged by how well it explains the walls that are seen.

Every particle m moves by a control of its own, predicts the lines of the map in its own scanner's frame, gives
each observed line to the nearest of them, and keeps its weight in the measure in which the innovations are likely:

.. math::

    w_m \leftarrow \eta\, w_m \prod_i \exp\left(-\tfrac12 v_{mi}^T Q_i^{-1} v_{mi}\right).

A particle has no covariance of its own, so the distance is judged with Q_i alone, and there is no gate: what one
particle dropped would make it look better than those that kept it. The factor 1 / sqrt(det 2 pi Q_i) is the same
for all particles and cancels. Likelihoods are multiplied as sums of logarithms: a product of a few dozen of them
is 0 in floating point for every particle, their sum is not.

No loop runs over particles. Inside, particles are the last index, so that every operation runs along a
contiguous row, and they are taken in blocks that stay in the cache; nothing of the size particles x observations
x lines is ever stored, but for a block. Two observations make each pair cheap:

* the distance of a line from a scanner at (X, Y) in the world is r - X cos(alpha) - Y sin(alpha): one sine and one
  cosine for a particle, whatever the number of lines;
* with s = q_rr - q_ar^2 / q_aa the variance of r where the angle is known, the quadratic form of a 2 x 2
  covariance is v_a^2 / q_aa + (v_r - v_a q_ar / q_aa)^2 / s.

Results have the shapes of the handout; they are views whose last index in memory is the particle.

Source: Stanford AA274A (2021), problem set 4, problem 3. The tests hold it against plain loops.
"""

import threading
import warnings
from math import pi, prod

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import TURN
from roboloc.validation import as_array, as_floats, as_number

# Particles handled at a time, at most; fewer where pairs of observation and line are many.
_BLOCK = 2048
_PAIRS = 150_000

# Fresh memory costs more than what is written to it, so each thread keeps the memory of its last block.
_kept = threading.local()


def transition_model(xs: ArrayLike, us: ArrayLike, dt: float) -> np.ndarray:
    """Move every particle along the arc of its own control.

    Parameters
    ----------
    xs : (M, 3) array_like
        Poses x, y, theta, one a row [m, m, rad].
    us : (M, 2) array_like
        Controls V, omega, one a row [m/s, rad/s].
    dt : float
        Duration of the controls [s].

    Returns
    -------
    (M, 3) ndarray
        Poses at the end; the heading is not wrapped.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Notes
    -----
    The formula of :mod:`roboloc_reference.motion`, right for every omega. Source: Stanford AA274A (2021), problem
    set 4, problem 3 (i).

    Examples
    --------
    In one second one particle drives 1 m ahead and another a quarter circle of radius 1 m to the left.

    >>> us = [[1.0, 0.0], [np.pi / 2, np.pi / 2]]
    >>> transition_model(np.zeros((2, 3)), us, 1.0).round(6).tolist()
    [[1.0, 0.0, 0.0], [1.0, 1.0, 1.570796]]
    """
    x, y, theta = as_array("xs", xs, ("M", 3)).T
    V, omega = as_array("us", us, (x.size, 2)).T
    dt = as_number("dt", dt)

    h = omega * dt / 2
    chord = V * dt * np.divide(np.sin(h), h, out=np.ones_like(h), where=h != 0.0)
    phi = theta + h
    return np.stack([x + chord * np.cos(phi), y + chord * np.sin(phi), theta + omega * dt]).T


def compute_predicted_measurements(
    xs: ArrayLike, map_lines: ArrayLike, tf_base_to_camera: ArrayLike
) -> np.ndarray:
    """Predict every line of a map as the scanner of every particle would report it.

    Parameters
    ----------
    xs : (M, 3) array_like
        Poses x, y, theta, one a row [m, m, rad].
    map_lines : (2, J) array_like
        Lines alpha, r of the map in the world, one a column [rad, m].
    tf_base_to_camera : (3,) array_like
        Pose x, y, theta of the scanner in the frame of the robot [m, m, rad].

    Returns
    -------
    hs : (M, 2, J) ndarray
        Lines alpha, r in the frame of each scanner [rad, m]: alpha in [-pi, pi), r not negative.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Notes
    -----
    Source: Stanford AA274A (2021), problem set 4, problem 3 (ii).

    Examples
    --------
    A wall 2 m ahead of one particle is 1 m to the right of another that has moved 1 m and turned left.

    >>> hs = compute_predicted_measurements([[0, 0, 0], [1, 0, np.pi / 2]], [[0.0], [2.0]], [0, 0, 0])
    >>> hs[..., 0].round(6).tolist()
    [[0.0, 2.0], [-1.570796, 1.0]]
    """
    x, y, theta = as_array("xs", xs, ("M", 3)).T
    alpha, r = as_array("map_lines", map_lines, (2, "J"))[..., None]
    x_cam, y_cam, theta_cam = as_floats("tf_base_to_camera", tf_base_to_camera, 3)

    c, s = np.cos(theta), np.sin(theta)
    scanners = np.stack([x + x_cam * c - y_cam * s, y + x_cam * s + y_cam * c])  # X, Y in the world
    heading = theta + theta_cam
    normals = np.hstack([np.cos(alpha), np.sin(alpha)])

    hs = np.empty((2, alpha.size, x.size))
    for block in _blocks(x.size):
        h_alpha, h_r = hs[:, :, block]
        np.subtract(alpha, heading[block], out=h_alpha)
        np.subtract(r, normals @ scanners[:, block], out=h_r)
        h_alpha += np.multiply(h_r < 0.0, pi)
        _wrap_in_place(h_alpha)
        np.abs(h_r, out=h_r)
    return hs.transpose(2, 0, 1)


def compute_innovations(z_raw: ArrayLike, Q_raw: ArrayLike, hs: ArrayLike) -> np.ndarray:
    """Give each observed line to the nearest line that each particle predicts.

    Parameters
    ----------
    z_raw : (2, I) array_like
        Observed lines, columns alpha, r in the scanner's frame [rad, m].
    Q_raw : (I, 2, 2) array_like
        Their covariances, symmetric, positive definite; an array or a list of I matrices.
    hs : (M, 2, J) array_like
        The lines that each particle predicts [rad, m].

    Returns
    -------
    vs : (M, 2I) ndarray
        Innovations z - h of each particle, alpha, r, alpha, r, ... [rad, m]; angles wrapped to [-pi, pi).

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if a covariance is not positive definite.

    Notes
    -----
    Nearest is the least v^T Q^-1 v; of two lines equally near, the first of the map is taken. There is no gate.
    With no line in the map nothing is predicted and nothing can contradict it: all innovations are 0, and the
    weights stay as they are. Source: Stanford AA274A (2021), problem set 4, problem 3 (ii).

    Examples
    --------
    A line is seen 1.9 m ahead. One particle expects its wall there at 2 m, another at 2.5 m.

    >>> vs = compute_innovations([[0.0], [1.9]], [np.diag([0.01, 0.01])], [[[0.0], [2.0]], [[0.0], [2.5]]])
    >>> vs.round(12).tolist()
    [[0.0, -0.1], [0.0, -0.6]]
    """
    z_raw = as_array("z_raw", z_raw, (2, "I"))
    count = z_raw.shape[1]
    per_alpha, slope, per_r = _quadratic_forms(Q_raw, count)
    hs = as_array("hs", hs, ("M", 2, "J"))
    M, _, J = hs.shape
    vs = np.zeros((count, 2, M))
    if J and count:
        # The angle is counted in turns, so that rint wraps it; d2 is multiplied by the variance of r.
        forms = TURN * TURN * per_alpha / per_r, TURN * slope
        by_line = hs.transpose(1, 2, 0)
        for block in _blocks(M, count * J):
            h = np.ascontiguousarray(by_line[:, :, block])
            nearest = _nearest(z_raw, h, forms)
            nearest *= h.shape[2]
            nearest += np.arange(h.shape[2])
            v_alpha = np.subtract(z_raw[0, :, None], h[0].take(nearest))
            _wrap_in_place(v_alpha)
            vs[:, 0, block] = v_alpha
            np.subtract(z_raw[1, :, None], h[1].take(nearest), out=vs[:, 1, block])
    return vs.reshape(2 * count, M).T


def measurement_weights(vs: ArrayLike, Q_raw: ArrayLike, ws: ArrayLike) -> np.ndarray:
    """Multiply the weights by the likelihoods of the innovations.

    Parameters
    ----------
    vs : (M, 2I) array_like
        Innovations of each particle, alpha, r, alpha, r, ... [rad, m].
    Q_raw : (I, 2, 2) array_like
        Covariances of the observations, symmetric, positive definite.
    ws : (M,) array_like
        Weights before, not negative, of any total.

    Returns
    -------
    (M,) ndarray
        Weights after, of total 1. Where every particle is impossible they are all 1/M.

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
    Of two particles the one that is a standard deviation off loses, exp(-1/2) to 1; each keeps its old share.

    >>> measurement_weights([[0.0, 0.0], [0.0, 0.1]], [np.diag([0.01, 0.01])], [0.5, 0.5]).round(4).tolist()
    [0.6225, 0.3775]
    """
    ws = as_array("ws", ws, ("M",))
    M = ws.size
    if not M:
        raise ValueError("ws: expected at least one weight, got none")
    if ws.min() < 0.0:
        raise ValueError(f"ws: expected no negative weight, got {ws.min()}")
    vs = as_array("vs", vs, (M, "2I"))
    count, odd = divmod(vs.shape[1], 2)
    if odd:
        raise ValueError(f"vs: expected an even number of columns, got shape {vs.shape}")
    per_alpha, slope, per_r = _quadratic_forms(Q_raw, count)

    d2 = np.zeros(M)
    with np.errstate(over="ignore", divide="ignore"):
        for i in range(count):
            v_alpha, v_r = vs[:, 2 * i], vs[:, 2 * i + 1]
            rest = v_r - slope[i] * v_alpha
            d2 += per_alpha[i] * (v_alpha * v_alpha) + per_r[i] * (rest * rest)
        logs = np.log(ws) - d2 / 2
    best = logs.max()
    if best == -np.inf:
        message = "no particle can explain what is seen: all weights are set to 1/M"
        warnings.warn(message, RuntimeWarning, stacklevel=2)
        return np.full(M, 1.0 / M)
    logs -= best
    after = np.exp(logs, out=logs)
    after /= after.sum()
    return after


def _blocks(M: int, pairs: int = 1) -> list[slice]:
    """Return slices that cut M particles, each with so many pairs, into blocks."""
    size = min(_BLOCK, max(_PAIRS // pairs, 64))
    return [slice(start, min(start + size, M)) for start in range(0, M, size)]


def _memory(*shape: int) -> np.ndarray:
    """Return an array of unknown content, which is this thread's until the next call."""
    size = prod(shape)
    if getattr(_kept, "memory", np.empty(0)).size < size:
        _kept.memory = np.empty(size)
    return _kept.memory[:size].reshape(shape)


def _wrap_in_place(a: np.ndarray) -> None:
    """Wrap angles to [-pi, pi); faster than :func:`roboloc.angles.wrap`."""
    turns = a * (1.0 / TURN)
    np.rint(turns, out=turns)
    turns *= TURN
    a -= turns
    # What rint leaves outside is a digit beyond either edge; there is almost never any.
    if a.size and (a.max() >= pi or a.min() < -pi):
        a[a < -pi] += TURN
        a[a >= pi] -= TURN
        np.maximum(a, -pi, out=a)


def _quadratic_forms(Q_raw: ArrayLike, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a, b, c, each (I,), with v^T Q^-1 v = a v_alpha^2 + c (v_r - b v_alpha)^2."""
    Q_raw = as_array("Q_raw", Q_raw if count else np.zeros((0, 2, 2)), (count, 2, 2))
    q_aa, q_ar, q_rr = Q_raw[:, 0, 0], Q_raw[:, 0, 1], Q_raw[:, 1, 1]
    with np.errstate(all="ignore"):
        slope = q_ar / q_aa
        rest = q_rr - slope * q_ar
    if not ((q_aa > 0.0) & (rest > 0.0)).all():
        raise ValueError(f"Q_raw: expected positive definite matrices, got {Q_raw.tolist()}")
    return 1.0 / q_aa, slope, 1.0 / rest


def _nearest(z_raw: np.ndarray, h: np.ndarray, forms: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return for each observation and particle (I, B) which of the lines h (2, J, B) is nearest."""
    h_r = h[1]
    h_turns, turns, work, *_ = memory = _memory(3 + z_raw.shape[1], *h_r.shape)
    np.multiply(h[0], 1.0 / TURN, out=h_turns)
    for i, (z_alpha, z_r, weight, slope) in enumerate(zip(*z_raw, *forms, strict=True), start=3):
        d2 = memory[i]
        np.subtract(z_alpha / TURN, h_turns, out=turns)
        np.rint(turns, out=work)
        turns -= work
        np.subtract(z_r, h_r, out=d2)
        if slope:
            np.multiply(slope, turns, out=work)
            d2 -= work
        d2 *= d2
        turns *= turns
        turns *= weight
        d2 += turns

    # An argmin with no step from row to row. j only grows, so the largest j that was nearer than all before it is
    # the nearest; it is kept in one byte if the map has no more lines than that.
    by_line = memory[3:].swapaxes(0, 1)
    best = by_line[0].copy()
    number = np.min_scalar_type(h_r.shape[0])
    nearest, later = np.zeros(best.shape, number), np.empty(best.shape, number)
    nearer = np.empty(best.shape, np.bool_)
    for j in range(1, h_r.shape[0]):
        np.less(by_line[j], best, out=nearer)
        np.multiply(nearer.view(np.uint8), number.type(j), out=later)
        np.maximum(nearest, later, out=nearest)
        np.minimum(best, by_line[j], out=best)
    return nearest.astype(np.intp)
