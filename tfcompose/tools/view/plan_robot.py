"""Conversion of a built plan to a robot for the view.

The robot has the edges of the plan. Its bodies and joint limits come from the URDF.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from tfcompose.compiler.urdf.convert import robot_of
from tfcompose.compiler.urdf.read import read_xml
from tfcompose.foundation.findings import Span
from tfcompose.model.robot import Edge, Joint, Link, Robot

if TYPE_CHECKING:
    from tfcompose.compiler.urdf.convert import Finder
    from tfcompose.model.plan import Plan, PlanEdge
    from tfcompose.model.robot import Limit


def robot_of_plan(plan: Plan, description: str | None, file: str, find: Finder) -> Robot:
    """Return the robot that a plan describes.

    Frames have their names of the running tree. ``description`` is the text of the URDF next to
    the plan ``file``, or None if there is none. ``find`` finds the meshes of the URDF.

    Raises:
        RejectedError: if the text is not a URDF.
    """
    links: dict[str, Link] = {}
    limits: dict[str, Limit | None] = {}
    ros = plan.ros
    if description is not None:
        described = robot_of(read_xml(description, file), file, find).robot
        final = {name: f"{ros.frame_prefix}{name}" for name in described.links}
        final |= {name: name for name in final.keys() & set(ros.shared_frames)}
        links = {final[name]: link for name, link in described.links.items()}
        limits = {final[edge.child]: edge.joint.limit for edge in described.edges if edge.joint}
    edges = tuple(_edge(edge, limits.get(edge.child)) for edge in plan.edges)
    frames = {frame: edge.span for edge in edges for frame in (edge.parent, edge.child)}
    frames |= {edge.child: edge.span for edge in edges}
    frames |= {frame: Span(file) for frame in links if frame not in frames}
    return Robot(
        plan.robot,
        file,
        frames,
        edges=edges,
        links=links,
        processes=(),
        base=plan.base,
        guard=plan.guard,
        args=plan.args,
    )


def _edge(edge: PlanEdge, limit: Limit | None) -> Edge:
    span = Span(*edge.source)
    joint = Joint(**asdict(edge.joint), span=span, limit=limit) if edge.joint else None
    return Edge(
        edge.parent,
        edge.child,
        edge.kind,
        edge.owner,
        edge.pose,
        node=edge.node,
        rate=edge.rate,
        joint=joint,
        switched=edge.switched,
        pose_known=edge.pose_known,
        span=span,
    )
