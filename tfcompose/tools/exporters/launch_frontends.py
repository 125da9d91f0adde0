"""XML and YAML launch files.

Both formats have the same entities, with the same attributes. In XML all values are text, which
launch converts. In YAML values have types. Sources: the parse methods of ``launch`` and
``launch_ros`` of ROS 2 Jazzy, and the grammar of substitutions in ``launch.frontend``.
"""

from __future__ import annotations

import os
import shlex
from dataclasses import dataclass, field
from functools import singledispatchmethod
from typing import TYPE_CHECKING, Any, Literal, get_args
from xml.etree import ElementTree as ET

import yaml

from tfcompose.foundation.findings import Finding, RejectedError, Span, finding
from tfcompose.foundation.numbers import number
from tfcompose.launcher.preflight import path_in_share
from tfcompose.launcher.program import ANYWHERE_PARTS
from tfcompose.model.process_keys import KeywordKind, launch_keywords
from tfcompose.tools.exporters.launch_actions import (
    Action,
    AfterExit,
    Delayed,
    FixedEdge,
    Include,
    LoadComponents,
    LoadedComponent,
    SetVariable,
    StartCommand,
    StartFromPlan,
    StartNode,
    nested,
)
from tfcompose.tools.exporters.launch_texts import (
    ArgumentValue,
    FileContent,
    FilePath,
    TypedText,
    VariableValue,
)
from tfcompose.tools.exporters.launch_values import Junction, LaunchArgument, Negation, TruthValue

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from tfcompose.model.process_keys import Setting
    from tfcompose.tools.exporters.launch_texts import Text
    from tfcompose.tools.exporters.launch_values import Condition, LaunchValues


LaunchFormat = Literal["python", "xml", "yaml"]

_KEYWORDS = {keyword.name: keyword for keyword in launch_keywords(*get_args(KeywordKind))}
#: Separators of lists in XML. The writer uses the first one that no item contains.
_SEPARATORS = (", ", ";", "|", "\t", "\n")
#: A launch configuration that contains the launch file's folder. ``$(dirname)`` does not work
#: after an include or inside a timer, because it is then the folder of the last included file.
_FOLDER = "tfcompose_launch_folder"
_ADVICE = (
    "--format python; or start the robot file from a launch file, with <tfcompose"
    ' file="robot.yaml"/>'
)


@dataclass(frozen=True, slots=True)
class LaunchFile:
    """A launch file to write."""

    #: The plan's folder: absolute, or relative to the launch file.
    folder: str
    format: LaunchFormat = "python"
    #: A function from a process and a key, such as ``after``, to the key's location in the robot
    #: file.
    place_of: Callable[[str, str], Span | None] = lambda _process, _key: None


Value = str | bool | int | float | list[Any]


@dataclass(frozen=True, slots=True)
class Entity:
    """An element of a launch file, such as ``node`` or ``group``."""

    name: str
    attributes: Mapping[str, Value]
    #: Elements inside the entity that describe it: param, remap, env, arg, choice,
    #: composable_node.
    inner: Sequence[Entity] = ()
    #: The actions of a group or timer.
    actions: Sequence[Entity] = ()

    def to_xml(self) -> ET.Element:
        """Return the element."""
        element = ET.Element(self.name, dict(self._xml_attributes()))
        element.extend(entity.to_xml() for entity in (*self.inner, *self.actions))
        return element

    def _xml_attributes(self) -> Iterator[tuple[str, str]]:
        for name, value in self.attributes.items():
            if isinstance(value, list):
                texts = list(map(_xml_text, value))
                separator = next(
                    sign for sign in _SEPARATORS if not any(sign in text for text in texts)
                )
                yield name, separator.join(texts)
                yield f"{name}-sep", separator
            else:
                yield name, _xml_text(value)

    def to_yaml(self) -> dict[str, Any]:
        """Return the mapping that YAML has under the entity's name."""
        data: dict[str, Any] = dict(self.attributes)
        for entity in self.inner:
            data.setdefault(entity.name, []).append(entity.to_yaml())
        if self.actions:
            data["children"] = [{entity.name: entity.to_yaml()} for entity in self.actions]
        return data


@dataclass
class FrontendWriter:
    """Writes actions as XML or YAML, and collects differences from the Python file in ``gaps``."""

    file: LaunchFile
    values: LaunchValues
    gaps: list[str] = field(default_factory=list)
    _has_paths: bool = False

    def write(self, robot: str, actions: Sequence[Action]) -> str:
        """Return the launch file.

        Raises:
            RejectedError: if an action needs a feature that the format does not have.
        """
        if findings := [*self._unsupported(actions)]:
            raise RejectedError(findings)
        entities = [
            *map(self._argument, self.values.arguments),
            *(entity for action in actions for entity in self._entities(action)),
        ]
        if self._has_paths:
            entities.insert(0, _named("let", _FOLDER, "$(dirname)"))
        title = f"The TF tree and the processes of {robot}, for ros2 launch."
        if self.file.format == "yaml":
            data = {"launch": [{entity.name: entity.to_yaml()} for entity in entities]}
            text: str = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=100)
            return f"# {title}\n{text}"
        root = ET.Element("launch")
        root.extend(entity.to_xml() for entity in entities)
        ET.indent(root)
        return f"<!-- {title} -->\n{ET.tostring(root, encoding='unicode')}\n"

    def _unsupported(self, actions: Sequence[Action]) -> Iterator[Finding]:
        """Yield a finding for each action that the format does not support."""
        files = f"{self.file.format.upper()} launch files"
        for action in (inner for outer in actions for inner in nested(outer)):
            name = action.process
            if isinstance(action, AfterExit):
                message = (
                    f"{name} waits until {action.awaited} is done, and {files} cannot wait for the"
                    " end of a process"
                )
                yield self._finding(message, name, "after")
            elif isinstance(action, StartNode) and action.lifecycle_state:
                message = (
                    f"launch brings {name} to {action.lifecycle_state}, and {files} have no"
                    " lifecycle nodes"
                )
                yield self._finding(message, name, "lifecycle")

    def _finding(self, message: str, process: str, key: str) -> Finding:
        return finding("TF928", message, self.file.place_of(process, key), help=_ADVICE)

    def _argument(self, argument: LaunchArgument) -> Entity:
        default = argument.default
        value: Text = (VariableValue(argument.env, default),) if argument.env else (default,)
        attributes: dict[str, Value] = {
            "name": argument.name,
            "default": self._template(value),
        }
        if argument.description:
            attributes["description"] = argument.description.replace("\\", "\\\\")
        choices = [choice.replace("\\", "\\\\") for choice in argument.choices]
        return Entity("arg", attributes, [Entity("choice", {"value": each}) for each in choices])

    @singledispatchmethod
    def _entities(self, action: Action) -> list[Entity]:
        raise TypeError(f"no entity for {action!r}")

    @_entities.register
    def _(self, action: SetVariable) -> list[Entity]:
        return [_named("set_env", action.name, self._template((action.value,)))]

    @_entities.register
    def _(self, action: FixedEdge) -> list[Entity]:
        keys = ("--x", "--y", "--z", "--qx", "--qy", "--qz", "--qw")
        numbers = map(number, (*action.xyz, *action.quat_xyzw))
        argv = [text for pair in zip(keys, numbers, strict=True) for text in pair]
        argv += ["--frame-id", action.parent, "--child-frame-id", action.child]
        attributes = {"pkg": "tf2_ros", "exec": "static_transform_publisher", "name": action.name}
        if action.namespace:
            attributes["namespace"] = action.namespace
        attributes["args"] = self._command((text,) for text in argv)
        attributes["output"] = "screen"
        return [Entity("node", attributes, self._remap(action.remap))]

    @_entities.register
    def _(self, action: StartNode) -> list[Entity]:
        attributes: dict[str, Value] = {"pkg": action.package, "exec": action.executable}
        attributes |= {
            name: value
            for name, value in (
                ("name", action.name),
                ("namespace", action.namespace),
                ("exec_name", action.exec_name),
                ("args", self._command(action.arguments)),
                ("ros_args", self._command(action.ros_arguments)),
            )
            if value
        }
        attributes |= self._settings(action) | self._condition(action.condition)
        inner = [*self._params(action.params_file, action.params), *self._remap(action.remap)]
        inner += self._environment(action.settings)
        if action.components is None:
            return [Entity("node", attributes, inner)]
        inner += map(self._component, action.components)
        return [Entity("node_container", attributes, inner)]

    @_entities.register
    def _(self, action: LoadComponents) -> list[Entity]:
        attributes: dict[str, Value] = {"target": action.container}
        attributes |= self._condition(action.condition)
        components = list(map(self._component, action.components))
        return [Entity("load_composable_node", attributes, components)]

    @_entities.register
    def _(self, action: StartCommand) -> list[Entity]:
        return [self._executable(action, self._command(action.argv))]

    @_entities.register
    def _(self, action: StartFromPlan) -> list[Entity]:
        """Write ``tfcompose exec``, run by the Python of launch, as in the Python launch file."""
        python = "$(eval 'sys.executable' sys)"
        start = self._command([("-c",), ("".join(ANYWHERE_PARTS),), ("exec",)])
        arguments = self._command([(FilePath("plan.json"),), (action.process,)])
        return [self._executable(action, f"{python} {start} {arguments}")]

    def _executable(self, action: StartCommand | StartFromPlan, cmd: str) -> Entity:
        attributes: dict[str, Value] = {"cmd": cmd, "name": action.process}
        if isinstance(action, StartFromPlan):
            attributes["output"] = "screen"
        attributes |= self._settings(action) | self._condition(action.condition)
        return Entity("executable", attributes, self._environment(action.settings))

    @_entities.register
    def _(self, action: Include) -> list[Entity]:
        settings = [
            _named("set_env", name, self._template(value)) for name, value in action.env.items()
        ]
        if action.namespace:
            settings.append(Entity("push_ros_namespace", {"namespace": action.namespace}))
        settings += self._remap(action.remap, "set_remap")
        if action.use_sim_time:
            settings.append(_named("set_parameter", "use_sim_time", "true"))
        arguments = [
            _named("arg", name, self._template(value)) for name, value in action.arguments
        ]
        path = f"$(find-pkg-share {action.package})/{self._path_in_share(action)}"
        settings.append(Entity("include", {"file": path}, arguments))
        return [Entity("group", self._condition(action.condition), (), settings)]

    @_entities.register
    def _(self, action: Delayed) -> list[Entity]:
        return [Entity("timer", {"period": action.delay_s}, (), self._entities(action.action))]

    def _path_in_share(self, include: Include) -> str:
        """Return the launch file's path inside the share folder of its package on this machine."""
        if path := path_in_share(include.package, include.file, os.environ):
            return path[1]
        self.gaps.append(
            f"{include.file} of {include.process} is expected in the folder launch of"
            f" {include.package}, which is not installed here"
        )
        return f"launch/{include.file}"

    def _component(self, component: LoadedComponent) -> Entity:
        attributes: dict[str, Value] = {
            "pkg": component.package,
            "plugin": component.plugin,
            "name": component.name,
            "namespace": component.namespace,
        }
        inner = [*self._params(None, component.params), *self._remap(component.remap)]
        inner += [
            _named(_KEYWORDS[setting.name].attribute, name, self._template((_yaml(value),)))
            for setting in component.settings
            for extra in setting.value
            for name, value in extra.items()
        ]
        return Entity("composable_node", attributes | self._condition(component.condition), inner)

    def _remap(self, remap: Mapping[str, Text], entity: str = "remap") -> list[Entity]:
        return [
            Entity(entity, {"from": self._template((old,)), "to": self._template(new)})
            for old, new in remap.items()
        ]

    def _params(self, file: FilePath | None, params: Mapping[str, Any]) -> Iterator[Entity]:
        if file:
            yield Entity("param", {"from": self._template((file,))})
        for name, value in params.items():
            text, kind = self._parameter(value)
            yield Entity("param", {"name": self._template((name,)), "value": text, "type": kind})

    def _parameter(self, value: Any) -> tuple[Value, str]:
        """Return a parameter's value and its type."""
        if isinstance(value, TypedText):
            return self._template(value.text), value.type
        if isinstance(value, FileContent):
            return f"$(file-content '{self._path(FilePath(value.path))}')", "str"
        if isinstance(value, list):
            items = list(map(self._parameter, value))
            return [item for item, _ in items], f"list_of_{items[0][1]}"
        if isinstance(value, str):
            return self._template((value,)), "str"
        return value, type(value).__name__

    def _settings(self, action: StartNode | StartCommand | StartFromPlan) -> dict[str, Value]:
        """Return the attributes of an action's settings, without its environment."""
        attributes: dict[str, Value] = {}
        for name, value, _ in action.settings:
            keyword = _KEYWORDS[name]
            if keyword.kind == "variables":
                continue
            if keyword.kind == "output":
                attribute: Value = self._output(action, value)
            elif keyword.type is not str:
                attribute = keyword.type(value[0] if isinstance(value, tuple) else value)
            elif isinstance(value, tuple):
                attribute = self._template(value)
            else:
                attribute = _xml_text(value)
            attributes[keyword.attribute or name] = attribute
        return attributes

    def _output(self, action: Action, value: Any) -> str:
        """Return launch's value for ``output``.

        These formats cannot set stdout and stderr separately.
        """
        if isinstance(value, tuple):
            return str(value[0])
        destination = str(value["both"])
        if destination == "log":
            self.gaps.append(
                f"{action.process} also prints its stderr: these formats cannot log it alone, as"
                " --format python does"
            )
        return destination

    def _environment(self, settings: Iterable[Setting]) -> list[Entity]:
        return [
            _named("env", name, self._template(value))
            for setting in settings
            if _KEYWORDS[setting.name].kind == "variables"
            for name, value in setting.value.items()
        ]

    def _condition(self, condition: Condition | None) -> dict[str, Value]:
        if condition is None:
            return {}
        if isinstance(condition, Negation):
            return {"unless": _truth(condition.condition)}
        return {"if": _truth(condition)}

    def _command(self, argv: Iterable[Text]) -> str:
        """Return the command as a single string that launch splits as a shell does."""
        return " ".join("".join(map(self._argument_part, text)) or "''" for text in argv)

    def _argument_part(self, part: str | FilePath | ArgumentValue | VariableValue) -> str:
        return _escape(shlex.quote(part)) if isinstance(part, str) else self._part(part)

    def _template(self, text: Text) -> str:
        """Return a text in which substitutions stand for paths and values."""
        return "".join(map(self._part, text))

    def _part(self, part: str | FilePath | ArgumentValue | VariableValue) -> str:
        if isinstance(part, str):
            return _escape(part)
        if isinstance(part, FilePath):
            return self._path(part)
        if isinstance(part, ArgumentValue):
            return f"$(var {part.name})"
        if part.default is None:
            return f"$(env {part.name})"
        return f"$(env {part.name} {_quoted(part.default)})"

    def _path(self, path: FilePath) -> str:
        folder = "" if path.is_next_to_launch_file else self.file.folder
        parts = [_escape(folder), _escape(path.path)]
        if not folder.startswith("/"):
            self._has_paths = True
            parts.insert(0, f"$(var {_FOLDER})")
        return "/".join(filter(None, parts))


def _named(entity: str, name: str, value: str) -> Entity:
    return Entity(entity, {"name": _escape(name), "value": value})


def _truth(condition: Condition) -> str:
    """Return a substitution whose value is true or false."""
    if isinstance(condition, Junction):
        return f"$({condition.operator} {_truth(condition.left)} {_truth(condition.right)})"
    if isinstance(condition, Negation):
        return f"$(not {_truth(condition.condition)})"
    if isinstance(condition, TruthValue):
        return condition.text if condition.is_constant else f"$(var {condition.text})"
    variable = f"$(var {condition.name})"
    if condition.is_of_order:
        return f"$(eval '{variable} {condition.sign} {condition.value}')"
    name = "equals" if condition.sign == "==" else "not-equals"
    return f"$({name} {variable} {_quoted(condition.value)})"


def _escape(text: str) -> str:
    """Escape the text for an attribute in which launch looks for substitutions."""
    return text.replace("\\", "\\\\").replace("$(", "\\$(")


def _quoted(text: str) -> str:
    """Quote the text as an argument of a substitution."""
    escaped = _escape(text).replace("'", "\\'")
    return f"'{escaped}'"


def _xml_text(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _yaml(value: Any) -> str:
    """Return the value as a single line of YAML, because launch parses untyped values as YAML."""
    text: str = yaml.safe_dump(value, default_flow_style=True, width=10**6)
    return text.removesuffix("\n").removesuffix("\n...")
