"""Wrong versions of the line fit, and the diagnosis that names them."""

from __future__ import annotations

import numpy as np
from diagnosis import found, observed

from autograder.diagnose import ARGUMENTS
from autograder.misconceptions import line_fit, line_jacobians, line_parameters
from roboloc_reference.extraction import fit_line

PARAMETERS = "extraction.line_parameters"
JACOBIANS = "extraction.line_jacobians"
FIT = "extraction.fit_line"


def test_a_right_function_has_no_diagnosis():
    """Nothing is said about functions that pass, under whatever name of a line."""

    def other_name(theta, rho):
        alpha, r, _ = fit_line(theta, rho, 0, 0)
        return alpha + 3 * np.pi, -r

    assert found(PARAMETERS, other_name) == []
    assert found(FIT, fit_line) == []


def test_a_mistake_is_recognised_under_another_name():
    """The direction along the wall is recognised whichever of its two ends is returned."""

    def other_end(*args):
        alpha, r = line_parameters.along_the_wall(*args)
        return alpha - np.pi, -r

    assert found(PARAMETERS, other_end) == [("direction along the wall", ("alpha", "r"))]


def test_two_mistakes_in_two_outputs_are_both_named():
    """An absolute value of r and exchanged variances give both names, an overwritten argument a third."""

    def three(theta, rho, var_theta, var_rho):
        alpha, r, _ = line_fit.absolute_distance(theta, rho, var_theta, var_rho)
        C = line_fit.variances_exchanged(theta, rho, var_theta, var_rho)[2]
        theta.sort()
        return alpha, r, C

    assert found(FIT, three) == [
        ("fit with the bare absolute value", ("alpha",)),
        ("variances exchanged", ("C",)),
        ("the caller's bearings sorted", (ARGUMENTS,)),
    ]


def test_a_mistake_in_one_of_two_derivatives_is_named_for_it():
    """The angle of incidence is about the ranges, the full length across about the bearings; both have their name."""

    def both(*args):
        J_theta, _ = line_jacobians.bearing_by_the_range(*args)
        return J_theta, line_jacobians.incidence_ignored(*args)[1]

    assert found(JACOBIANS, both) == [
        ("bearing errors across in full", ("J_theta",)),
        ("angle of incidence ignored", ("J_rho",)),
    ]


def test_no_name_for_what_only_looks_alike():
    """A function that is right but for an unknown fault is not given a known mistake's name."""

    def odd(*args):
        alpha, r, C = fit_line(*args)
        return alpha, r, C * [[1, 1.2], [1.2, 1]]

    observed(FIT, odd)  # asserts that nothing known is seen
