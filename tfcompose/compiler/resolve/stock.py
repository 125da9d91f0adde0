"""A stock robot_state_publisher instead of tfcompose's ``joints``.

It publishes the fixed edges and joints of its URDF. robot_state_publisher 3.3 (ROS 2 Jazzy)
publishes fixed joints on /tf_static and moving joints by ``joint_states``, and skips floating
joints. It prepends ``frame_prefix`` to every frame. It passes on joint states at most
``publish_frequency`` times a second, 20 by default. It also publishes ``robot_description``.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.compiler.resolve.processes import full_name
from tfcompose.foundation.findings import Finding, finding
from tfcompose.model.plan.stock import MOST_HZ
from tfcompose.model.plan.stock import STATE_PUBLISHER as NAME
from tfcompose.model.robot import JOINTS, STATIC, Node

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.resolve.draft import Draft
    from tfcompose.model.robot import Process, Robot


def use_stock_publisher(draft: Draft) -> Iterator[Finding]:
    """Replace ``joints`` with a stock robot_state_publisher if the file asks for one."""
    if draft.spec.ros.state_publisher == "stock" and draft.robot.base is not None:
        yield from stock_faults(draft.robot)
        draft.robot = with_stock(draft.robot)


def stock_faults(robot: Robot) -> Iterator[Finding]:
    """Yield findings about joints and frames that a stock publisher cannot publish correctly."""
    described = robot.described_frames()
    for edge in robot.edges:
        if (
            edge.joint
            and edge.owner == JOINTS
            and not (edge.child in described and edge.child != robot.base)
        ):
            message = (
                f"the joint {edge.joint.name} is not below {robot.base}, but a stock {NAME}"
                " publishes only joints below it"
            )
            advice = "state_publisher: tfcompose, or another base"
            yield finding("TF315", message, edge.joint.span, help=advice)
    shared = described & set(robot.ros.shared_frames) if robot.ros.frame_prefix else set[str]()
    for frame in sorted(shared):
        message = (
            f"{frame} is shared and in the tree of {robot.base}: a stock {NAME} prefixes every"
            " frame"
        )
        span = robot.frames.get(frame)
        yield finding("TF316", message, span, help="state_publisher: tfcompose")


def with_stock(robot: Robot) -> Robot:
    """Return the robot with a stock publisher as ``joints``.

    ``static`` keeps the fixed edges outside the URDF, and also publishes the description.
    """
    below = robot.described_frames() - {robot.base}
    edges = []
    for edge in robot.edges:
        is_taken = edge.owner == STATIC and edge.kind == "static" and edge.child in below
        edges.append(replace(edge, owner=JOINTS if is_taken else edge.owner))
    processes = list(robot.processes)
    if any(edge.owner == JOINTS for edge in edges):
        for index, process in enumerate(processes):
            if process.name == JOINTS:
                processes[index] = _stock(process, robot)
    return replace(robot, edges=tuple(edges), processes=tuple(processes))


def _stock(joints: Process, robot: Robot) -> Process:
    """Return the process of the stock publisher, with its own URDF.

    Its topic ``robot_description`` is remapped, because ``static`` publishes the description.
    """
    params = {"publish_frequency": MOST_HZ} | joints.params
    params["publish_frequency"] = min(float(params["publish_frequency"]), MOST_HZ)
    prefix = {"frame_prefix": robot.ros.frame_prefix} if robot.ros.frame_prefix else {}
    node = Node(full_name(robot.ros.namespace, NAME), joints.span, params=params | prefix)
    return replace(
        joints,
        kind="run",
        package=NAME,
        executable=NAME,
        ros_nodes=(node,),
        remap={"robot_description": "~/robot_description"} | joints.remap,
        describes=True,
    )
