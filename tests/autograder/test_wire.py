"""The wire: plain data keeps its exact type, and nothing but plain data comes in."""

# ruff: noqa: D102, E501, PYI024  (liars of every kind, and one comparison for all kinds of data)

from __future__ import annotations

import collections
import enum
import io
import math
import os
import sys

import msgpack
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plain_data import ARRAYS, MUCH, PLAIN, QUICK, over, same

from autograder import wire


@MUCH
@given(PLAIN)
def test_plain_data_keeps_type_order_and_bits(value):
    """Every kind of plain data arrives as the same type with the same bits, nested however it is."""
    assert same(over(value), value)


@QUICK
@given(ARRAYS, st.booleans(), st.booleans())
def test_arrays_keep_memory_order_and_write_flag(array, transposed, writeable):
    """A Fortran-ordered array stays one, a read-only one stays read-only, and the copy is the receiver's own."""
    array = array.T if transposed else array.copy()
    array.flags.writeable = writeable
    got = over(array)
    assert same(got, array)
    assert got.flags.f_contiguous == array.flags.f_contiguous
    assert got.flags.c_contiguous == array.flags.c_contiguous
    assert got.flags.writeable is writeable
    assert got.flags.owndata or got.base.flags.owndata


@pytest.mark.parametrize("byte_order", ["<", ">"])
def test_byte_order_and_strides(byte_order):
    """A big-endian array stays big-endian; a view with strides arrives with its values."""
    array = np.arange(12, dtype=f"{byte_order}i4").reshape(3, 4)[::2, ::-1]
    got = over(array)
    assert got.dtype.str == f"{byte_order}i4"
    np.testing.assert_array_equal(got, [[3, 2, 1, 0], [11, 10, 9, 8]])


@pytest.mark.parametrize(
    "value",
    [
        np.str_(""), np.bytes_(b""), np.str_("pose"), np.float16(0.1), np.longdouble(1) / 3, np.bool_(False),
        np.int8(-3), np.uint64(2**64 - 1), np.complex64(1 - 2j), np.datetime64("2026-01-02"),
        np.timedelta64(5, "ms"), np.float64("nan"), np.array(3.0), np.zeros((0, 3)), np.array(["", "ab"]),
    ],
    ids=repr,
)  # fmt: skip
def test_numpy_scalars_and_odd_arrays(value):
    """A numpy scalar is not the Python number of its value, and an empty text or array is one too."""
    assert same(over(value), value)


@pytest.mark.parametrize(
    "value",
    [2**63 - 1, 2**63, -(2**63), -(2**63) - 1, 2**5000, -0.0, math.nan, math.inf, "\ud800", True, 1, 1.0],
)
def test_numbers_at_the_edges(value):
    """Large integers, the zero's sign, NaN and lone surrogates cross; True, 1 and 1.0 stay three things."""
    assert same(over(value), value)


@pytest.mark.parametrize("name", ["PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64"])
def test_generators_go_on_where_they_were(name):
    """A random generator draws on the other side what it would have drawn here, half a word included."""
    rng = np.random.Generator(getattr(np.random, name)(7))
    rng.integers(2**32, dtype=np.uint32)
    rng.normal(size=3)
    there = over({"rng": rng})["rng"]
    np.testing.assert_array_equal(
        there.integers(2**32, size=700, dtype=np.uint32), rng.integers(2**32, size=700, dtype=np.uint32)
    )
    np.testing.assert_array_equal(there.normal(size=9), rng.normal(size=9))


class Liar(float):
    """A number equal to everything."""

    __hash__ = float.__hash__

    def __eq__(self, _):
        return True

    def __float__(self):
        return 42.0

    def __reduce__(self):
        raise AssertionError("nobody may ask it")


class Lying(list):
    """A list that shows other items than it has."""

    def __iter__(self):
        return iter([42])

    def __len__(self):
        return 1


class LyingDict(dict):
    """A dict that shows other items than it has."""

    def items(self):
        return [("a", 42)]


class Text(str):
    """A text that prints as another."""

    __slots__ = ()

    def __str__(self):
        return "42"


class Count(int):
    """An integer that says it is another."""

    __slots__ = ()

    def __int__(self):
        return 42

    __index__ = __int__


Point = collections.namedtuple("Point", "x y")
Colour = enum.IntEnum("Colour", "RED GREEN")


@pytest.mark.parametrize(
    ("value", "plain"),
    [
        (Liar(1.5), 1.5),
        (Lying([1, 2]), [1, 2]),
        (LyingDict(a=1), {"a": 1}),
        (Text("x"), "x"),
        (Count(3), 3),
        (Point(1, 2.0), (1, 2.0)),
        (Colour.GREEN, 2),
        (collections.Counter("aab"), {"a": 2, "b": 1}),
        (collections.OrderedDict(b=1, a=2), {"b": 1, "a": 2}),
    ],
)
def test_subclasses_cross_as_their_builtin(value, plain):
    """An object that pretends to be a number arrives as the number it holds; its methods are not asked."""
    assert same(over(value), plain)


class AlwaysEqual(np.ndarray):
    """An array equal to everything."""

    def __eq__(self, _):
        return True

    __hash__ = None


@pytest.mark.parametrize(
    "value",
    [
        object(), lambda: 1, io.BytesIO(), type, np.array([object()]), np.zeros(2, "V8"), np.zeros(2, "f8,i4"),
        np.zeros(2).view(AlwaysEqual), np.ma.masked, memoryview(b"x"), (i for i in ()), os, NotImplemented,
        np.random.RandomState(0), ValueError("x"),
    ],
    ids=lambda value: type(value).__name__,
)  # fmt: skip
def test_what_is_not_plain_data_stays(value):
    """Any other object is an error, or a reference where the sender gives it a number; its name crosses only."""
    with pytest.raises(wire.WireError):
        wire.encode(value)
    kept = []
    got = over([value], to_ref=lambda it: kept.append(it) or wire.Ref(3, type(it).__name__, callable(it)))
    assert got == [wire.Ref(3, type(value).__name__, callable(value))]
    assert kept[0] is value


def test_a_reference_becomes_what_the_receiver_says():
    """The receiver of a reference decides what stands for it."""
    data = wire.encode({"f": wire.Ref(5, "function", is_callable=True)})
    assert wire.decode(data, lambda ref: ref.number + 1) == {"f": 6}


def test_too_deep_too_large_and_cyclic_values_stay(monkeypatch):
    """Depth, size and cycles are bounded on the sending side too."""
    deep = [0]
    for _ in range(60):
        deep = [deep]
    cycle = []
    cycle.append(cycle)
    monkeypatch.setattr(wire, "MAX_ITEMS", 1000)
    for value in (deep, cycle, [None] * 1001, ["x" * 65_000], 1 << 200_000):
        with pytest.raises(wire.WireError):
            wire.encode(value)
    with pytest.raises(wire.WireError):
        wire.encode(np.broadcast_to(np.float64(1), (wire.MAX_BYTES // 8 + 1,)))


# Named functions: from the grader to the submission, never back.


@pytest.mark.parametrize(
    "function", [np.sin, np.linalg.norm, math.hypot, abs, len, ValueError, np.float32, np.add, sum]
)
def test_library_functions_are_named_in_the_trusted_direction(function):
    """A test may hand `np.sin` to a student's solver: it arrives as the function itself."""
    assert over([function], named=True)[0] is function


@pytest.mark.parametrize("function", [np.sin, abs, math.sin])
def test_no_function_is_named_by_a_submission(function):
    """What a submission sends is data: neither its side names functions nor does the grader look one up."""
    with pytest.raises(wire.WireError):
        wire.encode(function)
    data = wire.encode(function, named=True)
    with pytest.raises(wire.WireError):
        wire.decode(data)
    with pytest.raises(wire.WireError):
        wire.decode([0, data])


@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("os", "system"), ("subprocess", "run"), ("builtins", "eval"), ("builtins", "exec"), ("builtins", "open"),
        ("builtins", "__import__"), ("builtins", "__build_class__"), ("numpy", "no_such"), ("numpy.no_such", "x"),
        ("numpyx", "sin"), ("", ""), ("math", "pi"), ("numpy", "__getattr__"), ("shutil", "rmtree"), (None, "sin"),
    ],
)  # fmt: skip
def test_no_tool_is_named(module, name):
    """A name outside the known libraries, a private one, or one that hands over a tool is refused, even when trusted."""
    with pytest.raises(wire.WireError):
        wire.resolve_named(module, name)


def test_naming_does_not_import_when_told_so(monkeypatch):
    """With `loaded_only` a module that is not imported already is not imported."""
    monkeypatch.delitem(sys.modules, "scipy.datasets", raising=False)
    with pytest.raises(wire.WireError):
        wire.resolve_named("scipy.datasets", "face", loaded_only=True)
    assert "scipy.datasets" not in sys.modules


def test_a_function_of_a_tests_own_is_not_named():
    """A function that only claims to be numpy's is not sent under that name."""

    def sin(x):
        return x

    sin.__module__ = "numpy"
    with pytest.raises(wire.WireError):
        wire.encode(sin, named=True)


def test_what_crosses_is_plain_messagepack():
    """Encoded data needs no extension of MessagePack: any reader of it sees all there is."""
    data = wire.encode({"pose": (0.0, np.float32(1)), "map": np.eye(2), "rng": np.random.default_rng(0)})
    assert msgpack.unpackb(msgpack.packb(data), strict_map_key=True) == data
