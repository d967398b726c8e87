r"""A map that grows: how a line that nobody knew becomes one of the map.

EKF SLAM as the handout has it begins with a map that is wrong, but complete. Without one, each observed line that
is none of the map raises three questions.

*Is it new?* Only if it is none of those that are known already, beyond reasonable doubt: a right pair is outside
the validation gate once in ninety times, and that is no reason for a second wall in the same place. So there are two
gates. Inside the narrow one, g standard deviations, the observation corrects; outside the wide one, it may be new;
between the two nothing is done with it. A line nearly through the scanner may be seen from either side of the
rounding, as (alpha, r) or (alpha + pi, -r), and is asked for both ways.

*Is it there at all?* A scan has lines that are none: two corners in a row, somebody who walks by. A new line rides
along as a passenger until it has been seen in several scans, and is forgotten when it is not seen for a while.

*Where is it?* Where it was seen first, with the error that the robot had then. The passenger is therefore in the
state from its first sighting, by `slam.augment`, with its covariances with pose, map and other passengers, and
everything that is learnt about those moves it as it should. Only its own sightings are not used before it is
confirmed, so that the belief about pose and map is that of a filter which has never heard of passengers: a wall that
is none does no harm. To wait with `augment` until the line is confirmed
would be simpler, and worse: a map from nothing hangs on how well the robot knew its heading when it saw its first
walls, and in the arena waiting for the third sighting doubles the error at the end.

What is confirmed moves to the end of the map, in front of the passengers, and keeps its place for ever: line j of
the map is line j at any later time.

Source: the handout (Stanford AA274A (2021), problem set 4, problem 2) leaves this out. Lists of lines on probation
are in M. W. M. G. Dissanayake et al., *A solution to the simultaneous localization and map building (SLAM) problem*.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from roboloc.validation import as_array, as_number
from roboloc_reference import slam


class EkfMapping(slam.EkfSlam):
    """EKF SLAM with lines, of which new ones enter the map.

    Parameters
    ----------
    x0 : (3 + 2J,) array_like
        Pose and known lines at the start [m, m, rad, rad, m, ...]; J may be 0.
    Sigma0 : (3 + 2J, 3 + 2J) array_like
        Covariance at the start, symmetric, no negative eigenvalue. Something must hold the map: a pose that is
        certain, or fixed lines.
    R : (2, 2) array_like
        Covariance of the control, symmetric, no negative eigenvalue.
    tf_base_to_camera : (3,) array_like
        Pose of the scanner in the frame of the robot [m, m, rad].
    g : float
        Validation gate in standard deviations, not negative.
    fixed : int
        How many lines, counted from the first, are certain, with covariance 0; at most J.
    newness : float
        How many standard deviations a new line is away from all others, not below g.
    sightings : int
        In how many scans a line must have been seen to enter the map, at least 1.
    patience : int
        After how many scans in a row without it an unconfirmed line is forgotten, at least 1.
    stages : mapping or object, optional
        What supplies the functions: those of :class:`roboloc.filters.EkfSlam` and ``augment``.

    Attributes
    ----------
    x : (3 + 2J + 2P,) ndarray
        Mean: the pose, the J lines of the map, and P lines that are not confirmed yet.
    Sigma : (3 + 2J + 2P, 3 + 2J + 2P) ndarray
        Covariance.
    known : int
        Number J of lines of the map.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if a covariance is none, or if a number is outside its
        limits.

    Examples
    --------
    A robot that knows nothing but where it is sees a wall 2 m ahead. Seen again, the wall is in the map, and once
    more, it tells the robot how far it has driven.

    >>> R, Q = np.diag([0.04, 0.0]), 1e-6 * np.eye(2)
    >>> ekf = EkfMapping(np.zeros(3), np.zeros((3, 3)), R, [0.0, 0.0, 0.0], 3.0, sightings=2)
    >>> for _ in range(2):
    ...     ekf.measurement_update([[0.0], [2.0]], [Q])
    ...     ekf.known
    0
    1
    >>> ekf.transition_update([0.5, 0.0], 1.0)
    >>> ekf.measurement_update([[0.0], [1.4]], [Q])
    >>> ekf.map_lines.round(4).tolist(), ekf.x[:3].round(4).tolist()
    ([[0.0], [2.0]], [0.6, 0.0, 0.0])
    """

    def __init__(
        self,
        x0: ArrayLike,
        Sigma0: ArrayLike,
        R: ArrayLike,
        tf_base_to_camera: ArrayLike,
        g: float,
        fixed: int = 0,
        *,
        newness: float = 5.0,
        sightings: int = 3,
        patience: int = 6,
        stages: Any = slam.STAGES,
    ) -> None:
        super().__init__(x0, Sigma0, R, tf_base_to_camera, g, fixed, stages=stages)
        self.known = (self.x.size - 3) // 2
        if self.fixed > self.known:
            raise ValueError(f"fixed: expected at most the {self.known} lines of x0, got {self.fixed}")
        self.newness = as_number("newness", newness, minimum=self.g)
        self.sightings = as_number("sightings", sightings, minimum=1.0)
        self.patience = as_number("patience", patience, minimum=1.0)
        self._seen = np.zeros(0, dtype=int)  # of each passenger: scans with it
        self._missed = np.zeros(0, dtype=int)  # scans without it since

    @property
    def map_lines(self) -> np.ndarray:
        """The lines alpha, r of the map as it is believed, (2, J) [rad, m]."""
        return super().map_lines[:, : self.known]

    def compute_predicted_measurements(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lines of the map, without passengers, as the scanner would report them.

        Returns
        -------
        hs : (2, J) ndarray
            Lines alpha, r in the frame of the scanner [rad, m].
        Hs : (J, 2, 3 + 2J + 2P) ndarray
            Their derivatives by the state.
        """
        hs, Hs = super().compute_predicted_measurements()
        return hs[:, : self.known], Hs[: self.known]

    def measurement_update(self, z_raw: ArrayLike, Q_raw: ArrayLike) -> None:
        """Correct the belief by the lines of a scan that are known, then look for new ones among the rest.

        Parameters
        ----------
        z_raw : (2, I) array_like
            Observed lines alpha, r in the frame of the scanner [rad, m].
        Q_raw : (I, 2, 2) array_like
            Their covariances; an array or a list of matrices.

        Raises
        ------
        ValueError
            If an argument has another shape or is not finite.
        """
        super().measurement_update(z_raw, Q_raw)
        z_raw = as_array("z_raw", z_raw, (2, "I"))
        sighted = {self._passenger(z, Q) for z, Q in zip(z_raw.T, np.asarray(Q_raw), strict=True)} - {None}
        now = np.isin(np.arange(self._seen.size), list(sighted))
        self._seen = self._seen + now
        self._missed = np.where(now, 0, self._missed + 1)
        confirmed = self._seen >= self.sightings
        waiting = ~confirmed & (self._missed < self.patience)
        self._arrange(np.flatnonzero(confirmed), np.flatnonzero(waiting))

    def _passenger(self, z: np.ndarray, Q: np.ndarray) -> int | None:
        """Return which passenger an observation is of, perhaps a new one; None if of a known line, or in doubt."""
        known, total = self.known, (self.x.size - 3) // 2
        if self._is_one_of(slice(known), z, Q, self.newness):
            return None
        for j in range(known, total):
            if self._is_one_of(slice(j, j + 1), z, Q, self.g):
                return j - known
        if self._is_one_of(slice(known, total), z, Q, self.newness):
            return None
        n = self.x.size + 2
        arguments = self.x.copy(), self.Sigma.copy(), z.copy(), Q.copy(), self.tf_base_to_camera.copy()
        self.x, self.Sigma = self._call("augment", {"x": (n,), "Sigma": (n, n)}, *arguments)
        self._seen, self._missed = np.append(self._seen, 0), np.append(self._missed, 0)
        return total - known

    def _is_one_of(self, lines: slice, z: np.ndarray, Q: np.ndarray, g: float) -> bool:
        """Tell whether an observation, written either way, is within a gate of some lines of the state."""
        hs, Hs = super().compute_predicted_measurements()
        flip = np.diag([1.0, -1.0])
        both = np.stack([z, flip @ z + [np.pi, 0.0]], axis=1), np.stack([Q, flip @ Q @ flip])
        results = {"v": ("K", 2), "Q": ("K", 2, 2), "H": ("K", 2, self.x.size)}
        v, _, _ = self._call(
            "compute_innovations", results, *both, hs[:, lines], Hs[lines], self.Sigma.copy(), g
        )
        return bool(len(v))

    def _arrange(self, confirmed: np.ndarray, waiting: np.ndarray) -> None:
        """Let some passengers be lines of the map, keep some others, and forget the rest."""
        lines = np.concatenate([np.arange(self.known), self.known + confirmed, self.known + waiting])
        entries = np.concatenate([[0, 1, 2], (3 + 2 * lines[:, None] + [0, 1]).ravel()])
        self.x, self.Sigma = self.x[entries], self.Sigma[np.ix_(entries, entries)]
        self._seen, self._missed = self._seen[waiting], self._missed[waiting]
        self.known += confirmed.size
