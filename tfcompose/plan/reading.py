"""From a plan's JSON to the plan: every value is of its kind, or it is refused."""

from __future__ import annotations

from typing import Any, get_args

from tfcompose.geometry import Pose, norm
from tfcompose.plan import (
    Claim,
    Clock,
    Discovery,
    Driven,
    EdgeKind,
    FenceWay,
    GuardMode,
    GuardPolicy,
    Joint,
    JointType,
    LifecycleState,
    LogLevel,
    OnViolation,
    Plan,
    PlanEdge,
    PlanProcess,
    PoseKnowledge,
    ProcessKind,
    Ready,
    ReadyKind,
    RestartPolicy,
    RosSettings,
    Simulation,
    SimulationKind,
    StartCondition,
    StopRule,
    StopSignal,
    Sweep,
    UnknownEdges,
)
from tfcompose.plan.fields import floats, get, one_of, optional, pairs, rows, strings, texts, there


def _pose_from_json(data: dict[str, Any], where: str) -> Pose:
    x, y, z = floats(data, "xyz", 3, where)
    qx, qy, qz, qw = floats(data, "quat_xyzw", 4, where)
    if abs(norm((qx, qy, qz, qw)) - 1) > 1e-6:  # noqa: PLR2004 (what was written is normalised to the last bit)
        raise ValueError(f"{where}: quat_xyzw is not a unit quaternion")
    return Pose((x, y, z), (qx, qy, qz, qw))


def _joint_from_json(data: dict[str, Any], where: str) -> Joint:
    ax, ay, az = floats(data, "axis", 3, where)
    return Joint(
        name=get(data, "name", str, where),
        type=one_of(data, "type", get_args(JointType), where),
        axis=(ax, ay, az),
        mimic=optional(data, "mimic", str, where),
        multiplier=get(data, "multiplier", float, where),
        offset=get(data, "offset", float, where),
    )


def _edge_from_json(data: dict[str, Any], where: str) -> PlanEdge:
    where += f", {data.get('parent')} → {data.get('child')}"
    source = get(data, "source", dict, where)
    return PlanEdge(
        parent=get(data, "parent", str, where),
        child=get(data, "child", str, where),
        kind=one_of(data, "kind", get_args(EdgeKind), where),
        owner=get(data, "owner", str, where),
        node=get(data, "node", str, where),
        pose=_pose_from_json(data, where),
        rate=optional(data, "rate", float, where),
        source=(get(source, "file", str, where), get(source, "line", int, where)),
        joint=_joint_from_json(get(data, "joint", dict, where), where) if "joint" in data else None,
        switched=strings(data, "switched", where) if "switched" in data else (),
    )


def _simulation_from_json(data: dict[str, Any], where: str) -> Simulation:
    joints, sweeps = get(data, "joints", dict, where), get(data, "sweep", dict, where)
    return Simulation(
        kind=one_of(data, "kind", get_args(SimulationKind), where),
        rate=get(data, "rate", float, where),
        radius=get(data, "radius", float, where),
        speed=get(data, "speed", float, where),
        pose=_pose_from_json(data, where),
        joints={name: get(joints, name, float, where) for name in joints},
        sweep={name: _sweep_from_json(get(sweeps, name, dict, where), where) for name in sweeps},
    )


def _sweep_from_json(data: dict[str, Any], where: str) -> Sweep:
    lower, upper = optional(data, "lower", float, where), optional(data, "upper", float, where)
    period_s = get(data, "period_s", float, where)
    if period_s <= 0 or (lower is None) != (upper is None):
        raise ValueError(f"{where}: a sweep needs a period above 0, and either both ends or none")
    return Sweep(period_s, lower, upper)


def _stop_from_json(data: dict[str, Any], where: str) -> StopRule:
    return StopRule(one_of(data, "signal", get_args(StopSignal), where), optional(data, "timeout_s", float, where))


def _ready_from_json(data: dict[str, Any], where: str) -> Ready:
    return Ready(
        kind=one_of(data, "kind", get_args(ReadyKind), where),
        text=get(data, "text", str, where),
        number=get(data, "number", float, where),
        timeout_s=optional(data, "timeout_s", float, where),
    )


def _words(data: dict[str, Any], key: str, words: tuple[str, ...], where: str) -> dict[str, Any]:
    values = get(data, key, dict, where)
    return {name: one_of(values, name, words, where) for name in values}


def _process_from_json(data: dict[str, Any], where: str) -> PlanProcess:
    where += f", {data.get('name')}"
    return PlanProcess(
        name=get(data, "name", str, where),
        kind=one_of(data, "kind", get_args(ProcessKind), where),
        argv=strings(data, "argv", where),
        env=texts(data, "env", where),
        cwd=optional(data, "cwd", str, where),
        params_file=optional(data, "params_file", str, where),
        remap=texts(data, "remap", where),
        nodes=strings(data, "nodes", where),
        restart=one_of(data, "restart", get_args(RestartPolicy), where),
        max_restarts=optional(data, "max_restarts", int, where),
        required=optional(data, "required", bool, where),
        stop=_stop_from_json(get(data, "stop", dict, where), where),
        log_level=one_of(data, "log_level", (None, *get_args(LogLevel)), where),
        lifecycle=_words(data, "lifecycle", get_args(LifecycleState), where),
        after=_words(data, "after", get_args(StartCondition), where),
        ready=None if there(data, "ready", where) is None else _ready_from_json(get(data, "ready", dict, where), where),
        host=optional(data, "host", str, where),
        owns=pairs(data, "owns", where),
        simulate=_simulation_from_json(get(data, "simulate", dict, where), where) if "simulate" in data else None,
        description=get(data, "description", str, where) if "description" in data else None,
        drives=rows(data, "drives", _driven_from_json) if "drives" in data else (),
        switches=_switches_from_json(data, where) if "switches" in data else {},
        namespace=get(data, "namespace", str, where) if "namespace" in data else None,
    )


def _driven_from_json(data: dict[str, Any], where: str) -> Driven:
    return Driven(
        sensor=get(data, "sensor", str, where),
        preset=get(data, "preset", str, where),
        publishes=get(data, "publishes", bool, where),
        switch=_parameters(get(data, "switch", dict, where), f"{where}: switch"),
        frames=_words(data, "frames", get_args(PoseKnowledge), where),
    )


def _switches_from_json(data: dict[str, Any], where: str) -> dict[str, dict[str, Any]]:
    nodes = get(data, "switches", dict, where)
    return {node: _parameters(get(nodes, node, dict, where), f"{where}: {node}") for node in nodes}


def _parameters(values: dict[str, Any], where: str) -> dict[str, Any]:
    if not all(isinstance(value, (str, int, float)) for value in values.values()):
        raise TypeError(f"{where} holds something that is no parameter")
    return values


def _guard_from_json(data: dict[str, Any]) -> GuardPolicy:
    return GuardPolicy(
        mode=one_of(data, "mode", get_args(GuardMode), "guard"),
        unknown_edges=one_of(data, "unknown_edges", get_args(UnknownEdges), "guard"),
        on_violation=one_of(data, "on_violation", get_args(OnViolation), "guard"),
        allow=rows(data, "allow", _allowed_from_json),
        fence=one_of(data, "fence", get_args(FenceWay), "guard") if "fence" in data else "auto",
    )


def _allowed_from_json(data: dict[str, Any], where: str) -> tuple[str, str]:
    return get(data, "parent", str, where), get(data, "child", str, where)


def _claim_from_json(data: dict[str, Any], where: str) -> Claim:
    return Claim(*(get(data, key, str, where) for key in ("node", "parent", "child", "switch")))


def plan_from_json(data: dict[str, Any]) -> Plan:
    """Return the plan that the data hold.

    Raises:
        KeyError, TypeError, ValueError, AttributeError, OverflowError: if they hold none.
    """
    ros = get(data, "ros", dict, "plan")
    return Plan(
        robot=get(data, "robot", str, "plan"),
        spec_digest=get(data, "spec_digest", str, "plan"),
        base=optional(data, "base", str, "plan"),
        ros=RosSettings(
            namespace=get(ros, "namespace", str, "ros"),
            domain_id=optional(ros, "domain_id", int, "ros"),
            discovery=one_of(ros, "discovery", (None, *get_args(Discovery)), "ros"),
            clock=one_of(ros, "clock", get_args(Clock), "ros"),
            frame_prefix=get(ros, "frame_prefix", str, "ros"),
            shared_frames=strings(ros, "shared_frames", "ros"),
        ),
        edges=rows(data, "edges", _edge_from_json),
        processes=rows(data, "processes", _process_from_json),
        guard=_guard_from_json(get(data, "guard", dict, "plan")),
        claims=rows(data, "claims", _claim_from_json),
        description=get(data, "description", str, "plan"),
        host=get(data, "host", str, "plan") if "host" in data else None,
    )
