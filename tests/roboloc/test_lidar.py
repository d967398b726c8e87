import dataclasses
import math

import numpy as np
import pytest
from oracles import read_only

from roboloc import se2
from roboloc.lidar import Lidar, cast_rays
from roboloc.worlds import World, arena, lines_of, maze


def scalar_loop(segments, pose, bearings, max_range):
    """Return what `cast_rays` returns, one ray and one wall at a time, by Cramer's rule."""
    x, y, theta = pose
    found = []
    for bearing in bearings:
        c, s = math.cos(theta + bearing), math.sin(theta + bearing)
        nearest = math.inf
        for x1, y1, x2, y2 in segments:
            ex, ey = x2 - x1, y2 - y1
            determinant = c * ey - s * ex
            if determinant == 0:
                continue
            rho = ((x1 - x) * ey - (y1 - y) * ex) / determinant
            t = ((x1 - x) * s - (y1 - y) * c) / determinant
            if rho > 0 and 0 <= t <= 1:
                nearest = min(nearest, rho)
        found.append(nearest if nearest <= max_range else math.nan)
    return np.array(found)


@pytest.mark.parametrize("max_range", [1.0, 3.5, 30.0])
@pytest.mark.parametrize("world", [maze(), arena()], ids=lambda world: world.name)
def test_rays_equal_a_scalar_loop(world, max_range):
    """At random poses, inside and outside, all distances agree to 1e-12 and the same rays find nothing."""
    rng = np.random.default_rng(1)
    for _ in range(40):
        pose = rng.uniform([-9, -9, -9], [9, 9, 9])
        bearings = rng.uniform(-4, 4, size=100)
        rho = cast_rays(world.segments, pose, bearings, max_range)
        right = scalar_loop(world.segments.tolist(), pose, bearings, max_range)
        np.testing.assert_allclose(rho, right, rtol=1e-12)


def test_rays_equal_a_scalar_loop_among_random_walls():
    """Walls that cross, touch and hide each other are seen as the loop sees them."""
    rng = np.random.default_rng(2)
    for walls in (0, 1, 2, 40):
        segments, pose = rng.uniform(-3, 3, size=(walls, 4)), rng.uniform(-2, 2, size=3)
        bearings = np.linspace(-np.pi, np.pi, 200)
        rho = cast_rays(segments, pose, bearings, 4.0)
        np.testing.assert_allclose(rho, scalar_loop(segments, pose, bearings, 4.0), rtol=1e-9)


def test_no_ray_slips_through_a_corner():
    """Rays aimed at the corners of a closed room find them, whatever the rounding."""
    world, rng = arena(), np.random.default_rng(3)
    corners = world.segments[:, :2]
    for _ in range(300):
        x = rng.uniform(-1.5, 1.5, size=2)
        away = corners - x
        rho = cast_rays(world.segments, [*x, 0.0], np.arctan2(away[:, 1], away[:, 0]), 20.0)
        np.testing.assert_allclose(rho, np.hypot(*away.T), rtol=1e-9)


def test_points_that_are_seen_lie_on_walls():
    """Without noise each range ends on a line of the map, through the offset of the scanner."""
    world, lidar = maze(), Lidar()
    (x,) = read_only([-1.0, 0.4, 2.0])
    rho = lidar.scan(world, x)
    cx, cy, ctheta = se2.compose(x, lidar.tf_base_to_camera)
    phi = ctheta + lidar.bearings
    points = np.stack([cx + rho * np.cos(phi), cy + rho * np.sin(phi)])[:, np.isfinite(rho)]
    alpha, r = world.map_lines
    off = np.abs(np.stack([np.cos(alpha), np.sin(alpha)]).T @ points - r[:, None]).min(axis=0)
    assert points.shape[1] > 50
    assert off.max() < 1e-12


def test_edge_on_and_behind():
    """A wall along the ray is not seen, nor one behind the scanner, nor one just out of reach."""
    behind, along, near, far = [-1, -1, -1, 1], [1, 0, 2, 0], [3, -1, 3, 1], [5, -1, 5, 1]
    for walls, right in (([behind], np.nan), ([along], np.nan), ([behind, along, far, near], 3.0)):
        np.testing.assert_array_equal(cast_rays(walls, np.zeros(3), [0.0], 4.0), [right])
    np.testing.assert_array_equal(cast_rays([near], np.zeros(3), [0.0], 2.999), [np.nan])


def test_bearings_span_the_field_of_view():
    """From right to left, symmetric; a whole turn does not look back twice."""
    bearings = Lidar(beams=5, field_of_view=2.0).bearings
    np.testing.assert_allclose(bearings, [-1, -0.5, 0, 0.5, 1])
    np.testing.assert_allclose(
        Lidar(beams=4, field_of_view=2 * np.pi).bearings, [-np.pi, -np.pi / 2, 0, np.pi / 2]
    )
    np.testing.assert_array_equal(Lidar(beams=1).bearings, [0.0])


def one_wall(distance):
    """Return a world with a long wall at a distance ahead."""
    segments = [[distance, -50, distance, 50]]
    return World("one wall", segments, lines_of(segments), np.zeros(3))


def test_range_noise_has_its_standard_deviation():
    """Straight ahead of a wall, 20 000 ranges scatter by sigma_range (5 standard deviations of both moments)."""
    n = 20_000
    lidar = Lidar(n, 1e-9, 3.5, 0.02, 0.0, 0.0, np.zeros(3))
    rho = lidar.scan(one_wall(2.0), np.zeros(3), np.random.default_rng(4))
    assert abs(rho.mean() - 2) < 5 * 0.02 / np.sqrt(n)
    assert abs(rho.std() - 0.02) < 5 * 0.02 / np.sqrt(2 * n)


def test_bearing_noise_moves_the_beam_and_not_the_report():
    """Against a wall seen at 45 degrees, an error of direction shows as one of range, d tan(phi) / cos(phi)."""
    n, sigma = 20_000, 0.002
    lidar = Lidar(n, 1e-9, 9.0, 0.0, sigma, 0.0, [0.0, 0.0, np.pi / 4])
    rho = lidar.scan(one_wall(2.0), np.zeros(3), np.random.default_rng(5))
    expected = sigma * 2 * np.sqrt(2)
    assert abs(rho.std() - expected) < 5 * expected / np.sqrt(2 * n) + 1e-4
    np.testing.assert_allclose(lidar.bearings, 0, atol=1e-9)


def test_beams_get_lost_with_their_probability():
    """Of 20 000 beams at a wall a fifth is NaN, within 5 standard deviations; without noise none is."""
    n = 20_000
    lidar = Lidar(beams=n, field_of_view=0.1, dropout=0.2)
    rho = lidar.scan(one_wall(2.0), np.zeros(3), np.random.default_rng(6))
    assert abs(np.isnan(rho).mean() - 0.2) < 5 * np.sqrt(0.16 / n)
    assert np.isfinite(lidar.scan(one_wall(2.0), np.zeros(3))).all()


def test_ranges_stay_in_reach():
    """No noisy range is negative or beyond what the scanner can see."""
    lidar = Lidar(beams=500, sigma_range=0.5, tf_base_to_camera=np.zeros(3))
    for distance in (0.2, 3.3):
        rho = lidar.scan(one_wall(distance), np.zeros(3), np.random.default_rng(7))
        seen = rho[np.isfinite(rho)]
        assert len(seen) > 20
        assert seen.min() > 0
        assert seen.max() <= 3.5


def test_the_same_seed_gives_the_same_scan():
    """All randomness comes from the generator, and its use does not depend on the noise."""
    scans = [Lidar().scan(maze(), maze().start, np.random.default_rng(8)) for _ in range(2)]
    np.testing.assert_array_equal(*scans)
    used = []
    for lidar in (Lidar(), Lidar(sigma_range=0, sigma_bearing=0, dropout=0)):
        rng = np.random.default_rng(9)
        lidar.scan(maze(), maze().start, rng)
        used.append(rng.random())
    assert used[0] == used[1]


def test_a_lidar_cannot_be_changed():
    """Neither its fields nor the array in it can be written to."""
    lidar = Lidar()
    with pytest.raises(dataclasses.FrozenInstanceError):
        lidar.beams = 3
    with pytest.raises(ValueError, match="read-only"):
        lidar.tf_base_to_camera[0] = 1


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("beams", 0),
        ("beams", 2.5),
        ("field_of_view", 0),
        ("field_of_view", 7),
        ("max_range", 0),
        ("max_range", np.inf),
        ("sigma_range", -1),
        ("sigma_bearing", np.nan),
        ("dropout", 1.5),
        ("tf_base_to_camera", [0, 0]),
    ],
)
def test_a_wrong_argument_of_a_lidar_is_named(name, value):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        Lidar(**{name: value})


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (([[1, 2, 3]], np.zeros(3), [0], 1), "segments"),
        ((np.ones((1, 4)), np.zeros(2), [0], 1), "pose"),
        ((np.ones((1, 4)), np.zeros(3), 0, 1), "bearings"),
        ((np.ones((1, 4)), np.zeros(3), [np.nan], 1), "bearings"),
        ((np.ones((1, 4)), np.zeros(3), [0], 0), "max_range"),
    ],
)
def test_a_wrong_argument_of_cast_rays_is_named(arguments, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        cast_rays(*arguments)


def test_noise_needs_a_generator():
    """A seed is not a generator."""
    with pytest.raises(ValueError, match=r"^rng: expected a numpy.random.Generator, got int"):
        Lidar().scan(maze(), np.zeros(3), 7)


def test_read_only_arguments_are_accepted():
    """Neither walls nor pose nor bearings are written to."""
    segments, pose, bearings = read_only(maze().segments, [0, 0, 0], [0, 1])
    cast_rays(segments, pose, bearings, 3.0)
