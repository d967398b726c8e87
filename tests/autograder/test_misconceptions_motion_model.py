"""Wrong versions of the motion model, and the diagnosis that names them."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from diagnosis import found, observed

from autograder.diagnose import ARGUMENTS
from autograder.misconceptions import motion_model as wrong
from roboloc_reference.gaussian import transition_update
from roboloc_reference.motion import compute_dynamics


def handout_switch():
    """Load the handout's solution, whose numbers at small omega are not the reference's."""
    path = Path(__file__).parent / "alternatives" / "motion_model" / "handout_switch.py"
    spec = importlib.util.spec_from_file_location("handout_switch", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.compute_dynamics


def test_printed_column_is_the_faulty_one():
    """For v = 1.5, omega = 0.7, theta = 0.4 and half a second it is the column that ERRATA R1 proves wrong."""
    args = (np.array([0.0, 0.0, 0.4]), np.array([1.5, 0.7]), 0.5)
    assert wrong.printed_velocity_column(*args)[2][:, 1].round(4).tolist() == [-0.5964, -0.3865, 0.5]
    assert compute_dynamics(*args)[2][:, 1].round(4).tolist() == [-0.1106, 0.1506, 0.5]


def test_a_right_function_has_no_diagnosis():
    """Nothing is said about functions that pass, however they are written."""
    assert found("motion.compute_dynamics", compute_dynamics) == []
    assert found("motion.compute_dynamics", handout_switch()) == []


def test_a_mistake_is_recognised_in_another_way_of_writing():
    """A transposed Gx is named in the handout's solution, though its numbers at small omega are not ours."""
    right = handout_switch()

    def transposed(*args):
        g, Gx, Gu = right(*args)
        return g.tolist(), Gx.T.tolist(), Gu.tolist()

    assert found("motion.compute_dynamics", transposed) == [("Gx transposed", ("Gx",))]


def test_two_mistakes_in_two_outputs_are_both_named():
    """A transposed Gx beside the printed column of Gu gives both names, each with its output."""

    def both(*args):
        g, Gx, Gu = wrong.printed_velocity_column(*args)
        return g, Gx.T, Gu

    assert found("motion.compute_dynamics", both) == [
        ("Gx transposed", ("Gx",)),
        ("derivative of 1 / omega alone, without V", ("Gu",)),
    ]


def test_a_mistake_and_a_changed_argument_are_both_named():
    """A wrong covariance that is also written into the argument gives both names."""

    def both(g, Gx, Gu, Sigma, R, dt):
        Sigma[...] = Gx @ Sigma @ Gx.T + Gu @ R @ Gu.T
        return g, Sigma

    titles = found("gaussian.transition_update", both)
    assert titles == [("dt missing", ("Sigma",)), ("the caller's covariance overwritten", (ARGUMENTS,))]


def test_division_by_zero_is_recognised_as_an_exception_too():
    """Plain Python raises ZeroDivisionError where numpy returns NaN: the same mistake."""

    def plain(xvec, u, dt):
        1 / float(u[1])
        return wrong.MISCONCEPTIONS[0].function(xvec, u, dt)

    assert [title for title, _ in found("motion.compute_dynamics", plain)] == ["division by zero"]


def test_no_name_for_what_only_looks_alike():
    """A function that is right but for an unknown fault at one place is not given a known mistake's name."""

    def odd(*args):
        g, Gx, Gu = compute_dynamics(*args)
        if args[1][0] < 0:
            Gu[:2, 1] *= 1.5
        return g, Gx, Gu

    assert observed("motion.compute_dynamics", odd) == [
        "In Gu, only entries [0, 1] (x by omega), [1, 1] (y by omega) of 6 are off; the others are always right."
    ]


def change(index, how):
    """Make compute_dynamics with one output changed."""

    def function(*args):
        outputs = list(compute_dynamics(*args))
        outputs[index] = how(outputs[index], *args)
        return tuple(outputs)

    return function


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (change(1, lambda Gx, *_: Gx * np.array([[1, 1, -1], [1, 1, 1], [1, 1, 1]])), "the sign is wrong"),
        (change(2, lambda Gu, *_: Gu * [1, 2]), "off by the same factor everywhere, about 2"),
        (change(2, lambda Gu, _x, _u, dt: Gu * [1, dt]), "a factor dt too much"),
        (change(2, lambda Gu, *_: Gu * [0, 1]), "always 0"),
        (change(0, lambda g, *_: g.astype(np.float32)), "close, but not to rounding"),
        (change(2, lambda Gu, *_: Gu * (1 + 1e-7)), "close, but not to rounding"),
    ],
    ids=["sign", "factor", "dt", "zero", "float32", "difference"],
)
def test_an_unknown_mistake_is_located(function, words):
    """Without a known mistake the report says which entries are off, and how."""
    (sentence,) = observed("motion.compute_dynamics", function)
    assert words in sentence


def test_an_asymmetric_covariance_is_seen():
    """A covariance that is not symmetric is told to be none, in whatever sizes it came."""

    def function(*args):
        x, Sigma = transition_update(*args)
        return x, Sigma + np.triu(Sigma, 1)

    assert observed("gaussian.transition_update", function) == [
        "Sigma is not symmetric, and a covariance is."
    ]


def test_too_few_calls_say_nothing():
    """A function that is not written or always raises gets no diagnosis."""
    assert found("motion.compute_dynamics", lambda *_: 1 / None) == []
