"""Python launch files."""

from __future__ import annotations

import io
import math
import re
import tokenize
from functools import singledispatchmethod
from keyword import iskeyword
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.numbers import number
from tfcompose.tools.exporters.code import CodeBlock, call, items, keyword
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
from tfcompose.tools.exporters.launch_functions import HELPERS, IMPORTS
from tfcompose.tools.exporters.launch_texts import (
    ArgumentValue,
    FileContent,
    FilePath,
    TypedText,
    VariableValue,
)
from tfcompose.tools.exporters.launch_values import (
    Comparison,
    Junction,
    LaunchArgument,
    Negation,
    TruthValue,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from tfcompose.model.process_keys import Setting
    from tfcompose.tools.exporters.launch_texts import Text
    from tfcompose.tools.exporters.launch_values import Condition, LaunchValues


def write_python(robot: str, folder: str, values: LaunchValues, actions: Sequence[Action]) -> str:
    """Return a launch file in Python.

    ``folder`` is the plan's folder: absolute, or relative to the launch file.
    """
    return _module(robot, folder, *_PythonWriter(actions).body(values))


def _module(robot: str, folder: str, body: str, helpers: str) -> str:
    """Return the launch file: its imports, the helper functions that it calls, and its actions."""
    used = set(re.findall(r"\w+", helpers + body))
    lines = [f'"""The TF tree and the processes of {robot}, for ros2 launch."""', ""]
    lines += ["import sys"] if "sys" in used else []
    lines += ["from pathlib import Path", ""]
    if "get_package_share_directory" in used:
        lines.append("from ament_index_python.packages import get_package_share_directory")
    lines.append("from launch import LaunchDescription")
    for module, names in IMPORTS.items():
        used_names = [name for name in names if name in used]
        imported = CodeBlock(f"from {module} import ", tuple(used_names), "")
        if len(str(imported)) > 100:  # noqa: PLR2004 (as long as lines of code are)
            imported = CodeBlock(f"from {module} import (", tuple(used_names), ")")
        lines += imported.lines() if used_names else []
    lines += [""] if used & {"BUILD", "HERE"} else []
    if "BUILD" in used:
        place = f"(Path(__file__).resolve().parent / {folder!r}).resolve()"
        lines.append(f"BUILD = Path({folder!r})" if folder.startswith("/") else f"BUILD = {place}")
    lines += ["HERE = Path(__file__).resolve().parent"] if "HERE" in used else []
    begin = "\n\ndef generate_launch_description():\n"
    return _in_double_quotes("\n".join(lines) + f"\n{helpers}{begin}{body}")


class _PythonWriter:
    """Writes actions as Python. An action that another action waits for gets a variable."""

    def __init__(self, actions: Sequence[Action]) -> None:
        self._actions = actions
        self._variables: dict[str, str] = {}
        awaited = {
            inner.awaited
            for action in actions
            for inner in nested(action)
            if isinstance(inner, AfterExit)
        }
        for process in dict.fromkeys(action.process for action in actions):
            if process in awaited:
                self._variables[process] = _variable_name(process, self._variables.values())
        self._named: dict[str, CodeBlock] = {}

    def body(self, values: LaunchValues) -> tuple[str, str]:
        """Return the body of ``generate_launch_description``, and the functions that it calls."""
        parts = [_argument(argument) for argument in values.arguments]
        parts += [self._code(action) for action in self._actions]
        body = "".join(
            f"{line}\n" for name, action in self._named.items() for line in _assign(name, action)
        )
        listed = "".join(f"{line}\n" for part in parts for line in part.lines(" " * 8, ","))
        body += f"    return LaunchDescription([\n{listed}    ])\n"
        helpers = "".join(
            f"\n{text}" for name, text in HELPERS.items() if re.search(rf"\b{name}\(", body)
        )
        return body, helpers

    def _code(self, action: Action) -> CodeBlock:
        """Return an action's code, or its variable if another action waits for the action."""
        code = self._write(action)
        variable = self._variables.get(action.process)
        if variable is None or isinstance(action, Delayed | AfterExit):
            return code
        self._named[variable] = code
        return CodeBlock(variable, (), "")

    @singledispatchmethod
    def _write(self, action: Action) -> CodeBlock:
        raise TypeError(f"no Python for {action!r}")

    @_write.register
    def _(self, action: SetVariable) -> CodeBlock:
        return call("SetEnvironmentVariable", repr(action.name), repr(action.value))

    @_write.register
    def _(self, action: FixedEdge) -> CodeBlock:
        ends = (repr(action.name), repr(action.parent), repr(action.child))
        pose = (
            CodeBlock("(", tuple(map(number, part)), ")")
            for part in (action.xyz, action.quat_xyzw)
        )
        namespace = [f"namespace={action.namespace!r}"] if action.namespace else []
        return call("fixed", *ends, *pose, *namespace, *_remappings(action.remap))

    @_write.register
    def _(self, action: StartNode) -> CodeBlock:
        parts = list(_node_keywords(action))
        if action.components is not None:
            components = map(_component, action.components)
            loaded = items(components, "composable_node_descriptions")
            return call("ComposableNodeContainer", *parts, loaded)
        if action.lifecycle_state:
            active = f"active={action.lifecycle_state == 'active'}"
            return call("*managed", call("LifecycleNode", *parts), active)
        return call("Node", *parts)

    @_write.register
    def _(self, action: LoadComponents) -> CodeBlock:
        return call(
            "LoadComposableNodes",
            f"target_container={action.container!r}",
            items(map(_component, action.components), "composable_node_descriptions"),
            *_condition(action.condition),
        )

    @_write.register
    def _(self, action: StartCommand) -> CodeBlock:
        return call(
            "ExecuteProcess",
            items(map(_text, action.argv), "cmd"),
            f"name={action.process!r}",
            *_settings(action.settings),
            *_condition(action.condition),
        )

    @_write.register
    def _(self, action: StartFromPlan) -> CodeBlock:
        settings = _settings(action.settings)
        return call("process", repr(action.process), *settings, *_condition(action.condition))

    @_write.register
    def _(self, action: Include) -> CodeBlock:
        settings = [
            *(
                call("SetEnvironmentVariable", repr(name), _text(value))
                for name, value in action.env.items()
            ),
            *([call("PushRosNamespace", repr(action.namespace))] if action.namespace else []),
            *(call("SetRemap", repr(old), _text(new)) for old, new in action.remap.items()),
            *([call("SetParameter", "'use_sim_time'", "True")] if action.use_sim_time else []),
        ]
        return call(
            "included",
            repr(action.package),
            repr(action.file),
            items(f"({name!r}, {_text(value)})" for name, value in action.arguments),
            items(settings),
            *_condition(action.condition),
        )

    @_write.register
    def _(self, action: Delayed) -> CodeBlock:
        actions = items([self._code(action.action)], "actions")
        return call("TimerAction", f"period={action.delay_s!r}", actions)

    @_write.register
    def _(self, action: AfterExit) -> CodeBlock:
        target = f"target_action={self._variables[action.awaited]}"
        started = items([self._code(action.action)], "on_exit")
        return call("RegisterEventHandler", call("OnProcessExit", target, started))


def _assign(name: str, action: CodeBlock) -> Iterator[str]:
    return CodeBlock(f"{name} = {action.begin}", action.parts, action.end).lines("    ")


def _argument(argument: LaunchArgument) -> CodeBlock:
    """Return the code that declares a launch argument."""
    default: CodeBlock | str = repr(argument.default)
    if argument.env:
        otherwise = f"default_value={argument.default!r}"
        default = call("EnvironmentVariable", repr(argument.env), otherwise)
    parts: list[CodeBlock | str] = [repr(argument.name), f"default_value={default}"]
    parts += [items(map(repr, argument.choices), "choices")] if argument.choices else []
    parts += [f"description={argument.description!r}"] if argument.description else []
    return call("DeclareLaunchArgument", *parts)


def _node_keywords(node: StartNode) -> Iterator[CodeBlock | str]:
    """Yield the keywords of a node."""
    if node.package:
        yield f"package={node.package!r}"
        yield f"executable={node.executable!r}"
    yield f"name={node.name!r}"
    if node.namespace:
        yield f"namespace={node.namespace!r}"
    if node.exec_name:
        yield f"exec_name={node.exec_name!r}"
    yield from _remappings(node.remap)
    if node.arguments:
        yield items(map(_text, node.arguments), "arguments")
    if node.ros_arguments:
        yield items(map(_text, node.ros_arguments), "ros_arguments")
    parameters: list[CodeBlock | str] = []
    parameters += [_path(node.params_file)] if node.params_file else []
    parameters += [_mapping(node.params)] if node.params else []
    if parameters:
        yield items(parameters, "parameters")
    yield from _settings(node.settings)
    yield from _condition(node.condition)


def _component(component: LoadedComponent) -> CodeBlock:
    """Return the code that describes a component."""
    params = [items([_mapping(component.params)], "parameters")] if component.params else []
    return call(
        "ComposableNode",
        f"package={component.package!r}",
        f"plugin={component.plugin!r}",
        f"name={component.name!r}",
        f"namespace={component.namespace!r}",
        *_remappings(component.remap),
        *params,
        *_settings(component.settings),
        *_condition(component.condition),
    )


def _remappings(remap: Mapping[str, Text]) -> Iterator[CodeBlock]:
    if remap:
        yield items((f"({old!r}, {_text(new)})" for old, new in remap.items()), "remappings")


def _settings(settings: Sequence[Setting]) -> Iterator[CodeBlock | str]:
    for setting in settings:
        if setting.name == "on_exit":
            yield keyword("on_exit", "Shutdown()")
        else:
            yield keyword(setting.name, _value(setting.value))


def _value(value: Any) -> CodeBlock | str:
    """Return the code of a setting's or parameter's value."""
    if isinstance(value, TypedText):
        return _typed(value)
    if isinstance(value, FileContent):
        return "description()"
    if isinstance(value, tuple):
        return _text(value)
    if isinstance(value, list):
        return items(map(_value, value))
    if isinstance(value, dict):
        return _mapping(value)
    if isinstance(value, float) and not math.isfinite(value):
        return f'float("{value}")'
    return repr(value)


def _mapping(values: Mapping[str, Any]) -> CodeBlock:
    """Return the code of a dict."""
    pairs: list[str | CodeBlock] = []
    for key, value in values.items():
        code = _value(value)
        if isinstance(code, str):
            pairs.append(f"{key!r}: {code}")
        else:
            pairs.append(CodeBlock(f"{key!r}: {code.begin}", code.parts, code.end))
    return CodeBlock("{", tuple(pairs), "}")


def _text(text: Text) -> CodeBlock | str:
    """Return the code of a text, with substitutions for values that only launch knows."""
    parts = list(map(_part, text)) or ["''"]
    if len(parts) == 1:
        return parts[0]
    if any(isinstance(part, CodeBlock) for part in parts):
        return items(parts)
    return " + ".join(map(str, parts))


def _typed(value: TypedText) -> CodeBlock | str:
    """Return the code of a parameter's value, with a type unless the value is plain text."""
    text = _text(value.text)
    if not any(isinstance(part, ArgumentValue | VariableValue) for part in value.text):
        return text
    return call("ParameterValue", text, f"value_type={value.type}")


def _part(part: str | FilePath | ArgumentValue | VariableValue) -> CodeBlock | str:
    if isinstance(part, str):
        return repr(part)
    if isinstance(part, FilePath):
        return _path(part)
    if isinstance(part, ArgumentValue):
        return call("LaunchConfiguration", repr(part.name))
    default = [] if part.default is None else [f"default_value={part.default!r}"]
    return call("EnvironmentVariable", repr(part.name), *default)


def _path(path: FilePath) -> str:
    folder = "HERE" if path.is_next_to_launch_file else "BUILD"
    return f"str({folder} / {path.path!r})" if path.path else f"str({folder})"


def _condition(condition: Condition | None) -> Iterator[CodeBlock | str]:
    """Yield the keyword of a condition."""
    if isinstance(condition, Negation):
        yield keyword("condition", call("UnlessCondition", _truth(condition.condition)))
    elif condition is not None:
        yield keyword("condition", call("IfCondition", _truth(condition)))


def _truth(condition: Condition) -> CodeBlock | str:
    if isinstance(condition, Junction):
        name = "AndSubstitution" if condition.operator == "and" else "OrSubstitution"
        return call(name, _truth(condition.left), _truth(condition.right))
    if isinstance(condition, Negation):
        return call("NotSubstitution", _truth(condition.condition))
    if isinstance(condition, TruthValue):
        if condition.is_constant:
            return repr(condition.text)
        return call("LaunchConfiguration", repr(condition.text))
    return _comparison(condition)


def _comparison(comparison: Comparison) -> CodeBlock:
    configuration = call("LaunchConfiguration", repr(comparison.name))
    if comparison.is_of_order:
        rest = repr(f" {comparison.sign} {comparison.value}")
        return call("PythonExpression", items([configuration, rest]))
    name = "EqualsSubstitution" if comparison.sign == "==" else "NotEqualsSubstitution"
    return call(name, configuration, repr(comparison.value))


def _variable_name(name: str, names_in_use: Collection[str]) -> str:
    plain = re.sub(r"\W", "_", name)
    plain = plain if plain.isidentifier() and not iskeyword(plain) else f"process_{plain}"
    while plain in names_in_use:
        plain += "_"
    return plain


def _in_double_quotes(text: str) -> str:
    """Return the source code with double quotes around all strings that contain none."""
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
