"""Hosts that are deployed to and are none.

They answer as agents do, and note what they were asked.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tests.support.plans import compiled_plan
from tfcompose.model.plan.file import write_plan
from tfcompose.tools.deploy.connection import LostError, RefusedError
from tfcompose.tools.deploy.release import Release
from tfcompose.tools.deploy.rollout import Rollout, Share, target_of
from tfcompose.tools.deploy.unit import Unit

if TYPE_CHECKING:
    from tfcompose.tools.deploy.connection import ConnectedHost

ROBOT = """
tfcompose: 1
robot: rover
hosts: {main: {}, jetson: {ssh: pi@10.0.0.3}}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
  arm: {parent: base_link, owner: arm_drive, rate: 20 Hz}
processes:
  static: {host: main}
  drive: {simulate: {fixed: {xyz: [0, 0, 0]}, rate: 20 Hz}}
  arm_drive: {simulate: {fixed: {xyz: [0, 0, 1]}, rate: 20 Hz}, host: jetson}
"""
#: The same, with processes that run nowhere.
NOWHERE = ROBOT.replace("static: {host: main}", "static: {}").replace("main: {}, ", "")
PROBE: dict[str, Any] = {
    "python": "3.12.3",
    "tfcompose": "0.1.0",
    "executable": "/usr/bin/python3",
    "problems": [],
    "env": {},
    "machine": "a",
    "lingers": True,
    "base": "/home/pi/.local/share/tfcompose/x",
    "setup": [],
}
RUNNING: dict[str, Any] = {"missing": [], "silent": [], "processes": [], "launcher": 7}
LATE: dict[str, Any] = {
    "name": "arm_drive",
    "kind": "simulate",
    "failed": False,
    "ready": False,
    "detail": "",
    "waits": "",
    "state": "running",
}
STATUS: dict[str, Any] = {"robot": RUNNING, "failed": False, "lines": []}
STATE: dict[str, Any] = {
    "release": "before",
    "previous": None,
    "files": {},
    "unit": None,
    "active": True,
    "enabled": True,
    "stranger": None,
    "unsettled": False,
}


@dataclass
class StandInHost:
    """A host; ``answers`` are what it answers instead of that all is well, by request."""

    name: str
    answers: dict[str, Any] = field(default_factory=dict)
    offset_s: float = 0.0
    span: None = None
    requests: list[str] = field(default_factory=list)

    async def ask(self, request: str, timeout_s: float = 1.0, **_: Any) -> Any:
        """Answer."""
        del timeout_s
        self.requests.append(request)
        usual: dict[str, Any] = {
            "state": STATE | STATUS,
            "take_lock": {"holder": None},
            "rehearse": [],
            "wait": STATUS,
            "texts": {},
            "back": {"release": "before", "active": True},
        }
        answer = self.answers.get(request, usual.get(request))
        if isinstance(answer, (LostError, RefusedError)):
            raise answer
        return answer

    async def clock_offset_s(self) -> float:
        """Return by how much its clock is ahead."""
        return self.offset_s


def rollout_to(
    *hosts: StandInHost, text: str = ROBOT, probes: dict[str, dict[str, Any]] | None = None
) -> Rollout:
    """Return a deployment of the robot to these hosts."""
    plan = compiled_plan(text)
    target = target_of(plan, [], {}, timeout_s=0.01)
    shares = []
    for host in hosts:
        probe = PROBE | (probes or {}).get(host.name, {})
        unit = Unit(f"rover.{host.name}", "rover", host.name, probe["base"], probe["executable"])
        connected_host: ConnectedHost = host  # type: ignore[assignment]
        shares.append(Share(connected_host, unit, probe))
    return Rollout(target, shares, lambda _: None)


def release_of(text: str = ROBOT) -> Release:
    """Return a release of the robot's plan alone."""
    plan = compiled_plan(text)
    return Release(plan, {"plan.json": write_plan(plan)}, {})
