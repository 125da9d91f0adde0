"""Sandbox for a process that runs code from files: expressions of xacro, Python launch files.

The kernel enforces it for Python, ctypes and native code. seccomp(2) permits only the system calls
in a table. landlock(7) limits the files that can be opened. Neither can be removed again. Open
pipes and files stay open.

This module runs in the sandboxed process. ``confined`` starts such a process and talks to it. Each
expansion of a xacro file starts a process, so this module imports little.
"""

from __future__ import annotations

import ctypes
import errno
import json
import os
import resource
import signal
import struct
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tfcompose.foundation.procfs import threads

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

MOST_MEMORY_BYTES: Final = 2 << 30
#: Memory reserve that lets a process without memory report this.
_SPARE_BYTES: Final = 64 << 20
_MOST_FILES: Final = 256

#: Permitted system calls, with their numbers on x86-64 and on arm64, which lacks some.
_CALLS: Final[dict[str, tuple[int, int | None]]] = {
    # open files
    "read": (0, 63), "write": (1, 64), "readv": (19, 65), "writev": (20, 66), "pread64": (17, 67),
    "lseek": (8, 62), "close": (3, 57), "fstat": (5, 80), "dup": (32, 23), "dup2": (33, None),
    "dup3": (292, 24), "poll": (7, None), "ppoll": (271, 73), "select": (23, None),
    "pselect6": (270, 72), "getcwd": (79, 17),
    # memory
    "brk": (12, 214), "munmap": (11, 215), "mprotect": (10, 226), "mremap": (25, 216),
    # threads and signals of this process
    "futex": (202, 98), "set_robust_list": (273, 99), "rseq": (334, 293), "membarrier": (324, 283),
    "set_tid_address": (218, 96), "sched_yield": (24, 124), "exit": (60, 93),
    "exit_group": (231, 94), "rt_sigaction": (13, 134), "rt_sigprocmask": (14, 135),
    "rt_sigreturn": (15, 139), "sigaltstack": (131, 132), "restart_syscall": (219, 128),
    # time
    "clock_gettime": (228, 113), "clock_getres": (229, 114), "clock_nanosleep": (230, 115),
    "nanosleep": (35, 101), "gettimeofday": (96, 169), "time": (201, None), "times": (100, 153),
    "setitimer": (38, 103), "getitimer": (36, 102),
    # identity of this process
    "getpid": (39, 172), "gettid": (186, 178), "getppid": (110, 173), "getuid": (102, 174),
    "geteuid": (107, 175), "getgid": (104, 176), "getegid": (108, 177), "uname": (63, 160),
    "sysinfo": (99, 179), "getrusage": (98, 165), "getcpu": (309, 168), "getrandom": (318, 278),
}  # fmt: skip
#: System calls that examine files. open and openat are among the conditions.
_FILE_CALLS: Final[dict[str, tuple[int, int | None]]] = {
    "stat": (4, None), "lstat": (6, None), "newfstatat": (262, 79), "statx": (332, 291),
    "access": (21, None), "faccessat": (269, 48), "faccessat2": (439, 439),
    "readlink": (89, None), "readlinkat": (267, 78), "getdents64": (217, 61), "chdir": (80, 49),
}  # fmt: skip


class _Condition(NamedTuple):
    """A condition on an argument of a system call. The call is permitted if it is true."""

    numbers: tuple[int, int | None]
    argument: int
    #: Permitted values of the argument.
    values: tuple[int, ...] = ()
    #: Bits that the argument must not have.
    without_bits: int = 0
    #: The error number of a rejected call.
    refusal: int = errno.EPERM


_WRITES: Final = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC
_OPENS: Final = (
    _Condition((2, None), 1, without_bits=_WRITES),  # open
    _Condition((257, 56), 2, without_bits=_WRITES),  # openat
)
#: Flags with which glibc and musl start a thread of the process, without a new namespace.
_THREAD: Final = (0x3D0F00, 0x7D0F00)
#: F_DUPFD, F_GETFD, F_SETFD, F_GETFL and F_DUPFD_CLOEXEC. Locks, leases and owners are excluded.
_DESCRIPTORS: Final = (0, 1, 2, 3, 1030)
#: TCGETS, TIOCGWINSZ, FIONREAD, FIONCLEX and FIOCLEX, which isatty and open use.
_TERMINAL: Final = (0x5401, 0x5413, 0x541B, 0x5450, 0x5451)
#: NORMAL to DONTNEED, FREE, HUGEPAGE to DODUMP, and the guard pages of glibc's stacks.
_ADVICE: Final = (0, 1, 2, 3, 4, 8, 14, 15, 16, 17, 102, 103)
#: PR_SET_NAME and PR_GET_NAME for threads, and PR_SET_VMA, which names memory.
_NAMES: Final = (15, 16, 0x53564D41)
#: MAP_LOCKED and MAP_HUGETLB take memory from all processes of the machine.
_SCARCE: Final = 0x2000 | 0x40000


def _conditions() -> tuple[_Condition, ...]:
    pid = os.getpid()
    return (
        _Condition((9, 222), 3, without_bits=_SCARCE),  # mmap
        _Condition((28, 233), 2, _ADVICE, refusal=errno.EINVAL),  # madvise
        _Condition((56, 220), 0, _THREAD),  # clone
        _Condition((72, 25), 1, _DESCRIPTORS),  # fcntl
        _Condition((16, 29), 1, _TERMINAL),  # ioctl
        _Condition((157, 167), 0, _NAMES),  # prctl
        _Condition((302, 261), 0, (0, pid)),  # prlimit64
        _Condition((204, 123), 0, (0, pid)),  # sched_getaffinity
        _Condition((234, 131), 0, (pid,)),  # tgkill, by which abort() ends this process
    )


#: System calls from this number on are new, and callers have fallbacks. Examples are clone3 and
#: openat2, whose arguments a filter cannot read.
_NEW_CALLS: Final = 424
#: Numbers from this one on belong to x32, another calling convention of x86-64.
_X32: Final = 0x40000000
#: Instructions of the filter (linux/bpf_common.h): load a word, compare it, end.
_LOAD, _EQUAL, _AT_LEAST, _ANY_BIT, _END = 0x20, 0x15, 0x35, 0x45, 0x06
_ALLOW, _REFUSE = 0x7FFF0000, 0x00050000
#: Offsets of the number, the architecture and the arguments in struct seccomp_data.
_NUMBER, _ARCHITECTURE, _ARGUMENTS = 0, 4, 16
#: The column of the tables, and the kernel's number of the architecture, by
#: ``os.uname().machine``.
MACHINES: Final = {"x86_64": (0, 0xC000003E), "aarch64": (1, 0xC00000B7)}

_SECCOMP: Final = (317, 277)
_SET_FILTER, _EVERY_THREAD = 1, 1
_SET_DEATH_SIGNAL, _NO_NEW_PRIVILEGES = 1, 38
#: Capabilities of root (linux/capability.h) to keep: CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH,
#: which permit reading files of other users. With further capabilities a process could raise its
#: limits again.
_CAPSET, _CAPGET = (126, 91), (125, 90)
_CAPABILITY_VERSION, _KEPT_CAPABILITIES = 0x20080522, 0b110
_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_GET_VERSION, _PATH_BENEATH = 1, 1
_READ_FILE, _READ_FOLDER = 1 << 2, 1 << 3
#: Rights for files by version of Landlock. Rights without a rule are denied.
_FILE_RIGHTS: Final = {1: 0x1FFF, 2: 0x3FFF, 3: 0x7FFF, 4: 0x7FFF, 5: 0xFFFF}
#: Rights for TCP since version 4, and scopes for abstract sockets and signals since version 6.
_NET_RIGHTS, _SCOPES = 0b11, 0b11


class Readable(NamedTuple):
    """Paths that a sandboxed process may open, with everything below, and folders it may list."""

    paths: Sequence[str]
    listed: Sequence[str] = ()


def limit(wall_s: float) -> None:
    """Limit time and memory of this process, and make it end with its parent."""
    libc = ctypes.CDLL(None)
    libc.prctl(_SET_DEATH_SIGNAL, signal.SIGKILL, 0, 0, 0)
    cpu_s = int(wall_s) + 1
    for kind, soft, hard in (
        (resource.RLIMIT_CPU, cpu_s, cpu_s + 1),
        (resource.RLIMIT_AS, MOST_MEMORY_BYTES, MOST_MEMORY_BYTES + _SPARE_BYTES),
        (resource.RLIMIT_NOFILE, _MOST_FILES, _MOST_FILES),
        *((kind, 0, 0) for kind in (
            resource.RLIMIT_CORE, resource.RLIMIT_FSIZE, resource.RLIMIT_MEMLOCK
        )),
    ):  # fmt: skip
        before = resource.getrlimit(kind)[1]
        most = hard if before == resource.RLIM_INFINITY else min(hard, before)
        resource.setrlimit(kind, (min(soft, most), most))


def take_spare_memory() -> None:
    """Make the reserved memory available."""
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (hard, hard))


def confine(readable: Readable | None) -> list[str]:
    """Put this process into the sandbox, and return the features that the kernel lacks.

    Without ``readable``, no file can be opened or examined.

    Raises:
        RuntimeError: if other threads exist, because Landlock would not apply to them.
    """
    if threads() > 1:
        raise RuntimeError("a process is confined before it starts threads")
    libc = ctypes.CDLL(None, use_errno=True)
    libc.syscall.restype = ctypes.c_long
    libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0)
    _drop_capabilities(libc)
    missing = [] if _restrict_files(libc, readable) else ["Landlock"]
    return missing if _filter_calls(libc, files=readable is not None) else [*missing, "seccomp"]


def _drop_capabilities(libc: ctypes.CDLL) -> None:
    machine = MACHINES.get(os.uname().machine)
    if machine is None:
        return
    header = struct.pack("Ii", _CAPABILITY_VERSION, 0)
    data = ctypes.create_string_buffer(
        24
    )  # effective, permitted and inheritable; then their high words
    if libc.syscall(_CAPGET[machine[0]], header, data) == 0:
        effective, permitted = struct.unpack_from("2I", data)
        kept = (effective & _KEPT_CAPABILITIES, permitted & _KEPT_CAPABILITIES, 0, 0, 0, 0)
        libc.syscall(_CAPSET[machine[0]], header, struct.pack("6I", *kept))


def _restrict_files(libc: ctypes.CDLL, readable: Readable | None) -> bool:
    """Return whether Landlock restricts this thread and threads that it starts."""
    version = libc.syscall(_CREATE_RULESET, None, ctypes.c_size_t(0), _GET_VERSION)
    if version < 1:
        return False
    rights = _FILE_RIGHTS[min(version, max(_FILE_RIGHTS))]
    attributes = [rights]
    attributes += [_NET_RIGHTS] if version >= 4 else []  # noqa: PLR2004
    attributes += [_SCOPES] if version >= 6 else []  # noqa: PLR2004
    data = struct.pack(f"{len(attributes)}Q", *attributes)
    ruleset = libc.syscall(_CREATE_RULESET, data, ctypes.c_size_t(len(data)), 0)
    if ruleset < 0:
        return False
    try:
        for path in readable.paths if readable else ():
            _add_rule(libc, ruleset, path, _READ_FILE | _READ_FOLDER)
        for path in readable.listed if readable else ():
            _add_rule(libc, ruleset, path, _READ_FOLDER)
        return bool(libc.syscall(_RESTRICT_SELF, ruleset, 0) == 0)
    finally:
        os.close(ruleset)


def _add_rule(libc: ctypes.CDLL, ruleset: int, path: str, rights: int) -> None:
    try:
        file = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:  # the path does not exist
        return
    try:
        is_folder = os.fstat(file).st_mode & 0o170000 == 0o040000  # noqa: PLR2004
        rule = struct.pack("=Qi", rights if is_folder else rights & _READ_FILE, file)
        libc.syscall(_ADD_RULE, ruleset, _PATH_BENEATH, rule, 0)
    finally:
        os.close(file)


def _filter_calls(libc: ctypes.CDLL, *, files: bool) -> bool:
    """Return whether seccomp filters the system calls of this process (x86-64 and arm64 only)."""
    machine = MACHINES.get(os.uname().machine)
    if machine is None:
        return False
    column, architecture = machine
    program = filter_program(column, architecture, files=files)
    text = ctypes.create_string_buffer(program)
    header = struct.pack("HxxxxxxP", len(program) // 8, ctypes.addressof(text))
    return bool(libc.syscall(_SECCOMP[column], _SET_FILTER, _EVERY_THREAD, header) == 0)


def filter_program(column: int, architecture: int, *, files: bool) -> bytes:
    """Return the filter in the kernel's format (linux/filter.h), 8 bytes per instruction."""
    refuse, unknown = _REFUSE | errno.EPERM, _REFUSE | errno.ENOSYS
    lines = [
        (_LOAD, 0, 0, _ARCHITECTURE), (_EQUAL, 1, 0, architecture), (_END, 0, 0, refuse),
        (_LOAD, 0, 0, _NUMBER), (_AT_LEAST, 0, 1, _X32), (_END, 0, 0, refuse),
    ]  # fmt: skip
    for numbers in (*_CALLS.values(), *(_FILE_CALLS.values() if files else ())):
        number = numbers[column]
        if number is not None:
            lines += [(_EQUAL, 0, 1, number), (_END, 0, 0, _ALLOW)]
    for condition in (*_conditions(), *(_OPENS if files else ())):
        number = condition.numbers[column]
        if number is not None:
            block = list(_condition_block(condition))
            lines += [(_EQUAL, 0, len(block), number), *block]
    lines += [(_AT_LEAST, 0, 1, _NEW_CALLS), (_END, 0, 0, unknown), (_END, 0, 0, refuse)]
    return b"".join(struct.pack("HBBI", *line) for line in lines)


def _condition_block(condition: _Condition) -> Iterable[tuple[int, int, int, int]]:
    """Yield the instructions that check the low word of an argument of a call."""
    yield (_LOAD, 0, 0, _ARGUMENTS + 8 * condition.argument)
    if condition.without_bits:
        yield (_ANY_BIT, 0, 1, condition.without_bits)
    for left, value in zip(range(len(condition.values), 0, -1), condition.values, strict=True):
        yield (_EQUAL, left, 0, value)
    yield (_END, 0, 0, _REFUSE | condition.refusal)
    yield (_END, 0, 0, _ALLOW)


class Channel:
    """The sandboxed process's ends of the pipes to its parent, for lines of JSON and bytes."""

    def __init__(self, reads: int, writes: int) -> None:
        self._reads, self._writes = os.fdopen(reads, "rb"), os.fdopen(writes, "wb")

    def send(self, message: Any) -> None:
        """Send a message. Values that JSON lacks are sent as text."""
        self._writes.write(json.dumps(message, default=str).encode() + b"\n")
        self._writes.flush()

    def receive(self) -> Any:
        """Wait for a message and return it."""
        return json.loads(self._reads.readline())

    def receive_bytes(self, count: int) -> bytes:
        """Return the bytes that follow a message."""
        return self._reads.read(count)
