"""The extended Kalman filter of whatever is moved by a control [V, omega]."""

from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from roboloc.filters.shell import Shell
from roboloc.validation import as_array, as_covariance


class Ekf(Shell):
    """Extended Kalman filter of a state moved by a control [V, omega].

    Parameters
    ----------
    x0 : (n,) array_like
        Mean at the start.
    Sigma0 : (n, n) array_like
        Covariance at the start, symmetric, no negative eigenvalue.
    R : (2, 2) array_like
        Covariance of the control, symmetric, no negative eigenvalue.
    stages : mapping or object, optional
        What supplies the functions: a mapping from names, or anything with attributes so named. The names are
        ``compute_dynamics``, ``transition_update`` and ``measurement_update``; only those that are called are
        needed.

    Attributes
    ----------
    x : (n,) ndarray
        Mean.
    Sigma : (n, n) ndarray
        Covariance.
    R : (2, 2) ndarray
        Covariance of the control.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if a covariance is none.

    Examples
    --------
    A filter told that nothing ever moves stays where it is; asked to measure, it says what it lacks.

    >>> def compute_dynamics(x, u, dt):
    ...     return x, np.eye(3), np.zeros((3, 2))
    >>> def transition_update(g, Gx, Gu, Sigma, R, dt):
    ...     return g, Sigma
    >>> stages = {"compute_dynamics": compute_dynamics, "transition_update": transition_update}
    >>> ekf = Ekf([1.0, 2.0, 0.0], np.eye(3), np.eye(2), stages=stages)
    >>> ekf.transition_update([0.5, 0.0], 0.1)
    >>> ekf.x.tolist()
    [1.0, 2.0, 0.0]
    >>> ekf.measurement_update([0.1], [[1.0]], [[1.0, 0.0, 0.0]])
    Traceback (most recent call last):
        ...
    roboloc.filters.shell.MissingStageError: stage measurement_update: not supplied
    """

    notebooks = MappingProxyType(
        {
            "compute_dynamics": "motion-model",
            "transition_update": "motion-model",
            "compute_predicted_measurements": "line-measurements",
            "compute_innovations": "association-and-update",
            "measurement_model": "association-and-update",
            "measurement_update": "association-and-update",
        }
    )

    def __init__(self, x0: ArrayLike, Sigma0: ArrayLike, R: ArrayLike, stages: Any = None) -> None:
        super().__init__(stages)
        self.x = as_array("x0", x0, ("n",)).copy()
        self.Sigma = as_covariance("Sigma0", Sigma0, self.x.size).copy()
        self.R = as_covariance("R", R, 2).copy()

    def transition_model(self, u: ArrayLike, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return g, Gx and Gu at the present mean, from the stage ``compute_dynamics``.

        Parameters
        ----------
        u : (2,) array_like
            Control V, omega [m/s, rad/s].
        dt : float
            Duration of the control [s].

        Returns
        -------
        g : (n,) ndarray
            The mean after the motion.
        Gx : (n, n) ndarray
            Derivative by the state.
        Gu : (n, 2) ndarray
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
        return self._call("compute_dynamics", results, self.x.copy(), as_array("u", u, (2,)).copy(), dt)

    def transition_update(self, u: ArrayLike, dt: float) -> None:
        """Predict: move the belief by a control.

        Parameters
        ----------
        u : (2,) array_like
            Control V, omega [m/s, rad/s].
        dt : float
            Duration of the control [s].

        Raises
        ------
        MissingStageError
            If ``compute_dynamics`` or ``transition_update`` is not supplied or not written yet.
        ValueError
            If one of them returns something else.
        """
        g, Gx, Gu = self.transition_model(u, dt)
        arguments = (g, Gx, Gu, self.Sigma.copy(), self.R.copy(), dt)
        self._store("transition_update", *arguments)

    def measurement_update(self, z: ArrayLike, Q: ArrayLike, H: ArrayLike) -> None:
        """Correct: condition the belief on an innovation.

        Parameters
        ----------
        z : (k,) array_like
            Innovation: observation minus prediction.
        Q : (k, k) array_like
            Covariance of the observation.
        H : (k, n) array_like
            Derivative of the prediction by the state.

        Raises
        ------
        MissingStageError
            If ``measurement_update`` is not supplied or not written yet.
        ValueError
            If an argument has another shape, or if the stage returns something else.
        """
        z = as_array("z", z, ("k",)).copy()
        Q = as_array("Q", Q, (z.size, z.size)).copy()
        H = as_array("H", H, (z.size, self.x.size)).copy()
        self._store("measurement_update", self.x.copy(), self.Sigma.copy(), z, Q, H)

    def _store(self, name: str, *arguments: Any) -> None:
        n = self.x.size
        self.x, self.Sigma = self._call(name, {"x": (n,), "Sigma": (n, n)}, *arguments)
