"""The sandbox from inside: no listener, no interface and no name service is reached."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import threading
import time

import pytest
from starts import UNFILTERED_TOO


@pytest.fixture
def listeners():
    """Listen outside on loopback, IPv4 and IPv6, and on an abstract name; collect who comes."""
    visitors, sockets = [], []

    def listen(family, address):
        listener = socket.socket(family)
        listener.bind(address)
        listener.listen()
        listener.settimeout(0.1)
        sockets.append(listener)
        return listener.getsockname()

    addresses = [
        (socket.AF_INET, listen(socket.AF_INET, ("127.0.0.1", 0))),
        (socket.AF_UNIX, listen(socket.AF_UNIX, f"\0listener-{os.getpid()}")),
    ]
    with contextlib.suppress(OSError):
        addresses.append((socket.AF_INET6, listen(socket.AF_INET6, ("::1", 0))))
    running = threading.Event()

    def accept():
        while not running.is_set():
            for listener in sockets:
                with contextlib.suppress(TimeoutError):
                    connection, _ = listener.accept()
                    visitors.append(connection.recv(100))
                    connection.close()

    thread = threading.Thread(target=accept)
    thread.start()
    yield addresses, visitors
    running.set()
    thread.join()
    for listener in sockets:
        listener.close()


CONNECT = """
import socket
for family, address in {addresses!r}:
    try:
        with socket.socket(family) as s:
            s.settimeout(2)
            s.connect(address)
            s.sendall(b"visit")
        print("connected")
    except OSError as error:
        print(type(error).__name__)
"""


@UNFILTERED_TOO
def test_no_listener_is_reached(inside, listeners):
    """Listeners outside that anybody here can reach are not reached from inside, by address nor by abstract name."""
    addresses, visitors = listeners
    source = CONNECT.format(addresses=[(int(family), address) for family, address in addresses])
    done = subprocess.run([sys.executable, "-c", source], check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["connected"] * len(
        addresses
    )  # outside it works: the test would see a connection
    deadline = time.monotonic() + 5
    while len(visitors) < len(addresses) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert visitors == [b"visit"] * len(addresses)
    assert "connected" not in inside(source)
    time.sleep(0.3)
    assert len(visitors) == len(addresses)


@UNFILTERED_TOO
def test_no_other_way_out(inside):
    """There is no interface that is up, no route, no name service, and no raw socket."""
    printed = inside(
        "import socket\n"
        "def attempt(f):\n    try: print('got', f())\n    except OSError: print('no')\n"
        "attempt(lambda: socket.getaddrinfo('example.org', 80))\n"
        "attempt(lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b'x', ('192.0.2.1', 9)))\n"
        "attempt(lambda: socket.socket(socket.AF_INET, socket.SOCK_RAW, 1))\n"
        "attempt(lambda: socket.socket(socket.AF_PACKET, socket.SOCK_RAW))\n"
    )
    assert printed.split() == ["no"] * 4
