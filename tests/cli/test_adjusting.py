"""Adjusted edges, and files of a plan with them."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
import yourdfpy

from tests.support import processes
from tests.support.cli import tfcompose
from tests.support.waiting import until
from tfcompose.cli.adjusting import MOST_EARLIER, _files_of, _remove_earlier, moved, reset, undone
from tfcompose.compiler.urdf.write import with_pose
from tfcompose.foundation import procfs
from tfcompose.foundation.geometry import Pose, quat_from_rpy
from tfcompose.launcher.runtime_dir import RuntimeDir
from tfcompose.model.plan import PlanEdge, SourceLine
from tfcompose.model.plan.file import read_plan

EDGE = PlanEdge(
    "base", "lidar", "static", "static", "/static", Pose((1, 0, 0)), None, SourceLine("r.yaml", 1)
)
NEW = Pose((0.1, 0.2, 0.3), quat_from_rpy(0.1, 0.2, 0.3))


def test_each_undo_restores_the_pose_before_and_reset_the_built_one() -> None:
    once = moved(EDGE, Pose((2, 0, 0)))
    twice = moved(once, Pose((3, 0, 4)))
    assert twice.adjustment is not None
    assert twice.adjustment.xyz_m == pytest.approx(20**0.5)
    assert moved(twice, twice.pose) == twice, "no step that undoes nothing"
    assert (undone(twice), undone(once), reset(twice)) == (once, EDGE, EDGE)
    assert (EDGE.adjustment, EDGE.earlier) == (None, ())


def test_many_adjustments_keep_the_built_pose_and_the_last_ones() -> None:
    edge = EDGE
    for number in range(2, MOST_EARLIER + 30):
        edge = moved(edge, Pose((number, 0, 0)))
    assert len(edge.earlier) == MOST_EARLIER
    assert edge.earlier[0] == EDGE.pose
    assert [pose.xyz[0] for pose in edge.earlier[1:]] == list(
        range(int(edge.pose.xyz[0]) - MOST_EARLIER + 1, int(edge.pose.xyz[0]))
    )
    assert reset(edge) == EDGE


URDF = """\
  <joint name="a" type="fixed">
    <parent link="base"/>
    <child link="lidar"/>
    <origin xyz="1 0 0" rpy="0 0 0"/>
  </joint>
  <joint name="b" type="fixed">
    <parent link="lidar"/>
    <child link="top"/>
  </joint>
"""


@pytest.mark.parametrize("prefix", ["", "r1/"])
def test_only_the_joint_of_the_edge_gets_the_pose(prefix: str) -> None:
    new = with_pose(URDF, f"{prefix}base", f"{prefix}lidar", Pose((2, 0, 0)))
    assert new == URDF.replace('xyz="1 0 0"', 'xyz="2 0 0"')
    assert with_pose(new, "base", "lidar", Pose((1, 0, 0))) == URDF
    added = with_pose(URDF, f"{prefix}lidar", f"{prefix}top", Pose((2, 0, 0)))
    origin = '    <origin xyz="2 0 0" rpy="0 0 0"/>\n'
    assert added == URDF.replace('"top"/>\n', f'"top"/>\n{origin}')
    assert with_pose(added, "lidar", "top", Pose()) == URDF


def test_an_edge_that_a_urdf_lacks_changes_nothing() -> None:
    assert with_pose(URDF, "base", "top", NEW) == URDF
    assert with_pose(URDF, "r1/base", "r2/lidar", NEW) == URDF


ROBOT = """\
tfcompose: 1
robot: rover
ros: {state_publisher: PUBLISHER, frame_prefix: PREFIX}
links: {base_link: {visual: {box: [1, 1, 1]}}}
frames:
  mast: {parent: base_link, xyz: [0, 0, 1]}
  lamp: {parent: mast}
xml: {note: "<gazebo><a>it's: a \\"quote\\"</a></gazebo>"}
"""


@pytest.mark.parametrize("publisher", ["tfcompose", "stock"])
@pytest.mark.parametrize("prefix", ['""', "r1/"])
def test_every_description_has_the_pose_and_nothing_else_changes(
    publisher: str, prefix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The oracle is yourdfpy, for the edge and for those that stay."""
    monkeypatch.chdir(tmp_path)
    text = ROBOT.replace("PUBLISHER", publisher).replace("PREFIX", prefix)
    (tmp_path / "robot.yaml").write_text(text)
    tfcompose("build", "robot.yaml", "-o", "b")
    plan = read_plan((tmp_path / "b/plan.json").read_text(), "plan.json")
    edge = next(edge for edge in plan.edges if edge.child.endswith("mast"))
    assert plan.is_adjustable(edge)
    new = moved(edge, NEW)
    changed = replace(
        plan, edges=tuple(new if planned == edge else planned for planned in plan.edges)
    )
    files = {
        name: data.decode()
        for name, data in _files_of(changed, tmp_path / "b", {edge.child: new}).items()
    }
    assert read_plan(files.pop("plan.json"), "plan.json") == changed
    texts = {name: text for name, text in files.items() if name.endswith(".urdf")}
    for name in files.keys() - texts.keys():
        before = yaml.safe_load((tmp_path / "b" / name).read_text())
        (params,) = yaml.safe_load(files[name]).values()
        texts[name] = params["ros__parameters"].pop("robot_description")
        (old,) = before.values()
        del old["ros__parameters"]["robot_description"]
        assert params == old
    assert len(texts) == 1 + (publisher == "stock"), "the plan's, and the stock publisher's"
    for text in texts.values():
        (tmp_path / "new.urdf").write_text(text)
        robot = yourdfpy.URDF.load(str(tmp_path / "new.urdf"), load_meshes=False)
        assert robot.get_transform("mast", "base_link")[:3, 3] == pytest.approx(NEW.xyz)
        quat = robot.get_transform("lamp", "mast")
        assert quat == pytest.approx(robot.get_transform("mast", "mast"))
        assert text.count("it's") == 1


def test_copies_of_plans_stay_while_a_process_was_started_with_them(tmp_path: Path) -> None:
    runtime_dir = RuntimeDir("rover@1", tmp_path, tmp_path / "logs")
    folders = {name: runtime_dir.plan_folder(name) for name in ("built", "used", "old", "new")}
    for name, folder in folders.items():
        folder.mkdir(parents=True)
        (folder / "plan.json").write_text("{}" if name == "built" else '{"earlier": []}')
        os.utime(folder, (1, 1))
    runtime_dir.link_plan(folders["new"])
    code = "import sys; sys.stdin.read()"
    command = [sys.executable, "-c", code, str(folders["used"] / "plan.json")]
    reader = processes.start(command, stdin=subprocess.PIPE)
    try:
        assert until(lambda: str(folders["used"]) in " ".join(procfs.argv(reader.pid)))
        _remove_earlier(runtime_dir, folders["old"])
        assert all(folder.exists() for folder in folders.values()), "replaced a moment ago"
        os.utime(folders["old"], (1, 1))
        _remove_earlier(runtime_dir, folders["new"])
        existing = {name for name, folder in folders.items() if folder.exists()}
        assert existing == {"built", "used", "new"}
    finally:
        processes.end(reader)
