"""The UDP sockets through which this process receives: buffer sizes and lost datagrams.

The middleware opens the sockets, and reports neither value. The kernel drops datagrams that arrive
while a socket's buffer is full. If publishers send at the same moment, it drops the last ones. A
reliable connection repeats them only with the writer's next heartbeat, 3 s later in Fast DDS.
"""

from __future__ import annotations

import os
import socket
import stat
import struct
from contextlib import suppress
from typing import TYPE_CHECKING

from tfcompose.foundation import procfs

if TYPE_CHECKING:
    from collections.abc import Iterator

#: Requested receive buffer of each socket, in bytes; the kernel grants at most ``LIMIT``.
WANTED = 16 * 1024 * 1024
#: The name of the kernel's limit in sysctl.
LIMIT = "net.core.rmem_max"
_MEMORY = struct.Struct("=9I")  # SK_MEMINFO_VARS of linux/sock_diag.h: the last one counts drops
_SO_MEMINFO = 55  # asm-generic/socket.h
_INTERNET = (socket.AF_INET, socket.AF_INET6)


def widen_buffers() -> None:
    """Set each socket's buffer to ``WANTED`` bytes, or to as many as the kernel grants."""
    for udp_socket in _udp_sockets():
        with suppress(OSError):
            if udp_socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) < WANTED:
                udp_socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, WANTED)


def buffer_limit() -> int | None:
    """Return the number of bytes that the kernel grants a socket, None if unknown."""
    return procfs.kernel_number(LIMIT)


class LostDatagrams:
    """Counts the datagrams that this process's sockets have lost since its creation."""

    def __init__(self) -> None:
        self._known = _drops()

    def take(self) -> int:
        """Return the number of datagrams lost since the last call."""
        before, self._known = self._known, _drops()
        return sum(max(0, drops - before.get(inode, 0)) for inode, drops in self._known.items())


def _drops() -> dict[int, int]:
    """Return the number of datagrams that each socket has lost, by inode."""
    drops = {}
    for udp_socket in _udp_sockets():
        with suppress(OSError):  # the kernel does not count them
            numbers = udp_socket.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, _MEMORY.size)
            drops[os.fstat(udp_socket.fileno()).st_ino] = _MEMORY.unpack(numbers)[-1]
    return drops


def _udp_sockets() -> Iterator[socket.socket]:
    """Yield this process's UDP sockets as duplicates that stay open during the iteration."""
    for descriptor in procfs.descriptors():
        with suppress(OSError):  # closed meanwhile
            if not stat.S_ISSOCK(os.fstat(descriptor).st_mode):
                continue
            with socket.socket(fileno=os.dup(descriptor)) as copy:
                if copy.family in _INTERNET and copy.type == socket.SOCK_DGRAM:
                    yield copy
