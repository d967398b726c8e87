from math import atan2, pi

import numpy as np
from landmark_forms import covariance, exactly, floats, scene

from roboloc_reference.landmarks import init_landmarks, measurement, predict


def test_audit_c1_c2_the_turn_is_alpha_and_the_third_error_is_in_heading():
    """ERRATA C1, C2: the heading gains alpha, not d, and takes the third variance alone; it is not wrapped."""
    x, Sigma = predict([0.0, 0.0, 3.0], np.zeros((3, 3)), [2.0, 0.5], np.diag([0.0, 0.0, 0.04]))
    assert x[2] == 3.5
    np.testing.assert_array_equal(Sigma, np.diag([0.0, 0.0, 0.04]))


def test_audit_c3_the_range_noise_moves_the_landmark_along_the_ray():
    """ERRATA C3: bearing noise acts across the ray, by the range, and range noise along it."""
    _, Sigma = init_landmarks([pi / 2, 5.0], np.diag([0.01, 0.09]), np.zeros(3), np.zeros((3, 3)))
    np.testing.assert_allclose(Sigma[3:, 3:], np.diag([0.25, 0.09]), atol=1e-15)


def test_audit_c4_to_c8_the_worked_numbers():
    """ERRATA C4 to C8: pose (1, 2, .3), landmark (4, 6) is seen at .627 rad and 5 m, with these derivatives."""
    z, Hp, Hl = measurement([1.0, 2.0, 0.3, 4.0, 6.0], 0)
    assert round(float(z[0]), 4) == 0.6273
    assert z[1] == 5.0
    assert round(atan2(2 - 6, 1 - 4) - 0.3, 3) == -2.514  # C4: pose minus landmark looks backwards
    assert round(atan2(3, 4) - 0.3, 4) == 0.3435  # C5: the arguments the wrong way round
    np.testing.assert_allclose(Hp, [[0.16, -0.12, -1.0], [-0.6, -0.8, 0.0]], atol=1e-15)
    np.testing.assert_allclose(Hl, [[-0.16, 0.12], [0.6, 0.8]], atol=1e-15)


def off_by(Sigma, errors):
    """Return how far whitened errors are from independent unit normals, the worst of all entries, in sigmas."""
    white = np.linalg.solve(np.linalg.cholesky(Sigma), errors.T)
    n, N = white.shape
    return np.abs((white @ white.T / N - np.eye(n)) / np.sqrt((1 + np.eye(n)) / N)).max()


def test_audit_c10_the_first_covariance_is_that_of_20000_draws():
    """ERRATA C10: all 28 moments agree, false alarm 2e-5 (5 standard deviations each); zero cross terms do not."""
    rng, N = np.random.default_rng(10), 20_000
    z, _, pose, _ = scene(rng, 2)
    pose_cov, Q = 1e-6 * covariance(rng, 3), 1e-6 * covariance(rng, 2)
    x, Sigma = init_landmarks(z, Q, pose, pose_cov)
    poses = pose + rng.multivariate_normal(np.zeros(3), pose_cov, N)
    looks = z.reshape(2, 2) + rng.multivariate_normal(np.zeros(2), Q, (N, 2))
    angle = looks[..., 0] + poses[:, 2:]
    places = poses[:, None, :2] + looks[..., 1:] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    errors = np.concatenate([poses, places.reshape(N, 4)], axis=1) - x
    assert off_by(Sigma, errors) < 5
    apart = Sigma.copy()
    apart[:3, 3:] = apart[3:, :3] = 0.0
    assert off_by(apart, errors) > 20
    np.testing.assert_allclose(
        Sigma[3:5, :3], floats(exactly("J_pose", *pose, *z[:2])) @ pose_cov, rtol=1e-12, atol=1e-18
    )
