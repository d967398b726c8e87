"""Frames: a length and one MessagePack value, both bounded."""

from __future__ import annotations

import contextlib
import datetime as dt
import resource
import struct
import subprocess
import sys

import msgpack
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autograder import frames, wire

QUICK = settings(max_examples=150, deadline=None, derandomize=True)
MESSAGES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats(allow_nan=False)
    | st.text()
    | st.binary(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner, max_size=4),
    max_leaves=10,
)


@QUICK
@given(MESSAGES)
def test_messages_come_back(message):
    """What is packed is unpacked as itself, and its header tells its length."""
    packed = frames.pack(message)
    assert frames.frame_length(packed[:4]) == len(packed) - 4
    assert frames.unpack(packed[4:]) == message


@QUICK
@given(st.binary(max_size=60))
def test_bytes_are_a_message_or_a_wire_error(body):
    """Any bytes at all are one message or a WireError."""
    with contextlib.suppress(wire.WireError):
        frames.unpack(body)


@pytest.mark.parametrize(
    "body",
    [
        b"", b"\xc1", b"\x01\x01", frames.pack([1])[4:] + b"\x00", frames.pack([1, 2])[4:-1],
        b"\x91" * 5000 + b"\xc0", b"\xdd\xff\xff\xff\xff", b"\xdf\xff\xff\xff\xff", b"\xc6\xff\xff\xff\xff",
        b"\xdb\x7f\xff\xff\xff", msgpack.packb({1: 2}), b"\xd9\x01\xff",
        msgpack.packb(msgpack.ExtType(5, b"x")), msgpack.packb([msgpack.ExtType(42, b"")]),
    ],
    ids=lambda body: body[:12].hex() or "empty",
)  # fmt: skip
def test_hostile_bodies(body):
    """Nothing, halves, extra bytes, deep nesting, huge announced lengths, odd keys and extension types are refused."""
    with pytest.raises(wire.WireError):
        frames.unpack(body)


@pytest.mark.parametrize(
    "body",
    [
        msgpack.packb(dt.datetime(2026, 1, 1, tzinfo=dt.UTC), datetime=True),
        msgpack.packb([0, msgpack.Timestamp(5)]),
        msgpack.packb({b"a": 2}),
        msgpack.packb({"a": 2}),
    ],
    ids=["date", "date in a list", "bytes as key", "map"],
)
def test_what_messagepack_builds_itself_is_no_value(body):
    """MessagePack's own dates and maps, which its reader makes unasked, are no values of the wire."""
    with pytest.raises(wire.WireError):
        wire.decode(frames.unpack(body))


@pytest.mark.parametrize("message", [object(), {1, 2}, 2**64, -(2**63) - 1, [[lambda: 0]], 1j])
def test_what_messagepack_does_not_carry(message):
    """What is not for MessagePack is a WireError already where it is sent."""
    with pytest.raises(wire.WireError):
        frames.pack(message)


def test_cyclic_message():
    """A message that contains itself is a WireError."""
    cycle = []
    cycle.append(cycle)
    with pytest.raises(wire.WireError):
        frames.pack(cycle)


def test_length_is_bounded_both_ways(monkeypatch):
    """A frame above the bound is neither sent nor waited for; one at the bound is."""
    monkeypatch.setattr(frames, "MAX_FRAME", 1000)
    assert frames.frame_length(struct.pack(">I", 1000)) == 1000
    assert len(frames.frame(b"x" * 1000)) == 1004
    with pytest.raises(wire.WireError):
        frames.frame(b"x" * 1001)
    with pytest.raises(wire.WireError):
        frames.pack("x" * 1000)
    for length in (1001, 2**31, 2**32 - 1):
        with pytest.raises(wire.WireError):
            frames.frame_length(struct.pack(">I", length))


def test_announced_lengths_take_no_memory():
    """Two kilobytes that announce a thousand million items, nested, take no more than a few megabytes to refuse."""
    code = (
        "import struct, resource\n"
        "from autograder import frames, wire\n"
        "peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "before = peak()\n"
        "for head in (b'\\xdd', b'\\xdf', b'\\xc6', b'\\xdb'):\n"
        "    for length in (1_900_000, 2**32 - 1):\n"
        "        try:\n"
        "            frames.unpack((head + struct.pack('>I', length)) * 400)\n"
        "        except wire.WireError:\n"
        "            print('refused')\n"
        "print(peak() - before)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=60
    )
    *refused, grown = done.stdout.split()
    assert refused == ["refused"] * 8
    assert int(grown) < 100_000  # kilobytes


def test_a_small_frame_does_not_unfold_into_gigabytes():
    """Items are counted before one takes memory: in a frame of many empty dicts they would take 72 bytes each."""
    row = b"\xdd" + struct.pack(">I", 1_000_000) + b"\x80" * 1_000_000
    body = b"\xdd" + struct.pack(">I", 40) + row * 40
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(wire.WireError, match="items"):
        frames.unpack(body)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # kB


@QUICK
@given(MESSAGES)
def test_items_are_counted_as_they_are(message):
    """The count that comes before is that of the items that come out."""

    def items(value):
        if isinstance(value, list):
            return 1 + sum(map(items, value))
        return 1 + sum(1 + items(one) for one in value.values()) if isinstance(value, dict) else 1

    body = frames.pack(message)[4:]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(frames, "SMALL", 0)
        patch.setattr(wire, "MAX_ITEMS", items(message))
        assert frames.unpack(body) == message
        patch.setattr(wire, "MAX_ITEMS", items(message) - 1)
        with pytest.raises(wire.WireError):
            frames.unpack(body)
