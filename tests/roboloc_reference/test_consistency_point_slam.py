r"""SLAM with points is honest where the noise is small; where it is not, only the right-invariant filter is.

A robot drives a circle and a half inside a ring of six landmarks and sees all of them at the start and after each of
30 steps. Each run draws the first pose, every step and every look with the covariances that the filter is told. If
the filter is right, the squared error of the pose in units of its own covariance (NEES) is chi-square with 3 degrees
of freedom, that of the whole state with 15, and the sums over N runs with 3 N and 15 N. A block of N = 200 runs
passes if both sums are between the quantiles at five named instants, with a false alarm of 1e-3 for all ten together.

Two cases differ in their noise. In the mild one the heading is doubted by 0.01 rad, and by 0.005 rad more a step. In
the hard one both are 0.1 rad, as in the homework, and the landmarks are further off, so that what is hard is the
heading and not a landmark that is passed closely. There the standard filter fails: it believes to see the heading of
the world. The error of a filter is the one that it speaks of, estimate minus truth or the motion of the world between
them; the pose of the right-invariant filter is judged by both.

The runs of all 20 blocks go through a filter at once, as one more axis of every array. The first test says that these
filters are the reference, run by run; the seeds of block b are b.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from point_slam_runs import (
    START,
    STEP,
    Case,
    begun,
    drive,
    invariant_error,
    moved,
    ordinary_error,
    right_invariant,
    standard,
    to_ordinary,
    transposed,
)
from scipy.stats import chi2

from roboloc_reference import invariant_slam, landmarks

BLOCKS, RUNS, FALSE_ALARM = 20, 200, 1e-3
INSTANTS = {
    "first map": 0,
    "first step": 1,
    "quarter of a circle": 5,
    "half a circle": 10,
    "end of the drive": 30,
}
MILD = Case(
    np.diag([0.1, 0.1, 0.01]) ** 2, np.diag([0.03, 0.03, 0.005]) ** 2, np.diag([0.01, 0.03]) ** 2, radius=8.0
)
HARD = Case(
    np.diag([0.1, 0.1, 0.1]) ** 2, np.diag([0.1, 0.05, 0.1]) ** 2, np.diag([0.02, 0.15]) ** 2, radius=12.0
)


@cache
def the_drives(case):
    """Return the drives of all blocks."""
    return drive(case, [np.random.default_rng(block) for block in range(BLOCKS)], RUNS)


# ---------------------------------------------------------------- faults


def begun_without_cross_covariance(case, z):
    """Begin as if the errors of the landmarks had nothing to do with that of the pose."""
    x, Sigma = begun(case, z)
    Sigma[:, :3, 3:] = Sigma[:, 3:, :3] = 0.0
    return x, Sigma


def begun_as_if_the_pose_were_certain(case, z):
    """Begin with the covariance of the look alone for the landmarks, and zeros between them and the pose."""
    x, Sigma = begun_without_cross_covariance(case, z)
    certain = replace(case, pose_cov=np.zeros((3, 3)))
    Sigma[:, 3:, 3:] = begun(certain, z)[1][:, 3:, 3:]
    return x, Sigma


def begun_with_the_identity(case, z):
    """Begin with landmarks known to a metre each, and zeros between them and the pose."""
    x, Sigma = begun_without_cross_covariance(case, z)
    Sigma[:, 3:, 3:] = np.eye(12)
    return x, Sigma


def moved_transposed(Sigma, G):
    """Push a covariance through the motion the wrong way round."""
    return moved(Sigma, transposed(G))


# ---------------------------------------------------------------- the verdict


def squares(error, Sigma, n):
    """Return the NEES of the first n numbers of the state, (B,)."""
    return np.sum(error[:, :n] * np.linalg.solve(Sigma[:, :n, :n], error[:, :n, None])[..., 0], axis=1)


def at_instants(beliefs):
    """Return mean and covariance at the named instants."""
    return [belief for k, belief in enumerate(beliefs) if k in INSTANTS.values()]


def nees(beliefs, truth, error=ordinary_error, sizes=(3, 15)):
    """Return the NEES of all runs at the named instants, for the pose and for the state, (5, 2, B)."""
    pairs = zip(beliefs, truth[list(INSTANTS.values())], strict=True)
    return np.array([[squares(error(x, t), P, n) for n in sizes] for (x, P), t in pairs])


def passed(nees, sizes=(3, 15)):
    """Tell for each instant, for pose and state, and for each block whether the mean NEES is in its band."""
    mean = nees.reshape(len(INSTANTS), len(sizes), -1, RUNS).mean(axis=-1)
    tail = FALSE_ALARM / (len(INSTANTS) * len(sizes)) / 2
    low, high = (chi2.ppf(p, np.array(sizes) * RUNS)[:, None] / RUNS for p in (tail, 1 - tail))
    return (low < mean) & (mean < high)


@cache
def invariant_beliefs():
    """Return what the right-invariant filter believes in the hard case."""
    return at_instants(right_invariant(HARD, the_drives(HARD)[1]))


# ---------------------------------------------------------------- the tests


@pytest.mark.parametrize(("stages", "many"), [(landmarks, standard), (invariant_slam, right_invariant)])
def test_many_runs_at_once_are_the_reference_one_by_one(stages, many):
    """Run by run, the stages of the reference give the same mean, covariance and error, to 1e-9, at every instant."""
    truth, zs = drive(HARD, [np.random.default_rng(99)], runs=3)
    beliefs = at_instants(many(HARD, zs))
    for run in range(3):
        x, P = stages.init_landmarks(zs[0, run], HARD.Q, START, HARD.pose_cov)
        reference = [(x, P)]
        for z in zs[1:, run]:
            x, P = stages.predict(x, P, STEP, HARD.R)
            x, P = stages.update(x, P, z, HARD.Q)
            reference.append((x, P))
        for k, got, expected in zip(INSTANTS.values(), beliefs, at_instants(reference), strict=True):
            for mine, theirs in zip(got, expected, strict=True):
                np.testing.assert_allclose(mine[run], theirs, atol=1e-9)
            if stages is invariant_slam:
                own = invariant_slam.invariant_error(expected[0], truth[k, run])
                np.testing.assert_allclose(invariant_error(got[0], truth[k])[run], own, atol=1e-9)
                plain = invariant_slam.to_ordinary(*expected)
                np.testing.assert_allclose(to_ordinary(*got)[run], plain, atol=1e-9)


def test_the_standard_filter_is_honest_where_the_noise_is_small():
    """At least 19 of 20 blocks pass at all five instants; a false alarm in two has a probability of 2e-4."""
    truth, zs = the_drives(MILD)
    assert passed(nees(at_instants(standard(MILD, zs)), truth)).all(axis=(0, 1)).sum() >= 19


@pytest.mark.parametrize(
    "fault",
    [
        {"move": moved_transposed},
        {"begin": begun_without_cross_covariance},
        {"begin": begun_as_if_the_pose_were_certain},
        {"begin": begun_with_the_identity},
    ],
)
def test_a_wrong_covariance_is_found(fault):
    """With Gx transposed, or a first map that is independent of the pose, no block of 20 passes the mild case."""
    truth, zs = the_drives(MILD)
    assert not passed(nees(at_instants(standard(MILD, zs, **fault)), truth)).all(axis=(0, 1)).any()


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_wrong_noise_is_found(factor):
    """A filter told half or twice the variance of the looks fails in all blocks: both edges of the band work."""
    truth, zs = the_drives(MILD)
    told = replace(MILD, Q=factor * MILD.Q)
    assert not passed(nees(at_instants(standard(told, zs)), truth)).all(axis=(0, 1)).any()


def test_the_standard_filter_fails_where_the_heading_is_hard():
    """No block of 20 passes; from the fifth step on the pose fails in each, and in the end its mean NEES is over 9."""
    truth, zs = the_drives(HARD)
    found = nees(at_instants(standard(HARD, zs)), truth)
    assert not passed(found).all(axis=(0, 1)).any()
    assert not passed(found)[2:, 0].any()
    assert found[-1, 0].mean() > 9


def test_the_right_invariant_filter_is_honest_there():
    """On the same drives at least 19 of 20 blocks pass, pose and state, at all five instants."""
    found = nees(invariant_beliefs(), the_drives(HARD)[0], error=invariant_error)
    assert passed(found).all(axis=(0, 1)).sum() >= 19


def test_its_pose_is_honest_in_ordinary_terms_too():
    """Judged as the standard filter is, by estimate minus truth, the pose passes in at least 19 of 20 blocks."""
    ordinary = [(x, to_ordinary(x, P)) for x, P in invariant_beliefs()]
    found = nees(ordinary, the_drives(HARD)[0], sizes=(3,))
    assert passed(found, sizes=(3,)).all(axis=(0, 1)).sum() >= 19
