"""Wrong versions of splitting and merging, and the diagnosis that names them."""

from __future__ import annotations

import numpy as np
from diagnosis import found, observed

from autograder.checks import STAGES
from autograder.diagnose import ARGUMENTS
from autograder.misconceptions import line_segments, line_splitting

SPLIT, MERGE = "extraction.split", "extraction.merge"
SEGMENTS, EXTRACT = "extraction.segments", "extraction.extract_lines"


def test_a_right_function_has_no_diagnosis():
    """Nothing is said about functions that pass, in whatever turn the angles are."""

    def turned(*args):
        alpha, *rest = STAGES[EXTRACT].reference(*args)
        return alpha + 4 * np.pi, *rest

    assert found(EXTRACT, turned) == []
    assert found(SPLIT, STAGES[SPLIT].reference) == []


def test_two_mistakes_in_two_outputs_are_both_named():
    """A run too many and ends that are not projected have both their names."""

    def two(theta, rho, ranges, lines, params):
        kept, _ = line_segments.more_points(theta, rho, ranges, lines, params)
        return kept, line_segments.not_projected(theta, rho, ranges, lines, params)[1]

    assert found(SEGMENTS, two) == [
        ("one point more than needed", ("ranges",)),
        ("ends as they were seen", ("ends",)),
    ]


def test_a_mistake_is_named_whatever_the_number_of_runs():
    """Runs that come back in another number than the right ones are recognised, and a changed argument beside them."""

    def twice(theta, rho, lines, params):
        runs = line_splitting.cut_once(theta, rho, lines, params)
        rho *= 2
        return runs

    assert found(SPLIT, twice) == [
        ("cut once", ("ranges",)),
        ("ranges overwritten by points", (ARGUMENTS,)),
    ]


def test_no_name_for_what_only_looks_alike():
    """Runs that are off in a way that nobody thought of are given no known name, and no number that is none."""

    def odd(*args):
        runs = np.array(STAGES[SPLIT].reference(*args))
        return np.vstack([runs, runs[-1:]])

    assert not [text for text in observed(SPLIT, odd) if "nan" in text]
