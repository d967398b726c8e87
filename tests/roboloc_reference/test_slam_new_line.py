"""A new line in the state: where it enters, what it knows of the rest, and that it is predicted as it was seen."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from line_states import TF, a_line, law, minus, mountings, poses, random_covariance, random_state, seeds
from scipy.stats import norm

from roboloc.angles import wrap
from roboloc_reference.slam import augment, compute_predicted_measurements


@law
@given(a_line, poses, mountings, st.integers(0, 4), seeds)
def test_a_new_line_is_predicted_where_it_was_seen(z, pose, tf, J, seed):
    """Once in the state, a line is predicted as it was seen, and it is written with r >= 0, alpha in [-pi, pi)."""
    rng = np.random.default_rng(seed)
    x = np.concatenate([pose, random_state(rng, J)[3:]])
    Sigma, Q = random_covariance(rng, x.size), random_covariance(rng, 2)
    grown, Grown = augment(x, Sigma, z, Q, tf)
    np.testing.assert_array_equal(grown[:-2], x)
    np.testing.assert_array_equal(Grown[:-2, :-2], Sigma)
    np.testing.assert_array_equal(Grown, Grown.T)
    assert -np.pi <= grown[-2] < np.pi
    assert grown[-1] >= 0
    hs, Hs = compute_predicted_measurements(grown, tf, fixed=0)
    foot, seen = (r * np.array([np.cos(a), np.sin(a)]) for a, r in (hs[:, J], z))
    np.testing.assert_allclose(foot, seen, atol=1e-12)
    assume(z[1] > 1e-9)
    assert np.abs(minus(hs[:, J], z)).max() < 1e-12

    # What is predicted of it has the covariance Q of the observation, and nothing to do with the old state.
    H = Hs[J]
    scale = 1 + np.abs(Grown).max() * np.abs(H).max()
    np.testing.assert_allclose(H @ Grown @ H.T, Q, atol=1e-11 * scale)
    np.testing.assert_allclose(H @ Grown[:, :-2], 0.0, atol=1e-11 * scale)


def test_a_new_line_against_monte_carlo():
    """The covariance of 100,000 drawn states and observations is the one claimed; false alarm 1e-3 in all."""
    # The errors are small, so that the second order is far below the bands, which are Bonferroni's for the 28
    # entries of both covariances, each with the variance S_ii S_jj + S_ij**2 over the runs. In the second case
    # the wall is between origin and scanner, so that the line is normalised.
    rng = np.random.default_rng(3)
    runs, size = 100_000, 1e-4
    for z in ([0.7, 1.5], [2.9, 0.4]):
        x = np.array([1.0, 2.0, 0.4, -1.0, 3.0])
        Sigma, Q = random_covariance(rng, 5, size), random_covariance(rng, 2, size)
        grown, claimed = augment(x, Sigma, z, Q, TF)
        states = rng.multivariate_normal(x, Sigma, runs)
        seen = rng.multivariate_normal(z, Q, runs)
        zero, none = np.zeros((3, 3)), np.zeros((2, 2))
        new = np.array(
            [augment(s[:3], zero, o, none, TF)[0][3:] for s, o in zip(states[:4], seen[:4], strict=True)]
        )
        drawn = drawn_lines(states, seen)
        np.testing.assert_allclose(drawn[:4], new, atol=1e-12)  # what is drawn is what enters
        errors = np.hstack([states, drawn]) - grown
        errors[:, [3, 5]] = wrap(errors[:, [3, 5]])
        found = errors.T @ errors / runs
        variance = np.diag(claimed)
        spread = np.sqrt((np.outer(variance, variance) + claimed**2) / runs)
        limit = norm.isf(1e-3 / 2 / 28 / 2)
        assert np.abs((found - claimed) / spread).max() < limit

        forgotten = claimed.copy()  # the fault C10 of ERRATA: no cross-covariance
        forgotten[5:, :5] = forgotten[:5, 5:] = 0.0
        assert np.abs((found - forgotten) / spread).max() > 10 * limit


def drawn_lines(states, seen):
    """Return the world's lines (N, 2) for states and observations, from the nearest and one more point."""
    p = seen[:, 1] * np.exp(1j * seen[:, 0])
    q = p + 1j * np.exp(1j * seen[:, 0])
    for x, y, theta in (TF[:, None], states[:, :3].T):
        p, q = (w * np.exp(1j * theta) + x + 1j * y for w in (p, q))
    normal = -1j * (q - p)
    r = (p * normal.conj()).real
    normal = np.where(r < 0, -normal, normal)
    return np.stack([np.angle(normal), np.abs(r)], axis=1)


def test_a_line_beyond_the_origin_is_normalised():
    """A wall between robot and origin, seen ahead of a robot that looks away from it, changes its sign."""
    x, Sigma = augment(
        [3.0, 0.0, 0.0], np.diag([0.04, 0.0, 0.0]), [np.pi, 4.0], np.diag([0.0, 0.01]), [0, 0, 0]
    )
    np.testing.assert_allclose(x[3:], [-np.pi, 1.0], atol=1e-12)
    assert Sigma[0, 4] == pytest.approx(
        -0.04
    )  # the robot farther to the right, the wall nearer to the origin
    assert Sigma[4, 4] == pytest.approx(0.05)


@pytest.mark.parametrize("zero", [0.0, -0.0])
def test_a_line_through_the_scanner_or_the_origin(zero):
    """A line with r = 0 of either sign, seen or in the world, keeps its angle, and r is never -0."""
    x, _ = augment([0.0, 0.0, 0.3], np.eye(3), [0.2, zero], np.eye(2), [0.0, 0.0, 0.0])
    assert x[3:].tolist() == [0.5, 0.0]
    assert not np.signbit(x[4])
    hs, Hs = compute_predicted_measurements([0.0, 0.0, 0.0, 0.5, zero], [0.0, 0.0, 0.0], fixed=0)
    assert hs.tolist() == [[0.5], [0.0]]
    assert not np.signbit(hs).any()
    assert Hs[0, :, 3:].tolist() == [[1.0, 0.0], [0.0, 1.0]]


def test_the_covariance_of_a_grown_state_is_one():
    """However many lines enter, even with a singular Q or a certain pose, no eigenvalue is below the rounding."""
    rng = np.random.default_rng(11)
    for pose_size, Q in ((0.0, np.eye(2)), (0.3, np.zeros((2, 2))), (0.3, np.diag([1e-12, 1.0]))):
        x, Sigma = np.array([2.0, -1.0, 0.5]), random_covariance(rng, 3, pose_size)
        for _ in range(20):
            x, Sigma = augment(x, Sigma, [rng.uniform(-3, 3), rng.uniform(0, 5)], Q, TF)
        eigenvalues = np.linalg.eigvalsh(Sigma)
        assert eigenvalues[0] >= -x.size * np.finfo(float).eps * eigenvalues[-1]
