import dataclasses

import numpy as np
import pytest
from oracles import read_only

from roboloc.worlds import World, arena, lines_of, maze, scatter

WORLDS = [maze(), arena()]


@pytest.mark.parametrize("world", WORLDS, ids=lambda world: world.name)
def test_every_wall_lies_on_a_line_of_the_map(world):
    """Both ends of each wall satisfy the equation of one map line, and each line has a wall."""
    alpha, r = world.map_lines
    normals = np.stack([np.cos(alpha), np.sin(alpha)])
    off = [np.abs(world.segments[:, i : i + 2] @ normals - r) for i in (0, 2)]
    on = np.maximum(*off) < 1e-12
    assert on.any(axis=1).all()
    assert on.any(axis=0).all()
    assert (on.sum(axis=1) == 1).all()


@pytest.mark.parametrize("world", WORLDS, ids=lambda world: world.name)
def test_lines_are_normalized(world):
    """No distance is negative and every normal is in [-pi, pi)."""
    alpha, r = world.map_lines
    assert (r >= 0).all()
    assert ((alpha >= -np.pi) & (alpha < np.pi)).all()


def test_the_maze_has_what_its_description_says():
    """Fifteen walls on fourteen lines, some parallel, some leaning; the robot starts inside."""
    world = maze()
    assert (world.segments.shape, world.map_lines.shape) == ((15, 4), (2, 14))
    upright = np.isclose(np.sin(2 * world.map_lines[0]), 0, atol=1e-12)
    assert (upright.sum(), (~upright).sum()) == (10, 4)
    corners = world.segments[:4, :2]
    np.testing.assert_array_equal(np.abs(corners), np.tile([8, 6], (4, 1)))
    assert (np.abs(world.start[:2]) < [8, 6]).all()


def test_the_arena_is_closed_and_has_no_parallel_walls():
    """Six walls, each beginning where another ends, all directions at least 10 degrees apart."""
    world = arena()
    assert (world.segments.shape, world.map_lines.shape) == ((6, 4), (2, 6))
    np.testing.assert_array_equal(world.segments[:, :2], np.roll(world.segments[:, 2:], 1, axis=0))
    alpha = world.map_lines[0]
    apart = np.abs(np.sin(alpha[:, None] - alpha))[~np.eye(6, dtype=bool)]
    assert apart.min() > np.sin(np.radians(10))


def test_the_direction_in_which_a_wall_is_given_does_not_matter():
    """A wall from b to a lies on the same line as a wall from a to b, also through the origin."""
    rng = np.random.default_rng(2)
    walls = np.vstack([rng.uniform(-3, 3, size=(50, 4)), [[0, 0, 1, 2], [-1, -1, 2, 2], [0, -1, 0, 3]]])
    for x1, y1, x2, y2 in walls:
        there, back = lines_of([[x1, y1, x2, y2]]), lines_of([[x2, y2, x1, y1]])
        np.testing.assert_allclose(there, back, atol=1e-12)
        assert lines_of([[x1, y1, x2, y2], [x2, y2, x1, y1]]).shape == (2, 1)


def test_walls_on_one_line_are_one_column():
    """The order is that of first occurrence."""
    (segments,) = read_only([[1, 0, 1, 1], [0, -2, 3, -2], [1, 5, 1, 4]])
    np.testing.assert_allclose(lines_of(segments), [[0, -np.pi / 2], [1, 2]], atol=1e-15)
    assert lines_of(np.zeros((0, 4))).shape == (2, 0)


def test_a_world_cannot_be_changed():
    """Neither its fields nor its arrays can be written to, and the caller's arrays stay the caller's."""
    segments = np.array([[1.0, 0.0, 1.0, 1.0]])
    world = World("one", segments, lines_of(segments), np.zeros(3))
    segments[:] = 7
    assert world.segments[0, 0] == 1
    for array in (world.segments, world.map_lines, world.start):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(dataclasses.FrozenInstanceError):
        world.name = "other"


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (([[1, 2, 3]], np.zeros((2, 1)), np.zeros(3)), "segments"),
        (([[1, 2, 3, np.nan]], np.zeros((2, 1)), np.zeros(3)), "segments"),
        ((np.ones((1, 4)), np.zeros((1, 2)), np.zeros(3)), "map_lines"),
        ((np.ones((1, 4)), np.zeros((2, 1)), np.zeros(2)), "start"),
    ],
)
def test_a_wrong_argument_of_a_world_is_named(arguments, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        World("wrong", *arguments)


def test_a_wall_without_length_is_refused():
    """A point lies on every line through it."""
    with pytest.raises(ValueError, match=r"^segments: expected walls with a length, got the point \(1"):
        lines_of([[1, 2, 1, 2]])


@pytest.mark.parametrize("world", WORLDS, ids=lambda world: world.name)
def test_poses_are_scattered_evenly_over_the_whole_floor(world):
    """No pose is outside, every square metre that is all inside has its share, and so has every heading."""
    xs = scatter(world, 40_000, np.random.default_rng(0))
    corners = (
        np.array([[-8, -6], [8, -6], [8, 6], [-8, 6]]) if world.name == "maze" else world.segments[:, :2]
    )
    ahead = np.roll(corners, -1, axis=0) - corners

    def depth(points):
        """Return how far inside the outline, given counter-clockwise, points are."""
        off = points[:, None] - corners
        return ((ahead[:, 0] * off[..., 1] - ahead[:, 1] * off[..., 0]) / np.hypot(*ahead.T)).min(axis=1)

    x, y = corners.T
    area = (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    assert xs.shape == (40_000, 3)
    assert depth(xs[:, :2]).min() > -1e-9
    counts, *_ = np.histogram2d(xs[:, 0], xs[:, 1], bins=[np.arange(-8, 9), np.arange(-6, 7)])
    middles = np.stack(np.meshgrid(np.arange(-7.5, 8), np.arange(-5.5, 6), indexing="ij"), axis=-1)
    whole = depth(middles.reshape(-1, 2)).reshape(counts.shape) > 0.71
    share = 40_000 / area
    assert whole.sum() > 15
    assert np.abs(counts[whole] - share).max() < 5 * np.sqrt(share)
    headings, _ = np.histogram(xs[:, 2], bins=np.linspace(-np.pi, np.pi, 9))
    assert np.abs(headings - 5000).max() < 5 * np.sqrt(5000)


def test_walls_on_one_line_enclose_no_floor():
    """Poses cannot be scattered behind a single wall."""
    wall = [[0.0, 0.0, 1.0, 0.0]]
    with pytest.raises(ValueError, match=r"^world: expected walls on two lines or more, got 1"):
        scatter(World("wall", wall, lines_of(wall), np.zeros(3)), 5, np.random.default_rng(0))


def test_no_pose_is_asked_for():
    """A count of 0 gives no pose."""
    assert scatter(arena(), 0, np.random.default_rng(0)).shape == (0, 3)
