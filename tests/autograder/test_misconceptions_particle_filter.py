"""Wrong versions of the particle filter, and the diagnosis that names them."""

from __future__ import annotations

import numpy as np
from diagnosis import found

from autograder.diagnose import ARGUMENTS
from autograder.misconceptions import velocity_weights
from roboloc_reference import particle, velocity


def test_right_functions_have_no_diagnosis():
    """Nothing is said about functions that pass."""
    for name in ("predict", "correct", "effective_sample_size"):
        assert found(f"particle.{name}", getattr(particle, name)) == []


def test_a_wrong_spread_is_named_whatever_the_order_of_the_draws():
    """Variances drawn as deviations are recognised by the moments, drawn control by control."""

    def control_by_control(xs, u, alphas, dt, rng):
        M = velocity.noise(u, alphas)
        us = [rng.normal(mean, variance, len(xs)) for mean, variance in zip(u, np.diag(M), strict=True)]
        return velocity.motions(xs, np.transpose(us), dt)

    assert found("particle.predict", control_by_control) == [("variances drawn as deviations", ("spread",))]


def test_an_argument_that_is_written_to_is_named_beside_a_mistake():
    """Weights written over, of an exponent without its half: two names."""

    def two(xs, ws, *rest):
        once = particle.correct(xs, ws, *rest)
        with np.errstate(divide="ignore", invalid="ignore"):
            likely = np.where(ws > 0, once**2 / ws, 0.0)
        ws[:] = likely / likely.sum()
        return ws

    assert found("particle.correct", two) == [
        ("half of the exponent missing", ("ws",)),
        ("weights overwritten", (ARGUMENTS,)),
    ]


def test_entropy_and_squares_agree_only_on_even_weights():
    """Another measure of the same thing is no rounding: 2.83 and 2.67 for one half and two quarters."""
    ws = np.array([0.5, 0.25, 0.25])
    assert round(velocity_weights.perplexity(ws), 2) == 2.83
    assert round(particle.effective_sample_size(ws), 2) == 2.67
