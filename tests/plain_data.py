"""Values that cross the wire, for property tests: every kind of plain data, and when two of them are the same."""

# ruff: noqa: PLR0911, PLW0108  (liars of every kind, and one comparison for all kinds of data)

from __future__ import annotations

import struct

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from autograder import frames, wire

QUICK = settings(
    max_examples=60, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
MUCH = settings(
    max_examples=150, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)


def over(value, **keywords):
    """Send a value through encoding, a frame and decoding, as it crosses."""
    body = frames.pack(wire.encode(value, **keywords))[4:]
    return wire.decode(frames.unpack(body), allow_named=keywords.get("named", False))


def same(left, right):
    """Return whether two values agree in type, order, bits and flags, at every depth."""
    if type(left) is not type(right):
        return False
    if isinstance(left, np.ndarray):
        return (
            left.dtype.str == right.dtype.str
            and left.shape == right.shape
            and left.tobytes() == right.tobytes()
            and left.flags.writeable == right.flags.writeable
            and left.flags.c_contiguous >= (left.flags.c_contiguous and right.flags.c_contiguous)
        )
    if isinstance(left, np.generic):
        return left.dtype.str == right.dtype.str and left.tobytes() == right.tobytes()
    if isinstance(left, float):
        return struct.pack("d", left) == struct.pack("d", right)
    if isinstance(left, complex):
        return same((left.real, left.imag), (right.real, right.imag))
    if isinstance(left, dict):
        return same(list(left.items()), list(right.items()))
    if isinstance(left, (list, tuple)):
        return len(left) == len(right) and all(map(same, left, right))
    if isinstance(left, np.random.Generator):
        return str(left.bit_generator.state) == str(right.bit_generator.state)
    return left == right


DTYPES = st.one_of(
    hnp.boolean_dtypes(),
    hnp.integer_dtypes(),
    hnp.unsigned_integer_dtypes(),
    hnp.floating_dtypes(sizes=(16, 32, 64)),
    hnp.complex_number_dtypes(sizes=(64, 128)),
    hnp.unicode_string_dtypes(max_len=5),
    hnp.byte_string_dtypes(max_len=5),
    hnp.datetime64_dtypes(),
    hnp.timedelta64_dtypes(),
)
ARRAYS = hnp.arrays(DTYPES, hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4))
HASHABLE = st.recursive(
    st.one_of(
        st.none(),
        st.booleans(),
        st.integers(),
        st.floats(allow_nan=False),
        st.text(),
        st.binary(),
        st.complex_numbers(allow_nan=False),
        st.just(Ellipsis),
    ),
    lambda inner: st.one_of(st.lists(inner, max_size=3).map(tuple), st.frozensets(inner, max_size=3)),
    max_leaves=4,
)
PLAIN = st.recursive(
    st.one_of(
        HASHABLE,
        st.floats(),
        st.builds(bytearray, st.binary()),
        st.builds(range, st.integers(-9, 9), st.integers(-9, 9), st.sampled_from([-2, 1, 3])),
        st.builds(slice, st.none() | st.integers(), st.integers(), st.text()),
        ARRAYS,
        DTYPES.flatmap(lambda dtype: hnp.from_dtype(dtype)).filter(
            lambda value: isinstance(value, np.generic)
        ),
        st.sets(HASHABLE, max_size=3),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.lists(inner, max_size=4).map(tuple),
        st.dictionaries(HASHABLE, inner, max_size=4),
    ),
    max_leaves=12,
)
