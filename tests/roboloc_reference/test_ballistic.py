from functools import cache

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import correction, finite_difference, read_only

from roboloc.metrics import chi2_band, nees
from roboloc_reference.ballistic import correct, motion, predict

law = settings(deadline=None, derandomize=True, max_examples=60)
seed = st.integers(0, 2**32 - 1)
G = 9.81


def bounce(x, dt, g, e):
    """Go from impact to impact with 50 digits; return state, product of flights and saltations, impacts."""
    with mp.workdps(50):
        px, y, vx, v = (mp.mpf(float(value)) for value in x)
        left, g, e = mp.mpf(float(dt)), mp.mpf(float(g)), mp.mpf(float(e))
        product, impacts = mp.eye(2), 0
        while True:
            fall = (v + mp.sqrt(v * v + 2 * g * y)) / g
            time = min(fall, left)
            y, v, left = y + v * time - g * time**2 / 2, v - g * time, left - time
            product = mp.matrix([[1, time], [0, 1]]) * product
            if left <= 0:
                break
            product = mp.matrix([[-e, 0], [-(1 + e) * g / v, -e]]) * product
            y, v, impacts = mp.mpf(0), -e * v, impacts + 1
        state = np.array([float(px + vx * mp.mpf(float(dt))), float(y), float(vx), float(v)])
        return state, np.array(product.tolist(), dtype=float), impacts


@cache
def one_impact():
    """Derive height and speed behind one impact, and their Jacobian by height and speed, by SymPy."""
    y, v, dt, g, e = symbols = sp.symbols("y v dt g e", positive=True)
    s = sp.sqrt(v**2 + 2 * g * y)
    tau = dt - (v + s) / g
    after = sp.Matrix([e * s * tau - g * tau**2 / 2, e * s - g * tau])
    return symbols, after, after.jacobian([y, v])


def energy(x):
    """Return the energy per mass of a state."""
    return G * x[1] + (x[2] ** 2 + x[3] ** 2) / 2


def covariance(rng, n, scale=1.0):
    """Draw a covariance with eigenvalues between 0.1 and 10 times `scale` squared."""
    axes, _ = np.linalg.qr(rng.normal(size=(n, n)))
    Sigma = axes * (scale**2 * 10.0 ** rng.uniform(-1, 1, size=n)) @ axes.T
    return (Sigma + Sigma.T) / 2


def test_one_impact_is_the_derivation():
    """State and Jacobian behind one impact equal SymPy's, evaluated with 50 digits, to 1e-12."""
    symbols, after, slope = one_impact()
    rng = np.random.default_rng(1)
    for _ in range(20):
        y, v, e = rng.uniform(0.5, 3), rng.uniform(0, 3), rng.uniform(0.3, 1)
        s = np.sqrt(v * v + 2 * G * y)
        dt = (v + s) / G + rng.uniform(0.05, 0.95) * 2 * e * s / G
        at = dict(zip(symbols, (sp.Float(a, 50) for a in (y, v, dt, G, e)), strict=True))
        g, Gx = motion([0.0, y, 0.0, v], dt, G, e)
        np.testing.assert_allclose(
            g[1::2], np.array(after.evalf(50, subs=at).tolist(), dtype=float).ravel(), atol=1e-12
        )
        np.testing.assert_allclose(
            Gx[1::2, 1::2], np.array(slope.evalf(50, subs=at).tolist(), dtype=float), atol=1e-12
        )


@law
@given(seed)
def test_many_impacts_are_flights_and_saltations(seed):
    """Through up to dozens of impacts, state and Jacobian equal the product step by step with 50 digits."""
    rng = np.random.default_rng(seed)
    x = np.array([rng.normal(), rng.uniform(0.1, 2), rng.normal(), rng.normal(0, 2)])
    e = rng.choice([rng.uniform(0.3, 0.99), 1.0])
    s = np.sqrt(x[3] ** 2 + 2 * G * x[1])
    rest = (x[3] + s) / G + (2 * s / G) * (e / (1 - e) if e < 1 else 10.0)
    dt = rng.uniform(0.0, min(0.95 * rest, 10.0))
    g, Gx = motion(x, dt, G, e)
    exact, product, _ = bounce(x, dt, G, e)
    np.testing.assert_allclose(g, exact, atol=1e-9)
    np.testing.assert_allclose(Gx[1::2, 1::2], product, rtol=1e-8, atol=1e-8 * np.abs(product).max())
    np.testing.assert_array_equal(Gx[::2, ::2], [[1.0, dt], [0.0, 1.0]])
    np.testing.assert_array_equal(Gx[::2, 1::2], 0.0)
    np.testing.assert_array_equal(Gx[1::2, ::2], 0.0)


@pytest.mark.parametrize(("dt", "impacts"), [(0.3, 0), (1.0, 1), (1.9, 2), (2.6, 3)])
def test_jacobian_is_the_slope(dt, impacts):
    """Away from an impact, the Jacobian agrees with finite differences, after 0, 1, 2 and 3 impacts."""
    x = np.array([1.0, 2.0, 0.5, 1.0])
    assert bounce(x, dt, G, 0.7)[2] == impacts
    slope = finite_difference(lambda a: motion(a, dt, G, 0.7)[0], x, step=1e-4)
    np.testing.assert_allclose(motion(x, dt, G, 0.7)[1], slope, atol=1e-8)


@law
@given(seed)
def test_energy_is_kept_and_lost(seed):
    """With e = 1 energy stays; otherwise each impact keeps e^2 of the vertical part, and flight all of it."""
    rng = np.random.default_rng(seed)
    x = np.array([0.0, rng.uniform(0.1, 2), rng.normal(), rng.normal(0, 2)])
    assert energy(motion(x, rng.uniform(0, 20), G, 1.0)[0]) == pytest.approx(energy(x), rel=1e-9)
    e = rng.uniform(0.5, 0.95)
    s = np.sqrt(x[3] ** 2 + 2 * G * x[1])
    dt = rng.uniform(0, 0.9) * ((x[3] + s) / G + 2 * s / G * e / (1 - e))
    sideways = x[2] ** 2 / 2
    impacts = bounce(x, dt, G, e)[2]
    left = energy(motion(x, dt, G, e)[0]) - sideways
    assert left == pytest.approx(e ** (2 * impacts) * (energy(x) - sideways), rel=1e-8)


@pytest.mark.parametrize("vy", [0.0, 3.0, -3.0, -1e4])
def test_impact_is_at_its_time(vy):
    """A hair before the closed form's impact the ball falls, a hair after it rises, with e times the speed."""
    y, e = 1.7, 0.6
    s = np.sqrt(vy**2 + 2 * G * y)
    t1 = 2 * y / (s - vy)
    before, after = (motion([0.0, y, 0.0, vy], t1 * (1 + hair), G, e)[0] for hair in (-1e-9, 1e-9))
    assert before[3] == pytest.approx(-s, rel=1e-6)
    assert after[3] == pytest.approx(e * s, rel=1e-6)
    assert 0 <= before[1] < 1e-5
    assert 0 <= after[1] < 1e-5


@law
@given(seed)
def test_two_steps_are_one(seed):
    """Cutting a step anywhere changes neither the state nor the product of the Jacobians."""
    rng = np.random.default_rng(seed)
    x = np.array([0.0, rng.uniform(0.1, 2), rng.normal(), rng.normal(0, 2)])
    first, second = rng.uniform(0, 0.6, size=2)
    middle, G1 = motion(x, first, G, 0.8)
    last, G2 = motion(middle, second, G, 0.8)
    whole, Gx = motion(x, first + second, G, 0.8)
    np.testing.assert_allclose(last, whole, atol=1e-9)
    np.testing.assert_allclose(G2 @ G1, Gx, rtol=1e-7, atol=1e-7 * np.abs(Gx).max())


def test_infinitely_many_impacts_end_in_rest():
    """After the geometric sum of all flights the ball lies still, moves on sideways, and forgot its height."""
    e, s = 0.5, np.sqrt(2 * G * 1.0)
    end = s / G + 2 * s / G * e / (1 - e)
    g, _ = motion([0.0, 1.0, 1.0, 0.0], end * (1 - 1e-6), G, e)
    assert 0 <= g[1] < 1e-9
    for x, dt in (([0.0, 1.0, 1.0, 0.0], end * (1 + 1e-12)), ([0.0, 0.0, 1.0, 0.0], 1.0)):
        g, Gx = motion(x, dt, G, e)
        np.testing.assert_array_equal(g, [dt, 0.0, 1.0, 0.0])
        np.testing.assert_array_equal(Gx[1::2], 0.0)
    np.testing.assert_array_equal(motion([0.0, 1.0, 0.0, 0.0], 1.0, G, 0.0)[0], np.zeros(4))
    np.testing.assert_array_equal(motion(np.zeros(4), 1.0, G, 1.0)[0], np.zeros(4))


def test_edges_of_a_step():
    """With dt = 0 nothing moves, not even on the ground; a start below the ground counts as on it."""
    for x in ([1.0, 2.0, 3.0, -4.0], [1.0, 0.0, 3.0, -4.0], np.zeros(4)):
        g, Gx = motion(x, 0.0, G, 0.5)
        np.testing.assert_array_equal(g, x)
        np.testing.assert_array_equal(Gx, np.eye(4))
    below, on = motion([0.0, -0.01, 0.0, -1.0], 0.05, G, 0.5), motion([0.0, 0.0, 0.0, -1.0], 0.05, G, 0.5)
    np.testing.assert_array_equal(below[0], on[0])
    assert np.isfinite(below[1]).all()


def test_without_impact_it_is_the_kalman_filter():
    """In free flight the motion is linear: covariance and correction equal the textbook with 50 digits."""
    rng = np.random.default_rng(2)
    x, Sigma, Q, R = (
        np.array([0.0, 50.0, 1.0, 2.0]),
        covariance(rng, 4),
        covariance(rng, 4),
        covariance(rng, 2),
    )
    F = np.eye(4)
    F[0, 2] = F[1, 3] = 0.5
    got, got_Sigma = predict(x, Sigma, 0.5, G, 0.7, Q)
    np.testing.assert_allclose(got, F @ x - G * np.array([0.0, 0.125, 0.0, 0.5]), atol=1e-12)
    np.testing.assert_allclose(got_Sigma, F @ Sigma @ F.T + Q, atol=1e-12)
    z = x[:2] + rng.normal(size=2)
    exact, exact_Sigma = correction(x, Sigma, z - x[:2], R, np.eye(2, 4))
    got, got_Sigma = correct(x, Sigma, z, R)
    np.testing.assert_allclose(got, np.array(exact.tolist(), dtype=float).ravel(), atol=1e-9)
    np.testing.assert_allclose(got_Sigma, np.array(exact_Sigma.tolist(), dtype=float), atol=1e-9)
    np.testing.assert_array_equal(got_Sigma, got_Sigma.T)


def test_predicted_covariance_is_that_of_many_balls():
    """Through two impacts the covariance is that of 2,000 balls, to a tenth; the naive jump is far off."""
    rng = np.random.default_rng(3)
    x, Sigma, dt, e = np.array([0.0, 2.0, 1.0, 0.0]), np.diag([1e-4, 1e-4, 1e-4, 1e-4]), 2.0, 0.8
    balls = [motion(ball, dt, G, e)[0] for ball in rng.multivariate_normal(x, Sigma, size=2000)]
    _, got = predict(x, Sigma, dt, G, e, np.zeros((4, 4)))
    sigma = np.sqrt(np.diag(got))
    # Two thousand balls know an entry to sqrt(2 / 2000) = 0.032: 16 entries at 4.7 deviations, false alarm 1e-4.
    assert bounce(x, dt, G, e)[2] == 2
    assert np.abs((np.cov(np.transpose(balls)) - got) / np.outer(sigma, sigma)).max() < 0.15
    flight = np.array([[1.0, dt], [0.0, 1.0]])
    naive = np.diag([1.0, e**2]) @ flight
    naive = naive @ Sigma[1::2, 1::2] @ naive.T
    assert np.abs(naive / got[1::2, 1::2] - 1).max() > 0.5


def run(rng, steps, *, naive=False):
    """Return the NEES after the steps of one run; the naive filter knows the jump's own derivative only."""
    e, dt = 0.8, 0.1
    P = np.diag([0.02, 0.02, 0.05, 0.05]) ** 2
    Q, R = np.diag([1e-3, 1e-3, 5e-3, 5e-3]) ** 2, np.diag([0.2, 0.2]) ** 2
    x = np.array([0.0, 2.0, 1.0, 0.0])
    truth, Sigma = x + np.sqrt(np.diag(P)) * rng.normal(size=4), P
    for _ in range(steps):
        truth = motion(truth, dt, G, e)[0] + np.sqrt(np.diag(Q)) * rng.normal(size=4)
        before = x
        x, predicted = predict(before, Sigma, dt, G, e, Q)
        if naive and x[3] > before[3]:
            jump = np.eye(4)
            jump[0, 2], jump[1, 3], jump[3, 3] = dt, dt, -e
            predicted = jump @ Sigma @ jump.T + Q
        x, Sigma = correct(x, predicted, truth[:2] + 0.2 * rng.normal(size=2), R)
    return nees(x - truth, Sigma)


def test_the_filter_is_honest():
    """Mean NEES of 300 seeded runs past an impact is in the chi-square band of .999; the naive jump's is not."""
    low, high = chi2_band(4, 0.999, 300)
    rng = np.random.default_rng(4)
    assert low < np.mean([run(rng, 9) for _ in range(300)]) < high
    assert np.mean([run(rng, 9, naive=True) for _ in range(300)]) > high


def test_arguments_are_read_only_and_results_are_new():
    """Read-only arrays are accepted, and the results share no memory with them."""
    x, Sigma, Q, z, R = arguments = read_only(np.ones(4), np.eye(4), np.eye(4), np.ones(2), np.eye(2))
    results = [*motion(x, 0.0, G, 0.5), *predict(x, Sigma, 0.0, G, 0.5, Q), *correct(x, Sigma, z, R)]
    for result in results:
        assert not any(np.shares_memory(result, argument) for argument in arguments)


X, I4, I2 = np.ones(4), np.eye(4), np.eye(2)


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: motion(None, 0.1, G, 0.5), "x"),
        (lambda: motion(X[:3], 0.1, G, 0.5), "x"),
        (lambda: motion(X, -0.1, G, 0.5), "dt"),
        (lambda: motion(X, 0.1, 0.0, 0.5), "gravity"),
        (lambda: motion(X, 0.1, np.nan, 0.5), "gravity"),
        (lambda: motion(X, 0.1, G, -0.1), "restitution"),
        (lambda: motion(X, 0.1, G, 1.1), "restitution"),
        (lambda: predict(X, I2, 0.1, G, 0.5, I4), "Sigma"),
        (lambda: predict(X, I4, 0.1, G, 0.5, I2), "Q"),
        (lambda: predict(X * np.inf, I4, 0.1, G, 0.5, I4), "x"),
        (lambda: correct(X[:2], I4, X[:2], I2), "x"),
        (lambda: correct(X, I2, X[:2], I2), "Sigma"),
        (lambda: correct(X, I4, X, I2), "z"),
        (lambda: correct(X, I4, X[:2], I4), "R"),
        (lambda: correct(X, 0 * I4, X[:2], 0 * I2), "R"),
    ],
)
def test_a_wrong_argument_of_the_bouncing_ball_is_named(call, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        call()
