"""The plan as a file: JSON, written and read with the standard library alone."""

from __future__ import annotations

import json
import math
from typing import Any, TypeVar

from tfcompose.diagnostic import Diagnostic, RejectedError, Span, finding
from tfcompose.plan import (
    EDGE_KINDS,
    PROCESS_KINDS,
    VERSION,
    GuardPolicy,
    Joint,
    Plan,
    PlanEdge,
    PlanProcess,
    RosSettings,
    Simulation,
)
from tfcompose.pose import Pose, norm


def write_plan(plan: Plan) -> str:
    """Return the plan as JSON text: one line an edge and a process, the same bytes for the same plan."""
    head = {
        "version": plan.version,
        "robot": plan.robot,
        "spec_digest": plan.spec_digest,
        "description": plan.description,
        "base": plan.base,
        "ros": _fields(plan.ros),
    }
    lines = [f"  {_json(key)}: {_json(value)}" for key, value in head.items()]
    lines.append(_block("edges", [_edge_to_json(edge) for edge in plan.edges]))
    lines.append(_block("processes", [_process_to_json(process) for process in plan.processes]))
    lines.append(f'  "guard": {_json(_guard_to_json(plan.guard))}')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def read_plan(text: str, file: str) -> Plan:
    """Return the plan that ``write_plan`` wrote.

    Raises:
        RejectedError: with TF902 findings, if the text is no plan of this version.
    """
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        line, column = getattr(error, "lineno", 1), getattr(error, "colno", 1)
        raise RejectedError([_bad(f"not a plan: {error}", Span(file, line, column, line, column + 1))]) from None
    if not isinstance(data, dict) or "edges" not in data or "processes" not in data:
        raise RejectedError([_bad("not a plan: it has no edges and processes", Span(file))])
    if data.get("version") != VERSION:
        message = f"the plan has version {data.get('version')!r}; this tfcompose reads version {VERSION}"
        raise RejectedError([_bad(message, Span(file))])
    try:
        return _plan_from_json(data)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        what = f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)
        raise RejectedError([_bad(f"not a whole plan: {what}", Span(file))]) from None


def _bad(message: str, span: Span) -> Diagnostic:
    return finding("TF902", message, span, help="build it again: tfcompose build robot.yaml")


_json = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode


def _block(key: str, rows: list[dict[str, Any]]) -> str:
    if not rows:
        return f'  "{key}": []'
    return f'  "{key}": [\n' + ",\n".join(f"    {_json(row)}" for row in rows) + "\n  ]"


def _fields(value: Joint | GuardPolicy | PlanProcess | RosSettings | Simulation) -> dict[str, Any]:
    return {name: getattr(value, name) for name in value.__slots__}


def _edge_to_json(edge: PlanEdge) -> dict[str, Any]:
    file, line = edge.source
    row: dict[str, Any] = {
        "parent": edge.parent,
        "child": edge.child,
        "kind": edge.kind,
        "owner": edge.owner,
        "node": edge.node,
        "xyz": edge.pose.xyz,
        "quat_xyzw": edge.pose.quat_xyzw,
        "rate": edge.rate,
        "source": {"file": file, "line": line},
    }
    if edge.joint:
        row["joint"] = _fields(edge.joint)
    return row


def _process_to_json(process: PlanProcess) -> dict[str, Any]:
    row = _fields(process)
    simulation = row.pop("simulate")
    if simulation:
        row["simulate"] = _fields(simulation)
        pose = row["simulate"].pop("pose")
        row["simulate"] |= {"xyz": pose.xyz, "quat_xyzw": pose.quat_xyzw}
    return row


def _guard_to_json(guard: GuardPolicy) -> dict[str, Any]:
    return _fields(guard) | {"allow": [{"parent": parent, "child": child} for parent, child in guard.allow]}


T = TypeVar("T")


def _get(data: dict[str, Any], key: str, kind: type[T], where: str) -> T:
    value = data[key]
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise TypeError(f"{where}: {key} is {value!r}, not a {kind.__name__}")
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{where}: {key} is not finite")
    return value


def _one_of(data: dict[str, Any], key: str, allowed: tuple[str, ...], where: str) -> Any:
    if data[key] not in allowed:
        raise ValueError(f"{where}: {key} is {data[key]!r}, not one of {', '.join(allowed)}")
    return data[key]


def _optional(data: dict[str, Any], key: str, kind: type[T], where: str) -> T | None:
    return None if data[key] is None else _get(data, key, kind, where)


def _floats(data: dict[str, Any], key: str, count: int, where: str) -> tuple[float, ...]:
    values = _get(data, key, list, where)
    if len(values) != count or not all(isinstance(v, (int, float)) and math.isfinite(v) for v in values):
        raise ValueError(f"{where}: {key} is not {count} finite numbers")
    return tuple(float(value) for value in values)


def _texts(data: dict[str, Any], key: str, where: str) -> dict[str, str]:
    values = _get(data, key, dict, where)
    if not all(isinstance(value, str) for value in values.values()):
        raise TypeError(f"{where}: {key} holds something that is no text")
    return values


def _pose_from_json(data: dict[str, Any], where: str) -> Pose:
    x, y, z = _floats(data, "xyz", 3, where)
    qx, qy, qz, qw = _floats(data, "quat_xyzw", 4, where)
    if abs(norm((qx, qy, qz, qw)) - 1) > 1e-6:  # noqa: PLR2004 (what was written is normalised to the last bit)
        raise ValueError(f"{where}: quat_xyzw is not a unit quaternion")
    return Pose((x, y, z), (qx, qy, qz, qw))


def _joint_from_json(data: dict[str, Any], where: str) -> Joint:
    ax, ay, az = _floats(data, "axis", 3, where)
    return Joint(
        name=_get(data, "name", str, where),
        type=_get(data, "type", str, where),
        axis=(ax, ay, az),
        mimic=_optional(data, "mimic", str, where),
        multiplier=_get(data, "multiplier", float, where),
        offset=_get(data, "offset", float, where),
    )


def _edge_from_json(data: dict[str, Any]) -> PlanEdge:
    where = f"edge {data.get('parent')} → {data.get('child')}"
    source = _get(data, "source", dict, where)
    return PlanEdge(
        parent=_get(data, "parent", str, where),
        child=_get(data, "child", str, where),
        kind=_one_of(data, "kind", EDGE_KINDS, where),
        owner=_get(data, "owner", str, where),
        node=_get(data, "node", str, where),
        pose=_pose_from_json(data, where),
        rate=_optional(data, "rate", float, where),
        source=(_get(source, "file", str, where), _get(source, "line", int, where)),
        joint=_joint_from_json(data["joint"], where) if data.get("joint") else None,
    )


def _simulation_from_json(data: dict[str, Any], where: str) -> Simulation:
    joints = _get(data, "joints", dict, where)
    return Simulation(
        kind=_one_of(data, "kind", ("circle", "fixed", "joints"), where),
        rate=_get(data, "rate", float, where),
        radius=_get(data, "radius", float, where),
        speed=_get(data, "speed", float, where),
        pose=_pose_from_json(data, where),
        joints={name: _get(joints, name, float, where) for name in joints},
    )


def _process_from_json(data: dict[str, Any]) -> PlanProcess:
    where = f"process {data.get('name')}"
    simulation = data.get("simulate")
    return PlanProcess(
        name=_get(data, "name", str, where),
        kind=_one_of(data, "kind", PROCESS_KINDS, where),
        argv=tuple(str(word) for word in _get(data, "argv", list, where)),
        env=_texts(data, "env", where),
        cwd=_optional(data, "cwd", str, where),
        params_file=_optional(data, "params_file", str, where),
        remap=_texts(data, "remap", where),
        nodes=tuple(str(node) for node in _get(data, "nodes", list, where)),
        restart=_one_of(data, "restart", ("no", "on-failure", "always"), where),
        after=_texts(data, "after", where),
        ready=_optional(data, "ready", str, where),
        host=_optional(data, "host", str, where),
        owns=tuple((str(parent), str(child)) for parent, child in _get(data, "owns", list, where)),
        simulate=_simulation_from_json(simulation, where) if simulation else None,
    )


def _guard_from_json(data: dict[str, Any]) -> GuardPolicy:
    return GuardPolicy(
        mode=_one_of(data, "mode", ("off", "watch", "strict"), "guard"),
        unknown_edges=_one_of(data, "unknown_edges", ("ignore", "warn", "error"), "guard"),
        on_violation=_one_of(data, "on_violation", ("report", "stop"), "guard"),
        allow=tuple((str(edge["parent"]), str(edge["child"])) for edge in _get(data, "allow", list, "guard")),
    )


def _plan_from_json(data: dict[str, Any]) -> Plan:
    ros = _get(data, "ros", dict, "plan")
    return Plan(
        robot=_get(data, "robot", str, "plan"),
        spec_digest=_get(data, "spec_digest", str, "plan"),
        base=_optional(data, "base", str, "plan"),
        ros=RosSettings(
            namespace=_get(ros, "namespace", str, "ros"),
            domain_id=_optional(ros, "domain_id", int, "ros"),
            discovery=_optional(ros, "discovery", str, "ros"),
            clock=_one_of(ros, "clock", ("wall", "sim"), "ros"),
            frame_prefix=_get(ros, "frame_prefix", str, "ros"),
            shared_frames=tuple(str(frame) for frame in _get(ros, "shared_frames", list, "ros")),
        ),
        edges=tuple(_edge_from_json(edge) for edge in _get(data, "edges", list, "plan")),
        processes=tuple(_process_from_json(process) for process in _get(data, "processes", list, "plan")),
        guard=_guard_from_json(_get(data, "guard", dict, "plan")),
        description=_get(data, "description", str, "plan"),
    )
