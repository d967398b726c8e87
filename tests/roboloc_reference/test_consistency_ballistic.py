"""The filter of the bouncing ball is as sure of itself as it may be, before, between and behind impacts.

How the runs are drawn, and what a block of 200 has to pass, is told in `ball_runs`. The runs of all 20 blocks go
through the filter at once; the first test says that this filter is the reference, run by run.
"""

from functools import cache

import numpy as np
import pytest
from ball_runs import (
    BLOCKS,
    GRAVITY,
    INSTANTS,
    SIGMA0,
    START,
    TIMES,
    E,
    Q,
    R,
    estimate,
    jump_alone,
    no_jump,
    passed,
    throw,
)

from roboloc.metrics import nees
from roboloc_reference.ballistic import correct, predict


@cache
def the_throws():
    """Return the throws of all blocks."""
    return throw([np.random.default_rng(block) for block in range(BLOCKS)], SIGMA0, TIMES)


def test_many_runs_at_once_are_the_reference_one_by_one():
    """Run by run, the stages of the reference give the same NEES at every instant, to 1e-6 of it."""
    states, zs = throws = throw([np.random.default_rng(99)], SIGMA0, TIMES, runs=3)
    many = estimate(throws, SIGMA0, TIMES, INSTANTS, 4)
    for run in range(3):
        x, Sigma, squares = START[:4], SIGMA0[:4, :4], []
        for k, dt in enumerate(np.diff(TIMES, prepend=0.0)):
            x, Sigma = predict(x, Sigma, dt, GRAVITY, E, Q[:4, :4])
            if k < len(TIMES) - 1:
                x, Sigma = correct(x, Sigma, zs[k, run], R)
            if TIMES[k] in INSTANTS:
                squares.append(nees(x - states[k, run, :4], Sigma))
        np.testing.assert_allclose(many[:, run], squares, rtol=1e-6)


def test_the_right_filter_is_honest():
    """At least 19 of 20 blocks pass at all five instants; a false alarm in two has a probability of 2e-4."""
    assert passed(estimate(the_throws(), SIGMA0, TIMES, INSTANTS, 4), 4).all(axis=0).sum() >= 19


@pytest.mark.parametrize(
    "fault",
    [
        pytest.param({"impact": jump_alone}, id="Jacobian without the saltation term"),
        pytest.param({"impact": no_jump}, id="Jacobian without the impact"),
        pytest.param({"turned": True}, id="Jacobian transposed"),
        pytest.param({"Q": 0 * Q}, id="process noise forgotten"),
        pytest.param({"Q": Q / 2}, id="half the process noise"),
        pytest.param({"Q": 2 * Q}, id="twice the process noise"),
    ],
)
def test_a_wrong_filter_is_found(fault):
    """None of the 20 blocks passes if the filter is wrong in one thing."""
    assert not passed(estimate(the_throws(), SIGMA0, TIMES, INSTANTS, 4, **fault), 4).all(axis=0).any()
