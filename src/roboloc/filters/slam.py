"""The extended Kalman filter of a robot that sees lines and makes the map of them."""

from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from roboloc.filters.lines import LineEkf
from roboloc.validation import as_array, as_number


class EkfSlam(LineEkf):
    """Extended Kalman filter of a pose and of the lines of a map, corrected by the lines of a scan.

    The state is the pose followed by the lines, x, y, theta, alpha_1, r_1, ..., alpha_J, r_J. It moves as the
    pose does; a correction goes through the same four stages as in localization, with derivatives by the whole
    state.

    Parameters
    ----------
    x0 : (3 + 2J,) array_like
        Pose and lines at the start [m, m, rad, rad, m, ...].
    Sigma0 : (3 + 2J, 3 + 2J) array_like
        Covariance at the start, symmetric, no negative eigenvalue; 0 for the lines that are fixed.
    R : (2, 2) array_like
        Covariance of the control, symmetric, no negative eigenvalue.
    tf_base_to_camera : (3,) array_like
        Pose of the scanner in the frame of the robot [m, m, rad].
    g : float
        Validation gate in standard deviations, not negative.
    fixed : int
        How many lines, counted from the first, are certain.
    stages : mapping or object, optional
        What supplies the functions: a mapping from names, or anything with attributes so named. The names are
        ``transition_model``, ``transition_update``, ``compute_predicted_measurements``,
        ``compute_innovations``, ``measurement_model`` and ``measurement_update``; only those that are called
        are needed. The first is ``(x, u, dt)`` to ``g, Gx, Gu`` of the whole state, the third ``(x,
        tf_base_to_camera, fixed)`` to ``hs, Hs``.

    Attributes
    ----------
    x : (3 + 2J,) ndarray
        Mean; neither the heading nor the lines are wrapped.
    Sigma : (3 + 2J, 3 + 2J) ndarray
        Covariance.
    R, tf_base_to_camera, g, fixed
        As given.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if a covariance is none, if g is negative, or if
        `fixed` is no whole number or negative.

    Examples
    --------
    A filter whose stages find that no line matches keeps its belief, the map included.

    >>> stages = {
    ...     "compute_predicted_measurements": lambda x, tf, fixed: (x[3:, None], np.zeros((1, 2, 5))),
    ...     "compute_innovations": lambda z_raw, Q_raw, hs, Hs, Sigma, g: ([], [], np.zeros((0, 2, 5))),
    ...     "measurement_model": lambda v, Q, H: (np.zeros(0), np.zeros((0, 0)), np.zeros((0, 5))),
    ...     "measurement_update": lambda x, Sigma, z, Q, H: (x, Sigma),
    ... }
    >>> x0, tf = [1.0, 2.0, 0.0, 0.5, 4.0], [0.1, 0.0, 0.0]
    >>> slam = EkfSlam(x0, np.eye(5), np.eye(2), tf, 3.0, fixed=0, stages=stages)
    >>> slam.measurement_update([[0.0], [1.9]], [np.eye(2)])
    >>> slam.map_lines.tolist()
    [[0.5], [4.0]]
    """

    notebooks = MappingProxyType(
        {
            **LineEkf.notebooks,
            "transition_model": "line-slam",
            "compute_predicted_measurements": "line-slam",
        }
    )

    def __init__(
        self,
        x0: ArrayLike,
        Sigma0: ArrayLike,
        R: ArrayLike,
        tf_base_to_camera: ArrayLike,
        g: float,
        fixed: int = 2,
        stages: Any = None,
    ) -> None:
        x0 = as_array("x0", x0, ("3 + 2J",))
        if x0.size < 3 or x0.size % 2 == 0:
            raise ValueError(f"x0: expected shape (3 + 2J,), got shape ({x0.size},)")
        super().__init__(x0, Sigma0, R, tf_base_to_camera, g, stages=stages)
        number = as_number("fixed", fixed, minimum=0.0)
        if number != int(number):
            raise ValueError(f"fixed: expected a whole number, got {number}")
        self.fixed = int(number)

    @property
    def map_lines(self) -> np.ndarray:
        """The lines alpha, r of the map as it is believed, (2, J) [rad, m]."""
        return self.x[3:].reshape(-1, 2).T.copy()

    def transition_model(self, u: ArrayLike, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return g, Gx and Gu of pose and lines at the present mean, from the stage ``transition_model``.

        Parameters
        ----------
        u : (2,) array_like
            Control V, omega [m/s, rad/s].
        dt : float
            Duration of the control [s].

        Returns
        -------
        g : (3 + 2J,) ndarray
            The mean after the motion.
        Gx : (3 + 2J, 3 + 2J) ndarray
            Derivative by the state.
        Gu : (3 + 2J, 2) ndarray
            Derivative by the control.

        Raises
        ------
        MissingStageError
            If the stage is not supplied or not written yet.
        ValueError
            If the stage returns something else.
        """
        n = self.x.size
        results = {"g": (n,), "Gx": (n, n), "Gu": (n, 2)}
        return self._call("transition_model", results, self.x.copy(), as_array("u", u, (2,)).copy(), dt)

    def compute_predicted_measurements(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lines of the map as the scanner would report them at the present mean.

        Returns
        -------
        hs : (2, J) ndarray
            Lines alpha, r in the frame of the scanner [rad, m].
        Hs : (J, 2, 3 + 2J) ndarray
            Their derivatives by the state.

        Raises
        ------
        MissingStageError
            If the stage is not supplied or not written yet.
        ValueError
            If the stage returns something else.
        """
        n = self.x.size
        J = (n - 3) // 2
        arguments = (self.x.copy(), self.tf_base_to_camera.copy(), self.fixed)
        return self._call("compute_predicted_measurements", {"hs": (2, J), "Hs": (J, 2, n)}, *arguments)
