"""Systematic resampling of a million particles, against filterpy, which walks along comb and ruler in a loop."""

import warnings

import numpy as np

from benchmarks.harness import Result, best_times, fitted_exponent
from roboloc_reference.resampling import systematic_resample

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # filterpy is older than the NumPy it is used with
    from filterpy.monte_carlo import systematic_resample as resample_of_filterpy

SIZES = (10_000, 100_000, 1_000_000)


def weights(count: int) -> np.ndarray:
    """Return weights as a correction leaves them: a particle in ten has nearly all."""
    ws = np.random.default_rng(0).random(count) ** 10
    return ws / ws.sum()


def ours(ws: np.ndarray) -> np.ndarray:
    """Resample with the first number of the seed 0, arguments checked."""
    return systematic_resample(ws, np.random.RandomState(0).random_sample() / ws.size)


def theirs(ws: np.ndarray) -> np.ndarray:
    """Resample with filterpy, which draws from NumPy's global state: the same number."""
    np.random.seed(0)  # noqa: NPY002 - what filterpy draws from
    return resample_of_filterpy(ws)


def against_filterpy() -> Result:
    """Compare the times for a million particles, and print how ours grow with the number of particles."""
    ws = weights(SIZES[-1])
    np.testing.assert_array_equal(ours(ws), theirs(ws))
    mine, others = best_times([lambda: ours(ws), lambda: theirs(ws)], 5)
    clouds = [weights(size) for size in SIZES]
    exponent = fitted_exponent(SIZES, best_times([lambda ws=ws: ours(ws) for ws in clouds], 10))
    print(f"        resampling takes a time that grows as M^{exponent:.2f}, M from {SIZES[0]} to {SIZES[-1]}")
    name = "resample-1e6-vs-filterpy: ancestors of a million particles, arguments checked"
    return Result(name, others / mine, 14.0, "filterpy 1.4.5, monte_carlo.systematic_resample")


BENCHMARKS = (against_filterpy,)
