"""Other people's programs read the same frames, masses and tensors from the URDF.

What a reader cannot read is in ``CANNOT``, with the reason, and is tried all the same where it can
be: the day that it can, the entry is wrong.
"""

import json
import random
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.random_robot import TYPES, spec
from tests.support.texts import robot_in
from tests.support.urdf_readers import Body, Drake, MuJoCo, Pinocchio, Reader, Yourdfpy, together
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.foundation.geometry import Pose
from tfcompose.launcher.publishers.joint_mover import JointMover, PublishOptions
from tfcompose.model.plan import Plan, RosSettings
from tfcompose.model.plan.file import read_plan
from tfcompose.model.robot import Robot
from tfcompose.tf.ros.joint_codec import encode_names, fill
from tfcompose.tf.ros.tf_codec import decode

ROBOTS = Path(__file__).parents[3] / "robots"
PRESETS = library()
READERS: dict[str, Callable[[str, str], Reader]] = {
    "yourdfpy": Yourdfpy,
    "pinocchio": Pinocchio,
    "mujoco": MuJoCo,
    "drake": Drake,
}
#: What a reader cannot read, and why.
CANNOT: dict[tuple[str, str], str] = {
    ("mujoco", "floating"): "a free joint below a body that is not the world is refused",
    (
        "drake",
        "floating",
    ): "the joint is left out: the child is a free body without its place in the parent",
    (
        "yourdfpy",
        "floating",
    ): "a mimic joint then reads another joint's position: it counts joints as positions",
    ("yourdfpy", "planar"): "as for floating",
    ("mujoco", "root"): "the root is the world, whose mass it forgets",
    ("mujoco", "massless"): "a moving body without mass is refused; boundmass gives it one",
}
SEEDS = range(8)
POSITIONS = 5
FAR_M = 1e-9


def robot_of(text: str) -> Robot:
    return robot_in(
        compile_robot(
            text, "r.yaml", PRESETS, read=lambda name: (ROBOTS / name).read_text("utf-8")
        )
    )


def generated(seed: int, reader: str) -> Robot:
    types = tuple(kind for kind in TYPES if (reader, kind) not in CANNOT)
    return robot_of(json.dumps(spec(seed, types)))


def examples() -> list[Path]:
    with_several_robots = {
        "two_rovers"
    }  # robots beside each other, with joints of one name; rover.yaml is one of them
    return sorted(file for file in ROBOTS.rglob("*.yaml") if file.stem not in with_several_robots)


def source_text(robot: Robot) -> dict[str, str]:
    return {file.path: file.text for file in emit(robot)}


def matrix(pose: Pose) -> Any:
    rows = np.eye(4)
    rows[:3, :3], rows[:3, 3] = Rotation.from_quat(pose.quat_xyzw).as_matrix(), pose.xyz
    return rows


class Own:
    """Where tfcompose's own publisher puts the frames: by the plan, as its process reads it."""

    def __init__(self, plan: Plan) -> None:
        self.base = plan.base
        self.edges = {edge.child: edge for edge in plan.edges}
        self.moving = [edge for edge in plan.edges if edge.joint]
        self.mover = JointMover(
            plan.edges, print, lambda arrival: arrival, PublishOptions(ignore_timestamp=True)
        )

    def positions(self, chance: random.Random) -> dict[str, float]:
        """Return a position for each joint.

        Random, and what follows from it for those that mimic one.
        """
        values = {
            edge.joint.name: chance.uniform(-2, 2)
            for edge in self.moving
            if edge.joint and not edge.joint.mimic
        }
        for edge in self.moving:
            if edge.joint and edge.joint.mimic:
                values[edge.joint.name] = (
                    edge.joint.multiplier * values[edge.joint.mimic] + edge.joint.offset
                )
        return values

    def poses(self, positions: Mapping[str, float]) -> dict[str, Any]:
        masters = {
            e.joint.name: positions[e.joint.name]
            for e in self.moving
            if e.joint and not e.joint.mimic
        }
        state = encode_names(list(masters))
        fill(state, 1, list(masters.values()))
        answer = self.mover.tf_message(bytes(state), 0)
        moved = decode(answer) if answer else []
        moved_poses = {
            transform.child: Pose(transform.xyz, transform.quat_xyzw) for transform in moved
        }
        matrices: dict[str, Any] = {}
        for frame in self.edges:
            pose, step = Pose(), frame
            while step in self.edges and step != self.base:
                pose, step = (
                    moved_poses.get(step, self.edges[step].pose) @ pose,
                    self.edges[step].parent,
                )
            if step == self.base:
                matrices[frame] = matrix(pose)
        return matrices


def compare(robot: Robot, reader: Reader, files: Mapping[str, str]) -> None:
    planned, chance = Own(read_plan(files["plan.json"], "plan.json")), random.Random(1)
    for _ in range(POSITIONS):
        positions = planned.positions(chance)
        mine, theirs = planned.poses(positions), reader.poses(positions)
        assert set(theirs) >= set(mine) - {robot.base}
        for frame, pose in mine.items():
            if frame != robot.base:
                assert np.abs(theirs[frame] - pose).max() < FAR_M, frame


def bodies_of(robot: Robot) -> dict[str, Body]:
    """Return the bodies as tfcompose has them."""
    bodies = {}
    for name, link in robot.links.items():
        if link.inertial:
            xx, xy, xz, yy, yz, zz = link.inertial.tensor
            tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            bodies[name] = Body(link.inertial.mass, np.zeros(3), tensor).moved(
                matrix(link.inertial.pose)
            )
    return bodies


def fixed_to(robot: Robot, link: str) -> Body:
    """Return what is fixed to the link, itself included, as one body."""
    bodies = bodies_of(robot)
    fixed, waiting = [], [(link, np.eye(4))]
    while waiting:
        name, pose = waiting.pop()
        fixed += [bodies[name].moved(pose)] if name in bodies else []
        waiting += [
            (e.child, pose @ matrix(e.pose))
            for e in robot.edges
            if e.parent == name and e.kind == "static"
        ]
    return together(fixed)


def assert_equal(theirs: Body, mine: Body, link: str) -> None:
    assert theirs.mass == pytest.approx(mine.mass, rel=1e-9), link
    assert theirs.centre == pytest.approx(mine.centre, abs=1e-9), link
    assert theirs.tensor == pytest.approx(
        mine.tensor, rel=1e-9, abs=1e-9 * np.trace(mine.tensor)
    ), link


def compare_bodies(robot: Robot, name: str, reader: Reader) -> int:
    """Compare the bodies and return how many there were."""
    theirs = reader.bodies()
    if name == "pinocchio":
        for link, body in theirs.items():
            assert_equal(body, fixed_to(robot, link), link)
        return len(theirs)
    mine = bodies_of(robot)
    if (name, "root") in CANNOT:
        mine.pop(robot.base or "", None)
    assert set(theirs) == set(mine)
    for link, body in mine.items():
        assert_equal(theirs[link], body, link)
    return len(mine)


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_reader_finds_every_frame_and_every_body_of_a_generated_robot(
    seed: int, name: str
) -> None:
    robot = generated(seed, name)
    files = source_text(robot)
    reader = READERS[name](files["robot.urdf"], robot.base or "")
    assert reader.moving >= {e.joint.name for e in robot.edges if e.joint and not e.joint.mimic}
    compare(robot, reader, files)
    assert compare_bodies(robot, name, reader) >= 3


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("file", examples(), ids=lambda file: file.stem)
def test_a_reader_finds_every_frame_and_every_body_of_an_example(file: Path, name: str) -> None:
    full = robot_of(file.read_text("utf-8"))
    alone = [
        replace(part.robot, ros=RosSettings()) for part in full.parts
    ]  # each has a description of its own
    for robot in alone or [full]:
        files = source_text(robot)
        if name == "mujoco":
            reader: Reader = MuJoCo(
                files["robot.urdf"], robot.base or "", 'boundmass="1e-6" boundinertia="1e-9"'
            )
        else:
            reader = READERS[name](files["robot.urdf"], robot.base or "")
            compare_bodies(robot, name, reader)
        compare(robot, reader, files)


BOX = {"visual": {"box": [1, 1, 1]}, "inertial": {"mass": 1}}
FREE = {
    "tfcompose": 1,
    "robot": "r",
    "links": {"base_link": {}, "a": BOX, "b": BOX, "c": BOX, "d": BOX},
    "joints": {
        "arm": {"type": "continuous", "parent": "base_link", "child": "a", "xyz": [1, 0, 0]},
        "free": {
            "type": "floating",
            "parent": "a",
            "child": "b",
            "owner": "mover",
            "xyz": [1, 2, 3],
        },
        "hand": {"type": "fixed", "parent": "b", "child": "c", "xyz": [0, 0, 1]},
        "last": {
            "type": "continuous",
            "parent": "a",
            "child": "d",
            "mimic": {"joint": "arm", "multiplier": 2},
        },
    },
    "processes": {"mover": {"external": True}},
}


def test_what_a_reader_cannot_read_it_cannot_read() -> None:
    robot = robot_of(json.dumps(FREE))
    files = source_text(robot)
    urdf = files["robot.urdf"]
    with pytest.raises(ValueError, match="free joint can only be used on top level"):
        MuJoCo(urdf, "base_link")
    with pytest.raises(AssertionError, match=r"b|c"):
        compare(robot, Drake(urdf, "base_link"), files)
    with pytest.raises(AssertionError, match="d"):
        compare(robot, yourdfpy_with_joints_in_order(urdf), files)
    compare(robot, Pinocchio(urdf, "base_link"), files)
    with pytest.raises(ValueError, match="mass and inertia of moving bodies"):
        MuJoCo(
            source_text(robot_of((ROBOTS / "my_robot.yaml").read_text("utf-8")))["robot.urdf"],
            "base_link",
        )


def yourdfpy_with_joints_in_order(urdf: str) -> Yourdfpy:
    """Return the reader with the floating joint before the others."""
    begin, end = urdf.index('  <joint name="free"'), urdf.index('  <joint name="hand"')
    first = urdf.index("  <joint ")
    return Yourdfpy(urdf[:first] + urdf[begin:end] + urdf[first:begin] + urdf[end:], "base_link")
