"""ROS domains that tests have to themselves."""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import pytest

from tfcompose.tf.ros.domains import DOMAINS, reserve_domain

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
        RosError: if there is none.
    """
    domains = own_share(DOMAINS)
    begin = next(_WINDOW) % len(domains)
    with reserve_domain([*domains[begin:], *domains[:begin]]) as number:
        yield number


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
