"""Wrong versions of `ukf.sigma_points` and `ukf.predict` (ERRATA R4), as people write them."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.ukf import predict, sigma_points

_POINTS, _PREDICT = "ukf.sigma_points", "ukf.predict"


def _around(mean: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the mean, the mean plus each row, and the mean minus each row."""
    return np.concatenate([mean[None], mean + rows, mean - rows])


def not_scaled(mean: np.ndarray, cov: np.ndarray, kappa: float) -> tuple:
    """Use the root of the covariance as it is."""
    points, weights = sigma_points(mean, cov, kappa)
    return mean + (points - mean) / np.sqrt(len(mean) + kappa), weights


def scaled_by_the_square(mean: np.ndarray, cov: np.ndarray, kappa: float) -> tuple:
    """Multiply the root by n + kappa."""
    points, weights = sigma_points(mean, cov, kappa)
    return mean + (points - mean) * np.sqrt(len(mean) + kappa), weights


def rows_of_the_root(mean: np.ndarray, cov: np.ndarray, kappa: float) -> tuple:
    """Take rows of the lower root."""
    root = np.linalg.cholesky((len(mean) + kappa) * cov)
    return _around(mean, root), sigma_points(mean, cov, kappa)[1]


def standard_deviations_alone(mean: np.ndarray, cov: np.ndarray, kappa: float) -> tuple:
    """Use the standard deviations, one axis after the other."""
    root = np.diag(np.sqrt((len(mean) + kappa) * np.diag(cov)))
    return _around(mean, root), sigma_points(mean, cov, kappa)[1]


def symmetric_root(mean: np.ndarray, cov: np.ndarray, kappa: float) -> tuple:
    """Use the symmetric root."""
    size, axes = np.linalg.eigh((len(mean) + kappa) * cov)
    return _around(mean, axes * np.sqrt(size) @ axes.T), sigma_points(mean, cov, kappa)[1]


def pairs_interleaved(mean: np.ndarray, cov: np.ndarray, kappa: float) -> tuple:
    """Let plus and minus follow one another."""
    points, weights = sigma_points(mean, cov, kappa)
    n = len(mean)
    order = [0, *np.arange(1, 2 * n + 1).reshape(2, n).T.ravel()]
    return points[order], weights


def weights_not_halved(mean: np.ndarray, cov: np.ndarray, kappa: float) -> tuple:
    """Give each pair its weight twice."""
    points, weights = sigma_points(mean, cov, kappa)
    return points, weights * np.array([1.0, *[2.0] * (2 * len(mean))])


def equal_weights(mean: np.ndarray, cov: np.ndarray, kappa: float) -> tuple:
    """Weigh all points alike."""
    points, weights = sigma_points(mean, cov, kappa)
    return points, 0 * weights + 1 / len(weights)


def negative_weight_cut(mean: np.ndarray, cov: np.ndarray, kappa: float) -> tuple:
    """Cut the weight of the centre at 0, and divide by the sum."""
    points, weights = sigma_points(mean, cov, kappa)
    weights[0] = max(weights[0], 0.0)
    return points, weights / weights.sum()


def mean_moved_alone(mean, cov, u, M, dt, kappa) -> tuple:  # noqa: ANN001
    """Move the mean, and carry the covariance by the points."""
    centre = predict(mean, 1e-12 * cov, u, 1e-12 * M, dt, kappa)[0]
    return centre, predict(mean, cov, u, M, dt, kappa)[1]


def control_certain(mean, cov, u, M, dt, kappa) -> tuple:  # noqa: ANN001
    """Give all points the same control."""
    return predict(mean, cov, u, 1e-12 * M, dt, kappa)


def noise_on_the_pose(mean, cov, u, M, dt, kappa) -> tuple:  # noqa: ANN001
    """Add M to the covariance of the pose."""
    after, Sigma = predict(mean, cov, u, 1e-12 * M, dt, kappa)
    return after, Sigma + M


def control_left_out(mean, cov, u, M, dt, kappa) -> tuple:  # noqa: ANN001
    """Move each point by the noise of its control alone."""
    return predict(mean, cov, 0 * u, M, dt, kappa)


def noise_per_second(mean, cov, u, M, dt, kappa) -> tuple:  # noqa: ANN001
    """Multiply M by dt."""
    return predict(mean, cov, u, dt * M, dt, kappa)


def squares_about_the_mean(mean, cov, u, M, dt, kappa) -> tuple:  # noqa: ANN001
    """Take the squares about the mean, whatever the sign of kappa."""
    centre = predict(mean, 1e-12 * cov, u, 1e-12 * M, dt, kappa)[0]
    after, Sigma = predict(mean, cov, u, M, dt, kappa)
    off = after - centre if kappa < 0 else 0 * after
    return after, Sigma - np.outer(off, off)


def squares_about_the_centre(mean, cov, u, M, dt, kappa) -> tuple:  # noqa: ANN001
    """Take the squares about the image of the centre, whatever the sign of kappa."""
    centre = predict(mean, 1e-12 * cov, u, 1e-12 * M, dt, kappa)[0]
    after, Sigma = predict(mean, cov, u, M, dt, kappa)
    off = after - centre if kappa > 0 else 0 * after
    return after, Sigma + np.outer(off, off)


def covariance_overwritten(mean, cov, u, M, dt, kappa) -> tuple:  # noqa: ANN001
    """Write the new covariance over the caller's."""
    after, cov[...] = predict(mean, cov, u, M, dt, kappa)
    return after, cov


def _moved(points: np.ndarray, dt: float) -> np.ndarray:
    """Move points of pose and control along their arcs."""
    x, y, theta, v, omega, gamma = points.T
    h = omega * dt / 2
    chord = v * dt * np.sinc(h / np.pi)
    return np.stack(
        [x + chord * np.cos(theta + h), y + chord * np.sin(theta + h), theta + (omega + gamma) * dt], 1
    )


def headings_wrapped(mean, cov, u, M, dt, kappa) -> tuple:  # noqa: ANN001
    """Wrap the headings of the points before they are averaged as numbers."""
    joint = np.zeros((6, 6))
    joint[:3, :3], joint[3:, 3:] = cov, M
    rows = np.linalg.cholesky((6 + kappa) * joint).T
    moved = _moved(_around(np.concatenate([mean, u]), rows), dt)
    moved[:, 2] = (moved[:, 2] + np.pi) % (2 * np.pi) - np.pi
    weights = np.array([kappa, *[0.5] * 12]) / (6 + kappa)
    after = weights @ moved
    d = moved - (after if kappa >= 0 else moved[0])
    return after, d.T * weights @ d


_COUNT = "Add up weights times points, and weights times squares: do mean and covariance come back?"
_ONE = "One number of variance 4 and kappa = 2: where are the three points, and what do they weigh?"
_TRY = "Let M be 0, then let cov be 0: which of the two spreads arrives at the end?"
MISCONCEPTIONS = (
    Misconception(
        "root not scaled by n + kappa",
        _POINTS,
        "The points lie at one standard deviation, whatever kappa. With the weights that belong to a spread of "
        "n + kappa their covariance is too small.",
        _COUNT,
        not_scaled,
    ),
    Misconception(
        "root scaled by n + kappa itself",
        _POINTS,
        "The root is multiplied by n + kappa. It is the covariance that is scaled so; its root follows with the root "
        "of the number.",
        _ONE,
        scaled_by_the_square,
    ),
    Misconception(
        "rows of the root",
        _POINTS,
        "The rows of the lower root are added to the mean. L L^T is the sum of squares of columns; rows have another "
        "covariance.",
        _COUNT,
        rows_of_the_root,
    ),
    Misconception(
        "standard deviations alone",
        _POINTS,
        "Each point goes along one axis by its standard deviation. The correlations are lost: the points lie on the "
        "axes and not on those of the ellipse.",
        _COUNT,
        standard_deviations_alone,
    ),
    Misconception(
        "symmetric root",
        _POINTS,
        "The points are those of the symmetric root. They have the right mean and covariance and would make a good "
        "filter, but not the numbers of this one, which takes the lower triangular root.",
        "Which numbers of your root, above or below the diagonal, should be 0?",
        symmetric_root,
    ),
    Misconception(
        "plus and minus in turns",
        _POINTS,
        "The points come as plus, minus, plus, minus. The notebook wants the centre, then all plus, then all minus.",
        "Print the first column of your points.",
        pairs_interleaved,
    ),
    Misconception(
        "weights not halved",
        _POINTS,
        "The outer weights are twice what they should be: each column of the root makes two points, and they share "
        "its weight.",
        "What is the sum of your weights?",
        weights_not_halved,
    ),
    Misconception(
        "equal weights",
        _POINTS,
        "All points weigh the same. The spread of the points depends on kappa, so the weights must as well.",
        _COUNT,
        equal_weights,
    ),
    Misconception(
        "negative weight cut off",
        _POINTS,
        "A negative weight is replaced by 0. It is no probability, and allowed: without it the points have too large "
        "a covariance.",
        _COUNT,
        negative_weight_cut,
    ),
    Misconception(
        "mean moved alone",
        _PREDICT,
        "The predicted mean is the image of the mean, as in the extended filter. The average of the images is another "
        "point: on an arc with an unknown heading it lies nearer to the start.",
        "Of a hundred robots that look in a hundred directions, where is the middle after a metre?",
        mean_moved_alone,
    ),
    Misconception(
        "control without noise",
        _PREDICT,
        "All points get the same control. Its noise is part of what is uncertain, and needs points of its own.",
        _TRY,
        control_certain,
    ),
    Misconception(
        "noise of the control added to the pose",
        _PREDICT,
        "M is added to the predicted covariance. It belongs to v, omega and gamma: it has other units, and its way "
        "into the pose leads through the motion.",
        "Which unit has M[0, 0], which the covariance's entry for x?",
        noise_on_the_pose,
    ),
    Misconception(
        "control left out of the points",
        _PREDICT,
        "The points are moved by the noise of the control, and the control itself is missing, as in the formula that "
        "the source prints.",
        "Where does the point in the centre end, if nothing is uncertain?",
        control_left_out,
    ),
    Misconception(
        "noise multiplied by dt",
        _PREDICT,
        "M is multiplied by dt. Here it is the covariance of the control that is held for the whole step.",
        "How is M defined, and where does dt come in anyway?",
        noise_per_second,
    ),
    Misconception(
        "squares about the mean with a negative weight",
        _PREDICT,
        "With a negative weight in the centre the squares are still taken about the mean. The centre's own square "
        "then counts against the others, and a variance may come out negative.",
        "About which point has the centre's square no weight at all?",
        squares_about_the_mean,
    ),
    Misconception(
        "squares about the centre with positive weights",
        _PREDICT,
        "The squares are taken about the image of the centre for positive weights too. Spread about another point "
        "than the mean is larger than the covariance.",
        "What is the covariance of numbers, and about what are its squares taken?",
        squares_about_the_centre,
    ),
    Misconception(
        "headings averaged as wrapped numbers",
        _PREDICT,
        "The headings of the points are wrapped and then averaged as numbers. Of headings on either side of the cut "
        "the mean looks the other way.",
        "Print the 13 headings of a robot that looks almost straight back.",
        headings_wrapped,
    ),
    Misconception(
        "the caller's covariance overwritten",
        _PREDICT,
        "The new covariance is written into the array that was given. The caller's belief from before is gone.",
        "Which operations make a new array, and which write into the old one?",
        covariance_overwritten,
    ),
)
