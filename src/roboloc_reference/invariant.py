r"""The right-invariant extended Kalman filter on SE(2).

A belief is a pose X, the matrix of rotation R and position p, and a covariance P of the error xi of a motion of
the whole world: estimate = exp(xi) truth. Twists are ordered v1, v2, omega. In these coordinates the error of a
robot that moves without noise does not change at all, however it moves and however large the error is, and a
landmark m observed in the robot's frame has a Jacobian that does not depend on the estimate:

.. math::

    X &\leftarrow X \exp(\zeta\,\Delta t), \qquad P \leftarrow P + \mathrm{Ad}_X\, W\, \mathrm{Ad}_X^T \\
    H &= \begin{pmatrix} -1 & 0 & m_y \\ 0 & -1 & -m_x \end{pmatrix}, \qquad
    S = H P H^T + R N R^T, \qquad L = P H^T S^{-1} \\
    X &\leftarrow \exp(L (X Y - b))\, X, \qquad P \leftarrow (I - L H) P (I - L H)^T + L R N R^T L^T

Here b = (m, 1) is the landmark and Y what the robot sees of it, both with a 1 below; the third row of X Y - b is
always 0 and is left out, and the rows of all landmarks are stacked.

Source: Michigan ROB530, homework 5, problem 1 (D), where the correction is printed with the transpose of X;
A. Barrau and S. Bonnabel, *The invariant extended Kalman filter as a stable observer*.
"""

import numpy as np
from numpy.typing import ArrayLike

from roboloc import se2
from roboloc.validation import as_array, as_number

# A rotation, and the last number of an observation, may be off by what thousands of products can do.
_SLACK = 1e-6


def predict(
    X: ArrayLike, P: ArrayLike, twist: ArrayLike, W: ArrayLike, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Push a belief through the motion.

    Parameters
    ----------
    X : (3, 3) array_like
        Pose as a matrix: rotation, position, and a last row 0, 0, 1.
    P : (3, 3) array_like
        Covariance of the right-invariant error, symmetric.
    twist : (3,) array_like
        Velocity v1, v2, omega in the robot's frame [m/s, m/s, rad/s].
    W : (3, 3) array_like
        Covariance of the error of this step's motion, in the robot's frame [m, m, rad]. It is that of the
        whole step: it is not multiplied by dt.
    dt : float
        Duration of the step [s], not negative.

    Returns
    -------
    X : (3, 3) ndarray
        Predicted pose.
    P : (3, 3) ndarray
        Predicted covariance, exactly symmetric.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if X is no pose, or if dt is negative.

    Notes
    -----
    Source: Michigan ROB530, homework 5, problem 1 (D).

    Examples
    --------
    A quarter circle of radius 1 m to the left in one second; without noise the error is the same as before.

    >>> X, P = predict(np.eye(3), 0.01 * np.eye(3), [np.pi / 2, 0, np.pi / 2], np.zeros((3, 3)), 1.0)
    >>> X[:2, 2].round(12).tolist(), P.tolist() == (0.01 * np.eye(3)).tolist()
    ([1.0, 1.0], True)
    """
    pose = _pose(X)
    P = as_array("P", P, (3, 3))
    twist = as_array("twist", twist, (3,))
    W = as_array("W", W, (3, 3))
    dt = as_number("dt", dt, minimum=0.0)

    Ad = se2.adjoint(pose)
    return _matrix(se2.compose(pose, se2.exp(twist * dt))), _symmetric(P + Ad @ W @ Ad.T)


def correct(
    X: ArrayLike, P: ArrayLike, Y: ArrayLike, landmarks: ArrayLike, N: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Condition a belief on the positions of known landmarks in the robot's frame.

    Parameters
    ----------
    X : (3, 3) array_like
        Pose as a matrix: rotation, position, and a last row 0, 0, 1.
    P : (3, 3) array_like
        Covariance of the right-invariant error, symmetric.
    Y : (k, 3) array_like
        What is seen: rows y1, y2, 1, a position in the robot's frame [m]. k = 0 changes nothing.
    landmarks : (k, 2) array_like
        Positions of the landmarks seen [m].
    N : (2, 2) array_like
        Covariance of one observed position, in the robot's frame, symmetric, positive definite.

    Returns
    -------
    X : (3, 3) ndarray
        Corrected pose.
    P : (3, 3) ndarray
        Corrected covariance, exactly symmetric.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if X is no pose, if the last column of Y is not 1,
        or if the covariance of the innovation is singular.

    Notes
    -----
    Source: Michigan ROB530, homework 5, problem 1 (D).

    Examples
    --------
    A robot sure of its heading sees a landmark, expected 2 m ahead, at 1 m. Equally sure of its place as of the
    observation, it moves up by half a metre.

    >>> X, P = correct(np.eye(3), np.diag([1.0, 1.0, 0.0]), [[1.0, 0.0, 1.0]], [[2.0, 0.0]], np.eye(2))
    >>> X[:2, 2].tolist(), np.diag(P).tolist()
    ([0.5, 0.0], [0.5, 0.5, 0.0])
    """
    pose = _pose(X)
    P = as_array("P", P, (3, 3))
    landmarks = as_array("landmarks", landmarks if np.size(landmarks) else np.zeros((0, 2)), ("k", 2))
    k = len(landmarks)
    Y = as_array("Y", Y if k or np.size(Y) else np.zeros((0, 3)), (k, 3))
    if np.any(np.abs(Y[:, 2] - 1) > _SLACK):
        raise ValueError(f"Y: expected a last column of 1, got {Y[:, 2]}")
    N = as_array("N", N, (2, 2))

    Xbar = _matrix(pose)
    R = Xbar[:2, :2]
    H = np.zeros((k, 2, 3))
    H[:, 0, 0] = H[:, 1, 1] = -1.0
    H[:, 0, 2], H[:, 1, 2] = landmarks[:, 1], -landmarks[:, 0]
    H = H.reshape(2 * k, 3)
    v = (Y @ Xbar[:2].T - landmarks).ravel()
    Nbar = np.kron(np.eye(k), R @ N @ R.T)

    HP = H @ P
    try:
        L = np.linalg.solve(HP @ H.T + Nbar, HP).T
    except np.linalg.LinAlgError as error:
        raise ValueError("N: expected a covariance that makes S positive definite, got S singular") from error
    A = np.eye(3) - L @ H
    return _matrix(se2.compose(se2.exp(L @ v), pose)), _symmetric(A @ P @ A.T + L @ Nbar @ L.T)


def _pose(X: ArrayLike) -> np.ndarray:
    """Return the matrix of a pose as [x, y, theta], with theta in [-pi, pi]."""
    X = as_array("X", X, (3, 3))
    R = X[:2, :2]
    wrong = max(np.abs(R @ R.T - np.eye(2)).max(), np.abs(X[2] - [0.0, 0.0, 1.0]).max())
    if wrong > _SLACK or np.linalg.det(R) < 0:
        raise ValueError(f"X: expected a rotation, a position and a last row 0, 0, 1, got {X.tolist()}")
    return np.array([X[0, 2], X[1, 2], np.arctan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])])


def _matrix(pose: np.ndarray) -> np.ndarray:
    """Return the matrix of a pose; its rotation is one to the last digits, whatever came before."""
    x, y, theta = pose
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s, x], [s, c, y], [0.0, 0.0, 1.0]])


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    """Return the mean of a matrix and its transpose: symmetric to the last bit."""
    return (matrix + matrix.T) / 2
