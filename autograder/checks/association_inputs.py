"""Hidden scenes for association: walls that are expected, lines that are observed, and choices that are clear.

Association is a choice, and a choice has no tolerance: two correct programs may differ in the last digit of a
distance and then disagree. So every scene is drawn until its choices are clear: the nearest wall is nearer
than the next one, and no distance lies next to the gate, by far more than rounding.

Every scene asks one question. In the plain ones all ways of judging agree and the gate is wide, so only what
is returned counts; the others each hold a trap for one kind of mistake. Arguments are those of
``compute_innovations``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roboloc.angles import wrap

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

_TRIES = 100_000


def covariance(rng: Generator, n: int) -> np.ndarray:
    """Draw a covariance without a special structure: correlated, unequal variances, exactly symmetric."""
    A = rng.normal(size=(n, n)) + np.diag(rng.uniform(0.5, 2.0, n))
    half = A @ A.T / n
    return (half + half.T) / 2


def distances(
    z_raw: np.ndarray, Q_raw: np.ndarray, hs: np.ndarray, Hs: np.ndarray, Sigma: np.ndarray
) -> dict[str, np.ndarray]:
    """Judge every pair of observation and wall in the right way and in several wrong ones: (I, J) each."""
    v = z_raw.T[:, None, :] - hs.T[None]
    v[..., 0] = wrap(v[..., 0])
    P = np.broadcast_to(Hs @ Sigma @ Hs.swapaxes(1, 2), (len(Q_raw), len(Hs), 2, 2))
    Q = np.broadcast_to(Q_raw[:, None], P.shape)

    def squared(S: np.ndarray) -> np.ndarray:
        return np.sum(v * np.linalg.solve(S, v[..., None])[..., 0], axis=-1)

    return {
        "right": squared(P + Q),
        "pose alone": squared(P),
        "observation alone": squared(Q),
        "euclidean": np.sum(v * v, axis=-1),
        "not inverted": np.einsum("ijk,ijkl,ijl->ij", v, P + Q, v),
    }


def _scene(
    rng: Generator,
    steps: list[float],
    walls: list[int],
    *,
    count: int,
    g: float,
    n: int = 3,
    size: float = 0.1,
) -> tuple:
    """Draw walls and lines: line i lies `steps[i]` standard deviations from where wall `walls[i]` is expected.

    The covariances of what is expected and observed are both of the order of `size` squared.
    """
    hs = np.stack([rng.uniform(-np.pi, np.pi, count), rng.uniform(0.8, 4.0, count)])
    Hs = rng.uniform(0.5, 2.0, (count, 2, n)) * rng.choice([-1, 1], (count, 2, n)) / np.sqrt(n)
    Sigma = size**2 * covariance(rng, n)
    Q_raw = np.array([size**2 * covariance(rng, 2) for _ in steps]).reshape(-1, 2, 2)
    z_raw = np.empty((2, len(steps)))
    for i, (step, j) in enumerate(zip(steps, walls, strict=True)):
        S = Hs[j] @ Sigma @ Hs[j].T + Q_raw[i]
        angle = rng.uniform(-np.pi, np.pi)
        z_raw[:, i] = hs[:, j] + step * np.linalg.cholesky(S) @ [np.cos(angle), np.sin(angle)]
    z_raw[0] = wrap(z_raw[0])
    return z_raw, Q_raw, hs, Hs, Sigma, float(g)


def _clear(args: tuple, walls: list[int] | None = None, *, cut: bool = False) -> bool:
    """Tell whether every choice is clear, and is the one meant; and none crosses the cut at pi unless it should."""
    *parts, g = args
    d2 = distances(*parts)["right"]
    nearest = d2.argmin(axis=1)
    first, second = np.sort(d2, axis=1)[:, :2].T
    turn = parts[0][0] - parts[2][0, nearest]
    return bool(
        (walls is None or (nearest == walls).all())
        and (second > 1.2 * first + 0.1).all()
        and (np.abs(first - g**2) > 0.05 * g**2).all()
        and (np.abs(first - g) > 0.05 * g).all()
        and (np.abs(wrap(turn)) < 2.5).all()
        and (cut or (np.abs(turn) < np.pi).all())
        and wrap(turn).min() < 0 < wrap(turn).max()
        and (parts[0][1] > 0.1).all()
    )


def _agreed(args: tuple, walls: list[int]) -> bool:
    """Tell whether every way of judging makes the same choices, and no other wall is inside the gate."""
    *parts, g = args
    ways = distances(*parts)
    rest = np.ones(ways["right"].shape, dtype=bool)
    rest[np.arange(len(walls)), walls] = False
    same = all((d2.argmin(axis=1) == walls).all() for d2 in ways.values())
    return bool(same and (ways["right"][rest] > 1.3 * g**2).all())


def _wide_gate(args: tuple) -> bool:
    """Tell whether every way of judging keeps every line."""
    return all(bool((d2.min(axis=1) < 0.5 * args[-1] ** 2).all()) for d2 in distances(*args[:-1]).values())


def _drawn(draw: Callable[[], tuple], condition: Callable[[tuple], bool]) -> tuple:
    """Draw scenes until one meets its condition."""
    for _ in range(_TRIES):
        args = draw()
        if condition(args):
            return args
    raise RuntimeError("no scene meets its condition")


def _easy(rng: Generator, walls: list[int], steps: list[float], count: int, n: int = 3) -> tuple:
    """Draw lines near walls that are far apart: every way of judging agrees, and the gate is wide."""
    return _drawn(
        lambda: _scene(rng, steps, walls, count=count, g=rng.uniform(5, 6), n=n, size=0.06),
        lambda args: _clear(args, walls) and _agreed(args, walls) and _wide_gate(args),
    )


def _plain(rng: Generator, n: int = 3) -> tuple:
    walls = [[2, 0, 3], [3, 1, 0], [1, 3, 2]][rng.integers(3)]
    return _easy(rng, walls, [0.8, 1.2, 0.5], 4, n)


def plain(rng: Generator) -> list[tuple]:
    """Make scenes in which nothing is in doubt."""
    return [_plain(rng) for _ in range(4)]


def gated(rng: Generator) -> list[tuple]:
    """Make scenes with lines inside the gate, outside it, and between g and its square; g above and below 1."""

    def meant(args: tuple, walls: list[int]) -> bool:
        if not (_clear(args, walls) and _agreed(args, walls)):
            return False
        ways = {name: d2.min(axis=1) < args[-1] ** 2 for name, d2 in distances(*args[:-1]).items()}
        right = ways["right"]
        below = wrap(args[0][0] - args[2][0, walls])[right].min() < 0
        return bool(below and all((ways[f"{one} alone"] != right).any() for one in ("pose", "observation")))

    settings = (
        (2.6, [2.2, 3.2, 1.1], [3, 0, 1]),
        (0.6, [1.2, 0.5, 0.7], [0, 2, 1]),
        (3.4, [4.0, 2.8, 0.7], [1, 3, 2]),
    )
    return [
        _drawn(
            lambda g=g, steps=steps, walls=walls: _scene(rng, steps, walls, count=4, g=g, size=0.06),
            lambda args, walls=walls: meant(args, walls),
        )
        for g, steps, walls in settings
    ]


def crowded(rng: Generator) -> list[tuple]:
    """Make scenes of walls close together, where each way of judging but the right one errs somewhere."""

    def errs(args: tuple) -> bool:
        if not _clear(args):
            return False
        ways = distances(*args[:-1])
        d2 = ways.pop("right")
        inside, nearest = d2 < args[-1] ** 2, d2.argmin(axis=1)
        others = [*(way.argmin(axis=1) for way in ways.values()), inside.argmax(axis=1)]
        distinct = len(set(nearest.tolist())) == len(nearest) and (np.diff(nearest) < 0).any()
        return bool(
            distinct and inside.any(axis=1).all() and all((other != nearest).any() for other in others)
        )

    steps = [1.2, 1.5, 0.7, 1.0]
    return [
        _drawn(lambda: _scene(rng, steps, rng.permutation(6)[:4].tolist(), count=6, g=3.0, size=0.5), errs)
        for _ in range(3)
    ]


def across_the_cut(rng: Generator) -> list[tuple]:
    """Make scenes of walls behind the scanner: observed on one side of the cut at pi, expected on the other."""

    def draw(walls: list[int]) -> tuple:
        z_raw, Q_raw, hs, Hs, Sigma, g = _scene(rng, [0.8, 1.1, 0.6], walls, count=4, g=6.0, size=0.06)
        turns = np.array([np.pi, -np.pi, rng.uniform(-2, 2)]) - (hs[0, walls] + z_raw[0]) / 2
        z_raw[0] = wrap(z_raw[0] + turns)
        hs[0, walls] = wrap(hs[0, walls] + turns)
        return z_raw, Q_raw, hs, Hs, Sigma, g

    def meant(args: tuple, walls: list[int]) -> bool:
        apart = args[0][0] - args[2][0, walls]
        both = (np.abs(apart[:2]) > 5.5).all() and apart[0] * apart[1] < 0 and -0.5 < apart[2] < -0.01
        return bool(both and _clear(args, walls, cut=True) and _agreed(args, walls) and _wide_gate(args))

    return [
        _drawn(lambda walls=walls: draw(walls), lambda args, walls=walls: meant(args, walls))
        for walls in ([2, 0, 3], [3, 1, 0], [1, 3, 2])
    ]


def shared(rng: Generator) -> list[tuple]:
    """Make scenes in which two or three lines are pieces of one wall."""
    settings = (
        ([1, 1, 0], [0.5, 1.1, 0.8]),
        ([2, 0, 2, 2], [0.6, 0.9, 0.4, 1.2]),
        ([0, 2, 0], [0.7, 1.0, 1.3]),
    )
    return [_easy(rng, walls, steps, 3) for walls, steps in settings]


def nothing(rng: Generator) -> list[tuple]:
    """Make scenes of which nothing is kept: no line was seen, or all are outside the gate."""
    far = _drawn(
        lambda: _scene(rng, [3.5, 4.1], [1, 2], count=4, g=2.5, size=0.05), lambda args: _clear(args, [1, 2])
    )
    unseen = [_scene(rng, [], [], count=4, g=3.0, n=n) for n in (3, 4)]
    return [far, *unseen]


def larger(rng: Generator) -> list[tuple]:
    """Make scenes with states of 2, 5 and 9 numbers: the stage serves filters with a map in the state too."""
    return [_plain(rng, n) for n in (2, 5, 9)]
