"""Frames over a stream socket, with a deadline."""

from __future__ import annotations

import socket
import time
from typing import Any

from .. import frames


class Closed(ConnectionError):  # noqa: N818  (a state of the channel as much as an error)
    """The other side is gone."""


class Channel:
    """One end of a stream socket that carries frames of `wire`.

    Parameters
    ----------
    sock : socket.socket
        A connected stream socket; the channel owns it.
    """

    def __init__(self, sock: socket.socket) -> None:
        self.sock = sock

    def fileno(self) -> int:
        """Return the socket's descriptor."""
        return self.sock.fileno()

    def close(self) -> None:
        """Close the socket; the other side reads an end."""
        self.sock.close()

    def send(self, message: object, timeout: float | None = None) -> None:
        """Send one message.

        Parameters
        ----------
        message : object
            What `frames.pack` takes.
        timeout : float, optional
            Most seconds the other side may take to read it.

        Raises
        ------
        Closed
            If the other side is gone.
        TimeoutError
            If it does not read.
        """
        self.send_frame(frames.pack(message), timeout)

    def send_frame(self, frame: bytes, timeout: float | None = None) -> None:
        """Send a frame that is already packed; see :meth:`send`."""
        self.sock.settimeout(timeout)
        try:
            self.sock.sendall(frame)
        except TimeoutError:
            raise
        except OSError as error:
            raise Closed(str(error)) from error

    def receive(self, timeout: float | None = None, most: int | None = None) -> Any:
        """Return the next message.

        Parameters
        ----------
        timeout : float, optional
            Most seconds until it is complete.
        most : int, optional
            Most bytes; `frames.MAX_FRAME` if not given.

        Returns
        -------
        object
            What `frames.unpack` gives.

        Raises
        ------
        Closed
            If the other side is gone.
        TimeoutError
            If the message is not complete in time.
        wire.WireError
            If it is no frame.
        """
        return frames.unpack(self.receive_frame(timeout, most))

    def receive_frame(self, timeout: float | None = None, most: int | None = None) -> bytes:
        """Return the body of the next frame without reading it; see :meth:`receive`."""
        deadline = None if timeout is None else time.monotonic() + timeout
        return self._exactly(frames.frame_length(self._exactly(4, deadline), most), deadline)

    def _exactly(self, count: int, deadline: float | None) -> bytes:
        found = bytearray()  # not a list of parts: the other side chooses how many
        while len(found) < count:
            left = None if deadline is None else deadline - time.monotonic()
            if left is not None and left <= 0:
                raise TimeoutError
            self.sock.settimeout(left)
            try:
                part = self.sock.recv(min(count - len(found), 1 << 20))
            except TimeoutError:
                raise
            except OSError as error:
                raise Closed(str(error)) from error
            if not part:
                raise Closed("end of stream")
            found += part
        return bytes(found)

    def send_descriptor(self, descriptor: int) -> None:
        """Hand an open file descriptor to the other side."""
        self.sock.settimeout(None)
        try:
            socket.send_fds(self.sock, [b"\0"], [descriptor])
        except OSError as error:
            raise Closed(str(error)) from error

    def receive_descriptor(self) -> int:
        """Return the file descriptor that the other side hands over."""
        self.sock.settimeout(None)
        data, descriptors, _, _ = socket.recv_fds(self.sock, 1, 1)
        if not data or len(descriptors) != 1:
            raise Closed("no descriptor came")
        return descriptors[0]


def pair() -> tuple[Channel, Channel]:
    """Return two connected channels."""
    left, right = socket.socketpair()
    return Channel(left), Channel(right)
