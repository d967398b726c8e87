"""The public checks of Monte Carlo localization: what they accept, and how they say what is wrong."""

import importlib.util
from pathlib import Path

import pytest

from autograder.misconceptions import of_stage
from roboloc.checks import check, cloud
from roboloc_reference import mcl

pytestmark = pytest.mark.filterwarnings("ignore:no particle:RuntimeWarning")
STAGES = {
    "transition_model": cloud.TRANSITION,
    "compute_predicted_measurements": cloud.PREDICTED,
    "compute_innovations": cloud.INNOVATIONS,
    "measurement_weights": cloud.WEIGHTS,
}
ALTERNATIVES = Path(__file__).resolve().parents[1] / "autograder" / "alternatives" / "monte_carlo"


def alternative(name, stage):
    """Load another right way to write a stage."""
    spec = importlib.util.spec_from_file_location(f"public_{name}", ALTERNATIVES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return getattr(module, stage)


@pytest.mark.parametrize("stage", STAGES)
def test_correct_functions_pass(stage):
    """Every correct way passes: the reference, loops, complex numbers, matrices."""
    functions = [getattr(mcl, stage)]
    functions += [alternative(f"mcl_{name}", stage) for name in ("complex", "loops", "matrices")]
    for function in functions:
        report = check(function, stage=f"mcl.{stage}")
        assert report, str(report)


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


@pytest.mark.parametrize("stage", STAGES)
def test_each_mistake_is_found(stage):
    """Every wrong version fails the check that is about it, and returns something usable."""
    for wrong in of_stage(f"mcl.{stage}"):
        report = check(wrong.function, stage=f"mcl.{stage}")
        failed = [item.name for item in report.items if not item.passed]
        assert FINDINGS[wrong.name] in failed, wrong.name
        assert report.items[0].passed, wrong.name


def test_a_cloud_without_a_word_is_told_to_warn():
    """Equal weights for an impossible cloud are not enough: the caller must hear of it."""
    silent = alternative("mcl_loops", "measurement_weights")
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

    report = check(stub, stage=f"mcl.{stage}")
    assert "not written yet" in report.items[0].message
    assert [item.passed for item in report.items[1:]] == [None] * (len(STAGES[stage]) - 1)
