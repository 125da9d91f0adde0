"""The plan as a file: JSON, written and read with the standard library alone."""

from __future__ import annotations

import json
from typing import Any

from tfcompose.findings import Finding, RejectedError, Span, finding
from tfcompose.plan import VERSION, GuardPolicy, Plan, PlanEdge, PlanProcess
from tfcompose.plan.reading import plan_from_json


def write_plan(plan: Plan) -> str:
    """Return the plan as JSON text: one line an edge and a process, the same bytes for the same plan."""
    head = {
        "version": plan.version,
        "robot": plan.robot,
        "spec_digest": plan.spec_digest,
        "description": plan.description,
        "base": plan.base,
        **({} if plan.host is None else {"host": plan.host}),
        "ros": _fields(plan.ros),
    }
    lines = [f"  {_json(key)}: {_json(value)}" for key, value in head.items()]
    lines.append(_block("edges", [_edge_to_json(edge) for edge in plan.edges]))
    lines.append(_block("processes", [_process_to_json(process) for process in plan.processes]))
    lines.append(_block("claims", [_fields(claim) for claim in plan.claims]))
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
    if data.get("version") != VERSION or data["version"] is True:
        message = f"the plan has version {data.get('version')!r}; this tfcompose reads version {VERSION}"
        raise RejectedError([_bad(message, Span(file))])
    try:
        return plan_from_json(data)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        what = f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)
        raise RejectedError([_bad(f"not a whole plan: {what}", Span(file))]) from None


def _bad(message: str, span: Span) -> Finding:
    return finding("TF902", message, span, help="build it again: tfcompose build robot.yaml")


_json = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode


def _block(key: str, rows: list[dict[str, Any]]) -> str:
    if not rows:
        return f'  "{key}": []'
    return f'  "{key}": [\n' + ",\n".join(f"    {_json(row)}" for row in rows) + "\n  ]"


def _fields(value: Any) -> dict[str, Any]:
    """Return the fields of one of the plan's objects as they are held."""
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
    if edge.switched:
        row["switched"] = edge.switched
    return row


def _process_to_json(process: PlanProcess) -> dict[str, Any]:
    row = _fields(process)
    row |= {"stop": _fields(process.stop), "ready": process.ready and _fields(process.ready)}
    simulation = row.pop("simulate")
    for key in ("description", "namespace"):
        if row[key] is None:
            del row[key]
    row["drives"] = [_fields(driven) for driven in process.drives]
    if not process.drives:
        del row["drives"]
    if not process.switches:
        del row["switches"]
    if simulation:
        row["simulate"] = _fields(simulation)
        pose = row["simulate"].pop("pose")
        row["simulate"] |= {"xyz": pose.xyz, "quat_xyzw": pose.quat_xyzw}
        row["simulate"]["sweep"] = {name: _fields(sweep) for name, sweep in simulation.sweep.items()}
    return row


def _guard_to_json(guard: GuardPolicy) -> dict[str, Any]:
    said = _fields(guard) | {"allow": [{"parent": parent, "child": child} for parent, child in guard.allow]}
    if guard.fence == "auto":
        del said["fence"]
    return said
