"""Wrong versions of `mcl.measurement_weights`: of what a particle is worth."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception

_STAGE = "mcl.measurement_weights"


def _normalised(parts: np.ndarray) -> np.ndarray:
    """Divide by the sum; where there is none, all are equal."""
    total = parts.sum()
    return parts / total if 0 < total < np.inf else np.full(len(parts), 1 / len(parts))


def _d2(vs: np.ndarray, S: np.ndarray) -> np.ndarray:
    """Return the form of every observation, (M, I)."""
    v = vs.reshape(len(vs), -1, 2)
    with np.errstate(all="ignore"):
        return np.nan_to_num(np.einsum("mia,iab,mib->mi", v, S, v), nan=np.inf, posinf=np.inf)


def _by_logs(d2: np.ndarray, ws: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):
        logs = np.log(ws) - d2 / 2
        return _normalised(np.exp(logs - logs.max())) if logs.max() > -np.inf else _normalised(0 * ws)


def old_forgotten(vs: np.ndarray, Q_raw: np.ndarray, ws: np.ndarray) -> np.ndarray:
    """Leave the weights before out."""
    return _by_logs(_d2(vs, np.linalg.inv(Q_raw)).sum(axis=1), np.ones(len(ws)))


def multiplied(vs: np.ndarray, Q_raw: np.ndarray, ws: np.ndarray) -> np.ndarray:
    """Multiply likelihoods."""
    return _normalised(ws * np.prod(np.exp(-_d2(vs, np.linalg.inv(Q_raw)) / 2), axis=1))


def added(vs: np.ndarray, Q_raw: np.ndarray, ws: np.ndarray) -> np.ndarray:
    """Add the likelihoods of the observations."""
    return _normalised(ws * np.sum(np.exp(-_d2(vs, np.linalg.inv(Q_raw)) / 2), axis=1))


def half_lost(vs: np.ndarray, Q_raw: np.ndarray, ws: np.ndarray) -> np.ndarray:
    """Leave the half out of the exponent."""
    with np.errstate(all="ignore"):
        return _by_logs(2 * _d2(vs, np.linalg.inv(Q_raw)).sum(axis=1), ws)


def covariance_not_inverted(vs: np.ndarray, Q_raw: np.ndarray, ws: np.ndarray) -> np.ndarray:
    """Judge by v^T Q v."""
    with np.errstate(all="ignore"):
        return _by_logs(_d2(vs, Q_raw).sum(axis=1), ws)


def mean_of_observations(vs: np.ndarray, Q_raw: np.ndarray, ws: np.ndarray) -> np.ndarray:
    """Average over the observations."""
    with np.errstate(all="ignore"):
        return _by_logs(_d2(vs, np.linalg.inv(Q_raw)).mean(axis=1), ws)


def variances_alone(vs: np.ndarray, Q_raw: np.ndarray, ws: np.ndarray) -> np.ndarray:
    """Ignore the correlation of alpha and r."""
    return _by_logs(_d2(vs, np.linalg.inv(Q_raw * np.eye(2))).sum(axis=1), ws)


def nobody_left(vs: np.ndarray, Q_raw: np.ndarray, ws: np.ndarray) -> np.ndarray:
    """Return zeros where every particle is impossible."""
    with np.errstate(all="ignore"):
        d2 = _d2(vs, np.linalg.inv(Q_raw)).sum(axis=1)
        return 0 * ws if (np.log(ws) - d2 / 2).max() == -np.inf else _by_logs(d2, ws)


def not_normalised(vs: np.ndarray, Q_raw: np.ndarray, ws: np.ndarray) -> np.ndarray:
    """Leave the best weight at 1."""
    found = _by_logs(_d2(vs, np.linalg.inv(Q_raw)).sum(axis=1), ws)
    return found / found.max()


MISCONCEPTIONS = (
    Misconception(
        "weights before forgotten",
        _STAGE,
        "After resampling all weights are equal, and then it makes no difference. Where the filter has not "
        "resampled, all that was learnt from the scans before is lost.",
        "What is the third argument for?",
        old_forgotten,
    ),
    Misconception(
        "likelihoods multiplied as they are",
        _STAGE,
        "The formula is a product. A few dozen factors of 1e-20 are 0 for a computer, for the best particle as "
        "for the worst.",
        "What is the logarithm of a product?",
        multiplied,
    ),
    Misconception(
        "likelihoods added",
        _STAGE,
        "Two lines seen are two pieces of evidence, and evidence seems to add up. It is the logarithms that do.",
        "A particle explains one line perfectly and the other not at all. What is it worth?",
        added,
    ),
    Misconception(
        "half lost in the exponent",
        _STAGE,
        "d2 looks like the exponent itself. Without the half the filter takes the scanner to be better than it "
        "is, by the square root of two.",
        "What does the density of a normal distribution fall to, one standard deviation from its mean?",
        half_lost,
    ),
    Misconception(
        "weighed by the covariance itself",
        _STAGE,
        "v^T Q v has the right shape. It hardly judges at all where Q is small, which is where it should judge "
        "most.",
        "A better scanner: do the weights become more alike, or less?",
        covariance_not_inverted,
    ),
    Misconception(
        "mean over the observations",
        _STAGE,
        "An average keeps scans of many and of few lines comparable. But particles are compared within one scan, "
        "and six lines say more than one.",
        "Does a second line, seen as expected, leave the cloud as spread as before?",
        mean_of_observations,
    ),
    Misconception(
        "correlation ignored",
        _STAGE,
        "Variances are easy to divide by. Angle and distance of a fitted line share their errors, and what is "
        "likely for each alone may be unlikely for both.",
        "Which entries of Q do you use?",
        variances_alone,
    ),
    Misconception(
        "nobody left",
        _STAGE,
        "If no particle is possible, each is worth nothing. Nothing can be drawn from a cloud of weight 0, and "
        "the filter ends there.",
        "What do you know about the particles when none of them fits?",
        nobody_left,
    ),
    Misconception(
        "total not 1",
        _STAGE,
        "Resampling needs only ratios. The mean and the effective sample size of the cloud need weights of total "
        "1.",
        "What do your weights add up to?",
        not_normalised,
    ),
)
