"""Scenes for *monte-carlo-localization*: which line each particle takes for which, with choices that are clear.

Association is a choice, and a choice has no tolerance. So every scene is drawn until the nearest line of each
observation is nearer than the next one, for each particle, by far more than rounding. Every scene asks one question: in
the plain ones all ways of judging agree, each of the others is a trap for one of them. Arguments are those of
``compute_innovations``. The `many_...` at the end are no secret: with them the lines are counted that a stage runs.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from roboloc.angles import wrap

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

_BATCH = 200  # scenes that are drawn at once; a few in a thousand are wanted
_TRIES = 1000


def _differences(z_raw: np.ndarray, hs: np.ndarray) -> np.ndarray:
    """Return z - h for all pairs of every scene, (B, M, I, J, 2), not wrapped."""
    return z_raw.swapaxes(1, 2)[:, None, :, None] - hs.swapaxes(2, 3)[:, :, None]


def _forms(v: np.ndarray, S: np.ndarray) -> np.ndarray:
    """Return v^T S v for all pairs, (B, M, I, J), S (B, I, 2, 2) being that of the observation."""
    return np.sum(v @ S[:, None] * v, axis=-1)


def _draw(rng: Generator, size: tuple[int, int, int], spread: tuple[float, float]) -> tuple:
    """Draw scenes, not chosen: z_raw (B, 2, I), Q_raw (B, I, 2, 2), hs (B, M, 2, J)."""
    M, count, J = size
    hs = np.stack([rng.uniform(-3.1, 3.1, (_BATCH, M, J)), rng.uniform(0.5, 4.0, (_BATCH, M, J))], axis=2)
    z_raw = np.stack(
        [rng.uniform(-3.1, 3.1, (_BATCH, count)), rng.uniform(0.5, 4.0, (_BATCH, count))], axis=1
    )
    A = rng.normal(size=(_BATCH, count, 2, 2)) + rng.uniform(0.5, 2.0, (_BATCH, count, 1, 2)) * np.eye(2)
    half = A @ A.swapaxes(2, 3) * rng.uniform(*spread, (_BATCH, count, 1, 1)) ** 2 / 4
    return z_raw, half + half.swapaxes(2, 3), hs


def _scene(
    rng: Generator,
    size: tuple[int, int, int],
    accept: Callable[[dict[str, np.ndarray]], np.ndarray],
    spread: tuple[float, float] = (0.4, 0.9),
) -> tuple:
    """Draw a scene with clear choices; `accept` is told where several ways of judging go wrong, (B, M, I) each.

    Where there are several particles and lines, not all particles choose alike. The observations have standard
    deviations of about `spread`.
    """
    M, _, J = size
    for _ in range(_TRIES):
        z_raw, Q_raw, hs = _draw(rng, size, spread)
        raw = _differences(z_raw, hs)
        v = raw.copy()
        v[..., 0] = wrap(v[..., 0])
        P = np.linalg.inv(Q_raw)
        d2 = _forms(v, P)
        ordered = np.sort(d2, axis=3)
        nearest = d2.argmin(axis=3)
        wrong = {
            "euclidean": np.sum(v * v, axis=-1),
            "not inverted": _forms(v, Q_raw),
            "not wrapped": _forms(raw, P),
            "first covariance": _forms(v, np.broadcast_to(P[:, :1], P.shape)),
        }
        choices = {name: one.argmin(axis=3) for name, one in wrong.items()}
        found = {name: one != nearest for name, one in choices.items()}
        found["told apart"] = choices["euclidean"] != choices["not inverted"]
        ends = np.take_along_axis(raw[..., 0], nearest[..., None], 3)[..., 0]
        found["not wrapped"] |= np.abs(ends) > math.pi
        found["far"] = ordered[..., 0] > 16.0
        found["gated"] = ordered[..., 0] > 8.0
        good = (np.abs(np.abs(raw[..., 0]) - math.pi) > 0.02).all(axis=(1, 2, 3)) & accept(found)
        if J > 1:
            gaps = ordered[..., 1] - ordered[..., 0]
            good &= (gaps >= 0.05 * ordered[..., 1] + 0.02).all(axis=(1, 2))
        if min(M, J) > 1:
            good &= (nearest != nearest[:, :1]).any(axis=(1, 2))
        if good.any():
            first = int(good.argmax())
            return z_raw[first], Q_raw[first], hs[first]
    raise AssertionError  # pragma: no cover


def _only(*traps: str, least: float = 0.2) -> Callable[[dict[str, np.ndarray]], np.ndarray]:
    """Return what accepts scenes in which just these ways of judging go wrong, for a share of the pairs."""

    def accept(found: dict[str, np.ndarray]) -> np.ndarray:
        told = [
            one.mean(axis=(1, 2)) > least if name in traps else ~one.any(axis=(1, 2))
            for name, one in found.items()
        ]
        return np.logical_and.reduce(told)

    return accept


def plain(rng: Generator) -> list[tuple]:
    """Make scenes in which every way of judging finds the same lines."""
    return [_scene(rng, size, _only()) for size in ((3, 2, 2), (4, 1, 3), (2, 2, 3))]


def judged_by_covariance(rng: Generator) -> list[tuple]:
    """Make scenes in which the distance without the covariance, or with it not inverted, finds other lines."""
    return [_scene(rng, (3, 2, 3), _only("euclidean", "not inverted", "told apart")) for _ in range(2)]


def own_covariance(rng: Generator) -> list[tuple]:
    """Make scenes in which the covariance of another observation finds other lines."""
    return [_scene(rng, (3, 2, 2), _only("first covariance", least=0.1)) for _ in range(2)]


def wrapped(rng: Generator) -> list[tuple]:
    """Make scenes in which the nearest line is across the end of a turn."""
    return [_scene(rng, (3, 2, 2), _only("not wrapped")) for _ in range(3)]


def far(rng: Generator) -> list[tuple]:
    """Make scenes in which no line is near, by any gate."""
    return [_scene(rng, (3, 2, 2), _only("far", "gated", least=0.6), (0.04, 0.1)) for _ in range(2)]


def scenes(rng: Generator) -> list[tuple]:
    """Make scenes of one particle, one observation, one line, and of more."""
    return [_scene(rng, size, _only()) for size in ((1, 1, 1), (1, 3, 2), (5, 1, 2), (2, 3, 1), (3, 3, 2))]


def many_matched(M: int) -> tuple:
    """Return what M particles expect in a room, and what is seen, which are no secret."""
    hs = np.random.default_rng(M).normal(size=(M, 2, 3)) * [[0.3], [0.2]] + [
        [0.0, 2.0, -2.0],
        [2.0, 1.5, 3.0],
    ]
    return (
        np.array([[0.1, -1.9], [2.1, 2.8]]),
        np.array([np.diag([0.01, 0.02]), [[0.02, 0.01], [0.01, 0.03]]]),
        hs,
    )


def many_moved(M: int) -> tuple:
    """Return M particles and controls that are no secret."""
    rng = np.random.default_rng(M)
    us = rng.normal(size=(M, 2))
    us[::7, 1] = 0.0
    return rng.normal(size=(M, 3)), us, 0.5


def many_seen(M: int) -> tuple:
    """Return M particles in a map that are no secret."""
    map_lines = np.array([[0.4, 2.0, -1.3], [2.0, 1.5, 3.0]])
    return np.random.default_rng(M).normal(size=(M, 3)), map_lines, np.array([0.2, 0.1, 0.3])


def many_weighed(M: int) -> tuple:
    """Return innovations of M particles that are no secret."""
    vs = np.random.default_rng(M).normal(size=(M, 4)) * 0.1
    return vs, np.array([np.diag([0.01, 0.02]), [[0.02, 0.01], [0.01, 0.03]]]), np.full(M, 1 / M)
