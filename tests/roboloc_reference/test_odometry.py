from math import atan2, cos, inf, nan, pi, sin

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import DIGITS, read_only

from roboloc.angles import wrap
from roboloc_reference.odometry import bearing_likelihood, bootstrap_step, sample_motion
from roboloc_reference.resampling import systematic_resample

law = settings(deadline=None, derandomize=True, max_examples=40)
seed = st.integers(0, 2**32 - 1)

# The tutorial's question 2 with its signs put right: anticlockwise is positive.
ODOMETRY = np.array([pi / 9, 0.1, -pi / 18])
ALPHAS = np.array([0.05, 0.001, 0.05, 0.01])
SPREAD = np.array([0.05 * pi / 9 + 1e-4, 0.005 + 0.01 * pi / 6, 0.05 * pi / 18 + 1e-4])
FIRST = np.array([0.5377, 1.8339, -0.3942])
SIGMA = pi / 9
STILL, EXACT = np.zeros(3), np.zeros(4)


class Scripted(np.random.Generator):
    """A generator that draws what it is told."""

    def __init__(self, normals=(0.0, 0.0, 0.0), offset=0.0):
        super().__init__(np.random.PCG64(0))
        self.normals, self.offset = np.asarray(normals, dtype=float), offset

    def standard_normal(self, size):
        """Return the same numbers for every particle."""
        return np.broadcast_to(self.normals, size)

    def uniform(self, low, high):
        """Return the offset, which has to be in the interval."""
        assert low <= self.offset < high
        return self.offset


def cloud(rng, M):
    """Draw particles all around."""
    return np.stack([*rng.uniform(-5, 5, (2, M)), rng.uniform(-pi, pi, M)], axis=-1)


@law
@given(seed, st.integers(0, 8))
def test_the_motion_is_a_loop_over_particles(seed, M):
    """All particles at once equal a plain loop that draws from the same generator, to 1e-14."""
    rng = np.random.default_rng(seed)
    xs, odometry, alphas = cloud(rng, M), rng.uniform(-2, 2, 3), rng.uniform(0, 0.3, 4)
    got = sample_motion(xs, odometry, alphas, np.random.default_rng(seed))
    draw = np.random.default_rng(seed)
    rot1, trans, rot2 = odometry
    a1, a2, a3, a4 = alphas
    expected = []
    for x, y, theta in xs:
        one = rot1 + (a1 * abs(rot1) + a2 * abs(trans)) * draw.standard_normal()
        way = trans + (a3 * abs(trans) + a4 * (abs(rot1) + abs(rot2))) * draw.standard_normal()
        two = rot2 + (a1 * abs(rot2) + a2 * abs(trans)) * draw.standard_normal()
        expected.append([x + way * cos(theta + one), y + way * sin(theta + one), theta + one + two])
    assert got.shape == (M, 3)
    np.testing.assert_allclose(got, np.reshape(expected, (-1, 3)), rtol=0, atol=1e-14)


def test_the_errors_are_independent_normals_of_the_right_spread():
    """In 20000 draws means, spreads and correlations are right; false alarm 1e-5 (9 tests of 5 deviations)."""
    N = 20_000
    moved = sample_motion(np.zeros((N, 3)), ODOMETRY, ALPHAS, np.random.default_rng(1))
    rot1 = np.arctan2(moved[:, 1], moved[:, 0])
    drawn = np.stack([rot1, np.hypot(moved[:, 0], moved[:, 1]), moved[:, 2] - rot1])
    white = (drawn - ODOMETRY[:, None]) / SPREAD[:, None]
    assert np.abs(white.mean(axis=1)).max() < 5 / np.sqrt(N)
    off = np.abs(white @ white.T / N - np.eye(3)) / np.sqrt((1 + np.eye(3)) / N)
    assert off.max() < 5


@law
@given(seed, st.integers(1, 8))
def test_the_likelihood_is_the_normal_density_of_the_wrapped_innovation(seed, M):
    """It equals the density evaluated with 50 digits, to 1e-12 relative."""
    rng = np.random.default_rng(seed)
    xs, landmark = cloud(rng, M), rng.uniform(-5, 5, 2)
    bearing, sigma = rng.uniform(-10, 10), rng.uniform(0.2, 2)
    got = bearing_likelihood(xs, landmark, bearing, sigma)
    with mp.workdps(DIGITS):
        for support, (x, y, theta) in zip(got, xs, strict=True):
            expected = mp.atan2(mp.mpf(landmark[1]) - mp.mpf(y), mp.mpf(landmark[0]) - mp.mpf(x))
            v = mp.mpf(bearing) - expected + mp.mpf(theta)
            v -= 2 * mp.pi * mp.floor((v + mp.pi) / (2 * mp.pi))
            assert support == pytest.approx(float(mp.npdf(v, 0, sigma)), rel=1e-12)


def test_audit_f2_an_anticlockwise_turn_is_positive():
    """ERRATA F2: 20 degrees to the left, then 10 to the right, end facing 10 degrees to the left."""
    moved = sample_motion([STILL], ODOMETRY, EXACT, Scripted())[0]
    np.testing.assert_allclose(moved, [0.1 * cos(pi / 9), 0.1 * sin(pi / 9), pi / 18], atol=1e-15)
    wrong = sample_motion([STILL], -ODOMETRY * [1, -1, 1], EXACT, Scripted())[0]
    assert moved[1] > 0 > wrong[1]


def drawn(normals):
    """Return the way that a particle goes which draws these numbers."""
    return np.hypot(*sample_motion([STILL], ODOMETRY, ALPHAS, Scripted(normals))[0, :2])


def test_audit_f3_the_motion_uses_the_way_that_was_drawn():
    """ERRATA F3: an error of -.0072 m makes the way .0928 m, and that is what the particle goes."""
    assert round(float(drawn([0, -0.0072 / SPREAD[1], 0])), 4) == 0.0928


def test_audit_f4_turns_to_either_side_add_to_the_doubt():
    """ERRATA F4: the way is uncertain to .01024 m; with the size of the sum of the turns it would be .00675."""
    assert round(float(drawn([0, 1, 0])) - 0.1, 5) == 0.01024
    assert round(0.05 * 0.1 + 0.01 * abs(ODOMETRY[0] + ODOMETRY[2]), 5) == 0.00675


def test_audit_f5_the_spread_is_a_standard_deviation():
    """ERRATA F5: one standard normal number moves each turn by .0176 and .0088 rad, not by their roots."""
    for normals, expected in (([1, 0, 0], 0.0176), ([0, 0, 1], 0.0088)):
        heading = sample_motion([STILL], ODOMETRY, ALPHAS, Scripted(normals))[0, 2]
        assert round(float(heading) - pi / 18, 4) == expected


def test_audit_f6_f7_the_landmark_of_the_question_and_the_wrap():
    """ERRATA F6, F7: with (0, 1) the printed sample is 3.03 rad off, once wrapped, and its weight is 0."""
    x, y, theta = printed = 0.6117, 1.7665, -0.5585
    unwrapped = pi / 2 - (atan2(1 - y, 0 - x) - theta)
    assert round(unwrapped, 2) == 3.26
    assert round(abs(wrap(unwrapped)), 2) == 3.03
    support = bearing_likelihood([printed], [0.0, 1.0], pi / 2, SIGMA)[0]
    assert 0 < support < 1e-15
    assert support == pytest.approx(np.exp(-0.5 * (wrap(unwrapped) / SIGMA) ** 2) / (np.sqrt(2 * pi) * SIGMA))
    whole_turns = [bearing_likelihood([printed], [0, 10], pi / 2 + 2 * pi * n, SIGMA)[0] for n in (-3, 0, 1)]
    np.testing.assert_allclose(whole_turns, whole_turns[1], rtol=1e-12)


def test_audit_f8_the_first_sample_and_its_support():
    """ERRATA F8: the first sample is (.6305, 1.8312, -.2096), sees (0, 10) at 1.8574 rad and weighs .0816."""
    normals = np.array([0.0156, -0.0072, -0.0055]) / SPREAD
    moved = sample_motion([FIRST], ODOMETRY, ALPHAS, Scripted(normals))
    assert moved[0].round(4).tolist() == [0.6305, 1.8312, -0.2096]
    assert round(atan2(10 - moved[0, 1], -moved[0, 0]) - moved[0, 2], 4) == 1.8574
    assert round(0.1 * float(bearing_likelihood(moved, [0.0, 10.0], pi / 2, SIGMA)[0]), 4) == 0.0816
    old = [[0.6117, 1.7665, -0.5585]]
    assert round(0.1 * float(bearing_likelihood(old, [0.0, 10.0], pi / 2, SIGMA)[0]), 4) == 0.0221


WEIGHTS = np.array([0.1775, 0.0080, 0.0696, 0.0116, 0.0244, 0.2070, 0.1747, 0.0797, 0.2389, 0.0087])


def test_audit_f9_f10_the_resampled_ten():
    """ERRATA F9, F10: the weights sum to 1.0001, and the offset .0097 takes 1 1 3 6 6 7 7 8 9 9."""
    assert round(WEIGHTS.sum(), 4) == 1.0001
    xs = np.stack([np.arange(1.0, 11.0), np.zeros(10), np.zeros(10)], axis=-1)
    # All particles face the landmark, which is seen ahead: they explain it alike, and the weights decide.
    taken, ws = bootstrap_step(xs, WEIGHTS, STILL, EXACT, [1e3, 0.0], 0.0, 1.0, Scripted(offset=0.0097))
    assert taken[:, 0].tolist() == [1, 1, 3, 6, 6, 7, 7, 8, 9, 9]
    np.testing.assert_array_equal(ws, np.full(10, 0.1))


def test_a_step_is_its_three_parts():
    """Drawing, weighing and resampling one by one, from one generator, give the same particles."""
    rng = np.random.default_rng(2)
    xs, ws = cloud(rng, 50), rng.uniform(size=50)
    got, even = bootstrap_step(xs, ws, ODOMETRY, ALPHAS, [0.0, 10.0], 1.0, SIGMA, np.random.default_rng(3))
    draw = np.random.default_rng(3)
    moved = sample_motion(xs, ODOMETRY, ALPHAS, draw)
    ws = ws * bearing_likelihood(moved, [0.0, 10.0], 1.0, SIGMA)
    np.testing.assert_array_equal(got, moved[systematic_resample(ws, draw.uniform(0, 1 / 50))])
    np.testing.assert_array_equal(even, np.full(50, 1 / 50))


def test_a_nearly_linear_case_is_the_kalman_filters():
    """Of 20000 headings mean and variance are those of Bayes' rule; false alarm 2e-6 (2 tests, 5 deviations)."""
    M, prior, sigma, bearing = 20_000, 0.3, 0.2, 0.25
    rng = np.random.default_rng(4)
    xs = np.zeros((M, 3))
    xs[:, 2] = prior * rng.standard_normal(M)
    got, _ = bootstrap_step(xs, np.full(M, 1 / M), STILL, EXACT, [5.0, 0.0], bearing, sigma, rng)
    mean = -bearing * prior**2 / (prior**2 + sigma**2)
    var = (prior * sigma) ** 2 / (prior**2 + sigma**2)
    w = bearing_likelihood(xs, [5.0, 0.0], bearing, sigma)
    w /= w.sum()
    off = xs[:, 2] - mean
    # What the weights cost, and at most as much again as drawing independently from them would.
    for moment, exact, scatter in ((off, 0.0, var), (off**2, var, 2 * var**2)):
        deviation = np.sqrt(np.sum((w * (moment - exact)) ** 2) + scatter / M)
        estimate = np.mean((got[:, 2] - mean) ** (1 if exact == 0.0 else 2))
        assert abs(estimate - exact) < 5 * deviation


def test_particles_far_off_still_have_a_best_one():
    """Where every density is too small for a float the logarithms still tell the nearest particle."""
    xs = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.1], [0.0, 0.0, 1.2]])
    assert not bearing_likelihood(xs, [5.0, 0.0], 0.0, 1e-3).any()
    taken, _ = bootstrap_step(xs, np.ones(3), STILL, EXACT, [5.0, 0.0], 0.0, 1e-3, Scripted())
    np.testing.assert_array_equal(taken, xs[[0, 0, 0]])


@pytest.mark.parametrize(("ws", "sigma"), [(np.zeros(3), 0.1), (np.ones(3), 1e-200)])
def test_if_none_is_possible_all_stay_and_a_warning_says_so(ws, sigma):
    """Weights all 0, or logarithms all minus infinity, keep every particle once."""
    xs = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.1], [0.0, 0.0, 1.2]])
    with pytest.warns(RuntimeWarning, match="no particle can explain"):
        taken, even = bootstrap_step(xs, ws, STILL, EXACT, [5.0, 0.0], 0.0, sigma, Scripted(offset=0.1))
    np.testing.assert_array_equal(taken, xs)
    np.testing.assert_array_equal(even, np.full(3, 1 / 3))


def test_edges_are_no_accident():
    """One particle, one weight of 1, float32 weights, the largest offset, the back, the landmark itself."""
    rng = np.random.default_rng(5)
    one, ws = bootstrap_step([FIRST], [0.3], STILL, EXACT, [0.0, 10.0], 0.1, SIGMA, rng)
    np.testing.assert_array_equal(one, [FIRST])
    np.testing.assert_array_equal(ws, [1.0])
    xs = cloud(rng, 4)
    last = Scripted(offset=np.nextafter(0.25, 0.0))
    taken, _ = bootstrap_step(xs, [0, 0, 1, 0], STILL, EXACT, [0.0, 10.0], 0.1, SIGMA, last)
    np.testing.assert_array_equal(taken, xs[[2, 2, 2, 2]])
    ws = rng.uniform(size=4).astype(np.float32)
    taken, even = bootstrap_step(xs, ws, STILL, EXACT, [0.0, 10.0], 0.1, SIGMA, last)
    assert taken.dtype == even.dtype == np.float64
    back = (
        bearing_likelihood([STILL], [-5.0, 0.0], pi, 0.1),
        bearing_likelihood([STILL], [-5.0, 0.0], -pi, 0.1),
    )
    assert back[0] == back[1] == bearing_likelihood([STILL], [5.0, 0.0], 0.0, 0.1)
    assert np.isfinite(bearing_likelihood([FIRST], FIRST[:2], 0.0, 0.1)).all()
    assert bearing_likelihood(np.zeros((0, 3)), [5.0, 0.0], 0.0, 0.1).shape == (0,)
    np.testing.assert_allclose(sample_motion([STILL], [0, -1, 0], EXACT, rng), [[-1.0, 0.0, 0.0]])


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted, and no result shares memory with them."""
    rng = np.random.default_rng(6)
    arguments = read_only(cloud(rng, 5), np.ones(5), ODOMETRY, ALPHAS, [0.0, 10.0])
    xs, ws, odometry, alphas, landmark = arguments
    results = (
        sample_motion(xs, odometry, alphas, rng),
        bearing_likelihood(xs, landmark, 0.1, SIGMA),
        *bootstrap_step(xs, ws, odometry, alphas, landmark, 0.1, SIGMA, rng),
    )
    for result in results:
        assert result.flags.writeable
        assert not any(np.shares_memory(result, argument) for argument in arguments)


XS, RNG = np.zeros((2, 3)), np.random.default_rng(7)


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        (sample_motion, (np.zeros(3), ODOMETRY, ALPHAS, RNG), "xs: expected shape"),
        (sample_motion, (XS, [1, 2], ALPHAS, RNG), "odometry: expected shape"),
        (sample_motion, (XS, [1, nan, 2], ALPHAS, RNG), "odometry: expected finite"),
        (sample_motion, (XS, ODOMETRY, [0.1] * 3, RNG), "alphas: expected shape"),
        (sample_motion, (XS, ODOMETRY, -ALPHAS, RNG), "alphas: expected no negative number, got -0.05"),
        (sample_motion, (XS, ODOMETRY, ALPHAS, 7), "rng: expected a numpy.random.Generator, got int"),
        (bearing_likelihood, (XS, [1, 2, 3], 0.0, 1.0), "landmark: expected shape"),
        (bearing_likelihood, (XS, [1, 2], inf, 1.0), "bearing: expected a finite"),
        (bearing_likelihood, (XS, [1, 2], 0.0, 0.0), "sigma: expected a positive number, got 0.0"),
        (bootstrap_step, (XS[:0], [], STILL, ALPHAS, [1, 2], 0.0, 1.0, RNG), "xs: expected at least one"),
        (bootstrap_step, (XS, [1.0], STILL, ALPHAS, [1, 2], 0.0, 1.0, RNG), "ws: expected shape"),
        (bootstrap_step, (XS, [1, -1], STILL, ALPHAS, [1, 2], 0.0, 1.0, RNG), "ws: expected no negative"),
        (bootstrap_step, (XS, [1, 1], STILL, ALPHAS, [1, 2], 0.0, -1.0, RNG), "sigma: expected a positive"),
    ],
)
def test_wrong_arguments_are_named(function, arguments, message):
    """A wrong argument is an error with its name, what was expected and what came."""
    with pytest.raises(ValueError, match=message):
        function(*arguments)
