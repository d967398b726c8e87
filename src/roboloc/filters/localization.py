"""The extended Kalman filter of a robot that sees lines and has a map of them."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from roboloc.filters.ekf import Ekf
from roboloc.validation import as_array, as_number


class EkfLocalization(Ekf):
    """Extended Kalman filter of a pose, corrected by the lines of a scan.

    A correction goes through four stages: the lines that the map predicts, the innovations of those observed
    lines that match one, the innovations stacked into one, and the update.

    Parameters
    ----------
    x0 : (3,) array_like
        Pose at the start [m, m, rad].
    Sigma0 : (3, 3) array_like
        Covariance at the start, symmetric, no negative eigenvalue.
    R : (2, 2) array_like
        Covariance of the control, symmetric, no negative eigenvalue.
    map_lines : (2, J) array_like
        Lines alpha, r of the map [rad, m].
    tf_base_to_camera : (3,) array_like
        Pose of the scanner in the frame of the robot [m, m, rad].
    g : float
        Validation gate in standard deviations, not negative.
    stages : mapping or object, optional
        What supplies the functions: a mapping from names, or anything with attributes so named. The names are
        ``compute_dynamics``, ``transition_update``, ``compute_predicted_measurements``,
        ``compute_innovations``, ``measurement_model`` and ``measurement_update``; only those that are called
        are needed.

    Attributes
    ----------
    x : (3,) ndarray
        Mean, the heading not wrapped.
    Sigma : (3, 3) ndarray
        Covariance.
    R, map_lines, tf_base_to_camera, g
        As given.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if a covariance is none, or if g is negative.

    Examples
    --------
    A filter whose stages find that no line matches keeps its belief.

    >>> stages = {
    ...     "compute_predicted_measurements": lambda x, map_lines, tf: (map_lines, np.zeros((1, 2, 3))),
    ...     "compute_innovations": lambda z_raw, Q_raw, hs, Hs, Sigma, g: ([], [], np.zeros((0, 2, 3))),
    ...     "measurement_model": lambda v, Q, H: (np.zeros(0), np.zeros((0, 0)), np.zeros((0, 3))),
    ...     "measurement_update": lambda x, Sigma, z, Q, H: (x, Sigma),
    ... }
    >>> map_lines, tf = [[0.0], [2.0]], [0.1, 0.0, 0.0]
    >>> ekf = EkfLocalization([1.0, 2.0, 0.0], np.eye(3), np.eye(2), map_lines, tf, 3.0, stages=stages)
    >>> ekf.measurement_update([[0.0], [1.9]], [np.eye(2)])
    >>> ekf.x.tolist()
    [1.0, 2.0, 0.0]
    """

    def __init__(
        self,
        x0: ArrayLike,
        Sigma0: ArrayLike,
        R: ArrayLike,
        map_lines: ArrayLike,
        tf_base_to_camera: ArrayLike,
        g: float,
        stages: Any = None,
    ) -> None:
        super().__init__(as_array("x0", x0, (3,)), Sigma0, R, stages=stages)
        self.map_lines = as_array("map_lines", map_lines, (2, "J")).copy()
        self.tf_base_to_camera = as_array("tf_base_to_camera", tf_base_to_camera, (3,)).copy()
        self.g = as_number("g", g, minimum=0.0)

    def compute_predicted_measurements(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lines that the map predicts at the present mean.

        Returns
        -------
        hs : (2, J) ndarray
            Lines alpha, r in the frame of the scanner [rad, m].
        Hs : (J, 2, 3) ndarray
            Their derivatives by the pose.

        Raises
        ------
        MissingStageError
            If the stage is not supplied or not written yet.
        ValueError
            If the stage returns something else.
        """
        J = self.map_lines.shape[1]
        arguments = (self.x.copy(), self.map_lines.copy(), self.tf_base_to_camera.copy())
        return self._call("compute_predicted_measurements", {"hs": (2, J), "Hs": (J, 2, 3)}, *arguments)

    def compute_innovations(
        self, z_raw: ArrayLike, Q_raw: ArrayLike
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Match observed lines with those of the map.

        Parameters
        ----------
        z_raw : (2, I) array_like
            Observed lines alpha, r in the frame of the scanner [rad, m].
        Q_raw : (I, 2, 2) array_like
            Their covariances; an array or a list of matrices.

        Returns
        -------
        v : (K, 2) ndarray
            Innovations of the lines that match.
        Q : (K, 2, 2) ndarray
            Covariances of these lines.
        H : (K, 2, 3) ndarray
            Derivatives of the predictions.

        Raises
        ------
        MissingStageError
            If a stage is not supplied or not written yet.
        ValueError
            If an argument has another shape, or if a stage returns something else.
        """
        z_raw = as_array("z_raw", z_raw, (2, "I")).copy()
        count = z_raw.shape[1]
        Q_raw = as_array("Q_raw", Q_raw if count else np.zeros((0, 2, 2)), (count, 2, 2)).copy()
        hs, Hs = self.compute_predicted_measurements()
        results = {"v": ("K", 2), "Q": ("K", 2, 2), "H": ("K", 2, 3)}
        return self._call("compute_innovations", results, z_raw, Q_raw, hs, Hs, self.Sigma.copy(), self.g)

    def measurement_model(
        self, z_raw: ArrayLike, Q_raw: ArrayLike
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Make one measurement of all lines that match.

        Parameters
        ----------
        z_raw : (2, I) array_like
            Observed lines alpha, r in the frame of the scanner [rad, m].
        Q_raw : (I, 2, 2) array_like
            Their covariances; an array or a list of matrices.

        Returns
        -------
        z : (2K,) ndarray
            Innovation.
        Q : (2K, 2K) ndarray
            Covariance of the observation.
        H : (2K, 3) ndarray
            Derivative of the prediction.

        Raises
        ------
        MissingStageError
            If a stage is not supplied or not written yet.
        ValueError
            If an argument has another shape, or if a stage returns something else.
        """
        v, Q, H = self.compute_innovations(z_raw, Q_raw)
        k = 2 * len(v)
        return self._call("measurement_model", {"z": (k,), "Q": (k, k), "H": (k, 3)}, v, Q, H)

    def measurement_update(self, z_raw: ArrayLike, Q_raw: ArrayLike) -> None:
        """Correct: condition the belief on the lines of a scan.

        Parameters
        ----------
        z_raw : (2, I) array_like
            Observed lines alpha, r in the frame of the scanner [rad, m].
        Q_raw : (I, 2, 2) array_like
            Their covariances; an array or a list of matrices.

        Raises
        ------
        MissingStageError
            If a stage is not supplied or not written yet.
        ValueError
            If an argument has another shape, or if a stage returns something else.
        """
        super().measurement_update(*self.measurement_model(z_raw, Q_raw))
