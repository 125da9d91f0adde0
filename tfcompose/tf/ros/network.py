"""Detection of a network on this computer, and a wait for it.

DDS reads a computer's addresses only when a process joins. Without a network at that time, the
process never reaches other computers. This happens at boot before Wi-Fi is up, or with an
unplugged cable.
"""

from __future__ import annotations

import fcntl
import os
import socket
import struct
from contextlib import suppress
from threading import Event, Thread
from typing import TYPE_CHECKING

from tfcompose.tf.ros.environment import RANGE

if TYPE_CHECKING:
    from typing_extensions import Self

    from tfcompose.foundation.signals import Stop

#: Interval between checks for a network, in seconds.
CHECK_EVERY_S = 0.5
_FLAGS, _ADDRESS = 0x8913, 0x8915  # SIOCGIFFLAGS and SIOCGIFADDR of linux/sockios.h
_LOOPBACK, _RUNNING = 0x8, 0x40  # IFF_LOOPBACK and IFF_RUNNING of linux/if.h
_REQUEST = struct.Struct("16sH22x")  # ifreq: a name, and flags


def has_network() -> bool:
    """Return whether an interface other than the loopback is up and has an IPv4 address."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
        for _, name in socket.if_nameindex():
            request = _REQUEST.pack(name.encode(), 0)
            with suppress(OSError):  # no address, or removed
                flags = _REQUEST.unpack(fcntl.ioctl(opened, _FLAGS, request))[1]
                fcntl.ioctl(opened, _ADDRESS, request)
                if flags & (_LOOPBACK | _RUNNING) == _RUNNING:
                    return True
    return False


class FirstNetwork:
    """Requests ``stop`` when a network appears, if there is none at the start of the block.

    ``came`` tells whether this has happened. If ROS is limited to this computer, nothing happens.
    """

    def __init__(self, stop: Stop) -> None:
        self.came = False
        self._stop = stop
        self._ended = Event()

    def __enter__(self) -> Self:
        if os.environ.get(RANGE) not in {"LOCALHOST", "OFF"} and not has_network():
            Thread(target=self._wait, name="network", daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()

    def _wait(self) -> None:
        while not self._ended.wait(CHECK_EVERY_S):
            if has_network():
                self.came = not self._stop.requested
                self._stop.request()
                return
