"""Sums over named indices, Cholesky roots, and counts instead of picks."""

import numpy as np
from scipy import stats


def rms_errors(poses, truth):
    """Sum squares by einsum; turns by sine and cosine."""
    gap = poses - truth
    turn = np.arctan2(np.sin(gap[..., 2]), np.cos(gap[..., 2]))
    flat = gap[..., :2]
    return (
        np.sqrt(np.einsum("rki,rki->k", flat, flat) / len(gap)),
        np.linalg.norm(turn, axis=0) / np.sqrt(len(gap)),
    )


def coverage(errors, covs, probability):
    """Whiten by the Cholesky root and look at the probability of each square."""
    white = np.linalg.solve(np.linalg.cholesky(covs), errors[..., None])[..., 0]
    return (stats.chi2.cdf(np.einsum("rki,rki->rk", white, white), errors.shape[2]) <= probability).mean(0)


def mean_and_error(values):
    """Use the variance of the mean that SciPy knows."""
    means = np.mean(values, axis=1)
    return np.mean(values), stats.sem(means)


def paired_interval(a, b, picks, probability):
    """Count how often each run is drawn."""
    counts = (picks[:, :, None] == np.arange(len(a))).sum(axis=1)
    means = counts @ (a - b) / len(a)
    rest = 50 * (1 - probability)
    return np.percentile(means, rest), np.percentile(means, 100 - rest)
