"""The hidden checks of what judges filters: what they catch, what they let pass, which forms are equal."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from matrix import hold_matrix
from scipy.stats import chi2

from autograder.check import Recorder, run_stage
from autograder.checks import STAGES
from autograder.grading import grade, grade_expression
from roboloc_reference import verdict

SECRETS = [f"course-{number}" for number in range(3)]
RMS, COVERAGE = "verdict.rms_errors", "verdict.coverage"
MEAN, PAIRED = "verdict.mean_and_error", "verdict.paired_interval"
FOUR, SIX = set(range(1, 5)), set(range(1, 7))

# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    RMS: {
        "error of the heading not wrapped": ({3, 4}, 13),
        "mean of the distances": (SIX, 0),
        "errors averaged before they are squared": (SIX, 0),
        "position error per coordinate": ({1}, 15),
        "root left out": (SIX, 0),
        "spread about the mean error": (SIX, 0),
    },
    COVERAGE: {
        "bound of a single number": (FOUR, 0),
        "distance compared with a squared bound": (FOUR, 0),
        "correlations left out": (FOUR, 0),
        "each number by itself": (FOUR, 0),
        "bound from the other tail": (FOUR, 0),
        "one covariance for all runs": (FOUR, 0),
        "runs outside counted": (FOUR, 0),
    },
    MEAN: {
        "instants taken for independent": ({2, 3}, 7),
        "spread of the runs for the precision of their mean": ({2, 3}, 7),
        "mean of the runs taken for known": ({2, 3}, 7),
        "spread from instant to instant": ({2, 3}, 7),
        "divided by the count and not by its root": ({2, 3}, 7),
    },
    PAIRED: {
        "pairs torn apart": (FOUR, 0),
        "second less first": (FOUR, 0),
        "all that is left out on either side": (FOUR, 0),
        "quantiles of runs instead of means": (FOUR, 0),
        "intervals subtracted end by end": (FOUR, 0),
        "medians of the draws": (FOUR, 0),
    },
    "claims.E_nees": {
        "bias left out of the mean square": ({1}, 0),
        "bias not squared": ({1}, 0),
        "expected square of an honest filter": ({1}, 0),
        "claim divided by truth": ({1}, 0),
        "correlation of the errors counted": ({1}, 0),
    },
    "claims.p_inside": {
        "factor of the ellipse not squared": ({1}, 0),
        "ellipse too large instead of too small": ({1}, 0),
        "probability in proportion to the area": ({1}, 0),
        "probability of the outside": ({1}, 0),
    },
    "claims.var_difference": {
        "pairs taken for independent": ({1}, 0),
        "variance of the sum": ({1}, 0),
        "one run alone": ({1}, 0),
        "deviation for variance": ({1}, 0),
    },
}


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix(name):
    """Every wrong version fails just its checks and is named, every correct one passes, whatever the secret."""
    correct = {"verdict_loops", "verdict_tensors"} if name in STAGES else set()
    hold_matrix(EXPECTED[name], correct, name, SECRETS)


def recorded(stage):
    """Return the calls that the checks of a stage make."""
    recorder = Recorder(STAGES[stage].reference)
    run_stage(STAGES[stage], recorder, "s")
    return recorder.calls


def test_no_square_is_near_the_bound():
    """Rounding moves no run across: every square is off its bound by a fiftieth at least, and both sides occur."""
    for call in recorded(COVERAGE):
        errors, covs, probability = call.args
        squares = np.einsum("rni,rnij,rnj->rn", errors, np.linalg.inv(covs), errors)
        ratio = squares / chi2.ppf(probability, errors.shape[-1])
        assert np.abs(ratio - 1).min() > 0.02
        assert ratio.min() < 1 < ratio.max()
    assert {call.args[0].shape[-1] for call in recorded(COVERAGE)} == {1, 2, 3}


def test_the_edge_of_the_region_may_count_or_not(published):
    """Who counts squares below the bound alone gets all points."""

    def open_region(errors, covs, probability):
        squares = np.einsum("rni,rnij,rnj->rn", errors, np.linalg.inv(covs), errors)
        return (squares < chi2.ppf(probability, errors.shape[-1])).mean(axis=0)

    assert grade(COVERAGE, open_region, 5) == 5


def test_lists_are_results(published):
    """Lists are as good as arrays, and a list of two as good as a tuple."""
    assert grade(RMS, lambda *args: [part.tolist() for part in verdict.rms_errors(*args)], 5) == 5
    assert grade(PAIRED, lambda *args: list(verdict.paired_interval(*args)), 5) == 5


def test_hidden_inputs_cover_what_the_notebook_promises():
    """Headings across the cut and of many turns; two runs, and one instant; hard runs are hard for both filters."""
    poses, truth = (np.concatenate([call.args[i][..., 2].ravel() for call in recorded(RMS)]) for i in (0, 1))
    apart = np.abs(poses - truth)
    assert ((apart > 4) & (apart < 2 * np.pi)).any()
    assert (apart > 4 * np.pi).any()
    shapes = {call.args[0].shape for call in recorded(MEAN)}
    assert 2 in {runs for runs, _ in shapes}
    assert 1 in {instants for _, instants in shapes}
    for call in recorded(PAIRED):
        a, b, picks, _ = call.args
        assert np.corrcoef(a, b)[0, 1] > 0.5
        assert picks.shape[1] == a.size


a, c, s, t, k, p, s_1, s_2, R = sp.symbols("a c s t k p s_1 s_2 R", positive=True)
b_x, b_y, rho = sp.symbols("b_x b_y rho", real=True)


def answers():
    """Derive the answers by another route than the notebook: traces, an integral over rings, a quadratic form."""
    truth = sp.Matrix([[a**2, rho * a * c], [rho * a * c, c**2]])
    bias, claim = sp.Matrix([b_x, b_y]), sp.diag(s**2, t**2)
    q = sp.Symbol("q", positive=True)
    bound = -2 * sp.log(1 - p)
    ring = sp.integrate(sp.exp(-q / (2 * k**2)) / (2 * k**2), (q, 0, bound))
    both, sign = sp.Matrix([[s_1**2, rho * s_1 * s_2], [rho * s_1 * s_2, s_2**2]]), sp.Matrix([1, -1])
    return {
        "E_nees": (claim.inv() * (truth + bias * bias.T)).trace(),
        "p_inside": ring,
        "var_difference": (sign.T * both * sign)[0] / R,
    }


ANSWERS = answers()


@pytest.mark.parametrize("answer", ANSWERS)
def test_every_way_of_writing_an_expression_is_accepted(answer, published):
    """By traces and integrals, expanded or not: the points are the same."""
    for form in (ANSWERS[answer], sp.expand(ANSWERS[answer])):
        assert grade_expression(f"claims.{answer}", form, 2) == 2
