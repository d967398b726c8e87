"""Wrong versions of the weights of bearings and ranges, and of the effective sample size."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.misconceptions.model import Misconception

if TYPE_CHECKING:
    from collections.abc import Callable


def _expected(xs: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    """Return bearings, between -pi and pi, and ranges from every pose, (M, k, 2)."""
    to = landmarks - xs[:, None, :2]
    sight = (to[..., 0] + 1j * to[..., 1]) * np.exp(-1j * xs[:, 2:])
    return np.stack([np.angle(sight), np.abs(sight)], axis=-1)


def _innovations(xs: np.ndarray, z: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    """Return bearings, wrapped, and ranges: seen less expected, (M, k, 2)."""
    v = np.reshape(z, (-1, 2)) - _expected(xs, landmarks)
    v[..., 0] = np.angle(np.exp(1j * v[..., 0]))
    return v


def _squares(v: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """Return the squared distances (M, k)."""
    return np.einsum("mki,ij,mkj->mk", v, np.linalg.inv(Q), v)


def _by_logs(ws: np.ndarray, exponents: np.ndarray) -> np.ndarray:
    """Return normalised weights, by logarithms."""
    with np.errstate(divide="ignore"):
        logs = np.log(ws) + exponents
    likely = np.exp(logs - logs.max())
    return likely / likely.sum()


def _directly(ws: np.ndarray, likelihoods: np.ndarray) -> np.ndarray:
    """Return normalised products; equal weights where all of them are 0."""
    likely = ws * likelihoods
    return likely / likely.sum() if likely.sum() else np.full(len(ws), 1.0 / len(ws))


def _with(
    innovations: Callable = _innovations,
    squares: Callable = _squares,
    exponents: Callable = lambda d2: -0.5 * d2.sum(axis=1),
) -> Callable:
    """Return a correction of which one part is another."""

    def function(
        xs: np.ndarray, ws: np.ndarray, z: np.ndarray, landmarks: np.ndarray, Q: np.ndarray
    ) -> np.ndarray:
        return _by_logs(ws, exponents(squares(innovations(xs, z, landmarks), Q)))

    return function


def _not_wrapped(xs: np.ndarray, z: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    """Leave the difference of the bearings as it is."""
    return np.reshape(z, (-1, 2)) - _expected(xs, landmarks)


def _heading_forgotten(xs: np.ndarray, z: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    """Count the bearings from the x axis."""
    return _innovations(xs * [1.0, 1.0, 0.0], z, landmarks)


def _range_first(xs: np.ndarray, z: np.ndarray, landmarks: np.ndarray) -> np.ndarray:
    """Take the expected range for the bearing and the bearing for the range."""
    v = np.reshape(z, (-1, 2)) - _expected(xs, landmarks)[..., ::-1]
    v[..., 0] = np.angle(np.exp(1j * v[..., 0]))
    return v


def earlier_left_out(xs: np.ndarray, ws: np.ndarray, *rest: Any) -> np.ndarray:
    """Weigh anew in each step."""
    z, landmarks, Q = rest
    even = np.ones(len(ws))
    return _by_logs(even, -0.5 * _squares(_innovations(xs, z, landmarks), Q).sum(axis=1))


def without_logarithms(
    xs: np.ndarray, ws: np.ndarray, z: np.ndarray, landmarks: np.ndarray, Q: np.ndarray
) -> np.ndarray:
    """Multiply densities as they are."""
    return _directly(ws, np.exp(-0.5 * _squares(_innovations(xs, z, landmarks), Q)).prod(axis=1))


def added(xs: np.ndarray, ws: np.ndarray, z: np.ndarray, landmarks: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """Add the densities of the landmarks."""
    if not len(landmarks):
        return _directly(ws, np.ones(len(ws)))
    return _directly(ws, np.exp(-0.5 * _squares(_innovations(xs, z, landmarks), Q)).sum(axis=1))


def not_normalised(
    xs: np.ndarray, ws: np.ndarray, z: np.ndarray, landmarks: np.ndarray, Q: np.ndarray
) -> np.ndarray:
    """Return the products as they are."""
    return ws * np.exp(-0.5 * _squares(_innovations(xs, z, landmarks), Q)).prod(axis=1)


def revived(xs: np.ndarray, ws: np.ndarray, *rest: Any) -> np.ndarray:
    """Add a small number to every weight, so that the logarithm is finite."""
    return _RIGHT(xs, ws + 1e-3, *rest)


def in_place(xs: np.ndarray, ws: np.ndarray, *rest: Any) -> np.ndarray:
    """Write the new weights over the old."""
    ws[:] = _RIGHT(xs, ws, *rest)
    return ws


def _diagonal_alone(v: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """Use the variances, and leave the correlation out."""
    return (v**2 / np.diag(Q)).sum(axis=-1)


def _as_deviations(v: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """Divide by Q as if it held deviations."""
    return _squares(v, Q @ Q)


_RIGHT = _with()
_ONE = "One particle, one landmark at (1, 2): work the exponent out by hand, number by number."
_TWO = (
    "Two particles that explain what is seen equally well, and weighed 0.9 and 0.1: what do they weigh now?"
)
_CORRECT, _SIZE = "particle.correct", "particle.effective_sample_size"

_WEIGHTS = (
    (
        "earlier weights dropped",
        (
            "The weights are those of this observation alone. Between two resamplings a particle has explained, "
            "or not, all that was seen since; each step multiplies what there is."
        ),
        _TWO,
        earlier_left_out,
    ),
    (
        "bearing's innovation not wrapped",
        (
            "The difference of two bearings is used as it comes. Straight behind the robot it is nearly a whole "
            "turn, and the best particles lose all their weight."
        ),
        "Take a bearing of 3.1 and a prediction of -3.1, and print every step.",
        _with(_not_wrapped),
    ),
    (
        "likelihoods without logarithms",
        (
            "Densities are multiplied as they are. Far from what is seen all of them are 0 in floating point, and"
            " the cloud forgets which of its particles was the best of a bad lot."
        ),
        "Print the densities for an observation that is 60 deviations off.",
        without_logarithms,
    ),
    (
        "likelihoods of landmarks added",
        (
            "The densities of several landmarks are added. A particle that explains one of them then need not "
            "explain the others: that is an or in the place of an and."
        ),
        "A particle explains one landmark well and the other not at all. How probable is it?",
        added,
    ),
    (
        "first of the landmarks alone",
        (
            "Only the first bearing and range are used. The others would have told the particles apart that the "
            "first cannot."
        ),
        "Does your weight change when the second landmark is moved?",
        _with(exponents=lambda d2: -0.5 * d2[:, :1].sum(axis=1)),
    ),
    (
        "half of the exponent missing",
        (
            "The exponent lacks its factor 1/2. The sensor then counts as better than it is, by the root of 2, "
            "and the cloud thins out too fast."
        ),
        "One standard deviation off, what is left of a normal density?",
        _with(exponents=lambda d2: -d2.sum(axis=1)),
    ),
    (
        "correlation of the sensor left out",
        (
            "Bearing and range are weighed by their variances alone. Where Q has a number beside its diagonal, "
            "they err together, and errors of like sign are more probable than others."
        ),
        "Try a Q that is not diagonal, and compare with a density that you trust.",
        _with(squares=_diagonal_alone),
    ),
    (
        "Q taken for deviations",
        (
            "Q holds variances; it is used as if it held standard deviations. With errors below 1 the sensor "
            "counts as far better than it is."
        ),
        _ONE,
        _with(squares=_as_deviations),
    ),
    (
        "weights not normalised",
        (
            "The products come back as they are. Each step makes them smaller, until they are 0, and a mean of "
            "particles with such weights is no mean."
        ),
        "What do your weights add up to?",
        not_normalised,
    ),
    (
        "range taken for the bearing",
        (
            "An observation is bearing, range, bearing, range; the prediction has them the other way round, and "
            "metres are compared with radians."
        ),
        _ONE,
        _with(_range_first),
    ),
    (
        "heading left out of the bearing",
        (
            "The direction of a landmark is compared with a bearing as if every particle looked along the x axis."
            " Then nothing that is seen tells headings apart."
        ),
        _ONE,
        _with(_heading_forgotten),
    ),
    (
        "small number added to the weights",
        (
            "A small number is added before the logarithm is taken, so that it exists. Particles that were "
            "impossible come back, and all ratios change a little."
        ),
        "What is the exponential of the logarithm of 0, and does anything need it to be finite?",
        revived,
    ),
    (
        "weights overwritten",
        (
            "The new weights are written into the array that was handed over: the caller's weights are changed by"
            " being looked at."
        ),
        "Does your function write to ws, or to a new array?",
        in_place,
    ),
)


def _normal(ws: np.ndarray) -> np.ndarray:
    return ws / ws.sum()


def size_in_place(ws: np.ndarray) -> float:
    """Normalise the caller's weights."""
    ws /= ws.sum()
    return float(1.0 / (ws @ ws))


def squared_first(ws: np.ndarray) -> float:
    """Square before anything is scaled."""
    return float(ws.sum() ** 2 / max(float(ws @ ws), 1e-300))


def perplexity(ws: np.ndarray) -> float:
    """Take the exponential of the entropy."""
    w = _normal(ws[ws > 0])
    return float(np.exp(-np.sum(w * np.log(w))))


_EQUAL = "Four equal weights of 1/4 each: what must come out, and what does?"
_HALVES = "Weights 1/2, 1/4 and 1/4, by hand: 8/3. Which of your steps is off?"

_SIZES = (
    (
        "sum of the weights taken for 1 in the size",
        (
            "The formula for weights of sum 1 is used for weights of any sum: twice the weights are a quarter of "
            "the size."
        ),
        "Multiply all weights by 2: is it another cloud?",
        lambda ws: float(1.0 / max(float(ws @ ws), 1e-300)),
    ),
    (
        "sum not squared",
        (
            "The sum of the weights is divided by the sum of their squares. That is right for a sum of 1, and has"
            " the unit of one over a weight."
        ),
        "Multiply all weights by 2: is it another cloud?",
        lambda ws: float(ws.sum() / max(float(ws @ ws), 1e-300)),
    ),
    (
        "root of the size",
        "A root is taken of the sum of squares. The size is one over a variance, not over a deviation.",
        _EQUAL,
        lambda ws: float(1.0 / np.sqrt(_normal(ws) @ _normal(ws))),
    ),
    (
        "share in the place of a size",
        (
            "The size is divided by the number of particles. That is handy for a threshold, and it is not what "
            "was asked for."
        ),
        _EQUAL,
        lambda ws: float(1.0 / (_normal(ws) @ _normal(ws)) / len(ws)),
    ),
    (
        "living particles counted",
        (
            "The particles that have any weight are counted. One that has 0.999 and a hundred that share the rest"
            " are then a hundred and one."
        ),
        _HALVES,
        lambda ws: float(np.count_nonzero(ws)),
    ),
    (
        "inverse of the largest weight",
        (
            "One over the largest weight is another measure of how uneven weights are: it looks at one particle "
            "only."
        ),
        _HALVES,
        lambda ws: float(1.0 / _normal(ws).max()),
    ),
    (
        "exponential of the entropy",
        (
            "The exponential of the entropy counts particles as well, in another way: it is larger, wherever the "
            "weights are uneven."
        ),
        _HALVES,
        perplexity,
    ),
    (
        "squared before scaled",
        (
            "Sums and squares are taken of the weights as they come. Weights of 1e-200 have squares of 0, and the"
            " quotient is no number."
        ),
        "Try weights of 1e-200.",
        squared_first,
    ),
    (
        "weights normalised on the way",
        (
            "The weights are divided by their sum in the array that was handed over. The caller asked for a "
            "number, and got other weights."
        ),
        "Does your function write to ws, or to a new array?",
        size_in_place,
    ),
)

MISCONCEPTIONS = tuple(
    Misconception(name, stage, explanation, hint, function)
    for stage, catalogue in ((_CORRECT, _WEIGHTS), (_SIZE, _SIZES))
    for name, explanation, hint, function in catalogue
)
