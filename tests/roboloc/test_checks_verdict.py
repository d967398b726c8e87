"""The public checks of what judges filters: what they accept, and how they say what is wrong."""

import numpy as np
import pytest
from public import Public, words_in, writes

from autograder.checks import STAGES as GRADED
from roboloc.checks import verdict

STAGES = tuple(f"verdict.{name}" for name in ("rms_errors", "coverage", "mean_and_error", "paired_interval"))
# What each mistake must be told by, at least: the name of one check.
FINDINGS = {
    "error of the heading not wrapped": "headings across the cut, and of many turns",
    "mean of the distances": "distances worked by hand",
    "errors averaged before they are squared": "distances worked by hand",
    "position error per coordinate": "distances worked by hand",
    "root left out": "distances worked by hand",
    "spread about the mean error": "distances worked by hand",
    "bound of a single number": "bounds from a table",
    "distance compared with a squared bound": "bounds from a table",
    "correlations left out": "along and across a narrow ellipse",
    "each number by itself": "along and across a narrow ellipse",
    "one covariance for all runs": "every run by its own claim",
    "instants taken for independent": "repeated instants add no precision",
    "spread of the runs for the precision of their mean": "two runs worked by hand",
    "mean of the runs taken for known": "two runs worked by hand",
    "pairs torn apart": "a filter that is worse by the same in every run",
    "second less first": "a filter that is worse by the same in every run",
    "all that is left out on either side": "five draws worked by hand",
    "quantiles of runs instead of means": "one hard run in every draw",
    "intervals subtracted end by end": "five draws worked by hand",
    "medians of the draws": "one hard run in every draw",
}
PUBLIC = Public(STAGES, FINDINGS)


@pytest.mark.parametrize("stage", STAGES)
def test_right_functions_pass_and_wrong_ones_are_told(stage):
    """Correct ways pass, every known mistake fails a check, which has a message, and no line is right by default."""
    PUBLIC.hold(stage, lambda *_: None, writes(GRADED[stage].reference))


def test_no_answer_is_stored():
    """The checks know bounds from a table, and no quantile, no solve and no root of a count."""
    assert words_in("chi2 chdtri ppf solve inv( quantile std( var( sqrt(len", verdict) == []
    assert np.isclose(5.991, -2 * np.log(0.05), atol=1e-3)
