"""What cannot be a value: whatever arrives is a value or a `WireError`, and takes little memory."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plain_data import MUCH, PLAIN, QUICK

from autograder import frames, wire

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


def test_without_its_bounds_the_wire_is_won(monkeypatch):
    """What the bounds are for: without them depth ends the reader, and a generator points into its memory."""
    deep = 0
    for _ in range(2000):
        deep = [0, deep]
    monkeypatch.setattr(wire._Budget, "spend", lambda *_: None)
    with pytest.raises(RecursionError):
        wire.decode(deep)
    monkeypatch.setattr(wire, "_BUFFERS", {})
    outside = wire.decode(_with(TWISTER, "state", "pos", value=10**6))
    place = outside.bit_generator.state["state"]["pos"]
    assert place == 10**6  # never drawn from: that would read beyond the buffer


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


def test_numbers_and_dtypes_that_could_not_go_back_are_refused():
    """What is read can be written again: no integer is too long for that; and text of a dtype is never Python."""
    with pytest.raises(wire.WireError, match="100000"):
        wire.decode([5, hex(1 << 110_000)])
    assert wire.decode(wire.encode(1 << 99_999)) == 1 << 99_999
    for text in ("f4,(1 2)f4", "<f8 ", "m8[generic]", "f8\n", "(1).__class__"):
        with pytest.raises(wire.WireError):
            wire.decode([7, text, [1], "C", True, bytes(8)])
