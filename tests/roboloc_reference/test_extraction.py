from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import finite_difference, read_only
from scipy.optimize import least_squares
from scipy.stats import chi2

from roboloc.angles import difference
from roboloc.lidar import cast_rays
from roboloc.worlds import arena
from roboloc_reference.extraction import Params, extract_lines, fit_line, merge, split

law = settings(deadline=None, derandomize=True, max_examples=50)
seed = st.integers(0, 2**32 - 1)

PARAMS = Params(min_segment_length=0.3, line_point_distance=0.06, max_point_gap=0.5, min_points=8)
VAR_THETA, VAR_RHO = np.radians(0.1) ** 2, 0.01**2


def closed(*corners):
    """Return the walls of a closed room as segments."""
    return np.hstack([corners, np.roll(corners, -1, axis=0)]).astype(float)


# Every wall is seen from where the scanner is, the origin, by many beams; `passage` has two walls of no room.
ROOMS = {
    "square": closed((2, -1.5), (2, 2.5), (-3, 2.5), (-3, -1.5)),
    "seven obtuse corners": closed(
        (2.5, 0.2), (1.4, 2.1), (-0.8, 2.6), (-2.4, 1.2), (-2.2, -1.1), (-0.4, -2.3), (1.7, -1.8)
    ),
    "L": closed((1, -1), (1, 3.2), (2.5, 3.2), (2.5, 4), (-0.8, 4), (-0.8, -1)),
    "notch": closed((2, -2), (2, 2), (0.5, 2), (0.5, 1.2), (-0.7, 1.2), (-0.7, 2), (-2, 2), (-2, -2)),
    "passage": np.array([[-4.0, 1.1, 4.0, 0.9], [-4.0, -0.6, 4.0, -0.8]]),
}


def see(walls, theta):
    """Return ranges and the wall that each ray meets, wall by wall, with NaN and -1 beyond 5 m."""
    rho, wall = np.full(theta.shape, np.inf), np.full(theta.shape, -1)
    for k, (x1, y1, x2, y2) in enumerate(walls):
        for i, phi in enumerate(theta):
            edge, d = np.array([x2 - x1, y2 - y1]), np.array([np.cos(phi), np.sin(phi)])
            det = d[1] * edge[0] - d[0] * edge[1]
            distance, along = (y1 * edge[0] - x1 * edge[1]) / det, (y1 * d[0] - x1 * d[1]) / det
            if 0 <= along <= 1 and 0 < distance < min(rho[i], 5.0):
                rho[i], wall[i] = distance, k
    return np.where(wall < 0, np.nan, rho), wall


def line_of(wall):
    """Return alpha, r of a wall."""
    x1, y1, x2, y2 = wall
    alpha = np.arctan2(x1 - x2, y2 - y1)
    r = x1 * np.cos(alpha) + y1 * np.sin(alpha)
    return np.array([alpha, r]) if r >= 0 else np.array([alpha + np.pi, -r])


def draw_beams(rng, N=30, noise=0.02):
    """Draw beams along a random wall; return theta, rho and the wall's alpha, r."""
    alpha, r = rng.uniform(-np.pi, np.pi), rng.uniform(0.5, 4)
    theta = alpha + np.sort(rng.uniform(-1.1, 1.1, N))
    return theta, r / np.cos(theta - alpha) + noise * rng.normal(size=N), alpha, r


# ---------------------------------------------------------------- one line


@law
@given(seed, st.integers(3, 60))
def test_fit_is_the_least_squares_line(seed, N):
    """An optimiser that knows only the distances ends at the same line, to 1e-9."""
    theta, rho, alpha, r = draw_beams(np.random.default_rng(seed), N)
    got = fit_line(theta, rho, 0.0, 0.0)[:2]
    done = least_squares(
        lambda line: rho * np.cos(theta - line[0]) - line[1],
        (alpha, r),
        jac=lambda line: np.stack([rho * np.sin(theta - line[0]), -np.ones(N)], axis=1),
        method="lm",
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    assert abs(difference(got[0], done.x[0])) < 1e-9
    assert abs(got[1] - done.x[1]) < 1e-9
    assert -np.pi <= got[0] < np.pi


@law
@given(seed, st.integers(3, 20))
def test_covariance_is_that_of_the_linearized_fit(seed, N):
    """C equals J diag(var) J^T with J from differences of the fit itself, bearings and ranges alike."""
    rng = np.random.default_rng(seed)
    theta, rho, alpha, _ = draw_beams(rng, N)
    var_theta, var_rho = rng.uniform(0, 1e-3, 2)

    def fit(beams):
        a, r, _ = fit_line(beams[:N], beams[N:], 0.0, 0.0)
        return np.array([difference(a, alpha), r])

    J = finite_difference(fit, np.concatenate([theta, rho]), step=1e-4)
    expected = J * np.repeat([var_theta, var_rho], N) @ J.T
    C = fit_line(theta, rho, var_theta, var_rho)[2]
    np.testing.assert_allclose(C, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())
    np.testing.assert_array_equal(C, C.T)


@pytest.mark.parametrize("case", range(5))
def test_covariance_is_that_of_many_fits(case):
    """4000 fits of one wall scatter as C says: the mean of d2 is in its chi-square band, false alarm 1e-4 each."""
    rng, runs = np.random.default_rng(case), 4000
    theta, rho, alpha, r = draw_beams(rng, 40, noise=0.0)
    _, _, C = fit_line(theta, rho, VAR_THETA, VAR_RHO)
    d2 = 0.0
    for _ in range(runs):
        # The beam leaves a little beside its nominal bearing, and its range is read with an error.
        left = theta + VAR_THETA**0.5 * rng.normal(size=theta.size)
        read = r / np.cos(left - alpha) + VAR_RHO**0.5 * rng.normal(size=theta.size)
        a, d, _ = fit_line(theta, read, 0.0, 0.0)
        e = np.array([difference(a, alpha), d - r])
        d2 += e @ np.linalg.solve(C, e)
    assert chi2.ppf(0.5e-4, 2 * runs) < d2 < chi2.ppf(1 - 0.5e-4, 2 * runs)


@law
@given(seed)
def test_turning_the_scanner_turns_the_line(seed):
    """A turn of all bearings adds to alpha and changes neither r nor C."""
    rng = np.random.default_rng(seed)
    theta, rho, *_ = draw_beams(rng)
    turn = rng.uniform(-10, 10)
    alpha, r, C = fit_line(theta, rho, VAR_THETA, VAR_RHO)
    turned, r2, C2 = fit_line(theta + turn, rho, VAR_THETA, VAR_RHO)
    assert abs(difference(turned, alpha + turn)) < 1e-12
    assert abs(r2 - r) < 1e-12
    np.testing.assert_allclose(C2, C, atol=1e-12 * C.max())


def test_two_points_are_joined():
    """Two beams determine their line exactly: (1, 0) and (0, 1) lie on alpha 45 degrees, r 1 / sqrt 2."""
    alpha, r, _ = fit_line([0.0, np.pi / 2], [1.0, 1.0], 0.0, 0.0)
    assert (alpha, r) == (pytest.approx(np.pi / 4), pytest.approx(0.5**0.5))


def test_a_line_through_the_scanner_has_no_distance():
    """Points on both sides of the origin: r is 0, and alpha is a normal, whichever of the two."""
    alpha, r, C = fit_line([0.3, 0.3, 0.3 + np.pi], [1.0, 2.0, 1.0], VAR_THETA, VAR_RHO)
    assert r == pytest.approx(0.0, abs=1e-15)
    assert abs(np.sin(alpha - 0.3)) == pytest.approx(1.0)
    assert np.isfinite(C).all()


# ---------------------------------------------------------------- many lines


@pytest.mark.parametrize("room", ROOMS)
def test_without_noise_every_wall_is_found_exactly(room):
    """Each wall that beams fall on is found once, in order, to 1e-9, with exactly its own beams."""
    theta = np.linspace(-np.pi, np.pi, 720, endpoint=False) + 1e-3
    theta = theta + (0.7 if room != "passage" else np.pi / 2)  # begin in a corner, not on a wall
    rho, wall = see(ROOMS[room], theta)
    begin = int(np.argmax(wall != np.roll(wall, 1)))
    theta, rho, wall = (np.roll(a, -begin) for a in (theta, rho, wall))
    alpha, r, _, segments, ranges = extract_lines(theta, rho, PARAMS, VAR_THETA, VAR_RHO)
    seen = [wall[i:j] for i, j in ranges]
    assert all((s == s[0]).all() for s in seen)
    assert sorted(s[0] for s in seen) == sorted(set(wall) - {-1})
    for k, (i, j) in enumerate(ranges):
        expected = line_of(ROOMS[room][wall[i]])
        assert abs(difference(alpha[k], expected[0])) < 1e-9
        assert abs(r[k] - expected[1]) < 1e-9
        ends = rho[[i, j - 1]] * np.array([np.cos(theta[[i, j - 1]]), np.sin(theta[[i, j - 1]])])
        np.testing.assert_allclose(segments[k], ends.T.ravel(), atol=1e-9)


@pytest.mark.parametrize("room", ROOMS)
def test_with_noise_walls_are_found_and_nothing_else(room):
    """Of 50 noisy scans with lost beams: every wall found in 98 of 100 cases, 99 of 100 lines a wall; d2 as claimed."""
    # A line counts as a wall if d2 is below the 1 - 1e-6 quantile. The mean d2 of all lines of a room lies in a band
    # of 15 percent about 2: wider than chance, since a beam at a corner may go to the wrong wall.
    rng, scans = np.random.default_rng(3), 50
    theta = np.linspace(-np.pi, np.pi, 360, endpoint=False) + 1e-3
    walls = ROOMS[room]
    lines = np.array([line_of(wall) for wall in walls])
    found, wanted, d2s = 0, 0, []
    clean, wall = see(walls, theta)
    counts = np.bincount(wall[wall >= 0], minlength=len(walls))
    for _ in range(scans):
        left = VAR_THETA**0.5 * rng.normal(size=theta.size)
        slope = clean * np.tan(theta - lines[wall, 0])  # d rho / d theta of a wall
        rho = clean + slope * left + VAR_RHO**0.5 * rng.normal(size=theta.size)
        rho[rng.uniform(size=theta.size) < 0.05] = np.nan
        alpha, r, C, _, _ = extract_lines(theta, rho, PARAMS, VAR_THETA, VAR_RHO)
        hit = set()
        for a, d, c in zip(alpha, r, C, strict=True):
            e = np.stack([difference(a, lines[:, 0]), d - lines[:, 1]])
            d2 = np.einsum("ik,ij,jk->k", e, np.linalg.inv(c), e)
            d2s.append(d2.min())
            hit.add(int(d2.argmin()))
        wanted += np.count_nonzero(counts >= 2 * PARAMS.min_points)
        found += sum(counts[k] >= 2 * PARAMS.min_points for k in hit)
    good = np.array(d2s) < chi2.ppf(1 - 1e-6, 2)
    assert found >= 0.98 * wanted
    assert good.mean() >= 0.99
    assert 1.7 < np.mean(np.array(d2s)[good]) < 2.3


def test_a_corner_is_sharpened_after_its_neighbour():
    """A corner of the arena that is exact only once the next corner has been put right is exact."""
    theta, pose = np.radians(np.linspace(-120, 120, 181)), (0.25, -0.22, -1.28)
    rho = cast_rays(arena().segments, pose, theta, 6.0)
    ranges = extract_lines(theta, rho, PARAMS, VAR_THETA, VAR_RHO)[4]
    assert ranges[:3].tolist() == [[0, 37], [37, 110], [110, 139]]


def test_ends_of_a_segment_lie_on_its_line():
    """The ends are the outermost points moved to the line, not the points themselves."""
    theta, rho, *_ = draw_beams(np.random.default_rng(1), 40)
    params = replace(PARAMS, line_point_distance=1.0, max_point_gap=10.0)
    alpha, r, _, segments, _ = extract_lines(theta, rho, params, 0.0, 0.0)
    ends = segments.reshape(2, 2)
    np.testing.assert_allclose(ends @ [np.cos(alpha[0]), np.sin(alpha[0])], r[0], atol=1e-12)
    along = [-np.sin(alpha[0]), np.cos(alpha[0])]
    points = np.stack([rho * np.cos(theta), rho * np.sin(theta)], axis=1)[[0, -1]]
    np.testing.assert_allclose(ends @ along, points @ along, atol=1e-12)


def test_a_doorway_makes_two_segments_of_one_line():
    """Two walls on one line with a gap between them stay two, and neither is seen through the door."""
    theta = np.linspace(-1.2, 1.2, 241)
    rho = 2.0 / np.cos(theta)
    door = np.abs(2.0 * np.tan(theta)) < 0.5
    rho[door] = 4.0 / np.cos(theta[door])
    alpha, r, _, segments, ranges = extract_lines(theta, rho, PARAMS, VAR_THETA, VAR_RHO)
    np.testing.assert_allclose(alpha, 0.0, atol=1e-9)
    np.testing.assert_allclose(r, [2.0, 4.0, 2.0], atol=1e-9)
    np.testing.assert_array_equal(ranges[1:, 0], ranges[:-1, 1])
    assert segments[0, 3] < -0.5 < 0.5 < segments[2, 1]
    assert -1.0 < segments[1, 1] < segments[1, 3] < 1.0


@law
@given(seed, st.integers(0, 80))
def test_split_covers_and_every_run_is_a_line(seed, N):
    """Of any points at all: the runs cover them in order, and each is as close to its line as was asked."""
    rng = np.random.default_rng(seed)
    theta, rho = np.sort(rng.uniform(-3, 3, N)), rng.uniform(0.5, 3, N)
    ranges = split(theta, rho, PARAMS)
    assert ranges.shape[1] == 2
    assert ranges.ravel().tolist() == np.repeat(np.concatenate([[0], ranges[:, 1]]), 2)[1:-1].tolist()
    assert (ranges[-1, 1] if N else 0) == N
    points = np.stack([rho * np.cos(theta), rho * np.sin(theta)])
    for i, j in ranges:
        assert (np.hypot(*np.diff(points[:, i:j])) <= PARAMS.max_point_gap).all()
        if j - i > 1:
            alpha, r, _ = fit_line(theta[i:j], rho[i:j], 0.0, 0.0)
            assert (
                np.abs(rho[i:j] * np.cos(theta[i:j] - alpha) - r).max() <= PARAMS.line_point_distance + 1e-9
            )


@law
@given(seed, st.integers(2, 80))
def test_merge_joins_and_stops(seed, N):
    """Merging keeps what is covered, removes some of the cuts, and a second merge changes nothing."""
    rng = np.random.default_rng(seed)
    theta, rho, *_ = draw_beams(rng, N)
    cuts = np.unique(np.concatenate([[0, N], rng.integers(1, N, 5)]))
    ranges = np.stack([cuts[:-1], cuts[1:]], axis=1)
    merged = merge(theta, rho, ranges, PARAMS)
    assert (merged[0, 0], merged[-1, 1]) == (0, N)
    np.testing.assert_array_equal(merged[1:, 0], merged[:-1, 1])
    assert set(merged.ravel()) <= set(cuts)
    np.testing.assert_array_equal(merge(theta, rho, merged, PARAMS), merged)


def test_merge_repairs_what_split_cuts_too_much():
    """Two lines fit a deep bay best with a cut in its back wall: split makes four runs of it, merge three."""
    theta = np.linspace(-1.5, 1.5, 301)
    sides = np.where(np.sin(theta) == 0, np.inf, 0.5 / np.abs(np.where(theta == 0, 1, np.sin(theta))))
    rho = np.minimum(4.0 / np.cos(theta), sides)
    runs = split(theta, rho, PARAMS)
    assert len(merge(theta, rho, runs, PARAMS)) == 3 < len(runs)


def test_nothing_seen_is_no_line():
    """A scan of NaN, a scan of no beams and one of too few points give empty arrays of the right shapes."""
    few = np.full(50, np.nan)
    few[:3] = 1.0
    for rho in (np.full(50, np.nan), np.zeros(0), few):
        results = extract_lines(np.linspace(-1, 1, rho.size), rho, PARAMS, VAR_THETA, VAR_RHO)
        assert [a.shape for a in results] == [(0,), (0,), (0, 2, 2), (0, 4), (0, 2)]


def test_short_segments_and_few_points_are_dropped():
    """A wall is dropped for its length or its points alone."""
    theta = np.linspace(-0.2, 0.2, 41)
    changes = {"min_segment_length": 0.9}, {"min_points": 41}, {"min_points": 42}
    for change, expected in zip(({}, *changes), (1, 0, 1, 0), strict=True):
        params = {
            "min_segment_length": 0.3,
            "line_point_distance": 0.05,
            "max_point_gap": 0.5,
            "min_points": 5,
        }
        found = extract_lines(theta, 2.0 / np.cos(theta), params | change, VAR_THETA, VAR_RHO)
        assert len(found[0]) == expected


def test_ranges_count_the_beams_of_the_scan():
    """Beams that saw nothing shift no index: the range of a wall goes from its first beam to its last."""
    theta = np.linspace(-0.5, 0.5, 101)
    rho = 2.0 / np.cos(theta)
    rho[:20], rho[50], rho[90:] = np.nan, np.nan, np.nan
    assert extract_lines(theta, rho, PARAMS, VAR_THETA, VAR_RHO)[4].tolist() == [[20, 90]]


# ---------------------------------------------------------------- arguments


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted, and the results share no memory with them."""
    theta, rho, *_ = draw_beams(np.random.default_rng(0))
    theta, rho, ranges = read_only(theta, rho, [[0, 10], [10, 30]])
    results = [*extract_lines(theta, rho, PARAMS, 0.0, 0.0), merge(theta, rho, ranges, PARAMS)]
    for result in [*results, split(theta, rho, PARAMS), fit_line(theta, rho, 0.0, 0.0)[2]]:
        assert not any(np.shares_memory(result, argument) for argument in (theta, rho, ranges))


T3, R3 = np.array([-0.5, 0.0, 0.5]), np.ones(3)


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: fit_line(T3[None], R3, 0.0, 0.0), "theta"),
        (lambda: fit_line(T3[:1], R3[:1], 0.0, 0.0), "theta"),
        (lambda: fit_line(T3, R3[:2], 0.0, 0.0), "rho"),
        (lambda: fit_line(T3, [1.0, np.nan, 1.0], 0.0, 0.0), "rho"),
        (lambda: fit_line(0 * T3, R3, 0.0, 0.0), "rho"),
        (lambda: fit_line(T3, R3, -1.0, 0.0), "var_theta"),
        (lambda: fit_line(T3, R3, 0.0, np.nan), "var_rho"),
        (lambda: split(T3, None, PARAMS), "rho"),
        (lambda: split(T3, R3, {"min_points": 2}), "params"),
        (lambda: split(T3, R3, None), "params"),
        (lambda: merge(T3, R3, [0, 3], PARAMS), "ranges"),
        (lambda: merge(T3, R3, [[0, 2], [1, 3]], PARAMS), "ranges"),
        (lambda: merge(T3, R3, [[0, 4]], PARAMS), "ranges"),
        (lambda: merge(T3, R3, [[1, 1]], PARAMS), "ranges"),
        (lambda: merge(T3, R3, [[0, 1.5]], PARAMS), "ranges"),
        (lambda: extract_lines(T3, [1.0, np.inf, 1.0], PARAMS, 0.0, 0.0), "rho"),
        (lambda: extract_lines(T3, "abc", PARAMS, 0.0, 0.0), "rho"),
        (lambda: extract_lines(T3, R3[:2], PARAMS, 0.0, 0.0), "rho"),
        (lambda: extract_lines(T3 * np.nan, R3, PARAMS, 0.0, 0.0), "theta"),
        (lambda: extract_lines(T3, R3, PARAMS, -1.0, 0.0), "var_theta"),
        (lambda: extract_lines(T3, R3, PARAMS, 0.0, "x"), "var_rho"),
        (lambda: Params(0.1, 0.1, 0.1, 1), "min_points"),
        (lambda: Params(0.1, -0.1, 0.1, 2), "line_point_distance"),
    ],
)
def test_a_wrong_argument_is_named(call, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        call()
