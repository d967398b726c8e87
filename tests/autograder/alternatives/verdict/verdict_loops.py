"""Plain loops over runs and instants, and complex numbers for headings."""

import cmath
import math

import numpy as np
from scipy.stats import chi2


def rms_errors(poses, truth):
    """Add up squares one after the other."""
    runs, instants = len(poses), len(poses[0])
    position, heading = [], []
    for k in range(instants):
        far = turned = 0.0
        for r in range(runs):
            far += math.dist(poses[r][k][:2], truth[r][k][:2]) ** 2
            turned += cmath.phase(cmath.exp(1j * (poses[r][k][2] - truth[r][k][2]))) ** 2
        position.append(math.sqrt(far / runs))
        heading.append(math.sqrt(turned / runs))
    return position, heading


def coverage(errors, covs, probability):
    """Invert each covariance."""
    runs, instants, n = errors.shape
    inside = [0] * instants
    for k in range(instants):
        for r in range(runs):
            e = errors[r, k]
            inside[k] += e @ np.linalg.inv(covs[r, k]) @ e < chi2.ppf(probability, n)
    return [count / runs for count in inside]


def mean_and_error(values):
    """Use sums of squares."""
    means = [sum(run) / len(run) for run in values]
    mean = sum(means) / len(means)
    squares = sum((m - mean) ** 2 for m in means)
    return mean, math.sqrt(squares / (len(means) - 1) / len(means))


def paired_interval(a, b, picks, probability):
    """Sort the means and look between neighbours."""
    means = sorted(sum(a[i] - b[i] for i in row) / len(row) for row in picks)

    def at(share):
        place = share * (len(means) - 1)
        below = min(int(place), len(means) - 2)
        return means[below] + (place - below) * (means[below + 1] - means[below])

    return at((1 - probability) / 2), at((1 + probability) / 2)
