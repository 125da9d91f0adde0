"""A robot that keeps its launch files: adopted, guarded, and handed over edge by edge."""

from pathlib import Path

import pytest

from tests.support.adoption import PUBLISHERS, hand_over_first, status_of
from tests.support.bags import UP, write_bag
from tests.support.cli import tfcompose_in
from tests.support.importing import PRESETS
from tests.support.plans import compiled_plan
from tfcompose.compiler.compile import compile_robot
from tfcompose.foundation.geometry import Pose
from tfcompose.model.plan.hosts import with_guard_alone

LAUNCH = "bringup.launch.xml"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / LAUNCH).write_text(PUBLISHERS, "utf-8")
    done = tfcompose_in(tmp_path, "adopt", LAUNCH, "-o", "robot.yaml")
    assert done.returncode == 0, done.stderr
    return tmp_path


def poses(text: str, owner: str = "") -> dict[tuple[str, str], Pose]:
    robot = compile_robot(text, "robot.yaml", PRESETS).robot
    assert robot
    edges = [edge for edge in robot.edges if not owner or edge.owner == owner]
    return {(edge.parent, edge.child): edge.pose for edge in edges}


def published_by(launch: Path) -> dict[tuple[str, str], Pose]:
    """Return what the publishers of the launch file send."""
    if "<node" not in launch.read_text("utf-8"):
        return {}
    return poses(tfcompose_in(launch.parent, "import", launch.name).stdout)


def test_every_process_is_external_and_owns_the_edges_that_it_publishes(folder: Path) -> None:
    plan = compiled_plan((folder / "robot.yaml").read_text("utf-8"))
    assert {edge.child: edge.node for edge in plan.edges} == {
        "lidar": "/lidar_tf",
        "imu": "/imu_tf",
        "gnss": "/gnss_tf",
    }
    started = [process.name for process in with_guard_alone(plan).processes]
    assert started == ["lidar_tf", "imu_tf", "gnss_tf", "guard"]


def test_the_tree_is_the_same_after_each_edge_that_is_handed_over(folder: Path) -> None:
    robot, launch = folder / "robot.yaml", folder / LAUNCH
    before = published_by(launch)
    assert len(before) == 3
    for handed_over in range(1, 4):
        hand_over_first(folder, robot.name, launch.name)
        robot_poses, launch_poses = poses(robot.read_text("utf-8"), "static"), published_by(launch)
        assert len(robot_poses) == handed_over
        assert not robot_poses.keys() & launch_poses.keys()
        together = robot_poses | launch_poses
        assert together.keys() == before.keys()
        for edge, pose in together.items():
            assert pose.xyz == pytest.approx(before[edge].xyz, abs=1e-9)
            assert pose.quat_xyzw == pytest.approx(before[edge].quat_xyzw, abs=1e-9)
    assert len(status_of(folder, robot.name)) == 1


@pytest.mark.parametrize("arguments", [("robot.urdf",), (), (LAUNCH, "--live")], ids=str)
def test_what_cannot_be_adopted_is_refused(folder: Path, arguments: tuple[str, ...]) -> None:
    assert tfcompose_in(folder, "adopt", *arguments).returncode == 2


def test_a_publisher_without_a_name_is_named_as_what_to_hand_over_first(tmp_path: Path) -> None:
    (tmp_path / LAUNCH).write_text(PUBLISHERS.replace(' name="lidar_tf"', ""), "utf-8")
    done = tfcompose_in(tmp_path, "adopt", LAUNCH)
    assert done.returncode == 0
    assert f"{LAUNCH}:2" in done.stderr
    assert "TF020" in done.stderr


NODE_OF_SEVERAL = """tfcompose: 1
robot: rover
frames:
  base_link: {}
  mast:
    parent: base_link
    xyz: [0, 0, 1]
    owner: tree
    static: true
  lidar: {parent: mast, xyz: [0.1, 0, 0], owner: tree, static: true}
  imu: {parent: base_link, xyz: [0, 0.1, 0], owner: imu_tf, static: true}
processes:
  tree: {external: true, node: /my/tree}
  imu_tf: {external: true}
"""
MOVING = "  wheel: {parent: base_link, owner: tree, rate: 20 Hz}\n"


def test_edges_of_one_node_are_handed_over_together(tmp_path: Path) -> None:
    robot = tmp_path / "robot.yaml"
    robot.write_text(NODE_OF_SEVERAL, "utf-8")
    before = poses(NODE_OF_SEVERAL)
    first = hand_over_first(tmp_path, robot.name)
    assert first == "base_link → mast, mast → lidar: published by /my/tree"
    text = robot.read_text("utf-8")
    assert poses(text, "static").keys() == {("base_link", "mast"), ("mast", "lidar")}
    assert poses(text) == before
    assert "/my/tree" not in text
    hand_over_first(tmp_path, robot.name)
    assert poses(robot.read_text("utf-8"), "static") == before


@pytest.mark.parametrize("launched", [True, False], ids=["launch file", "robot file alone"])
def test_a_node_of_moving_edges_keeps_its_fixed_ones(launched: bool, tmp_path: Path) -> None:  # noqa: FBT001 (a parameter)
    text = NODE_OF_SEVERAL.replace("processes:", f"{MOVING}processes:")
    (tmp_path / "robot.yaml").write_text(text, "utf-8")
    (tmp_path / LAUNCH).write_text(PUBLISHERS, "utf-8")
    lines = status_of(tmp_path, "robot.yaml", *[LAUNCH] * launched)
    heads = [line for line in lines if not line.startswith(" ")]
    mast, lidar = "base_link → mast", "mast → lidar"
    if launched:  # it starts a publisher of lidar
        assert f"{lidar}: published by /my/tree" in heads
        assert f"  remove  {LAUNCH}:2: the start of /my/tree" in lines
    kept = mast if launched else f"{mast}, {lidar}"
    assert heads[-1] == f"{kept}: stays with /my/tree, which also publishes base_link → wheel"
    assert not any("tree, which owns" in line for line in lines)


def test_a_driver_keeps_what_is_inside_of_its_sensor(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(
        """tfcompose: 1
robot: rover
frames:
  base_link: {}
  lamp: {parent: base_link, owner: camera, static: true}
sensors:
  cam: {preset: realsense/d435i, parent: base_link, tf: driver, driver: camera, owner: cam_tf, static: true}
processes:
  camera: {external: true, node: /cam/cam}
  cam_tf: {external: true, node: /cam/tf}
""",  # noqa: E501 (a text as its reader has it)
        "utf-8",
    )
    lines = status_of(tmp_path, "robot.yaml")
    handed_over, kept = (line for line in lines if not line.startswith(" "))
    assert handed_over == "base_link → cam_bottom_screw_frame: published by /cam/tf"
    assert kept.startswith("base_link → lamp: stays with /cam/cam, which also publishes cam_link")
    hand_over_first(tmp_path, "robot.yaml")
    plan = compiled_plan((tmp_path / "robot.yaml").read_text("utf-8"))
    assert {edge.owner for edge in plan.edges} == {"static", "camera"}


def test_edges_of_a_recording_stay_with_their_unknown_nodes(tmp_path: Path) -> None:
    still = (("base_link", "lidar"), ("base_link", "imu"))
    sent = [("/tf_static", 0.0, *edge, 0.0, (0.1, 0.0, 0.3), UP) for edge in still]
    moved = [("/tf", i / 20, "odom", "base_link", i / 20, (i, 0.0, 0.0), UP) for i in range(40)]
    write_bag(tmp_path / "run_17", [*sent, *moved])
    done = tfcompose_in(tmp_path, "adopt", "--bag", "run_17", "-o", "robot.yaml")
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "robot.yaml").read_text("utf-8")
    plan = compiled_plan(text)
    assert {(edge.child, edge.kind, edge.owner) for edge in plan.edges} == {
        ("base_link", "dynamic", "recorded"),
        ("lidar", "static", "recorded"),
        ("imu", "static", "recorded"),
    }
    alone = with_guard_alone(plan).processes
    assert {process.name: process.kind for process in alone} == {
        "recorded": "external",
        "guard": "guard",
    }
    assert tfcompose_in(tmp_path, "verify", "robot.yaml", "--bag", "run_17").returncode == 0
    (line,) = status_of(tmp_path, "robot.yaml")
    assert "stays with /recorded" in line
    (tmp_path / LAUNCH).write_text(PUBLISHERS, "utf-8")
    hand_over_first(tmp_path, "robot.yaml", LAUNCH)
    handed = poses((tmp_path / "robot.yaml").read_text("utf-8"), "static")
    assert handed.keys() == {("base_link", "imu")} or handed.keys() == {("base_link", "lidar")}
