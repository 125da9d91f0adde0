"""``tfcompose fleet share`` on a robot: from real publishers of TF to whoever asks the router."""

import os
import signal
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.domains import Domain
from tests.support.fake_nodes import sending
from tests.support.fleets import fleet_of, fleet_text
from tests.support.waiting import TIMEOUT_S, until
from tests.support.zenoh_peers import free_port, session
from tfcompose.tools.fleet.observe import FleetObserver

pytestmark = pytest.mark.ros


def test_edges_that_are_shared_leave_the_robot_and_no_others(
    domain: Domain, tmp_path: Path
) -> None:
    routers = {"r1": f"tcp/127.0.0.1:{free_port()}"}
    text = fleet_text(routers).replace("map → odom, ", "")
    (tmp_path / "fleet.yaml").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "tfcompose", "fleet", "share", "r1"]
    with ExitStack() as stack:
        stack.enter_context(session("router", listen=[routers["r1"]]))
        stack.enter_context(sending("drive", "odom", "base_link", rate=50))
        stack.enter_context(sending("arm", "base_link", "hand", rate=50))
        sharing = processes.start(command, cwd=tmp_path, env={**os.environ, **domain.environment})
        stack.callback(processes.end, sharing)
        observer = FleetObserver(fleet_of(routers))
        stack.callback(observer.close)
        assert until(lambda: {"r1/odom", "r1/base_link"} <= observer.buffer.frames)
        assert {edge.state for edge in observer.status()} == {"live"}
        assert observer.buffer.frames == {"r1/odom", "r1/base_link"}
        assert [finding.code for finding in observer.findings()] == ["TF884"], (
            "the file here shares map → odom, too"
        )
        sharing.send_signal(signal.SIGINT)
        assert sharing.wait(TIMEOUT_S) == 0
