"""ROS domains that tests have to themselves."""

from __future__ import annotations

import fcntl
import os
import tempfile
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

#: The domains that a test may have; CI's own run of a robot has 101.
DOMAINS = 100
_TURN = count(os.getpid())


@contextmanager
def reserved_domain() -> Iterator[int]:
    """Give a domain from 1 to 100, locked by a file so that concurrent runs do not hear each other.

    Each test has the next one: what a test before left behind may need a moment to end.
    """
    for _ in range(DOMAINS):
        number = 1 + next(_TURN) % DOMAINS
        path = Path(tempfile.gettempdir()) / f"tfcompose-test-domain-{number}.lock"
        descriptor = os.open(path, os.O_CREAT | os.O_RDWR, 0o666)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(descriptor)
            continue
        try:
            yield number
        finally:
            os.close(descriptor)
        return
    raise RuntimeError("all ROS domains are in use by other tests")
