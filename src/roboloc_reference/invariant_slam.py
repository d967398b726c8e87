r"""SLAM with points by the right-invariant filter: why the standard one grows too sure, and what to do about it.

Turn the world about any point, the robot and all landmarks with it: every bearing and range stays what it was. So
no look can tell the heading of the whole, and its variance must never shrink. In the standard filter it does. Its
error is estimate minus truth, in which such a turn is the vector (-y, x, 1, -l_y, l_x, ...), and that depends on the
state. A filter that linearizes each look about another estimate has each time another vector in mind; what is hidden
along one shows along the next, and after a few looks the filter believes to have seen what cannot be seen.

Measure the error as a motion of the world instead, one turn common to all points and a shift for each of them:

.. math::

    \hat\theta = \theta + \xi_\theta, \qquad
    \hat p = C(\xi_\theta)\, p + V(\xi_\theta)\, \xi_p, \qquad
    \hat l_j = C(\xi_\theta)\, l_j + V(\xi_\theta)\, \xi_j

with C the rotation and C, V the parts of the exponential of SE(2). To first order xi is (e_x + y e_theta,
e_y - x e_theta, e_theta, ...), and now a turn of the world is (0, 0, 1, 0, 0, ...) whatever the estimate. The column
of the heading in H is zero, the other columns are those of the standard filter, and nothing can be learnt by mistake.
A robot that moves without noise keeps its xi, however far it drives and however wrong it is, so the prediction is
without a G; the noise of heading is a turn about the robot, which as a motion of the world moves all landmarks:

.. math::

    P \leftarrow P + N R N^T, \qquad
    N = \begin{pmatrix} \cos\theta & -\sin\theta & y \\ \sin\theta & \cos\theta & -x \\ 0 & 0 & 1 \\
                        0 & 0 & l_y \\ 0 & 0 & -l_x \\ & \vdots & \end{pmatrix}.

The mean is corrected by the motion, x <- exp(K v) x, not by a sum. The state is that of
:mod:`roboloc_reference.landmarks`, and so are the controls, the looks and the noise; only P is the covariance of xi.
The price is a prediction quadratic in the number of landmarks instead of linear.

Source: the model is that of CMU 16-833, homework 2; the filter follows A. Barrau and S. Bonnabel, *An EKF-SLAM
algorithm with consistency properties*; the fault was first shown by S. Julier and J. Uhlmann, *A counter example to
the theory of simultaneous localization and map building*.
"""

from math import cos, sin

import numpy as np
from numpy.typing import ArrayLike

from roboloc import se2
from roboloc.validation import as_array, as_floats
from roboloc_reference import landmarks
from roboloc_reference.gaussian import measurement_update
from roboloc_reference.landmark_map import as_state, block_diagonal, innovation


def init_landmarks(
    z: ArrayLike, Q: ArrayLike, pose: ArrayLike, pose_cov: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Begin the map as `landmarks.init_landmarks` does, with the covariance of the invariant error.

    Parameters
    ----------
    z : (2k,) array_like
        Bearing and range of each landmark, one after another [rad, m, rad, m, ...]; no range is negative.
    Q : (2, 2) array_like
        Covariance of one bearing and range, the same for all; their errors are independent of each other.
    pose : (3,) array_like
        Where the robot believes to be: x, y, theta [m, m, rad].
    pose_cov : (3, 3) array_like
        Covariance of the pose, in the ordinary sense, symmetric.

    Returns
    -------
    x : (3 + 2k,) ndarray
        Pose and landmarks [m, m, rad, m, m, ...].
    P : (3 + 2k, 3 + 2k) ndarray
        Covariance of their invariant error, exactly symmetric.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if z has odd length, or if a range is negative.

    Examples
    --------
    A robot that only doubts its heading puts the landmark 2 m ahead to 0.2 m, but the doubt is one turn of the world.

    >>> x, P = init_landmarks([0.0, 2.0], np.zeros((2, 2)), np.zeros(3), np.diag([0.0, 0.0, 0.01]))
    >>> np.sqrt(np.diag(P)).tolist(), np.sqrt(np.diag(to_ordinary(x, P))).tolist()
    ([0.0, 0.0, 0.1, 0.0, 0.0], [0.0, 0.0, 0.1, 0.0, 0.2])
    """
    x, Sigma = landmarks.init_landmarks(z, Q, pose, pose_cov)
    return x, to_invariant(x, Sigma)


def predict(
    x: ArrayLike, P: ArrayLike, control: ArrayLike, control_cov: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Predict: drive d ahead, then turn by alpha; the landmarks stay.

    Parameters
    ----------
    x : (3 + 2k,) array_like
        Pose and landmarks [m, m, rad, m, m, ...].
    P : (3 + 2k, 3 + 2k) array_like
        Covariance of their invariant error, symmetric.
    control : (2,) array_like
        Way ahead d and turn alpha [m, rad].
    control_cov : (3, 3) array_like
        Covariance of the error of the step along, across and in heading, in the frame of the robot, symmetric.

    Returns
    -------
    x : (3 + 2k,) ndarray
        Pose after the step, its heading not wrapped, and the landmarks unchanged.
    P : (3 + 2k, 3 + 2k) ndarray
        Covariance of the invariant error after the step.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Examples
    --------
    Without noise the error stays what it was, for all that the robot drives.

    >>> x, P = predict([0.0, 0.0, 0.3, 5.0, 1.0], np.eye(5), [2.0, 0.1], np.zeros((3, 3)))
    >>> x[3:].tolist(), P.tolist() == np.eye(5).tolist()
    ([5.0, 1.0], True)
    """
    x = as_state(x)
    n = x.size
    P = as_array("P", P, (n, n))
    d, alpha = as_floats("control", control, 2)
    R = as_array("control_cov", control_cov, (3, 3))

    c, s = cos(x[2]), sin(x[2])
    x = x.copy()
    x[:3] += [d * c, d * s, alpha]
    N = np.zeros((n, 3))
    N[:2, :2] = [[c, -s], [s, c]]
    N[:, 2] = _turn(x)
    N[2, 2] = 1.0
    return x, _symmetric(P + N @ R @ N.T)


def update(x: ArrayLike, P: ArrayLike, z: ArrayLike, Q: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Correct: condition pose and map on one look at every landmark, all at once.

    Parameters
    ----------
    x : (3 + 2k,) array_like
        Pose and landmarks before the look [m, m, rad, m, m, ...].
    P : (3 + 2k, 3 + 2k) array_like
        Covariance of their invariant error, symmetric.
    z : (2k,) array_like
        Bearing and range of each landmark, in their order [rad, m, rad, m, ...].
    Q : (2, 2) array_like
        Covariance of one bearing and range, symmetric; it may be singular where that of the innovation is not.

    Returns
    -------
    x : (3 + 2k,) ndarray
        Corrected pose, its heading not wrapped, and landmarks.
    P : (3 + 2k, 3 + 2k) ndarray
        Corrected covariance of the invariant error, exactly symmetric, in Joseph's form.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if a landmark lies on the robot, or if the innovation
        has a singular covariance.

    Examples
    --------
    A robot at the origin that doubts nothing but its heading, and that of the map with it, learns nothing from a
    look, however precise: it may all be turned.

    >>> x, P = [0.0, 0.0, 0.0, 2.0, 0.0], np.diag([0.0, 0.0, 0.01, 0.0, 0.0])
    >>> x, P = update(x, P, [0.05, 2.0], np.diag([1e-6, 1e-6]))
    >>> x.tolist(), np.sqrt(np.diag(P)).tolist()
    ([0.0, 0.0, 0.0, 2.0, 0.0], [0.0, 0.0, 0.1, 0.0, 0.0])
    """
    x = as_state(x)
    n = x.size
    k = (n - 3) // 2
    P = as_array("P", P, (n, n))
    Q = as_array("Q", Q, (2, 2))

    v, H = innovation(x, z)
    H[:, 2] = 0.0  # robot and map turned together look the same
    xi, P = measurement_update(np.zeros(n), P, v, block_diagonal(np.broadcast_to(Q, (k, 2, 2))), H)
    return _moved(xi, x), P


def invariant_error(x: ArrayLike, truth: ArrayLike) -> np.ndarray:
    """Return the motion of the world that carries the truth to the estimate.

    Parameters
    ----------
    x : (3 + 2k,) array_like
        Estimate of pose and landmarks [m, m, rad, m, m, ...].
    truth : (3 + 2k,) array_like
        The true pose and landmarks.

    Returns
    -------
    xi : (3 + 2k,) ndarray
        Invariant error, the turn in [-pi, pi) [m, m, rad, m, m, ...]. It is what P is the covariance of.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Examples
    --------
    Pose and map turned by 0.1 rad about the origin have an error of 0.1 rad, and no other.

    >>> c, s = np.cos(0.1), np.sin(0.1)
    >>> (invariant_error([c, s, 0.1, -3 * s, 3 * c], [1.0, 0.0, 0.0, 0.0, 3.0]).round(12) + 0.0).tolist()
    [0.0, 0.0, 0.1, 0.0, 0.0]
    """
    x = as_state(x)
    truth = as_array("truth", truth, x.shape)
    xi = np.empty_like(x)
    for i in _points(x):
        at = [i, i + 1, 2]  # a landmark with the heading of the robot is moved as a pose is
        xi[at] = se2.log(se2.compose(x[at], se2.inverse(truth[at])))
    return xi


def to_invariant(x: ArrayLike, Sigma: ArrayLike) -> np.ndarray:
    """Turn the covariance of the ordinary error, estimate minus truth, into that of the invariant one.

    Parameters
    ----------
    x : (3 + 2k,) array_like
        Pose and landmarks [m, m, rad, m, m, ...].
    Sigma : (3 + 2k, 3 + 2k) array_like
        Covariance of the ordinary error, symmetric.

    Returns
    -------
    P : (3 + 2k, 3 + 2k) ndarray
        Covariance of the invariant error, to first order, exactly symmetric.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Examples
    --------
    At the origin both errors of the pose are the same.

    >>> to_invariant(np.zeros(3), np.diag([1.0, 2.0, 3.0])).tolist()
    [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]]
    """
    x = as_state(x)
    Sigma = as_array("Sigma", Sigma, (x.size, x.size))
    return _sheared(Sigma, _turn(x))


def to_ordinary(x: ArrayLike, P: ArrayLike) -> np.ndarray:
    """Turn the covariance of the invariant error into that of the ordinary one, to evaluate or to draw it.

    Parameters
    ----------
    x : (3 + 2k,) array_like
        Pose and landmarks [m, m, rad, m, m, ...].
    P : (3 + 2k, 3 + 2k) array_like
        Covariance of the invariant error, symmetric.

    Returns
    -------
    Sigma : (3 + 2k, 3 + 2k) ndarray
        Covariance of estimate minus truth, to first order, exactly symmetric.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Examples
    --------
    A turn of the world by 0.1 rad moves what is 3 m away by 0.3 m.

    >>> np.sqrt(np.diag(to_ordinary([3.0, 0.0, 0.0], np.diag([0.0, 0.0, 0.01])))).round(12).tolist()
    [0.0, 0.3, 0.1]
    """
    x = as_state(x)
    P = as_array("P", P, (x.size, x.size))
    return _sheared(P, -_turn(x))


def _points(x: np.ndarray) -> tuple[int, ...]:
    """Return where in the state the robot's place and each landmark begin."""
    return (0, *range(3, x.size, 2))


def _turn(x: np.ndarray) -> np.ndarray:
    """Return what an error of heading alone is as a motion of the world: (y, -x, 0, l_y, -l_x, ...)."""
    turn = np.zeros_like(x)
    for i in _points(x):
        turn[i], turn[i + 1] = x[i + 1], -x[i]
    return turn


def _sheared(Sigma: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Return the covariance of e + turn e_theta, where Sigma is that of e."""
    half = Sigma + np.outer(turn, Sigma[2])
    return _symmetric(half + np.outer(half[:, 2], turn))


def _moved(xi: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Move robot and landmarks by their motions, which have the turn in common."""
    moved = x.copy()
    moved[2] += xi[2]
    for i in _points(x):
        moved[i : i + 2] = se2.compose(se2.exp(xi[[i, i + 1, 2]]), [*x[i : i + 2], 0.0])[:2]
    return moved


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    """Return the mean of a matrix and its transpose: symmetric to the last bit."""
    return (matrix + matrix.T) / 2
