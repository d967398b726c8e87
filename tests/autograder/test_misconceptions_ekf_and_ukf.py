"""Wrong versions of the velocity model and the unscented filter, and the diagnosis that names them."""

from __future__ import annotations

import numpy as np
from diagnosis import found

from autograder.misconceptions import of_stage, unscented_points, velocity_jacobians
from roboloc_reference import ukf, velocity, velocity_ekf


def test_right_functions_have_no_diagnosis():
    """Nothing is said about functions that pass."""
    assert found("velocity.motion", velocity.motion) == []
    assert found("ukf.correct", ukf.correct) == []


def test_the_printed_derivatives_are_those_of_the_errata():
    """At the audited drive the printed column is (-.5964, -.3865); at 5 m the printed row is (-.12, -.16)."""
    at = np.array([0.0, 0.0, 0.4]), np.array([1.5, 0.7, 0.0]), 0.5
    printed = velocity_jacobians.as_printed(*at)[1][:, 1]
    np.testing.assert_allclose(printed, (-0.5964, -0.3865, 0.5), atol=1e-4)
    np.testing.assert_allclose(velocity.jacobians(*at)[1][:, 1], (-0.1106, 0.1506, 0.5), atol=1e-4)
    (twice,) = (item for item in of_stage("velocity.range_bearing") if "divided twice" in item.name)
    _, H = twice.function(np.zeros(3), np.array([3.0, 4.0]))
    np.testing.assert_allclose(H[1, :2], (-0.12, -0.16))


def test_mistakes_in_two_outputs_are_both_named():
    """Points that are not scaled and weights that are not halved give both names."""

    def both(*args):
        return unscented_points.not_scaled(*args)[0], unscented_points.weights_not_halved(*args)[1]

    assert found("ukf.sigma_points", both) == [
        ("root not scaled by n + kappa", ("points",)),
        ("weights not halved", ("weights",)),
    ]


def test_a_filter_of_tangents_is_told_that_it_moves_the_mean_alone():
    """The extended prediction in place of the points is named by its mean; its covariance has no name."""

    def tangents(mean, cov, u, M, dt, _kappa):
        return velocity_ekf.predict(mean, cov, u, M, dt)

    first, second = found("ukf.predict", tangents)
    assert first == ("mean moved alone", ("mean",))
    assert second[1] == ("cov",)


def test_vector_sums_with_wrapped_residuals_are_recognised():
    """Who averages by vectors and takes residuals from that mean is told so, though the covariance differs a little."""
    (item,) = (item for item in of_stage("ukf.correct") if "vectors" in item.name)

    def own(mean, cov, z, landmarks, Q, kappa):
        after, Sigma = item.function(mean, cov, z, landmarks, Q, kappa)
        return after, Sigma * (1 + 1e-9)

    assert found("ukf.correct", own) == [("bearings averaged as vectors", ("mean",))]
