"""Reader of launch files in ROS 1's XML, and of XML with only static transforms.

This reader does not need ROS. Elements and substitutions follow the documentation of roslaunch and
rosparam. Because ``$(eval …)`` contains Python, this module runs in the confined process that
reads launch files (``launch_process``).
"""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from tfcompose.compiler.urdf.read import Element, read_xml
from tfcompose.foundation.findings import RejectedError
from tfcompose.model.process_keys import launch_keywords
from tfcompose.tools.importers.launch_records import (
    IDS,
    PACKAGE,
    FailedError,
    LaunchRecording,
    file_text,
    of_command,
    relative,
    scalar_of,
    with_package,
)
from tfcompose.tools.importers.static_transforms import PROGRAM
from tfcompose.tools.importers.texts import (
    Argument,
    Part,
    Text,
    argument_of,
    arguments_in,
    words_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

#: Maximum depth of launch files that include each other.
_DEEPEST = 30
#: Attributes, elements and substitutions that only launch files of ROS 1 have. Each attribute is a
#: pair of its element and its name.
_ATTRIBUTES = frozenset({("node", "type"), ("param", "command"), ("param", "textfile")})
_ELEMENTS = frozenset({"rosparam", "machine", "test"})
_SUBSTITUTION = re.compile(r"\$\((arg|find|optenv|env|anon|dirname|eval)\b\s*([^)]*)\)")
_OF_ROS1 = re.compile(r"\$\((arg|find|optenv)\s")


class Ros1Recording(LaunchRecording):
    """The recording of a ROS 1 launch file, with the scope that its elements change."""

    def __init__(
        self, find: Callable[[str, str], str | None], *, every_branch: bool = False
    ) -> None:
        super().__init__(find, every_branch=every_branch)
        self.arguments: dict[str, str] = {}
        self.variables: dict[str, str] = {}
        self.namespace: str | None = None
        self.params: list[Any] = []
        self.remaps: list[tuple[str, str]] = []
        self.file = ""

    def scope(self) -> dict[str, Any]:
        """Return the state that a group restores at its end."""
        return {
            "variables": dict(self.variables),
            "namespace": self.namespace,
            "params": list(self.params),
            "remaps": list(self.remaps),
        }

    def restore(self, scope: dict[str, Any]) -> None:
        """Undo the changes of a group or an included file."""
        vars(self).update(scope)


def is_of_ros1(text: str, file: str) -> bool:
    """Return whether the text of a launch file is roslaunch's XML."""
    root = _launch_in(text, file)
    return root is not None and any(map(_says_ros1, _elements(root)))


def has_only_transforms(text: str, file: str) -> bool:
    """Return whether an XML launch file starts only static_transform_publishers."""
    root = _launch_in(text, file)
    return root is not None and bool(root.children) and all(map(_is_transform, root.children))


def _launch_in(text: str, file: str) -> Element | None:
    try:
        root = read_xml(text, file)
    except RejectedError:
        return None
    return root if root.tag == "launch" else None


def _is_transform(element: Element) -> bool:
    is_publisher = element.tag == "node" and element.attributes.get("exec") == PROGRAM
    has_more = any("$(" in value for value in element.attributes.values())
    return is_publisher and not has_more and not element.children


def _elements(element: Element) -> Iterator[Element]:
    yield element
    for child in element.children:
        yield from _elements(child)


def _says_ros1(element: Element) -> bool:
    tag, attributes = element.tag, element.attributes
    return (
        tag in _ELEMENTS
        or any((tag, name) in _ATTRIBUTES and "exec" not in attributes for name in attributes)
        or any(map(_OF_ROS1.search, attributes.values()))
    )


def read(file: str, recording: Ros1Recording) -> None:
    """Record the processes of a launch file.

    Raises:
        FailedError: if the file is not a launch file, or includes itself.
    """
    if recording.depth >= _DEEPEST:
        raise FailedError("launch files include each other")
    root = _root(file)
    before = recording.file
    recording.file, recording.depth = file, recording.depth + 1
    try:
        for child in root.children:
            _visit(child, recording)
    finally:
        recording.file, recording.depth = before, recording.depth - 1


def _root(file: str) -> Element:
    try:
        text = Path(file).read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise FailedError(f"{file} cannot be read: {error}") from None
    try:
        root = read_xml(text, file)
    except RejectedError as error:
        finding = error.findings[0]
        raise FailedError(finding.message, finding.span.line if finding.span else 0) from None
    if root.tag != "launch":
        raise FailedError(f"<{root.tag}> is not a launch file")
    return root


def _visit(element: Element, recording: Ros1Recording) -> None:
    """Record an element, if its condition is true."""
    recording.place = (recording.file, element.span.line)
    place = recording.place
    try:
        when, holds = _condition(element, recording)
    except FailedError as error:
        recording.todo(place, f"{_describe(element)}: {error}")
        return
    text = element.attributes.get("if") or f"not {element.attributes.get('unless')}"
    if holds is False and not recording.every_branch:
        recording.record("skipped", place, text=f"{_describe(element)} only if {text}")
        return
    conditions, whens = list(recording.conditions), list(recording.whens)
    if when:
        recording.whens.append(when)
    elif holds is not None and recording.every_branch:
        recording.todo(place, f"the condition of {_describe(element)}: {text}")
        recording.conditions.append(text if holds else f"{text}, which does not hold")
    try:
        _read_element(element, recording)
    except FailedError as error:
        recording.todo(place, f"{_describe(element)}: {error}")
    finally:
        recording.conditions, recording.whens = conditions, whens


def _condition(element: Element, recording: Ros1Recording) -> tuple[str | None, bool | None]:
    """Return an element's condition as an expression of a robot file, and its value.

    The expression is None if the robot file does not contain the condition. The value is None if
    the element has no condition.
    """
    name = "if" if "if" in element.attributes else "unless"
    if name not in element.attributes:
        return None, None
    text = _text(element.attributes[name], recording)
    argument = argument_of(text)
    if recording.every_branch and argument and recording.declared[argument.name] == "bool":
        expression = f"args.{argument.name}"
        return expression if name == "if" else f"not ({expression})", None
    recording.decided |= arguments_in(text)
    value = text.strip().lower()
    if value not in {"true", "1", "false", "0"}:
        raise FailedError(f"{str(text)!r} is neither true nor false")
    return None, (value in {"true", "1"}) is (name == "if")


def _describe(element: Element) -> str:
    attributes = element.attributes
    if element.tag == "node":
        return f"the node {attributes.get('pkg')}/{attributes.get('type')}"
    if element.tag == "include":
        return f"the included {attributes.get('file')}"
    return f"<{element.tag}>"


def _read_element(element: Element, recording: Ros1Recording) -> None:
    reader = _READERS.get(element.tag)
    if reader is None:
        raise FailedError("it is not known here")
    attributes = _Attributes(element, recording)
    reader(attributes, recording)
    if left := attributes.unread():
        recording.todo(attributes.place, f"<{element.tag}>: {', '.join(left)}")


class _Attributes:
    """The attributes of an element, with a record of the attributes that were read."""

    def __init__(self, element: Element, recording: Ros1Recording) -> None:
        self.element, self._recording = element, recording
        self.place = recording.place
        self._read = {"if", "unless", "doc", "clear_params", "pass_all_args"}
        self._inside: set[str] = set()

    def get(self, name: str) -> str | None:
        """Return the text of an attribute, with references to arguments, or None."""
        self._read.add(name)
        text = self.element.attributes.get(name)
        return None if text is None else _text(text, self._recording)

    def value(self, name: str) -> str | None:
        """Return the text of an attribute with the values of arguments, or None.

        The values of these arguments are then fixed in the robot file.
        """
        text = self.get(name)
        if text is None:
            return None
        self._recording.decided |= arguments_in(text)
        return str(text)

    def need(self, name: str) -> str:
        """Return the text of an attribute.

        Raises:
            FailedError: if the element does not have the attribute.
        """
        text = self.get(name)
        if text is None:
            raise FailedError(f"it has no {name}")
        return text

    def all(self, tag: str) -> list[_Attributes]:
        """Return the child elements with a tag."""
        self._inside.add(tag)
        return [
            _Attributes(child, self._recording)
            for child in self.element.children
            if child.tag == tag
        ]

    def unread(self) -> list[str]:
        """Return the attributes and child elements that were not read."""
        left = [name for name in self.element.attributes if name not in self._read]
        tags = (child.tag for child in self.element.children if child.tag not in self._inside)
        return [*left, *(f"<{tag}>" for tag in dict.fromkeys(tags))]


# Substitutions


def _text(text: str, recording: Ros1Recording) -> str:
    """Return a text after substitutions, with references to arguments where possible."""
    if text.startswith("$(eval ") and text.endswith(")"):
        return _evaluate(text[len("$(eval ") : -1], recording)
    parts: list[Part] = []
    position = 0
    for match in _SUBSTITUTION.finditer(text):
        parts += [text[position : match.start()], _substitute(match, recording)]
        position = match.end()
    return Text.of([*parts, text[position:]])


def _substitute(match: re.Match[str], recording: Ros1Recording) -> Part:
    kind, operands = match[1], match[2].split()
    name = operands[0] if operands else ""
    match kind:
        case "arg":
            value = _argument(name, recording)
            return Argument(name, value) if recording.argument_kept(name, value) else value
        case "find":
            return recording.find(name, recording.file) or f"{PACKAGE}{name}"
        case "dirname":
            return str(Path(recording.file).parent)
        case "anon":
            return name
        case "eval":
            raise FailedError(f"{match[0]} is only part of a value")
    value = recording.variables.get(name, os.environ.get(name, ""))
    if not value and kind == "optenv":
        return " ".join(operands[1:])
    if name not in recording.variables and name not in os.environ:
        raise FailedError(f"the environment variable {name} is not set")
    return value


def _argument(name: str, recording: Ros1Recording) -> str:
    if name not in recording.arguments:
        raise FailedError(f"the argument {name} has no value: give {name}:=…")
    return recording.arguments[name]


def _evaluate(expression: str, recording: Ros1Recording) -> str:
    """Return the result of a Python expression that contains arguments."""

    def argument(name: str) -> Any:
        recording.decided |= {name} & recording.declared.keys()
        return scalar_of(_argument(name, recording))

    used = set(re.findall(r"[A-Za-z_]\w*", expression)) & recording.arguments.keys()
    names = {**vars(math), **{name: argument(name) for name in used}}
    names |= {
        "arg": argument,
        "env": lambda name: os.environ[name],
        "optenv": lambda name, default="": os.environ.get(name, default),
        "find": lambda name: recording.find(name, recording.file) or f"{PACKAGE}{name}",
        "dirname": lambda: str(Path(recording.file).parent),
    }
    try:
        return str(eval(expression, {}, names))  # noqa: S307 (as roslaunch; this is confined)
    except FailedError:
        raise
    except Exception as error:  # noqa: BLE001 (any can come out of it)
        raise FailedError(
            f"the expression {expression}: {type(error).__name__}: {error}"
        ) from None


# Elements


def _arg(element: _Attributes, recording: Ros1Recording) -> None:
    name, default = str(element.need("name")), element.value("default")
    fixed = element.value("value")
    if fixed is not None:  # the value cannot be changed
        recording.declared.pop(name, None)
        recording.arguments[name] = fixed
        return
    value = recording.arguments.get(name, default)
    if value is None:
        raise FailedError(f"the argument {name} has no default: give {name}:=…")
    recording.arguments[name] = value
    if recording.depth > 1:
        return
    recording.declare(name, value)
    description = element.element.attributes.get("doc", "")
    what: dict[str, Any] = {
        "default": default,
        "value": value,
        "choices": [],
        "description": description,
    }
    recording.record("argument", element.place, name=name, variable="", **what)


def _param(element: _Attributes, recording: Ros1Recording) -> None:
    name, value = _parameter(element)
    recording.params.append({name: value})


def _parameter(element: _Attributes) -> tuple[str, Any]:
    """Return a parameter's name and value.

    The value is the attribute itself, the text of a file, or the placeholder for a command's
    output.
    """
    name, kind = str(element.need("name")), element.value("type")
    if (command := element.value("command")) is not None:
        return name, of_command(list(map(str, words_of(command))), command)
    if (file := element.value("textfile")) is not None:
        return name, file_text(with_package(file))
    text = element.need("value")
    if kind in {"str", "string"}:
        return name, text
    argument = argument_of(text)
    if argument and scalar_of(argument.value) == _convert(argument.value):
        return name, text
    return name, text if arguments_in(text) and not argument else _convert(str(text))


def _convert(text: str) -> Any:
    try:
        value = yaml.safe_load(text) if text else ""
    except yaml.YAMLError:
        return text
    return value if isinstance(value, (bool, int, float, str)) else text


def _node(element: _Attributes, recording: Ros1Recording) -> None:
    args, executable = element.get("args"), element.get("type")
    is_of_ros1 = executable is not None
    params = [dict([_parameter(param)]) for param in element.all("param")]
    remaps = [(str(rule.need("from")), rule.need("to")) for rule in element.all("remap")]
    env = {str(variable.need("name")): variable.need("value") for variable in element.all("env")}
    recording.record(
        "node",
        element.place,
        id=next(IDS),
        package=str(element.need("pkg")),
        executable=str(executable if is_of_ros1 else element.need("exec")),
        name=element.value("name"),
        label=None,
        namespace=_below(recording.namespace, element.value("ns")),
        argv=[] if args is None else words_of(args),
        params=[*recording.params, *params],
        remap=[*recording.remaps, *remaps],
        env={**recording.variables, **env},
        period=0.0,
        after={},
        ros1=is_of_ros1,
        **_keywords(element),
    )


def _keywords(element: _Attributes) -> dict[str, Any]:
    """Return the settings of a node, with launch's keywords."""
    keywords: dict[str, Any] = {}
    for keyword in launch_keywords("text", "switch", "number", "output"):
        text = element.value(keyword.attribute or keyword.name)
        if text is None:
            continue
        match keyword.kind:
            case "switch":
                keywords[keyword.name] = text.lower() in {"true", "1"}
            case "number":
                keywords[keyword.name] = _number(text)
            case _:
                keywords[keyword.name] = text
    for keyword in launch_keywords("shutdown"):
        keywords[keyword.name] = (element.value(keyword.ros1) or "").lower() == "true"
    return keywords


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise FailedError(f"{text!r} is not a number") from None


def _group(element: _Attributes, recording: Ros1Recording) -> None:
    scope = recording.scope()
    recording.namespace = _below(recording.namespace, element.value("ns"))
    try:
        for child in element.element.children:
            element.all(child.tag)
            _visit(child, recording)
    finally:
        recording.restore(scope)


def _include(element: _Attributes, recording: Ros1Recording) -> None:
    path = with_package(str(element.need("file")))
    recording.decided |= arguments_in(element.get("file"))
    passes_all = element.element.attributes.get("pass_all_args", "").lower() == "true"
    kept: dict[str, str] = {}
    for arg in element.all("arg"):
        value = arg.get("value")
        kept[str(arg.need("name"))] = arg.need("default") if value is None else value
    namespace = _below(recording.namespace, element.value("ns"))
    if path.startswith(PACKAGE):
        where = {"file": path, "namespace": namespace, "env": dict(recording.variables)}
        recording.record("include", element.place, args=kept, period=0.0, after={}, **where)
        return
    scope, arguments = recording.scope(), recording.arguments
    declared = recording.declared
    recording.arguments = dict(arguments) if passes_all else {}
    recording.arguments |= {name: str(value) for name, value in kept.items()}
    recording.declared = {
        name: kind
        for name, kind in declared.items()
        if _is_itself(name, kept.get(name)) or (passes_all and name not in kept)
    }
    recording.decided |= arguments_in(kept) - recording.declared.keys()
    recording.namespace = namespace
    try:
        read(path, recording)
    except FailedError as error:
        raise FailedError(f"{relative(path)}: {error}") from None
    finally:
        recording.restore(scope)
        recording.arguments, recording.declared = arguments, declared


def _is_itself(name: str, text: str | None) -> bool:
    argument = argument_of(text)
    return argument is not None and argument.name == name


def _remap(element: _Attributes, recording: Ros1Recording) -> None:
    recording.remaps.append((str(element.need("from")), element.need("to")))


def _env(element: _Attributes, recording: Ros1Recording) -> None:
    recording.variables[str(element.need("name"))] = str(element.value("value") or "")


def _below(base: str | None, namespace: str | None) -> str | None:
    """Join two namespaces to an absolute namespace; return None if both are None."""
    if base is None and namespace is None:
        return None
    if namespace is not None and namespace.startswith("/"):
        base = None
    names = [part.strip("/") for part in (base, namespace) if part and part.strip("/")]
    return "/" + "/".join(names)


_READERS: dict[str, Callable[[_Attributes, Ros1Recording], None]] = {
    "arg": _arg,
    "param": _param,
    "node": _node,
    "group": _group,
    "include": _include,
    "remap": _remap,
    "env": _env,
}
