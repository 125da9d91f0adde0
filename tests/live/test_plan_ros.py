"""Real nodes that do otherwise than the plan says: the doctor and verify find it, by one code and in the same words."""

from __future__ import annotations

import json
import sys
import time
from typing import TYPE_CHECKING, Any

import pytest

from tests.support import processes
from tests.support.doctor import LOOKS_S, doctor, finds_nothing, said, says
from tests.support.fake_nodes import message
from tfcompose.geometry import OPTICAL_XYZW
from tfcompose.ros.node import TFPublisher

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
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
"""
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


def nobody_drives(rover: Rover) -> None:
    rover.all_but("drive")


def named_otherwise(rover: Rover) -> None:
    rover.all_but("drive").drive(name="base_controller")


def second_publisher(rover: Rover) -> None:
    rover.all_but().drive(name="ekf")


def twice(rover: Rover) -> None:
    rover.all_but().drive()


def second_parent(rover: Rover) -> None:
    rover.all_but()
    rover.nodes.moving(rover.nodes.node("slam"), "map base_link")


def other_parent(rover: Rover) -> None:
    rover.all_but("mount")
    rover.nodes.fixed(rover.nodes.node("mount"), "odom mast", x=0.3)


def stranger(rover: Rover) -> None:
    rover.all_but()
    rover.nodes.moving(rover.nodes.node("tags"), "mast tag_1", "mast tag_2")


def falls_silent(rover: Rover) -> None:
    """It is heard for a second, and stays."""
    rover.all_but("drive")
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


def slow(rover: Rover) -> None:
    rover.all_but("drive").drive(hz=10.0)


def moving_though_fixed(rover: Rover) -> None:
    rover.all_but("mount")
    publisher = rover.nodes.keep(TFPublisher(rover.nodes.node("mount"), static=False))
    rover.nodes.every(10.0, lambda now: publisher.publish(message(now, ("base_link mast",), 0.3)))


def elsewhere(rover: Rover) -> None:
    rover.all_but("mount").mount(x=0.312)


def other_camera(rover: Rover) -> None:
    rover.all_but("driver").driver(x=0.02)


SCENES: dict[Callable[[Rover], Any], tuple[str, list[str]]] = {
    nobody_drives: ("TF811", ["odom → base_link", "drive (/drive)"]),
    named_otherwise: ("TF801", ["odom → base_link", "/base_controller", "drive (/drive)"]),
    second_publisher: ("TF801", ["odom → base_link", "/ekf", "drive (/drive)"]),
    twice: ("TF801", ["odom → base_link", "another /drive", "drive (/drive)"]),
    second_parent: ("TF802", ["base_link", "map (from /slam)", "drive (/drive)"]),
    other_parent: ("TF802", ["odom → mast", "mount (/mount)", "base_link → mast"]),
    stranger: ("TF803", ["mast → tag_1", "/tags", "guard: {allow: [{parent: mast, child: "]),
    falls_silent: ("TF804", ["drive (/drive)", "odom → base_link", "25 Hz"]),
    slow: ("TF805", ["odom → base_link", "drive (/drive)", "25 Hz"]),
    moving_though_fixed: ("TF809", ["base_link → mast", "/mount", "/tf ", "/tf_static"]),
    elsewhere: ("TF846", ["mast", "base_link", "/mount", "12 mm", "0.312"]),
    other_camera: ("TF828", ["front_depth_frame", "front_link", "/front/front", "20 mm"]),
}


@pytest.fixture
def robot(tmp_path: Path) -> str:
    file = tmp_path / "rover.yaml"
    file.write_text(ROBOT, encoding="utf-8")
    return str(file)


def verify(robot: str, seconds: float) -> list[dict[str, Any]]:
    command = [sys.executable, "-m", "tfcompose", "verify", "--for", str(seconds), "--format", "json", robot]
    done = processes.run(command)
    assert "Traceback" not in done.stderr, done.stderr
    found: list[dict[str, Any]] = json.loads(done.stdout)
    return found


def both(
    robot: str, code: str, words: Sequence[str], others: set[str]
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return what the doctor and verify find, when both find that code in those words, and no codes but the others."""
    for seconds in LOOKS_S:
        found = doctor(robot, seconds=seconds)[1], verify(robot, seconds)
        if all(says(some, code, words, others) for some in found):
            break
    return found


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.__name__)
def test_what_differs_from_the_plan_is_found_by_both_in_the_same_words(
    nodes: FakeNodes, robot: str, scene: Callable[[Rover], Any]
) -> None:
    scene(Rover(nodes))
    code, words = SCENES[scene]
    others = {*LATE, *ALSO.get(scene, set())}
    by_doctor, by_verify = both(robot, code, words, others)
    for found in (by_doctor, by_verify):
        text = said(found, code)
        for word in words:
            assert word in text
        assert {one["code"] for one in found} <= {code, *others}, found
    at = {one["line"] for one in by_verify if one["code"] == code and one["line"]}
    assert at or code == "TF803", "verify says where the edge stands in the file"


#: What else is found there, since it follows.
ALSO: dict[Callable[[Rover], Any], set[str]] = {
    nobody_drives: {"TF830", "TF908"},  # where frames are missing, it looks for processes that it cannot hear
    second_publisher: {"TF824"},
    twice: {"TF824"},
}


def test_a_robot_as_planned_has_no_findings(nodes: FakeNodes, robot: str) -> None:
    Rover(nodes).all_but()
    assert finds_nothing(robot)
    assert any(verify(robot, seconds) == [] for seconds in LOOKS_S)
