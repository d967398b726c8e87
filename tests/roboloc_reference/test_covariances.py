import numpy as np
import pytest

from roboloc.angles import wrap
from roboloc_reference import ballistic, gaussian, invariant, landmarks, ukf
from roboloc_reference.velocity import range_bearings

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


def plain(rng):
    """Correct by two observations of nearly the same thing."""
    Sigma, Q = wide(rng, 6), sharp(rng, 2)
    H = rng.normal(size=(1, 6)) + 1e-5 * rng.normal(size=(2, 6))
    after = gaussian.measurement_update(rng.normal(size=6), Sigma, rng.normal(size=2), Q, H)[1]
    return Sigma, after, H @ Sigma, H @ Sigma @ H.T + Q


def point_slam(rng):
    """Map two landmarks that nearly coincide: the little in which they differ goes with the pose."""
    T = np.eye(7)
    T[5:, :2], T[5:, 3:5], T[5:, 5:] = 1e-2 * np.eye(2), np.eye(2), 1e-2 * np.eye(2)
    Sigma, Q = T @ wide(rng, 7, 2.0) @ T.T, 3 * sharp(rng, 2)
    Sigma = (Sigma + Sigma.T) / 2
    x = np.concatenate([0.1 * rng.normal(size=3), twins(rng).ravel()])
    z, H = np.zeros(4), np.zeros((4, 7))
    for j in range(2):
        i = slice(2 * j, 2 * j + 2)
        z[i], H[i, :3], H[i, 3 + 2 * j : 5 + 2 * j] = landmarks.measurement(x, j)
    after = landmarks.update(x, Sigma, z + 1e-6 * rng.normal(size=4), Q)[1]
    return Sigma, after, H @ Sigma, H @ Sigma @ H.T + np.kron(np.eye(2), Q)


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
        return cov, after, e.T * weights @ (points - mean), e.T * weights @ e + np.kron(np.eye(2), Q)

    return case


def on_the_group(rng):
    """See two known landmarks that nearly coincide, on the group."""
    P, N, seen = wide(rng, 3, 2.0), 10 * sharp(rng, 2), twins(rng)
    Y = np.concatenate([seen + 1e-6 * rng.normal(size=(2, 2)), np.ones((2, 1))], axis=1)
    H = np.concatenate([[[-1, 0, m[1]], [0, -1, -m[0]]] for m in seen])
    after = invariant.correct(np.eye(3), P, Y, seen, N)[1]
    return P, after, H @ P, H @ P @ H.T + np.kron(np.eye(2), N)


def ball(rng):
    """Correct a ball whose position is seen far better than it was known."""
    Sigma, R = wide(rng, 4), sharp(rng, 2)
    after = ballistic.correct(rng.normal(size=4), Sigma, rng.normal(size=2), R)[1]
    return Sigma, after, Sigma[:2], Sigma[:2, :2] + R


# How often Sigma - K S K^T has to be no covariance, of 2000. A position observed as it stands in the state never
# makes a large gain of a small difference, so the ball's filter would do with the handout's form.
CASES = {
    "gaussian.measurement_update": (plain, 1500),
    "landmarks.update": (point_slam, 100),
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
        Sigma, after, HSigma, S = case(rng)
        np.testing.assert_array_equal(after, after.T)
        K = np.linalg.solve(S, HSigma).T
        short = Sigma - K @ S @ K.T
        floor = -len(Sigma) * EPS * np.linalg.norm(Sigma, 2)
        indefinite += np.linalg.eigvalsh(after)[0] < floor
        handout += np.linalg.eigvalsh((short + short.T) / 2)[0] < floor
    assert indefinite == 0
    assert handout >= least
