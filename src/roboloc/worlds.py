"""Worlds for a robot: straight walls, seen from above.

A wall is a segment ``[x1, y1, x2, y2]``; its line has two numbers ``[alpha, r]``, the direction of the normal
and the distance from the origin:

    x cos(alpha) + y sin(alpha) = r,   r >= 0.

A map holds lines, as columns, and not walls: it says where walls could be, not where they end. Two walls with
a doorway between them lie on one line and are one column. The walls have no thickness and are the same seen
from both sides.

Source: the layout of a map, (2, J) with columns [alpha, r], is that of Stanford AA274A (2021), problem set 4;
both worlds are our own.
"""

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import difference, wrap
from roboloc.validation import as_array

# Two walls lie on one line when their parameters differ by less than this [rad, m].
_SAME_LINE = 1e-9


@dataclass(frozen=True, eq=False)
class World:
    """Walls, the map of their lines, and where a robot starts.

    The arrays are copies that cannot be written to.

    Parameters
    ----------
    name : str
        What the world is called.
    segments : (S, 4) array_like
        Ends x1, y1, x2, y2 of the walls [m].
    map_lines : (2, J) array_like
        Lines alpha, r of the walls [rad, m].
    start : (3,) array_like
        Pose at the start [m, m, rad].

    Raises
    ------
    ValueError
        If an array has another shape or is not finite.
    """

    name: str
    segments: np.ndarray
    map_lines: np.ndarray
    start: np.ndarray

    def __post_init__(self) -> None:
        for name, shape in (("segments", ("S", 4)), ("map_lines", (2, "J")), ("start", (3,))):
            array = as_array(name, getattr(self, name), shape).copy()
            array.flags.writeable = False
            object.__setattr__(self, name, array)


def lines_of(segments: ArrayLike) -> np.ndarray:
    """Return the lines on which walls lie, each once, in the order in which they first occur.

    Parameters
    ----------
    segments : (S, 4) array_like
        Ends x1, y1, x2, y2 of the walls [m].

    Returns
    -------
    (2, J) ndarray
        Lines alpha, r [rad, m], r not negative, alpha in [-pi, pi); J is at most S. A line through the origin
        has its normal in [-pi / 2, pi / 2).

    Raises
    ------
    ValueError
        If `segments` has another shape or is not finite, or if a wall has no length.

    Examples
    --------
    Two walls with a doorway between them, 2 m ahead, are one line.

    >>> lines_of([[2.0, -3.0, 2.0, -1.0], [2.0, 0.0, 2.0, 4.0]]).tolist()
    [[0.0], [2.0]]
    """
    segments = as_array("segments", segments, ("S", 4))
    found: list[tuple[float, float]] = []
    for x1, y1, x2, y2 in segments.tolist():
        length = np.hypot(x2 - x1, y2 - y1)
        if length == 0.0:
            raise ValueError(f"segments: expected walls with a length, got the point ({x1}, {y1})")
        alpha = np.arctan2(x1 - x2, y2 - y1)
        r = (x1 * (y2 - y1) - y1 * (x2 - x1)) / length
        if abs(r) < _SAME_LINE:
            alpha, r = wrap(2.0 * alpha) / 2.0, 0.0
        elif r < 0.0:
            alpha, r = alpha + pi, -r
        line = float(wrap(alpha)) + 0.0, float(r)
        if not any(
            abs(difference(line[0], a)) < _SAME_LINE and abs(line[1] - b) < _SAME_LINE for a, b in found
        ):
            found.append(line)
    return np.array(found).reshape(-1, 2).T


def scatter(world: World, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draw poses from everywhere inside a world's outer walls, looking everywhere.

    An outer wall is one that has all others on one side. Whoever knows nothing but the map of a world may be at any
    of these poses; the floor behind a cut-off corner, which a robot cannot reach, is among them.

    Parameters
    ----------
    world : World
        The world. Where outer walls leave a gap, the smallest upright rectangle about all walls closes it.
    count : int
        How many poses to draw.
    rng : numpy.random.Generator
        Source of the draws.

    Returns
    -------
    (count, 3) ndarray
        Poses, the headings in [-pi, pi) [m, m, rad].

    Raises
    ------
    ValueError
        If all walls are on one line.

    Examples
    --------
    A triangle with two sides of 1 m along the axes: no pose is beyond the third, and on average they are at 1/3.

    >>> corner = [[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]]
    >>> xs = scatter(World("corner", corner, lines_of(corner), [0.2, 0.2, 0.0]), 50_000, np.random.default_rng(0))
    >>> bool((xs[:, 0] + xs[:, 1] < 1.0).all()), xs[:, :2].mean(axis=0).round(2).tolist()
    (True, [0.33, 0.33])
    """
    corners = world.segments.reshape(-1, 2)
    alpha, r = lines_of(world.segments)
    if r.size < 2:
        raise ValueError(f"world: expected walls on two lines or more, got {r.size}")
    normals = np.stack([np.cos(alpha), np.sin(alpha)])
    beyond = corners @ normals - r
    low, high = corners.min(axis=0), corners.max(axis=0)
    # All corners lie between two parallels to each wall. One of them is the wall itself where it is an outer one.
    least, most = beyond.min(axis=0), beyond.max(axis=0)
    kept = np.zeros((0, 3))
    while len(kept) < count:
        xs = rng.uniform([*low, -pi], [*high, pi], (count, 3))
        off = xs[:, :2] @ normals - r
        kept = np.vstack([kept, xs[((off >= least) & (off <= most)).all(axis=1)]])
    return kept[:count]


def maze() -> World:
    """Return a maze of 15 walls on 14 lines: a hall, three rooms and a corridor, 16 m by 12 m.

    The hall in the south-west is so wide that a robot which drives east along the south wall, and sees 3.5 m
    far and 120 degrees to either side, sees that wall alone for more than 6 m. The corridor in the middle has
    two parallel walls. The two walls north of the hall have a doorway between them and share a line.

    Returns
    -------
    World
        The maze, its origin in the middle.

    Examples
    --------
    Fifteen walls, but the doorway of the hall makes two of them one line.

    >>> world = maze()
    >>> len(world.segments), world.map_lines.shape
    (15, (2, 14))
    """
    walls = [
        [-8.0, -6.0, 8.0, -6.0],  # outside: south, east, north, west
        [8.0, -6.0, 8.0, 6.0],
        [8.0, 6.0, -8.0, 6.0],
        [-8.0, 6.0, -8.0, -6.0],
        [-6.0, -0.5, -1.0, -0.5],  # north of the hall, left and right of a doorway
        [0.5, -0.5, 3.0, -0.5],
        [3.0, -0.5, 3.0, -3.2],  # between the hall and the south-east room
        [5.8, -6.0, 8.0, -4.1],  # its cut-off corner
        [4.8, 0.3, 8.0, 0.3],  # between the south-east and the north-east room
        [-4.5, 1.4, 2.5, 1.4],  # north of the corridor
        [2.5, 1.4, 2.5, 3.6],  # between the north-east and the north-west room
        [5.4, 6.0, 8.0, 3.2],  # cut-off corner of the north-east room
        [-1.2, 6.0, -1.7, 3.4],  # a leaning divider of the north-west room
        [-4.5, 1.4, -4.5, 3.3],  # its west end
        [-8.0, 3.4, -5.2, 6.0],  # cut-off corner in the north-west
    ]
    return World("maze", np.array(walls), lines_of(walls), np.array([-6.4, -4.6, 0.0]))


def arena() -> World:
    """Return an arena of 6 walls on 6 lines, 7 m by 6 m, without two that are alike.

    No two walls are parallel, so that a robot which has lost itself can tell where it is from any two.

    Returns
    -------
    World
        The arena, its origin near the middle.

    Examples
    --------
    Six walls, closed: each begins where the one before it ends.

    >>> world = arena()
    >>> bool((world.segments[:, :2] == np.roll(world.segments[:, 2:], 1, axis=0)).all())
    True
    """
    corners = np.array([[-3.6, -3.0], [2.4, -2.5], [3.8, -0.8], [3.2, 2.2], [-0.6, 3.0], [-3.2, 1.6]])
    walls = np.hstack([corners, np.roll(corners, -1, axis=0)])
    return World("arena", walls, lines_of(walls), np.array([-1.6, -1.2, 0.3]))
