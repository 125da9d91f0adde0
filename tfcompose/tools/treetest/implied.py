"""Writes the test cases that follow from a robot file.

One case checks edges, owners, rates, joints and poses. If the cases start the robot, further
cases check that the guard reports second publishers.
"""

from __future__ import annotations

from math import degrees, radians
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.numbers import ANGLE_NOISE_RAD, clean, clean_rpy
from tfcompose.foundation.yaml_text import Bare, entry
from tfcompose.guard.verdict.drivers import EXACT, NOMINAL, expected_frames, is_fixed

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.foundation.geometry import Offset, Pose
    from tfcompose.model.plan import Plan, PlanEdge

#: Every edge must arrive within this time after the first transform. The time is long, because a
#: recording can begin while the robot is still starting.
_COMPLETE = "10 s"
#: A mean rate may be this far from the declared one. Verify reports an edge as slow below 80 %.
_SLOWEST, _FASTEST = 0.8, 1.25
#: The name of the injected node that publishes an edge which another node owns.
_RIVAL = "/second_publisher"
#: Decimals of a degree that people write.
_SHORT_DECIMALS = 3


def implied_suite(plan: Plan, robot: str, source: dict[str, Any]) -> str:
    """Return a test file with the cases that a robot's plan implies.

    Args:
        plan: the plan.
        robot: the robot file, relative to the test file.
        source: the keys of each case that say where its tree comes from. Without ``bag`` the robot
            is started, and second publishers can be injected.
    """
    cases = [{"name": "is as declared", **source, "expect": _expectations(plan)}]
    if "bag" not in source:
        cases += [_rival(edge, source) for edge in _contested_edges(plan)]
    lines = [*entry("robot", robot), "cases:"]
    for case in cases:
        first, *following = [line for key in case for line in entry(key, case[key], 2)]
        lines += ["", f"  - {first.lstrip()}", *following]
    return "\n".join(lines) + "\n"


def _expectations(plan: Plan) -> dict[str, Any]:
    edges = {_pair(edge): _edge(edge) for edge in plan.edges if not edge.switched}
    poses = {_pair(edge): _pose(edge.pose, limit) for edge, limit in _fixed_edges(plan)}
    expected = {"complete": _COMPLETE, "edges": edges, "pose": poses, "findings": []}
    return {key: value for key, value in expected.items() if value != {}}


def _contested_edges(plan: Plan) -> Iterator[PlanEdge]:
    """Yield the edges that get a case with a second publisher.

    These are all dynamic edges. An owner of joints also gets a case for its first joint, unless
    the plan lists a dynamic edge of this owner before it.
    """
    owners: set[str] = set()
    for edge in plan.edges:
        is_first = edge.kind == "joint" and edge.owner not in owners
        if edge.kind == "dynamic" or is_first:
            owners.add(edge.owner)
            yield edge


def _rival(edge: PlanEdge, source: dict[str, Any]) -> dict[str, Any]:
    """Return the case in which a second node publishes an edge."""
    return {
        "name": f"reports a second publisher of {edge.child}",
        **source,
        "inject": {"publish": {"edge": _pair(edge), "as": _RIVAL}},
        "expect": {"findings": [{"code": "TF801", "names": [_RIVAL, edge.child]}]},
    }


def _pair(edge: PlanEdge) -> Bare:
    return Bare(edge.name)


def _edge(edge: PlanEdge) -> dict[str, Any]:
    expected: dict[str, Any] = {"owner": edge.owner}
    if edge.rate is not None and edge.kind != "static":
        low, high = (float(f"{edge.rate * part:.4g}") for part in (_SLOWEST, _FASTEST))
        expected["rate"] = [f"{low:g} Hz", f"{high:g} Hz"]
    if edge.joint is not None:
        joint = {"name": edge.joint.name, "type": edge.joint.type, "axis": list(edge.joint.axis)}
        expected["joint"] = {**joint, **_pose(edge.pose, None)}
    return expected


def _fixed_edges(plan: Plan) -> Iterator[tuple[PlanEdge, Offset | None]]:
    """Yield the edges whose pose is tested, each with the tolerance of the pose.

    A frame that a sensor's driver publishes has the tolerance for drivers. An edge whose pose the
    robot file states has None, which means the tolerance that tests have by default.
    """
    frames = expected_frames(plan)
    for edge in plan.edges:
        driver = frames.get(edge.child)
        if not edge.pose_known or edge.switched:
            continue
        if driver is not None:
            yield edge, NOMINAL if driver.nominal else EXACT
        elif is_fixed(edge, plan.process(edge.owner)):
            yield edge, None


def _pose(pose: Pose, limit: Offset | None) -> dict[str, Any]:
    """Return the keys of a pose: ``xyz`` in metres, ``rpy``, and with a limit also ``within``.

    An angle is in degrees if the number is short, because people write angles so.
    """
    xyz, quat_xyzw = clean(pose)
    expected: dict[str, Any] = {"xyz": list(xyz)}
    expected["rpy"] = [_angle(angle) for angle in clean_rpy(quat_xyzw)]
    if limit is not None:
        expected["within"] = [f"{limit.xyz_m * 1e3:g} mm", f"{degrees(limit.rot_rad):g} deg"]
    return expected


def _angle(angle_rad: float) -> str | float:
    """Return an angle in degrees if that is short, else in radians."""
    angle_deg = round(degrees(angle_rad), _SHORT_DECIMALS)
    if not angle_deg or abs(radians(angle_deg) - angle_rad) > ANGLE_NOISE_RAD:
        return angle_rad
    return f"{angle_deg:g} deg"
