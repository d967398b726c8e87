"""Wrong versions of what judges a filter: errors over runs, coverage, a mean with its precision, a paired interval."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc.angles import wrap
from roboloc_reference.verdict import coverage, mean_and_error, paired_interval, rms_errors

_RMS, _COVERAGE = "verdict.rms_errors", "verdict.coverage"
_MEAN, _PAIRED = "verdict.mean_and_error", "verdict.paired_interval"


def _error(poses: np.ndarray, truth: np.ndarray) -> np.ndarray:
    error = poses - truth
    error[..., 2] = wrap(error[..., 2])
    return error


def heading_not_wrapped(poses: np.ndarray, truth: np.ndarray) -> tuple:
    """Subtract headings as numbers."""
    return rms_errors(poses, truth)[0], np.sqrt(np.mean((poses - truth)[..., 2] ** 2, axis=0))


def mean_distance(poses: np.ndarray, truth: np.ndarray) -> tuple:
    """Average the absolute errors."""
    error = _error(poses, truth)
    return np.hypot(error[..., 0], error[..., 1]).mean(axis=0), np.abs(error[..., 2]).mean(axis=0)


def of_the_mean(poses: np.ndarray, truth: np.ndarray) -> tuple:
    """Average the errors before they are squared."""
    mean = _error(poses, truth).mean(axis=0)
    return np.hypot(mean[:, 0], mean[:, 1]), np.abs(mean[:, 2])


def a_coordinate(poses: np.ndarray, truth: np.ndarray) -> tuple:
    """Average over both coordinates of the position too."""
    position, heading = rms_errors(poses, truth)
    return position / np.sqrt(2), heading


def no_root(poses: np.ndarray, truth: np.ndarray) -> tuple:
    """Leave out the root."""
    position, heading = rms_errors(poses, truth)
    return position**2, heading**2


def about_the_mean(poses: np.ndarray, truth: np.ndarray) -> tuple:
    """Take standard deviations over the runs."""
    spread = _error(poses, truth).std(axis=0)
    return np.hypot(spread[:, 0], spread[:, 1]), spread[:, 2]


def _bound(size: int, probability: float) -> float:
    from scipy.special import chdtri  # noqa: PLC0415  (goes into a student's cell with the function)

    return float(chdtri(size, 1 - probability))


def _inside(errors: np.ndarray, covs: np.ndarray, bound: float) -> np.ndarray:
    squares = np.sum(errors * np.linalg.solve(covs, errors[..., None])[..., 0], axis=-1)
    return np.mean(squares <= bound, axis=0)


def one_degree(errors: np.ndarray, covs: np.ndarray, probability: float) -> np.ndarray:
    """Take the bound of one number."""
    return _inside(errors, covs, _bound(1, probability))


def distance_not_squared(errors: np.ndarray, covs: np.ndarray, probability: float) -> np.ndarray:
    """Compare the distance with the bound of its square."""
    return _inside(errors, covs, _bound(errors.shape[-1], probability) ** 2)


def diagonal_alone(errors: np.ndarray, covs: np.ndarray, probability: float) -> np.ndarray:
    """Leave the correlations out."""
    return coverage(errors, covs * np.eye(errors.shape[-1]), probability)


def box(errors: np.ndarray, covs: np.ndarray, probability: float) -> np.ndarray:
    """Ask of each number by itself."""
    variances = np.diagonal(covs, axis1=-2, axis2=-1)
    return np.mean(np.all(errors**2 / variances <= _bound(1, probability), axis=-1), axis=0)


def other_tail(errors: np.ndarray, covs: np.ndarray, probability: float) -> np.ndarray:
    """Take the bound from the other tail."""
    return coverage(errors, covs, 1 - probability)


def averaged_covariance(errors: np.ndarray, covs: np.ndarray, probability: float) -> np.ndarray:
    """Judge every run by the mean covariance of all."""
    return coverage(errors, np.broadcast_to(covs.mean(axis=0), covs.shape), probability)


def outside(errors: np.ndarray, covs: np.ndarray, probability: float) -> np.ndarray:
    """Count the runs outside."""
    return 1 - coverage(errors, covs, probability)


def all_independent(values: np.ndarray) -> tuple:
    """Take instants for independent."""
    return values.mean(), values.std(ddof=1) / np.sqrt(values.size)


def spread_of_the_runs(values: np.ndarray) -> tuple:
    """Leave out the root of the count."""
    return values.mean(), values.mean(axis=1).std(ddof=1)


def known_mean(values: np.ndarray) -> tuple:
    """Divide by the count of the runs in the variance."""
    return values.mean(), values.mean(axis=1).std() / np.sqrt(len(values))


def over_the_runs(values: np.ndarray) -> tuple:
    """Average over the runs and take the spread over the instants."""
    means = values.mean(axis=0)
    spread = means.std(ddof=1) if means.size > 1 else 0.0
    return means.mean(), spread / np.sqrt(means.size)


def divided_by_the_count(values: np.ndarray) -> tuple:
    """Divide by the count instead of its root."""
    mean, error = mean_and_error(values)
    return mean, error / np.sqrt(len(values))


def unpaired(a: np.ndarray, b: np.ndarray, picks: np.ndarray, probability: float) -> tuple:
    """Draw the runs of the second filter on their own."""
    means = a[picks].mean(axis=1) - b[np.roll(picks, 1, axis=0)].mean(axis=1)
    return tuple(np.quantile(means, [(1 - probability) / 2, (1 + probability) / 2]))


def other_way_round(a: np.ndarray, b: np.ndarray, picks: np.ndarray, probability: float) -> tuple:
    """Take the second less the first."""
    return paired_interval(b, a, picks, probability)


def one_tail(a: np.ndarray, b: np.ndarray, picks: np.ndarray, probability: float) -> tuple:
    """Leave out the whole rest on either side."""
    means = (a - b)[picks].mean(axis=1)
    return tuple(np.sort(np.quantile(means, [1 - probability, probability])))


def of_the_runs(a: np.ndarray, b: np.ndarray, picks: np.ndarray, probability: float) -> tuple:
    """Take quantiles of the differences of single runs."""
    return tuple(np.quantile((a - b)[picks], [(1 - probability) / 2, (1 + probability) / 2]))


def difference_of_ends(a: np.ndarray, b: np.ndarray, picks: np.ndarray, probability: float) -> tuple:
    """Make an interval of each filter and subtract the ends."""
    zero = np.zeros(a.size)
    first = paired_interval(a, zero, picks, probability)
    second = paired_interval(b, zero, picks, probability)
    return first[0] - second[0], first[1] - second[1]


def medians(a: np.ndarray, b: np.ndarray, picks: np.ndarray, probability: float) -> tuple:
    """Take the median of each set."""
    means = np.median((a - b)[picks], axis=1)
    return tuple(np.quantile(means, [(1 - probability) / 2, (1 + probability) / 2]))


_ONE = "Take one instant and two runs, errors of 3 and 5, and go through your function by hand."
_BOUND = "Take one run, and draw the region that you ask about. What shape has it, and how probable is it?"
_COUNT = "Repeat every column of the values: you know nothing more than before. What does your number do?"
_SAME = "Let the first filter be worse by exactly 1 in every run. What must come out, and what does?"

MISCONCEPTIONS = (
    Misconception(
        "error of the heading not wrapped",
        _RMS,
        "Headings are subtracted as numbers. Where estimate and truth lie on two sides of the cut, or "
        "some turns apart, a small error counts as a large one.",
        "How far apart are headings of 179 and -179 degrees?",
        heading_not_wrapped,
    ),
    Misconception(
        "mean of the distances",
        _RMS,
        "Absolute errors are averaged. That is a fair measure too, but another one: squares weigh large "
        "errors more, and it is they that a covariance speaks of.",
        _ONE,
        mean_distance,
    ),
    Misconception(
        "errors averaged before they are squared",
        _RMS,
        "Errors to the left and to the right cancel. What is left is the bias, which is near 0 for the "
        "worst of filters, if it is wrong on all sides.",
        "What is the result if one run is 1 m too far east and another 1 m too far west?",
        of_the_mean,
    ),
    Misconception(
        "position error per coordinate",
        _RMS,
        "A mean over both the runs and the two coordinates: what is said is the error along one axis and "
        "not that of the position.",
        "A robot is 3 m off to the east and 4 m to the north. How far is it off?",
        a_coordinate,
    ),
    Misconception(
        "root left out",
        _RMS,
        "The mean square is returned. It has the unit of a square and cannot be laid beside a distance.",
        "In which unit is your result?",
        no_root,
    ),
    Misconception(
        "spread about the mean error",
        _RMS,
        "A standard deviation subtracts the mean first, so that an error that all runs share does not count.",
        "What is the result if every run is 1 m too far east?",
        about_the_mean,
    ),
    Misconception(
        "bound of a single number",
        _COVERAGE,
        "The bound that is known by heart, 1.96 squared for 95 percent, belongs to one number. More "
        "numbers have more ways to be off.",
        _BOUND,
        one_degree,
    ),
    Misconception(
        "distance compared with a squared bound",
        _COVERAGE,
        "The root of the square is compared with the quantile of the square, so that far too much counts "
        "as inside.",
        "Which of the two, the distance or its square, is distributed as chi-squared?",
        distance_not_squared,
    ),
    Misconception(
        "correlations left out",
        _COVERAGE,
        "Each error is divided by its own deviation alone. The ellipse loses its slant.",
        _BOUND,
        diagonal_alone,
    ),
    Misconception(
        "each number by itself",
        _COVERAGE,
        "A run counts if every number is within its own interval. That is a box about the mean, and its "
        "probability is another one.",
        _BOUND,
        box,
    ),
    Misconception(
        "bound from the other tail",
        _COVERAGE,
        "Functions for quantiles count the probability from below or from above, and the wrong one was "
        "taken.",
        "Print the bound for 50, 90 and 99 percent. Does it grow?",
        other_tail,
    ),
    Misconception(
        "one covariance for all runs",
        _COVERAGE,
        "Covariances are averaged over the runs. A filter that is sure in the wrong runs hides behind "
        "those in which it is not.",
        "Two runs, one of them sure and wrong, the other neither. Who is inside?",
        averaged_covariance,
    ),
    Misconception(
        "runs outside counted",
        _COVERAGE,
        "The share of the misses is returned, so that the better filter gets the smaller number.",
        "What is the share for errors of 0?",
        outside,
    ),
    Misconception(
        "instants taken for independent",
        _MEAN,
        "All numbers are counted as if each were news. An error lives on for many steps, so the precision "
        "that is claimed is far too good.",
        _COUNT,
        all_independent,
    ),
    Misconception(
        "spread of the runs for the precision of their mean",
        _MEAN,
        "The standard deviation from run to run says where the next run may be. The mean of many is known "
        "better than that.",
        "What does your number do if there are a hundred times as many runs?",
        spread_of_the_runs,
    ),
    Misconception(
        "mean of the runs taken for known",
        _MEAN,
        "The squares are divided by the count. But the mean that they are about was made from the same "
        "runs, and lies in their middle.",
        "With two runs, 2 and 4, work out the number by hand.",
        known_mean,
    ),
    Misconception(
        "spread from instant to instant",
        _MEAN,
        "Runs and instants have been exchanged: how a number goes up and down along a run says nothing of "
        "other runs.",
        "Which axis of the array is which?",
        over_the_runs,
    ),
    Misconception(
        "divided by the count and not by its root",
        _MEAN,
        "Variances of means fall with the count, deviations with its root.",
        "In which unit would the count have to be?",
        divided_by_the_count,
    ),
    Misconception(
        "pairs torn apart",
        _PAIRED,
        "The two filters get different sets of runs. That some runs are hard for both then counts as "
        "chance, and hides what is no chance.",
        _SAME,
        unpaired,
    ),
    Misconception(
        "second less first",
        _PAIRED,
        "The difference is taken the other way round, so that the worse filter looks better.",
        "What is the sign for a filter that is worse in each run?",
        other_way_round,
    ),
    Misconception(
        "all that is left out on either side",
        _PAIRED,
        "The rest of the probability is left out twice, below and above, so that less is inside than was "
        "asked for.",
        "How many of a hundred draws lie inside your 90 percent?",
        one_tail,
    ),
    Misconception(
        "quantiles of runs instead of means",
        _PAIRED,
        "The spread of single runs is shown, and not that of their mean.",
        "Does your interval become narrower with more runs?",
        of_the_runs,
    ),
    Misconception(
        "intervals subtracted end by end",
        _PAIRED,
        "Each filter gets an interval and the ends are subtracted. Quantiles of differences are not "
        "differences of quantiles.",
        _SAME,
        difference_of_ends,
    ),
    Misconception(
        "medians of the draws",
        _PAIRED,
        "The median of each set is taken. That answers another question, about the run in the middle.",
        "What does one terrible run in ten do to your interval?",
        medians,
    ),
)
