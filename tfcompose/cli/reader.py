"""Whoever reads what a command writes, and may go away while nothing is written: ``tfcompose logs -f | head -1``."""

from __future__ import annotations

import select
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import socket
    from typing import TextIO


def is_read(stream: TextIO) -> bool:
    """Return whether somebody can still read what is written there."""
    return _first_of(stream, None, 0) != stream


def wait_for(connection: socket.socket, stream: TextIO) -> bool:
    """Wait until there is something to receive, or nobody reads the stream any more; return whether it is read.

    It is waited no longer than the connection's timeout.
    """
    timeout_s = connection.gettimeout()
    return _first_of(stream, connection, None if timeout_s is None else timeout_s * 1e3) != stream


def _first_of(stream: TextIO, connection: socket.socket | None, timeout_ms: float | None) -> object:
    """Return the stream if nobody reads it; else the connection if it has something; else None."""
    poll = select.poll()
    with suppress(OSError):  # it has no descriptor: nobody can leave
        poll.register(stream.fileno(), 0)
    if connection:
        poll.register(connection, select.POLLIN)
    found = [fd for fd, _ in poll.poll(timeout_ms)]
    if connection and connection.fileno() in found:
        found.remove(connection.fileno())
        return stream if found else connection
    return stream if found else None
