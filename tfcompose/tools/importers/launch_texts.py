"""Launch files in XML and YAML, read into actions; of ROS 1 as well, whose XML has other words.

This runs in the process that reads launch files, with the stand-in for launch's API.
"""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.urdf.read import read_xml
from tfcompose.foundation.findings import RejectedError
from tfcompose.model.process_keys import launch_keywords
from tfcompose.spec.load import load
from tfcompose.tools.importers import launch_actions as actions
from tfcompose.tools.importers import launch_conditions as conditions
from tfcompose.tools.importers import launch_substitutions as substitutions
from tfcompose.tools.importers.launch_substitutions import (
    BEGIN,
    END,
    Context,
    FailedError,
    text_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tfcompose.compiler.urdf.read import Element
    from tfcompose.spec.load import Path as Steps
    from tfcompose.spec.load import Source


@dataclass(slots=True)
class Entity:
    """An action in a text: its tag, attributes, what is inside, and its file and line."""

    tag: str
    attributes: dict[str, Any]
    children: list[Entity]
    at: tuple[str, int]
    used: set[str] = field(default_factory=set)

    def get(self, *names: str) -> Any:
        """Return the first of these attributes that is there, or None."""
        self.used.update(names)
        return next((self.attributes[name] for name in names if name in self.attributes), None)

    def all(self, tag: str) -> list[Entity]:
        """Return what is inside of a tag."""
        self.used.add(f"<{tag}>")
        return [one for one in self.children if one.tag == tag]

    def unused(self) -> list[str]:
        """Return what nobody asked for."""
        left = [name for name in self.attributes if name not in self.used]
        return [
            *left,
            *dict.fromkeys(
                f"<{one.tag}>" for one in self.children if f"<{one.tag}>" not in self.used
            ),
        ]


def of_xml(text: str, file: str) -> list[Entity]:
    """Return the actions of an XML launch file.

    Raises:
        FailedError: if it is none.
    """
    try:
        root = read_xml(text, file)
    except RejectedError as error:
        raise _refusal(error) from None
    if root.tag != "launch":
        raise FailedError(f"<{root.tag}> is no launch file")
    return [_of_element(child, file) for child in root.children]


def _refusal(error: RejectedError) -> FailedError:
    found = error.findings[0]
    return FailedError(found.message, found.span.line if found.span else 0)


def _of_element(element: Element, file: str) -> Entity:
    children = [_of_element(child, file) for child in element.children]
    return Entity(element.tag, dict(element.attributes), children, (file, element.at.line))


def of_yaml(text: str, file: str) -> list[Entity]:
    """Return the actions of a YAML launch file.

    Raises:
        FailedError: if it is none.
    """
    try:
        source = load(text, file)
    except RejectedError as error:
        raise _refusal(error) from None
    listed = source.data.get("launch")
    if not isinstance(listed, list):
        raise FailedError("it has no list under launch:")
    return list(_of_list(listed, ("launch",), source))


def _of_list(listed: list[Any], path: Steps, source: Source) -> Iterator[Entity]:
    for index, item in enumerate(listed):
        at = (*path, index)
        if isinstance(item, dict):
            for tag, value in item.items():
                yield _of_value(str(tag), value, (*at, tag), source)
        else:
            yield Entity(str(item), {}, [], (source.file, source.at(at).line))


def _of_value(tag: str, value: Any, path: Steps, source: Source) -> Entity:
    place = source.at(path) if isinstance(path[-1], int) else source.at_key(path)
    entity = Entity(tag, {}, [], (source.file, place.line))
    if isinstance(value, list):
        entity.children = list(_of_list(value, path, source))
        return entity
    for key, inner in value.items() if isinstance(value, dict) else ():
        if key == "children" and isinstance(inner, list):
            entity.children += _of_list(inner, (*path, key), source)
        elif isinstance(inner, list) and any(isinstance(one, dict) for one in inner):
            entity.children += [
                _of_value(key, one, (*path, key, index), source) for index, one in enumerate(inner)
            ]
        else:
            entity.attributes[key] = inner
    return entity


# Substitutions

_BEGIN = re.compile(r"\$\(\s*([A-Za-z_][A-Za-z0-9_-]*)\s*")


def substituted(text: Any) -> Any:
    """Return a text with its substitutions; other values as they are."""
    if isinstance(text, list):
        return [substituted(one) for one in text]
    if not isinstance(text, str) or "$(" not in text:
        return text
    parts: list[Any] = []
    position = 0
    while (found := _BEGIN.search(text, position)) is not None:
        parts.append(text[position : found.start()])
        words, position = _arguments(text, found.end())
        parts.append(_substitution(found[1], words))
    parts.append(text[position:])
    kept = [part for part in parts if part != ""]
    return kept[0] if len(kept) == 1 else kept


def _arguments(text: str, begin: int) -> tuple[list[Any], int]:
    """Return the arguments of a substitution, and where the text goes on behind its bracket."""
    words: list[str] = []
    word: str | None = None
    depth, quote, position = 0, "", begin
    while position < len(text):
        char = text[position]
        position += 1
        if quote:
            quote = "" if char == quote else quote
            word = (word or "") + (char if quote else "")
        elif char in "'\"" and depth == 0:
            quote, word = char, word or ""
        elif char == ")" and depth == 0:
            break
        elif char.isspace() and depth == 0:
            words += [word] if word is not None else []
            word = None
        else:
            depth += (char == "(") - (char == ")")
            word = (word or "") + char
    return [substituted(one) for one in [*words, *([word] if word is not None else [])]], position


def _substitution(name: str, words: list[Any]) -> Any:
    first = words[0] if words else ""
    several = _several(words)
    known: dict[str, Callable[[], Any]] = {
        "var": lambda: substitutions.LaunchConfiguration(
            first, default=words[1] if words[1:] else None
        ),
        "arg": lambda: substitutions.LaunchConfiguration(first),
        "env": lambda: substitutions.EnvironmentVariable(
            first, default_value=words[1] if words[1:] else None
        ),
        "optenv": lambda: substitutions.EnvironmentVariable(
            first, default_value=several[2:] if words[1:] else ""
        ),
        "find-pkg-share": lambda: substitutions.FindPackageShare(first),
        "find": lambda: substitutions.FindPackageShare(first),
        "find-pkg-prefix": lambda: substitutions.FindPackagePrefix(first),
        "find-exec": lambda: substitutions.FindExecutable(name=first),
        "exec-in-pkg": lambda: substitutions.ExecutableInPackage(
            first, words[1] if words[1:] else ""
        ),
        "anon": lambda: substitutions.AnonName(first),
        "dirname": substitutions.ThisLaunchFileDir,
        "filename": substitutions.ThisLaunchFile,
        "log_dir": substitutions.LaunchLogDir,
        "launch_log_dir": substitutions.LaunchLogDir,
        "eval": lambda: substitutions.PythonExpression(several),
        "command": lambda: substitutions.Command(first),
        "file-content": lambda: substitutions.FileContent(first),
        "equals": lambda: substitutions.EqualsSubstitution(*words[:2]),
        "not-equals": lambda: substitutions.NotEqualsSubstitution(*words[:2]),
        "not": lambda: substitutions.NotSubstitution(first),
        "and": lambda: substitutions.AndSubstitution(*words),
        "or": lambda: substitutions.OrSubstitution(*words),
        "any": lambda: substitutions.AnySubstitution(*words),
        "all": lambda: substitutions.AllSubstitution(*words),
        "if": lambda: substitutions.IfElseSubstitution(*words[:3]),
    }
    make = known.get(name)
    if make is not None:
        return make()
    unknown = actions.Unknown()
    unknown.NAME = f"the substitution $({name} …)"
    return unknown


def _several(words: list[Any]) -> list[Any]:
    """Return words as one text again, with spaces between them."""
    parts: list[Any] = []
    for word in words:
        parts += [" ", *(word if isinstance(word, list) else [word])]
    return parts[1:]


def command_line(text: Any) -> list[Any]:
    """Return a command line's words.

    It is split where it has spaces, and not where a substitution's value has.

    Quotes around a substitution, as ROS 1 has them, are taken off.
    """
    parts = substituted(text)
    parts = parts if isinstance(parts, list) else [parts]
    try:
        split = list(map(_tokens_of, parts))
    except ValueError:
        return _quoted_words(parts)
    words: list[list[Any]] = []
    is_open = False
    for part, tokens in zip(parts, split, strict=True):
        if tokens is None:
            if is_open:
                words[-1].append(part)
            else:
                words.append([part])
            is_open = True
            continue
        for index, token in enumerate(tokens):
            if index == 0 and is_open and not part[0].isspace():
                words[-1].append(token)
            else:
                words.append([token])
        is_open = bool(tokens) and not part[-1].isspace()
    return words


def _tokens_of(part: Any) -> list[str] | None:
    """Return the tokens of a text; a substitution has none."""
    return shlex.split(part) if isinstance(part, str) else None


def _quoted_words(parts: list[Any]) -> list[Any]:
    """Return the words of a command line in which quotes go around substitutions."""
    texts = list(parts)
    for index, part in enumerate(parts):
        if not isinstance(part, str):
            texts[index] = f"{BEGIN}{index}{END}"
    text = "".join(texts)
    try:
        tokens = shlex.split(text)
    except ValueError:
        tokens = text.split()
    words = []
    for token in tokens:
        word: list[Any] = re.split(f"{BEGIN}(\\d+){END}", token)
        for index in range(1, len(word), 2):
            word[index] = parts[int(word[index])]
        words.append(word)
    return words


# Actions


@dataclass(slots=True)
class _Text(actions.Action):
    """An action in a text, made when its turn comes."""

    entity: Entity

    def __init__(self, entity: Entity) -> None:
        self.entity, self.at = entity, entity.at
        self.condition = None

    def visit(self, context: Context) -> None:
        context.at = self.at
        try:
            several = list(_made(self.entity, context))
        except FailedError as error:
            context.todo(self.at, f"<{self.entity.tag}>: {error}")
            return
        for one in several:
            one.at = self.at
            one.visit(context)
        left = self.entity.unused() if several else []
        if left:
            context.todo(self.at, f"<{self.entity.tag}>: {', '.join(left)}")


class Actions:
    """What a text holds, as a launch description."""

    def __init__(self, entities: list[Entity]) -> None:
        self.entities = entities

    def visit(self, context: Context) -> None:
        """Do what it says, in order."""
        for entity in self.entities:
            _Text(entity).visit(context)


def _made(entity: Entity, context: Context) -> Iterator[Any]:
    """Yield the action of an entity.

    Raises:
        FailedError: if it has no such attributes.
    """
    make = _MAKERS.get(entity.tag.replace("-", "_"))
    if make is None:
        entity.used.update(entity.attributes)
        raise FailedError("it is not known here")
    several = make(entity, context)
    condition: Any = None
    if (given := entity.get("if")) is not None:
        condition = conditions.IfCondition(substituted(given))
    elif (given := entity.get("unless")) is not None:
        condition = conditions.UnlessCondition(substituted(given))
    for one in several:
        one.condition = condition
        yield one


def _need(entity: Entity, *names: str) -> Any:
    value = entity.get(*names)
    if value is None:
        raise FailedError(f"it has no {names[0]}")
    return substituted(value)


def _optional(entity: Entity, *names: str) -> Any:
    return substituted(entity.get(*names))


def _argument(entity: Entity, context: Context) -> list[Any]:
    name = _need(entity, "name")
    entity.get("doc")
    fixed = entity.get("value")
    if fixed is not None:  # of ROS 1: nobody can give another one
        return [actions.SetLaunchConfiguration(name, substituted(fixed))]
    default = _optional(entity, "default")
    choices = [text_of(_need(one, "value"), context) for one in entity.all("choice")]
    description = str(entity.get("description", "doc") or "")
    return [
        actions.DeclareLaunchArgument(
            name, default_value=default, description=description, choices=choices or None
        )
    ]


def _parameters(entity: Entity) -> list[Any]:
    several: list[Any] = []
    for one in entity.all("param"):
        if one.get("from") is not None:
            several.append(substitutions.ParameterFile(substituted(one.get("from"))))
        elif one.get("name") is not None:
            several.append(dict([_parameter(one)]))
    return several


def _parameter(one: Entity) -> tuple[Any, Any]:
    name = substituted(one.get("name"))
    inner = one.all("param")
    if inner:
        return name, dict(_parameter(child) for child in inner)
    if (made := _made_by_ros1(one)) is not None:
        return name, made
    value, kind = one.get("value"), one.get("type")
    separator = one.get("value-sep")
    if isinstance(value, str) and separator:
        return name, [
            substitutions.ParameterValue(substituted(part)) for part in value.split(separator)
        ]
    if isinstance(value, list):
        return name, [substitutions.ParameterValue(substituted(part)) for part in value]
    return name, substitutions.ParameterValue(
        substituted(value), value_type=str if kind in {"str", "string"} else None
    )


def _made_by_ros1(one: Entity) -> Any:
    """Return what a parameter of ROS 1 is the output of, or the text of.

    None where it has a value.
    """
    if one.get("command") is not None:
        return substitutions.Command(substituted(one.get("command")))
    return (
        None
        if one.get("textfile") is None
        else substitutions.FileContent(substituted(one.get("textfile")))
    )


def _global_parameter(one: Entity, _context: Context) -> list[Any]:
    made = _made_by_ros1(one)
    return [
        actions.SetParameter(
            _need(one, "name"), made or substitutions.ParameterValue(_need(one, "value"))
        )
    ]


def _common(entity: Entity) -> dict[str, Any]:
    attributes = {
        keyword.attribute or keyword.name: keyword.name
        for keyword in launch_keywords("text", "switch", "number", "output")
    }
    attributes["shell"] = "shell"
    given = {
        name: value
        for attribute, name in attributes.items()
        if (value := _optional(entity, attribute)) is not None
    }
    env = [(_need(one, "name"), _need(one, "value")) for one in entity.all("env")]
    given |= {launch_keywords("variables")[0].name: env} if env else {}
    for keyword in launch_keywords("shutdown"):
        is_required = str(entity.get(keyword.ros1)).lower() == "true"
        if entity.get(keyword.name) == "shutdown" or is_required:
            given[keyword.name] = [actions.Shutdown()]
    entity.get("clear_params")
    return given


def _node_words(entity: Entity) -> dict[str, Any]:
    return {
        "package": _need(entity, "pkg"),
        "executable": _need(entity, "exec", "type"),
        "name": _optional(entity, "name", "node-name"),
        "namespace": _optional(entity, "namespace", "ns"),
        "exec_name": _optional(entity, "exec_name"),
        "parameters": _parameters(entity),
        "remappings": [(_need(one, "from"), _need(one, "to")) for one in entity.all("remap")],
        "arguments": command_line(entity.get("args")) if entity.get("args") is not None else None,
        "ros_arguments": command_line(entity.get("ros_args"))
        if entity.get("ros_args") is not None
        else None,
        **_common(entity),
    }


def _node(entity: Entity, _context: Context) -> list[Any]:
    node = actions.Node(**_node_words(entity))
    if entity.get("type") is not None:
        return [_OfRos1(node)]
    return [node]


class _OfRos1(actions.Action):
    """A node of ROS 1's launch, whose static_transform_publisher reads other arguments."""

    def __init__(self, node: actions.Node) -> None:
        super().__init__()
        self.node = node

    def execute(self, context: Context) -> None:
        self.node.at = self.at
        self.node.record(context, "node", ros1=True)

    def described(self, context: Context) -> str:
        return self.node.described(context)


def _component(entity: Entity, _context: Context) -> list[Any]:
    component = actions.ComposableNode(
        package=_need(entity, "pkg"),
        plugin=_need(entity, "plugin"),
        name=_optional(entity, "name"),
        namespace=_optional(entity, "namespace"),
        parameters=_parameters(entity),
        remappings=[(_need(rule, "from"), _need(rule, "to")) for rule in entity.all("remap")],
        **{
            keyword.name: [dict([_parameter(one)]) for one in entity.all(keyword.attribute)]
            for keyword in launch_keywords("parameters")
        },
    )
    return [component]


def _components(entity: Entity) -> list[_Text]:
    return [_Text(one) for one in entity.all("composable_node")]


def _container(entity: Entity, _context: Context) -> list[Any]:
    words = _node_words(entity)
    return [
        actions.ComposableNodeContainer(**words, composable_node_descriptions=_components(entity))
    ]


def _load(entity: Entity, _context: Context) -> list[Any]:
    components = _components(entity)
    target = _need(entity, "target")
    return [
        actions.LoadComposableNodes(
            target_container=target, composable_node_descriptions=components
        )
    ]


def _group(entity: Entity, _context: Context) -> list[Any]:
    inner: list[Any] = [
        _Text(one) for one in entity.children if one.tag not in {"keep", "forward"}
    ]
    entity.used.update(f"<{one.tag}>" for one in entity.children)
    keeps = {
        _need(one, "name"): _need(one, "value") for one in entity.children if one.tag == "keep"
    }
    namespace = _optional(entity, "ns")
    if namespace is not None:
        inner = [actions.PushRosNamespace(namespace), *inner]
    scoped, forwarding = entity.get("scoped"), entity.get("forwarding")
    return [
        actions.GroupAction(
            inner,
            scoped=True if scoped is None else substituted(scoped),
            forwarding=str(forwarding).lower() != "false",
            launch_configurations={str(name): value for name, value in keeps.items()},
        )
    ]


def _include(entity: Entity, _context: Context) -> list[Any]:
    given = [(_need(one, "name"), _need(one, "value", "default")) for one in entity.all("arg")]
    namespace = _optional(entity, "ns")
    entity.get("pass_all_args", "clear_params")
    action = actions.IncludeLaunchDescription(_need(entity, "file"), launch_arguments=given)
    if namespace is None:
        return [action]
    return [actions.GroupAction([actions.PushRosNamespace(namespace), action])]


def _timer(entity: Entity, _context: Context) -> list[Any]:
    entity.used.update(f"<{one.tag}>" for one in entity.children)
    return [
        actions.TimerAction(
            period=_need(entity, "period"), actions=[_Text(one) for one in entity.children]
        )
    ]


_MAKERS: dict[str, Callable[[Entity, Context], list[Any]]] = {
    "arg": _argument,
    "let": lambda one, _: [
        actions.SetLaunchConfiguration(_need(one, "name"), _need(one, "value"))
    ],
    "set_env": lambda one, _: [
        actions.SetEnvironmentVariable(_need(one, "name"), _need(one, "value"))
    ],
    "env": lambda one, _: [
        actions.SetEnvironmentVariable(_need(one, "name"), _need(one, "value"))
    ],
    "unset_env": lambda one, _: [actions.UnsetEnvironmentVariable(_need(one, "name"))],
    "append_env": lambda one, _: [
        actions.AppendEnvironmentVariable(
            _need(one, "name"),
            _need(one, "value"),
            prepend=str(one.get("prepend")).lower() == "true",
            separator=_optional(one, "separator") or ":",
        )
    ],
    "node": _node,
    "executable": lambda one, _: [
        actions.ExecuteProcess(
            cmd=command_line(_need(one, "cmd")), name=_optional(one, "name"), **_common(one)
        )
    ],
    "node_container": _container,
    "composable_node": _component,
    "load_composable_node": _load,
    "group": _group,
    "include": _include,
    "timer": _timer,
    "ros_timer": _timer,
    "push_ros_namespace": lambda one, _: [actions.PushRosNamespace(_need(one, "namespace"))],
    "set_parameter": lambda one, _: [
        actions.SetParameter(_need(one, "name"), substitutions.ParameterValue(_need(one, "value")))
    ],
    "param": _global_parameter,
    "set_parameters_from_file": lambda one, _: [
        actions.SetParametersFromFile(_need(one, "filename"))
    ],
    "set_remap": lambda one, _: [actions.SetRemap(_need(one, "from"), _need(one, "to"))],
    "remap": lambda one, _: [actions.SetRemap(_need(one, "from"), _need(one, "to"))],
    "set_use_sim_time": lambda one, _: [actions.SetUseSimTime(_need(one, "value"))],
    "log": lambda one, _: [actions.LogInfo(msg=one.get("message"), level=one.get("level"))],
    "set_ros_log_dir": lambda _one, _: [actions.Action()],
}


def read(path: str) -> tuple[str, str]:
    """Return a launch file's text and kind: py, xml or yaml.

    Raises:
        FailedError: if it cannot be read.
    """
    try:
        text = Path(path).read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise FailedError(f"{path} cannot be read: {error}") from None
    if path.endswith(".py"):
        return text, "py"
    return text, (
        "xml" if path.endswith((".xml", ".launch")) or text.lstrip().startswith("<") else "yaml"
    )
