"""What the extended Kalman filters that see lines have in common: how a scan corrects them."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from roboloc.filters.ekf import Ekf
from roboloc.validation import as_array, as_number


class LineEkf(Ekf):
    """Extended Kalman filter corrected by the lines of a scan; what it predicts of them is for its subclasses to say.

    Parameters
    ----------
    x0 : (n,) array_like
        Mean at the start.
    Sigma0 : (n, n) array_like
        Covariance at the start, symmetric, no negative eigenvalue.
    R : (2, 2) array_like
        Covariance of the control, symmetric, no negative eigenvalue.
    tf_base_to_camera : (3,) array_like
        Pose of the scanner in the frame of the robot [m, m, rad].
    g : float
        Validation gate in standard deviations, not negative.
    stages : mapping or object, optional
        What supplies the functions.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if a covariance is none, or if g is negative.
    """

    def __init__(
        self,
        x0: ArrayLike,
        Sigma0: ArrayLike,
        R: ArrayLike,
        tf_base_to_camera: ArrayLike,
        g: float,
        stages: Any = None,
    ) -> None:
        super().__init__(x0, Sigma0, R, stages=stages)
        self.tf_base_to_camera = as_array("tf_base_to_camera", tf_base_to_camera, (3,)).copy()
        self.g = as_number("g", g, minimum=0.0)

    def compute_predicted_measurements(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lines of the map as the scanner would report them at the present mean, and their derivatives."""
        raise NotImplementedError

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
        H : (K, 2, n) ndarray
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
        results = {"v": ("K", 2), "Q": ("K", 2, 2), "H": ("K", 2, self.x.size)}
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
        H : (2K, n) ndarray
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
        results = {"z": (k,), "Q": (k, k), "H": (k, self.x.size)}
        return self._call("measurement_model", results, v, Q, H)

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
