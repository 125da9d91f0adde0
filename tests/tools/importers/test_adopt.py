"""A robot that keeps its launch files: adopted, guarded, and handed over edge by edge."""

from pathlib import Path

import pytest

from tests.support.adoption import PUBLISHERS, hand_over_first, status_of
from tests.support.cli import tfcompose_in
from tests.support.importing import PRESETS
from tests.support.plans import compiled_plan
from tfcompose.compiler.compile import compile_robot
from tfcompose.foundation.geometry import Pose

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
    started = [process.name for process in plan.processes if process.kind != "external"]
    assert started == ["static", "guard"]  # static without an edge, which a guard alone leaves out


def test_the_tree_is_the_same_after_each_edge_that_is_handed_over(folder: Path) -> None:
    robot, launch = folder / "robot.yaml", folder / LAUNCH
    before = published_by(launch)
    assert len(before) == 3
    for handed_over in range(1, 4):
        hand_over_first(folder, robot.name, launch.name)
        own, others = poses(robot.read_text("utf-8"), "static"), published_by(launch)
        assert len(own) == handed_over
        assert not own.keys() & others.keys()
        together = own | others
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
