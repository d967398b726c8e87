"""The extended Kalman filter of a robot that sees lines and has a map of them."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from roboloc.filters.lines import LineEkf
from roboloc.validation import as_array


class EkfLocalization(LineEkf):
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
        super().__init__(as_array("x0", x0, (3,)), Sigma0, R, tf_base_to_camera, g, stages=stages)
        self.map_lines = as_array("map_lines", map_lines, (2, "J")).copy()

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
