"""The filter of system calls: what no exercise needs is refused from inside, and what one needs works as before."""

from __future__ import annotations

import os
import platform
import struct

import pytest

from autograder import sandbox as sandbox_
from autograder import system_calls
from autograder.sandbox import Sandbox, SandboxError
from autograder.session import Session
from autograder.system_calls import DENIED, LAST, FilterError, number_of
from autograder.worker import barrier

EPERM, ENOSYS = 1, 38
# Each call in a process of its own: without the filter, some would change or end the one that makes them.
TRY = """
import ctypes, os
libc = ctypes.CDLL(None, use_errno=True)
def attempt(number, *arguments):
    reading, writing = os.pipe()
    pid = os.fork()
    if pid == 0:
        result = libc.syscall(number, *[ctypes.c_long(a) for a in arguments])
        os.write(writing, str(ctypes.get_errno() if result == -1 else 0).encode())
        os._exit(0)
    os.close(writing)
    said = os.read(reading, 9)
    os.close(reading)
    os.waitpid(pid, 0)
    return int(said or -1)
"""


@pytest.fixture
def inside(sandbox, unfiltered, limits):
    """Run one cell, with the filter or without, and return what it printed."""
    sessions = []

    def run(source, *, filtered=True):
        sessions.append(Session(sandbox if filtered else unfiltered, limits))
        result = sessions[-1].cell(source)
        assert result.succeeded, (result.ended, result.outputs)
        return "".join(o["text"] for o in result.outputs if o["output_type"] == "stream")

    yield run
    for session in sessions:
        session.close()


def errors(inside, calls, *, filtered=True):
    """Return the error numbers of system calls, each a number and its arguments, made from a cell; 0 for success."""
    printed = inside(f"{TRY}print([attempt(*call) for call in {calls!r}])", filtered=filtered)
    return [int(word) for word in printed.strip("[]\n").split(",")]


# Calls that anybody may make on any kernel of the last ten years, with arguments with which they succeed.
FREE = {
    "socket": (1, 1, 0),
    "ptrace": (0, 0, 0, 0),
    "unshare": (0x200,),
    "personality": (0xFFFFFFFF,),
    "shmget": (0, 4096, 0o600),
    "semget": (0, 1, 0o600),
    "msgget": (0, 0o600),
    "seccomp": (0, 0, 0),
}


def test_every_call_of_every_family_is_refused(inside):
    """All calls that the filter names and this machine has are refused with the same error, whatever they ask."""
    names = [name for family in DENIED.values() for name in family if number_of(name) >= 0]
    assert len(names) > 60
    calls = [(number_of(name), *([-1] * 6)) for name in names]
    refused = errors(inside, calls)
    assert [name for name, number in zip(names, refused, strict=True) if number != EPERM] == []
    without = errors(inside, calls, filtered=False)
    told_apart = {name for name, number in zip(names, without, strict=True) if number != EPERM}
    # To the others somebody without rights gets this error from the kernel too, or it is a matter of its settings.
    assert {"socket", "connect", "process_vm_readv", "unshare", "setns", "keyctl"} <= told_apart
    assert len(told_apart) > 25


def test_what_anybody_may_call_succeeds_without_the_filter(inside):
    """Calls with arguments that the kernel accepts from anybody succeed without the filter, and are refused with it."""
    calls = [(number_of(name), *arguments) for name, arguments in FREE.items()]
    assert errors(inside, calls) == [EPERM] * len(FREE)
    assert errors(inside, calls, filtered=False) == [0] * len(FREE)


NAMESPACES = (0x20000, 0x02000000, 0x04000000, 0x08000000, 0x10000000, 0x20000000, 0x40000000)
CLONE = """
def clone(flags):
    result = libc.syscall({clone}, ctypes.c_long(flags | 17), *[ctypes.c_long(0)] * 4)
    if result == 0:
        os._exit(0)
    error = ctypes.get_errno() if result == -1 else 0
    if result > 0:
        os.waitpid(result, 0)
    return error
print([clone(flags) for flags in {flags!r}])
"""


def test_no_process_starts_in_a_new_namespace(inside):
    """A process with a new namespace of any kind is refused; without the filter it is had with a user namespace."""
    flags = [0, *NAMESPACES, *(f | 0x10000000 for f in NAMESPACES)]
    source = TRY + CLONE.format(clone=number_of("clone"), flags=flags)
    assert inside(source) == f"{[0] + [EPERM] * 14}\n"
    assert inside(source, filtered=False).startswith(f"{[0] + [EPERM] * 4}"[:-1])
    users = "\nimport subprocess\nprint(subprocess.run(['unshare', '-U', 'true'], capture_output=True).returncode == 0)"
    assert inside(users) == "False\n"


def test_arguments_in_memory_and_calls_of_newer_kernels_are_unknown(inside):
    """`clone3`, whose flags no filter can read, and calls newer than the filter, are answered as by an older kernel."""
    calls = [(number_of("clone3"), 0, 0), (LAST + 1, 0, 0), (1000, 0), (0x40000000 | 39,), (-5,)]
    assert errors(inside, calls) == [ENOSYS] * 5
    assert errors(inside, calls[:1], filtered=False) != [ENOSYS]


MACHINE_CODE = """
import ctypes, mmap, os
memory = mmap.mmap(-1, 4096, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS, prot=7)
memory.write(b"\\x53\\xb8\\x14\\x00\\x00\\x00\\xcd\\x80\\x5b\\xc3")  # push rbx; eax = 20; int 0x80; pop rbx; ret
pid = os.fork()
if pid == 0:
    function = ctypes.CFUNCTYPE(ctypes.c_int)(ctypes.addressof(ctypes.c_char.from_buffer(memory)))
    os._exit(0 if function() == os.getpid() else 1)
print(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
"""


def test_calls_of_another_machine_end_the_process(inside):
    """A call by the numbers of 32 bits, which the filter does not know, ends the process that makes it."""
    if platform.machine() == "x86_64":  # the code is of that machine
        assert inside(MACHINE_CODE) == "-31\n"
        assert inside(MACHINE_CODE, filtered=False) != "-31\n"


def test_pairs_of_sockets_are_streams(inside):
    """Of sockets there are connected pairs of streams alone: of datagrams, one could write to another notebook."""
    number, flags = number_of("socketpair"), 0o2000000 | 0o4000
    calls = [(number, 1, kind, 0, -1) for kind in (1, 1 | flags, 2, 2 | flags, 3, 5)] + [
        (number, 2, 1, 0, -1)
    ]
    assert (
        errors(inside, calls) == [14, 14] + [EPERM] * 5
    )  # 14: no place to put the pair, so the kernel was asked
    assert EPERM not in errors(inside, calls, filtered=False)


def test_no_second_filter(inside):
    """A submission cannot put a filter of its own in force by `prctl`, whatever stands in the argument's upper half."""
    calls = [(number_of("prctl"), option, 2, 0) for option in (22, 22 | 1 << 32)]
    assert errors(inside, calls) == [EPERM, EPERM]
    assert errors(inside, calls, filtered=False) == [14, 14]


LISTEN = (
    "import socket\ns = socket.socket(socket.AF_UNIX)\ns.bind('\\0meeting')\ns.listen()\nprint('listens')"
)
VISIT = "import socket\ns = socket.socket(socket.AF_UNIX)\ns.connect('\\0meeting')\nprint('met')"


def test_two_notebooks_at_a_time_do_not_meet(sandbox, unfiltered, limits):
    """Two notebooks that are graded in one sandbox at the same time share its abstract names; no socket has one."""
    for running, expected in ((unfiltered, "listensmet"), (sandbox, "")):
        first, second = Session(running, limits), Session(running, limits)
        outputs = first.cell(LISTEN).outputs + second.cell(VISIT).outputs
        assert "".join(o.get("text", "").strip() for o in outputs) == expected
        first.close()
        second.close()


NEEDED = """
%matplotlib inline
import asyncio, ctypes, multiprocessing, os, subprocess, tempfile, threading, time
import numpy as np, scipy.linalg, scipy.optimize, scipy.integrate, sympy as sp
import matplotlib.pyplot as plt
from IPython.display import display, Math
from multiprocessing import shared_memory
print(float(np.linalg.eigvalsh(np.eye(300) * 2)[0]), scipy.optimize.brentq(lambda x: x - 1, 0, 3))
print(scipy.integrate.quad(lambda x: x, 0, 2)[0], sp.limit(sp.sin(sp.Symbol("x")) / sp.Symbol("x"), sp.Symbol("x"), 0))
print(ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int)(lambda a: a + 1)(3))
thread = threading.Thread(target=print, args=["thread"]); thread.start(); thread.join()
loop = asyncio.new_event_loop(); print(loop.run_until_complete(asyncio.sleep(0, "loop"))); loop.close()
print(subprocess.run(["echo", "process"], capture_output=True, text=True).stdout.strip())
with multiprocessing.get_context("fork").Pool(2) as pool: print(pool.map(abs, [-1, 2]))
block = shared_memory.SharedMemory(create=True, size=10); block.close(); block.unlink()
with tempfile.TemporaryDirectory() as folder: np.save(os.path.join(folder, "a.npy"), np.ones(3))
print(time.strftime("%Y", time.localtime(0)), os.cpu_count() > 0, len(os.sched_getaffinity(0)) > 0)
plt.plot([1, 2]); plt.title("$x$"); plt.savefig("figure.pdf"); plt.savefig("figure.svg")
display(Math("x"))
"""


def test_what_exercises_need_works(sandbox, limits):
    """Numbers, symbols, figures, threads, processes, shared memory and an event loop work under the filter."""
    session = Session(sandbox, limits)
    result = session.cell(NEEDED)
    assert result.succeeded, (result.ended, result.outputs)
    printed = "".join(o["text"] for o in result.outputs if o["output_type"] == "stream").split("\n")
    assert printed == ["2.0 1.0", "2.0 1", "4", "thread", "loop", "process", "[1, 2]", "1970 True True", ""]
    assert [*result.outputs[-1]["data"]] == ["text/plain", "image/png"]
    session.close()


# Where there is none to be had.


def test_without_libseccomp_it_refuses_and_names_the_remedy(monkeypatch):
    """Where libseccomp is missing nothing is run, and the message says what to install."""
    monkeypatch.setattr(system_calls, "LIBRARY", "libseccomp-that-is-not-there.so")
    system_calls._library.cache_clear()
    system_calls.program.cache_clear()
    try:
        with pytest.raises(
            SandboxError, match=r"libseccomp[\s\S]*not installed[\s\S]*libseccomp2[\s\S]*trust_submissions"
        ):
            Sandbox()
    finally:
        system_calls._library.cache_clear()


def test_a_call_that_libseccomp_does_not_know_is_refused_to_be_left_out(monkeypatch):
    """A libseccomp too old to know a call that must be refused makes no filter with a hole."""
    monkeypatch.setitem(system_calls.DENIED, "keys", ("a_call_of_the_future",))
    with pytest.raises(FilterError, match="too old: it does not know a_call_of_the_future"):
        system_calls.program.__wrapped__()


def test_where_the_kernel_refuses_the_filter_it_says_so(monkeypatch):
    """A kernel that does not take the filter ends in a refusal to grade, not in grading without."""
    monkeypatch.setattr(sandbox_, "program", lambda: b"\xff" * 8)
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    with pytest.raises(
        SandboxError, match=r"kernel refuses its filter of system calls: \[Errno 22\] Invalid argument"
    ):
        Sandbox()


def test_a_filter_that_refuses_nothing_is_noticed():
    """A filter that is taken and lets everything pass is no filter."""
    assert "does not follow" in barrier.refusal(struct.pack("=HBBI", 0x06, 0, 0, 0x7FFF0000))
    assert barrier.refusal(system_calls.program()) == ""
    assert "ends at once" in barrier.refusal(struct.pack("=HBBI", 0x06, 0, 0, 0x80000000))


UNCOUNTED = """
import mmap, os, socket
def error(call, *args):
    try:
        call(*args)
    except OSError as e:
        return e.errno
    return 0
a, b = socket.socketpair()
print([
    error(mmap.mmap, -1, 4096), error(mmap.mmap, -1, 4096, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS),
    error(os.open, "/dev/zero", os.O_RDWR), error(a.setsockopt, socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 20),
])
"""


def test_memory_that_no_limit_counts_is_refused(inside):
    """Shared memory of no file, and larger buffers of sockets, are refused; memory of one's own is not."""
    assert inside(UNCOUNTED) == f"[{EPERM}, 0, 13, {EPERM}]\n"
    assert inside(UNCOUNTED, filtered=False) == "[0, 0, 13, 0]\n"


def test_a_session_of_its_own_is_none(inside):
    """Leaving the session succeeds and does nothing: each session would have a share of the processors of its own."""
    source = "import os\nif (pid := os.fork()) == 0:\n    before = os.getsid(0)\n    os.setsid()\n"
    source += "    os._exit(os.getsid(0) == before)\nprint(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))"
    assert inside(source) == "1\n"
    assert inside(source, filtered=False) == "0\n"
