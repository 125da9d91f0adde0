"""ROS domains reserved for one run, so that runs on this machine do not hear each other.

A domain is reserved by a lock on a file in /tmp, which is the same for all users and whatever
TMPDIR is, and by the TCP port that ROS's own tests bind for theirs (package domain_coordinator).
Both are free again when the process ends.
"""

from __future__ import annotations

import fcntl
import os
import socket
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.foundation import procfs
from tfcompose.tf.ros.environment import RosError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

#: Domains with all ports below those that Linux assigns to clients; 0 is the default domain.
DOMAINS = range(1, 101)
#: A domain has this many ports, from the first one on (RTPS 2.2, 9.6.1.1).
_FIRST_PORT, _PORTS = 7400, 250
#: The port of domain 0 in domain_coordinator.
_FIRST_LOCK_PORT = 32768
_LOCKS = Path("/tmp")  # noqa: S108 (the files are empty)


@contextmanager
def reserve_domain(domains: Iterable[int]) -> Iterator[int]:
    """Reserve the first of these domains that is neither locked nor in use, during the block.

    Raises:
        RosError: if there is none.
    """
    for domain in domains:
        with ExitStack() as stack:
            if _lock(domain, stack) and domain not in domains_in_use():
                yield domain
                return
    raise RosError("every ROS domain is in use")


def domains_in_use() -> set[int]:
    """Return the domains whose ports a process on this machine listens on."""
    return {(port - _FIRST_PORT) // _PORTS for port in procfs.udp_ports()}


def _lock(domain: int, stack: ExitStack) -> bool:
    """Lock a domain until the stack is closed; return whether that was possible."""
    try:
        descriptor = _open(_LOCKS / f"tfcompose-test-domain-{domain}.lock")
    except PermissionError:  # another user's file that only its owner can read
        return False
    stack.callback(os.close, descriptor)
    port = stack.enter_context(socket.socket())
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        port.bind(("", _FIRST_LOCK_PORT + domain))
    except OSError:
        return False
    return True


def _open(path: Path) -> int:
    """Return a descriptor of the file, which other users can read."""
    flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC
    try:
        return os.open(path, flags)
    except FileNotFoundError:
        descriptor = os.open(path, flags | os.O_CREAT, 0o644)
        os.fchmod(descriptor, 0o644)
        return descriptor
