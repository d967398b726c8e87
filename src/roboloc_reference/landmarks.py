r"""SLAM with points: a robot that maps landmarks by bearing and range, and finds itself among them.

The state is the pose and the landmarks, x = (x, y, theta, l_x, l_y, ...). A control moves the robot d ahead and
then turns it by alpha; the error of the step is given in the frame of the robot, so it is turned into the world:

.. math::

    \Sigma \leftarrow G \Sigma G^T + L R L^T, \qquad
    G = \begin{pmatrix} 1 & 0 & -d \sin\theta \\ 0 & 1 & d \cos\theta \\ 0 & 0 & 1 \end{pmatrix}, \qquad
    L = \begin{pmatrix} \cos\theta & -\sin\theta & 0 \\ \sin\theta & \cos\theta & 0 \\ 0 & 0 & 1 \end{pmatrix}.

A landmark is seen at a bearing and a range. Both follow from landmark minus pose, delta, with q its square:

.. math::

    z = \begin{pmatrix} \operatorname{atan2}(\delta_y, \delta_x) - \theta \\ \sqrt{q} \end{pmatrix}, \qquad
    H_p = \begin{pmatrix} \delta_y / q & -\delta_x / q & -1 \\
                          -\delta_x / \sqrt{q} & -\delta_y / \sqrt{q} & 0 \end{pmatrix}, \qquad
    H_l = \begin{pmatrix} -\delta_y / q & \delta_x / q \\
                          \delta_x / \sqrt{q} & \delta_y / \sqrt{q} \end{pmatrix}.

A landmark enters the state at l = (x + r cos(beta + theta), y + r sin(beta + theta)). Where the robot is wrong the
landmark is wrong with it: with J_pose and J_z the derivatives of l, its covariance with the pose is
J_pose Sigma_pose, and that of two landmarks is J_pose Sigma_pose J_pose'^T. Zeros in these places, as a first guess
would have them, claim what nobody knows: that the map is independent of the robot that drew it.

Every landmark is seen in every step and known by its place in the list, so there is no association here.

Source: CMU 16-833 (Robot Localization and Mapping), homework 2, problems 1 to 3.
"""

from math import cos, sin

import numpy as np
from numpy.typing import ArrayLike

from roboloc.validation import as_array, as_floats
from roboloc_reference.gaussian import measurement_update
from roboloc_reference.landmark_map import (
    as_pairs,
    as_state,
    block_diagonal,
    evaluate,
    innovation,
    measurement,
)

__all__ = ["evaluate", "init_landmarks", "innovation", "measurement", "predict", "update"]


def init_landmarks(
    z: ArrayLike, Q: ArrayLike, pose: ArrayLike, pose_cov: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Begin the map: landmarks where the first look of an uncertain robot puts them.

    Parameters
    ----------
    z : (2k,) array_like
        Bearing and range of each landmark, one after another [rad, m, rad, m, ...]; no range is negative.
    Q : (2, 2) array_like
        Covariance of one bearing and range, the same for all; their errors are independent of each other.
    pose : (3,) array_like
        Where the robot believes to be: x, y, theta [m, m, rad].
    pose_cov : (3, 3) array_like
        Covariance of the pose, symmetric.

    Returns
    -------
    x : (3 + 2k,) ndarray
        Pose and landmarks [m, m, rad, m, m, ...].
    Sigma : (3 + 2k, 3 + 2k) ndarray
        Their covariance, exactly symmetric, with all cross-covariances.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if z has odd length, or if a range is negative.

    Notes
    -----
    Source: CMU 16-833, homework 2, problem 1.3 and 3.1.

    Examples
    --------
    A robot that does not know its place to 0.1 m sees a landmark 2 m ahead, to 0.01 m. The landmark is not known
    better than the robot, but how far apart the two are is known to 0.01 m.

    >>> x, Sigma = init_landmarks([0.0, 2.0], np.diag([0.0, 1e-4]), np.zeros(3), np.diag([0.01, 0.0, 0.0]))
    >>> x[3:].tolist(), round(float(Sigma[3, 3]), 12)
    ([2.0, 0.0], 0.0101)
    >>> round(float(np.sqrt(Sigma[0, 0] + Sigma[3, 3] - 2 * Sigma[0, 3])), 12)
    0.01
    """
    beta, r = as_pairs("z", z).T
    Q = as_array("Q", Q, (2, 2))
    pose = as_array("pose", pose, (3,))
    pose_cov = as_array("pose_cov", pose_cov, (3, 3))
    if r.size and r.min() < 0.0:
        raise ValueError(f"z: expected no negative range, got {r.min()}")

    k = r.size
    along = np.stack([np.cos(beta + pose[2]), np.sin(beta + pose[2])], axis=-1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    J_z = np.stack([r[:, None] * across, along], axis=-1)  # by bearing and range
    to_all = np.zeros((3 + 2 * k, 3))  # derivative of the whole state by the pose
    to_all[:3] = np.eye(3)
    to_all[3:, :2] = np.tile(np.eye(2), (k, 1))
    to_all[3:, 2] = J_z[:, :, 0].ravel()  # a turn of the robot acts as a bearing does

    Sigma = to_all @ pose_cov @ to_all.T
    Sigma[3:, 3:] += block_diagonal(J_z @ Q @ J_z.swapaxes(1, 2))
    return np.concatenate([pose, (pose[:2] + r[:, None] * along).ravel()]), (Sigma + Sigma.T) / 2


def predict(
    x: ArrayLike, Sigma: ArrayLike, control: ArrayLike, control_cov: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Predict: drive d ahead, then turn by alpha; the landmarks stay.

    Parameters
    ----------
    x : (3 + 2k,) array_like
        Pose and landmarks [m, m, rad, m, m, ...].
    Sigma : (3 + 2k, 3 + 2k) array_like
        Their covariance, symmetric.
    control : (2,) array_like
        Way ahead d and turn alpha [m, rad].
    control_cov : (3, 3) array_like
        Covariance of the error of the step along, across and in heading, in the frame of the robot, symmetric.

    Returns
    -------
    x : (3 + 2k,) ndarray
        Pose after the step, its heading not wrapped, and the landmarks unchanged.
    Sigma : (3 + 2k, 3 + 2k) ndarray
        Covariance after the step; the block of the landmarks is unchanged.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Notes
    -----
    Only the rows and columns of the pose are worked on: the cost is linear in k, but for the copy of Sigma.
    Source: CMU 16-833, homework 2, problem 1.1 and 1.2.

    Examples
    --------
    A robot that faces along y and may slip 0.1 m along its way is uncertain in y, not in x.

    >>> x = [0.0, 0.0, np.pi / 2]
    >>> x, Sigma = predict(x, np.zeros((3, 3)), [1.0, 0.2], np.diag([0.01, 0.0, 0.0]))
    >>> (x[:2].round(12) + 0.0).tolist(), np.sqrt(np.diag(Sigma)).round(12).tolist()
    ([0.0, 1.0], [0.0, 0.1, 0.0])
    """
    x = as_state(x)
    n = x.size
    Sigma = as_array("Sigma", Sigma, (n, n))
    d, alpha = as_floats("control", control, 2)
    R = as_array("control_cov", control_cov, (3, 3))

    c, s = cos(x[2]), sin(x[2])
    G = np.array([[1.0, 0.0, -d * s], [0.0, 1.0, d * c], [0.0, 0.0, 1.0]])
    L = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    x = x.copy()
    x[:3] += [d * c, d * s, alpha]
    Sigma = Sigma.copy()
    pose = G @ Sigma[:3, :3] @ G.T + L @ R @ L.T
    Sigma[:3, :3] = (pose + pose.T) / 2
    Sigma[:3, 3:] = G @ Sigma[:3, 3:]
    Sigma[3:, :3] = Sigma[:3, 3:].T
    return x, Sigma


def update(x: ArrayLike, Sigma: ArrayLike, z: ArrayLike, Q: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Correct: condition pose and map on one look at every landmark, all at once.

    Parameters
    ----------
    x : (3 + 2k,) array_like
        Pose and landmarks before the look [m, m, rad, m, m, ...].
    Sigma : (3 + 2k, 3 + 2k) array_like
        Their covariance, symmetric.
    z : (2k,) array_like
        Bearing and range of each landmark, in their order [rad, m, rad, m, ...].
    Q : (2, 2) array_like
        Covariance of one bearing and range, symmetric; it may be singular where that of the innovation is not.

    Returns
    -------
    x : (3 + 2k,) ndarray
        Corrected pose, its heading not wrapped, and landmarks.
    Sigma : (3 + 2k, 3 + 2k) ndarray
        Corrected covariance, exactly symmetric, in Joseph's form.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if a landmark lies on the robot, or if the innovation
        has a singular covariance.

    Notes
    -----
    All landmarks are linearized about the same x. One after another gives the same covariance and mean if each
    keeps that x, and something else if each is linearized where the one before has moved the mean.
    Source: CMU 16-833, homework 2, problem 2.

    Examples
    --------
    A robot knows a landmark 2 m ahead exactly and its own place to 0.1 m. It sees the landmark 0.1 m nearer, with
    an error of 0.1 m: it is believed to be half of that ahead.

    >>> x, Sigma = [0.0, 0.0, 0.0, 2.0, 0.0], np.diag([0.01, 0.0, 0.0, 0.0, 0.0])
    >>> x, Sigma = update(x, Sigma, [0.0, 1.9], np.diag([0.01, 0.01]))
    >>> float(x[0].round(12)), float(Sigma[0, 0].round(12))
    (0.05, 0.005)
    """
    x = as_state(x)
    n = x.size
    k = (n - 3) // 2
    Sigma = as_array("Sigma", Sigma, (n, n))
    z = as_array("z", z, (2 * k,))
    Q = as_array("Q", Q, (2, 2))

    v, H = innovation(x, z)
    return measurement_update(x, Sigma, v, block_diagonal(np.broadcast_to(Q, (k, 2, 2))), H)
