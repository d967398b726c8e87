"""The whole step in the complex plane, with the comb by counting."""

import numpy as np
from scipy.stats import norm


def bootstrap_step(xs, ws, odometry, alphas, landmark, bearing, sigma, rng):
    """Draw control by control; how many teeth lie before each mark tells how often a particle is taken."""
    size, (one, way, two) = len(xs), np.abs(odometry)
    spread = alphas[[0, 2, 0]] * [one, way, two] + alphas[[1, 3, 1]] * [way, one + two, way]
    rot1, trans, rot2 = (rng.normal(mean, s, size) for mean, s in zip(odometry, spread, strict=True))
    place = xs[:, 0] + 1j * xs[:, 1] + trans * np.exp(1j * (xs[:, 2] + rot1))
    heading = xs[:, 2] + rot1 + rot2
    v = np.angle((complex(*landmark) - place) * np.exp(-1j * (heading + bearing)))
    marks = np.cumsum(ws * norm.pdf(v, scale=sigma))
    before = np.ceil((marks / marks[-1] - rng.uniform(0, 1 / size)) * size).astype(int)
    before[-1] = size
    chosen = np.repeat(np.arange(size), np.diff(np.maximum(before, 0), prepend=0))
    return np.column_stack([place.real, place.imag, heading])[chosen], np.full(size, 1 / size)
