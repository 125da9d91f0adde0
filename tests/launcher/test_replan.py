"""What a changed plan changes."""

from dataclasses import replace
from pathlib import Path

import pytest

from tfcompose.foundation.geometry import Pose
from tfcompose.launcher.answers import PlanDifference, change
from tfcompose.model.plan import (
    EdgeKind,
    GuardPolicy,
    Plan,
    PlanEdge,
    PlanProcess,
    RosSettings,
    SourceLine,
)


def edge(child: str, owner: str = "static", x: float = 0.0, line: int = 1) -> PlanEdge:
    kind: EdgeKind = "static" if owner == "static" else "dynamic"
    pose, source = Pose((x, 0, 0)), SourceLine("r.yaml", line)
    return PlanEdge("base", child, kind, owner, f"/{owner}", pose, None, source)


STATIC, JOINTS = PlanProcess("static", "static"), PlanProcess("joints", "joints")
GUARD = PlanProcess("guard", "guard")
SLAM = PlanProcess("slam", "run", argv=("slam",), params_file="params/slam.yaml")
PLAN = Plan(
    "rover",
    "",
    "base",
    RosSettings(),
    (edge("laser"), edge("odom", "slam")),
    (STATIC, SLAM, GUARD),
)


def changed(
    tmp_path: Path, plan: Plan, params: str = "a: 1", description: str = "<robot/>"
) -> PlanDifference:
    for name, slam, robot in (("old", "a: 1", "<robot/>"), ("new", params, description)):
        (tmp_path / name / "params").mkdir(parents=True)
        (tmp_path / name / "params" / "slam.yaml").write_text(slam)
        (tmp_path / name / plan.description).write_text(robot)
    return change(PLAN, tmp_path / "old", plan, tmp_path / "new")


def test_a_line_that_moved_in_the_file_changes_nothing(tmp_path: Path) -> None:
    moved = replace(
        PLAN, edges=(edge("laser", line=9), edge("odom", "slam", line=3)), spec_digest="other"
    )
    assert changed(tmp_path, moved) == PlanDifference(frozenset(), ())


@pytest.mark.parametrize(
    ("edges", "concerned"),
    [
        ((edge("laser"), edge("odom", "slam", x=0.1)), {"slam", "guard"}),
        ((edge("laser"), edge("lidar"), edge("odom", "slam")), {"static", "guard"}),
    ],
)
def test_an_edge_concerns_its_owner_and_another_one_the_guard(
    edges: tuple[PlanEdge, ...], concerned: set[str], tmp_path: Path
) -> None:
    assert changed(tmp_path, replace(PLAN, edges=edges)) == PlanDifference(
        frozenset(concerned), ()
    )


def test_static_follows_a_pose_while_it_runs_and_the_guard_with_it(tmp_path: Path) -> None:
    moved = replace(PLAN, edges=(edge("laser", x=0.1), edge("odom", "slam")))
    difference = PlanDifference(
        frozenset(), (), followers=frozenset({"static"}), moved=("base → laser",)
    )
    assert changed(tmp_path, moved) == difference
    adjusted = replace(moved, edges=(replace(moved.edges[0], earlier=(Pose(),)), moved.edges[1]))
    assert changed(tmp_path / "adjusted", adjusted) == difference


def test_an_edge_that_moves_with_another_one_added_comes_with_the_restart(tmp_path: Path) -> None:
    edges = (edge("laser", x=0.1), edge("lidar"), edge("odom", "slam"))
    difference = changed(tmp_path, replace(PLAN, edges=edges))
    assert difference == PlanDifference(frozenset({"static", "guard"}), ())


def test_a_parameter_concerns_its_process_only(tmp_path: Path) -> None:
    assert changed(tmp_path, PLAN, params="a: 2") == PlanDifference(frozenset({"slam"}), ())


def test_the_description_concerns_whoever_sends_it(tmp_path: Path) -> None:
    assert changed(tmp_path, PLAN, description="<robot name='r'/>") == PlanDifference(
        frozenset(), (), followers=frozenset({"static"})
    )
    arm = replace(
        PLAN, processes=(STATIC, JOINTS, GUARD), edges=(edge("laser"), edge("a", "joints"))
    )
    (tmp_path / PLAN.description).write_text("<robot/>")
    (tmp_path / "new").mkdir(exist_ok=True)
    joints = replace(arm, processes=(JOINTS, GUARD))
    for plan, follower, changes in ((arm, {"static"}, set()), (joints, set(), {"joints"})):
        difference = change(plan, tmp_path, plan, tmp_path / "new")
        assert difference.followers == follower
        assert difference.changed == changes


def test_joints_no_longer_sends_the_description_once_there_is_a_fixed_edge(tmp_path: Path) -> None:
    arm = replace(PLAN, processes=(JOINTS, GUARD), edges=(edge("a", "joints"),))
    new = replace(PLAN, processes=(STATIC, JOINTS, GUARD), edges=(edge("a", "joints"), edge("b")))
    assert change(arm, tmp_path, new, tmp_path).changed == {"joints", "guard"}


def test_a_policy_concerns_the_guard_and_a_setting_of_ros_everybody(tmp_path: Path) -> None:
    policy = replace(PLAN, guard=GuardPolicy(unknown_edges="error"))
    assert changed(tmp_path / "a", policy).changed == {"guard"}
    assert changed(tmp_path / "b", replace(PLAN, ros=RosSettings("r"))).changed == {
        "static",
        "slam",
        "guard",
    }


def test_a_fence_goes_up_at_process_start_so_strict_concerns_every_process(
    tmp_path: Path,
) -> None:
    strict = replace(PLAN, guard=GuardPolicy(mode="strict"))
    assert changed(tmp_path, strict).changed == {"static", "slam", "guard"}


def test_another_fence_concerns_every_process_and_an_unused_one_the_guard(
    tmp_path: Path,
) -> None:
    for mode, concerned in (("strict", {"static", "slam", "guard"}), ("watch", {"guard"})):
        old = replace(PLAN, guard=GuardPolicy(mode=mode))  # type: ignore[arg-type]
        new = replace(PLAN, guard=GuardPolicy(mode=mode, fence="remap"))  # type: ignore[arg-type]
        assert change(old, tmp_path, new, tmp_path).changed == concerned


def test_listeners_hold_a_vanished_fixed_frame_but_not_a_moving_one(
    tmp_path: Path,
) -> None:
    assert changed(tmp_path, replace(PLAN, edges=())).held == ("base → laser",)


STATE_PUBLISHER = PlanProcess(
    "joints",
    "run",
    argv=("${executable:robot_state_publisher/robot_state_publisher}",),
    params_file="params/joints.yaml",
)
PARAMS = '"/rsp":\n  ros__parameters:\n    "rate": %s\n    "robot_description": "%s"\n'


def fixed(child: str, x: float = 0.0) -> PlanEdge:
    return replace(edge(child, x=x), owner="joints")


@pytest.mark.parametrize(
    ("edges", "params", "difference"),
    [
        ((fixed("mast", 0.1), fixed("top")), ("20", "<robot a/>"), ("described", "joints")),
        ((fixed("mast"), fixed("top"), fixed("new")), ("20", "<robot b/>"), ("changed", "guard")),
        ((fixed("mast", 0.1), fixed("top")), ("30", "<robot a/>"), ("changed", "joints")),
        ((fixed("mast"),), ("20", "<robot/>"), ("changed", "joints")),
        (
            (fixed("mast"), replace(fixed("top"), kind="joint")),
            ("20", "<robot/>"),
            ("changed", "joints"),
        ),
        ((fixed("mast"), fixed("top")), ("20", "<robot>"), ("", "")),
    ],
)
def test_a_stock_state_publisher_gets_descriptions_unless_a_frame_vanishes(
    edges: tuple[PlanEdge, ...],
    params: tuple[str, str],
    difference: tuple[str, str],
    tmp_path: Path,
) -> None:
    old = replace(PLAN, processes=(STATE_PUBLISHER, GUARD), edges=(fixed("mast"), fixed("top")))
    for name, text in (("old", PARAMS % ("20", "<robot>")), ("new", PARAMS % params)):
        (tmp_path / name / "params").mkdir(parents=True)
        (tmp_path / name / "params" / "joints.yaml").write_text(text)
    changes = change(old, tmp_path / "old", replace(old, edges=edges), tmp_path / "new")
    kind, name = difference
    assert "joints" not in changes.changed or kind == "changed"
    assert (name in changes.described, name in changes.changed) == (
        kind == "described",
        kind == "changed",
    )
