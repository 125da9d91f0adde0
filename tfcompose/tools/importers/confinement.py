"""Confines this process by the kernel: it starts no program, writes no file, opens no socket, signals nobody else.

A seccomp filter (seccomp(2)) refuses these system calls, whoever makes them: Python, a module of
native code, or a launch file through ctypes. It cannot be taken off again. What is open already
stays open, and files can be read.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import platform
import resource
import struct
from typing import Final

MOST_CPU_S: Final = 30
MOST_MEMORY_BYTES: Final = 2 << 30
_CLONE_NEWUSER, _CLONE_NEWNET, _CLONE_THREAD = 0x10000000, 0x40000000, 0x10000
_NO_NEW_PRIVILEGES, _SET_FILTER, _EVERY_THREAD = 38, 1, 1
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC
#: Instructions of the filter (linux/bpf_common.h): load a word, compare it, end.
_LOAD, _EQUAL, _AT_LEAST, _ANY_BIT, _END = 0x20, 0x15, 0x35, 0x45, 0x06
_ALLOW, _REFUSE = 0x7FFF0000, 0x00050000
#: Where the filter finds the number, the architecture and the first argument (struct
#: seccomp_data).
_NUMBER, _ARCHITECTURE, _ARGUMENTS = 0, 4, 16
#: From here on numbers are those of x86-64's other calling convention, x32.
_X32 = 0x40000000
#: Numbers of system calls: on x86-64, and on arm64, which does not have all of them.
_NUMBERS: dict[str, tuple[int, int | None]] = {
    "fork": (57, None), "vfork": (58, None), "execve": (59, 221), "execveat": (322, 281), "ptrace": (101, 117),
    "kill": (62, 129), "tkill": (200, 130), "rt_sigqueueinfo": (129, 138), "rt_tgsigqueueinfo": (297, 240),
    "pidfd_send_signal": (424, 424), "pidfd_getfd": (438, 438), "process_vm_readv": (310, 270),
    "process_vm_writev": (311, 271), "socket": (41, 198), "io_uring_setup": (425, 425), "bpf": (321, 280),
    "perf_event_open": (298, 241), "userfaultfd": (323, 282), "keyctl": (250, 219), "add_key": (248, 217),
    "request_key": (249, 218), "mq_open": (240, 180), "mq_unlink": (241, 181), "shmget": (29, 194),
    "msgget": (68, 186), "semget": (64, 190), "creat": (85, None), "truncate": (76, 45), "rename": (82, None),
    "renameat": (264, 38), "renameat2": (316, 276), "mkdir": (83, None), "mkdirat": (258, 34), "rmdir": (84, None),
    "unlink": (87, None), "unlinkat": (263, 35), "link": (86, None), "linkat": (265, 37), "symlink": (88, None),
    "symlinkat": (266, 36), "mknod": (133, None), "mknodat": (259, 33), "chmod": (90, None), "fchmod": (91, 52),
    "fchmodat": (268, 53), "fchmodat2": (452, 452), "chown": (92, None), "fchown": (93, 55), "lchown": (94, None),
    "fchownat": (260, 54), "utime": (132, None), "utimes": (235, None), "futimesat": (261, None),
    "utimensat": (280, 88), "setxattr": (188, 5), "lsetxattr": (189, 6), "fsetxattr": (190, 7),
    "removexattr": (197, 14), "lremovexattr": (198, 15), "fremovexattr": (199, 16),
    "open_by_handle_at": (304, 265), "mount": (165, 40),
    "umount2": (166, 39), "move_mount": (429, 429), "open_tree": (428, 428), "fsopen": (430, 430),
    "mount_setattr": (442, 442), "pivot_root": (155, 41), "chroot": (161, 51), "setns": (308, 268),
    "unshare": (272, 97), "sethostname": (170, 161), "reboot": (169, 142), "swapon": (167, 224), "swapoff": (168, 225),
    "kexec_load": (246, 104), "init_module": (175, 105), "finit_module": (313, 273), "delete_module": (176, 106),
}  # fmt: skip
#: Those that callers do without where the kernel does not have them: their arguments lie where no
#: filter looks.
_UNKNOWN_TO_CALLERS = {"clone3": (435, 435), "openat2": (437, 437)}
_OPEN, _OPENAT, _CLONE, _TGKILL, _SECCOMP = (2, None), (257, 56), (56, 220), (234, 131), (317, 277)
#: By what ``platform.machine`` calls them: which of the numbers, and what the kernel calls the
#: architecture.
_MACHINES = {"x86_64": (0, 0xC000003E), "aarch64": (1, 0xC00000B7)}


def limit() -> None:
    """Bound this process's time and memory, and leave the network where that is allowed."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for kind, most, more in (
        (resource.RLIMIT_CPU, MOST_CPU_S, 1),
        (resource.RLIMIT_AS, MOST_MEMORY_BYTES, 0),
    ):
        hard = resource.getrlimit(kind)[1]
        if hard == resource.RLIM_INFINITY or most + more < hard:
            hard = most + more
        resource.setrlimit(kind, (min(most, hard), hard))
    with contextlib.suppress(OSError, AttributeError):
        libc = ctypes.CDLL(None, use_errno=True)
        if libc.unshare(_CLONE_NEWNET) != 0:
            libc.unshare(_CLONE_NEWUSER | _CLONE_NEWNET)


def confine() -> bool:
    """Let the kernel refuse from now on what this process may not do; return whether it does.

    It does not on other architectures than x86-64 and arm64, and where Linux was built without
    seccomp.
    """
    machine = _MACHINES.get(platform.machine())
    if machine is None:
        return False
    program = _program(*machine)
    number = _SECCOMP[machine[0]]
    try:
        libc = ctypes.CDLL(None, use_errno=True)
        text = ctypes.create_string_buffer(program)
        given = ctypes.create_string_buffer(
            struct.pack("HxxxxxxP", len(program) // 8, ctypes.addressof(text))
        )
        if libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0) != 0:
            return False
        return bool(libc.syscall(number, _SET_FILTER, _EVERY_THREAD, given) == 0)
    except (OSError, AttributeError):
        return False


def _program(column: int, architecture: int) -> bytes:
    """Return the filter as the kernel reads it (linux/filter.h), 8 bytes an instruction."""
    refuse, unknown = _REFUSE | errno.EPERM, _REFUSE | errno.ENOSYS
    lines = [
        (_LOAD, 0, 0, _ARCHITECTURE), (_EQUAL, 1, 0, architecture), (_END, 0, 0, refuse),
        (_LOAD, 0, 0, _NUMBER), (_AT_LEAST, 0, 1, _X32), (_END, 0, 0, refuse),
    ]  # fmt: skip
    several = [(one, refuse) for one in _NUMBERS.values()] + [
        (one, unknown) for one in _UNKNOWN_TO_CALLERS.values()
    ]
    for numbers, answer in several:
        number = numbers[column]
        if number is not None:
            lines += [(_EQUAL, 0, 1, number), (_END, 0, 0, answer)]
    # threads may be started, files be opened for reading, and signals be sent to this process:
    # abort() does
    arguments = (
        (_CLONE, 0, (_ANY_BIT, 0, 1, _CLONE_THREAD)),
        (_OPEN, 1, (_ANY_BIT, 1, 0, _WRITES)),
        (_OPENAT, 2, (_ANY_BIT, 1, 0, _WRITES)),
        (_TGKILL, 0, (_EQUAL, 0, 1, os.getpid())),
    )
    for numbers, index, allowed in arguments:
        number = numbers[column]
        if number is not None:
            lines += [(_EQUAL, 0, 4, number), (_LOAD, 0, 0, _ARGUMENTS + 8 * index), allowed]
            lines += [(_END, 0, 0, _ALLOW), (_END, 0, 0, refuse)]
    lines.append((_END, 0, 0, _ALLOW))
    return b"".join(struct.pack("HBBI", *line) for line in lines)
