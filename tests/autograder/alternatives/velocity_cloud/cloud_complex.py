"""Places as complex numbers, draws control by control, densities of scipy."""

import numpy as np
from scipy.special import logsumexp
from scipy.stats import multivariate_normal


def predict(xs, u, alphas, dt, rng):
    """Draw the three controls one after the other, wrap the headings."""
    squares = np.square(u[:2])
    v, omega, gamma = (
        rng.normal(mean, np.sqrt(pair @ squares), len(xs))
        for mean, pair in zip(u, np.reshape(alphas, (3, 2)), strict=True)
    )
    half = omega * dt / 2
    place = xs[:, 0] + 1j * xs[:, 1] + v * dt * np.sinc(half / np.pi) * np.exp(1j * (xs[:, 2] + half))
    heading = np.angle(np.exp(1j * (xs[:, 2] + (omega + gamma) * dt)))
    return np.column_stack([place.real, place.imag, heading])


def correct(xs, ws, z, landmarks, Q):
    """Look along the particle's heading and the bearing: what is left is the innovation."""
    if not ws.any():
        return np.ones(len(ws)) / len(ws)
    with np.errstate(divide="ignore"):
        logs = np.log(ws)
    for (bearing, distance), mark in zip(np.reshape(z, (-1, 2)), landmarks, strict=True):
        sight = complex(*mark) - xs[:, 0] - 1j * xs[:, 1]
        v = np.stack([np.angle(np.exp(1j * (xs[:, 2] + bearing)) / sight), distance - np.abs(sight)], axis=1)
        logs = logs + np.reshape(multivariate_normal.logpdf(v, cov=Q), len(ws))
    return np.exp(logs - logsumexp(logs))


def effective_sample_size(ws):
    """Divide by the largest, then take the norm."""
    w = ws / np.max(ws)
    return (w.sum() / np.linalg.norm(w)) ** 2
