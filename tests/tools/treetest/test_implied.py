"""``init --tests``: the cases that a robot file implies, and what they find."""

import io
import random
import shlex
import sys
from argparse import Namespace
from collections.abc import Iterator
from copy import deepcopy
from functools import reduce
from itertools import chain, zip_longest
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.support.bags import Sent, write_bag
from tests.support.cli import tfcompose, tfcompose_in
from tfcompose.cli.compiling import compile_file
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.foundation.geometry import Pose, quat_from_axis_angle
from tfcompose.model.plan import Plan, PlanEdge

ROBOTS = Path(__file__).parents[3] / "robots"
CART = """\
tfcompose: 1
robot: cart
links:
  base_link: {}
  arm: {}
  slide: {}
joints:
  arm_joint: {type: revolute, parent: base_link, child: arm, xyz: [0.1, 0, 0.2],
              rpy: [0, 0, 90 deg], axis: [0, 1, 0],
              limit: {lower: -1, upper: 1, velocity: 1, effort: 1}}
  slide_joint: {type: prismatic, parent: arm, child: slide, xyz: [0.3, 0, 0], axis: [1, 0, 0],
                limit: {lower: 0, upper: 1, velocity: 1, effort: 1}}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 50 Hz}
  tool: {parent: slide, xyz: [0, 0, 0.1]}
sensors:
  laser: {preset: generic/lidar2d, parent: base_link, xyz: [0.24, 0, 0.3]}
processes:
  drive: {simulate: {circle: {radius: 1 m, speed: 0.5 rad/s}, rate: 50 Hz}}
  other: {external: true, node: other}
  arms: {simulate: {joints: zero, rate: 50 Hz}}
"""


def plan_at(file: Path, profiles: list[str]) -> Plan:
    options = Namespace(profiles=profiles, overlays=[], settings=[], arg_values={}, trust=False)
    robot = compile_file(str(file), options).robot
    assert robot is not None
    return plan_of(robot.with_final_names())


def record(plan: Plan, folder: Path, seconds: float = 2.0) -> Path:
    """Write a recording of a robot that is as planned, with its joints in motion."""
    topics = {process.name: process.topics for process in plan.processes}
    sent: list[Sent] = []
    for edge in plan.edges:
        moving, fixed = topics[edge.owner]
        rate = edge.rate or 50.0
        if edge.kind == "static":
            sent.append((fixed, 0.0, edge.parent, edge.child, 0.0, *edge.pose))
        else:
            for index in range(round(seconds * rate)):
                at_s = index / rate
                pose = at_position(edge, 0.2 * at_s)
                sent.append((moving, at_s + 0.004, edge.parent, edge.child, at_s, *pose))
    return write_bag(folder, sorted(sent, key=lambda each: each[1]))


def at_position(edge: PlanEdge, position: float) -> Pose:
    """Return the pose of a joint's child, as URDF defines it."""
    joint = edge.joint
    if joint is None:
        return edge.pose
    if joint.type == "prismatic":
        x, y, z = joint.axis
        return edge.pose @ Pose((x * position, y * position, z * position))
    return edge.pose @ Pose(quat_xyzw=quat_from_axis_angle(joint.axis, position))


@pytest.fixture
def cart(tmp_path: Path) -> Path:
    """Return the folder of a robot with its recording and the cases that it implies."""
    (tmp_path / "cart.yaml").write_text(CART, "utf-8")
    record(plan_at(tmp_path / "cart.yaml", []), tmp_path / "bag")
    tfcompose("init", "--tests", tmp_path / "cart.yaml", "--bag", tmp_path / "bag")
    return tmp_path


def test_a_robot_as_declared_passes_and_each_of_its_edges_has_a_case(cart: Path) -> None:
    assert tfcompose_in(cart, "test").stdout.splitlines()[-1] == "1 case, 0 failed"
    suite = yaml.safe_load((cart / "cart.test.yaml").read_text("utf-8"))
    edges = {pair for case in suite["cases"] for pair in case["expect"].get("edges", ())}
    plan = plan_at(cart / "cart.yaml", [])
    assert edges == {edge.name for edge in plan.edges}
    poses = {pair for case in suite["cases"] for pair in case["expect"].get("pose", ())}
    assert poses == {edge.name for edge in plan.edges if edge.kind == "static"}


@pytest.mark.parametrize(
    ("before", "after", "key"),
    [
        ("xyz: [0.24, 0, 0.3]", "xyz: [0.25, 0, 0.3]", "pose"),
        ("xyz: [0, 0, 0.1]", "xyz: [0, 0, -0.1]", "pose"),
        ("tool: {parent: slide", "tool: {parent: arm", "TF930"),
        ("owner: drive", "owner: other", "owner"),
        ("rate: 50 Hz}\n  tool", "rate: 20 Hz}\n  tool", "rate"),
        ("axis: [0, 1, 0]", "axis: [0, 0, 1]", "joint"),
        ("axis: [1, 0, 0]", "axis: [0, 1, 0]", "joint"),
        ("rpy: [0, 0, 90 deg]", "rpy: [0, 0, -90 deg]", "joint"),
        ("xyz: [0.3, 0, 0]", "xyz: [0.3, 1 cm, 0]", "joint"),
        ("type: revolute", "type: continuous", "joint"),
        ("arm_joint:", "elbow_joint:", "joint"),
        ("  tool: {", "  gripper: {", "TF930"),
    ],
)
def test_a_changed_robot_file_fails(before: str, after: str, key: str, cart: Path) -> None:
    """The finding is at the expectation that is not met, or names what is missing."""
    assert CART.count(before) == 1
    (cart / "cart.yaml").write_text(CART.replace(before, after), "utf-8")
    done = tfcompose_in(cart, "test")
    assert done.returncode, done.stdout
    assert key in done.stdout + done.stderr


@pytest.mark.parametrize(
    ("xyz", "axis", "angle", "fails"),
    [
        ((0.1, 0.0, 0.2), (0.0, 1.0, 0.0), 0.7, False),
        ((0.1, 0.0, 0.2), (0.0, 0.01, 1.0), 0.7, True),
        ((0.1, 0.002, 0.2), (0.0, 1.0, 0.0), 0.0, True),
    ],
)
def test_a_joint_that_leaves_its_axis_fails(
    xyz: tuple[float, float, float],
    axis: tuple[float, float, float],
    angle: float,
    fails: bool,  # noqa: FBT001 (a parameter of the table)
    cart: Path,
) -> None:
    """The recording has one more pose of the arm."""
    plan = plan_at(cart / "cart.yaml", [])
    (edge,) = (edge for edge in plan.edges if edge.child == "arm")
    pose = Pose(xyz, edge.pose.quat_xyzw) @ Pose(quat_xyzw=quat_from_axis_angle(axis, angle))
    write_bag(cart / "arm", [("/tf", 0.5, "base_link", "arm", 0.5, *pose)])
    (cart / "arm.test.yaml").write_text(
        "robot: cart.yaml\ncases:\n  - name: bends\n    bag: arm\n    expect: {edges: {base_link →"
        " arm: {joint: {axis: [0, 1, 0]}}}}\n",
        "utf-8",
    )
    done = tfcompose_in(cart, "test", "arm.test.yaml")
    assert ("arm.test.yaml:5:" in done.stdout) is fails, done.stdout


@pytest.mark.parametrize(
    "arguments",
    [
        ("--tests", "cart.yaml", "--bag", "bag"),
        ("--tests", "cart.yaml", "--bag", "none", "-o", "new.test.yaml"),
        ("--tests", "none.yaml", "--bag", "bag", "-o", "new.test.yaml"),
        ("--tests", "cart.yaml", "--bag", "bag", "-o", "none/new.test.yaml"),
        ("--tests", "cart.yaml", "--bag", "bag", "--schema", "-o", "new.test.yaml"),
        ("--bag", "bag"),
    ],
)
def test_wrong_arguments_leave_no_file(arguments: tuple[str, ...], cart: Path) -> None:
    before = {file: file.stat().st_mtime_ns for file in cart.iterdir()}
    done = tfcompose_in(cart, "init", *arguments)
    assert done.returncode in {1, 2}
    assert done.stderr
    assert {file: file.stat().st_mtime_ns for file in cart.iterdir()} == before


def test_a_robot_on_stdin_has_no_name_for_its_test_file(
    cart: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(CART.encode())))
    before = set(cart.iterdir())
    assert tfcompose_in(cart, "init", "--tests", "-").returncode == 2
    assert set(cart.iterdir()) == before


def test_the_printed_command_runs_the_new_file(tmp_path: Path) -> None:
    (tmp_path / "my cart.yaml").write_text(CART, "utf-8")
    done = tfcompose("init", "--tests", tmp_path / "my cart.yaml")
    (line,) = [line for line in done.stdout.splitlines() if "tfcompose test" in line]
    assert shlex.split(line, comments=True)[2:] == [str(tmp_path / "my cart.test.yaml")]


def test_each_dynamic_edge_has_a_case_with_a_second_publisher(
    tmp_path: Path,
) -> None:
    """Of the edges that one process moves by joint states, the first is enough."""
    (tmp_path / "cart.yaml").write_text(CART, "utf-8")
    tfcompose("init", "--tests", tmp_path / "cart.yaml")
    suite = yaml.safe_load((tmp_path / "cart.test.yaml").read_text("utf-8"))
    declared, *rivals = suite["cases"]
    assert "bag" not in declared
    edges = [case["inject"]["publish"]["edge"] for case in rivals]
    assert edges == ["odom → base_link", "base_link → arm"]
    for case in rivals:
        (expected,) = case["expect"]["findings"]
        assert expected["code"] == "TF801"
        assert case["inject"]["publish"]["as"] in expected["names"]


@pytest.mark.slow
@pytest.mark.ros
@pytest.mark.parametrize("name", ["rover", "my_robot"])
def test_example_robots_pass_their_cases_when_started(name: str, tmp_path: Path) -> None:
    options = [word for profile in profiles_of(name) for word in ("-p", profile)]
    file = tmp_path / f"{name}.test.yaml"
    tfcompose("init", "--tests", ROBOTS / f"{name}.yaml", "-o", file, *options)
    done = tfcompose("test", file)
    assert done.stdout.splitlines()[-1].endswith(" 0 failed"), done.stdout


EXAMPLES = sorted(file.stem for file in ROBOTS.glob("*.yaml"))
FASTEST = "my_robot"


def profiles_of(name: str) -> list[str]:
    return ["demo"] if "\n  demo:" in (ROBOTS / f"{name}.yaml").read_text("utf-8") else []


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name == FASTEST else pytest.mark.slow) for name in EXAMPLES],
)
def test_the_example_robots_pass_the_cases_that_they_imply(name: str, tmp_path: Path) -> None:
    robot, profiles = ROBOTS / f"{name}.yaml", profiles_of(name)
    bag = record(plan_at(robot, profiles), tmp_path / "bag", 1.0)
    options = [word for profile in profiles for word in ("-p", profile)]
    file = tmp_path / f"{name}.test.yaml"
    tfcompose("init", "--tests", robot, "--bag", bag, "-o", file, *options)
    assert tfcompose("test", file).stdout.splitlines()[-1] == "1 case, 0 failed"


# Mutations by a script.


Change = tuple[str, tuple[Any, ...], Any]


def changes(data: dict[str, Any]) -> Iterator[Change]:
    """Yield kinds, paths and new values of changes of a robot file."""
    frames = [*data["links"], *(f"{name}_link" for name in data["sensors"])]
    owners = [name for name, entry in data["processes"].items() if entry]
    for section in ("joints", "frames", "sensors"):
        for name, entry in data[section].items():
            path = (section, name)
            yield from poses(path, entry)
            if "parent" in entry:
                names = {entry["parent"], entry.get("child"), name, f"{name}_link"}
                yield from (
                    ("parent", (*path, "parent"), frame) for frame in frames if frame not in names
                )
            if "owner" in entry:
                rivals = [owner for owner in owners if owner != entry["owner"]]
                yield from (("owner", (*path, "owner"), owner) for owner in rivals)
                rate = float(entry["rate"].split()[0])
                yield from (("rate", (*path, "rate"), rate * part) for part in (0.5, 2))


def poses(path: tuple[Any, ...], entry: dict[str, Any]) -> Iterator[Change]:
    for index, value in enumerate(entry.get("xyz", ())):
        if isinstance(value, (int, float)):
            yield "offset", (*path, "xyz", index), value + 0.01
            if value:
                yield "sign", (*path, "xyz", index), -value
    for index, value in enumerate(entry.get("rpy", ())):
        if isinstance(value, str):
            opposite = value.removeprefix("-") if value.startswith("-") else f"-{value}"
            yield "sign", (*path, "rpy", index), opposite
    if "axis" in entry:
        x, y, z = entry["axis"]
        yield from (("axis", (*path, "axis"), axis) for axis in ([z, x, y], [-x, -y, -z]))


def mutations(data: dict[str, Any]) -> dict[str, list[dict[str, Any]]]:
    """Return changed robot files by the kind of the change."""
    changed: dict[str, list[dict[str, Any]]] = {}
    for kind, path, value in changes(data):
        copy = deepcopy(data)
        entry: Any = reduce(lambda entry, step: entry[step], path[:-1], copy)
        entry[path[-1]] = value
        changed.setdefault(kind, []).append(copy)
    text = yaml.safe_dump(data, allow_unicode=True)
    for name in [*data["links"], *data["joints"], *data["frames"], *data["sensors"]]:
        changed.setdefault("name", []).append(yaml.safe_load(text.replace(name, f"{name}_2")))
    return changed


def forty(data: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield forty mutations, of all kinds alike as far as there are enough."""
    by_kind = mutations(data)
    shuffled = random.Random(37)
    for some in by_kind.values():
        shuffled.shuffle(some)
    rounds = zip_longest(*([(kind, each) for each in some] for kind, some in by_kind.items()))
    mixed = [each for each in chain.from_iterable(rounds) if each is not None]
    yield from mixed[:40]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["autonomous_robot", "rover"])
def test_thirty_eight_of_forty_mutations_of_a_robot_file_fail(name: str, tmp_path: Path) -> None:
    robot, profiles = ROBOTS / f"{name}.yaml", profiles_of(name)
    data = yaml.safe_load(robot.read_text("utf-8"))
    copy = tmp_path / "robot.yaml"
    copy.write_text(yaml.safe_dump(data, allow_unicode=True, sort_keys=False), "utf-8")
    record(plan_at(copy, profiles), tmp_path / "bag")
    options = [word for profile in profiles for word in ("-p", profile)]
    tfcompose("init", "--tests", copy, "--bag", tmp_path / "bag", *options)
    assert tfcompose("test", tmp_path).returncode == 0
    passed = []
    changed = list(forty(data))
    assert len(changed) == 40
    for kind, mutated in changed:
        copy.write_text(yaml.safe_dump(mutated, allow_unicode=True, sort_keys=False), "utf-8")
        if tfcompose_in(tmp_path, "test", ".").returncode == 0:
            passed.append((kind, mutated))
    assert len(passed) <= 2, passed
