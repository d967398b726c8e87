"""The ball with an unknown restitution: the slope by e, e found, and the filter honest about it.

How the runs of the last part are drawn, and what a block of 200 has to pass, is told in `ball_runs`; here e itself is
drawn about 0.8 with SIGMA_E.
"""

from functools import cache

import numpy as np
import pytest
from ball_runs import (
    BLOCKS,
    GRAVITY,
    INSTANTS_UNKNOWN,
    SIGMA0,
    SIGMA_E,
    START,
    TIMES_UNKNOWN,
    Q,
    R,
    estimate,
    jump_alone,
    moved,
    no_jump,
    passed,
    saltation,
    throw,
)
from oracles import correction, finite_difference, read_only

from roboloc.metrics import nees
from roboloc_reference import ballistic
from roboloc_reference.restitution import correct, motion, predict

G = GRAVITY
OPEN = SIGMA0 + np.diag([0.0, 0.0, 0.0, 0.0, SIGMA_E**2])
STEPS = np.diff(TIMES_UNKNOWN, prepend=0.0)


@pytest.mark.parametrize("dt", [0.0, 0.3, 1.0, 1.9, 2.6, 3.0])
def test_motion_is_that_of_the_known_ball(dt):
    """With e in the state the ball flies as with e given, and the old block of the Jacobian is the old Jacobian."""
    x = np.array([1.0, 2.0, 0.5, 1.0, 0.7])
    g, slope = motion(x, dt, G)
    known, known_slope = ballistic.motion(x[:4], dt, G, 0.7)
    np.testing.assert_array_equal(g, [*known, 0.7])
    np.testing.assert_array_equal(slope[:4, :4], known_slope)
    np.testing.assert_array_equal(slope[4], np.eye(5)[4])


@pytest.mark.parametrize("e", [0.2, 0.7, 0.95, 1 - 1e-4])
@pytest.mark.parametrize("dt", [0.3, 1.0, 1.9, 2.6, 4.4])
def test_slope_by_restitution_is_the_slope(e, dt):
    """Away from an impact the Jacobian agrees with finite differences, whatever the number of impacts behind it."""
    x = np.array([1.0, 2.0, 0.5, 1.0, e])
    slope = finite_difference(lambda a: motion(a, dt, G)[0], x, step=1e-5)
    np.testing.assert_allclose(motion(x, dt, G)[1], slope, atol=1e-5)


def test_slope_at_one_is_the_limit():
    """At e = 1, and next to it, the slope after many impacts is that from below, by flights and saltations."""
    for e in (1.0, 1 - 1e-12, 1 - 1e-8, 1 - 1e-6, 0.99):
        x = np.array([0.0, 2.0, 1.0, 0.0, e])
        (exact,), (slope,) = moved(x[None], 3.3)
        g, got = motion(x, 3.3, G)
        np.testing.assert_allclose(g, exact, atol=1e-10)
        np.testing.assert_allclose(got, slope, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(("e", "counts_as"), [(-0.1, 0.0), (1.2, 1.0)])
def test_an_impossible_restitution_counts_as_the_nearest(e, counts_as):
    """The ball moves as with the nearest possible e, and the belief about e stays what it is."""
    x = np.array([0.0, 1.0, 1.0, 0.0, e])
    g, _ = motion(x, 1.0, G)
    np.testing.assert_array_equal(g[:4], ballistic.motion(x[:4], 1.0, G, counts_as)[0])
    assert g[4] == e


def test_before_an_impact_nothing_is_learnt():
    """Observations in the first flight leave e and its variance as they were; one behind the impact does not."""
    x, Sigma = START, OPEN
    for dt in (0.2, 0.2, 0.1):
        x, Sigma = predict(x, Sigma, dt, G, Q)
        x, Sigma = correct(x, Sigma, x[:2] + 0.02, R)
    assert x[4] == START[4]
    assert Sigma[4, 4] == pytest.approx(SIGMA_E**2, rel=1e-12)
    x, Sigma = predict(x, Sigma, 0.4, G, Q)
    x, Sigma = correct(x, Sigma, x[:2] + np.array([0.0, 0.02]), R)
    assert x[4] > START[4] + 1e-3
    assert Sigma[4, 4] < 0.9 * SIGMA_E**2


@pytest.mark.parametrize("e", [0.6, 0.8, 0.95])
def test_the_restitution_is_found(e):
    """Told 0.75 give or take 0.15, thirty looks through two seconds find e to 0.01 and know that."""
    rng = np.random.default_rng(1)
    truth = np.array([0.0, 2.0, 1.0, 0.0, e])
    x, Sigma = np.array([0.0, 2.0, 1.0, 0.0, 0.75]), SIGMA0 + np.diag([0.0, 0.0, 0.0, 0.0, 0.15**2])
    for _ in range(30):
        truth = motion(truth, 0.0667, G)[0]
        x, Sigma = predict(x, Sigma, 0.0667, G, Q)
        x, Sigma = correct(x, Sigma, truth[:2] + 0.02 * rng.normal(size=2), R)
    assert abs(x[4] - e) < 0.01
    assert 1e-4 < np.sqrt(Sigma[4, 4]) < 0.01


def test_without_noise_the_error_is_zero():
    """From the true state, exact observations leave the filter at the truth through three impacts, to 1e-12."""
    truth = x = START
    Sigma = OPEN
    for dt in STEPS:
        truth = motion(truth, dt, G)[0]
        x, Sigma = predict(x, Sigma, dt, G, Q)
        x, Sigma = correct(x, Sigma, truth[:2], R)
    np.testing.assert_allclose(x, truth, atol=1e-12)


def test_correction_is_conditioning():
    """Mean and covariance equal the information form with 100 digits."""
    rng = np.random.default_rng(2)
    A = rng.normal(size=(5, 5))
    x, Sigma, v = rng.normal(size=5), A @ A.T + np.eye(5), rng.normal(size=2)
    exact = correction(x, Sigma, v, np.diag([0.1, 0.3]), np.eye(2, 5))
    for got, expected in zip(correct(x, Sigma, x[:2] + v, np.diag([0.1, 0.3])), exact, strict=True):
        np.testing.assert_allclose(
            got, np.array(expected.tolist(), dtype=float).reshape(got.shape), atol=1e-9
        )


# ---------------------------------------------------------------- honesty


@cache
def the_throws():
    """Return the throws of all blocks."""
    return throw([np.random.default_rng(block) for block in range(BLOCKS)], OPEN, TIMES_UNKNOWN)


def judged(throws, **fault):
    """Return the NEES of the whole state at the named instants."""
    return estimate(throws, OPEN, TIMES_UNKNOWN, INSTANTS_UNKNOWN, 5, **fault)


def blind_to_restitution(v, e):
    """Return a saltation that forgets what e does."""
    S = saltation(v, e)
    S[:, 1, 2] = 0.0
    return S


def test_many_runs_at_once_are_the_reference_one_by_one():
    """Run by run, the reference gives the same NEES at every instant, to 1e-6 of it."""
    states, zs = throws = throw([np.random.default_rng(99)], OPEN, TIMES_UNKNOWN, runs=3)
    many = judged(throws)
    for run in range(3):
        x, Sigma, squares = START, OPEN, []
        for k, dt in enumerate(STEPS):
            x, Sigma = predict(x, Sigma, dt, G, Q)
            if k < len(STEPS) - 1:
                x, Sigma = correct(x, Sigma, zs[k, run], R)
            if TIMES_UNKNOWN[k] in INSTANTS_UNKNOWN:
                squares.append(nees(x - states[k, run], Sigma))
        np.testing.assert_allclose(many[:, run], squares, rtol=1e-6)


def test_the_right_filter_is_honest():
    """At least 19 of 20 blocks pass at all five instants; a false alarm in two has a probability of 2e-4."""
    assert passed(judged(the_throws()), 5).all(axis=0).sum() >= 19


@pytest.mark.parametrize(
    "fault",
    [
        pytest.param({"impact": blind_to_restitution}, id="what e does forgotten"),
        pytest.param({"impact": jump_alone}, id="Jacobian without the saltation term"),
        pytest.param({"impact": no_jump}, id="Jacobian without the impact"),
        pytest.param({"turned": True}, id="Jacobian transposed"),
        pytest.param({"Q": 0 * Q}, id="process noise forgotten"),
        pytest.param({"Q": Q / 2}, id="half the process noise"),
    ],
)
def test_a_wrong_filter_is_found(fault):
    """None of the 20 blocks passes if the filter is wrong in one thing."""
    assert not passed(judged(the_throws(), **fault), 5).all(axis=0).any()


# ---------------------------------------------------------------- arguments


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted, and the results share no memory with them."""
    x, Sigma, noise, z, R2 = arguments = read_only(np.ones(5), np.eye(5), np.eye(5), np.ones(2), np.eye(2))
    results = [*motion(x, 0.0, G), *predict(x, Sigma, 0.0, G, noise), *correct(x, Sigma, z, R2)]
    for result in results:
        assert not any(np.shares_memory(result, argument) for argument in arguments)


X, I5, I2 = np.full(5, 0.5), np.eye(5), np.eye(2)


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: motion(X[:4], 0.1, G), "x"),
        (lambda: motion(X * np.nan, 0.1, G), "x"),
        (lambda: motion(X, -0.1, G), "dt"),
        (lambda: motion(X, 0.1, 0.0), "gravity"),
        (lambda: predict(X, I2, 0.1, G, I5), "Sigma"),
        (lambda: predict(X, I5, 0.1, G, I2), "Q"),
        (lambda: correct(None, I5, X[:2], I2), "x"),
        (lambda: correct(X, I2, X[:2], I2), "Sigma"),
        (lambda: correct(X, I5, X, I2), "z"),
        (lambda: correct(X, I5, X[:2], I5), "R"),
        (lambda: correct(X, 0 * I5, X[:2], 0 * I2), "R"),
    ],
)
def test_a_wrong_argument_of_the_unknown_ball_is_named(call, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        call()
