"""The hidden checks of the bootstrap filter: what they catch, what they let pass, and how often they err."""

from __future__ import annotations

import numpy as np
import pytest
from matrix import hold_matrix

from autograder.check import Recorder, run_stage
from autograder.checks import STAGES, bootstrap_step, odometry, resampling
from autograder.grading import grade
from roboloc_reference.odometry import bearing_likelihood, sample_motion
from roboloc_reference.resampling import systematic_resample

SECRETS = [f"course-{number}" for number in range(3)]
MOTION, BEARING = "odometry.sample_motion", "odometry.bearing_likelihood"
RESAMPLE, STEP = "resampling.systematic_resample", "odometry.bootstrap_step"
SEVEN = set(range(1, 8))

# Hand-written: which checks (by number) a wrong version must fail, and its share of the points in twentieths.
EXPECTED = {
    MOTION: {
        "turns counted clockwise": ({1, 2, 8}, 11),
        "way without its error": ({3, 4, 5, 6}, 10),
        "turns that cancel": ({4}, 17),
        "turns and ways with their signs": ({3, 4, 5}, 12),
        "spread taken for a variance": ({3, 4, 5}, 12),
        "spread squared": ({3, 4, 5}, 12),
        "both turns before the way": ({1, 2, 3, 4, 5, 6, 7}, 2),
        "way along the old heading": ({1, 2, 3, 4, 5, 6, 7}, 2),
        "one error for all particles": ({2, 3, 4, 5, 6, 7}, 7),
        "one number for three errors": ({6}, 18),
        "heading without the first error": ({3, 4, 5, 6}, 10),
        "particles moved in place": ({8}, 18),
    },
    BEARING: {
        "innovation not wrapped": ({2, 3}, 12),
        "wrapped before the difference": ({2}, 15),
        "density without its factor": (SEVEN, 0),
        "sigma taken for the variance": (SEVEN, 0),
        "exponent without its half": (SEVEN, 0),
        "heading forgotten": (SEVEN, 0),
        "heading added": (SEVEN, 0),
        "seen from the landmark": (SEVEN, 0),
        "arctangent of x and y exchanged": (SEVEN, 0),
        "bearing by a quotient": (SEVEN, 0),
        "headings wrapped in place": ({6}, 18),
    },
    RESAMPLE: {
        "particles overwritten while copying": ({1, 2, 4, 5, 6}, 6),
        "comb that stands still": ({1, 2, 4, 5, 6}, 6),
        "one step for each tooth": ({1, 2, 3, 4, 5, 6}, 4),
        "particles counted from 1": ({1, 2, 3, 4, 5, 6, 7, 8}, 0),
        "sum of the weights taken for 1": ({2, 4}, 14),
        "run past the end": ({5, 6}, 17),
        "weight of 0 taken": ({4}, 18),
        "copies in the place of indices": ({1, 2, 3, 4, 5, 6, 7, 8}, 0),
        "offset divided once more": ({1, 2, 5, 6}, 8),
        "weights normalised in place": ({7}, 18),
        "weights sorted first": ({1, 2, 3, 4, 5, 6}, 4),
    },
    STEP: {
        "earlier weights left out": ({1, 2}, 13),
        "weighed before the motion": ({1, 2, 6}, 11),
        "particles from before copied": ({4, 5, 6, 7}, 11),
        "weights kept beside the copies": ({3}, 17),
        "weighed and not resampled": ({1, 2, 3, 6}, 8),
        "bearing not wrapped in the step": ({1, 2}, 13),
        "particles moved without error": ({5, 6, 7}, 14),
        "errors drawn after the weighing": ({6}, 18),
        "best particle alone": ({1, 2, 5, 6, 7}, 7),
        "weights of 1": ({3}, 17),
    },
}
CORRECT = {
    MOTION: {"loops", "matrices", "complex_plane"},
    BEARING: {"loops", "matrices", "complex_plane"},
    RESAMPLE: {"pointer", "search", "copies"},
    STEP: {"loops", "complex_plane"},
}


@pytest.mark.parametrize("name", EXPECTED)
def test_kill_matrix(name):
    """Every wrong version fails just its checks and is named, every correct one passes, whatever the secret."""
    hold_matrix(EXPECTED[name], CORRECT[name], name, SECRETS)


def rejections(makers, stage, runs):
    """Run the reference with other seeds: how many runs are rejected, and how near the nearest came."""
    rejected, nearest = 0, 0.0
    cases = [case for make in makers for case in make(np.random.default_rng(5))]
    for seed in range(runs):
        worst = 0.0
        for case in cases:
            args = (*case.args[:-1], np.random.default_rng([seed, 17]))
            found = stage.summary(args, stage.reference(*args))
            for value, right, allowed in zip(found, case.expected, case.tolerance, strict=True):
                worst = max(worst, float(np.max(np.abs(value - right) / allowed)))
        rejected += worst > 1
        nearest = max(nearest, worst)
    return rejected, nearest


@pytest.mark.parametrize(
    ("makers", "stage", "runs"),
    [
        ((odometry.either_side,), odometry.MOTION, 1000),
        ((odometry.along,), odometry.MOTION, 1000),
        ((bootstrap_step.blind, bootstrap_step.star), bootstrap_step.STEP, 1000),
        ((bootstrap_step.ahead,), bootstrap_step.STEP, 50),
    ],
    ids=["either side", "along", "blind and star", "without error"],
)
def test_correct_samples_are_not_rejected(makers, stage, runs):
    """A thousand runs of the reference with other seeds: none is rejected, and none comes near."""
    rejected, nearest = rejections(makers, stage, runs)
    assert rejected == 0
    assert nearest < 0.8 or runs < 1000


def test_headings_may_be_in_any_turn(published):
    """Wrapped headings, or headings some turns on, get all points."""

    def turned(*args):
        xs = sample_motion(*args)
        xs[:, 2] = np.angle(np.exp(1j * xs[:, 2])) + 6 * np.pi
        return xs

    assert grade(MOTION, turned, 7) == 7


def test_answers_of_the_comb_are_clear():
    """No tooth is near a mark, the ends aside; the two ends are there, and so are single precision and other sums."""
    recorder = Recorder(systematic_resample)
    run_stage(STAGES[RESAMPLE], recorder, "s")
    inputs = [call.args for call in recorder.calls]
    assert all(resampling.clear(ws, offset, 1e-6) for ws, offset in inputs if offset)
    assert {ws.dtype for ws, _ in inputs} == {np.dtype(np.float64), np.dtype(np.float32)}
    assert any(offset == 0 and ws[0] == 0 for ws, offset in inputs)
    assert any(offset == np.nextafter(1 / ws.size, 0) for ws, offset in inputs)
    assert min(ws.sum() for ws, _ in inputs) < 0.1
    assert max(ws.sum() for ws, _ in inputs) > 100


def test_truth_of_the_star_is_the_weighted_mean():
    """The moments that a far landmark leaves are those of a sum over a fine grid of errors."""
    for case in bootstrap_step.star(np.random.default_rng(3)):
        xs, _, turns, alphas, landmark, bearing, sigma, _ = case.args
        spread = alphas[0] * turns[2]
        errors = np.linspace(-8, 8, 4001) * spread
        after = np.repeat(bootstrap_step.moved(xs[:1], turns), errors.size, axis=0)
        after[:, 2] += errors
        ws = np.exp(-0.5 * (errors / spread) ** 2) * bearing_likelihood(after, landmark, bearing, sigma)
        mean = np.average(errors, weights=ws)
        assert mean == pytest.approx(case.expected[1][2] - turns[2], abs=1e-6)
        assert np.average((errors - mean) ** 2, weights=ws) ** 0.5 == pytest.approx(
            case.expected[2][2], abs=1e-6
        )


@pytest.mark.parametrize("stage", [MOTION, STEP])
def test_what_is_handed_back_as_it_came_scores_nothing(stage, published):
    """Particles that never moved, and weights that never changed, are no answer in any case."""
    assert grade(stage, lambda xs, *rest: xs if stage == MOTION else (xs, rest[0]), 10) == 0


def test_draws_from_elsewhere_are_seen():
    """A generator of one's own costs the one check that asks for the given one."""
    own = np.random.default_rng(5)
    outcome = run_stage(STAGES[MOTION], lambda xs, u, alphas, _rng: sample_motion(xs, u, alphas, own), "s")
    assert [result.check.name for result in outcome.failed] == ["draws from rng alone"]
