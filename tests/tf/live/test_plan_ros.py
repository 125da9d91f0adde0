"""Real nodes that do otherwise than the plan says.

The doctor and verify find it, by one code and in the same words.
"""

from __future__ import annotations

import json
import sys
import time
from typing import TYPE_CHECKING, Any

import pytest

from tests.support import processes
from tests.support.doctor import OBSERVE_S, doctor, finds, finds_nothing, messages_of
from tests.support.fake_nodes import message
from tfcompose.foundation.geometry import OPTICAL_XYZW
from tfcompose.tf.ros.node import TFPublisher

if TYPE_CHECKING:
    from collections.abc import Callable
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
sensors:
  front: {preset: realsense/d435i, parent: mast, options: {streams: [depth]}, tf: driver, place: front_link}
processes:
  drive: {external: true, node: drive}
  mount: {external: true, node: mount}
"""  # noqa: E501 (a text as its reader has it)
#: True of publishers on a machine that does much else.
LATE = {"TF804", "TF805", "TF833", "TF838", "TF839"}


class Rover:
    """The robot as it is meant, part by part."""

    def __init__(self, nodes: FakeNodes) -> None:
        self.nodes = nodes

    def all_but(self, *parts: str) -> Rover:
        for name in ("drive", "mount", "static", "driver"):
            if name not in parts:
                getattr(self, name)()
        return self

    def drive(self, hz: float = 25.0, name: str = "drive") -> None:
        self.nodes.moving(self.nodes.node(name), "odom base_link", hz=hz)

    def mount(self, x: float = 0.3) -> None:
        self.nodes.fixed(self.nodes.node("mount"), "base_link mast", x=x)

    def static(self) -> None:
        node, quat = self.nodes.node("tfcompose_static"), (0.0, 0.0, 0.0, 1.0)
        screw = [
            ("mast", "front_bottom_screw_frame", (-0.0106, -0.0175, -0.0125), quat),
            ("front_bottom_screw_frame", "front_link", (0.0106, 0.0175, 0.0125), quat),
        ]
        self.nodes.latched(node, *screw)

    def driver(self, x: float = 0.0) -> None:
        inside = [
            ("front_link", "front_depth_frame", (x, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)),
            ("front_depth_frame", "front_depth_optical_frame", (0.0, 0.0, 0.0), OPTICAL_XYZW),
        ]
        self.nodes.latched(self.nodes.node("front", "front"), *inside)


def others(rover: Rover) -> None:
    """Others than planned publish, or below other parents."""
    rover.all_but("drive", "mount", "driver").drive(name="base_controller")
    rover.nodes.fixed(rover.nodes.node("mount"), "odom mast", x=0.3)
    rover.nodes.moving(rover.nodes.node("tags"), "mast tag_1", "mast tag_2")
    rover.driver(x=0.02)


def two_of_them(rover: Rover) -> None:
    """Two publish what one owns, too rarely or elsewhere."""
    rover.all_but("drive", "mount").drive(hz=10.0)
    rover.drive(name="ekf")
    rover.mount(x=0.312)


def twice(rover: Rover) -> None:
    """The owner runs twice, a frame has two parents, a fixed edge is on the wrong topic."""
    rover.all_but("mount").drive()
    rover.nodes.moving(rover.nodes.node("slam"), "map base_link")
    publisher = rover.nodes.keep(TFPublisher(rover.nodes.node("mount"), static=False))
    rover.nodes.every(10.0, lambda now: publisher.publish(message(now, ("base_link mast",), 0.3)))


def falls_silent(rover: Rover) -> None:
    """One is heard for a second, and stays; another is not there."""
    rover.all_but("drive", "mount")
    publisher = rover.nodes.keep(TFPublisher(rover.nodes.node("drive"), static=False))
    heard_since: list[float] = []

    def tick(now: int) -> None:
        if not publisher.publisher.get_subscription_count():
            heard_since.clear()
            return
        heard_since.append(heard_since[0] if heard_since else time.monotonic())
        if time.monotonic() - heard_since[0] < 1.0:
            publisher.publish(message(now, ("odom base_link",)))

    rover.nodes.every(25.0, tick)


#: What is found in each scene with what is named there, and what else may be, since it follows.
SCENES: dict[Callable[[Rover], None], tuple[dict[str, list[str]], set[str]]] = {
    others: (
        {
            "TF801": ["odom → base_link", "/base_controller", "drive (/drive)"],
            "TF802": ["odom → mast", "mount (/mount)", "base_link → mast"],
            "TF803": ["mast → tag_1", "/tags", "guard: {allow: [{parent: mast, child: "],
            "TF828": ["front_depth_frame", "front_link", "/front/front", "20 mm"],
        },
        set(),
    ),
    two_of_them: (
        {
            "TF801": ["odom → base_link", "/ekf", "drive (/drive)"],
            "TF805": ["odom → base_link", "drive (/drive)", "25 Hz"],
            "TF846": ["mast", "base_link", "/mount", "12 mm", "0.312"],
        },
        {"TF824"},
    ),
    twice: (
        {
            "TF801": ["odom → base_link", "another /drive", "drive (/drive)"],
            "TF802": ["base_link", "map (from /slam)", "drive (/drive)"],
            "TF809": ["base_link → mast", "/mount", "/tf ", "/tf_static"],
        },
        {"TF824"},
    ),
    falls_silent: (
        {
            "TF804": ["drive (/drive)", "odom → base_link", "25 Hz"],
            "TF811": ["base_link → mast", "mount (/mount)"],
        },
        {"TF830", "TF908"},  # where frames are missing, it looks for processes that it cannot hear
    ),
}


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
    found: list[dict[str, Any]] = json.loads(done.stdout)
    return found


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.__name__)
def test_what_differs_from_the_plan_is_found_by_the_doctor_and_by_verify(
    nodes: FakeNodes, robot: str, scene: Callable[[Rover], None]
) -> None:
    scene(Rover(nodes))
    expected, follows = SCENES[scene]
    for seconds in OBSERVE_S:
        found = doctor(robot, seconds=seconds)[1], verify(robot, seconds)
        if all(finds(some, expected, {*LATE, *follows}) for some in found):
            break
    for some in found:
        for code, names in expected.items():
            text = messages_of(some, code)
            assert [name for name in names if name not in text] == [], text
        assert {one["code"] for one in some} <= {*expected, *LATE, *follows}, some
    at = {one["code"] for one in found[1] if one["line"]}
    assert at >= expected.keys() - {"TF803"}, "verify says where the edge stands in the file"


def test_a_robot_as_planned_has_no_findings(nodes: FakeNodes, robot: str) -> None:
    Rover(nodes).all_but()
    assert finds_nothing(robot)
    assert any(verify(robot, seconds) == [] for seconds in OBSERVE_S)
