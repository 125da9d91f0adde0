"""Real nodes that do otherwise than the plan says.

The doctor and verify find it, by one code and in the same words; tests/guard/verdict has each
fault by itself, and robots as planned.
"""

from __future__ import annotations

import json
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import pytest

from tests.support import processes
from tests.support.doctor import OBSERVE_S, doctor, finds, messages_of
from tests.support.fake_nodes import message
from tfcompose.foundation.geometry import OPTICAL_XYZW
from tfcompose.tf.ros.node import TFPublisher

if TYPE_CHECKING:
    from pathlib import Path

    from tests.support.fake_nodes import FakeNodes

pytestmark = pytest.mark.ros

ROBOT = """\
tfcompose: 1
robot: rover
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 25 Hz}
  mast: {parent: base_link, xyz: [0.3, 0, 0], owner: mount, static: true}
  lift: {parent: base_link, owner: lift, rate: 25 Hz}
  arm: {parent: base_link, owner: arm, rate: 25 Hz}
  boom: {parent: base_link, owner: boom, rate: 25 Hz}
  pole: {parent: base_link, xyz: [0.3, 0, 0], owner: pole, static: true}
  flag: {parent: base_link, owner: flag, static: true}
  sail: {parent: base_link, owner: sail, static: true}
sensors:
  front: {preset: realsense/d435i, parent: mast, options: {streams: [depth]}, tf: driver, place: front_link}
processes:
  drive: {external: true, node: drive}
  mount: {external: true, node: mount}
  lift: {external: true, node: lift}
  arm: {external: true, node: arm}
  boom: {external: true, node: boom}
  pole: {external: true, node: pole}
  flag: {external: true, node: flag}
  sail: {external: true, node: sail}
"""  # noqa: E501 (a text as its reader has it)
#: What is found, and what is named there.
EXPECTED = {
    "TF801": [
        *("odom → base_link", "/base_controller", "drive (/drive)"),
        *("base_link → lift", "another /lift", "lift (/lift)"),
    ],
    "TF802": ["odom → mast", "mount (/mount)", "base_link → mast"],
    "TF803": ["mast → tag_1", "/tags", "guard: {allow: [{parent: mast, child: "],
    "TF804": ["boom (/boom)", "base_link → boom", "25 Hz"],
    "TF805": ["base_link → arm", "arm (/arm)", "25 Hz"],
    "TF809": ["base_link → flag", "/flag", "/tf ", "/tf_static"],
    "TF811": ["base_link → sail", "sail (/sail)"],
    "TF828": ["front_depth_frame", "front_link", "/front/front", "20 mm"],
    "TF846": ["pole", "base_link", "/pole", "12 mm", "0.312"],
}
#: True of publishers on a machine that does much else, of what else runs there, and of an edge
#: with two publishers.
LATE = {"TF833", "TF838", "TF839", "TF824", "TF908"}


def all_otherwise(nodes: FakeNodes) -> None:
    """Let each owner but static do otherwise than the plan says, and others what is theirs."""
    nodes.moving(nodes.node("base_controller"), "odom base_link", hz=25)
    nodes.fixed(nodes.node("mount"), "odom mast", x=0.3)
    for _ in range(2):
        nodes.moving(nodes.node("lift"), "base_link lift", hz=25)
    nodes.moving(nodes.node("arm"), "base_link arm", hz=10)
    falls_silent(nodes, "boom", "base_link boom")
    nodes.fixed(nodes.node("pole"), "base_link pole", x=0.312)
    flag = nodes.keep(TFPublisher(nodes.node("flag"), static=False))
    nodes.every(10, lambda now: flag.publish(message(now, ("base_link flag",))))
    nodes.moving(nodes.node("tags"), "mast tag_1", "mast tag_2")
    straight = (0.0, 0.0, 0.0, 1.0)
    nodes.latched(
        nodes.node("tfcompose_static"),
        ("mast", "front_bottom_screw_frame", (-0.0106, -0.0175, -0.0125), straight),
        ("front_bottom_screw_frame", "front_link", (0.0106, 0.0175, 0.0125), straight),
    )
    nodes.latched(
        nodes.node("front", "front"),
        ("front_link", "front_depth_frame", (0.02, 0.0, 0.0), straight),
        ("front_depth_frame", "front_depth_optical_frame", (0.0, 0.0, 0.0), OPTICAL_XYZW),
    )


def falls_silent(nodes: FakeNodes, name: str, edge: str) -> None:
    """Let a node stay that sends for a second to whoever has just come."""
    publisher = nodes.keep(TFPublisher(nodes.node(name), static=False))
    heard_since: list[float] = []

    def tick(now: int) -> None:
        if not publisher.publisher.get_subscription_count():
            heard_since.clear()
            return
        heard_since.append(heard_since[0] if heard_since else time.monotonic())
        if time.monotonic() - heard_since[0] < 1.0:
            publisher.publish(message(now, (edge,)))

    nodes.every(25.0, tick)


@pytest.fixture
def robot(tmp_path: Path) -> str:
    file = tmp_path / "rover.yaml"
    file.write_text(ROBOT, encoding="utf-8")
    return str(file)


def verify(robot: str, seconds: float) -> list[dict[str, Any]]:
    command = [
        sys.executable,
        "-m",
        "tfcompose",
        "verify",
        "--for",
        str(seconds),
        "--format",
        "json",
        robot,
    ]
    done = processes.run(command)
    assert "Traceback" not in done.stderr, done.stderr
    findings: list[dict[str, Any]] = json.loads(done.stdout)
    return findings


def test_what_differs_from_the_plan_is_found_by_the_doctor_and_by_verify(
    nodes: FakeNodes, robot: str
) -> None:
    all_otherwise(nodes)
    for seconds in OBSERVE_S:
        with ThreadPoolExecutor() as both:
            examined = both.submit(doctor, robot, seconds=seconds)
            results = verify(robot, seconds), examined.result()[1]
        if all(finds(some, EXPECTED, LATE) for some in results):
            break
    for some in results:
        for code, names in EXPECTED.items():
            text = messages_of(some, code)
            assert [name for name in names if name not in text] == [], text
        assert {name["code"] for name in some} <= {*EXPECTED, *LATE}, some
    located_codes = {name["code"] for name in results[0] if name["line"]}
    assert located_codes >= EXPECTED.keys() - {"TF803"}, (
        "verify says where the edge stands in the file"
    )
