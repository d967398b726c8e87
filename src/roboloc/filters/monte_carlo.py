"""The particle filter of a robot that sees lines and has a map of them."""

from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from roboloc.filters.particle import ParticleFilter
from roboloc.validation import as_array, as_number


class MonteCarloLocalization(ParticleFilter):
    """Particle filter of a pose, corrected by the lines of a scan and a map.

    Parameters
    ----------
    x0 : (M, 3) array_like
        Poses at the start, one a row, M at least 1 [m, m, rad]. All weigh the same.
    R : (2, 2) array_like
        Covariance of the control, symmetric, no negative eigenvalue.
    map_lines : (2, J) array_like
        Lines alpha, r of the map [rad, m].
    tf_base_to_camera : (3,) array_like
        Pose of the scanner in the frame of the robot [m, m, rad].
    g : float
        Not negative. It is there for the sake of the handout, where all localizers have the same arguments: no
        gate is applied.
    rng : numpy.random.Generator
        Source of all draws.
    stages : mapping or object, optional
        What supplies the functions: a mapping from names, or anything with attributes so named. The names are
        ``transition_model``, ``compute_predicted_measurements``, ``compute_innovations``,
        ``measurement_weights`` and ``systematic_resample``; only those that are called are needed.
    **options
        ``threshold``, ``fresh`` and ``share``, as in :class:`ParticleFilter`.

    Attributes
    ----------
    xs : (M, 3) ndarray
        Poses; the headings are not wrapped.
    ws : (M,) ndarray
        Their weights, of sum 1.
    R, map_lines, tf_base_to_camera, g, rng
        As given.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or as in :class:`ParticleFilter`.

    Examples
    --------
    A filter that judges all particles alike keeps them.

    >>> stages = {
    ...     "compute_predicted_measurements": lambda xs, map_lines, tf: np.zeros((2, 2, 1)),
    ...     "compute_innovations": lambda z_raw, Q_raw, hs: np.zeros((2, 2)),
    ...     "measurement_weights": lambda vs, Q_raw, ws: ws,
    ... }
    >>> x0, map_lines, tf = [[0, 0, 0], [2, 0, 0]], [[0.0], [2.0]], [0.1, 0.0, 0.0]
    >>> rng = np.random.default_rng(0)
    >>> mcl = MonteCarloLocalization(x0, np.eye(2), map_lines, tf, 3.0, rng, stages=stages)
    >>> mcl.measurement_update([[0.0], [1.9]], [np.eye(2)])
    >>> mcl.x.tolist()
    [1.0, 0.0, 0.0]
    """

    notebooks = MappingProxyType(
        dict.fromkeys(
            (
                "transition_model",
                "compute_predicted_measurements",
                "compute_innovations",
                "measurement_weights",
                "systematic_resample",
            ),
            "monte-carlo-localization",
        )
    )

    def __init__(
        self,
        x0: ArrayLike,
        R: ArrayLike,
        map_lines: ArrayLike,
        tf_base_to_camera: ArrayLike,
        g: float,
        rng: np.random.Generator,
        stages: Any = None,
        **options: Any,
    ) -> None:
        super().__init__(x0, R, rng, stages=stages, **options)
        self.map_lines = as_array("map_lines", map_lines, (2, "J")).copy()
        self.tf_base_to_camera = as_array("tf_base_to_camera", tf_base_to_camera, (3,)).copy()
        self.g = as_number("g", g, minimum=0.0)

    def compute_predicted_measurements(self) -> np.ndarray:
        """Return the lines of the map as the scanner of each particle would report them.

        Returns
        -------
        hs : (M, 2, J) ndarray
            Lines alpha, r in the frame of each scanner [rad, m].

        Raises
        ------
        MissingStageError
            If the stage is not supplied or not written yet.
        ValueError
            If the stage returns something else.
        """
        shape = len(self.xs), 2, self.map_lines.shape[1]
        arguments = self.xs.copy(), self.map_lines.copy(), self.tf_base_to_camera.copy()
        (hs,) = self._call("compute_predicted_measurements", {"hs": shape}, *arguments)
        return hs

    def compute_innovations(self, z_raw: ArrayLike, Q_raw: ArrayLike) -> np.ndarray:
        """Match the observed lines with those that each particle predicts.

        Parameters
        ----------
        z_raw : (2, I) array_like
            Observed lines alpha, r in the frame of the scanner [rad, m].
        Q_raw : (I, 2, 2) array_like
            Their covariances; an array or a list of matrices.

        Returns
        -------
        vs : (M, 2I) ndarray
            Innovations alpha, r, alpha, r, ... of each particle [rad, m].

        Raises
        ------
        MissingStageError
            If a stage is not supplied or not written yet.
        ValueError
            If an argument has another shape, or if a stage returns something else.
        """
        z_raw = as_array("z_raw", z_raw, (2, "I")).copy()
        count = z_raw.shape[1]
        Q_raw = self._covariances(Q_raw, count)
        hs = self.compute_predicted_measurements()
        results = {"vs": (len(self.xs), 2 * count)}
        (vs,) = self._call("compute_innovations", results, z_raw, Q_raw, hs)
        return vs

    def measurement_model(self, z_raw: ArrayLike, Q_raw: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Make what the correction needs of the lines of a scan.

        Parameters
        ----------
        z_raw : (2, I) array_like
            Observed lines alpha, r in the frame of the scanner [rad, m].
        Q_raw : (I, 2, 2) array_like
            Their covariances; an array or a list of matrices.

        Returns
        -------
        vs : (M, 2I) ndarray
            Innovations of each particle.
        Q : (I, 2, 2) ndarray
            Covariances, one for each observation: the blocks of the joint one, which is 0 elsewhere.

        Raises
        ------
        MissingStageError
            If a stage is not supplied or not written yet.
        ValueError
            If an argument has another shape, or if a stage returns something else.
        """
        vs = self.compute_innovations(z_raw, Q_raw)
        return vs, self._covariances(Q_raw, vs.shape[1] // 2)

    def measurement_update(self, z_raw: ArrayLike, Q_raw: ArrayLike) -> None:
        """Correct: weigh the particles by the lines of a scan, and resample where the weights call for it.

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
        self._refresh()
        super().measurement_update(*self.measurement_model(z_raw, Q_raw))
