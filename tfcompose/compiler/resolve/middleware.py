"""The robot's middleware: adds Zenoh's router to the processes, and reports conflicts."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.compiler.resolve.hosts import entry_of
from tfcompose.compiler.resolve.processes import add_process, says_how
from tfcompose.foundation.findings import Finding, Note, finding
from tfcompose.model.plan import Ready
from tfcompose.model.plan.middleware import (
    IMPLEMENTATIONS,
    ROUTER,
    ROUTER_LISTENS,
    ROUTER_PROGRAM,
    router_variables,
)
from tfcompose.model.robot import GUARD, STATIC, Process

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.resolve.draft import Draft
    from tfcompose.model.robot import Robot
    from tfcompose.spec.language.process import ProcessSpec
    from tfcompose.spec.language.robot import RobotSpec

_RMW = "RMW_IMPLEMENTATION"
#: The log line of a ready router. The router flushes it only if it writes to a terminal.
_READY = Ready("log", ROUTER_LISTENS)
#: The router's package and executable.
_PROGRAM = ("rmw_zenoh_cpp", "rmw_zenohd")


def is_own_router(name: str, declared: ProcessSpec | None, spec: RobotSpec) -> bool:
    """Return whether ``name`` is the Zenoh router that tfcompose adds.

    A robot file may have an entry with this name that sets keys such as ``host``, but not a
    program.
    """
    return spec.ros.rmw == "zenoh" and name == ROUTER and not says_how(declared)


def own_router(spec: RobotSpec) -> list[Process]:
    """Return the process of the Zenoh router, unless the robot has a router or needs none."""
    declared = spec.processes.get(ROUTER)
    runs_it = any(
        process.run and (process.run.package, process.run.executable) == _PROGRAM
        for process in spec.processes.values()
    )
    if not is_own_router(ROUTER, declared, spec) or (runs_it and not declared):
        return []
    path = ("processes", ROUTER) if declared else ("ros", "rmw")
    process = Process(
        ROUTER,
        "run",
        span=spec.key_span(path),
        argv=(ROUTER_PROGRAM,),
        restart="on-failure",
        emulate_tty=True,
    )
    process = add_process(process, declared, spec)
    return [replace(process, ready=process.ready or _READY)]


def _with_router(robot: Robot) -> Robot:
    """Return the robot with processes that start only after the Zenoh router listens.

    If the router's listening address is not the default, its environment sets the address.
    """
    routers = _routers(robot)
    if robot.ros.rmw != "zenoh" or not routers:
        return robot
    router, processes = routers[0], []
    for process in robot.processes:
        if process.name == router.name and process.kind == "run":
            env = router_variables(robot.ros) | process.env
            if process.ready is None:
                process = replace(process, ready=_READY, emulate_tty=True)  # noqa: PLW2901
            processes.append(replace(process, env=env))
        elif (
            process.kind == "external"
            or process.name in router.after
            or process.name == router.name
        ):
            processes.append(process)
        else:
            processes.append(replace(process, after={router.name: "ready", **process.after}))
    return replace(robot, processes=tuple(processes))


def _routers(robot: Robot) -> list[Process]:
    return [
        process
        for process in robot.processes
        if process.name == ROUTER or (process.package, process.executable) == _PROGRAM
    ]


def use_middleware(draft: Draft) -> Iterator[Finding]:
    """Make processes wait for the Zenoh router.

    A part is skipped, because its parent does this.
    """
    if draft.holder is None:
        yield from _faults(draft.robot, draft.spec)
        draft.robot = _with_router(draft.robot)


def _faults(robot: Robot, spec: RobotSpec) -> Iterator[Finding]:
    """Yield findings about unsupported settings and conflicts, and about unreachable routers."""
    ros = robot.ros
    if spec.ros.router and ros.rmw != "zenoh":
        advice = "ros: {rmw: zenoh}, or remove router"
        yield finding(
            "TF107",
            "router goes with rmw: zenoh",
            spec.key_span(("ros", "router")),
            help=advice,
        )
    if ros.rmw is None:
        return
    yield from _unsupported_settings(robot, spec)
    yield from _disagreeing(robot, spec)
    if ros.rmw == "zenoh":
        yield from _wrong_routers(robot, spec)


def _unsupported_settings(robot: Robot, spec: RobotSpec) -> Iterator[Finding]:
    ros, span = robot.ros, spec.span_of(("ros", "rmw"))
    if ros.rmw == "fastdds":
        return
    if robot.guard.mode == "strict" and robot.guard.fence == "partition":
        message = (
            f"guard: {{fence: partition}} needs Fast DDS, and rmw: {ros.rmw} has no partitions"
        )
        place = spec.span_of(("guard", "fence")) if spec.spans.has(("guard", "fence")) else span
        yield finding(
            "TF870", message, place, help="remove fence: the strict guard then uses remapping"
        )
    if ros.rmw == "zenoh" and ros.discovery == "off":
        message = "rmw: zenoh has no discovery: off: every node that reaches the router is found"
        advice = "discovery: localhost, so that the router accepts only its own computer"
        yield finding("TF870", message, spec.span_of(("ros", "discovery")), help=advice)


def _disagreeing(robot: Robot, spec: RobotSpec) -> Iterator[Finding]:
    """Yield a finding for each process whose environment sets another middleware.

    Such a process cannot discover the other processes.
    """
    implementation = IMPLEMENTATIONS[robot.ros.rmw] if robot.ros.rmw else ""
    for process in robot.processes:
        rmw = process.env.get(_RMW)
        if rmw is None or rmw == implementation:
            continue
        path = (*entry_of(process, spec), "env", _RMW)
        span = spec.spans.exact_span(path) or process.span
        message = f"{process.name} gets {_RMW}={rmw}, but the robot has rmw: {robot.ros.rmw}"
        notes = [Note("set here", spec.span_of(("ros", "rmw")))]
        advice = (
            f"remove {_RMW} from its env: {process.name} cannot find the other processes with it"
        )
        yield finding("TF871", message, span, notes=notes, help=advice)


def _wrong_routers(robot: Robot, spec: RobotSpec) -> Iterator[Finding]:
    routers = _routers(robot)
    for more in routers[1:]:
        notes = [Note(f"{routers[0].name} is defined here", routers[0].span)]
        message = f"{more.name} is a second Zenoh router, in addition to {routers[0].name}"
        yield finding(
            "TF872",
            message,
            more.span,
            notes=notes,
            help="remove one: all processes share one router",
        )
    if not routers or robot.ros.router:
        return
    router = routers[0]
    static = next((process.host for process in robot.processes if process.name == STATIC), None)
    home = router.host or static
    hosts = dict.fromkeys(
        process.host or static
        for process in robot.processes
        if process.kind != "external" and process.name != GUARD
    )
    away = [host for host in hosts if host != home]
    if away and router.kind != "external":
        names = ", ".join(host or "the computer that the file does not name" for host in away)
        declared = robot.hosts.get(home or "")
        address = declared.ssh.rpartition("@")[2] if declared else "ADDRESS"
        message = (
            f"processes on {names} cannot reach {router.name}, which runs on"
            f" {home or 'another computer'}"
        )
        advice = f"ros: {{router: tcp/{address}:7447}}, the address of {home or 'that computer'}"
        yield finding("TF873", message, spec.span_of(("ros", "rmw")), help=advice)
