"""A line that is new: it is that of augment, whatever its side, and recognition is the filter's own association."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles import finite_difference

from roboloc.angles import wrap
from roboloc_reference import lines, new_lines, slam
from roboloc_reference.association import compute_innovations

few = settings(deadline=None, derandomize=True, max_examples=40)
poses = st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-7, 7))
mountings = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-3, 3))
sights = st.tuples(st.floats(-3, 3), st.floats(0.1, 8))


@few
@given(sights, poses, mountings)
def test_the_line_is_seen_as_it_was(z, x, tf):
    """Predicted from the pose from which it was placed, the line is the one that was seen, to 1e-12."""
    line, _, _ = new_lines.line_in_world(z, x, tf)
    assert line[1] >= 0
    assert -np.pi <= line[0] < np.pi
    hs, _ = lines.compute_predicted_measurements(x, line[:, None], tf)
    assert abs(wrap(hs[0, 0] - z[0])) < 1e-12
    assert abs(hs[1, 0] - z[1]) < 1e-12


@few
@given(sights, poses, mountings)
def test_the_line_is_that_of_augment(z, x, tf):
    """Line and derivatives are those that augment uses, read off its covariances, to 1e-11."""
    line, by_pose, by_z = new_lines.line_in_world(z, x, tf)
    state, Sigma = slam.augment(x, np.eye(3), z, np.zeros((2, 2)), tf)
    np.testing.assert_allclose(state[3:], line, rtol=0, atol=1e-13)
    np.testing.assert_allclose(Sigma[3:, :3], by_pose, rtol=0, atol=1e-12)
    own = slam.augment(x, np.zeros((3, 3)), z, np.eye(2), tf)[1][3:, 3:]
    np.testing.assert_allclose(own, by_z @ by_z.T, rtol=0, atol=1e-11)


@few
@given(sights, poses, mountings)
def test_derivatives_agree_with_finite_differences(z, x, tf):
    """Both derivatives are the slopes of the line."""
    line, *slopes = new_lines.line_in_world(z, x, tf)
    assume(line[1] > 0.1)  # a step must not change its side
    for derivative, place, function in (
        (slopes[0], x, lambda y: new_lines.line_in_world(z, y, tf)[0]),
        (slopes[1], z, lambda y: new_lines.line_in_world(y, x, tf)[0]),
    ):

        def moved(y, function=function):
            new = function(y)
            return np.array([wrap(new[0] - line[0]), new[1]])

        np.testing.assert_allclose(derivative, finite_difference(moved, np.array(place)), atol=1e-8)


@pytest.mark.parametrize("seed", range(30))
def test_recognition_is_the_association_of_the_filter(seed):
    """A line is within a gate if the association keeps the observation under either name; the nearest is meant."""
    rng = np.random.default_rng(seed)
    hs, Hs = np.array([rng.uniform(-3, 3, 4), rng.uniform(0.1, 4, 4)]), rng.normal(size=(4, 2, 7))
    root = 0.3 * rng.normal(size=(7, 7))
    Sigma, Q = root @ root.T, np.array([[0.1, 0.04], [0.04, 0.2]])
    z, flip = np.array([rng.uniform(-3, 3), rng.uniform(-1, 4)]), np.diag([1.0, -1.0])
    both = np.stack([z, flip @ z + [np.pi, 0.0]], axis=1), np.stack([Q, flip @ Q @ flip])
    j = new_lines.recognize(z, Q, hs, Hs, Sigma, 0.5, 1.0)
    inside = [len(compute_innovations(*both, hs, Hs, Sigma, gate)[0]) > 0 for gate in (0.5, 1.0)]
    assert inside == [j >= 0, j != new_lines.NEW]
    d2 = new_lines.squared_distances(z, Q, hs, Hs, Sigma)
    assert j < 0 or j == d2.argmin()


def test_with_no_line_all_is_new():
    """An empty map has no line that could be meant."""
    none = np.zeros((2, 0)), np.zeros((0, 2, 3)), np.eye(3)
    assert new_lines.recognize([0.1, 1.0], np.eye(2), *none, 3.0, 5.0) == new_lines.NEW


def test_the_wide_gate_is_not_the_narrower_one():
    """A newness below g is refused."""
    known = np.zeros((2, 1)), np.zeros((1, 2, 3)), np.eye(3)
    with pytest.raises(ValueError, match="newness"):
        new_lines.recognize([0.1, 1.0], np.eye(2), *known, 3.0, 2.0)
