"""A robot file's tree for programs, in the shape that ``tree --live --format json`` has."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from tfcompose.emit.plan import plan_of
from tfcompose.observe.forest import forest

if TYPE_CHECKING:
    from tfcompose.model import Robot
    from tfcompose.observe.forest import Tree
    from tfcompose.plan import PlanEdge


def planned_json(robot: Robot) -> str:
    """Return one line of JSON: the trees with their roots, and of each edge what the robot says."""
    planned = {edge.child: edge for edge in plan_of(robot).edges}
    trees = [_tree(tree) for tree in forest((), planned)]
    return json.dumps({"robot": robot.name, "trees": trees}, ensure_ascii=False) + "\n"


def _tree(tree: Tree) -> dict[str, Any]:
    edges = [_edge(branch.planned) for branch in tree.branches if branch.planned is not None]
    return {"root": None if tree.loop else tree.branches[0].frame, "loop": list(tree.loop), "edges": edges}


def _edge(edge: PlanEdge) -> dict[str, Any]:
    return {
        "parent": edge.parent,
        "child": edge.child,
        "kind": edge.kind,
        "owner": edge.owner,
        "node": edge.node,
        "rate": edge.rate,
        "xyz": list(edge.pose.xyz),
        "quat_xyzw": list(edge.pose.quat_xyzw),
    }
