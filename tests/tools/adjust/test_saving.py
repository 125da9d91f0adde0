"""Adjusted poses in the overlay of one robot; ``up`` with it has them again."""

import os
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from tests.support.cli import tfcompose
from tfcompose.cli.adjusting import moved
from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.geometry import Pose, quat_from_rpy
from tfcompose.model.plan import Plan, PlanEdge
from tfcompose.model.plan.file import read_plan
from tfcompose.tools.adjust.saving import save_poses

ROBOT = """\
tfcompose: 1
robot: rover
overlays: {by: hostname, folder: overlays}
args: {height: {default: 0.3}, sim: {default: true}}
frames:
  base_link: {}
  imu: {parent: base_link, xyz: [0, -0.2, 0.05]}
sensors:
  laser: {preset: generic/lidar2d, parent: base_link, xyz: [0.1, 0, "${args.height}"]}
"""
NEW = Pose((0.11, 0.0, 0.4), quat_from_rpy(0.0, 0.1, 0.0))


def built(*options: str) -> Plan:
    tfcompose("build", "robot.yaml", "-o", "b", *options)
    return read_plan(Path("b/plan.json").read_text(encoding="utf-8"), "plan.json")


def laser(plan: Plan) -> PlanEdge:
    return next(edge for edge in plan.edges if edge.mounts == "laser")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    return tmp_path


def test_a_robot_built_with_the_overlay_has_the_pose_and_the_file_stays() -> None:
    plan = built()
    path, saved = save_poses(plan, [moved(laser(plan), NEW)], "robot.yaml", None)
    assert path == f"overlays/{os.uname().nodename}.yaml"
    assert [edge.child for edge in saved] == [laser(plan).child]
    again = built("--robot", os.uname().nodename)
    assert laser(again).pose.xyz == pytest.approx(NEW.xyz)
    assert laser(again).pose.quat_xyzw == pytest.approx(NEW.quat_xyzw)
    unchanged = [edge for edge in again.edges if edge.mounts != "laser"]
    assert [edge.pose for edge in unchanged] == [e.pose for e in plan.edges if e.mounts != "laser"]
    assert Path("robot.yaml").read_text(encoding="utf-8") == ROBOT
    assert save_poses(again, [laser(again)], "robot.yaml", None) == (path, [])


def test_it_goes_to_the_overlay_that_the_robot_runs_with() -> None:
    plan = built()
    save_poses(plan, [moved(laser(plan), NEW)], "robot.yaml", "ant")
    plan = built("--robot", "ant", "--set", "frames.imu.xyz=[0,0,1]")
    path, _ = save_poses(plan, [moved(laser(plan), Pose((1, 2, 3)))], "robot.yaml", None)
    assert path == "overlays/ant.yaml"
    assert list(Path("overlays").iterdir()) == [Path("overlays/ant.yaml")]
    assert laser(built("--robot", "ant")).pose.xyz == pytest.approx((1, 2, 3))
    imu = next(edge for edge in built("--robot", "ant").edges if edge.child == "imu")
    assert imu.pose.xyz == (0, -0.2, 0.05), "of a setting nothing is saved"


def test_saved_nudges_are_one_entry_that_one_undo_removes() -> None:
    plan = built()
    for number in range(5):
        edge = moved(laser(plan), Pose((1 + number, 0, 0)))
        save_poses(plan, [edge], "robot.yaml", "ant")
    data = yaml.safe_load(Path("overlays/ant.yaml").read_text(encoding="utf-8"))
    text = yaml.safe_dump(data["x-adjustments"])
    assert text.count("tool: nudge") == 1
    tfcompose("calibrate", "laser", "--undo", "--robot", "ant")
    assert laser(built("--robot", "ant")).pose == laser(plan).pose


def test_the_file_of_another_robot_is_refused_and_nothing_is_saved(folder: Path) -> None:
    plan = replace(built(), robot="cart")
    with pytest.raises(RejectedError) as refused:
        save_poses(plan, [moved(laser(plan), NEW)], "robot.yaml", None)
    assert [(f.code, f.span and f.span.line) for f in refused.value.findings] == [("TF667", 2)]
    assert not (folder / "overlays").exists()
