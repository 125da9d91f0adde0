"""Processes: their names and how they start and end, including simulated and external processes.

This module also makes the processes that tfcompose provides: ``static``, ``joints``, ``guard``.
"""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.hosts import entry_of
from tfcompose.compiler.resolve.poses import pose_of
from tfcompose.compiler.resolve.presets import (
    is_node_preset,
    name_of,
    node_preset,
    preset_of,
    start_advice,
    unknown_node_preset,
)
from tfcompose.foundation.findings import Note, did_you_mean, finding
from tfcompose.model.plan import Ready, Simulation, Sweep
from tfcompose.model.process_keys import ROS_ARGUMENTS
from tfcompose.model.robot import (
    BUILT_IN,
    GUARD,
    JOINTS,
    MOVING,
    ROS2_LAUNCH,
    SHELL,
    STATIC,
    Node,
    Process,
)
from tfcompose.spec.language.key_hints import habit
from tfcompose.spec.language.process import (
    RUNNING,
    SIMULATIONS,
    SWEEP,
    ReadySpec,
    Run,
    ScheduleSpec,
    StopSpec,
    keys_of,
)
from tfcompose.spec.language.robot import JointZeroSpec

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.resolve.draft import Draft, Finds
    from tfcompose.foundation.findings import Finding, Span
    from tfcompose.model.plan import ProcessKind
    from tfcompose.model.process_keys import Way
    from tfcompose.model.robot import Joint, Robot
    from tfcompose.spec.language import Validated
    from tfcompose.spec.language.process import (
        ContainerSpec,
        ProcessSpec,
        Simulate,
        StartedSpec,
    )
    from tfcompose.spec.language.robot import RobotSpec
    from tfcompose.spec.load import Path


def user_process(name: str, declared: ProcessSpec, validated: Validated) -> Finds[Process | None]:
    """Return the process that the entry describes, None if a required key is missing."""
    spec = validated.spec
    path: Path = ("processes", name)
    span = spec.key_span(path)
    namespace = namespace_of(declared, spec.ros.namespace)
    nodes = yield from nodes_of(name, declared, namespace, spec)
    has_common = declared.nodes and declared.params
    common = Node("/**", span, path, declared.params) if has_common else None
    if declared.external:
        process = Process(name, "external", span=span, ros_nodes=nodes, all_nodes=common)
        return replace(process, **how(declared, namespace, "external"))
    if declared.simulate:
        simulation = yield from _simulation(name, declared.simulate, validated)
        if simulation is None:
            return None
        process = Process(
            name, "simulate", span=span, ros_nodes=(Node(nodes[0].name, nodes[0].span),)
        )
        keys = how(declared, namespace, "simulate") | {"simulate": simulation}
        return replace(process, **keys)
    if declared.component and declared.container:
        process = Process(name, "component", span=span, ros_nodes=nodes)
        return replace(process, **how(declared, namespace, "component"))
    run = _run_of(declared)
    if run and run.is_startable:
        process = Process(name, "run", span=span, ros_nodes=nodes, all_nodes=common)
        started = program(run, shell=bool(declared.shell))
        return replace(process, **how(declared, namespace), **started)
    if _is_way_refused(name, validated):
        return None
    if declared.run:
        yield finding(
            "TF102",
            f"{name}: run needs package and executable",
            spec.key_span((*path, "run")),
            help=start_advice(
                declared.node,
                "run: {package: …, executable: …}, or {launch: package/file.launch.py}",
            ),
        )
        return None
    preset = preset_of(declared.node)
    if preset is not None and not is_node_preset(preset):
        yield unknown_node_preset(preset, spec.span_of((*path, "node", "preset")))
        return None
    ways = "run: {package: …, executable: …}, component: PACKAGE/CLASS, simulate: {…}"
    yield finding(
        "TF102",
        f"{name} does not say how it runs",
        span,
        help=start_advice(declared.node, f"{ways}, or external: true"),
    )
    return None


#: Rate in Hz of a simulated owner's edge without a declared rate.
_USUAL_RATE_HZ = 20.0


def _declared_rate(owner: str, spec: RobotSpec) -> float:
    """Return the highest declared rate of the owner's edges, in Hz."""
    sections = (spec.frames, spec.links, spec.joints, spec.parts)
    rates = [
        entry.rate
        for section in sections
        for entry in section.values()
        if not isinstance(entry, JointZeroSpec) and entry.owner == owner and entry.rate
    ]
    return max(rates, default=_USUAL_RATE_HZ)


def _simulation(name: str, simulate: Simulate, validated: Validated) -> Finds[Simulation | None]:
    entry_path: Path = ("processes", name, "simulate")
    rate = simulate.rate or _declared_rate(name, validated.spec)
    if simulate.circle:
        return Simulation(
            "circle",
            rate,
            radius=simulate.circle.radius,
            speed=simulate.circle.speed,
        )
    if simulate.fixed:
        return Simulation("fixed", rate, pose=pose_of(simulate.fixed))
    if simulate.joints is not None:
        return Simulation("joints", rate)
    if not any(
        path[:3] == entry_path and path[3:4] and path[3] in SIMULATIONS
        for path in validated.refused
    ):
        message = f"{name}: simulate needs circle, fixed or joints"
        yield finding("TF102", message, validated.spec.key_span(entry_path))
    return None


def _is_way_refused(name: str, validated: Validated) -> bool:
    """Return whether the key that defines how the process runs was rejected."""
    refused = [
        path[2:]
        for path in validated.refused
        if path[:2] == ("processes", name) and len(path) > 2  # noqa: PLR2004
    ]
    return any(
        way in RUNNING | {"container", "preset"} or habit(str(way), {"run"})
        for way, *rest in refused
        if not rest or way != "run" or isinstance(rest[0], int) or rest[0] != "args"
    )


def check_names(draft: Draft) -> Iterator[Finding]:
    """Yield a finding for each name that a sensor and a process, or two processes, share.

    A sensor may share the name of the process that drives it.
    """
    spec = draft.spec
    first: dict[str, Process] = {}
    for name, sensor in spec.sensors.items():
        driven_by_it = sensor.driver is not None and sensor.driver.process == name
        if name in spec.processes and not driven_by_it:
            first[name] = Process(name, "external", span=spec.key_span(("sensors", name)))
    for process in draft.all_processes:
        first_process = first.setdefault(process.name, process)
        if first_process.span != process.span:
            notes = [Note(f"{first_process.name} is also defined here", first_process.span)]
            advice = "rename one of them"
            if process.name in spec.sensors:
                advice += f", or, if it drives the sensor, driver: {process.name}"
            message = (
                f"the name {process.name} is used twice; sensors and processes share one name"
                " space"
            )
            yield finding("TF502", message, process.span, notes=notes, help=advice)


def check_waits(draft: Draft) -> Iterator[Finding]:
    """Yield findings about unknown names under ``after``, and waits for ends that never come.

    A name that a rejected entry may define is not reported.
    """
    spec, process_names = draft.spec, draft.process_names
    refused = {name for _, name in draft.broken}
    missing = tuple(name for section, name in draft.broken if section == "parts" and name)
    lasting = {process.name for process in draft.processes if process.kind != "run"}
    for process in draft.processes:
        path: Path = (*entry_of(process, spec), "after")
        for awaited, what in process.after.items():
            if what == "done" and awaited in lasting:
                message = f"{process.name} waits until {awaited} is done, which never happens"
                advice = f"after: {{{awaited}: ready}}, or started"
                yield finding("TF813", message, spec.span_of((*path, awaited)), help=advice)
            elif process.component and awaited == process.component.container:
                continue  # tfcompose adds this wait
            elif awaited not in process_names | refused and not awaited.startswith(missing):
                names = sorted(process_names - {process.name})
                advice = did_you_mean(awaited, names, f"one of: {', '.join(names)}")
                message = f"{process.name} waits for {awaited}, which is not a process"
                yield finding("TF813", message, spec.key_span((*path, awaited)), help=advice)


def check_launch_nodes(draft: Draft) -> Iterator[Finding]:
    """Yield a finding for each owner that is a launch file without named nodes."""
    owned = {edge.owner: edge for edge in reversed(draft.edges)}
    for process in draft.processes:
        edge, declared = owned.get(process.name), draft.spec.processes.get(process.name)
        is_launch = process.launch is not None or process.argv[:2] == ROS2_LAUNCH
        is_read = ("processes", process.name) not in draft.broken
        is_named = declared is None or declared.node is not None or declared.nodes
        if edge and is_launch and is_read and not is_named:
            message = (
                f"{process.name} is a launch file, and the node in it that publishes {edge.name}"
                " is not named"
            )
            advice = f"processes: {{{process.name}: {{node: NAME}}}}"
            yield finding("TF332", message, edge.owner_at or edge.span, help=advice)


_FIELDS = frozenset(field.name for field in fields(Process) if field.init)


def how(declared: StartedSpec | ContainerSpec, namespace: str, way: Way = "run") -> dict[str, Any]:
    """Return keyword arguments for ``Process`` from the keys of the same names in the entry.

    ``way`` selects the keys that have an effect on such a process.
    """
    stated: dict[str, Any] = {}
    for key in _FIELDS & keys_of(way):
        value = getattr(declared, key)
        if isinstance(value, ReadySpec):
            stated[key] = _ready(value, namespace)
        elif isinstance(value, (ScheduleSpec, StopSpec)):
            stated[key] = value.to_plan()
        elif value is not None:
            stated[key] = value
    if declared.namespace is not None:
        stated["namespace"] = namespace
    return stated


def program(run: Run, *, shell: bool) -> dict[str, Any]:
    """Return keyword arguments for the program: a package's program, a launch file, or a command.

    With ``shell``, the command is a single string.
    """
    if shell and run.argv:
        return {"argv": (*SHELL, *run.argv)}
    return _of_ros2(run.argv) or {
        "package": run.package,
        "executable": run.executable,
        "launch": run.launch,
        "argv": run.argv or run.args,
    }


def _of_ros2(argv: tuple[str, ...]) -> dict[str, Any] | None:
    """Return the program that ``ros2 run`` or ``ros2 launch`` starts, None for other commands.

    A command with options of ``ros2`` itself, or with a path to a launch file, is kept as it is.
    """
    match argv:
        case ("ros2", "run", package, executable, *words) if not package.startswith("-"):
            return {"package": package, "executable": executable, "argv": tuple(words)}
        case ("ros2", "launch", package, file, *words) if not package.startswith("-") and all(
            ":=" in argument for argument in (*words,)
        ):
            return (
                {"launch": f"{package}/{file}", "argv": tuple(words)} if ":=" not in file else None
            )
        case _:
            return None


def _ready(declared: ReadySpec, namespace: str) -> Ready | None:
    timeout_s = declared.timeout
    if declared.topic is not None:
        return Ready("topic", full_name(namespace, declared.topic), timeout_s=timeout_s)
    if declared.service is not None:
        return Ready("service", full_name(namespace, declared.service), timeout_s=timeout_s)
    if declared.lifecycle is not None:
        return Ready("lifecycle", declared.lifecycle, timeout_s=timeout_s)
    if declared.log is not None:
        return Ready("log", declared.log, timeout_s=timeout_s)
    if declared.exit is not None:
        return Ready("exit", number=float(declared.exit), timeout_s=timeout_s)
    if declared.time is not None:
        return Ready("time", number=declared.time, timeout_s=timeout_s)
    return (
        Ready("edges", timeout_s=timeout_s) if declared.edges else None
    )  # any other condition was rejected


#: Parameters of ``joints``, each with an example. They are parameters of robot_state_publisher.
_JOINTS_PARAMS: dict[str, Any] = {"publish_frequency": 30.0, "ignore_timestamp": True}
_KINDS: dict[str, ProcessKind] = {STATIC: "static", JOINTS: "joints", GUARD: "guard"}


def built_in_processes(spec: RobotSpec) -> list[Process]:
    """Return the processes that tfcompose provides, with the keys under their names."""
    built_in = []
    for name in BUILT_IN:
        declared = spec.processes.get(name)
        span = spec.key_span(("processes", name)) if declared else spec.key_span(("robot",))
        path: Path = ("processes", name)
        params = declared.params if declared and name == JOINTS else {}
        node = Node(full_name(spec.ros.namespace, f"tfcompose_{name}"), span, path, params)
        process = Process(name, _KINDS[name], span=span, ros_nodes=(node,))
        if declared:
            process = replace(process, **how(declared, spec.ros.namespace, "built-in"))
        built_in.append(process)
    return built_in


def says_how(declared: ProcessSpec | None) -> bool:
    """Return whether the entry defines how its process runs.

    Otherwise the entry only adds keys to a process that tfcompose provides.
    """
    return declared is not None and bool(
        declared.run or declared.external or declared.simulate or declared.component
    )


def add_process(process: Process, declared: ProcessSpec | None, spec: RobotSpec) -> Process:
    """Return a process that tfcompose adds, with the keys under its name.

    By default it runs on the host of ``static``.
    """
    if declared:
        stated = how(declared, spec.ros.namespace, "built-in")
        process = replace(
            process, **{key: stated[key] for key in stated if key in declared.model_fields_set}
        )
    static = spec.processes.get(STATIC)
    return replace(process, host=process.host or (static.host if static else None))


def check_built_in_keys(name: str, declared: ProcessSpec, spec: RobotSpec) -> Iterator[Finding]:
    """Yield findings about entries named after processes that tfcompose provides."""
    path: Path = ("processes", name)
    keys = keys_of("built-in") | ({"params"} if name == JOINTS else set())
    wrong = declared.model_fields_set - keys
    advice = f"its keys can be: {', '.join(sorted(keys))}"
    if wrong & RUNNING:
        advice = (
            f"give what {'joints publishes from' if name == JOINTS else 'you start'} a name of its"
            f" own; {advice}"
        )
    for key in wrong:
        message = f"{name} is built in and has no {key}"
        yield finding("TF101", message, spec.key_span((*path, key)), help=advice)
    if name == JOINTS:
        yield from _joints_params(declared.params, spec)


def _joints_params(params: dict[str, Any], spec: RobotSpec) -> Iterator[Finding]:
    """Yield findings about the parameters of ``joints``."""
    for name, value in params.items():
        path: Path = ("processes", JOINTS, "params", name)
        example = _JOINTS_PARAMS.get(name)
        if example is None:
            advice = did_you_mean(name, _JOINTS_PARAMS, f"it has {' and '.join(_JOINTS_PARAMS)}")
            yield finding(
                "TF101", f"joints has no parameter {name}", spec.key_span(path), help=advice
            )
        elif isinstance(value, bool) != isinstance(example, bool) or not isinstance(
            value, (bool, int, float)
        ):
            advice = f"for example {name}: {str(example).lower()}"
            what = "true or false" if isinstance(example, bool) else "a number of hertz"
            yield finding("TF103", f"{name} is {what}", spec.span_of(path), help=advice)
        elif not isinstance(value, bool) and not 0 < value < math.inf:
            advice = "leave it out, and every joint state is published"
            yield finding("TF106", f"{name} has to be above 0", spec.span_of(path), help=advice)


def check_keys(draft: Draft) -> Iterator[Finding]:
    """Yield a finding for each key of a process that has no effect."""
    spec = draft.spec
    yield from _idle_of_containers(spec)
    for name, process in spec.processes.items():
        yield from _idle(("processes", name), name, process, spec)
    for name, sensor in spec.sensors.items():
        if sensor.driver:
            yield from _idle(
                ("sensors", name, "driver"), f"the driver of {name}", sensor.driver, spec
            )


def _idle_of_containers(spec: RobotSpec) -> Iterator[Finding]:
    """Yield a finding for each key without effect on an external container."""
    for name, container in spec.containers.items():
        works = keys_of("external") | {"external"}
        for key in container.model_fields_set - works if container.external else ():
            message, advice = (
                f"{name} is external, so {key} has no effect",
                "remove it, or set it where the process is started",
            )
            yield finding("TF851", message, spec.key_span(("containers", name, key)), help=advice)


def _idle_rate(path: Path, name: str, process: StartedSpec, spec: RobotSpec) -> Iterator[Finding]:
    """Yield a finding about the key ``rate``, which only ``joints`` has."""
    if process.rate is None or path == ("processes", JOINTS):
        return
    advice = "remove it; the rate belongs to the edge: odom: {parent: map, owner: …, rate: 10 Hz}"
    if process.simulate:
        advice = "write it under simulate"
    elif path == ("processes", STATIC):
        advice = "remove it; fixed edges are sent once"
    message = f"{name} has no rate; only the process joints has"
    yield finding("TF101", message, spec.key_span((*path, "rate")), help=advice)


def _idle(path: Path, name: str, process: StartedSpec, spec: RobotSpec) -> Iterator[Finding]:
    """Yield a finding for each key without effect on the process.

    Keys are without effect on an external or simulated process, or on a component. If an overlay
    made the process external, for example, the other keys are intended for the robot without the
    overlay. They are not reported.
    """
    yield from _idle_rate(path, name, process, spec)
    way: Way = "external" if process.external else "simulate" if process.simulate else "run"
    way = "component" if process.component else way
    if (
        way == "run"
        or (*path, way) in spec.spans.replaced
        or (way == "simulate" and path[0] == "sensors")
    ):
        return  # a simulated driver is rejected elsewhere
    what, whom = "simulated", "on the real process"
    if way == "external":
        what, whom = "external", "where the process is started"
    elif way == "component":
        what, whom = "a component", f"on the container {process.container}"
    for key in (
        process.model_fields_set - keys_of(way) - RUNNING - {"rate"}
    ):  # ``RUNNING`` keys are rejected elsewhere
        message, advice = (
            f"{name} is {what}, so {key} has no effect",
            f"remove it, or set it {whom}",
        )
        yield finding("TF851", message, spec.key_span((*path, key)), help=advice)


def check_arguments(draft: Draft) -> Iterator[Finding]:
    """Yield findings about parameter files without parameters, and keys that reach no node."""
    spec = draft.spec
    for process in draft.robot.processes:
        path: Path = ("processes", process.name)
        names_params_file = any("${params_file}" in text for text in process.texts)
        if process.argv[:2] in {SHELL, ROS2_LAUNCH}:
            for key in ROS_ARGUMENTS:
                if key == "params" and names_params_file:
                    continue
                if getattr(process, key) and spec.spans.has((*path, key)):
                    yield _unreached_key(key, process, spec.key_span((*path, key)))
        elif (
            names_params_file
            and not process.all_nodes
            and not any(node.params for node in process.ros_nodes)
            and spec.spans.has((*path, "run"))
        ):
            message = f"{process.name} is given ${{params_file}}, and has no parameters"
            yield finding("TF816", message, spec.span_of((*path, "run")), help="params: {…}")


def _unreached_key(key: str, process: Process, span: Span) -> Finding:
    """Return a warning about a key for ROS arguments that a shell or launch file ignores."""
    advice = f"write it into the command: --ros-args {ROS_ARGUMENTS[key]}; or give run as a list"
    message = f"{key} does not reach {process.name}, whose run is a shell command"
    if process.argv[:2] == ROS2_LAUNCH:
        advice = (
            "write run: {launch: package/file.launch.py}, or an argument that the launch file"
            " takes"
        )
        message = f"{key} does not reach the nodes of {process.name}, which ros2 launch starts"
    return finding("TF107", message, span, help=advice, severity="warning")


#: The key in a process's parameters that names parameter files.
FILE_KEY = "file"


def full_name(namespace: str, name: str) -> str:
    """Return the full name of a node, topic or service.

    A name that does not begin with a slash is below the namespace.
    """
    if name.startswith("/"):
        return name
    return "/" + "/".join(part for part in (namespace.strip("/"), name) if part)


def namespace_of(declared: StartedSpec | ContainerSpec | None, namespace: str) -> str:
    """Return the namespace of a process's nodes, without a leading slash.

    By default this is ``namespace``, the robot's.
    """
    if declared is None or declared.namespace is None:
        return namespace
    return full_name(namespace, declared.namespace).strip("/")


def names_files(params: dict[str, Any]) -> bool:
    """Return whether the parameters name parameter files."""
    return isinstance(params.get(FILE_KEY), (str, list))


def _usual(declared: ProcessSpec) -> str | None:
    """Return the default name of a known node that tfcompose cannot rename, or None."""
    preset = preset_of(declared.node)
    run = _run_of(declared)
    if preset is None or not is_node_preset(preset) or (run and run.package):
        return None
    return node_preset(preset).node


def _run_of(declared: ProcessSpec) -> Run | None:
    """Return the key ``run``, completed from the preset of the process's node."""
    run, preset = declared.run, preset_of(declared.node)
    if run and run.is_startable:
        return run
    is_otherwise = declared.external or declared.simulate or declared.component
    if is_otherwise or preset is None or not is_node_preset(preset):
        return run
    preset_of_node = node_preset(preset)
    if not preset_of_node.executable:
        return run
    started = run or Run()
    return started.model_copy(
        update={
            "package": started.package or preset_of_node.package,
            "executable": started.executable or preset_of_node.executable,
        }
    )


def nodes_of(
    name: str, declared: ProcessSpec, namespace: str, spec: RobotSpec
) -> Finds[tuple[Node, ...]]:
    """Return the nodes of the process, at least one."""
    entry_path: Path = ("processes", name)
    if not declared.nodes:
        span = spec.span_of((*entry_path, "node")) if declared.node else spec.key_span(entry_path)
        own_name = name_of(declared.node) or _usual(declared)
        node = full_name(namespace, own_name or name)
        return (Node(node, span, entry_path, declared.params, declared.lifecycle),)
    if declared.publishes:
        message = f"{name} has nodes, and publishes names none of them"
        advice = "write it under one of its nodes"
        yield finding("TF107", message, spec.key_span((*entry_path, "publishes")), help=advice)
    nodes = []
    for node, node_spec in declared.nodes.items():
        path = (*entry_path, "nodes", node)
        nodes.append(
            Node(
                full_name(namespace, node),
                spec.key_span(path),
                path,
                node_spec.params,
                node_spec.lifecycle,
            )
        )
    return tuple(nodes)


#: The period of a sweep in seconds. It is longer if the joint's velocity limit requires it.
PERIOD_S = 6.0


def set_positions(draft: Draft) -> Iterator[Finding]:
    """Add a position for every independent joint to simulated joint states.

    A joint that mimics another joint is omitted, because the simulating process computes it. By
    default, a joint is at 0, or in the middle of its limits if they exclude 0, as in
    joint_state_publisher.
    """
    robot, spec = draft.robot, draft.spec
    processes = []
    for process in robot.processes:
        declared = spec.processes.get(process.name)
        joints = declared.simulate.joints if declared and declared.simulate else None
        simulation = process.simulate
        if simulation and simulation.kind == "joints" and joints is not None:
            if isinstance(joints, dict):
                yield from _wrong_positions(joints, robot, process, spec)
            processes.append(replace(process, simulate=_with_joints(simulation, joints, robot)))
        else:
            processes.append(process)
    draft.robot = replace(robot, processes=tuple(processes))


def _with_joints(simulation: Simulation, moved: str | dict[str, Any], robot: Robot) -> Simulation:
    joints = {
        edge.joint.name: edge.joint
        for edge in robot.edges
        if edge.joint and _has_position(edge.joint)
    }
    requested: dict[str, Any] = dict.fromkeys(joints)
    requested |= moved if isinstance(moved, dict) else dict.fromkeys(joints, moved)
    positions: dict[str, float] = {}
    for name, joint in joints.items():
        position = requested[name]
        is_at_rest = position is None or isinstance(position, str)
        positions[name] = _rest(joint) if is_at_rest else position
    sweeps = {name: _sweep(joint) for name, joint in joints.items() if requested[name] == SWEEP}
    return replace(
        simulation,
        joints=positions,
        sweep={name: sweep for name, sweep in sweeps.items() if sweep},
    )


def _wrong_positions(
    positions: dict[str, Any], robot: Robot, process: Process, spec: RobotSpec
) -> Iterator[Finding]:
    """Yield a finding for each joint that does not exist or cannot have the position."""
    joints = {edge.joint.name: edge.joint for edge in robot.edges if edge.joint}
    movable = [name for name, joint in joints.items() if _has_position(joint)]
    for name, what in positions.items():
        span = spec.key_span(("processes", process.name, "simulate", "joints", name))
        joint = joints.get(name)
        if joint and joint.mimic:
            advice = f"give the position of {joint.mimic}"
            yield finding(
                "TF703",
                f"{name} has no position of its own: it mimics {joint.mimic}",
                span,
                help=advice,
            )
        elif name not in movable:
            if not robot.tolerates(name):
                advice = did_you_mean(
                    name,
                    movable,
                    f"moving joints: {', '.join(movable)}" if movable else "no joint moves",
                )
                yield finding("TF703", f"no moving joint {name}", span, help=advice)
        elif joint and what == SWEEP and _sweep(joint) is None:
            advice = f"give {name} a limit: {{lower, upper}}, or give a position here"
            yield finding(
                "TF106", f"{name} slides and has no limits to sweep between", span, help=advice
            )
        elif joint and isinstance(what, float) and (limits := joint.exceeded_limits(what)):
            message = f"{name} is simulated at {joint.in_unit(what)}, outside its limits, {limits}"
            yield finding("TF737", message, span, help="correct the position, or the limits")


def _has_position(joint: Joint) -> bool:
    """Return whether the joint has a single independent position."""
    return joint.mimic is None and joint.type in MOVING


def _rest(joint: Joint) -> float:
    limit = joint.limit
    if joint.type == "continuous" or limit is None or limit.lower is None or limit.upper is None:
        return 0.0
    return 0.0 if limit.lower <= 0 <= limit.upper else (limit.lower + limit.upper) / 2


def _sweep(joint: Joint) -> Sweep | None:
    """Return the sweep between the joint's limits, within its velocity limit.

    None for a prismatic joint without limits. A missing lower or upper limit is 0, as in URDF
    readers.
    """
    limit = joint.limit
    fastest = limit.velocity if limit and limit.velocity else math.inf
    if joint.type == "continuous":
        return Sweep(max(PERIOD_S, math.tau / fastest))
    if limit is not None and (limit.lower is not None or limit.upper is not None):
        lower, upper = limit.lower or 0.0, limit.upper or 0.0
    elif joint.type == "revolute":
        lower, upper = -math.pi, math.pi
    else:
        return None
    return Sweep(max(PERIOD_S, math.pi * (upper - lower) / fastest), lower, upper)
