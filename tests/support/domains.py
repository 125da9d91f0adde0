"""ROS domains that tests have to themselves."""

import fcntl
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import pytest

#: The domains that tests may have; CI's own run of a robot has 101.
DOMAINS = range(1, 101)
_WINDOW = count(os.getpid())


@dataclass(frozen=True)
class Domain:
    """A ROS domain that nobody else on this machine uses during the test.

    ``environment`` is a process's.
    """

    id: int
    environment: Mapping[str, str]


def own_share(numbers: range) -> range:
    """Return the numbers that this worker of pytest-xdist has to itself.

    Each worker has about as many.
    """
    workers = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    return numbers[worker * len(numbers) // workers : (worker + 1) * len(numbers) // workers]


@contextmanager
def reserved_domain() -> Iterator[int]:
    """Give a ROS domain of this worker's own, locked by a file against concurrent runs.

    Each test has the next one: what a test before left behind may need a moment to end.

    Raises:
        RuntimeError: if there is none.
    """
    domains = own_share(DOMAINS)
    for _ in domains:
        number = domains[next(_WINDOW) % len(domains)]
        try:
            descriptor = _opened(
                Path(tempfile.gettempdir()) / f"tfcompose-test-domain-{number}.lock"
            )
        except PermissionError:  # of a user who lets nobody read it
            continue
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            is_free = number not in domains_in_use()
        except BlockingIOError:
            is_free = False
        if not is_free:
            os.close(descriptor)
            continue
        try:
            yield number
        finally:
            os.close(descriptor)
        return
    raise RuntimeError("all ROS domains are in use by other tests")


@contextmanager
def entered_domain(folder: Path) -> Iterator[Domain]:
    """Enter a domain on the loopback interface, in this process's environment too.

    Runs and logs are kept in the folder.
    """
    with reserved_domain() as number, pytest.MonkeyPatch.context() as patch:
        for name in ("XDG_RUNTIME_DIR", "ROS_LOG_DIR"):
            (folder / name).mkdir(mode=0o700)
            patch.setenv(name, str(folder / name))
        patch.setenv("ROS_DOMAIN_ID", str(number))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        yield Domain(number, dict(os.environ))


def domains_in_use() -> set[int]:
    """Return the domains of whoever runs here, tests or not.

    Each has 250 ports to listen on (RTPS 2.2, 9.6.1.1).
    """
    sockets = Path("/proc/net/udp").read_text("ascii").splitlines()[1:]
    ports = {int(line.split()[1].rpartition(":")[2], 16) for line in sockets}
    return {(port - 7400) // 250 for port in ports}


def _opened(path: Path) -> int:
    """Return a descriptor of the file, which other users can read."""
    try:
        return os.open(path, os.O_RDONLY)
    except FileNotFoundError:
        descriptor = os.open(path, os.O_CREAT | os.O_RDONLY, 0o644)
        os.fchmod(descriptor, 0o644)
        return descriptor
