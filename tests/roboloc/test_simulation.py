import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles import dynamics, read_only

from roboloc.simulation import figure_eight, simulate_motion


@settings(deadline=None, derandomize=True, max_examples=30)
@given(st.floats(0.1, 5), st.floats(0.05, 2), st.floats(0.01, 0.2))
def test_figure_eight_closes_on_itself(radius, speed, dt):
    """After a circle to each side the robot is back at its pose, at about the speed asked for."""
    assume(2 * np.pi * radius / (speed * dt) > 20)
    us = figure_eight(radius, speed, dt)
    xs = simulate_motion([1.0, 2.0, 0.3], us, dt)
    np.testing.assert_allclose(xs[-1], xs[0], atol=1e-9)
    np.testing.assert_allclose(us[:, 0], speed, rtol=0.03)


def test_figure_eight_is_two_circles_of_the_radius_asked_for():
    """The first half stays on the circle to the left, the second half on the one to the right."""
    us = figure_eight(radius=2.0, speed=0.4, dt=0.05)
    xs = simulate_motion(np.zeros(3), us, 0.05)
    half = len(us) // 2
    np.testing.assert_allclose(np.linalg.norm(xs[: half + 1, :2] - [0, 2], axis=1), 2.0, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(xs[half:, :2] - [0, -2], axis=1), 2.0, rtol=1e-12)
    assert xs[half, 2] == pytest.approx(2 * np.pi)


def test_motion_without_noise_is_the_integral_of_the_unicycle():
    """Each step agrees with SymPy's integral, straight steps included."""
    us = np.array([[0.5, 0.3], [1.0, 0.0], [-0.7, 1e-9], [0.2, -2.0]])
    xs = simulate_motion([0.5, -1.0, 2.0], us, 0.4)
    for before, u, after in zip(xs, us, xs[1:], strict=False):
        exact = [float(value) for value in dynamics(before, u, 0.4)[0]]
        np.testing.assert_allclose(after, exact, atol=1e-14)


def test_noise_has_covariance_dt_times_R():
    """The controls that were really driven scatter about the commanded ones with covariance dt R."""
    R, dt, n = np.array([[0.04, 0.01], [0.01, 0.09]]), 0.5, 20_000
    us = np.tile([1.0, 0.2], (n, 1))
    xs = simulate_motion(np.zeros(3), us, dt, R, np.random.default_rng(7))
    steps = np.diff(xs, axis=0)
    omega = steps[:, 2] / dt
    chord = steps[:, 0] * np.cos(xs[:-1, 2] + steps[:, 2] / 2) + steps[:, 1] * np.sin(
        xs[:-1, 2] + steps[:, 2] / 2
    )
    V = chord / (dt * np.sinc(steps[:, 2] / (2 * np.pi)))
    drawn = np.stack([V, omega])
    np.testing.assert_allclose(drawn.mean(axis=1), [1.0, 0.2], atol=5 * np.sqrt(0.045 / n))
    # Five standard deviations of an entry of a sample covariance of n draws.
    spread = dt * np.sqrt((np.outer(np.diag(R), np.diag(R)) + R**2) / n)
    assert np.all(np.abs(np.cov(drawn) - dt * R) < 5 * spread)


def test_the_same_seed_gives_the_same_run():
    """All randomness comes from the generator, and a step of no time takes none of it."""
    us = figure_eight()[:50]
    run = [simulate_motion(np.zeros(3), us, 0.1, np.eye(2), np.random.default_rng(3)) for _ in range(2)]
    np.testing.assert_array_equal(*run)
    other = simulate_motion(np.zeros(3), us, 0.1, np.eye(2), np.random.default_rng(4))
    assert np.abs(run[0] - other).max() > 0.01


def test_certain_controls_may_have_a_singular_covariance():
    """A robot whose turning is exact and whose speed is not stays on its line."""
    us = np.tile([1.0, 0.0], (10, 1))
    xs = simulate_motion(np.zeros(3), us, 0.1, np.diag([0.1, 0.0]), np.random.default_rng(1))
    assert np.abs(xs[:, 1:]).max() < 1e-12
    assert np.ptp(np.diff(xs[:, 0])) > 1e-3


def test_no_controls_is_the_start_alone():
    """An empty run has one pose."""
    np.testing.assert_array_equal(simulate_motion([1, 2, 3], np.zeros((0, 2)), 0.1), [[1, 2, 3]])


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (([1, 2], [[1, 0]], 0.1), "x0"),
        (([1, 2, 3], [1, 0], 0.1), "us"),
        (([1, 2, 3], [[1, 0]], -0.1), "dt"),
        (([1, 2, 3], [[1, 0]], None), "dt"),
        (([1, 2, 3], [[1, 0]], 0.1, np.eye(3), np.random.default_rng(0)), "R"),
        (([1, 2, 3], [[1, 0]], 0.1, -np.eye(2), np.random.default_rng(0)), "R"),
        (([1, 2, 3], [[1, 0]], 0.1, np.eye(2)), "rng"),
        (([1, 2, 3], [[1, 0]], 0.1, np.eye(2), 7), "rng"),
    ],
)
def test_a_wrong_argument_of_simulate_motion_is_named(arguments, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        simulate_motion(*arguments)


@pytest.mark.parametrize(
    ("keywords", "name"),
    [({"radius": 0}, "radius"), ({"speed": -1}, "speed"), ({"dt": np.nan}, "dt"), ({"dt": 10}, "dt")],
)
def test_a_wrong_argument_of_figure_eight_is_named(keywords, name):
    """A circle needs a positive radius, speed and step, and at least three steps."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        figure_eight(**keywords)


def test_read_only_arguments_are_accepted():
    """Neither the start nor the controls nor the covariance is written to."""
    x0, us, R = read_only(np.zeros(3), figure_eight()[:3], np.eye(2))
    simulate_motion(x0, us, 0.1, R, np.random.default_rng(0))
