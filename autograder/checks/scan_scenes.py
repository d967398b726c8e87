"""Scans for the hidden checks of *split-and-merge*: walls, rooms and bends as a scanner sees them, with errors."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.checks.circle import nearest_turn
from roboloc_reference import extraction

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

    from autograder.check import Case

LIMIT = 0.05
ERROR = 0.008
MARGIN = 1e-6
Scene = tuple[np.ndarray, np.ndarray, dict[str, float]]


def parameters() -> dict[str, float]:
    """Return what counts as a line in the scenes."""
    return {"min_segment_length": 0.3, "line_point_distance": LIMIT, "max_point_gap": 0.5, "min_points": 5}


def table(theta: np.ndarray, rho: np.ndarray) -> np.ndarray:
    """Return alpha, r of the line through the beams i to j - 1, for every i < j; NaN elsewhere.

    The line of a single point is the one that its beam meets at a right angle.
    """
    z = rho * np.exp(1j * theta)
    sums = np.cumsum(np.concatenate([[0.0], z]))
    squares = np.cumsum(np.concatenate([[0.0], z**2]))
    count = np.arange(z.size + 1) - np.arange(z.size + 1)[:, None]
    with np.errstate(all="ignore"):
        mean = (sums - sums[:, None]) / count
        alpha = 0.5 * np.angle((sums - sums[:, None]) * mean - (squares - squares[:, None]))
        r = (mean * np.exp(-1j * alpha)).real
    flip = r < 0
    found = np.stack(
        [np.where(flip, alpha - np.pi * np.where(alpha > 0, 1.0, -1.0), alpha), np.abs(r)], axis=-1
    )
    found[count <= 0] = np.nan
    at = np.arange(z.size)
    found[at, at + 1] = np.stack([theta, rho], axis=1)
    return found


def _seen(rng: Generator, corners: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return bearings, ranges and wall of beams that sweep over a chain of walls, given by its corners."""
    phi = np.unwrap(np.angle(corners))
    theta = np.linspace(phi[0] + 0.01, phi[-1] - 0.01, count)
    which = np.clip(np.searchsorted(phi, theta) - 1, 0, len(corners) - 2)
    a, edge = corners[which], np.diff(corners)[which]
    ray = np.exp(1j * theta)
    rho = (a * np.conj(edge)).imag / (ray * np.conj(edge)).imag
    return theta, rho + ERROR * rng.uniform(-1.0, 1.0, count), which


def _chain(rng: Generator, walls: int) -> np.ndarray:
    """Draw the corners of a chain of walls around the scanner, each corner a clear one."""
    while True:
        steps = rng.uniform(0.55, 0.95, walls)
        phi = rng.uniform(-2.5, -1.5) + np.concatenate([[0.0], np.cumsum(steps)])
        corners = rng.uniform(1.4, 2.4, walls + 1) * np.exp(1j * phi)
        edges = np.diff(corners)
        turns = np.angle(edges[1:] / edges[:-1])
        lean = np.abs((edges / np.abs(edges) / np.exp(1j * (phi[1:] + phi[:-1]) / 2)).imag)
        if np.abs(turns).min(initial=1.0) > 0.45 and np.abs(edges).min() > 0.8 and lean.min() > 0.6:
            return corners


def room(rng: Generator, walls: int) -> Scene:
    """Draw a scan of a chain of walls."""
    theta, rho, _ = _seen(rng, _chain(rng, walls), 13 * walls + int(rng.integers(0, 5)))
    return theta, rho, parameters()


def pieces(rng: Generator, walls: int) -> tuple[Scene, list[int]]:
    """Draw a scan of a chain of walls, and say where each begins."""
    while True:
        theta, rho, which = _seen(rng, _chain(rng, walls), 16 * walls + int(rng.integers(0, 5)))
        begins = np.searchsorted(which, np.arange(walls + 1)).tolist()
        if np.diff(begins).min() > 11:
            return (theta, rho, parameters()), begins


def wall(rng: Generator, *, doors: int = 0, step: bool = False, post: bool = False) -> Scene:
    """Draw a scan of one wall: with doorways, with its second half farther away, or with a post in front of it."""
    normal, r = rng.uniform(-np.pi, np.pi), rng.uniform(1.0, 1.8)
    along = np.linspace(-1.6, 1.6, 30) + rng.uniform(-0.02, 0.02, 30)
    if doors:
        begins = np.sort(rng.choice([6, 9, 12, 15, 18, 21], doors, replace=False)) + rng.integers(0, 2)
        along = along + 0.75 * np.sum(np.arange(30)[:, None] >= begins, axis=1) - 0.375 * doors
    depth = r + ERROR * rng.uniform(-1.0, 1.0, 30)
    if step:
        behind = np.arange(30) >= rng.integers(10, 20)
        depth = depth + rng.uniform(0.55, 0.75) * behind
        along = along * np.where(behind, depth / r, 1.0)
    if post:
        k = int(rng.integers(5, 25))
        depth[k] -= 0.7
        along[k] *= depth[k] / r
    return _facing(normal, depth, along)


def bend(rng: Generator, share: float, *, middle: bool = False) -> Scene:
    """Draw a scan of a wall with a slight bend; `share` is how far it is from one line, in shares of the limit."""
    normal, r = rng.uniform(-np.pi, np.pi), rng.uniform(1.0, 1.8)
    along = np.linspace(-1.2, 1.2, 24) + (0.0 if middle else rng.choice([-0.3, 0.3]))
    hinge = np.maximum(along, 0.0)
    slope = share * LIMIT / np.abs(hinge - np.polyval(np.polyfit(along, hinge, 1), along)).max()
    slope *= rng.choice([-1.0, 1.0])
    depth = r + slope * hinge + 0.5 * ERROR * rng.uniform(-1.0, 1.0, 24)
    return _facing(normal, depth, along)


def ends_alone(rng: Generator) -> Scene:
    """Draw a scan of a wall of which the first and the last beam are seen through doorways."""
    normal, r = rng.uniform(-np.pi, np.pi), rng.uniform(1.0, 1.8)
    along = np.linspace(-1.2, 1.2, 24) + rng.uniform(-0.02, 0.02, 24)
    along[[0, -1]] += [-0.7, 0.7]
    return _facing(normal, r + ERROR * rng.uniform(-1.0, 1.0, 24), along)


def lip(rng: Generator, normal: float, side: float) -> Scene:
    """Draw a scan of a wall whose last two beams stand aside."""
    return _with_aside(rng, normal, side * rng.uniform(2.1, 2.4) * LIMIT, slice(-2, None))


def beside(rng: Generator, normal: float, side: float) -> Scene:
    """Draw a scan of a wall with one beam beside it."""
    k = int(rng.integers(8, 16))
    return _with_aside(rng, normal, side * rng.uniform(1.5, 1.8) * LIMIT, slice(k, k + 1))


def _with_aside(rng: Generator, normal: float, far: float, which: slice) -> Scene:
    """Draw a scan of a wall of which some beams are too far from the line of all, to one side only."""
    while True:
        depth = rng.uniform(1.0, 1.8) + 0.5 * ERROR * rng.uniform(-1.0, 1.0, 24)
        depth[which] += far
        scene = _facing(normal, depth, np.linspace(-1.2, 1.2, 24))
        if one_sided(scene, 0, 24):
            return scene


def both_sides(rng: Generator, make: Callable[..., Scene]) -> list[Callable[[], Scene]]:
    """Return how to draw walls that face the same way: of one some beams stand out, of the other they stand back."""
    normal = rng.uniform(-np.pi, np.pi)
    return [partial(make, rng, normal, side) for side in (-1.0, 1.0)]


def one_sided(scene: Scene, i: int, j: int) -> bool:
    """Tell whether a run is too far from its line to one side, and not to the other."""
    theta, rho, _ = scene
    alpha, r = table(theta, rho)[i, j]
    off = rho[i:j] * np.cos(theta[i:j] - alpha) - r
    near, far = sorted((off.max(), -off.min()))
    return bool(near < 0.9 * LIMIT < 1.1 * LIMIT < far)


def small_things(rng: Generator) -> Scene:
    """Draw a scan of a wall of 10 beams, a post of 2 that is straight, and one of 3 that is not, far apart."""
    along = np.concatenate([np.linspace(-1.8, -0.9, 10), [-0.1, 0.05], [0.8, 1.05, 1.3]])
    depth = rng.uniform(1.4, 1.8) + 0.5 * ERROR * rng.uniform(-1.0, 1.0, along.size)
    depth[-2] += rng.choice([-1.0, 1.0]) * rng.uniform(3.0, 3.5) * LIMIT
    return _facing(rng.uniform(-np.pi, np.pi), depth, along)


def _facing(normal: float, depth: np.ndarray, along: np.ndarray) -> Scene:
    """Return the scan of points at some depths along a wall, whose normal has this direction."""
    z = (depth + 1j * along) * np.exp(1j * normal)
    return np.unwrap(np.angle(z)), np.abs(z), parameters()


def in_any_turn(right: dict[str, Any], got: dict[str, Any]) -> dict[str, Any]:
    """Accept angles in any turn."""
    if got["alpha"] is None:
        return got
    return {**got, "alpha": nearest_turn(got["alpha"], right["alpha"])}


def clear(theta: np.ndarray, rho: np.ndarray, params: dict[str, float]) -> bool:
    """Tell whether nothing about a scan is nearly a tie: neither a gap, nor a line, nor the place of a cut."""
    scan = extraction._points(theta, rho, extraction._params(params))  # noqa: SLF001 - the same project
    clean = np.abs(scan.steps - params["max_point_gap"]).min(initial=1.0) > MARGIN
    clean &= all(
        abs(scan.distance(i, j) - LIMIT) > MARGIN for i, j in (*visited(theta, rho, params), *scan.split())
    )
    for i, j in visited(theta, rho, params) if clean else ():
        costs = [misfit(theta, rho, i, m) + misfit(theta, rho, m, j) for m in range(i + 1, j)]
        least, second = np.partition(costs, 1)[:2] if len(costs) > 1 else (0.0, 1.0)
        clean &= second - least > 1e-9
    return bool(clean)


def visited(theta: np.ndarray, rho: np.ndarray, params: dict[str, float]) -> list[tuple[int, int]]:
    """Return the runs that are cut because they are no lines."""
    scan = extraction._points(theta, rho, extraction._params(params))  # noqa: SLF001 - the same project
    todo, found = scan.runs(), []
    while todo:
        i, j = todo.pop()
        if not scan.is_line(i, j):
            k = scan.corner(i, j, 1)
            found.append((i, j))
            todo += [(i, k), (k, j)]
    return found


def misfit(theta: np.ndarray, rho: np.ndarray, i: int, j: int) -> float:
    """Return the sum of the squared distances of a run from its own line."""
    z = rho[i:j] * np.exp(1j * theta[i:j])
    z = z - z.mean()
    return float(np.sum(np.abs(z) ** 2) - abs(np.sum(z**2))) / 2


def decided(theta: np.ndarray, rho: np.ndarray, ranges: list, params: dict[str, float]) -> bool:
    """Tell whether no joint distance of pieces is nearly the limit, and no two are nearly alike."""
    scan = extraction._points(theta, rho, extraction._params(params))  # noqa: SLF001 - the same project
    starts, ends = sorted({i for i, _ in ranges}), sorted({j for _, j in ranges})
    far = np.sort([scan.distance(i, j) for i in starts for j in ends if j - i > 2])
    return bool(np.diff(far).min(initial=1.0) > MARGIN and np.abs(far - LIMIT).min() > MARGIN)


def differ(lines: np.ndarray, i: int, k: int, j: int) -> bool:
    """Tell whether two pieces of a wall are so short that their directions differ, as they do by noise."""
    return bool(abs(np.sin(lines[i, k, 0] - lines[k, j, 0])) > 0.06)


def drawn(count: int, make: Any) -> list[Case]:
    """Draw until there are enough cases; None is no case."""
    found: list[Case] = []
    while len(found) < count:
        case = make()
        found += [case] if case else []
    return found
