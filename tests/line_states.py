"""States of a robot and lines for tests: strategies that draw them, covariances, and their differences."""

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

from roboloc.angles import difference
from roboloc.worlds import arena

law = settings(deadline=None, derandomize=True)
few = settings(law, max_examples=40)
position = st.floats(-10, 10)
a_line = st.tuples(st.floats(-np.pi, np.pi), st.floats(0, 10))
poses = st.tuples(position, position, st.floats(-7, 7))
controls = st.tuples(st.floats(-2, 2), st.floats(-3, 3))
mountings = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-np.pi, np.pi))
seeds = st.integers(0, 999)

MAP, TF, DT = arena().map_lines, np.array([0.12, -0.05, 0.2]), 0.1


def random_state(rng, J):
    """Draw a pose and J lines."""
    map_lines = np.array([rng.uniform(-np.pi, np.pi, J), rng.uniform(0, 10, J)])
    return np.concatenate([rng.uniform(-5, 5, 3), map_lines.T.ravel()])


def random_covariance(rng, n, size=1.0):
    """Draw a covariance with correlations everywhere."""
    root = rng.normal(size=(n, n))
    return size**2 * (root @ root.T / n + 0.1 * np.eye(n))


def with_map(x, map_lines=MAP):
    """Return the state of a pose and a map."""
    return np.concatenate([x, np.asarray(map_lines).T.ravel()])


def minus(a, b):
    """Return a - b of two lines, the angle on the circle."""
    return np.array([difference(a[0], b[0]), a[1] - b[1]])
