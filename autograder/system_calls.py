"""What a submission may not ask of the kernel: the filter of system calls that the sandbox runs it under.

Namespaces and rights decide what a submission can reach; the filter decides how much of the kernel it can try them on.
An exercise on filters computes, draws, writes files and starts a process at most. What else the kernel offers, and what
most ways out of a sandbox began with, is refused with EPERM, as the kernel itself refuses who has no right to it.

The program is made here, once, by libseccomp, whose tables know the numbers of calls on every machine; apt and systemd
need it, so it is there on Debian, Ubuntu and Fedora. It is called through ctypes: of its functions five are used, and
the bindings on PyPI would be one more package to trust. The program goes into the sandbox as bytes.
`worker.barrier` puts it in force after the warden has made its namespaces, for itself and all it forks.
"""

from __future__ import annotations

import ctypes
import errno
import os
import struct
from functools import cache

LIBRARY = "libseccomp.so.2"
# The families are named in the instructor guide, and each is tried by a test.
DENIED = {
    "sockets": ("socket", "bind", "listen", "accept", "accept4", "connect"),
    "other processes": (
        "ptrace", "process_vm_readv", "process_vm_writev", "process_madvise", "pidfd_getfd", "kcmp", "migrate_pages",
        "move_pages",
    ),
    "keys": ("add_key", "request_key", "keyctl"),
    "programs and events in the kernel": ("bpf", "perf_event_open", "userfaultfd", "fanotify_init", "fanotify_mark"),
    "mounts": (
        "mount", "umount2", "pivot_root", "chroot", "move_mount", "open_tree", "fsopen", "fsconfig", "fsmount",
        "fspick", "mount_setattr", "name_to_handle_at", "open_by_handle_at",
    ),
    "namespaces": ("unshare", "setns"),
    "the kernel itself": (
        "kexec_load", "kexec_file_load", "init_module", "finit_module", "delete_module", "create_module",
        "query_module", "get_kernel_syms", "reboot", "syslog", "uselib", "sysfs", "_sysctl", "nfsservctl",
        "lookup_dcookie",
    ),
    "queues to the kernel": ("io_uring_setup", "io_uring_enter", "io_uring_register", "io_setup", "io_submit"),
    "another machine": ("personality", "modify_ldt", "iopl", "ioperm", "vm86", "vm86old"),
    "the whole system": (
        "quotactl", "quotactl_fd", "swapon", "swapoff", "acct", "sethostname", "setdomainname", "vhangup",
        "settimeofday", "stime", "clock_settime", "clock_settime64", "clock_adjtime", "clock_adjtime64", "adjtimex",
    ),
    "memory that no limit counts": (
        "memfd_create", "memfd_secret", "shmget", "semget", "msgget", "mq_open", "setsockopt",
    ),
    "filters": ("seccomp",),
}  # fmt: skip
# A kernel may have calls that were not known when this was written: it says that it has none above this number.
LAST = 452

_ALLOW, _KILL = 0x7FFF0000, 0x80000000
_NE, _EQ_MASKED = 1, 7
_ON_OTHER_MACHINE, _OPTIMIZE, _BINARY_TREE = 2, 8, 2
_NAMESPACES = (
    0x00020000, 0x02000000, 0x04000000, 0x08000000, 0x10000000, 0x20000000, 0x40000000,
)  # fmt: skip
_AF_UNIX, _SOCK_STREAM, _SOCK_MASK = 1, 1, 0xF
_PR_SET_SECCOMP = 22
_SHARED_ANONYMOUS = 0x21


class FilterError(RuntimeError):
    """There is no filter of system calls to be had here; the text says what is missing."""


class _Comparison(ctypes.Structure):
    _fields_ = (
        ("argument", ctypes.c_uint),
        ("operation", ctypes.c_int),
        ("first", ctypes.c_uint64),
        ("second", ctypes.c_uint64),
    )


def _error(number: int) -> int:
    return 0x00050000 | number


@cache
def _library() -> ctypes.CDLL:
    try:
        library = ctypes.CDLL(LIBRARY)
    except OSError as error:
        raise FilterError("libseccomp, which makes its filter of system calls, is not installed") from error
    library.seccomp_init.restype = ctypes.c_void_p
    library.seccomp_init.argtypes = [ctypes.c_uint32]
    library.seccomp_attr_set.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_uint32]
    library.seccomp_rule_add_array.argtypes = [
        ctypes.c_void_p, ctypes.c_uint32, ctypes.c_int, ctypes.c_uint, ctypes.c_void_p,
    ]  # fmt: skip
    library.seccomp_export_bpf.argtypes = [ctypes.c_void_p, ctypes.c_int]
    library.seccomp_release.argtypes = [ctypes.c_void_p]
    return library


def number_of(name: str) -> int:
    """Return the number of a system call on this machine.

    Parameters
    ----------
    name : str
        As the kernel has it.

    Returns
    -------
    int
        Below 0 where this machine has no such call.

    Raises
    ------
    FilterError
        If libseccomp is missing, or does not know the call.
    """
    number = _library().seccomp_syscall_resolve_name(name.encode())
    if number == -1:
        raise FilterError(f"libseccomp is too old: it does not know {name}")
    return number


class _Filter:
    """A program in the making."""

    def __init__(self) -> None:
        self.library = _library()
        self.context = self.library.seccomp_init(_ALLOW)
        if not self.context:
            raise FilterError("libseccomp cannot make a filter here")
        # Calls of another machine's (32 bits, x32) have other numbers: who makes one is ended.
        self.check(self.library.seccomp_attr_set(self.context, _ON_OTHER_MACHINE, _KILL))
        # Optional: versions before 2.5 make a list that is searched from its beginning.
        self.library.seccomp_attr_set(self.context, _OPTIMIZE, _BINARY_TREE)

    def check(self, result: int) -> None:
        """Raise where libseccomp refused."""
        if result < 0:
            raise FilterError(f"libseccomp cannot make its filter ({os.strerror(-result)})")

    def refuse(self, name: str, *comparison: int, error: int = errno.EPERM) -> None:
        """Refuse a call, always or where one of its arguments compares so."""
        number = number_of(name)
        if number < 0:
            return  # not on this machine
        array = (_Comparison * 1)(_Comparison(*comparison)) if comparison else None
        result = self.library.seccomp_rule_add_array(
            self.context, _error(error), number, int(bool(comparison)), array
        )
        self.check(result)

    def export(self) -> bytes:
        """Return the program and forget it."""
        with os.fdopen(os.memfd_create("filter"), "w+b") as file:  # no folder that could be full
            self.check(self.library.seccomp_export_bpf(self.context, file.fileno()))
            self.library.seccomp_release(self.context)
            file.seek(0)
            return file.read()


@cache
def program() -> bytes:
    """Return the filter for this machine.

    Returns
    -------
    bytes
        Instructions of the kernel's packet filter, as ``struct sock_filter``.

    Raises
    ------
    FilterError
        If libseccomp is missing or too old.
    """
    made = _Filter()
    for names in DENIED.values():
        for name in names:
            made.refuse(name)
    for flag in _NAMESPACES:
        made.refuse("clone", 0, _EQ_MASKED, flag, flag)
    made.refuse("clone3", error=errno.ENOSYS)  # its flags are in memory; the C library takes `clone` then
    made.refuse("prctl", 0, _EQ_MASKED, 0xFFFFFFFF, _PR_SET_SECCOMP)
    # Many kernels give each session a share of the processors of its own. It is answered as if it had been done.
    made.refuse("setsid", error=0)
    # Shared memory of no file stays where no process has it in its tables any more.
    made.refuse("mmap", 3, _EQ_MASKED, _SHARED_ANONYMOUS, _SHARED_ANONYMOUS)
    # The warden's channels are connected pairs. Of a datagram's, a message could go to another notebook's.
    made.refuse("socketpair", 0, _NE, _AF_UNIX)
    for kind in range(_SOCK_MASK + 1):
        if kind != _SOCK_STREAM:
            made.refuse("socketpair", 1, _EQ_MASKED, _SOCK_MASK, kind)
    load_number = struct.pack("=HBBI", 0x20, 0, 0, 0)
    unless_above = struct.pack("=HBBI", 0x25, 0, 1, LAST)
    unknown = struct.pack("=HBBI", 0x06, 0, 0, _error(errno.ENOSYS))
    return load_number + unless_above + unknown + made.export()
