"""Wrong versions of the line fit, and the diagnosis that names them."""

from __future__ import annotations

import numpy as np
import pytest

from autograder.check import run_stage
from autograder.checks import EXPRESSIONS, STAGES
from autograder.diagnose import ARGUMENTS, diagnose
from autograder.misconceptions import leaning_wall, line_fit, line_jacobians, line_parameters, of_stage
from roboloc_reference.extraction import fit_line

COURSE = "a course"
ALL_STAGES = STAGES | {name: expression.stage() for name, expression in EXPRESSIONS.items()}
OURS = (
    line_parameters.MISCONCEPTIONS
    + line_jacobians.MISCONCEPTIONS
    + line_fit.MISCONCEPTIONS
    + leaning_wall.MISCONCEPTIONS
)
PARAMETERS = "extraction.line_parameters"
JACOBIANS = "extraction.line_jacobians"
FIT = "extraction.fit_line"


def found(stage, function):
    """Diagnose a function: pairs of title and outputs."""
    outcome = run_stage(ALL_STAGES[stage], function, COURSE)
    return [(item.title, item.outputs) for item in diagnose(outcome, of_stage(stage))]


@pytest.mark.parametrize("item", OURS, ids=lambda item: f"{item.stage}-{item.name}")
def test_wrong_versions_return_numbers_of_the_right_shape(item):
    """A wrong version differs by its fault alone: right shapes, finite numbers."""
    stage = ALL_STAGES[item.stage]
    for call in run_stage(stage, stage.reference, COURSE).calls:
        returned = item.function(*(np.copy(a) if isinstance(a, np.ndarray) else a for a in call.args))
        right = stage.reference(*call.args)
        assert [np.shape(value) for value in returned] == [np.shape(value) for value in right]
        assert all(np.isfinite(value).all() for value in returned)


def test_every_stage_has_enough_wrong_versions():
    """At least four of each stage and three of each symbolic answer, all with words, no name twice."""
    assert all(len(of_stage(name)) >= 4 for name in (PARAMETERS, JACOBIANS, FIT))
    assert all(len(of_stage(name)) >= 3 for name in EXPRESSIONS if name.startswith("leaning_wall"))
    assert len({item.name for item in OURS}) == len(OURS)
    assert all(len(item.explanation) > 60 and len(item.hint) > 20 for item in OURS)


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

    outcome = run_stage(ALL_STAGES[FIT], odd, COURSE)
    assert not any(item.known for item in diagnose(outcome, of_stage(FIT)))
