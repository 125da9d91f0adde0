"""Telling systemd that a process is ready: one datagram to the socket in NOTIFY_SOCKET, as sd_notify(3) says."""

from __future__ import annotations

import contextlib
import os
import socket


def ready() -> None:
    """Say READY=1; without systemd, or where nobody listens any more, do nothing."""
    address = os.environ.get("NOTIFY_SOCKET", "")
    if address[:1] not in {"/", "@"}:
        return
    name = f"\0{address[1:]}" if address[0] == "@" else address  # @: a name without a file
    with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as to_manager:
        to_manager.sendto(b"READY=1", name)
