"""``tfcompose up`` of a robot of a fleet.

What it shares reaches others, and is shared again after its process died.
"""

import json
import os
import signal
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.domains import Domain
from tests.support.fleets import fleet_of, fleet_text
from tests.support.waiting import TIMEOUT_S, until
from tests.support.zenoh_peers import free_port, session
from tfcompose.tools.fleet.observe import FleetObserver

pytestmark = pytest.mark.ros

ROBOT = """
tfcompose: 1
robot: rover
fleet: {file: fleet.yaml, robot: r1}
ros: {namespace: r1, isolate: topics}
frames:
  map: {}
  odom: {parent: map, xyz: [1, 0, 0]}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
processes:
  drive: {simulate: {fixed: {xyz: [2, 0, 0]}, rate: 20 Hz}}
"""


def test_a_robot_of_a_fleet_shares_its_edges_when_it_comes_up(
    domain: Domain, tmp_path: Path
) -> None:
    routers = {"r1": f"tcp/127.0.0.1:{free_port()}"}
    (tmp_path / "fleet.yaml").write_text(fleet_text(routers), encoding="utf-8")
    (tmp_path / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    command, env = [sys.executable, "-m", "tfcompose"], {**os.environ, **domain.environment}

    def listed() -> dict[str, int | None]:
        done = processes.run([*command, "ps", "--format", "json"], cwd=tmp_path, env=env)
        (robot,) = json.loads(done.stdout)
        return {process["name"]: process["pid"] for process in robot["processes"]}

    with ExitStack() as stack:
        running = processes.start([*command, "up", "--no-live"], cwd=tmp_path, env=env)
        stack.callback(processes.end, running)
        waits = [*command, "wait", "--ready", "--timeout", "60"]
        ready = until(
            lambda: processes.run(waits, cwd=tmp_path, env=env, check=False).returncode == 0
        )
        assert ready, "a router that is not there keeps no robot from coming up"
        stack.enter_context(session("router", listen=[routers["r1"]]))
        observer = FleetObserver(fleet_of(routers))
        stack.callback(observer.close)
        assert observer.wait(TIMEOUT_S)
        assert until(lambda: list(observer.findings()) == [])
        pose, _ = observer.pose("map", "r1/base_link")
        assert pose.xyz == pytest.approx((3.0, 0.0, 0.0))
        first = listed()["fleet_share"]
        assert first
        os.kill(first, signal.SIGKILL)
        killed = time.time_ns()
        assert until(lambda: listed()["fleet_share"] not in {None, first})
        assert until(lambda: (observer.buffer.latest("map", "r1/base_link")[1] or 0) > killed)
        assert until(lambda: list(observer.findings()) == [])
        running.send_signal(signal.SIGINT)
        assert running.wait(TIMEOUT_S) == 0
