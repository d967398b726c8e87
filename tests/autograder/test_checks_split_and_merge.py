"""The hidden checks of splitting and merging: what they catch, what they let pass, and that nothing is nearly a tie."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from matrix import hold_matrix

from autograder.check import Recorder, run_stage
from autograder.checks import STAGES
from autograder.checks.scan_scenes import clear, decided, misfit, table
from autograder.grading import grade, grade_expression
from roboloc_reference import extraction

SECRETS = [f"course-{number}" for number in range(3)]
SPLIT, MERGE = "extraction.split", "extraction.merge"
SEGMENTS, EXTRACT = "extraction.segments", "extraction.extract_lines"
ALL = (SPLIT, MERGE, SEGMENTS, EXTRACT)
TILT, FAR = "wall_with_a_step.tilt", "wall_with_a_step.far"

# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    SPLIT: {
        "cut at the farthest point": ({1, 2, 5, 6, 7}, 6),
        "cut in halves": ({1, 2, 5, 6, 7}, 6),
        "misfit of the first part alone": ({1, 2, 5, 6, 7}, 6),
        "gaps not looked for": ({3, 4}, 14),
        "gap as a difference of ranges": ({3}, 16),
        "gap one beam early": ({3, 4}, 14),
        "cut once": ({2}, 16),
        "mean distance in the place of the largest": ({2, 5}, 14),
        "last beam for last beam + 1": (set(range(1, 8)), 0),
        "ranges overwritten by points": ({6}, 18),
    },
    MERGE: {
        "joined from the left": ({5}, 16),
        "joined over a gap": ({3}, 17),
        "joined over beams left out": ({4}, 18),
        "lines compared by their numbers": ({1, 2, 3, 4, 6, 7}, 4),
        "one pair joined": ({1, 2}, 12),
        "mean distance of the joint run": ({2, 5}, 12),
        "the caller's runs overwritten": ({6}, 18),
    },
    SEGMENTS: {
        "one point more than needed": ({3}, 16),
        "length not asked for": ({4, 5}, 15),
        "points or length": ({3, 4, 5}, 11),
        "ends as they were seen": ({1, 4}, 11),
        "moved away from the line": ({1, 4}, 11),
        "end of the next run": ({1, 4}, 11),
        "the caller's runs shortened": ({6}, 18),
    },
    EXTRACT: {
        "never merged": ({1, 2, 3, 4}, 4),
        "dropped before merging": ({4}, 15),
        "split alone": ({1, 2, 3, 4}, 4),
        "beams counted among the seen": ({3}, 17),
        "lost beams behind the wall": ({3}, 17),
        "cut at every lost beam": ({2, 3, 6}, 12),
        "longest line first": ({1, 2, 3, 4}, 4),
        "lost beams filled in place": ({6}, 18),
    },
    TILT: {
        "regression through the step": ({1}, 0),
        "double angle of the step": ({1}, 0),
        "from end to end": ({1}, 0),
    },
    FAR: {
        "half the step": ({1}, 0),
        "distance of the ends": ({1}, 0),
        "the whole step": ({1}, 0),
    },
}


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix(name):
    """Every wrong version fails just its checks and is named, every correct one passes, whatever the secret."""
    correct = {"pieces_eigenvalues", "pieces_recursive"} if name in ALL else set()
    hold_matrix(EXPECTED[name], correct, name, SECRETS)


def recorded(stage):
    """Return the calls that the checks of a stage make."""
    recorder = Recorder(STAGES[stage].reference)
    run_stage(STAGES[stage], recorder, SECRETS[0])
    return recorder.calls


def test_nothing_is_nearly_a_tie():
    """No cut, gap or limit of any hidden scan is decided by rounding."""
    for call in recorded(SPLIT):
        theta, rho, _, params = call.args
        assert clear(theta, rho, params)
    for call in recorded(MERGE):
        theta, rho, ranges, _, params = call.args
        assert decided(theta, rho, ranges.tolist(), params)
    for call in recorded(EXTRACT):
        theta, rho, _, params = call.args
        seen = np.isfinite(rho)
        assert clear(theta[seen], rho[seen], params)


def test_the_table_holds_the_fits_of_the_reference():
    """Each entry of the table is the line that fit_line finds, and the misfit is that of this line."""
    theta, rho, lines, _ = recorded(SPLIT)[0].args
    np.testing.assert_array_equal(lines, table(theta, rho))
    for i, j in ((0, 2), (3, 9), (0, theta.size), (5, 8)):
        alpha, r, _ = extraction.fit_line(theta[i:j], rho[i:j], 0.0, 0.0)
        np.testing.assert_allclose(lines[i, j], (alpha, r), atol=1e-10)
        off = rho[i:j] * np.cos(theta[i:j] - alpha) - r
        assert misfit(theta, rho, i, j) == pytest.approx(off @ off, abs=1e-12)


def test_sharpened_corners_change_nothing():
    """On the hidden scans the reference, which sharpens corners, finds the lines, ends and beams of the checks."""
    for call in recorded(EXTRACT):
        theta, rho, _, params = call.args
        alpha, r, _, ends, ranges = extraction.extract_lines(theta, rho, params, 0.0, 1e-4)
        for right, got in zip(call.returned, (alpha, r, ends, ranges), strict=True):
            np.testing.assert_allclose(right, got, atol=1e-9)


def test_hidden_inputs_cover_what_the_notebook_promises():
    """One run and many, gaps, single beams, lost beams, empty results, pieces too small."""
    counts = {len(call.returned) for call in recorded(SPLIT)}
    assert counts >= {1, 2, 3}
    assert any((np.ptp(call.returned, axis=1) == 1).any() for call in recorded(SPLIT))
    assert any(np.ptp(call.returned[-1]) == 1 for call in recorded(SPLIT))
    assert any((call.args[2][1:, 0] > call.args[2][:-1, 1]).any() for call in recorded(MERGE))
    assert {len(call.returned[0]) for call in recorded(SEGMENTS)} >= {0, 3}
    lost = [int(np.isnan(call.args[1]).sum()) for call in recorded(EXTRACT)]
    assert min(lost) == 0
    assert {0, 2, 3, 4} <= {len(call.returned[0]) for call in recorded(EXTRACT)}


def test_distances_to_one_side_are_not_enough():
    """Some runs stay apart only because of points on one side of their line, some because of those on the other."""
    for stage in (SPLIT, MERGE):
        found = set()
        for call in recorded(stage):
            theta, rho, *_, lines, params = call.args
            runs = [[0, theta.size]] if stage == SPLIT else call.returned
            pairs = runs if stage == SPLIT else [(a[0], b[1]) for a, b in pairwise(runs)]
            for i, j in pairs:
                off = rho[i:j] * np.cos(theta[i:j] - lines[i, j, 0]) - lines[i, j, 1]
                beyond = np.array([off.max(), -off.min()]) > params["line_point_distance"]
                found |= {int(beyond.argmax())} if beyond.sum() == 1 else set()
        assert found == {0, 1}, stage


def test_lists_of_whole_numbers_as_floats_are_accepted(published):
    """Runs may be lists of pairs, tuples, or floats."""
    right = STAGES[SPLIT].reference
    assert grade(SPLIT, lambda *args: [tuple(map(float, run)) for run in right(*args)], 7) == 7


L, s = sp.symbols("L s", positive=True)


def answers():
    """Derive the answers by another route than the notebook: an eigenvector of the scatter."""
    a, b, c = L**2 / 3, s * L / 4, s**2 / 4
    along = (a + c + sp.sqrt((a - c) ** 2 + 4 * b**2)) / 2 - c
    size = sp.sqrt(along**2 + b**2)
    return {TILT: sp.atan(b / along), FAR: s * along / size / 2}


@pytest.mark.parametrize(("name", "right"), answers().items())
def test_every_way_of_writing_an_expression_is_accepted(name, right, published):
    """By an eigenvector, with roots for sines: the points are the same; other symbols or NaN score nothing."""
    assert grade_expression(name, right, 2) == 2
    for wrong in (right * sp.nan, right.subs(s, sp.Symbol("h")), sp.Matrix([[right, 1]]), None):
        assert grade_expression(name, wrong, 2) == 0
