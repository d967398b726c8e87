"""Hidden inputs of the notebook *landmark-slam*: poses, landmarks all around, covariances in which all is correlated.

Headings lie beyond half a turn too: a robot that has driven two laps has turned by twelve radians and more. Landmarks
lie from 0.7 m to 6 m away and on all sides, and the numbers of two of them are never alike, so that one that is taken
for another shows. Bearings keep away from straight back where their sign is a matter of the last digit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.random import Generator

STATE = ("x", "y", "theta", "l0_x", "l0_y", "l1_x", "l1_y", "l2_x", "l2_y")
POSE = STATE[:3]
LOOK = ("bearing", "range")


def covariance(rng: Generator, sizes: tuple[float, ...]) -> np.ndarray:
    """Draw a covariance with about these standard deviations, all of whose numbers are correlated."""
    n = len(sizes)
    weakest = 0.08 if n < 5 else 0.025  # of many numbers, two are often nearly uncorrelated
    while True:
        A = rng.normal(size=(n, n)) + 1.5 * np.eye(n)
        Sigma = A @ A.T
        d = np.sqrt(np.diag(Sigma))
        correlation = Sigma / np.outer(d, d)
        if n < 2 or np.abs(correlation[~np.eye(n, dtype=bool)]).min() > weakest:
            s = np.array(sizes) * rng.uniform(0.7, 1.4, n)
            if np.linalg.cond(correlation) < 300:
                return correlation * np.outer(s, s)


def pose(rng: Generator, *, laps: bool = False) -> np.ndarray:
    """Draw a pose; with `laps` its heading is beyond a turn, as after laps to one side."""
    heading = sign(rng) * rng.uniform(0.4, 2.6)
    return np.array([*rng.uniform(0.5, 3.0, 2) * signs(rng, 2), heading + laps * sign(rng) * 4.0 * np.pi])


def looks(rng: Generator, k: int, *, ahead: bool = False) -> np.ndarray:
    """Draw bearing and range of k landmarks; with `ahead` the bearings are less than a right angle."""
    start = sign(rng) * rng.uniform(0.3, 0.7)
    bearings = start + np.array([0.0, 1.9, -1.7])[:k] * (0.35 if ahead else 1.0) * sign(rng)
    bearings += rng.uniform(-0.1, 0.1, k)
    ranges = rng.permutation([rng.uniform(0.7, 1.5), rng.uniform(2.0, 3.5), rng.uniform(4.0, 6.0)])[:k]
    return np.stack([bearings, ranges], axis=-1).ravel()


def placed(at: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the state of a robot and the landmarks that it sees as z from where it is."""
    bearings, ranges = z.reshape(-1, 2).T
    place = at[0] + 1j * at[1] + ranges * np.exp(1j * (bearings + at[2]))
    return np.concatenate([at, np.stack([place.real, place.imag], axis=-1).ravel()])


def state_covariance(rng: Generator, k: int) -> np.ndarray:
    """Draw the covariance of a pose and k landmarks."""
    return covariance(rng, (0.2, 0.2, 0.08, *(0.25,) * (2 * k)))


def look_covariance(rng: Generator) -> np.ndarray:
    """Draw the covariance of a bearing and a range, correlated and unlike."""
    return covariance(rng, (0.05, 0.15))


def step_covariance(rng: Generator) -> np.ndarray:
    """Draw the covariance of a step along, across and in heading."""
    return covariance(rng, (0.2, 0.08, 0.05))


def sign(rng: Generator) -> float:
    """Draw one of two signs."""
    return float(rng.choice([-1.0, 1.0]))


def signs(rng: Generator, n: int) -> np.ndarray:
    """Draw n signs."""
    return rng.choice([-1.0, 1.0], n)
