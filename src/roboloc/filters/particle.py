"""The filter whose belief is a cloud of weighted poses."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import wrap
from roboloc.filters.shell import Shell
from roboloc.validation import as_array, as_covariance, as_number


class ParticleFilter(Shell):
    """Particle filter of a pose moved by a control [V, omega].

    Parameters
    ----------
    x0 : (M, 3) array_like
        Poses at the start, one a row, M at least 1 [m, m, rad]. All weigh the same.
    R : (2, 2) array_like
        Covariance of the control, symmetric, no negative eigenvalue.
    rng : numpy.random.Generator
        Source of all draws.
    stages : mapping or object, optional
        What supplies the functions: a mapping from names, or anything with attributes so named. The names are
        ``transition_model``, ``measurement_weights`` and ``systematic_resample``; only those that are called are
        needed.
    threshold : float
        The filter resamples after a correction if the effective sample size is below this share of M, in [0, 1].
        1 resamples whenever the weights differ at all, 0 never.
    fresh : callable, optional
        ``(count, rng)`` to (count, 3) poses: where a robot may be that was carried away unseen. Without it no
        robot ever is.
    share : float
        Probability with which a correction first replaces a particle by one of these, in [0, 1].

    Attributes
    ----------
    xs : (M, 3) ndarray
        Poses; the headings are not wrapped.
    ws : (M,) ndarray
        Their weights, of sum 1.
    R, rng, threshold, fresh, share
        As given.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if there is no pose, if R is no covariance, if rng is no
        Generator, or if `threshold` or `share` is outside [0, 1].

    Examples
    --------
    Two particles that are told to stay do so; asked to weigh them, the filter says what it lacks.

    >>> stages = {"transition_model": lambda xs, us, dt: xs}
    >>> pf = ParticleFilter([[0, 0, 3.0], [2, 0, -3.0]], np.eye(2), np.random.default_rng(0), stages=stages)
    >>> pf.transition_update([0.5, 0.0], 0.1)
    >>> pf.x.round(6).tolist()
    [1.0, 0.0, -3.141593]
    >>> pf.measurement_update([[0.0, 0.1], [0.0, 0.2]], [np.eye(2)])
    Traceback (most recent call last):
        ...
    roboloc.filters.shell.MissingStageError: stage measurement_weights: not supplied
    """

    def __init__(
        self,
        x0: ArrayLike,
        R: ArrayLike,
        rng: np.random.Generator,
        stages: Any = None,
        *,
        threshold: float = 1.0,
        fresh: Callable[[int, np.random.Generator], ArrayLike] | None = None,
        share: float = 0.05,
    ) -> None:
        super().__init__(stages)
        self.xs = as_array("x0", x0, ("M", 3)).copy()
        M = len(self.xs)
        if not M:
            raise ValueError("x0: expected at least one pose, got none")
        self.ws = np.full(M, 1.0 / M)
        self.R = as_covariance("R", R, 2).copy()
        if not isinstance(rng, np.random.Generator):
            raise ValueError(f"rng: expected a numpy.random.Generator, got {type(rng).__name__}")  # noqa: TRY004
        self.rng = rng
        self.threshold = _as_share("threshold", threshold)
        self.fresh = fresh
        self.share = _as_share("share", share)

    @property
    def x(self) -> np.ndarray:
        """The mean pose, (3,) [m, m, rad]; the heading is the direction of the mean of unit vectors."""
        theta = self.xs[:, 2]
        heading = np.arctan2(self.ws @ np.sin(theta), self.ws @ np.cos(theta))
        return np.append(self.ws @ self.xs[:, :2], wrap(heading))

    @property
    def Sigma(self) -> np.ndarray:
        """The covariance of the cloud about its mean, (3, 3); headings differ from it by half a turn at most."""
        v = self.xs - self.x
        v[:, 2] = wrap(v[:, 2])
        return (self.ws[:, None] * v).T @ v

    def transition_model(self, us: ArrayLike, dt: float) -> np.ndarray:
        """Return where controls take the particles, from the stage ``transition_model``.

        Parameters
        ----------
        us : (M, 2) array_like
            A control V, omega for each particle [m/s, rad/s].
        dt : float
            Duration of the controls [s].

        Returns
        -------
        (M, 3) ndarray
            Poses after the motion.

        Raises
        ------
        MissingStageError
            If the stage is not supplied or not written yet.
        ValueError
            If an argument has another shape, or if the stage returns something else.
        """
        M = len(self.xs)
        us = as_array("us", us, (M, 2)).copy()
        (xs,) = self._call("transition_model", {"xs": (M, 3)}, self.xs.copy(), us, dt)
        return xs

    def transition_update(self, u: ArrayLike, dt: float) -> None:
        """Predict: move every particle by a control of its own, drawn about `u` with covariance dt R.

        Parameters
        ----------
        u : (2,) array_like
            Control V, omega [m/s, rad/s].
        dt : float
            Duration of the control [s], not negative.

        Raises
        ------
        MissingStageError
            If the stage is not supplied or not written yet.
        ValueError
            If an argument has another shape, or if the stage returns something else.
        """
        u = as_array("u", u, (2,))
        dt = as_number("dt", dt, minimum=0.0)
        us = self.rng.multivariate_normal(u, dt * self.R, size=len(self.xs), method="eigh")
        self.xs = self.transition_model(us, dt)

    def measurement_update(self, vs: ArrayLike, Q_raw: ArrayLike) -> None:
        """Correct: weigh the particles by their innovations, and resample where the weights call for it.

        Parameters
        ----------
        vs : (M, 2I) array_like
            Innovations of each particle, those of an observation side by side.
        Q_raw : (I, 2, 2) array_like
            Covariances of the observations.

        Raises
        ------
        MissingStageError
            If a stage is not supplied or not written yet.
        ValueError
            If an argument has another shape, or if a stage returns something else.
        """
        M = len(self.xs)
        vs = as_array("vs", vs, (M, "2I")).copy()
        Q_raw = self._covariances(Q_raw, vs.shape[1] // 2)
        (ws,) = self._call("measurement_weights", {"ws": (M,)}, vs, Q_raw, self.ws.copy())
        self._reweigh(ws)

    def resample(self) -> None:
        """Draw as many particles as there are in proportion to their weights, which become the same for all.

        Raises
        ------
        MissingStageError
            If the stage is not supplied or not written yet.
        ValueError
            If the stage ``systematic_resample`` returns something else than M indices of particles.
        """
        M = len(self.xs)
        offset = min(self.rng.random() / M, np.nextafter(1.0 / M, 0.0))
        (ancestors,) = self._call("systematic_resample", {"ancestors": (M,)}, self.ws.copy(), offset)
        if not np.isin(ancestors, np.arange(M)).all():
            raise ValueError(
                f"stage systematic_resample: ancestors: expected indices below {M}, got {ancestors}"
            )
        self.xs = self.xs[ancestors.astype(np.intp)]
        self.ws = np.full(M, 1.0 / M)

    def _reweigh(self, ws: np.ndarray) -> None:
        """Take on new weights, and resample where they call for it."""
        self.ws = ws
        # The effective sample size, (sum w)^2 / sum w^2, against a share of the particles, whatever the sum is.
        shares = ws / max(ws.max(), np.finfo(float).tiny)
        if shares.sum() ** 2 < self.threshold * len(ws) * (shares @ shares):
            self.resample()

    @staticmethod
    def _covariances(Q_raw: ArrayLike, count: int) -> np.ndarray:
        """Return the covariances of so many observations as an array of the filter's own."""
        return as_array("Q_raw", Q_raw if count else np.zeros((0, 2, 2)), (count, 2, 2)).copy()

    def _refresh(self) -> None:
        """Replace a random choice of particles by fresh ones, which inherit the weights."""
        if self.fresh is not None:
            chosen = np.flatnonzero(self.rng.random(len(self.xs)) < self.share)
            self.xs[chosen] = as_array("fresh", self.fresh(chosen.size, self.rng), (chosen.size, 3))


def _as_share(name: str, value: float) -> float:
    share = as_number(name, value, minimum=0.0)
    if share > 1.0:
        raise ValueError(f"{name}: expected a number not above 1, got {share}")
    return share
