"""Frames: four bytes of length, then one MessagePack value of bounded size.

Used on both sides of the sandbox, under different package names.
"""

from __future__ import annotations

import struct
from typing import Any

import msgpack

from . import wire

MAX_FRAME = wire.MAX_BYTES
# A byte of a frame can become an object of 72: one of this size is unpacked as it is, of a larger one the items are
# counted before.
SMALL = 1 << 20


def pack(message: object) -> bytes:
    """Return one frame: the length in four bytes and the message.

    Parameters
    ----------
    message : object
        What MessagePack carries: scalars, lists, dicts with text keys.

    Returns
    -------
    bytes
        The frame.

    Raises
    ------
    wire.WireError
        If the message is larger than `MAX_FRAME` or is not for MessagePack.
    """
    try:
        body = msgpack.packb(message, use_bin_type=True, unicode_errors="surrogatepass")
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise wire.WireError(f"cannot be sent: {error}") from error
    return frame(body)


def frame(body: bytes) -> bytes:
    """Return a packed message with its length in front.

    Parameters
    ----------
    body : bytes
        A packed message.

    Returns
    -------
    bytes
        The frame.

    Raises
    ------
    wire.WireError
        If it is larger than `MAX_FRAME`.
    """
    if len(body) > MAX_FRAME:
        raise wire.WireError(f"{len(body)} bytes are more than {MAX_FRAME}")
    return struct.pack(">I", len(body)) + body


def unpack(body: bytes) -> Any:
    """Return the message of one frame's body.

    Parameters
    ----------
    body : bytes
        What followed the length.

    Returns
    -------
    object
        Scalars, lists, dicts with text keys.

    Raises
    ------
    wire.WireError
        If it is not exactly one MessagePack value of allowed size.
    """
    if len(body) > SMALL:
        _count_items(body)
    try:
        return msgpack.unpackb(
            body, raw=False, strict_map_key=True, use_list=True, unicode_errors="surrogatepass",
            ext_hook=_no_extension, max_array_len=wire.MAX_ITEMS, max_map_len=wire.MAX_ITEMS,
        )  # fmt: skip
    except wire.WireError:
        raise
    except (
        ValueError,
        TypeError,
        OverflowError,
        RecursionError,
        MemoryError,
        msgpack.UnpackException,
    ) as error:
        raise wire.WireError(f"not a frame: {type(error).__name__}") from error


def _steps() -> tuple[list[int], list[int]]:
    """Return, by the first byte of an item: bytes to the next item, and bytes of the length that is to be added."""
    steps, widths = [1] * 256, [0] * 256
    for first in range(0xA0, 0xC0):  # a short text
        steps[first] = 1 + (first & 0x1F)
    for first, width in zip((0xC4, 0xC5, 0xC6, 0xD9, 0xDA, 0xDB), (1, 2, 4) * 2, strict=True):  # bytes, text
        steps[first], widths[first] = 1 + width, width
    for first, width in zip((0xC7, 0xC8, 0xC9), (1, 2, 4), strict=True):  # an extension: its kind besides
        steps[first], widths[first] = 2 + width, width
    for first, size in zip(range(0xCA, 0xD4), (4, 8, 1, 2, 4, 8, 1, 2, 4, 8), strict=True):  # numbers
        steps[first] = 1 + size
    for power in range(5):  # extensions of fixed size
        steps[0xD4 + power] = 2 + 2**power
    # Of lists and dicts the items follow.
    for first, width in zip((0xDC, 0xDD, 0xDE, 0xDF), (2, 4) * 2, strict=True):
        steps[first] = 1 + width
    return steps, widths


_STEPS, _WIDTHS = _steps()


def _count_items(body: bytes) -> None:
    """Refuse a body of more items than a value may have, before one of them takes memory."""
    place, items, end = 0, 0, len(body)
    while place < end:
        first = body[place]
        width = _WIDTHS[first]
        if width:
            place += int.from_bytes(body[place + 1 : place + 1 + width])
        place += _STEPS[first]
        items += 1
        if items > wire.MAX_ITEMS:
            raise wire.WireError(f"more than {wire.MAX_ITEMS} items")


def _no_extension(code: int, data: bytes) -> None:  # noqa: ARG001
    raise wire.WireError("an extension type")


def frame_length(header: bytes, most: int | None = None) -> int:
    """Return the body's length from a frame's first four bytes.

    Parameters
    ----------
    header : bytes
        Exactly four bytes.
    most : int, optional
        Most bytes that may follow; `MAX_FRAME` if not given.

    Returns
    -------
    int
        How many bytes follow.

    Raises
    ------
    wire.WireError
        If they announce more.

    Examples
    --------
    >>> frame_length(pack([1, 2])[:4])
    3
    """
    (length,) = struct.unpack(">I", header)
    most = MAX_FRAME if most is None else most
    if length > most:
        raise wire.WireError(f"a frame of {length} bytes is announced; at most {most}")
    return length
