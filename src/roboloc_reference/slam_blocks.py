r"""A step of SLAM with lines on a large map: only what changes is touched.

The equations of `gaussian` cost as if everything had to do with everything: with n = 3 + 2J entries of the state,
the product G_x Sigma G_x^T alone takes 4 n^3 operations, 3e10 for a thousand lines. Three things are known beforehand.

*The robot moves, the walls do not.* G_x is that of the pose beside an identity, so that motion changes three rows of
Sigma and the columns to match: a product of 3 by 3 with 3 by n.

*A scan shows few lines.* The derivatives H of K lines are 0 but for the pose and these lines, together a state of
their own with 3 + 2K entries t. So H Sigma needs the rows t of Sigma alone, and S = H Sigma H^T + Q their columns t.

*The correction has rank 2K, and a covariance is symmetric.* With the Cholesky factor S = L L^T,

.. math::

    W = L^{-1} H \Sigma, \qquad x \leftarrow x + W^T L^{-1} v, \qquad \Sigma \leftarrow \Sigma - W^T W,

and the last is one pass over one triangle of Sigma, the BLAS routine syrk, in place. This pass is all that grows with
n^2, and it cannot be avoided: each line that is seen tells something about every other.

The price is Joseph's form, which costs n^3. Sigma - W^T W is symmetric whatever happens, and equal to rounding, but
where an update takes away nearly all of a variance it may end below zero by the rounding of what was there before.
For a map of a thousand lines it is the only choice; for six, `gaussian.measurement_update` is the better one.

Source: the structure is that of any text, for example S. Thrun, W. Burgard, D. Fox, *Probabilistic Robotics*,
section 10.2.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular
from scipy.linalg.blas import dsyrk

from roboloc.angles import wrap
from roboloc.validation import as_array, as_number
from roboloc_reference import slam
from roboloc_reference.motion import compute_dynamics


class BlockEkfSlam:
    """EKF SLAM on a large map, for lines that are known: the same belief as that of `slam` and `gaussian`, faster.

    Parameters
    ----------
    x0 : (3 + 2J,) array_like
        Pose x, y, theta and lines alpha, r at the start [m, m, rad, rad, m, ...].
    Sigma0 : (3 + 2J, 3 + 2J) array_like
        Covariance at the start, symmetric, no negative eigenvalue; 0 for lines that are certain.
    R : (2, 2) array_like
        Covariance of the control, symmetric.
    tf_base_to_camera : (3,) array_like
        Pose of the scanner in the frame of the robot [m, m, rad].

    Attributes
    ----------
    x : (3 + 2J,) ndarray
        Mean; neither the heading nor the lines are wrapped.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Examples
    --------
    A robot drives 1 m, give or take 0.1 m, towards a wall that is known to be 3 m ahead, and sees it 1.9 m ahead, give
    or take 0.1 m. It believes itself half way between the two.

    >>> x0, tf = [0.0, 0.0, 0.0, 0.0, 3.0], [0.0, 0.0, 0.0]
    >>> ekf = BlockEkfSlam(x0, np.zeros((5, 5)), np.diag([0.01, 0.0]), tf)
    >>> ekf.transition_update([1.0, 0.0], 1.0)
    >>> ekf.correct([0], [[0.0], [1.9]], [np.diag([0.01, 0.01])])
    >>> ekf.x.round(12).tolist(), ekf.Sigma[0, 0].round(12).tolist()
    ([1.05, 0.0, 0.0, 0.0, 3.0], 0.005)
    """

    def __init__(self, x0: ArrayLike, Sigma0: ArrayLike, R: ArrayLike, tf_base_to_camera: ArrayLike) -> None:
        x0 = as_array("x0", x0, ("3 + 2J",))
        n = x0.size
        if n < 3 or n % 2 == 0:
            raise ValueError(f"x0: expected shape (3 + 2J,), got shape ({n},)")
        self.x = x0.copy()
        # Only the lower triangle is kept up to date, column by column in memory: those of the pose are the first.
        self._lower = np.array(as_array("Sigma0", Sigma0, (n, n)), order="F")
        self._R = as_array("R", R, (2, 2)).copy()
        self._tf = as_array("tf_base_to_camera", tf_base_to_camera, (3,)).copy()

    @property
    def Sigma(self) -> np.ndarray:
        """The covariance, (3 + 2J, 3 + 2J); made of its triangle at each call."""
        below = np.tril(self._lower, -1)
        return below + below.T + np.diag(np.diag(self._lower))

    def transition_update(self, u: ArrayLike, dt: float) -> None:
        """Predict: move the belief by a control.

        Parameters
        ----------
        u : (2,) array_like
            Control V, omega [m/s, rad/s].
        dt : float
            Duration of the control [s], not negative.

        Raises
        ------
        ValueError
            If an argument has another shape or is not finite, or if dt is negative.
        """
        dt = as_number("dt", dt, minimum=0.0)
        self.x[:3], Gx, Gu = compute_dynamics(self.x[:3], u, dt)
        pose = self._rows([0, 1, 2])[:, :3]
        self._lower[:3, :3] = Gx @ pose @ Gx.T + dt * (Gu @ self._R @ Gu.T)
        self._lower[3:, :3] = self._lower[3:, :3] @ Gx.T

    def correct(self, lines: ArrayLike, z_raw: ArrayLike, Q_raw: ArrayLike) -> None:
        """Correct: condition the belief on observed lines of which it is known which they are.

        Parameters
        ----------
        lines : (K,) array_like of int
            Which line of the map each observation is of, counted from 0; a line may occur twice.
        z_raw : (2, K) array_like
            Observed lines alpha, r in the frame of the scanner [rad, m].
        Q_raw : (K, 2, 2) array_like
            Their covariances, symmetric, positive definite.

        Raises
        ------
        ValueError
            If an argument has another shape or is not finite, if a line is none of the map, or if a covariance of
            the innovation is not positive definite.
        """
        lines = as_array("lines", lines if np.size(lines) else np.zeros(0), ("K",))
        K, J = lines.size, (self.x.size - 3) // 2
        if np.any((lines < 0) | (lines >= J) | (lines % 1 != 0)):
            raise ValueError(f"lines: expected whole numbers from 0 to {J - 1}, got {lines.tolist()}")
        z_raw = as_array("z_raw", z_raw, (2, K))
        Q_raw = as_array("Q_raw", Q_raw if K else np.zeros((0, 2, 2)), (K, 2, 2))
        if not K:
            return

        j = lines.astype(int)
        t = np.concatenate([[0, 1, 2], (3 + 2 * j[:, None] + [0, 1]).ravel()])
        hs, Hs = slam.compute_predicted_measurements(self.x[t], self._tf, fixed=0)
        v = z_raw - hs
        v[0] = wrap(v[0])
        H = Hs.reshape(2 * K, t.size)

        HSigma = H @ self._rows(t)
        S = HSigma[:, t] @ H.T
        for i, Q in enumerate(Q_raw):
            S[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] += Q
        try:
            L = np.linalg.cholesky(S)
        except np.linalg.LinAlgError as error:
            raise ValueError("Q_raw: expected H Sigma H^T + Q positive definite, got it otherwise") from error
        W = solve_triangular(L, HSigma, lower=True)
        self.x += W.T @ solve_triangular(L, v.T.ravel(), lower=True)
        self._lower = dsyrk(-1.0, W.T, beta=1.0, c=self._lower, lower=True, overwrite_c=True)

    def _rows(self, t: ArrayLike) -> np.ndarray:
        """Return some rows of the covariance, each from a row of the triangle and the column that continues it."""
        return np.stack([np.concatenate([self._lower[i, :i], self._lower[i:, i]]) for i in t])
