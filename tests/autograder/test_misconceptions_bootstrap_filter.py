"""Wrong versions of the bootstrap filter, and the diagnosis that names them."""

from __future__ import annotations

import numpy as np
from diagnosis import found

from autograder.diagnose import ARGUMENTS
from autograder.misconceptions import resampling
from roboloc_reference.odometry import bearing_likelihood, bootstrap_step, sample_motion
from roboloc_reference.resampling import systematic_resample

MOTION, BEARING = "odometry.sample_motion", "odometry.bearing_likelihood"
RESAMPLE, STEP = "resampling.systematic_resample", "odometry.bootstrap_step"


def test_right_functions_have_no_diagnosis():
    """Nothing is said about functions that pass."""
    for stage, function in (
        (MOTION, sample_motion), (BEARING, bearing_likelihood), (RESAMPLE, systematic_resample), (STEP, bootstrap_step)
    ):  # fmt: skip
        assert found(stage, function) == []


def test_audit_f11_copies_in_place():
    """ERRATA F11: with the weights .5, .3, .2 and the offset .1 the list that is copied into gives x1 x1 x1."""
    ws = np.array([0.5, 0.3, 0.2])
    assert resampling.overwritten(ws, 0.1).tolist() == [0, 0, 0]
    assert systematic_resample(ws, 0.1).tolist() == [0, 0, 1]


def test_audit_f10_the_last_two_copies():
    """ERRATA F10: the printed weights give 1 1 3 6 6 7 7 8 9 9, in every version that is right about one end."""
    ws = np.array([0.1775, 0.0080, 0.0696, 0.0116, 0.0244, 0.2070, 0.1747, 0.0797, 0.2389, 0.0087])
    expected = [1, 1, 3, 6, 6, 7, 7, 8, 9, 9]
    assert (
        (systematic_resample(ws, 0.0097) + 1).tolist() == expected == resampling.from_one(ws, 0.0097).tolist()
    )
    assert resampling.one_step_a_tooth(ws, 0.0097).tolist() != systematic_resample(ws, 0.0097).tolist()


def test_a_wrong_spread_is_named_whatever_the_order_of_the_draws():
    """A deviation that is squared is recognised by the moments, drawn control by control."""

    def control_by_control(xs, odometry, alphas, rng):
        one, way, two = np.abs(odometry)
        spread = alphas[[0, 2, 0]] * [one, way, two] + alphas[[1, 3, 1]] * [way, one + two, way]
        turn, trans, back = (rng.normal(m, s**2, len(xs)) for m, s in zip(odometry, spread, strict=True))
        after = xs[:, 0] + 1j * xs[:, 1] + trans * np.exp(1j * (xs[:, 2] + turn))
        return np.column_stack([after.real, after.imag, xs[:, 2] + turn + back])

    assert found(MOTION, control_by_control) == [("spread squared", ("spread",))]


def test_two_mistakes_in_one_step_are_both_named():
    """Weights that are kept and earlier weights left out are about two outputs."""

    def both(xs, ws, *rest):
        right = bootstrap_step(xs, np.ones(len(ws)), *rest)[0]
        return right, np.ones(len(ws))

    assert found(STEP, both) == [("earlier weights left out", ("share",)), ("weights of 1", ("ws",))]


def test_an_argument_that_is_written_to_is_named_beside_a_mistake():
    """Weights that are normalised in place, by a comb of length 1: two names."""

    def two(ws, offset):
        found_ = resampling.ruler_of_length_one(ws, offset)
        ws *= len(ws) / ws.sum()
        return found_

    assert found(RESAMPLE, two) == [
        ("sum of the weights taken for 1", ("ancestors",)),
        ("weights normalised in place", (ARGUMENTS,)),
    ]
