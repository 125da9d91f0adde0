"""Reserved ROS domains."""

import fcntl
import socket
from pathlib import Path

import pytest

from tests.support.domains import Domain, own_share, reserved_domain
from tfcompose.tf.ros.domains import DOMAINS, domains_in_use, reserve_domain
from tfcompose.tf.ros.environment import RosError
from tfcompose.tf.ros.node import open_node

pytestmark = pytest.mark.ros


def test_an_occupied_or_locked_domain_is_not_reserved(
    domain: Domain, monkeypatch: pytest.MonkeyPatch
) -> None:
    with reserved_domain() as locked_id:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(locked_id))
        stranger = open_node("stranger", "")
        stranger.__enter__()
    try:  # no process has locked it any more
        assert locked_id in domains_in_use()
        with reserve_domain([domain.id, locked_id, *own_share(DOMAINS)]) as number:
            assert number not in {domain.id, locked_id}
        with pytest.raises(RosError), reserve_domain([domain.id, locked_id]):
            pass
    finally:
        stranger.__exit__(None, None, None)


def test_a_domain_of_ros_own_tests_is_not_reserved(domain: Domain) -> None:
    """domain_coordinator binds TCP port 32768 + domain."""
    with reserved_domain() as first, reserved_domain() as second:
        assert len({domain.id, first, second}) == 3
    with socket.socket() as port:
        port.bind(("", 32768 + first))
        with reserve_domain([first, second]) as number:
            assert number == second


def test_a_locked_domain_is_not_reserved() -> None:
    with reserved_domain() as first, reserved_domain() as second:
        pass
    with Path(f"/tmp/tfcompose-test-domain-{first}.lock").open("rb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        with reserve_domain([first, second]) as number:
            assert number == second
