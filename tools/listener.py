"""A port that somebody listens on, for the sample that tries to connect to it."""

from __future__ import annotations

import socket
import threading
import time


class Listener:
    """Something that listens on a port of this machine and counts who comes; a context manager."""

    def __init__(self) -> None:
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.port = self.socket.getsockname()[1]
        self.visits = 0
        self._thread = threading.Thread(target=self._count, daemon=True)

    def _count(self) -> None:
        while True:
            try:
                connection, _ = self.socket.accept()
            except OSError:
                return
            connection.close()
            self.visits += 1

    def __enter__(self) -> Listener:  # noqa: PYI034
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.shutdown(socket.SHUT_RDWR)
        self.socket.close()
        self._thread.join(5)

    def hears(self) -> bool:
        """Return whether a connection from here is counted, and count it no more."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=5) as connection:
            connection.recv(1)  # ends when the other side has closed
        time.sleep(0.05)
        heard, self.visits = self.visits == 1, 0
        return heard
