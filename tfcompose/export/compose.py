"""A compose file for containers: one service for each process of a plan, all on the host's network."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.emit.argv import mapping
from tfcompose.export.supervisors import (
    MAX_RESTARTS,
    STOP_S,
    after,
    command_of,
    gaps_of,
    plain_name,
    plain_names,
    restart_of,
    started,
)
from tfcompose.files import File

if TYPE_CHECKING:
    from tfcompose.export.supervisors import Machine
    from tfcompose.plan import Plan, PlanProcess

#: Where the plan's folder is inside a container.
INSIDE = "/robot"
IMAGE = "${TFCOMPOSE_IMAGE:?set it to an image with ROS 2 Jazzy and tfcompose}"
#: A health check does not come through the image's entry point, which sources the setup file for the process itself.
_SOURCED = 'setup=/opt/ros/${ROS_DISTRO:-jazzy}/setup.sh; [ ! -f "$setup" ] || . "$setup"; exec "$@"'
_MET = {"started": "service_started", "ready": "service_healthy", "done": "service_completed_successfully"}


def compose(plan: Plan, machine: Machine) -> tuple[tuple[File, ...], list[str]]:
    """Return the compose file, and what it does not keep of the plan.

    A process that owns edges is healthy while the first of them is live; ``after: ready`` waits for that.
    """
    names = plain_names(plan)
    services = {names[process.name]: _service(plan, process, machine) for process in started(plan)}
    lines = [f"name: {plain_name(plan.robot)}", "services:", *mapping(services, "  ")]
    gaps = gaps_of(plan)
    for process in started(plan):
        for name, what in process.after.items():
            if what == "ready" and plan.process(name).kind != "external" and not plan.edges_of(name):
                gaps.append(f"{process.name} waits until {name} was started: compose cannot see that it is ready")
        named = (*process.argv, *process.env.values(), process.cwd or "")
        outside = [word for word in named if "${build_dir}/.." in word]
        gaps += [f"{process.name} needs {word}, which is outside of {INSIDE}: add a volume" for word in outside]
    return (File("compose.yaml", "\n".join([*lines, ""])),), gaps


def _service(plan: Plan, process: PlanProcess, machine: Machine) -> dict[str, Any]:
    edges = plan.edges_of(process.name)
    waits = after(plan, process)
    stop_s = STOP_S if process.stop.timeout_s is None else process.stop.timeout_s
    domain = "${ROS_DOMAIN_ID:-0}" if plan.ros.domain_id is None else str(plan.ros.domain_id)
    service: dict[str, Any] = {
        "image": machine.image or IMAGE,
        "network_mode": "host",
        "ipc": "host",
        "init": True,
        "command": [_kept(word) for word in command_of(process, "python3", f"{INSIDE}/plan.json")],
        "environment": {"ROS_DOMAIN_ID": domain, **_discovery(plan)},
        "volumes": [{"type": "bind", "source": machine.folder, "target": INSIDE, "read_only": True}],
        "working_dir": INSIDE,
        "restart": _restart(process),
        "stop_signal": process.stop.signal,
        "stop_grace_period": f"{round(stop_s * 1000)}ms",
    }
    if waits:
        names = plain_names(plan)
        service["depends_on"] = {
            names[name]: {"condition": _MET[what if what != "ready" or plan.edges_of(name) else "started"]}
            for name, what in waits.items()
        }
    if edges:
        words = ["python3", "-m", "tfcompose", "echo", edges[0].parent, edges[0].child, "--once", "--timeout", "5"]
        words += _namespace(process)
        test = ["CMD", *(_kept(word) for word in ("sh", "-c", _SOURCED, "sh", *words))]
        service["healthcheck"] = {"test": test, "interval": "10s", "timeout": "8s", "start_period": "30s", "retries": 3}
    return service


def _discovery(plan: Plan) -> dict[str, str]:
    """Return what the health check needs; the process itself has it from the plan."""
    return {"ROS_AUTOMATIC_DISCOVERY_RANGE": plan.ros.discovery.upper()} if plan.ros.discovery else {}


def _namespace(process: PlanProcess) -> list[str]:
    """Return what tells the health check where a robot's own topics are."""
    namespace = process.topics[0].removesuffix("/tf")
    return ["--namespace", namespace] if namespace else []


def _restart(process: PlanProcess) -> str:
    restart = restart_of(process)
    most = MAX_RESTARTS if process.max_restarts is None else process.max_restarts
    return f"on-failure:{most}" if restart == "on-failure" and most else "no" if restart == "on-failure" else restart


def _kept(text: str) -> str:
    """Return the text as compose reads it back: it fills in variables itself."""
    return text.replace("$", "$$")
