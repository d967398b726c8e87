"""Wrong versions of `bootstrap_step`: steps left out, made twice, or made in another order."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.misconceptions.model import Misconception

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

_STAGE = "odometry.bootstrap_step"


def _moved(xs: np.ndarray, odometry: np.ndarray, alphas: np.ndarray, rng: Generator) -> np.ndarray:
    """Move every particle with errors of its own."""
    a1, a2, a3, a4 = alphas
    one, way, two = np.abs(odometry)
    spread = np.array([a1 * one + a2 * way, a3 * way + a4 * (one + two), a1 * two + a2 * way])
    one, way, two = (odometry + spread * rng.standard_normal((len(xs), 3))).T
    direction = xs[:, 2] + one
    return np.stack(
        [xs[:, 0] + way * np.cos(direction), xs[:, 1] + way * np.sin(direction), direction + two], axis=-1
    )


def _innovation(xs: np.ndarray, landmark: np.ndarray, bearing: float) -> np.ndarray:
    """Return what is seen less what is expected, not wrapped."""
    return bearing - np.arctan2(landmark[1] - xs[:, 1], landmark[0] - xs[:, 0]) + xs[:, 2]


def _weighed(ws: np.ndarray, v: np.ndarray, sigma: float) -> np.ndarray:
    """Return weights of sum 1 after an innovation."""
    ws = ws * np.exp(-0.5 * (v / sigma) ** 2)
    return ws / ws.sum()


def _support(xs: np.ndarray, landmark: np.ndarray, bearing: float, sigma: float) -> np.ndarray:
    """Return the support of every particle, of sum 1."""
    v = np.angle(np.exp(1j * _innovation(xs, landmark, bearing)))
    return _weighed(np.ones(len(xs)), v, sigma)


def _combed(ws: np.ndarray, rng: Generator) -> np.ndarray:
    """Return systematic ancestors."""
    marks, m = np.cumsum(ws), len(ws)
    teeth = (rng.uniform(0.0, 1.0 / m) + np.arange(m) / m) * marks[-1]
    return np.searchsorted(marks, np.minimum(teeth, np.nextafter(marks[-1], 0.0)), side="right")


def _even(m: int) -> np.ndarray:
    """Return equal weights."""
    return np.full(m, 1.0 / m)


def earlier_weights(xs, ws, odometry, alphas, landmark, bearing, sigma, rng):  # noqa: ANN001, ANN201
    """Forget the weights from before."""
    xs = _moved(xs, odometry, alphas, rng)
    return xs[_combed(_support(xs, landmark, bearing, sigma), rng)], _even(len(ws))


def weighed_first(xs, ws, odometry, alphas, landmark, bearing, sigma, rng):  # noqa: ANN001, ANN201
    """Weigh where the particles were before the motion."""
    ws = ws * _support(xs, landmark, bearing, sigma)
    xs = _moved(xs, odometry, alphas, rng)
    return xs[_combed(ws, rng)], _even(len(ws))


def old_particles(xs, ws, odometry, alphas, landmark, bearing, sigma, rng):  # noqa: ANN001, ANN201
    """Resample the particles from before the motion."""
    after = _moved(xs, odometry, alphas, rng)
    return xs[_combed(ws * _support(after, landmark, bearing, sigma), rng)], _even(len(ws))


def weights_kept(xs, ws, odometry, alphas, landmark, bearing, sigma, rng):  # noqa: ANN001, ANN201
    """Return the weights of the copied particles."""
    xs = _moved(xs, odometry, alphas, rng)
    ws = ws * _support(xs, landmark, bearing, sigma)
    taken = _combed(ws, rng)
    return xs[taken], ws[taken] / ws[taken].sum()


def not_resampled(xs, ws, odometry, alphas, landmark, bearing, sigma, rng):  # noqa: ANN001, ANN201
    """Return the weighed particles."""
    xs = _moved(xs, odometry, alphas, rng)
    ws = ws * _support(xs, landmark, bearing, sigma)
    return xs, ws / ws.sum()


def bearing_not_wrapped(xs, ws, odometry, alphas, landmark, bearing, sigma, rng):  # noqa: ANN001, ANN201
    """Leave the innovations as they are."""
    xs = _moved(xs, odometry, alphas, rng)
    return xs[_combed(_weighed(ws, _innovation(xs, landmark, bearing), sigma), rng)], _even(len(ws))


def without_error(xs, ws, odometry, alphas, landmark, bearing, sigma, rng):  # noqa: ANN001, ANN201
    """Move all particles exactly as asked."""
    xs = _moved(xs, odometry, 0 * alphas, rng)
    return xs[_combed(ws * _support(xs, landmark, bearing, sigma), rng)], _even(len(ws))


def errors_afterwards(xs, ws, odometry, alphas, landmark, bearing, sigma, rng):  # noqa: ANN001, ANN201
    """Weigh particles that moved exactly, and let them err afterwards."""
    clean = _moved(xs, odometry, 0 * alphas, rng)
    xs = _moved(xs, odometry, alphas, rng)
    return xs[_combed(ws * _support(clean, landmark, bearing, sigma), rng)], _even(len(ws))


def best_alone(xs, ws, odometry, alphas, landmark, bearing, sigma, rng):  # noqa: ANN001, ANN201
    """Copy the best particle into every place."""
    xs = _moved(xs, odometry, alphas, rng)
    best = np.argmax(ws * _support(xs, landmark, bearing, sigma))
    return xs[np.full(len(ws), best)], _even(len(ws))


def weights_of_one(xs, ws, odometry, alphas, landmark, bearing, sigma, rng):  # noqa: ANN001, ANN201
    """Give every copy the weight 1."""
    xs = _moved(xs, odometry, alphas, rng)
    return xs[_combed(ws * _support(xs, landmark, bearing, sigma), rng)], np.ones(len(ws))


_ORDER = "Write the three steps down with what goes into each and what comes out of it."
_COPY = "Two copies of one particle: what does each weigh, and what did the one weigh before?"


def _known(name: str, explanation: str, hint: str, function: Callable) -> Misconception:
    return Misconception(name, _STAGE, explanation, hint, function)


MISCONCEPTIONS = (
    _known(
        "earlier weights left out",
        "The support of the bearing replaces the weights from before. After a step with resampling these are "
        "all equal, so nothing shows until somebody resamples less often.",
        "What does a particle of weight 0 become?",
        earlier_weights,
    ),
    _known(
        "weighed before the motion",
        "The bearing weighs the particles where they were before the motion. It was measured after it.",
        _ORDER,
        weighed_first,
    ),
    _known(
        "particles from before copied",
        "The weights are right, and what is copied are the particles from before the motion. The cloud never moves.",
        _ORDER,
        old_particles,
    ),
    _known(
        "weights kept beside the copies",
        "The copies keep the weights of their originals. What a particle weighed is told by the number of its "
        "copies already, and is then counted twice.",
        _COPY,
        weights_kept,
    ),
    _known(
        "weighed and not resampled",
        "The weighed particles are returned as they are. That is a right belief, but after some steps one "
        "particle has all the weight and the others are carried along for nothing; the step asked for ends "
        "with resampling.",
        _ORDER,
        not_resampled,
    ),
    _known(
        "bearing not wrapped in the step",
        "The innovation is not wrapped. A landmark behind the robot lets the particles die that see it right.",
        "Print the innovations for a landmark straight behind.",
        bearing_not_wrapped,
    ),
    _known(
        "particles moved without error",
        "All particles move exactly as asked. Copies then stay together for ever, and after some steps the "
        "cloud is a few points.",
        "Two copies of one particle: when do they part?",
        without_error,
    ),
    _known(
        "errors drawn after the weighing",
        "The particles are weighed where they would be without error, and err afterwards. The bearing then "
        "never tells a lucky error from an unlucky one.",
        "Which poses does the bearing weigh?",
        errors_afterwards,
    ),
    _known(
        "best particle alone",
        "The particle of the largest weight fills all places. That is a guess and no longer a belief: a "
        "second place where the robot may be is forgotten at once.",
        "How often is a particle taken that has a quarter of the weight?",
        best_alone,
    ),
    _known(
        "weights of 1",
        "Every copy is given the weight 1. All weigh the same, as they should, but they add up to the number "
        "of particles, and a mean taken with them is that many times too large.",
        "What do the weights add up to?",
        weights_of_one,
    ),
)
