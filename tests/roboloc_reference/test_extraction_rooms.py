import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rooms import MAX_RANGE, draw_room, line_seen_from, stretches, wall_of_each_beam, with_door
from scipy.stats import chi2

from roboloc.angles import difference
from roboloc.lidar import Lidar, cast_rays
from roboloc.worlds import World, lines_of
from roboloc_reference.extraction import Params, extract_lines
from roboloc_reference.scan_points import ScanPoints

BEAMS = 360
LIDAR = Lidar(BEAMS, 2 * np.pi, MAX_RANGE, dropout=0.02, tf_base_to_camera=(0, 0, 0))
# Five standard deviations of a range; 0.5 m is less than any door and more than any step along a wall but the
# most oblique.
PARAMS = Params(min_segment_length=0.3, line_point_distance=0.05, max_point_gap=0.5, min_points=8)
VARIANCES = LIDAR.sigma_bearing**2, LIDAR.sigma_range**2


def extract(rho, theta=LIDAR.bearings):
    """Extract the lines of a scan."""
    return extract_lines(theta, rho, PARAMS, *VARIANCES)


def survey(seed):
    """Extract the lines of a random room and compare them with its walls.

    Returns for each stretch of wall that is plainly there whether it was found once and as one, for each line whether
    its beams are those of one wall, for each its squared error by the covariance that it claims, and how many walls
    lie across the seam of the turn and were found.
    """
    rng = np.random.default_rng(seed)
    world, pose = draw_room(rng), np.append(rng.uniform(-0.3, 0.3, 2), rng.uniform(-np.pi, np.pi))
    theta, rho = LIDAR.bearings, LIDAR.scan(world, pose, rng)
    wall = np.where(np.isnan(rho), -1, wall_of_each_beam(world, pose, theta))
    alpha, r, C, _, ranges = extract(rho)

    lines, pure, d2 = [], [], []
    for m, (i, j) in enumerate(ranges):
        beams = np.arange(i, j) % BEAMS
        beams = beams[wall[beams] >= 0]
        counts = np.bincount(wall[beams])
        k = int(counts.argmax())
        # At a corner or an edge the noise may give a beam to the wrong side.
        pure.append(beams.size - counts[k] <= max(2, 0.1 * beams.size))
        expected = line_seen_from(world.segments[k], pose)
        e = np.array([difference(alpha[m], expected[0]), r[m] - expected[1]])
        d2.append(e @ np.linalg.solve(C[m], e))
        lines.append((k, beams))

    points = rho[:, None] * np.stack([np.cos(theta), np.sin(theta)], axis=1)
    found = [
        sum(k == number and np.isin(beams, its).mean() > 0.5 for number, its in lines) == 1
        for k, beams, length in stretches(wall, points, PARAMS.max_point_gap)
        if beams.size >= 2 * PARAMS.min_points and length >= 2 * PARAMS.min_segment_length
    ]
    return found, pure, d2, int(np.count_nonzero(ranges[:, 1] > BEAMS))


def test_a_thousand_rooms():
    """Of 1000 random rooms every wall but few is found once, all but few lines are walls, and errors are as claimed."""
    # Recall and precision: 2 in 1000 may fail, which leaves room for what no method can tell, a wall all but hidden
    # behind the edge of another or a corner within the noise. Error: d2 is chi-square with 2 degrees of freedom if the
    # covariance is right; the mean of 6000 is within 0.085 of 2 with a probability of 0.999. Twice that is allowed
    # above, since a beam at a corner may go to the wrong wall. For the same reason lines whose d2 is beyond the
    # 1 - 1e-6 quantile, one in 2000 at most, are left out of the mean.
    found, pure, d2, across = zip(*map(survey, range(1000)), strict=True)
    found, pure, d2 = (np.concatenate(part) for part in (found, pure, d2))
    plausible = d2 < chi2.ppf(1 - 1e-6, 2)
    assert found.size > 5000
    assert sum(across) > 800
    assert found.mean() >= 0.998
    assert (pure & plausible).mean() >= 0.998
    assert plausible.mean() >= 0.9995
    assert 2 - 0.085 < d2[plausible].mean() < 2 + 0.17
    # One in 20 and one in 100 beyond these quantiles; the bands are 4 standard deviations wide, and half above.
    assert 0.039 < np.mean(d2 > chi2.ppf(0.95, 2)) < 0.067
    assert 0.005 < np.mean(d2 > chi2.ppf(0.99, 2)) < 0.018


# ---------------------------------------------------------------- the seam of a full turn

SQUARE = np.array(
    [[2.0, -1.5, 2.0, 2.5], [2.0, 2.5, -3.0, 2.5], [-3.0, 2.5, -3.0, -1.5], [-3.0, -1.5, 2.0, -1.5]]
)


def noiseless(walls, heading=0.0, theta=LIDAR.bearings):
    """Return what a scanner at the origin sees of walls."""
    return cast_rays(walls, [0.0, 0.0, heading], theta, 8.0)


@pytest.mark.parametrize("door", [False, True])
def test_where_the_turn_begins_does_not_matter(door):
    """Begun at any beam, a scan has the same lines, turned, of the same beams: with a gap in the room or without."""
    walls = with_door(np.random.default_rng(0), SQUARE) if door else SQUARE
    whole = noiseless(walls, 0.123)
    whole[[5, 6, 200]] = np.nan
    alpha, r, _, _, ranges = extract(whole)
    assert len(alpha) == 4 + door
    for first in range(0, BEAMS, 7):
        turned = extract(np.roll(whole, -first))
        order = np.argsort((turned[4][:, 0] + first) % BEAMS)
        np.testing.assert_allclose(turned[1][order], r, atol=1e-9)
        angles = turned[0][order] + first * 2 * np.pi / BEAMS
        np.testing.assert_allclose(difference(angles, alpha), 0.0, atol=1e-9)
        sets = [set(np.arange(i, j) % BEAMS) for i, j in turned[4][order] + first]
        assert sets == [set(np.arange(i, j) % BEAMS) for i, j in ranges]
        assert (turned[4][:, 0] < BEAMS).all()
        assert (np.diff(turned[4][:, 0]) > 0).all()


def test_a_wall_across_the_seam_is_one():
    """A wall behind the scanner, the only one in reach, is one line of beams from both ends of the scan."""
    alpha, r, _, segments, ranges = extract(noiseless(np.array([[-2.0, 1.0, -2.0, -1.0]])))
    assert (len(alpha), r[0]) == (1, pytest.approx(2.0))
    assert abs(difference(alpha[0], np.pi)) < 1e-9
    (i, j) = ranges[0]
    assert i < BEAMS < j
    np.testing.assert_allclose(np.sort(segments.reshape(2, 2)[:, 1]), [-1.0, 1.0], atol=0.04)


def test_neighbours_on_one_line_stay_two_across_the_seam():
    """A doorway behind the scanner parts two walls on one line, wherever in the doorway the turn begins."""
    walls = np.array([[-2.0, 2.0, -2.0, 0.4], [-2.0, -0.4, -2.0, -2.0]])
    for heading in (-0.15, 0.0, 0.15):
        _, r, _, _, ranges = extract(noiseless(walls, heading))
        np.testing.assert_allclose(r, 2.0, atol=1e-9)
        assert len(r) == 2
        assert (ranges <= BEAMS).all()


def test_a_corner_at_the_seam_is_sharp():
    """Where the last beam and the first meet in a corner, each wall ends exactly with its own beams."""
    corners = np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [0.0, 2.5], [-2.0, 0.1]])
    walls = np.hstack([corners, np.roll(corners, -1, axis=0)])
    world = World("room", walls, lines_of(walls), np.zeros(3))
    for heading in np.radians([-4.3, -2.3, -0.3, 0.7, 2.7]):
        wall = wall_of_each_beam(world, [0.0, 0.0, heading], LIDAR.bearings)
        ranges = extract(noiseless(walls, heading))[4]
        of_each = [wall[np.arange(i, j) % BEAMS] for i, j in ranges]
        assert all((beams == beams[0]).all() for beams in of_each)
        assert sum(beams.size for beams in of_each) == BEAMS


@pytest.mark.parametrize("sign", [1, -1])
def test_a_scanner_may_turn_either_way(sign):
    """Clockwise or not, the lines are the same, and so are the beams of each."""
    theta = LIDAR.bearings + 0.001
    rho = noiseless(SQUARE, 0.4, theta)
    alpha, r, C, _, _ = extract(rho[::sign], theta[::sign])
    assert len(r) == 4
    expected = extract(rho, theta)
    order = [int(np.argmin(np.abs(difference(a, expected[0])))) for a in alpha]
    assert sorted(order) == [0, 1, 2, 3]
    np.testing.assert_allclose(r, expected[1][order], atol=1e-9)
    np.testing.assert_allclose(C, expected[2][order], rtol=1e-6)


def test_a_scan_that_leaves_out_a_sector_is_not_closed():
    """Two walls on either side of a blind sector of 6 degrees stay two, though their ends are near each other."""
    theta = np.radians(np.arange(-177.0, 177.5, 1.0))
    r = extract(noiseless(np.array([[-2.0, 2.0, -2.0, -2.0]]), theta=theta), theta)[1]
    np.testing.assert_allclose(r, [2.0, 2.0], atol=1e-9)


def test_a_repeated_beam_and_few_beams_do_no_harm():
    """A turn whose last beam is the first once more, a turn of few beams, and one that saw next to nothing."""
    theta = np.linspace(-np.pi, np.pi, BEAMS + 1)
    assert len(extract(noiseless(SQUARE, 0.2, theta), theta)[0]) == 4
    few = np.linspace(-np.pi, np.pi, 10, endpoint=False)
    assert len(extract(noiseless(SQUARE, 0.2, few), few)[0]) == 0
    for count in range(4):
        rho = np.full(BEAMS, np.nan)
        rho[100 : 100 + count] = 1.0
        assert [a.shape for a in extract(rho)] == [(0,), (0,), (0, 2, 2), (0, 4), (0, 2)]


def test_a_wall_whose_ends_lie_beyond_its_corners_is_one():
    """A wall cut in the middle whose two halves each took a beam of the next wall is put together again."""
    theta = np.linspace(-1.2, 1.2, 241)
    rho = 2.0 / np.maximum(np.cos(theta), 1.6 * np.abs(np.sin(theta)))
    scan = ScanPoints(theta, rho, PARAMS.line_point_distance, PARAMS.max_point_gap)
    a, b = np.flatnonzero(np.diff(np.cos(theta) >= 1.6 * np.abs(np.sin(theta)))) + 1
    halves = [(0, a - 2), (a - 2, 121), (121, b + 3), (b + 3, 241)]
    assert scan.merge(halves) == halves
    assert scan.without_shared(scan.with_sharp_corners(halves, 8), 8) == [(0, a), (a, b), (b, 241)]


@settings(deadline=None, derandomize=True, max_examples=300)
@given(st.integers(0, 2**32 - 1), st.integers(0, 60), st.integers(0, 4), st.booleans())
def test_anything_at_all_gives_lines_or_none(seed, N, kind, turn):
    """Of any ranges in any order of size the lines are finite, each of beams of its own, in order, enough of them."""
    rng = np.random.default_rng(seed)
    theta = np.linspace(-np.pi, np.pi, N, endpoint=False) if turn else np.sort(rng.uniform(-3, 3, N))
    ranges_of = (
        rng.uniform(0.5, 4, N),
        np.full(N, 1.5),  # a round tank
        np.zeros(N),
        rng.integers(1, 3, N).astype(float),
        2 / np.maximum(np.abs(np.cos(theta)), np.abs(np.sin(theta))),
    )
    rho = np.where(rng.random(N) < rng.choice([0, 0.1, 0.9]), np.nan, ranges_of[kind])
    params = Params(
        *(rng.choice(values) for values in ([0, 0.3], [0, 0.02, 0.1, 10], [0, 0.1, 0.5, 100], [2, 3, 8]))
    )
    alpha, r, C, segments, ranges = extract_lines(theta, rho, params, *VARIANCES)
    assert all(np.isfinite(part).all() for part in (alpha, r, C, segments))
    assert (r >= 0).all()
    assert (ranges[:, 1] - ranges[:, 0] >= params.min_points).all()
    assert (np.diff(ranges[:, 0]) > 0).all()
    assert (ranges[:, 0] < max(N, 1)).all()
    beams = [b % N for i, j in ranges for b in range(i, j)]
    assert len(set(beams)) == len(beams)
