"""Random rooms with known walls, and what of them a scan sees, for the test of line extraction."""

from math import pi

import numpy as np

from roboloc.lidar import cast_rays
from roboloc.worlds import World, lines_of

MAX_RANGE = 6.0


def outline(rng):
    """Draw a closed room of 4 to 7 walls of 0.8 m or more, 1 m or more from the origin, no corner below 20 degrees."""
    while True:
        phi = np.sort(rng.uniform(-pi, pi, rng.integers(4, 8)))
        corners = rng.uniform(1.5, 5.0, (phi.size, 1)) * np.stack([np.cos(phi), np.sin(phi)], axis=1)
        edges = np.roll(corners, -1, axis=0) - corners
        lengths, heading = np.hypot(*edges.T), np.arctan2(edges[:, 1], edges[:, 0])
        turns = (np.diff(heading, append=heading[0]) + pi) % (2 * pi) - pi
        # The cross product over the length: how far the wall is, positive where the origin is inside.
        r = (corners[:, 0] * edges[:, 1] - corners[:, 1] * edges[:, 0]) / lengths
        if lengths.min() > 0.8 and r.min() > 1.0 and np.abs(turns).min() > np.radians(20):
            return np.hstack([corners, corners + edges])


def with_door(rng, walls):
    """Cut a door of 0.8 m to 1 m out of the longest wall: two walls that lie on one line."""
    lengths = np.hypot(*(walls[:, 2:] - walls[:, :2]).T)
    k = int(np.argmax(lengths))
    a, b = walls[k].reshape(2, 2)
    middle, half = rng.uniform(0.4, 0.6), rng.uniform(0.4, 0.5) / lengths[k]
    ends = [a, a + (middle - half) * (b - a), a + (middle + half) * (b - a), b]
    return np.vstack([walls[:k], np.reshape(ends, (2, 4)), walls[k + 1 :]])


def with_screen(rng, walls):
    """Put a wall of 0.4 m to 0.6 m into the room that hides what is behind it, 0.25 m or more from every wall."""
    while True:
        phi, turn, half = rng.uniform(-pi, pi), rng.uniform(-pi, pi), rng.uniform(0.2, 0.3)
        middle = rng.uniform(0.8, 1.5) * np.array([np.cos(phi), np.sin(phi)])
        screen = np.array([[-1], [1]]) * half * [np.cos(turn), np.sin(turn)] + middle
        if distance(screen, walls) > 0.25:
            return np.vstack([walls, screen.ravel()])


def distance(points, walls):
    """Return how near the nearest of some points in a room is to its walls."""
    a, edge = walls[:, :2], walls[:, 2:] - walls[:, :2]
    along = np.einsum("pwi,wi->pw", points[:, None] - a, edge) / np.sum(edge**2, axis=1)
    foot = a + np.clip(along, 0, 1)[..., None] * edge
    return np.hypot(*(points[:, None] - foot).T).min()


def draw_room(rng):
    """Draw a room, in one of two cases with a door, in one of two with a screen."""
    walls = outline(rng)
    if rng.random() < 0.5:
        walls = with_door(rng, walls)
    if rng.random() < 0.5:
        walls = with_screen(rng, walls)
    return World("room", walls, lines_of(walls), np.zeros(3))


def wall_of_each_beam(world, pose, bearings):
    """Return which wall each beam of a perfect scanner meets, -1 where none is within reach."""
    rho = np.stack([cast_rays(wall[None], pose, bearings, MAX_RANGE) for wall in world.segments])
    rho[np.isnan(rho)] = np.inf
    return np.where(np.isfinite(rho.min(axis=0)), rho.argmin(axis=0), -1)


def line_seen_from(wall, pose):
    """Return alpha, r of a wall in the frame of a scanner at a pose."""
    (x1, y1, x2, y2), (x, y, theta) = wall, pose
    alpha = np.arctan2(x1 - x2, y2 - y1)
    r = (x1 - x) * np.cos(alpha) + (y1 - y) * np.sin(alpha)
    return (alpha - theta, r) if r >= 0 else (alpha + pi - theta, -r)


def stretches(wall, points, max_gap):
    """Return where one wall is seen without a gap: its number, its beams, its length; around the full turn.

    `wall` (N,) is -1 and `points` (N, 2) anything where a beam saw nothing.
    """
    seen = np.flatnonzero(wall >= 0)
    p, w = points[seen], wall[seen]
    ends = np.flatnonzero((w != np.roll(w, -1)) | (np.hypot(*(np.roll(p, -1, axis=0) - p).T) > max_gap))
    found = []
    for begin, end in zip(np.roll(ends, 1) + 1, ends + 1, strict=True):
        part = np.arange(begin, end if end > begin else end + seen.size) % seen.size
        found.append((int(w[part[0]]), seen[part], float(np.hypot(*(p[part[-1]] - p[part[0]])))))
    return found
