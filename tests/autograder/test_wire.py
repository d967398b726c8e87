"""The wire: plain data keeps its exact type, and nothing but plain data comes in."""

# ruff: noqa: D102, E501, PLR0911, PLW0108, PYI024  (liars of every kind, and one comparison for all kinds of data)

from __future__ import annotations

import collections
import enum
import io
import math
import os
import struct
import sys
import tracemalloc

import msgpack
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
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


# Hostile data.

JUNK = st.recursive(
    st.one_of(
        st.none(), st.booleans(), st.integers(-2, 20), st.integers(), st.floats(), st.text(), st.binary()
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=6),
        st.builds(lambda tag, rest: [tag, *rest], st.integers(-1, 17), st.lists(inner, max_size=6)),
        st.dictionaries(st.text(max_size=3), inner, max_size=3),
    ),
    max_leaves=15,
)
GENERATOR = wire.encode(np.random.default_rng(1))
TWISTER = wire.encode(np.random.Generator(np.random.MT19937(1)))


@MUCH
@given(JUNK)
def test_junk_is_a_value_or_a_wire_error(data):
    """Whatever structure comes, it decodes to plain data or raises WireError and nothing else."""
    try:
        value = wire.decode(data)
    except wire.WireError:
        return
    assert not callable(value)


@QUICK
@given(PLAIN, st.data())
def test_a_mangled_value_is_a_value_or_a_wire_error(value, data):
    """A valid encoding with one of its bytes changed, cut or grown never raises anything but WireError."""
    body = bytearray(frames.pack(wire.encode([value, 1]))[4:])
    place = data.draw(st.integers(0, len(body) - 1))
    what = data.draw(st.sampled_from(["change", "cut", "insert"]))
    if what == "change":
        body[place] = data.draw(st.integers(0, 255))
    elif what == "cut":
        del body[place:]
    else:
        body[place:place] = data.draw(st.binary(max_size=5))
    try:
        wire.decode(frames.unpack(bytes(body)))
    except wire.WireError:
        pass
    except DeprecationWarning:
        pytest.fail("a dtype's text was interpreted, not compared")


@pytest.mark.parametrize(
    "data",
    [
        [], [99], [-1], ["x"], [True], [None], {}, {"a": 1}, [[0]], (0, 1), [2, 1], [3, [0]], [4, [2]], [2, [0, 1], 2],
        [3, [7, "<f8", [1], "C", True, b"12345678"]], [5], [5, "xyz"], [5, "f" * 30_001], [5, 7], [6, 1, 2],
        [6, 1.0], [12, 1, 2], [12, 1, 2, 0], [12, "a", "b", "c"], [13, 1, 2], [15, "x"], [10, 1, 2, 3],
        [10, True, "x", False], [11, "os", "system"], [11, "builtins", "eval"], [11, "math", "sin"],
    ],
    ids=str,
)  # fmt: skip
def test_wrong_tags_and_fields(data):
    """Wrong tags, half pairs, unhashable keys, fields of other types, and functions by name are refused."""
    with pytest.raises(wire.WireError):
        wire.decode(data)


@pytest.mark.parametrize(
    "data",
    [
        ["|O", [1], "C", True, bytes(8)], ["O", [1], "C", True, bytes(8)], ["|V8", [1], "C", True, bytes(8)],
        ["f8,f8", [1], "C", True, bytes(16)], ["(2,)f8", [1], "C", True, bytes(16)], ["T", [1], "C", True, bytes(16)],
        ["<f8", [2], "C", True, bytes(8)], ["<f8", [1], "C", True, bytes(9)], ["<f8", [-1], "C", True, b""],
        ["<f8", [1.0], "C", True, bytes(8)], ["<f8", [True], "C", True, bytes(8)], ["<f8", [1], "K", True, bytes(8)],
        ["<f8", [1], "C", 1, bytes(8)], ["<f8", [1], "C", True, "12345678"], ["<f8", [1] * 65, "C", True, bytes(8)],
        ["<f8", [2**40, 2**40], "C", True, b""], ["<f8", [0, 2**62], "C", True, b""],
        ["<f8", 1, "C", True, bytes(8)], [b"<f8", [1], "C", True, bytes(8)], ["<f8" * 20, [1], "C", True, bytes(8)],
        ["<f8", [1]], [], ["<f3", [1], "C", True, bytes(3)], ["<U0", [4], "C", True, b""],
    ],
    ids=lambda data: str(data)[:50],
)  # fmt: skip
def test_wrong_arrays(data):
    """Object and structured dtypes, byte counts that do not fit, impossible shapes and orders are refused."""
    with pytest.raises(wire.WireError):
        wire.decode([7, *data])


@pytest.mark.parametrize("raw", [b"", b"1234567"])
def test_wrong_scalars(raw):
    """A scalar with too few bytes or of an object dtype is refused."""
    with pytest.raises(wire.WireError):
        wire.decode([8, "<f8", raw])
    with pytest.raises(wire.WireError):
        wire.decode([8, "|O", bytes(8)])


def _with(encoded, *path, value):
    """Return an encoded generator whose state has another value at a path of keys."""
    state = wire.decode(encoded[2])
    inner = state
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    return [encoded[0], encoded[1], wire.encode(state)]


@pytest.mark.parametrize(
    "data",
    [
        [9], [9, "PCG64"], [9, "PCG64", [2]], [9, "Evil", [2]], [9, ["x"], [2]], [9, "seed", GENERATOR[2]],
        [9, "MT19937", GENERATOR[2]], _with(GENERATOR, "state", "state", value="x"),
        _with(GENERATOR, "state", "state", value=-1), _with(GENERATOR, "state", value=None),
        _with(TWISTER, "state", "key", value=[1, 2]), _with(TWISTER, "state", "pos", value="x"),
    ],
    ids=lambda data: str(data)[:40],
)  # fmt: skip
def test_wrong_generators(data):
    """A generator of an unknown kind or with a state of another is refused."""
    with pytest.raises(wire.WireError):
        wire.decode(data)


@pytest.mark.parametrize("place", [-1, 625, 10**6, 2**31 - 1, -(2**31), True, 1.0])
@pytest.mark.parametrize(("name", "path"), [("MT19937", ("state", "pos")), ("Philox", ("buffer_pos",))])
def test_no_generator_points_outside_its_buffer(name, path, place):
    """A state whose place lies outside the buffer is refused: numpy would read the grader's memory there and crash."""
    encoded = wire.encode(np.random.Generator(getattr(np.random, name)(1)))
    with pytest.raises(wire.WireError):
        wire.decode(_with(encoded, *path, value=place))


def test_depth_and_number_of_items_are_bounded(monkeypatch):
    """Data nested deeper, or with more items, than allowed is refused before it becomes a structure."""
    deep = 0
    for _ in range(wire.MAX_DEPTH + 5):
        deep = [0, deep]
    with pytest.raises(wire.WireError, match="nested"):
        wire.decode(deep)
    monkeypatch.setattr(wire, "MAX_ITEMS", 1000)
    with pytest.raises(wire.WireError, match="items"):
        wire.decode([0, *[None] * 1001])


def test_an_array_that_announces_much_takes_little():
    """An array that announces a terabyte without bytes takes no memory, whether or not it is refused."""
    tracemalloc.start()
    try:
        for shape in ([10**12], [0, 10**12], [2**62], [1, 10**11, 0]):
            try:
                wire.decode([7, "<f8", shape, "C", True, b""])
            except wire.WireError:
                continue
        assert tracemalloc.get_traced_memory()[1] < 1_000_000
    finally:
        tracemalloc.stop()


def test_what_crosses_is_plain_messagepack():
    """Encoded data needs no extension of MessagePack: any reader of it sees all there is."""
    data = wire.encode({"pose": (0.0, np.float32(1)), "map": np.eye(2), "rng": np.random.default_rng(0)})
    assert msgpack.unpackb(msgpack.packb(data), strict_map_key=True) == data
