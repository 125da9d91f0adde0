"""A process that begins without a network is told of the first one."""

import sys

import pytest

from tests.support import processes
from tests.support.computers import missing
from tests.support.waiting import until
from tfcompose.foundation.signals import Stop
from tfcompose.tf.ros import network
from tfcompose.tf.ros.environment import RANGE
from tfcompose.tf.ros.network import FirstNetwork

#: Prints whether there is a network, before and after a link with an address comes up.
CODE = """
import subprocess
from tfcompose.tf.ros.network import has_network
print(has_network())
for words in ("set lo up", "add d0 type veth peer name d1", "set d0 up", "set d1 up"):
    subprocess.run(["ip", "link", *words.split()], check=True)
print(has_network())
subprocess.run("ip addr add 10.9.9.1/24 dev d0".split(), check=True)
print(has_network())
"""


@pytest.mark.skipif(bool(missing()), reason=missing() or "all is there")
def test_a_network_is_an_interface_that_runs_and_has_an_address() -> None:
    done = processes.run(["unshare", "--net", sys.executable, "-c", CODE], check=True)
    assert done.stdout.split() == ["False", "False", "True"]


@pytest.mark.parametrize(
    ("begins", "heard", "comes"),
    [(False, "SUBNET", True), (True, "SUBNET", False), (False, "LOCALHOST", False)],
    ids=["without", "with", "alone"],
)
def test_the_first_network_ends_only_processes_that_need_it(
    monkeypatch: pytest.MonkeyPatch, *, begins: bool, heard: str, comes: bool
) -> None:
    monkeypatch.setenv(RANGE, heard)
    monkeypatch.setattr(network, "CHECK_EVERY_S", 0.01)
    answers = [begins]
    monkeypatch.setattr(network, "has_network", lambda: answers[0])
    stop = Stop()
    with FirstNetwork(stop) as first:
        assert not stop.wait(0.1)
        answers[0] = True
        assert until(lambda: first.came, 5.0 if comes else 0.1) is comes
    assert stop.requested is comes


def test_who_is_ended_otherwise_waits_for_no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(RANGE, raising=False)
    monkeypatch.setattr(network, "CHECK_EVERY_S", 0.01)
    answers = [False]
    monkeypatch.setattr(network, "has_network", lambda: answers[0])
    stop = Stop()
    with FirstNetwork(stop) as first:
        stop.request()
    answers[0] = True
    assert not until(lambda: first.came, 0.1)
