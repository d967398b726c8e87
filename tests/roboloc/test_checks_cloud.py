"""The public checks of Monte Carlo localization: what they accept, and how they say what is wrong."""

import pytest
from public import Public, writes

import kill_matrix
from autograder.checks import STAGES as GRADED
from autograder.misconceptions import of_stage
from roboloc.checks import STAGES as CHECKS
from roboloc.checks import check
from roboloc_reference import mcl

pytestmark = pytest.mark.filterwarnings("ignore:no particle:RuntimeWarning")
STAGES = tuple(
    f"mcl.{name}"
    for name in (
        "transition_model",
        "compute_predicted_measurements",
        "compute_innovations",
        "measurement_weights",
    )
)
# What each mistake must be told by, at least: the name of one check.
FINDINGS = {
    "straight step": "one step or two",
    "turn first, then drive": "one step or two",
    "one control for all": "each particle as if it were alone",
    "mean control for all": "each particle as if it were alone",
    "one formula for the whole cloud": "each particle as if it were alone",
    "headings wrapped": "headings keep their turn",
    "the caller's cloud overwritten": "leaves its arguments as they were",
    "scanner at the robot's centre": "a scanner that is not at the centre",
    "mounting not turned with the robot": "a scanner that is not at the centre",
    "distance left negative": "a line that was crossed",
    "absolute value alone": "a line that was crossed",
    "angles not wrapped": "each particle as if it were alone, and as scanners report",
    "heading added": "a wall ahead, a wall to the right",
    "axes exchanged by reshape": "a wall ahead, a wall to the right",
    "angles subtracted as numbers": "across the end of a turn",
    "expected minus seen": "each observation in its place",
    "radians and metres alike": "nearest by the covariance",
    "covariance not inverted": "nearest by the covariance",
    "one covariance for all observations": "each observation by its own covariance",
    "one association for the whole cloud": "each particle has a nearest line of its own",
    "angles first, then distances": "each observation in its place",
    "gated": "what is far is kept",
    "weights before forgotten": "the weights before",
    "likelihoods multiplied as they are": "likelihoods too small for a number",
    "likelihoods added": "two lines are two pieces of evidence",
    "half lost in the exponent": "one standard deviation",
    "mean over the observations": "two lines are two pieces of evidence",
    "weighed by the covariance itself": "one standard deviation",
    "correlation ignored": "correlated errors",
    "nobody left": "nobody can be right",
    "total not 1": "one standard deviation",
}
PUBLIC = Public(STAGES, FINDINGS)


@pytest.mark.parametrize("stage", STAGES)
def test_right_functions_pass_and_wrong_ones_are_told(stage):
    """Correct ways pass, every known mistake fails the check about it, and no line is right by default."""
    right = getattr(mcl, stage.removeprefix("mcl."))
    PUBLIC.hold(stage, writes(right), right=right)
    for wrong in of_stage(stage):
        assert wrong.name in FINDINGS
        assert check(wrong.function, stage=stage).items[0].passed, wrong.name  # it returns something usable


def test_a_cloud_without_a_word_is_told_to_warn():
    """Equal weights for an impossible cloud are not enough: the caller must hear of it."""
    silent = kill_matrix.alternatives(GRADED["mcl.measurement_weights"])["mcl_loops"]
    silent.__globals__["warnings"] = type("Silent", (), {"warn": staticmethod(lambda *_, **__: None)})
    report = check(silent, stage="mcl.measurement_weights")
    (failed,) = [item for item in report.items if not item.passed]
    assert failed.name == "nobody can be right"
    assert "warnings.warn" in failed.message


@pytest.mark.parametrize("stage", STAGES)
def test_what_is_not_written_is_said_to_be(stage):
    """A stub is told so, and nothing else is tried."""

    def stub(*_):
        raise NotImplementedError

    report = check(stub, stage=stage)
    assert "not written yet" in report.items[0].message
    assert [item.passed for item in report.items[1:]] == [None] * (len(CHECKS[stage]) - 1)
