"""Frames: four bytes of length, then one MessagePack value of bounded size.

Used on both sides of the sandbox, under different package names.
"""

from __future__ import annotations

import struct
from typing import Any

import msgpack

from . import wire

MAX_FRAME = wire.MAX_BYTES


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


def _no_extension(code: int, data: bytes) -> None:  # noqa: ARG001
    raise wire.WireError("an extension type")


def frame_length(header: bytes) -> int:
    """Return the body's length from a frame's first four bytes.

    Parameters
    ----------
    header : bytes
        Exactly four bytes.

    Returns
    -------
    int
        How many bytes follow.

    Raises
    ------
    wire.WireError
        If they announce more than `MAX_FRAME`.

    Examples
    --------
    >>> frame_length(pack([1, 2])[:4])
    3
    """
    (length,) = struct.unpack(">I", header)
    if length > MAX_FRAME:
        raise wire.WireError(f"a frame of {length} bytes is announced; at most {MAX_FRAME}")
    return length
