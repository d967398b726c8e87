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
  covariance is v_a^2 / q_aa + (v_r - v_a q_ar / q_aa)^2 / s, the square of two whitened numbers.

Results have the shapes of the handout; they are views whose last index in memory is the particle.

Source: Stanford AA274A (2021), problem set 4, problem 3. The tests hold it against plain loops.
"""

from math import pi
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from roboloc import filters
from roboloc.angles import TURN
from roboloc.validation import as_array, as_floats, as_number
from roboloc_reference._clouds import (
    as_weights,
    blocks,
    nearest_lines,
    posterior,
    scratch,
    whitening,
    wrap_in_place,
)
from roboloc_reference.cloud_weights import weigh
from roboloc_reference.resampling import systematic_resample

_BELOW_PI = np.nextafter(pi, 0.0)


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

    h = omega * (dt / 2)
    chord = V * dt
    chord *= np.divide(np.sin(h), h, out=np.ones(h.size), where=h != 0.0)
    phi = theta + h
    moved = np.empty((3, x.size))
    np.add(x, chord * np.cos(phi), out=moved[0])
    np.add(y, chord * np.sin(phi), out=moved[1])
    np.add(theta, omega * dt, out=moved[2])
    return moved.T


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
    alpha, r = as_array("map_lines", map_lines, (2, "J"))
    x_cam, y_cam, theta_cam = as_floats("tf_base_to_camera", tf_base_to_camera, 3)

    # Before r is made positive both parameters are linear in X, Y, heading and 1. Angles are counted in turns and
    # half a turn too large, so that what floor leaves is in [0, 1) and stands for [-pi, pi).
    J = alpha.size
    linear = np.zeros((2, J, 4))
    linear[0, :, 2], linear[0, :, 3] = -1.0 / TURN, alpha / TURN + 0.5
    linear[1, :, 0], linear[1, :, 1], linear[1, :, 3] = -np.cos(alpha), -np.sin(alpha), r
    c, s = np.cos(theta), np.sin(theta)
    scanners = np.ones((4, x.size))
    scanners[0] = x + x_cam * c - y_cam * s
    scanners[1] = y + x_cam * s + y_cam * c
    scanners[2] = theta + theta_cam

    hs = np.empty((2 * J, x.size))
    for block in blocks(x.size, J):
        h = np.matmul(linear.reshape(2 * J, 4), scanners[:, block], out=hs[:, block])
        h_alpha, h_r = h[:J], h[J:]
        behind = h_r < 0.0
        if behind.any():
            np.add(h_alpha, 0.5, out=h_alpha, where=behind)
            np.abs(h_r, out=h_r)
        h_alpha -= np.floor(h_alpha, out=scratch(*h_alpha.shape))
        h_alpha *= TURN
        h_alpha -= pi
        np.minimum(h_alpha, _BELOW_PI, out=h_alpha)  # a difference that rounds to a whole turn
    return hs.reshape(2, J, x.size).transpose(2, 0, 1)


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
    W = whitening(Q_raw, count)
    hs = as_array("hs", hs, ("M", 2, "J"))
    M, _, J = hs.shape
    vs = np.zeros((count, 2, M))
    if J and count:
        by_line = hs.transpose(1, 2, 0)
        for block in blocks(M, count * J):
            h_alpha, h_r = np.ascontiguousarray(by_line[:, :, block])
            nearest = nearest_lines(z_raw, h_alpha, h_r, W)
            v_alpha = h_alpha.take(nearest)
            np.subtract(z_raw[0, :, None], v_alpha, out=v_alpha)
            wrap_in_place(v_alpha)
            vs[:, 0, block] = v_alpha
            np.subtract(z_raw[1, :, None], h_r.take(nearest), out=vs[:, 1, block])
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
    ws = as_weights(ws)
    M = ws.size
    vs = as_array("vs", vs, (M, "2I"))
    count, odd = divmod(vs.shape[1], 2)
    if odd:
        raise ValueError(f"vs: expected an even number of columns, got shape {vs.shape}")
    W = whitening(Q_raw, count)

    d2 = np.empty(M)
    by_observation = vs.T.reshape(count, 2, M)
    with np.errstate(over="ignore", invalid="ignore"):
        for block in blocks(M, count):
            v = by_observation[:, :, block]
            white = np.matmul(W, v, out=scratch(*v.shape))
            white *= white
            np.sum(white, axis=(0, 1), out=d2[block])
    return posterior(ws, d2)


STAGES = MappingProxyType(
    {
        "transition_model": transition_model,
        "compute_predicted_measurements": compute_predicted_measurements,
        "compute_innovations": compute_innovations,
        "measurement_weights": measurement_weights,
        "systematic_resample": systematic_resample,
    }
)
"""The reference stages by name."""


class ParticleFilter(filters.ParticleFilter):
    """Particle filter with the reference stages; see :class:`roboloc.filters.ParticleFilter`.

    Examples
    --------
    A thousand robots drive 1 m, with a speed right to 0.1 m/s: they are 1 m ahead on average and spread by 0.1 m.

    >>> pf = ParticleFilter(np.zeros((1000, 3)), np.diag([0.01, 0.0]), np.random.default_rng(0))
    >>> pf.transition_update([1.0, 0.0], 1.0)
    >>> pf.x.round(2).tolist(), np.sqrt(np.diag(pf.Sigma)).round(2).tolist()
    ([1.0, 0.0, 0.0], [0.1, 0.0, 0.0])
    """

    def __init__(
        self, x0: ArrayLike, R: ArrayLike, rng: np.random.Generator, stages: Any = STAGES, **options: Any
    ) -> None:
        super().__init__(x0, R, rng, stages=stages, **options)


class MonteCarloLocalization(filters.MonteCarloLocalization):
    """Monte Carlo localization with the reference stages; see :class:`roboloc.filters.MonteCarloLocalization`.

    Examples
    --------
    A robot is 2 m from a wall, give or take 10 cm, and sees it 1.9 m ahead, give or take 10 cm: it moves half way.

    >>> rng, Q = np.random.default_rng(0), np.diag([0.01, 0.01])
    >>> x0 = rng.normal(size=(10_000, 3)) * [0.1, 0.0, 0.0]
    >>> mcl = MonteCarloLocalization(x0, np.eye(2), [[0.0], [2.0]], [0.0, 0.0, 0.0], 3.0, rng)
    >>> mcl.measurement_update([[0.0], [1.9]], [Q])
    >>> mcl.x.round(2).tolist()
    [0.05, 0.0, 0.0]
    """

    def __init__(
        self,
        x0: ArrayLike,
        R: ArrayLike,
        map_lines: ArrayLike,
        tf_base_to_camera: ArrayLike,
        g: float,
        rng: np.random.Generator,
        stages: Any = STAGES,
        **options: Any,
    ) -> None:
        super().__init__(x0, R, map_lines, tf_base_to_camera, g, rng, stages=stages, **options)

    def measurement_update(self, z_raw: ArrayLike, Q_raw: ArrayLike) -> None:
        """Correct as the shell does; with the reference stages by :func:`roboloc_reference.cloud_weights.weigh`.

        Parameters
        ----------
        z_raw : (2, I) array_like
            Observed lines alpha, r in the frame of the scanner [rad, m].
        Q_raw : (I, 2, 2) array_like
            Their covariances; an array or a list of matrices.

        Raises
        ------
        ValueError
            If an argument has another shape, or if a stage returns something else.
        """
        if self._stages is not STAGES:
            super().measurement_update(z_raw, Q_raw)
            return
        self._refresh()
        self._reweigh(weigh(self.xs, self.ws, z_raw, Q_raw, self.map_lines, self.tf_base_to_camera))
