r"""A particle filter on poses, driven by velocities and corrected by bearings and ranges.

A belief is a cloud of poses with weights. Prediction moves each particle by a control of its own, drawn about
the one that was asked for; correction multiplies its weight by the likelihood of the observation there. The
likelihoods are multiplied as sums of logarithms and scaled by the largest before they leave that form, so no
cloud is ever too far from the observation to be weighed.

The effective sample size of the weights says when to resample: below a threshold, half the number of particles
for example. Its ancestors are drawn systematically, and afterwards every weight is 1/M.

Source: Michigan ROB530, homework 5, problem 1 (C), where the size is compared with itself.
"""

import warnings

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import wrap
from roboloc.validation import as_array
from roboloc_reference.velocity import motions, noise, range_bearings

__all__ = ["correct", "effective_sample_size", "predict"]


def predict(
    xs: ArrayLike, u: ArrayLike, alphas: ArrayLike, dt: float, rng: np.random.Generator
) -> np.ndarray:
    """Move every particle by a control drawn for it.

    Parameters
    ----------
    xs : (M, 3) array_like
        Poses [m, m, rad].
    u : (3,) array_like
        Control v, omega, gamma that was asked for [m/s, rad/s, rad/s].
    alphas : (6,) array_like
        Noise of the control; see :func:`roboloc_reference.velocity.noise`.
    dt : float
        Duration of the step [s].
    rng : numpy.random.Generator
        Source of the draws: M times three normal numbers, row by row.

    Returns
    -------
    (M, 3) ndarray
        Poses after the step [m, m, rad]; the headings are not wrapped.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if an alpha is negative.

    Notes
    -----
    Source: Michigan ROB530, homework 5, problem 1 (C).

    Examples
    --------
    A thousand robots told to drive 1 m, with a speed right to 0.1 m/s, spread over a decimetre.

    >>> alphas, rng = [0.01, 0.0, 0.0, 0.0, 0.0, 0.0], np.random.default_rng(0)
    >>> predict(np.zeros((1000, 3)), [1.0, 0.0, 0.0], alphas, 1.0, rng).std(axis=0).round(2).tolist()
    [0.1, 0.0, 0.0]
    """
    xs = as_array("xs", xs, ("M", 3))
    u = as_array("u", u, (3,))
    sigma = np.sqrt(np.diag(noise(u, alphas)))
    return motions(xs, u + sigma * rng.normal(size=xs.shape), dt)


def correct(xs: ArrayLike, ws: ArrayLike, z: ArrayLike, landmarks: ArrayLike, Q: ArrayLike) -> np.ndarray:
    """Weigh the particles by bearings and ranges of known landmarks.

    Parameters
    ----------
    xs : (M, 3) array_like
        Poses [m, m, rad].
    ws : (M,) array_like
        Weights before, none negative; their sum does not matter.
    z : (2k,) array_like
        Observations: bearing, range, bearing, range, ... [rad, m]. k = 0 only normalizes.
    landmarks : (k, 2) array_like
        Positions of the landmarks seen [m].
    Q : (2, 2) array_like
        Covariance of one observation, symmetric, positive definite.

    Returns
    -------
    (M,) ndarray
        Weights after, of sum 1.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if a weight is negative, or if Q is not positive
        definite.

    Warns
    -----
    RuntimeWarning
        If no particle is possible: all weights were 0. The weights returned are equal.

    Notes
    -----
    Source: Michigan ROB530, homework 5, problem 1 (C).

    Examples
    --------
    A landmark is seen one standard deviation nearer than the first particle expects it and two nearer than the
    second: the first is exp(3/2) = 4.48 times as probable.

    >>> ws = correct([[0, 0, 0], [-1, 0, 0]], [0.5, 0.5], [0.0, 9.0], [[10.0, 0.0]], np.diag([0.01, 1.0]))
    >>> round(float(ws[0] / ws[1]), 2)
    4.48
    """
    xs = as_array("xs", xs, ("M", 3))
    ws = _weights(ws, len(xs))
    landmarks = as_array("landmarks", landmarks if np.size(landmarks) else np.zeros((0, 2)), ("k", 2))
    z = as_array("z", z, (2 * len(landmarks),)).reshape(-1, 2)
    Q = as_array("Q", Q, (2, 2))
    try:
        L = np.linalg.cholesky(Q)
    except np.linalg.LinAlgError as error:
        raise ValueError(f"Q: expected a positive definite matrix, got {Q.tolist()}") from error

    if not ws.any():
        if ws.size:
            warnings.warn("no particle is possible: the weights are made equal", RuntimeWarning, stacklevel=2)
        return np.full(len(ws), 1.0 / max(len(ws), 1))
    v = z - range_bearings(xs, landmarks)
    v[..., 0] = wrap(v[..., 0])
    # With Q = L L^T the exponent is half the square of e = L^-1 v.
    e0 = v[..., 0] / L[0, 0]
    e1 = (v[..., 1] - L[1, 0] * e0) / L[1, 1]
    with np.errstate(divide="ignore"):
        logs = np.log(ws) - 0.5 * np.sum(e0 * e0 + e1 * e1, axis=1)
    likely = np.exp(logs - logs.max())
    return likely / likely.sum()


def _weights(ws: ArrayLike, size: int) -> np.ndarray:
    ws = as_array("ws", ws, (size,))
    if np.any(ws < 0):
        raise ValueError(f"ws: expected no negative weight, got {ws.min()}")
    return ws


def effective_sample_size(ws: ArrayLike) -> float:
    """Return how many equal weights would be as uneven as these: (sum w)^2 / sum w^2.

    Parameters
    ----------
    ws : (M,) array_like
        Weights, none negative and not all 0; their sum does not matter.

    Returns
    -------
    float
        Between 1 (one particle has all the weight) and M (all weigh the same).

    Raises
    ------
    ValueError
        If the argument has another shape or is not finite, or if a weight is negative, or if all are 0.

    Notes
    -----
    Source: A. Kong, J. S. Liu, W. H. Wong, *Sequential imputations and Bayesian missing data problems*; Michigan
    ROB530, homework 5, problem 1 (C).

    Examples
    --------
    Of four particles two have died, and the others share the weight: two are left in effect.

    >>> effective_sample_size([0.5, 0.0, 0.5, 0.0])
    2.0
    """
    ws = as_array("ws", ws, ("M",))
    if np.any(ws < 0.0) or not np.any(ws):
        raise ValueError(f"ws: expected none negative and not all 0, got {np.array2string(ws, threshold=20)}")
    ws = ws / ws.max()
    return float(ws.sum() ** 2 / (ws @ ws))
