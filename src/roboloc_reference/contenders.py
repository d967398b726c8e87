r"""Four filters for one problem, behind one set of methods.

Each filter of the velocity model is put behind the same four methods: predict, correct, the pose it believes in,
and the squared error in units of its own covariance (NEES). That square is taken in the coordinates in which the
filter states its covariance: poses for the extended, the unscented and the particle filter, whose cloud has a mean
and a covariance; right-invariant errors for the invariant filter.

The invariant filter has to be fed. It moves by a twist, with noise W in the frame of the robot, and it sees
positions: with p the way of a step in that frame and J the derivative of polar coordinates,

.. math::

    A_p = \begin{pmatrix} 1 & 0 & p_y \\ 0 & 1 & -p_x \\ 0 & 0 & 1 \end{pmatrix}, \qquad
    W \leftarrow A_p\, (W M W^T)\, A_p^T, \qquad
    Y = (r \cos\beta,\; r \sin\beta,\; 1), \qquad N = J Q J^T.

A_p turns an error of a pose, added to its numbers, into one of a motion of the world from the left; at the start it
turns the covariance of the pose into P. N differs from landmark to landmark, so they come one after the other.

What a filter costs is counted in evaluations of the model: poses that are moved, landmarks that are looked at.

Source: Michigan ROB530, homework 5, problem 1.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from roboloc.angles import wrap
from roboloc.metrics import nees, pose_error
from roboloc.se2 import log
from roboloc.velocity_logs import VelocityLog
from roboloc_reference import invariant, particle, ukf, velocity_ekf
from roboloc_reference.resampling import systematic_resample
from roboloc_reference.velocity import jacobians, motion, noise


class Filter(Protocol):
    """What the comparison asks of a filter."""

    motions: int
    """Poses moved so far."""
    sightings: int
    """Landmarks looked at so far, from whichever pose."""

    def predict(self, u: np.ndarray) -> None:
        """Move by a control (3,)."""

    def correct(self, z: np.ndarray, landmarks: np.ndarray) -> None:
        """Condition on observations (2k,) of landmarks (k, 2)."""

    def pose(self) -> np.ndarray:
        """Return the pose (3,) that is believed in."""

    def nees(self, truth: np.ndarray) -> float:
        """Return the normalized squared error for a true pose (3,)."""


class Extended:
    """The extended Kalman filter; see :mod:`roboloc_reference.velocity_ekf`."""

    def __init__(self, scenario: VelocityLog) -> None:
        self.scenario = scenario
        self.x, self.Sigma = scenario.x0, scenario.Sigma0
        self.motions = self.sightings = 0

    def predict(self, u: np.ndarray) -> None:
        """Move by a control."""
        M = noise(u, self.scenario.alphas)
        self.x, self.Sigma = velocity_ekf.predict(self.x, self.Sigma, u, M, self.scenario.dt)
        self.motions += 1

    def correct(self, z: np.ndarray, landmarks: np.ndarray) -> None:
        """Condition on observations."""
        self.x, self.Sigma = velocity_ekf.correct(self.x, self.Sigma, z, landmarks, self.scenario.Q)
        self.sightings += len(landmarks)

    def pose(self) -> np.ndarray:
        """Return the mean."""
        return self.x

    def nees(self, truth: np.ndarray) -> float:
        """Return the normalized squared error of the mean."""
        return nees(pose_error(self.x, truth), self.Sigma)


class Unscented(Extended):
    """The unscented Kalman filter, with the same kappa in both steps; see :mod:`roboloc_reference.ukf`."""

    def __init__(self, scenario: VelocityLog, kappa: float = 2.0) -> None:
        super().__init__(scenario)
        self.kappa = kappa

    def predict(self, u: np.ndarray) -> None:
        """Move by a control: 13 points of pose and control."""
        M = noise(u, self.scenario.alphas)
        self.x, self.Sigma = ukf.predict(self.x, self.Sigma, u, M, self.scenario.dt, self.kappa)
        self.motions += 13

    def correct(self, z: np.ndarray, landmarks: np.ndarray) -> None:
        """Condition on observations: 7 points of the pose."""
        self.x, self.Sigma = ukf.correct(self.x, self.Sigma, z, landmarks, self.scenario.Q, self.kappa)
        self.sightings += 7 * len(landmarks)


class Particles:
    """The particle filter, resampled when its effective size is low; see :mod:`roboloc_reference.particle`.

    Parameters
    ----------
    scenario : VelocityLog
        The problem.
    rng : numpy.random.Generator
        Source of the draws.
    count : int
        Number of particles.
    threshold : float
        Share of the particles below which the effective size makes it resample.
    """

    def __init__(
        self, scenario: VelocityLog, rng: np.random.Generator, count: int = 1000, threshold: float = 0.5
    ) -> None:
        self.scenario, self.rng, self.threshold = scenario, rng, threshold
        self.xs = rng.multivariate_normal(scenario.x0, scenario.Sigma0, size=count)
        self.ws = np.full(count, 1.0 / count)
        self.motions = self.sightings = self.resamplings = 0

    def predict(self, u: np.ndarray) -> None:
        """Resample if that is due, and move each particle by a control of its own."""
        count = len(self.xs)
        if particle.effective_sample_size(self.ws) < self.threshold * count:
            self.xs = self.xs[systematic_resample(self.ws, self.rng.uniform(0.0, 1.0 / count))]
            self.ws = np.full(count, 1.0 / count)
            self.resamplings += 1
        self.xs = particle.predict(self.xs, u, self.scenario.alphas, self.scenario.dt, self.rng)
        self.motions += count

    def correct(self, z: np.ndarray, landmarks: np.ndarray) -> None:
        """Weigh by observations."""
        self.ws = particle.correct(self.xs, self.ws, z, landmarks, self.scenario.Q)
        self.sightings += len(self.xs) * len(landmarks)

    def pose(self) -> np.ndarray:
        """Return the mean of the cloud, the headings about that of the heaviest particle."""
        heaviest = self.xs[np.argmax(self.ws)]
        away = self.xs - heaviest
        away[:, 2] = wrap(away[:, 2])
        return heaviest + self.ws @ away

    def nees(self, truth: np.ndarray) -> float:
        """Return the normalized squared error of the mean, by the covariance of the cloud."""
        mean = self.pose()
        away = self.xs - mean
        away[:, 2] = wrap(away[:, 2])
        return nees(pose_error(mean, truth), away.T * self.ws @ away)


class Invariant:
    """The right-invariant Kalman filter; see :mod:`roboloc_reference.invariant`."""

    def __init__(self, scenario: VelocityLog) -> None:
        self.scenario = scenario
        A = _from_the_left(scenario.x0)
        self.X, self.P = _matrix(scenario.x0), A @ scenario.Sigma0 @ A.T
        self.motions = self.sightings = 0

    def predict(self, u: np.ndarray) -> None:
        """Move by a control: along its arc, with all its noise, and then by its turn on the spot."""
        dt = self.scenario.dt
        way = motion(np.zeros(3), u, dt)
        AW = _from_the_left(way) @ jacobians(np.zeros(3), u, dt)[1]
        W = AW @ noise(u, self.scenario.alphas) @ AW.T
        self.X, self.P = invariant.predict(self.X, self.P, [u[0], 0.0, u[1]], W, dt)
        if u[2]:
            self.X, self.P = invariant.predict(self.X, self.P, [0.0, 0.0, u[2]], np.zeros((3, 3)), dt)
        self.motions += 1

    def correct(self, z: np.ndarray, landmarks: np.ndarray) -> None:
        """Condition on observations, as positions in the robot's frame, one after the other."""
        for (bearing, r), landmark in zip(z.reshape(-1, 2), landmarks, strict=True):
            c, s = np.cos(bearing), np.sin(bearing)
            J = np.array([[-r * s, c], [r * c, s]])
            Y = np.array([[r * c, r * s, 1.0]])
            self.X, self.P = invariant.correct(self.X, self.P, Y, landmark[None], J @ self.scenario.Q @ J.T)
        self.sightings += len(landmarks)

    def pose(self) -> np.ndarray:
        """Return the pose, its heading in [-pi, pi]."""
        return np.array([self.X[0, 2], self.X[1, 2], np.arctan2(self.X[1, 0], self.X[0, 0])])

    def nees(self, truth: np.ndarray) -> float:
        """Return the normalized square of the right-invariant error."""
        E = self.X @ np.linalg.inv(_matrix(truth))
        return nees(log([E[0, 2], E[1, 2], np.arctan2(E[1, 0], E[0, 0])]), self.P)


def four_filters(rng: np.random.Generator, count: int = 1000) -> dict[str, Callable[[VelocityLog], Filter]]:
    """Return what makes each of the four filters for a run, by name.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of the particle filter's draws.
    count : int
        Number of its particles.

    Returns
    -------
    dict of str to callable
        From a scenario to a filter at its start.
    """
    return {
        "EKF": Extended,
        "UKF": Unscented,
        "PF": lambda scenario: Particles(scenario, rng, count),
        "InEKF": Invariant,
    }


def _matrix(pose: np.ndarray) -> np.ndarray:
    """Return the matrix of a pose."""
    x, y, theta = pose
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s, x], [s, c, y], [0.0, 0.0, 1.0]])


def _from_the_left(pose: np.ndarray) -> np.ndarray:
    """Return what turns a small error of a pose's numbers into a motion of the world, to first order."""
    return np.array([[1.0, 0.0, pose[1]], [0.0, 1.0, -pose[0]], [0.0, 0.0, 1.0]])
