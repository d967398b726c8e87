import numpy as np
import pytest

from roboloc.angles import wrap
from roboloc_reference import (
    ballistic,
    gaussian,
    invariant,
    invariant_slam,
    landmark_map,
    landmarks,
    ukf,
    velocity_ekf,
)
from roboloc_reference.velocity import range_bearing, range_bearings

EPS = np.finfo(float).eps
UPDATES = 2000


def wide(rng, n, spread=3.0):
    """Draw a covariance with eigenvalues over six powers of ten."""
    axes, _ = np.linalg.qr(rng.normal(size=(n, n)))
    Sigma = axes * 10.0 ** rng.uniform(-spread, spread, size=n) @ axes.T
    return (Sigma + Sigma.T) / 2


def sharp(rng, n):
    """Draw the covariance of an observation that is far better than any prior here."""
    return 10.0 ** rng.uniform(-13, -11) * np.eye(n)


def twins(rng):
    """Draw two landmarks a few metres off that nearly coincide."""
    phi, r = rng.uniform(-np.pi, np.pi), rng.uniform(2, 8)
    return r * np.array([np.cos(phi), np.sin(phi)]) + 1e-5 * rng.normal(size=(2, 2))


def handout(Sigma, H, Q):
    """Return Sigma - K S K^T for one or more observations of covariance Q each."""
    S = H @ Sigma @ H.T + np.kron(np.eye(len(H) // len(Q)), Q)
    K = np.linalg.solve(S, H @ Sigma).T
    return Sigma - K @ S @ K.T


def plain(rng):
    """Correct by two observations of nearly the same thing."""
    Sigma, Q = wide(rng, 6), sharp(rng, 2)
    H = rng.normal(size=(1, 6)) + 1e-5 * rng.normal(size=(2, 6))
    after = gaussian.measurement_update(rng.normal(size=6), Sigma, rng.normal(size=2), Q, H)[1]
    return Sigma, after, handout(Sigma, H, Q)


def map_of_twins(rng):
    """Draw a map of two landmarks that nearly coincide: the little in which they differ goes with the pose."""
    T = np.eye(7)
    T[5:, :2], T[5:, 3:5], T[5:, 5:] = 1e-2 * np.eye(2), np.eye(2), 1e-2 * np.eye(2)
    Sigma = T @ wide(rng, 7, 2.0) @ T.T
    x = np.concatenate([0.1 * rng.normal(size=3), twins(rng).ravel()])
    z, H = landmark_map.innovation(x, np.zeros(4))
    return x, (Sigma + Sigma.T) / 2, 1e-6 * rng.normal(size=4) - z, H, 3 * sharp(rng, 2)


def point_slam(rng):
    """See both landmarks of a map."""
    x, Sigma, z, H, Q = map_of_twins(rng)
    return Sigma, landmarks.update(x, Sigma, z, Q)[1], handout(Sigma, H, Q)


def point_slam_on_the_group(rng):
    """See both landmarks of a map, with the right-invariant error."""
    x, Sigma, z, H, Q = map_of_twins(rng)
    P = invariant_slam.to_invariant(x, Sigma)
    return P, invariant_slam.update(x, P, z, Q)[1], invariant_slam.to_invariant(x, handout(Sigma, H, Q))


def extended(rng):
    """See two known landmarks that nearly coincide, with the extended filter of the velocity model."""
    x, Sigma, Q, seen = 0.1 * rng.normal(size=3), wide(rng, 3, 2.0), 10 * sharp(rng, 2), twins(rng)
    z = range_bearings(x[None], seen).ravel() + 1e-6 * rng.normal(size=4)
    H = np.vstack([range_bearing(x, landmark)[1] for landmark in seen])
    return Sigma, velocity_ekf.correct(x, Sigma, z, seen, Q)[1], handout(Sigma, H, Q)


def unscented(kappa):
    """Return how two known landmarks that nearly coincide are seen by an unscented filter."""

    def case(rng):
        cov, Q = 1e-8 * wide(rng, 3, 2.0), 1e-7 * sharp(rng, 2)
        mean, seen = 0.1 * rng.normal(size=3), twins(rng)
        z = range_bearings(mean[None], seen).ravel()
        after = ukf.correct(mean, cov, z, seen, Q, kappa)[1]
        points, weights = ukf.sigma_points(mean, cov, kappa)
        e = range_bearings(points, seen) - z.reshape(2, 2)
        e[..., 0] = wrap(e[..., 0])
        e = e.reshape(len(points), 4)
        e = e - (weights @ e if kappa >= 0 else e[0])
        S, C = e.T * weights @ e + np.kron(np.eye(2), Q), e.T * weights @ (points - mean)
        K = np.linalg.solve(S, C).T
        return cov, after, cov - K @ S @ K.T

    return case


def on_the_group(rng):
    """See two known landmarks that nearly coincide, on the group."""
    P, N, seen = wide(rng, 3, 2.0), 10 * sharp(rng, 2), twins(rng)
    Y = np.concatenate([seen + 1e-6 * rng.normal(size=(2, 2)), np.ones((2, 1))], axis=1)
    H = np.concatenate([[[-1, 0, m[1]], [0, -1, -m[0]]] for m in seen])
    after = invariant.correct(np.eye(3), P, Y, seen, N)[1]
    return P, after, handout(P, H, N)


def ball(rng):
    """Correct a ball whose position is seen far better than it was known."""
    Sigma, R = wide(rng, 4), sharp(rng, 2)
    after = ballistic.correct(rng.normal(size=4), Sigma, rng.normal(size=2), R)[1]
    return Sigma, after, handout(Sigma, np.eye(2, 4), R)


# How often Sigma - K S K^T has to be no covariance, of 2000. A position observed as it stands in the state never
# makes a large gain of a small difference, so the ball's filter would do with the handout's form.
CASES = {
    "gaussian.measurement_update": (plain, 1500),
    "landmarks.update": (point_slam, 100),
    "invariant_slam.update": (point_slam_on_the_group, 80),
    "velocity_ekf.correct": (extended, 500),
    "ukf.correct": (unscented(0.0), 100),
    "ukf.correct, negative kappa": (unscented(-1.0), 100),
    "invariant.correct": (on_the_group, 1000),
    "ballistic.correct": (ball, 0),
}


@pytest.mark.parametrize("name", CASES)
def test_every_correction_leaves_a_covariance(name):
    """Of 2000 ill-conditioned updates no covariance of ours is indefinite or asymmetric; the handout's form is."""
    # Indefinite is an eigenvalue below -n eps times the norm of the covariance before the update. The draws are as
    # ill-conditioned as doubles bear: S has a condition of up to 1e15. With more, K itself is noise, and even
    # Joseph's form may end a few times below the bound, since the rounding of (I - K H) Sigma grows with K squared.
    case, least = CASES[name]
    rng, indefinite, handout = np.random.default_rng(8), 0, 0
    for _ in range(UPDATES):
        Sigma, after, short = case(rng)
        np.testing.assert_array_equal(after, after.T)
        floor = -len(Sigma) * EPS * np.linalg.norm(Sigma, 2)
        indefinite += np.linalg.eigvalsh(after)[0] < floor
        handout += np.linalg.eigvalsh((short + short.T) / 2)[0] < floor
    assert indefinite == 0
    assert handout >= least
