r"""The unscented Kalman filter on poses, driven by velocities and corrected by bearings and ranges.

Instead of differentiating a function, it is evaluated at 2n + 1 sigma points which have the mean and the
covariance of the belief: the mean itself and, with the columns l_i of the lower root of (n + kappa) times the
covariance, mean + l_i and mean - l_i, of weights kappa / (n + kappa) and 1 / (2 (n + kappa)).

Three things are not as in the flat textbook case.

* The noise of the control passes through the motion too: predict draws its points for pose and control together,
  n = 6.
* A bearing has no mean by weighted sum, and with a negative kappa the direction of a weighted vector sum can point
  the wrong way. So a vector sum with the absolute weights says where to cut the circle, and the mean is that
  direction plus the weighted mean of the wrapped residuals. In the linear case this is the weighted mean,
  exactly. Headings need no such care: the motion never wraps them, so the points' headings lie on one line.
* With a negative kappa a weighted sum of squares about the mean may be negative. The sums are then taken about
  the image of the centre, whose own term vanishes; all others have positive weights.

Source: Michigan ROB530, homework 5, problem 1 (B), with its faults repaired (the control is missing, angles are
averaged and subtracted as numbers). The squares about the centre: S. Julier, J. Uhlmann and
H. Durrant-Whyte, *A new method for the nonlinear transformation of means and covariances*.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg.lapack import dpotrf

from roboloc.angles import wrap
from roboloc.validation import as_array, as_number
from roboloc_reference.gaussian import gain, symmetric
from roboloc_reference.velocity import motions


def sigma_points(mean: ArrayLike, cov: ArrayLike, kappa: float) -> tuple[np.ndarray, np.ndarray]:
    """Choose points and weights that have a given mean and covariance.

    Parameters
    ----------
    mean : (n,) array_like
        Mean.
    cov : (n, n) array_like
        Covariance, symmetric; it may be singular.
    kappa : float
        Spread, above -n; for a Gaussian n + kappa = 3 is the usual choice.

    Returns
    -------
    points : (2n+1, n) ndarray
        The mean, then mean + l_i, then mean - l_i.
    weights : (2n+1,) ndarray
        Their weights, of sum 1; the first has the sign of kappa.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if n + kappa is not positive, or if cov has a
        negative eigenvalue.

    Notes
    -----
    Source: Michigan ROB530, homework 5, problem 1 (B).

    Examples
    --------
    For one number of standard deviation 2 and kappa = 3 the outer points are 4 off, and weigh 1/8 each.

    >>> points, weights = sigma_points([10.0], [[4.0]], 3.0)
    >>> points.ravel().tolist(), weights.tolist()
    ([10.0, 14.0, 6.0], [0.75, 0.125, 0.125])
    """
    mean = as_array("mean", mean, ("n",))
    n = mean.size
    cov = as_array("cov", cov, (n, n))
    kappa = as_number("kappa", kappa)
    if n + kappa <= 0:
        raise ValueError(f"kappa: expected a number above {-n}, got {kappa}")
    spread = np.sqrt(n + kappa) * _root("cov", cov).T
    points = np.empty((2 * n + 1, n))
    points[:] = mean
    points[1 : n + 1] += spread
    points[n + 1 :] -= spread
    weights = np.full(2 * n + 1, 0.5 / (n + kappa))
    weights[0] = kappa / (n + kappa)
    return points, weights


def predict(
    mean: ArrayLike, cov: ArrayLike, u: ArrayLike, M: ArrayLike, dt: float, kappa: float
) -> tuple[np.ndarray, np.ndarray]:
    """Push a belief through the motion.

    Parameters
    ----------
    mean : (3,) array_like
        Mean pose [m, m, rad].
    cov : (3, 3) array_like
        Its covariance, symmetric.
    u : (3,) array_like
        Control v, omega, gamma [m/s, rad/s, rad/s].
    M : (3, 3) array_like
        Covariance of the control, symmetric; see :func:`roboloc_reference.velocity.noise`.
    dt : float
        Duration of the step [s], not negative.
    kappa : float
        Spread, above -6: there are 6 dimensions, pose and control.

    Returns
    -------
    mean : (3,) ndarray
        Predicted mean; the heading is not wrapped.
    cov : (3, 3) ndarray
        Predicted covariance, exactly symmetric.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if dt is negative, if 6 + kappa is not positive, or
        if cov or M has a negative eigenvalue.

    Notes
    -----
    Source: Michigan ROB530, homework 5, problem 1 (B).

    Examples
    --------
    A robot that does not know its heading to half a radian and drives 1 m ahead gets, on average, 0.88 m ahead:
    the average of the cosine. A linearized prediction says 1 m.

    >>> mean, cov = predict([0, 0, 0], np.diag([0, 0, 0.25]), [1, 0, 0], np.zeros((3, 3)), 1.0, -3.0)
    >>> mean.round(2).tolist()
    [0.88, 0.0, 0.0]
    """
    mean = as_array("mean", mean, (3,))
    u = as_array("u", u, (3,))
    joint = np.zeros((6, 6))
    joint[:3, :3] = as_array("cov", cov, (3, 3))
    joint[3:, 3:] = as_array("M", M, (3, 3))
    dt = as_number("dt", dt, minimum=0.0)

    points, weights = sigma_points(np.concatenate([mean, u]), joint, kappa)
    moved = motions(points[:, :3], points[:, 3:], dt)
    d = moved - moved[0]
    average = weights.dot(d)
    predicted = moved[0] + average
    if weights[0] >= 0:
        d -= average
    return predicted, symmetric((d.T * weights).dot(d))


def correct(
    mean: ArrayLike, cov: ArrayLike, z: ArrayLike, landmarks: ArrayLike, Q: ArrayLike, kappa: float
) -> tuple[np.ndarray, np.ndarray]:
    """Condition a belief on the bearings and ranges of known landmarks.

    Parameters
    ----------
    mean : (3,) array_like
        Mean pose [m, m, rad].
    cov : (3, 3) array_like
        Its covariance, symmetric.
    z : (2k,) array_like
        Observations: bearing, range, bearing, range, ... [rad, m]. k = 0 changes nothing.
    landmarks : (k, 2) array_like
        Positions of the landmarks seen [m].
    Q : (2, 2) array_like
        Covariance of one observation, symmetric, positive definite.
    kappa : float
        Spread, above -3.

    Returns
    -------
    mean : (3,) ndarray
        Corrected mean; the heading is not wrapped.
    cov : (3, 3) ndarray
        Corrected covariance, exactly symmetric.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if 3 + kappa is not positive, if cov or Q has a
        negative eigenvalue, or if the covariance of the innovation is singular.

    Notes
    -----
    The covariance is written as the sum of (d - K e)(d - K e)^T over the points plus K Q K^T, with d and e the
    deviations of state and observation: on paper it is Sigma - K S K^T, but it has no negative eigenvalue.
    Source: Michigan ROB530, homework 5, problem 1 (B).

    Examples
    --------
    A landmark 1 m straight behind is seen at plus or minus half a turn. Both are the same bearing, and the robot
    stays where it is.

    >>> for bearing in (-np.pi, np.pi):
    ...     mean, cov = correct([0, 0, 0], 1e-6 * np.eye(3), [bearing, 1], [[-1, 0]], 0.01 * np.eye(2), 0.0)
    ...     print(abs(mean).max() < 1e-8)
    True
    True
    """
    mean = as_array("mean", mean, (3,))
    cov = as_array("cov", cov, (3, 3))
    landmarks = as_array("landmarks", landmarks if np.size(landmarks) else np.zeros((0, 2)), ("k", 2))
    k = len(landmarks)
    z = as_array("z", z, (2 * k,)).reshape(k, 2)
    Q = as_array("Q", Q, (2, 2))
    _root("Q", Q)
    if k == 0:
        return mean.copy(), symmetric(cov)

    points, weights = sigma_points(mean, cov, kappa)
    dx, dy = landmarks[:, 0] - points[:, :1], landmarks[:, 1] - points[:, 1:2]
    seen = np.empty((len(points), k, 2))
    seen[..., 0] = np.arctan2(dy, dx) - points[:, 2:]
    seen[..., 1] = np.hypot(dx, dy)
    origin = seen[0].copy()
    origin[:, 0] = _direction(seen[..., 0], np.abs(weights))
    e = seen - origin
    e[..., 0] = wrap(e[..., 0])
    e = e.reshape(len(points), 2 * k)
    average = weights.dot(e)
    v = (z - origin).ravel() - average
    v[::2] = wrap(v[::2])
    e -= average if weights[0] >= 0 else e[0].copy()  # a row of itself would change on the way

    d = points - mean
    weighted = e.T * weights
    Qs = np.zeros((2 * k, 2 * k))
    for i in range(0, 2 * k, 2):
        Qs[i : i + 2, i : i + 2] = Q
    try:
        K = gain(weighted.dot(e) + Qs, weighted.dot(d))
    except np.linalg.LinAlgError as error:
        raise ValueError("Q: expected a covariance that makes S positive definite, got S singular") from error
    left = d - e.dot(K.T)
    return mean + K.dot(v), symmetric((left.T * weights).dot(left) + K.dot(Qs).dot(K.T))


def _direction(angles: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the directions (k,) of the vector sums of the columns of angles (m, k); no weight is negative."""
    return np.arctan2(weights @ np.sin(angles), weights @ np.cos(angles))


def _root(name: str, cov: np.ndarray) -> np.ndarray:
    """Return the lower triangular root of a covariance; a direction without variance has a zero column."""
    root, info = dpotrf(cov, lower=1, clean=1)
    if info == 0:
        return root
    left = cov.copy()
    n = len(left)
    slack = 1e-9 * np.abs(cov).max()
    root = np.zeros((n, n))
    for j in range(n):
        pivot = left[j, j]
        if pivot < -slack or (pivot <= 0 and np.abs(left[j:, j]).max() > slack):
            raise ValueError(f"{name}: expected no negative eigenvalue, got {np.linalg.eigvalsh(cov)[0]:.3g}")
        if pivot > n * np.finfo(float).eps * cov[j, j]:
            root[j:, j] = left[j:, j] / np.sqrt(pivot)
            left -= np.outer(root[:, j], root[:, j])
    return root
