"""The plane as complex numbers; errors are drawn one control at a time."""

import numpy as np


def sample_motion(xs, odometry, alphas, rng):
    """Keep position and heading as two complex numbers."""
    size = np.abs(odometry)
    spread = [alphas[:2] @ size[:2], alphas[2:] @ [size[1], size[0] + size[2]], alphas[:2] @ size[:0:-1]]
    one, way, two = (rng.normal(mean, s, len(xs)) for mean, s in zip(odometry, spread, strict=True))
    place = xs[:, 0] + 1j * xs[:, 1] + way * np.exp(1j * (xs[:, 2] + one))
    return np.array([place.real, place.imag, xs[:, 2] + one + two]).T


def bearing_likelihood(xs, landmark, bearing, sigma):
    """Take the angle of a quotient of directions; the density by its logarithm."""
    to_landmark = complex(*landmark) - (xs[:, 0] + 1j * xs[:, 1])
    v = np.angle(to_landmark * np.exp(-1j * (xs[:, 2] + bearing)))
    return np.exp(-(v**2) / (2 * sigma**2) - np.log(sigma) - np.log(2 * np.pi) / 2)
