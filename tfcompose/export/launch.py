"""A Python launch file: stock nodes for what is fixed and jointed, and each process as a node of its own."""

from __future__ import annotations

import graphlib
import json
import re
import shlex
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

from tfcompose.export.supervisors import plain_name, waiting_s
from tfcompose.files import File
from tfcompose.numbers import number
from tfcompose.plan.stock import MOST_HZ, OWN_KINDS, STATE_PUBLISHER, static_names

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from tfcompose.export.supervisors import Machine
    from tfcompose.plan import Plan, PlanEdge, PlanProcess

_EXECUTABLE = re.compile(r"\$\{executable:([^/}]+)/([^/}]+)\}")
_LAUNCH = re.compile(r"\$\{launch:([^/}]+)/([^}]+)\}")
_MOVED = ("-r", "--params-file")
#: No line is longer, unless a single word is.
_WIDTH = 100

_HEAD = '''\
"""The TF tree and the processes of {robot}, for ros2 launch."""

import sys
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import (
    EmitEvent,
    ExecuteProcess,
    GroupAction,
    IncludeLaunchDescription,
    RegisterEventHandler,
    SetEnvironmentVariable,
    Shutdown,
    TimerAction,
)
from launch.event_handlers import OnProcessStart
from launch.events import matches_action
from launch.launch_description_sources import AnyLaunchDescriptionSource
from launch_ros.actions import LifecycleNode, Node, PushRosNamespace, SetParameter, SetRemap
from launch_ros.event_handlers import OnStateTransition
from launch_ros.events.lifecycle import ChangeState
from launch_ros.parameter_descriptions import ParameterValue
from lifecycle_msgs.msg import Transition

BUILD = (Path(__file__).resolve().parent / {folder!r}).resolve()


def process(name, **more):
    """One of tfcompose's own, or one that only the plan knows how to start."""
    command = [sys.executable, "-m", "tfcompose.launcher.exec", str(BUILD / "plan.json"), name]
    return ExecuteProcess(cmd=command, name=name, output="screen", **more)


def description():
    """What robot_state_publisher is given."""
    return ParameterValue((BUILD / "robot.urdf").read_text(encoding="utf-8"), value_type=str)


def fixed(name, parent, child, xyz, quat_xyzw, **more):
    """A fixed edge that is not in the URDF."""
    keys = ("--x", "--y", "--z", "--qx", "--qy", "--qz", "--qw")
    pose = [word for key, value in zip(keys, (*xyz, *quat_xyzw)) for word in (key, str(value))]
    ends = ["--frame-id", parent, "--child-frame-id", child]
    program = {"package": "tf2_ros", "executable": "static_transform_publisher"}
    return Node(**program, name=name, arguments=pose + ends, output="screen", **more)


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


def included(package, name, arguments, settings):
    """A package's launch file, in its share folder or anywhere below, in a group with what holds for all its nodes."""
    share = Path(get_package_share_directory(package))
    direct = [file for file in (share / name, share / "launch" / name) if file.is_file()]
    file = (direct or sorted(share.rglob(name)) or [share / name])[0]
    source = AnyLaunchDescriptionSource(str(file))
    return GroupAction([*settings, IncludeLaunchDescription(source, launch_arguments=arguments)])


def generate_launch_description():
    return LaunchDescription([
'''


@dataclass(frozen=True, slots=True)
class _Code:
    """An expression in brackets: what is before its parts, the parts, and what is behind them."""

    begin: str
    parts: tuple[_Code | str, ...]
    end: str

    def __str__(self) -> str:
        return f"{self.begin}{', '.join(map(str, self.parts))}{self.end}"

    def lines(self, indent: str = "") -> Iterator[str]:
        """Yield it in lines, in one if that is short enough; each part on a line of its own otherwise."""
        if len(indent) + len(str(self)) <= _WIDTH:
            yield f"{indent}{self}"
            return
        yield f"{indent}{self.begin}"
        for part in self.parts:
            *most, last = [f"{indent}    {part}"] if isinstance(part, str) else part.lines(f"{indent}    ")
            yield from (*most, f"{last},")
        yield f"{indent}{self.end}"


def _call(name: str, *parts: _Code | str) -> _Code:
    return _Code(f"{name}(", parts, ")")


def _list(items: Iterable[_Code | str], keyword: str = "") -> _Code:
    return _Code(f"{keyword}=[" if keyword else "[", tuple(items), "]")


def launch(plan: Plan, machine: Machine, urdf: str) -> tuple[tuple[File, ...], list[str]]:
    """Return the launch file, and what it does not keep of the plan. ``urdf`` is the text of the plan's robot.urdf.

    A stock robot_state_publisher sends what that URDF holds as fixed or jointed, and a static_transform_publisher each
    fixed edge elsewhere; where the URDF is not all of what tfcompose's own publishers send, these are started instead.
    """
    actions: list[_Code] = [
        _call("SetEnvironmentVariable", repr(name), repr(value)) for name, value in _variables(plan)
    ]
    gaps = []
    delays_s = _delays_s(plan)
    known = {process.name: process for process in plan.processes}
    stock = _stock(plan, urdf)
    if stock is not None:
        names = static_names(plan)
        actions += [_state_publisher(plan), *(_fixed(plan, edge, names[edge.child]) for edge in stock)]
        gaps.append("robot_description is robot.urdf, in which edges of other owners are floating joints")
    for process in plan.started:
        if process.kind == "guard":
            gaps.append("the guard is left out: it belongs to tfcompose up")
        elif process.kind not in OWN_KINDS or stock is None:
            delay_s = delays_s[process.name]
            action = _started(plan, process)
            delayed = _call("TimerAction", f"period={delay_s!r}", _list([action], "actions"))
            actions.append(delayed if delay_s else action)
        unheeded = [name for name, what in process.after.items() if not waiting_s(known[name], what)]
        if unheeded and process.kind != "guard":
            gaps.append(f"{process.name} does not wait for {', '.join(unheeded)}: launch knows no readiness")
        gaps += _unlike(process)
    gaps += [f"{process.name} is a component, and left out: tfcompose up loads it" for process in plan.components]
    head = _HEAD.replace("{robot}", plan.robot).replace("{folder!r}", repr(machine.folder))
    text = head + "".join(f"{line}\n" for action in actions for line in _element(action)) + "    ])\n"
    return (File(f"{plain_name(plan.robot)}.launch.py", text),), gaps


def _element(action: _Code) -> Iterator[str]:
    """Yield the action in lines, as an element of the list of all."""
    *most, last = action.lines(" " * 8)
    yield from (*most, f"{last},")


def _delays_s(plan: Plan) -> dict[str, float]:
    """Return how long after the launch each is started: when all for which it waits so many seconds have had them."""
    known = {process.name: process for process in plan.processes}
    delays: dict[str, float] = {}
    for name in graphlib.TopologicalSorter({name: process.after for name, process in known.items()}).static_order():
        waits = (delays[other] + waiting_s(known[other], what) for other, what in known[name].after.items())
        delays[name] = max(waits, default=0.0)
    return delays


def _unlike(process: PlanProcess) -> Iterator[str]:
    """Yield what launch does otherwise with a process."""
    if process.kind == "run" and process.lifecycle and not _is_node(process):
        yield f"{', '.join(process.lifecycle)} of {process.name} is not brought into its lifecycle state"
    if _is_launch(process):
        if process.restart != "no":
            yield f"{process.name} is not started again: it is a launch file"
        if process.required:
            yield f"{process.name} is required: its end does not end the others here"
        return
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


def _stock(plan: Plan, urdf: str) -> list[PlanEdge] | None:
    """Return the fixed edges outside the URDF; None where own publishers must send all."""
    own = {process.name for process in plan.started if process.kind in OWN_KINDS}
    if not own or len(own) > len(OWN_KINDS) or any(plan.process(name).description for name in own):
        return None
    if any(_package(process) == STATE_PUBLISHER for process in plan.processes):
        return None
    edges = {(edge.parent, edge.child): edge for edge in plan.edges if edge.owner in own}
    of_urdf = published_by(urdf, plan.ros.frame_prefix)
    rest = [edge for ends, edge in edges.items() if ends not in of_urdf]
    if not of_urdf or of_urdf - set(edges) or any(edge.kind != "static" for edge in rest):
        return None
    return rest


def _package(process: PlanProcess) -> str:
    meant = _EXECUTABLE.fullmatch(process.argv[0]) if process.argv else None
    return meant[1] if meant else ""


def _keywords(plan: Plan) -> tuple[str, _Code]:
    """Return the keywords of stock nodes: namespace, and the publishers' remappings."""
    remap = {old: new for one in plan.started if one.kind in OWN_KINDS for old, new in one.remap.items()}
    return f"namespace={plan.ros.namespace!r}", _list(map(repr, remap.items()), "remappings")


def _state_publisher(plan: Plan) -> _Code:
    """Return robot_state_publisher, which passes on as many joint states as the plan's publisher does."""
    joints = next((process for process in plan.started if process.kind == "joints"), None)
    given = _params(joints.argv) if joints else {}
    values = {"publish_frequency": min(given.pop("publish_frequency", MOST_HZ), MOST_HZ), **given}
    values["use_sim_time"] = plan.ros.clock == "sim"
    if plan.ros.frame_prefix:
        values["frame_prefix"] = plan.ros.frame_prefix
    params = _Code("{", ('"robot_description": description()', *(f"{k!r}: {v!r}" for k, v in values.items())), "}")
    named = (f"package={STATE_PUBLISHER!r}", f"executable={STATE_PUBLISHER!r}", f"name={STATE_PUBLISHER!r}")
    return _call("Node", *named, *_keywords(plan), _list([params], "parameters"), "output='screen'")


def _params(argv: tuple[str, ...]) -> dict[str, Any]:
    """Return the parameters that one of tfcompose's own processes is given in its command."""
    words = [word for before, word in pairwise(argv) if before == "-p"]
    return {name: json.loads(value) for name, _, value in (word.partition(":=") for word in words)}


def _fixed(plan: Plan, edge: PlanEdge, name: str) -> _Code:
    ends = (repr(name), repr(edge.parent), repr(edge.child))
    numbers = (_Code("(", tuple(map(number, part)), ")") for part in (edge.pose.xyz, edge.pose.quat_xyzw))
    return _call("fixed", *ends, *numbers, *_keywords(plan))


def _started(plan: Plan, process: PlanProcess) -> _Code:
    if _is_launch(process):
        return _included(plan, process)
    delay = 1.0 if process.restart_delay is None else process.restart_delay
    again = () if process.restart == "no" else ("respawn=True", f"respawn_delay={delay}")
    ends = ("on_exit=Shutdown()",) if process.required else ()
    package = _EXECUTABLE.fullmatch(process.argv[0]) if process.argv else None
    if package is None or not _is_node(process) or process.schedule:
        return _call("process", repr(process.name), *again, *ends)
    own, ros_words = _rest(process)
    namespace, _, node = process.nodes[0].rpartition("/")
    parts: list[_Code | str] = [
        f"package={package[1]!r}", f"executable={package[2]!r}", f"name={node!r}", f"namespace={namespace or '/'!r}",
        _list(map(repr, process.remap.items()), "remappings"),
        _list(map(_filled, own), "arguments"),
        *([_list(map(_filled, ros_words), "ros_arguments")] if ros_words else []),
        *([f"parameters=[str(BUILD / {process.params_file!r})]"] if process.params_file else []),
        *([_Code("additional_env={", _environment(process), "}")] if process.env else []),
        *([f"prefix={shlex.join(process.prefix)!r}"] if process.prefix else []),
        "output='screen'", *again, *ends,
    ]  # fmt: skip
    state = process.lifecycle.get(process.nodes[0])
    if not state:
        return _call("Node", *parts)
    return _call("*managed", _call("LifecycleNode", *parts), f"active={state == 'active'}")


def _is_launch(process: PlanProcess) -> bool:
    return bool(process.argv) and _LAUNCH.fullmatch(process.argv[0]) is not None


def _included(plan: Plan, process: PlanProcess) -> _Code:
    """Return the launch file with its arguments, and what ``up`` sets for all of its nodes."""
    meant = _LAUNCH.fullmatch(process.argv[0])
    package, file = (meant[1], meant[2]) if meant else ("", "")
    arguments = [word.split(":=", 1) for word in process.argv[1:]]
    namespace = plan.ros.namespace if process.namespace is None else process.namespace
    settings = [
        *(_call("SetEnvironmentVariable", repr(name), _filled(value)) for name, value in process.env.items()),
        *([_call("PushRosNamespace", repr(namespace))] if namespace else []),
        *(_call("SetRemap", repr(old), repr(new)) for old, new in process.remap.items()),
        *([_call("SetParameter", "'use_sim_time'", "True")] if plan.ros.clock == "sim" else []),
    ]
    given = _list(f"({name!r}, {_filled(value)})" for name, value in arguments)
    return _call("included", repr(package), repr(file), given, _list(settings))


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


def _environment(process: PlanProcess) -> tuple[str, ...]:
    return tuple(f"{name!r}: {_filled(value)}" for name, value in process.env.items())


def _filled(word: str) -> str:
    """Return the word as Python that knows the plan's folder."""
    if "${build_dir}" not in word:
        return repr(word)
    return f"{word!r}.replace('${{build_dir}}', str(BUILD))"
