"""A Python launch file: stock nodes for fixed edges and joints, a node per process."""

from __future__ import annotations

import graphlib
import io
import json
import math
import re
import tokenize
from itertools import pairwise
from keyword import iskeyword
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

from tfcompose.foundation.numbers import number
from tfcompose.launcher.program import ANYWHERE_PARTS
from tfcompose.model.files import File
from tfcompose.model.plan import STOCK_DESCRIPTION
from tfcompose.model.plan.components import ros_value
from tfcompose.model.plan.middleware import middleware_variables
from tfcompose.model.plan.stock import MOST_HZ, OWN_KINDS, STATE_PUBLISHER, static_names
from tfcompose.model.process_keys import EXTRA_ARGUMENTS, PROCESS_KEYS, PythonCode
from tfcompose.tools.exporters.code import CodeBlock, call, items, keyword
from tfcompose.tools.exporters.launch_values import (
    LaunchValues,
    condition_code,
    parameter_code,
    text_code,
)
from tfcompose.tools.exporters.supervisors import plain_name, waiting_s

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping

    from tfcompose.model.plan import Plan, PlanEdge, PlanProcess
    from tfcompose.tools.exporters.launch_values import Text
    from tfcompose.tools.exporters.supervisors import Machine

_EXECUTABLE = re.compile(r"\$\{executable:([^/}]+)/([^/}]+)\}")
_LAUNCH = re.compile(r"\$\{launch:([^/}]+)/([^}]+)\}")
_PLACEHOLDER = re.compile(r"\$\{(?:executable:|launch:|plan\}|tfcompose\})")
_MOVED = ("-r", "--params-file")
#: What the launch file needs of which module.
_IMPORTS = {
    "launch.actions": (
        "DeclareLaunchArgument",
        "EmitEvent",
        "ExecuteProcess",
        "GroupAction",
        "IncludeLaunchDescription",
        "OpaqueFunction",
        "RegisterEventHandler",
        "SetEnvironmentVariable",
        "Shutdown",
        "TimerAction",
    ),
    "launch.conditions": ("IfCondition", "UnlessCondition"),
    "launch.event_handlers": ("OnProcessExit", "OnProcessStart"),
    "launch.events": ("matches_action",),
    "launch.launch_description_sources": ("AnyLaunchDescriptionSource",),
    "launch.substitutions": (
        "AndSubstitution",
        "EnvironmentVariable",
        "EqualsSubstitution",
        "LaunchConfiguration",
        "NotEqualsSubstitution",
        "NotSubstitution",
        "OrSubstitution",
        "PythonExpression",
    ),
    "launch_ros.actions": (
        "ComposableNodeContainer",
        "LifecycleNode",
        "LoadComposableNodes",
        "Node",
        "PushRosNamespace",
        "SetParameter",
        "SetRemap",
    ),
    "launch_ros.descriptions": ("ComposableNode",),
    "launch_ros.event_handlers": ("OnStateTransition",),
    "launch_ros.events.lifecycle": ("ChangeState",),
    "launch_ros.parameter_descriptions": ("ParameterValue",),
    "lifecycle_msgs.msg": ("Transition",),
}
#: Functions that a launch file has where it calls them.
_HELPERS = {
    "process": (
        f'''
def process(name, **more):
    """One of tfcompose's own, or one that only the plan knows how to start."""
    start = (
        "{ANYWHERE_PARTS[0]}"
        "{ANYWHERE_PARTS[1]}"
    )
    command = [sys.executable, "-c", start, "exec", str(BUILD / "plan.json"), name]
    return ExecuteProcess(cmd=command, name=name, output="screen", **more)
'''
    ),
    "description": (
        f'''
def description():
    """What robot_state_publisher is given."""
    urdf = (BUILD / "{STOCK_DESCRIPTION}").read_text(encoding="utf-8")
    return ParameterValue(urdf, value_type=str)
'''
    ),
    "fixed": (
        '''
def fixed(name, parent, child, xyz, quat_xyzw, **more):
    """A fixed edge that is not in the URDF."""
    keys = ("--x", "--y", "--z", "--qx", "--qy", "--qz", "--qw")
    pose = [word for key, value in zip(keys, (*xyz, *quat_xyzw)) for word in (key, str(value))]
    ends = ["--frame-id", parent, "--child-frame-id", child]
    program = {"package": "tf2_ros", "executable": "static_transform_publisher"}
    return Node(**program, name=name, arguments=pose + ends, output="screen", **more)
'''
    ),
    "managed": (
        '''
def change(node, transition):
    matcher = matches_action(node)
    return EmitEvent(event=ChangeState(lifecycle_node_matcher=matcher, transition_id=transition))


def managed(node, active):
    """The node, which is configured when it was started, and activated once it is inactive."""
    configure = change(node, Transition.TRANSITION_CONFIGURE)
    yield node
    if active:
        activate = change(node, Transition.TRANSITION_ACTIVATE)
        then = OnStateTransition(
            target_lifecycle_node=node,
            start_state="configuring",
            goal_state="inactive",
            entities=[activate],
        )
        yield RegisterEventHandler(then)
    yield RegisterEventHandler(OnProcessStart(target_action=node, on_start=[configure]))
'''
    ),
    "included": (
        '''
def included(package, name, arguments, settings, **more):
    """A package's launch file, anywhere in its share folder, grouped with its settings."""

    def found(context):
        share = Path(get_package_share_directory(package))
        direct = [file for file in (share / name, share / "launch" / name) if file.is_file()]
        file = (direct or sorted(share.rglob(name)) or [share / name])[0]
        source = AnyLaunchDescriptionSource(str(file))
        return [IncludeLaunchDescription(source, launch_arguments=arguments)]

    return GroupAction([*settings, OpaqueFunction(function=found)], **more)
'''
    ),
}


def launch(
    plan: Plan, machine: Machine, urdf: str, values: LaunchValues | None = None
) -> tuple[tuple[File, ...], list[str]]:
    """Return the launch file, and the properties of the plan that it loses.

    ``urdf`` is the text of ``STOCK_DESCRIPTION``, next to the plan. A stock robot_state_publisher
    sends the fixed edges and joints of that URDF, and a static_transform_publisher each other
    fixed edge. If the URDF lacks some edges of tfcompose's own publishers, these are started
    instead. ``values`` are decided by the launch file at its start.
    """
    export = _Export(plan, values or LaunchValues())
    stock = _stock(plan, urdf)
    actions = list(export.actions(stock))
    text = _text(plan, machine, actions, export.named)
    return (File(f"{plain_name(plan.robot)}.launch.py", text),), export.gaps


def _text(
    plan: Plan, machine: Machine, actions: list[CodeBlock], named: Mapping[str, CodeBlock]
) -> str:
    """Return the launch file: what it imports, the functions that it calls, and its actions.

    ``named`` are actions that others refer to, by their variables' names.
    """
    body = "".join(f"{line}\n" for name, action in named.items() for line in _assign(name, action))
    body += "    return LaunchDescription([\n"
    body += (
        "".join(f"{line}\n" for action in actions for line in action.lines(" " * 8, ","))
        + "    ])\n"
    )
    helpers = "".join(
        f"\n{text}" for name, text in _HELPERS.items() if re.search(rf"\b{name}\(", body)
    )
    used = set(re.findall(r"\w+", helpers + body))
    lines = [f'"""The TF tree and the processes of {plan.robot}, for ros2 launch."""', ""]
    lines += ["import sys"] if "sys" in used else []
    lines += ["from pathlib import Path", ""]
    if "get_package_share_directory" in used:
        lines.append("from ament_index_python.packages import get_package_share_directory")
    lines.append("from launch import LaunchDescription")
    for module, names in _IMPORTS.items():
        used_names = [name for name in names if name in used]
        imported = CodeBlock(f"from {module} import ", tuple(used_names), "")
        if len(str(imported)) > 100:  # noqa: PLR2004 (as long as lines of code are)
            imported = CodeBlock(f"from {module} import (", tuple(used_names), ")")
        lines += imported.lines() if used_names else []
    for name in ("BUILD", "HERE"):
        if name in used:
            folder = f"Path(__file__).resolve().parent / {machine.folder!r}"
            lines += [
                "",
                (
                    f"BUILD = ({folder}).resolve()"
                    if name == "BUILD"
                    else "HERE = Path(__file__).resolve().parent"
                ),
            ]
    begin = "\n\ndef generate_launch_description():\n"
    return _in_double_quotes(
        "\n".join(lines).replace("\n\nHERE", "\nHERE") + f"\n{helpers}{begin}{body}"
    )


def _in_double_quotes(text: str) -> str:
    """Return Python's source with double quotes around all texts that hold none."""
    lines = text.splitlines(keepends=True)
    for token in reversed(list(tokenize.generate_tokens(io.StringIO(text).readline))):
        (line, begin), (last, end) = token.start, token.end
        if (
            token.type == tokenize.STRING
            and token.string[0] == "'"
            and line == last
            and '"' not in token.string
        ):
            inside = token.string[1:-1]
            lines[line - 1] = f'{lines[line - 1][:begin]}"{inside}"{lines[line - 1][end:]}'
    return "".join(lines)


def _assign(name: str, action: CodeBlock) -> Iterator[str]:
    return CodeBlock(f"{name} = {action.begin}", action.parts, action.end).lines("    ")


class _Export:
    """The actions of a launch file.

    ``gaps`` are what they do not keep, ``named`` those that others refer to.
    """

    def __init__(self, plan: Plan, values: LaunchValues) -> None:
        self.plan, self.values = plan, values
        self.processes = (*plan.managed, *values.more)
        self.known = {process.name: process for process in (*plan.processes, *values.more)}
        self.gaps: list[str] = []
        self.named: dict[str, CodeBlock] = {}
        self._variables: dict[str, str] = {}
        self._delays_s = _delays_s(self.known)
        #: The components that each container loads, by its name.
        self._components: dict[str, list[PlanProcess]] = {}
        for process in self.processes:
            if process.component:
                container = process.component.container
                self._components.setdefault(container, []).append(process)

    def actions(self, stock: list[PlanEdge] | None) -> Iterator[CodeBlock]:
        """Yield the actions in order.

        ``stock`` are the edges of static_transform_publishers, None without such.
        """
        plan = self.plan
        yield from (argument.code() for argument in self.values.arguments)
        yield from (
            call("SetEnvironmentVariable", repr(name), repr(value))
            for name, value in _variables(plan)
        )
        if stock is not None:
            names = static_names(plan)
            yield from (
                _state_publisher(plan),
                *(_fixed_actions(plan, edge, names[edge.child]) for edge in stock),
            )
            self.gaps.append(
                f"robot_description is {STOCK_DESCRIPTION}, in which edges of other owners are"
                " floating joints"
            )
        for name in self._awaited_processes(stock):
            self._variables[name] = _variable_name(name, self._variables.values())
        for process in self.processes:
            if process.kind == "guard":
                self.gaps.append("the guard is left out: it belongs to tfcompose up")
                continue
            if process.kind in OWN_KINDS and (stock is not None or not process.owns):
                if stock is None:
                    self.gaps.append(f"{process.name} is left out: it publishes no edge")
                continue
            before = self._before(process)
            self._waits(process, before[:1])
            self.gaps += self._unlike(process)
            if self._comes_with_container(process):
                continue
            action = self._start(process)
            if process.name in self._variables:
                self.named[self._variables[process.name]] = action
                action = CodeBlock(self._variables[process.name], (), "")
            delay_s = self._delays_s[process.name]
            action = (
                call("TimerAction", f"period={delay_s!r}", items([action], "actions"))
                if delay_s
                else action
            )
            if before:
                ended = f"target_action={self._variables[before[0]]}"
                action = call(
                    "RegisterEventHandler",
                    call("OnProcessExit", ended, items([action], "on_exit")),
                )
            yield action

    def _before(self, process: PlanProcess) -> list[str]:
        """Return the processes for whose end it waits."""
        return [
            name
            for name, what in process.after.items()
            if what == "done" and name in self._variables
        ]

    def _comes_with_container(self, process: PlanProcess) -> bool:
        """Return whether the action of its container loads it.

        It waits for nothing else, and launch starts that.
        """
        container = self.known.get(process.component.container) if process.component else None
        return (
            container is not None
            and container.kind == "run"
            and _is_node(container)
            and not self._before(process)
            and self._delays_s[process.name] == self._delays_s[container.name]
        )

    def _awaited_processes(self, stock: list[PlanEdge] | None) -> list[str]:
        """Return the processes for whose end others wait and which are actions of their own."""
        own = set() if stock is None else OWN_KINDS
        names = {
            name
            for process in self.processes
            for name, what in process.after.items()
            if what == "done"
        }
        return [
            process.name
            for process in self.processes
            if process.name in names
            and process.kind not in {"guard", *own}
            and not _is_launch(process)
            and not process.lifecycle
        ]

    def _waits(self, process: PlanProcess, before: list[str]) -> None:
        """Say for what the process does not wait as it does under ``up``."""
        container = process.component.container if process.component else ""
        rest = [
            name
            for name, what in process.after.items()
            if name in self.known
            and name not in {*before, container}
            and not waiting_s(self.known[name], what)
        ]
        if rest:
            self.gaps.append(
                f"{process.name} does not wait for {', '.join(rest)}: launch has no readiness"
            )
        self.gaps += [f"{process.name} also starts if {name} fails" for name in before]

    def _texts_of(self, process: PlanProcess, place: str) -> dict[str, Text]:
        """Return the texts of a place (args, env, params, remap) that the launch file makes."""
        texts = self.values.texts.get(process.name, {})
        return {
            key.removeprefix(f"{place}."): text
            for key, text in texts.items()
            if key.startswith(f"{place}.")
        }

    def _condition(self, process: PlanProcess) -> list[CodeBlock | str]:
        expression = self.values.conditions.get(process.name)
        return (
            [keyword("condition", condition_code(expression, self.values.kinds))]
            if expression
            else []
        )

    def _unlike(self, process: PlanProcess) -> Iterator[str]:
        """Yield what launch does otherwise with a process."""
        yield from _unlike(process)
        loads = [component.name for component in self._components.get(process.name, [])]
        if loads and process.restart != "no":
            yield (
                f"a restarted {process.name} comes back without its components: {', '.join(loads)}"
            )

    def _start(self, process: PlanProcess) -> CodeBlock:
        if process.component:
            container = self.known[process.component.container].nodes[0]
            components = items([self._component(process)], "composable_node_descriptions")
            return call(
                "LoadComposableNodes",
                f"target_container={container!r}",
                components,
                *self._condition(process),
            )
        if _is_launch(process):
            return self._include(process)
        if _is_node(process):
            return self._node(process, [*self._settings(process), *self._condition(process)])
        if _is_command(process):
            argv = self._fill(process, process.argv)
            for index, text in self._texts_of(process, "args").items():
                argv[int(index)] = text_code(text)
            return call(
                "ExecuteProcess",
                items(argv, "cmd"),
                f"name={process.name!r}",
                *self._settings(process),
                *self._condition(process),
            )
        settings = self._settings(process, is_own=False)
        return call("process", repr(process.name), *settings, *self._condition(process))

    def _file(self, process: PlanProcess) -> str:
        """Return Python that gives the process's parameter file."""
        return f"{'HERE' if process in self.values.more else 'BUILD'} / {process.params_file!r}"

    def _fill(self, process: PlanProcess, argv: Iterable[str]) -> list[CodeBlock | str]:
        return [_fill_text(argument, self._file(process)) for argument in argv]

    def _environment(self, process: PlanProcess) -> dict[str, CodeBlock | str]:
        """Return the process's variables, as Python."""
        env: dict[str, CodeBlock | str] = {
            name: _fill_text(value, self._file(process)) for name, value in process.env.items()
        }
        return env | {
            name: text_code(text) for name, text in self._texts_of(process, "env").items()
        }

    def _settings(self, process: PlanProcess, *, is_own: bool = True) -> Iterator[CodeBlock | str]:
        """Yield the keywords of a process's keys; ``is_own``: launch starts its program itself."""
        for key in PROCESS_KEYS:
            dialect = key.launch
            if dialect is None or (dialect.is_own and not is_own):
                continue
            for name, value, _ in dialect.settings(process):
                code = self._python(process, value, self._texts_of(process, key.name))
                if str(code) != "{}":
                    yield keyword(name, code)

    def _python(
        self, process: PlanProcess, value: Any, texts: Mapping[str, Text] | None = None
    ) -> CodeBlock | str:
        """Return a value as Python; a mapping also has the ``texts`` that the file makes."""
        if isinstance(value, PythonCode):
            return str(value)
        if isinstance(value, str):
            return _fill_text(value, self._file(process))
        if isinstance(value, list):
            return items([self._python(process, item) for item in value])
        if isinstance(value, dict):
            made = {name: text_code(text) for name, text in (texts or {}).items()}
            return _mapping(
                {name: self._python(process, item) for name, item in value.items()} | made
            )
        if isinstance(value, float) and not math.isfinite(value):
            return f'float("{value}")'
        return repr(value)

    def _node(self, process: PlanProcess, more: list[CodeBlock | str]) -> CodeBlock:
        package = _EXECUTABLE.fullmatch(process.argv[0])
        own, ros_words = _rest(process)
        argv = self._fill(process, own)
        for index, text in self._texts_of(process, "args").items():
            argv[int(index)] = text_code(text)
        texts = {
            name: parameter_code(text) for name, text in self._texts_of(process, "params").items()
        }
        parameters: list[CodeBlock | str] = (
            [f"str({self._file(process)})"] if "--params-file" in process.argv else []
        )
        parameters += [_mapping(texts)] if texts else []
        named = (
            []
            if process.nodes[0].endswith(f"/{process.name}")
            else [f"exec_name={process.name!r}"]
        )
        parts: list[CodeBlock | str] = [
            f"package={package[1]!r}" if package else "",
            f"executable={package[2]!r}" if package else "",
            *_name_actions(process),
            *named,
            *self._remap(process),
            *([items(argv, "arguments")] if argv else []),
            *([items(self._fill(process, ros_words), "ros_arguments")] if ros_words else []),
            *([items(parameters, "parameters")] if parameters else []),
            *more,
        ]
        if loaded := self._components.get(process.name, []):
            components = [
                self._component(component)
                for component in loaded
                if self._comes_with_container(component)
            ]
            return call(
                "ComposableNodeContainer",
                *parts,
                items(components, "composable_node_descriptions"),
            )
        state = process.lifecycle.get(process.nodes[0])
        if not state:
            return call("Node", *parts)
        return call("*managed", call("LifecycleNode", *parts), f"active={state == 'active'}")

    def _component(self, process: PlanProcess) -> CodeBlock:
        """Return the description of a component.

        Its condition is here if its container's action loads it.
        """
        if process.component is None:
            raise ValueError(f"{process.name} is not a component")
        found = process.component
        params = {
            name: self._python(process, ros_value(value)) for name, value in found.params.items()
        }
        params |= {
            name: parameter_code(text) for name, text in self._texts_of(process, "params").items()
        }
        extra = EXTRA_ARGUMENTS.launch.settings(process) if EXTRA_ARGUMENTS.launch else ()
        more = [keyword(name, self._python(process, value)) for name, value, _ in extra]
        also, conditions = self._comes_with_container(process), self.values.conditions
        needed = also and conditions.get(process.name) != conditions.get(found.container)
        condition = self._condition(process) if needed else []
        return call(
            "ComposableNode",
            f"package={found.package!r}",
            f"plugin={found.plugin!r}",
            *_name_actions(process),
            *self._remap(process),
            *([items([_mapping(params)], "parameters")] if params else []),
            *more,
            *condition,
        )

    def _remap(self, process: PlanProcess) -> Iterator[CodeBlock]:
        remap: dict[str, CodeBlock | str] = {old: repr(new) for old, new in process.remap.items()}
        remap |= {old: text_code(text) for old, text in self._texts_of(process, "remap").items()}
        if remap:
            yield items((f"({old!r}, {new})" for old, new in remap.items()), "remappings")

    def _include(self, process: PlanProcess) -> CodeBlock:
        """Return the launch file with its arguments, and what ``up`` sets for all of its nodes."""
        plan, parsed = self.plan, _LAUNCH.fullmatch(process.argv[0])
        package, file = (parsed[1], parsed[2]) if parsed else ("", "")
        texts = self._texts_of(process, "args")
        pairs = [argument.split(":=", 1) for argument in process.argv[1:]]
        arguments = [
            (name, texts.get(str(index)), value) for index, (name, value) in enumerate(pairs)
        ]
        namespace = plan.ros.namespace if process.namespace is None else process.namespace
        settings = [
            *(
                call("SetEnvironmentVariable", repr(name), value)
                for name, value in self._environment(process).items()
            ),
            *([call("PushRosNamespace", repr(namespace))] if namespace else []),
            *(call("SetRemap", repr(old), repr(new)) for old, new in process.remap.items()),
            *([call("SetParameter", "'use_sim_time'", "True")] if plan.ros.clock == "sim" else []),
        ]
        rows = []
        for name, text, value in arguments:
            code = text_code(text) if text else _fill_text(value, self._file(process))
            rows.append(f"({name!r}, {code})")
        arguments_code = items(rows)
        return call(
            "included",
            repr(package),
            repr(file),
            arguments_code,
            items(settings),
            *self._condition(process),
        )


def _name_actions(process: PlanProcess) -> Iterator[str]:
    namespace, _, node = process.nodes[0].rpartition("/")
    yield f"name={node!r}"
    yield f"namespace={namespace or '/'!r}"


def _variable_name(name: str, names_in_use: Collection[str]) -> str:
    plain = re.sub(r"\W", "_", name)
    plain = plain if plain.isidentifier() and not iskeyword(plain) else f"process_{plain}"
    while plain in names_in_use:
        plain += "_"
    return plain


def _mapping(values: Mapping[str, CodeBlock | str]) -> CodeBlock:
    """Return a dict."""
    pairs: list[str | CodeBlock] = []
    for key, value in values.items():
        if isinstance(value, str):
            pairs.append(f"{key!r}: {value}")
        else:
            pairs.append(CodeBlock(f"{key!r}: {value.begin}", value.parts, value.end))
    return CodeBlock("{", tuple(pairs), "}")


def _delays_s(known: Mapping[str, PlanProcess]) -> dict[str, float]:
    """Return how long after the launch each is started.

    When all for which it waits so many seconds have had them.
    """
    delays: dict[str, float] = {}
    waiting = {
        name: {other: what for other, what in process.after.items() if other in known}
        for name, process in known.items()
    }
    for name in graphlib.TopologicalSorter(waiting).static_order():
        waits = (
            delays[other] + waiting_s(known[other], what) for other, what in waiting[name].items()
        )
        delays[name] = max(waits, default=0.0)
    return delays


def _unlike(process: PlanProcess) -> Iterator[str]:
    if process.component and process.lifecycle:
        yield f"{process.name} is a component: launch does not set its lifecycle state"
    if process.kind == "run" and process.lifecycle and not _is_node(process):
        yield (
            f"launch does not set the lifecycle state of {', '.join(process.lifecycle)} in"
            f" {process.name}"
        )
    for key in PROCESS_KEYS:
        if key.launch is None or not key.is_set(process):
            continue
        if not _is_launch(process):
            yield from key.launch.gaps(process)
        elif key.launch.of_file:
            yield from key.launch.of_file(process)
        else:
            yield f"{process.name} is a launch file, for which launch has no {key.name}"


def _variables(plan: Plan) -> Iterator[tuple[str, str]]:
    if plan.ros.domain_id is not None:
        yield "ROS_DOMAIN_ID", str(plan.ros.domain_id)
    if plan.ros.discovery is not None:
        yield "ROS_AUTOMATIC_DISCOVERY_RANGE", plan.ros.discovery.upper()
    yield from middleware_variables(plan.ros, {}).items()


def edges_published_by(urdf: str, prefix: str) -> set[tuple[str, str]]:
    """Return the edges (parent, child) that a stock robot_state_publisher sends of this URDF.

    Floating joints are omitted.
    """
    joints = [
        joint
        for joint in ET.fromstring(urdf).iter("joint")  # noqa: S314
        if joint.get("type") not in (None, "floating")
    ]
    return {
        (prefix + parent.get("link", ""), prefix + child.get("link", ""))
        for joint in joints
        if (parent := joint.find("parent")) is not None
        and (child := joint.find("child")) is not None
    }


def _stock(plan: Plan, urdf: str) -> list[PlanEdge] | None:
    """Return the fixed edges outside the URDF; None where own publishers must send all."""
    own = {process.name for process in plan.started if process.kind in OWN_KINDS}
    if not own or len(own) > len(OWN_KINDS) or any(plan.process(name).description for name in own):
        return None
    if any(_package(process) == STATE_PUBLISHER for process in plan.processes):
        return None
    edges = {(edge.parent, edge.child): edge for edge in plan.edges if edge.owner in own}
    of_urdf = edges_published_by(urdf, plan.ros.frame_prefix)
    rest = [edge for ends, edge in edges.items() if ends not in of_urdf]
    if not of_urdf or of_urdf - set(edges) or any(edge.kind != "static" for edge in rest):
        return None
    return rest


def _package(process: PlanProcess) -> str:
    parsed = _EXECUTABLE.fullmatch(process.argv[0]) if process.argv else None
    return parsed[1] if parsed else ""


def _keywords(plan: Plan) -> Iterator[str | CodeBlock]:
    """Yield the keywords of stock nodes: namespace, and the publishers' remappings."""
    remap = {
        old: new
        for process in plan.started
        if process.kind in OWN_KINDS
        for old, new in process.remap.items()
    }
    if plan.ros.namespace:
        yield f"namespace={plan.ros.namespace!r}"
    if remap:
        yield items(map(repr, remap.items()), "remappings")


def _state_publisher(plan: Plan) -> CodeBlock:
    """Return robot_state_publisher, limited to the joint states of the plan's publisher."""
    joints = next((process for process in plan.started if process.kind == "joints"), None)
    parameters = _params(joints.argv) if joints else {}
    values = {
        "publish_frequency": min(parameters.pop("publish_frequency", MOST_HZ), MOST_HZ),
        **parameters,
    }
    values["use_sim_time"] = plan.ros.clock == "sim"
    if plan.ros.frame_prefix:
        values["frame_prefix"] = plan.ros.frame_prefix
    params = CodeBlock(
        "{",
        ('"robot_description": description()', *(f"{k!r}: {v!r}" for k, v in values.items())),
        "}",
    )
    named = (
        f"package={STATE_PUBLISHER!r}",
        f"executable={STATE_PUBLISHER!r}",
        f"name={STATE_PUBLISHER!r}",
    )
    return call("Node", *named, *_keywords(plan), items([params], "parameters"), "output='screen'")


def _params(argv: tuple[str, ...]) -> dict[str, Any]:
    """Return the parameters that one of tfcompose's own processes is given in its command."""
    settings = [argument for before, argument in pairwise(argv) if before == "-p"]
    return {
        name: json.loads(value)
        for name, _, value in (argument.partition(":=") for argument in settings)
    }


def _fixed_actions(plan: Plan, edge: PlanEdge, name: str) -> CodeBlock:
    ends = (repr(name), repr(edge.parent), repr(edge.child))
    numbers = (
        CodeBlock("(", tuple(map(number, part)), ")")
        for part in (edge.pose.xyz, edge.pose.quat_xyzw)
    )
    return call("fixed", *ends, *numbers, *_keywords(plan))


def _is_launch(process: PlanProcess) -> bool:
    return bool(process.argv) and _LAUNCH.fullmatch(process.argv[0]) is not None


def _is_node(process: PlanProcess) -> bool:
    """Return whether launch can start the process as one node, and not only as a process."""
    return bool(_package(process)) and len(process.nodes) == 1 and not _needs_launcher(process)


def _needs_launcher(process: PlanProcess) -> bool:
    """Return whether the process has a key that launch does not have."""
    return any(
        key.launch and key.launch.is_external and key.is_set(process) for key in PROCESS_KEYS
    )


def _is_command(process: PlanProcess) -> bool:
    """Return whether the process's command is one that launch can start as it is."""
    return (
        process.kind == "run"
        and not _needs_launcher(process)
        and not any(map(_PLACEHOLDER.search, process.texts))
    )


def _rest(process: PlanProcess) -> tuple[list[str], list[str]]:
    """Return the program's arguments and ROS's.

    Names, remappings and parameter files are keywords of their own.
    """
    argv = list(process.argv[1:])
    at = argv.index("--ros-args") if "--ros-args" in argv else len(argv)
    kept, rest = [], iter(argv[at + 1 :])
    for argument in rest:
        if argument in _MOVED:
            next(rest, None)
        else:
            kept.append(argument)
    return argv[:at], kept


#: The launch file's value for a word of the plan.
_WORDS = {
    "${build_dir}": "str(BUILD)",
    "${params_file}": "str({file})",
}


def _fill_text(argument: str, file: str) -> str:
    """Return the word as Python that knows the plan's folder.

    ``file`` is Python that gives the parameter file.
    """
    found = {
        mark: code.replace("{file}", file) for mark, code in _WORDS.items() if mark in argument
    }
    if argument in found:
        return found[argument]
    return repr(argument) + "".join(f".replace({mark!r}, {code})" for mark, code in found.items())
