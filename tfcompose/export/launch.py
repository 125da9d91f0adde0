"""A Python launch file: stock nodes for what is fixed and jointed, and each process as a node of its own."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from tfcompose.export.supervisors import plain_name, started
from tfcompose.files import File
from tfcompose.numbers import number

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.export.supervisors import Machine
    from tfcompose.plan import Plan, PlanEdge, PlanProcess

_EXECUTABLE = re.compile(r"\$\{executable:([^/}]+)/([^/}]+)\}")
_NO_NODE = re.compile(r"\W")
_OWN = ("static", "joints")
_MOVED = ("-r", "--params-file")

_HEAD = '''\
"""The TF tree and the processes of {robot}, for ros2 launch."""

import sys
from pathlib import Path

from launch import LaunchDescription
from launch.actions import EmitEvent, ExecuteProcess, RegisterEventHandler, SetEnvironmentVariable, Shutdown
from launch.event_handlers import OnProcessStart
from launch.events import matches_action
from launch_ros.actions import LifecycleNode, Node
from launch_ros.event_handlers import OnStateTransition
from launch_ros.events.lifecycle import ChangeState
from launch_ros.parameter_descriptions import ParameterValue
from lifecycle_msgs.msg import Transition

BUILD = (Path(__file__).resolve().parent / {folder!r}).resolve()


def process(name, **more):
    """One of tfcompose's own, or one that only the plan knows how to start."""
    command = [sys.executable, "-m", "tfcompose.launcher.exec", str(BUILD / "plan.json"), name]
    return ExecuteProcess(cmd=command, name=name, output="screen", **more)


def change(node, transition):
    return EmitEvent(event=ChangeState(lifecycle_node_matcher=matches_action(node), transition_id=transition))


def managed(node, active):
    """The node, which is configured when it was started, and activated once it is inactive."""
    configure = change(node, Transition.TRANSITION_CONFIGURE)
    yield node
    if active:
        activate = change(node, Transition.TRANSITION_ACTIVATE)
        then = OnStateTransition(
            target_lifecycle_node=node, start_state="configuring", goal_state="inactive", entities=[activate]
        )
        yield RegisterEventHandler(then)
    yield RegisterEventHandler(OnProcessStart(target_action=node, on_start=[configure]))


def generate_launch_description():
    return LaunchDescription([
'''


def launch(plan: Plan, machine: Machine, urdf: str) -> tuple[tuple[File, ...], list[str]]:
    """Return the launch file, and what it does not keep of the plan. ``urdf`` is the text of the plan's robot.urdf.

    A stock robot_state_publisher sends what that URDF holds as fixed or jointed, and a static_transform_publisher each
    fixed edge elsewhere; where the URDF is not all of what tfcompose's own publishers send, these are started instead.
    """
    lines, gaps = [], []
    for name, value in _variables(plan):
        lines.append(f"SetEnvironmentVariable({name!r}, {value!r}),")
    stock = _stock(plan, urdf)
    if stock is not None:
        lines += [*_state_publisher(plan), *(_static_transform(plan, edge, name) for edge, name in stock)]
        gaps.append("robot_description is robot.urdf, in which edges of other owners are floating joints")
    for process in started(plan):
        if process.kind == "guard":
            gaps.append("the guard is left out: it belongs to tfcompose up")
        elif process.kind not in _OWN or stock is None:
            lines += _started(process)
        if process.after and process.kind != "guard":
            gaps.append(f"{process.name} does not wait for {', '.join(process.after)}: launch knows no readiness")
        gaps += _unlike(process)
    head = _HEAD.replace("{robot}", plan.robot).replace("{folder!r}", repr(machine.folder))
    text = head + "".join(f"        {line}\n" for line in lines) + "    ])\n"
    return (File(f"{plain_name(plan.robot)}.launch.py", text),), gaps


def _unlike(process: PlanProcess) -> Iterator[str]:
    """Yield what launch does otherwise with a process."""
    if process.kind == "run" and process.lifecycle and not _is_node(process):
        yield f"{', '.join(process.lifecycle)} of {process.name} is not brought into its lifecycle state"
    if process.kind == "run" and process.restart != "no":
        whatever = "whatever its exit code, and " if process.restart == "on-failure" else ""
        yield f"{process.name} is started again {whatever}without a limit"
    if process.stop.signal != "SIGINT":
        yield f"{process.name} is ended by SIGINT, and not by {process.stop.signal}"


def _variables(plan: Plan) -> Iterator[tuple[str, str]]:
    if plan.ros.domain_id is not None:
        yield "ROS_DOMAIN_ID", str(plan.ros.domain_id)
    if plan.ros.discovery is not None:
        yield "ROS_AUTOMATIC_DISCOVERY_RANGE", plan.ros.discovery.upper()


def published_by(urdf: str, prefix: str) -> set[tuple[str, str]]:
    """Return the edges (parent, child) that a stock robot_state_publisher sends of this URDF: all but floating ones."""
    joints = [joint for joint in ET.fromstring(urdf).iter("joint") if joint.get("type") not in (None, "floating")]  # noqa: S314 (our own)
    return {
        (prefix + parent.get("link", ""), prefix + child.get("link", ""))
        for joint in joints
        if (parent := joint.find("parent")) is not None and (child := joint.find("child")) is not None
    }


def _stock(plan: Plan, urdf: str) -> list[tuple[PlanEdge, str]] | None:
    """Return the fixed edges outside the URDF, each with a node's name; None where own publishers must send all."""
    own = {process.name for process in started(plan) if process.kind in _OWN}
    if not own or len(own) > len(_OWN) or any(plan.process(name).description for name in own):
        return None
    if any(_package(process) == "robot_state_publisher" for process in plan.processes):
        return None
    edges = {(edge.parent, edge.child): edge for edge in plan.edges if edge.owner in own}
    of_urdf = published_by(urdf, plan.ros.frame_prefix)
    rest = [edge for ends, edge in edges.items() if ends not in of_urdf]
    if not of_urdf or of_urdf - set(edges) or any(edge.kind != "static" for edge in rest):
        return None
    names: dict[str, PlanEdge] = {}
    for edge in rest:
        name = f"static_{_NO_NODE.sub('_', edge.child)}"
        while name in names:
            name += "_"
        names[name] = edge
    return [(edge, name) for name, edge in names.items()]


def _package(process: PlanProcess) -> str:
    meant = _EXECUTABLE.fullmatch(process.argv[0]) if process.argv else None
    return meant[1] if meant else ""


def _keywords(plan: Plan) -> str:
    """Return the keywords of stock nodes: namespace, and the publishers' remappings."""
    remap = {old: new for one in started(plan) if one.kind in _OWN for old, new in one.remap.items()}
    return f"namespace={plan.ros.namespace!r}, remappings={list(remap.items())!r}, output='screen'"


def _state_publisher(plan: Plan) -> list[str]:
    prefix = {"frame_prefix": plan.ros.frame_prefix} if plan.ros.frame_prefix else {}
    values = prefix | {"use_sim_time": plan.ros.clock == "sim"}
    description = 'ParameterValue((BUILD / "robot.urdf").read_text(encoding="utf-8"), value_type=str)'
    parameters = f'[{{"robot_description": {description}}}, {values!r}]'
    package = 'package="robot_state_publisher", executable="robot_state_publisher", name="robot_state_publisher"'
    return [f"Node({package}, {_keywords(plan)}, parameters={parameters}),"]


def _static_transform(plan: Plan, edge: PlanEdge, name: str) -> str:
    pose = edge.pose
    named = zip(("--x", "--y", "--z", "--qx", "--qy", "--qz", "--qw"), (*pose.xyz, *pose.quat_xyzw), strict=True)
    words = [word for key, value in named for word in (key, number(value))]
    words += ["--frame-id", edge.parent, "--child-frame-id", edge.child]
    package = 'package="tf2_ros", executable="static_transform_publisher"'
    return f"Node({package}, name={name!r}, {_keywords(plan)}, arguments={words!r}),"


def _started(process: PlanProcess) -> list[str]:
    again = "" if process.restart == "no" else ", respawn=True, respawn_delay=1.0"
    ends = ", on_exit=Shutdown()" if process.required else ""
    package = _EXECUTABLE.fullmatch(process.argv[0]) if process.argv else None
    if package is None or not _is_node(process):
        return [f"process({process.name!r}{again}{ends}),"]
    own, ros_words = _rest(process)
    namespace, _, node = process.nodes[0].rpartition("/")
    arguments, ros_arguments = ([_filled(word) for word in words] for words in (own, ros_words))
    keywords = [
        f"package={package[1]!r}, executable={package[2]!r}, name={node!r}, namespace={namespace or '/'!r}",
        f"remappings={list(process.remap.items())!r}",
        f"arguments=[{', '.join(arguments)}]",
        *([f"ros_arguments=[{', '.join(ros_arguments)}]"] if ros_arguments else []),
        *([f"parameters=[str(BUILD / {process.params_file!r})]"] if process.params_file else []),
        *([f"additional_env={{{_environment(process)}}}"] if process.env else []),
        "output='screen'",
    ]
    made = f"({', '.join(keywords)}{again}{ends})"
    state = process.lifecycle.get(process.nodes[0])
    return [f"*managed(LifecycleNode{made}, active={state == 'active'}),"] if state else [f"Node{made},"]


def _is_node(process: PlanProcess) -> bool:
    """Return whether launch can start the process as one node, and not only as a process."""
    names_file = any("${params_file}" in word for word in (*process.env.values(), *_rest(process)[0]))
    return bool(_package(process)) and len(process.nodes) == 1 and process.cwd is None and not names_file


def _rest(process: PlanProcess) -> tuple[list[str], list[str]]:
    """Return the program's arguments and ROS's; names, remappings and parameter files are keywords of their own."""
    words = list(process.argv[1:])
    at = words.index("--ros-args") if "--ros-args" in words else len(words)
    kept, rest = [], iter(words[at + 1 :])
    for word in rest:
        if word in _MOVED:
            next(rest, None)
        else:
            kept.append(word)
    return words[:at], kept


def _environment(process: PlanProcess) -> str:
    return ", ".join(f"{name!r}: {_filled(value)}" for name, value in process.env.items())


def _filled(word: str) -> str:
    """Return the word as Python that knows the plan's folder."""
    if "${build_dir}" not in word:
        return repr(word)
    return f"{word!r}.replace('${{build_dir}}', str(BUILD))"
