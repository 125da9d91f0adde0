"""Stock nodes that replace tfcompose's own publishers in a launch file."""

from __future__ import annotations

import json
from itertools import pairwise
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

from tfcompose.model.plan import STOCK_DESCRIPTION
from tfcompose.model.plan.stock import MOST_HZ, OWN_KINDS, STATE_PUBLISHER, static_names
from tfcompose.model.process_keys import Setting
from tfcompose.tools.exporters.launch_actions import Action, FixedEdge, StartNode
from tfcompose.tools.exporters.launch_texts import FileContent

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.plan import Plan, PlanEdge
    from tfcompose.tools.exporters.launch_texts import Text


def other_fixed_edges(plan: Plan, urdf: str) -> list[PlanEdge] | None:
    """Return the fixed edges that the URDF does not contain.

    Return None if stock nodes cannot send all edges. Then tfcompose's own publishers send them.
    """
    owners = {process.name for process in plan.started if process.kind in OWN_KINDS}
    if (
        not owners
        or len(owners) > len(OWN_KINDS)
        or any(plan.process(name).description for name in owners)
    ):
        return None
    program = f"${{executable:{STATE_PUBLISHER}/"
    if any(process.argv[:1] and process.argv[0].startswith(program) for process in plan.processes):
        return None
    edges = {(edge.parent, edge.child): edge for edge in plan.edges if edge.owner in owners}
    of_urdf = edges_published_by(urdf, plan.ros.frame_prefix)
    rest = [edge for ends, edge in edges.items() if ends not in of_urdf]
    if not of_urdf or of_urdf - set(edges) or any(edge.kind != "static" for edge in rest):
        return None
    return rest


def edges_published_by(urdf: str, prefix: str) -> set[tuple[str, str]]:
    """Return the edges (parent, child) that robot_state_publisher sends for this URDF.

    It sends no edges of floating joints. ``prefix`` is its ``frame_prefix``.
    """
    joints = [
        joint
        for joint in ET.fromstring(urdf).iter("joint")  # noqa: S314
        if joint.get("type") not in (None, "floating")
    ]
    return {
        (prefix + parent.get("link", ""), prefix + child.get("link", ""))
        for joint in joints
        if (parent := joint.find("parent")) is not None
        and (child := joint.find("child")) is not None
    }


def stock_nodes(plan: Plan, fixed: list[PlanEdge]) -> Iterator[Action]:
    """Yield robot_state_publisher, and a static_transform_publisher for each fixed edge."""
    names = static_names(plan)
    yield _state_publisher(plan)
    for edge in fixed:
        yield FixedEdge(
            name=names[edge.child],
            parent=edge.parent,
            child=edge.child,
            xyz=edge.pose.xyz,
            quat_xyzw=edge.pose.quat_xyzw,
            namespace=plan.ros.namespace,
            remap=_remap(plan),
        )


def _remap(plan: Plan) -> dict[str, Text]:
    """Return the remappings of tfcompose's own publishers."""
    return {
        old: (new,)
        for process in plan.started
        if process.kind in OWN_KINDS
        for old, new in process.remap.items()
    }


def _state_publisher(plan: Plan) -> StartNode:
    """Return robot_state_publisher, which listens to the joint states of the plan's ``joints``."""
    joints = next((process for process in plan.started if process.kind == "joints"), None)
    parameters = _params(joints.argv) if joints else {}
    frequency_hz = min(parameters.pop("publish_frequency", MOST_HZ), MOST_HZ)
    params = {
        "robot_description": FileContent(STOCK_DESCRIPTION),
        "publish_frequency": frequency_hz,
        **parameters,
        "use_sim_time": plan.ros.clock == "sim",
    }
    if plan.ros.frame_prefix:
        params["frame_prefix"] = plan.ros.frame_prefix
    return StartNode(
        package=STATE_PUBLISHER,
        executable=STATE_PUBLISHER,
        name=STATE_PUBLISHER,
        namespace=plan.ros.namespace,
        remap=_remap(plan),
        params=params,
        settings=(Setting("output", ("screen",)),),
    )


def _params(argv: tuple[str, ...]) -> dict[str, Any]:
    """Return the parameters in the command line of a tfcompose process."""
    settings = [argument for before, argument in pairwise(argv) if before == "-p"]
    return {
        name: json.loads(value)
        for name, _, value in (argument.partition(":=") for argument in settings)
    }
