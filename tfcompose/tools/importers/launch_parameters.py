"""Conversion of launch's texts, parameters and conditions to values of a robot file.

The conversion keeps references to launch arguments where a robot file can have them. This module
runs in the process that reads launch files (``launch_process``), with ROS's own ``launch``.
"""

from __future__ import annotations

import ast
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import launch
import yaml
from launch.conditions import IfCondition, LaunchConfigurationEquals, UnlessCondition
from launch.frontend.parse_substitution import parse_substitution
from launch.substitutions import (
    LaunchConfiguration,
    PathJoinSubstitution,
    PythonExpression,
    TextSubstitution,
)
from launch.utilities.type_utils import normalize_typed_substitution, perform_typed_substitution
from launch_ros.parameter_descriptions import Parameter, ParameterFile, ParameterValue

from tfcompose.tools.importers.launch_objects import arguments_of, class_name, reason
from tfcompose.tools.importers.launch_records import (
    PACKAGE,
    FailedError,
    conjunction,
    display_text,
    file_text,
    relative,
    scalar_of,
    with_files,
    with_package,
)
from tfcompose.tools.importers.texts import (
    Argument,
    Part,
    Text,
    argument_of,
    arguments_in,
    files_in,
    fill,
)

if TYPE_CHECKING:
    from tfcompose.tools.importers.launch_context import RecordingContext


# Texts


def text_of(value: Any, context: RecordingContext) -> str:
    """Return the text that launch makes from a value, a substitution or a list of both.

    Raises:
        FailedError: if launch cannot evaluate it.
    """
    if isinstance(value, launch.Substitution):
        return str(evaluate(value.perform, context))
    if isinstance(value, (list, tuple)):
        return "".join(text_of(item, context) for item in value)
    return with_package(os.fspath(value)) if isinstance(value, os.PathLike) else str(value)


def evaluate(evaluate: Callable[[Any], Any], context: RecordingContext) -> Any:
    """Call a function of launch or another package with the context, and return its result.

    Raises:
        FailedError: with the message of any exception.
    """
    try:
        return evaluate(context)
    except FailedError:
        raise
    except Exception as error:  # noqa: BLE001 (launch's, or another package's)
        raise FailedError(reason(error)) from None


def optional_text(value: Any, context: RecordingContext) -> str | None:
    """Return the text of a value, or None."""
    return None if value is None else text_of(value, context)


def keep_text(value: Any, context: RecordingContext, *, typed: bool = False) -> str:
    """Return a value's text, with references to launch arguments.

    ``typed``: an argument may keep a value such as 10.0, if the argument is the whole text.
    """
    return with_package(with_files(Text.of(_parts(value, context, typed=typed))))


def _parts(value: Any, context: RecordingContext, *, typed: bool) -> list[Part]:
    if type(value) is LaunchConfiguration:
        name = text_of(value.variable_name, context)
        configured = context.launch_configurations.get(name)
        if isinstance(configured, str) and context.argument_kept(name, configured, typed=typed):
            return [Argument(name, configured)]
        return [text_of(value, context)]
    if isinstance(value, PathJoinSubstitution):
        return _join([_parts(part, context, typed=typed) for part in value.substitutions])
    if isinstance(value, (list, tuple)):
        return [part for item in value for part in _parts(item, context, typed=typed)]
    return [text_of(value, context)]


def _join(paths: Iterable[list[Part]]) -> list[Part]:
    """Join the parts of paths as ``os.path.join`` does."""
    path: list[Part] = []
    for parts in paths:
        before, added = str(Text.of(path)), str(Text.of(parts))
        if added.startswith("/"):
            path = []
        elif before and not before.endswith("/"):
            path.append("/")
        path += parts if added else []  # an empty argument adds no part
    return path


def is_true(value: Any, context: RecordingContext) -> bool:
    """Return the truth value that launch reads from a text.

    Raises:
        FailedError: if launch reads the text neither as true nor as false.
    """
    if isinstance(value, bool):
        return value
    text = text_of(value, context).strip().lower()
    if text in {"true", "1"}:
        return True
    if text in {"false", "0"}:
        return False
    raise FailedError(f"{text!r} is neither true nor false")


def describe(value: Any) -> str:
    """Return a readable text for a value and its substitutions."""
    if isinstance(value, (list, tuple)):
        return " ".join(map(describe, value))
    if not isinstance(value, launch.Substitution):
        return str(value)
    described = _DESCRIBED.get(class_name(value))
    return described(arguments_of(value)) if described else str(value.describe())


def _operands(arguments: Mapping[str, Any]) -> list[Any]:
    return (
        list(arguments["args"]) if "args" in arguments else [arguments["left"], arguments["right"]]
    )


def _describe_all(arguments: Mapping[str, Any]) -> str:
    return " and ".join(map(describe, _operands(arguments)))


def _describe_any(arguments: Mapping[str, Any]) -> str:
    return " or ".join(map(describe, _operands(arguments)))


def _describe_equality(arguments: Mapping[str, Any], sign: str) -> str:
    left, right = (describe(arguments[side]) or repr("") for side in ("left", "right"))
    return f"{left} {sign} {right}"


#: Functions that return a readable text for a substitution, by class name.
_DESCRIBED: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "TextSubstitution": lambda arguments: str(arguments["text"]),
    "LaunchConfiguration": lambda arguments: describe(arguments["variable_name"]),
    "PathJoinSubstitution": lambda arguments: "/".join(map(describe, arguments["substitutions"])),
    "PythonExpression": lambda arguments: " ".join(describe(arguments["expression"]).split()),
    "FindPackage": lambda arguments: describe(arguments["package"]),
    "FindPackageShare": lambda arguments: describe(arguments["package"]),
    "FindPackagePrefix": lambda arguments: describe(arguments["package"]),
    "NotSubstitution": lambda arguments: f"not {describe(arguments['value'])}",
    "EqualsSubstitution": lambda arguments: _describe_equality(arguments, "=="),
    "NotEqualsSubstitution": lambda arguments: _describe_equality(arguments, "!="),
    "AndSubstitution": _describe_all,
    "AllSubstitution": _describe_all,
    "OrSubstitution": _describe_any,
    "AnySubstitution": _describe_any,
}


# Parameters

_KINDS: dict[Any, str] = {bool: "bool", int: "int", float: "float", str: "string"}


def parameters_of(declared: Any, context: RecordingContext, place: Any) -> list[Any]:
    """Return parameters as mappings and names of files, in order.

    Report values that cannot be resolved.
    """
    read: list[Any] = []
    for params in declared or ():
        try:
            if isinstance(params, Mapping):
                read.append(dict(_flat(params, context, "", place)))
            elif isinstance(params, Parameter):
                made_of = arguments_of(params)
                read.append({text_of(made_of["name"], context): _describe(made_of, context)})
            else:
                read.append(_parameter_file(params, context, place))
        except FailedError as error:
            context.todo(place, f"parameters: {error}")
    return read


def _parameter_file(params: Any, context: RecordingContext, place: Any) -> str:
    """Return the path of a parameter file.

    If launch substitutes texts in the file, return a placeholder path for the file that launch
    would write.

    Raises:
        FailedError: if a substitution cannot be resolved, or the file cannot be read.
    """
    is_described = isinstance(params, ParameterFile)
    arguments = arguments_of(params) if is_described else {"param_file": params}
    file = display_text(with_package(text_of(arguments["param_file"], context)))
    if file.startswith(PACKAGE) or not is_true(arguments.get("allow_substs") or False, context):
        return file
    source = file_text(file)
    if "$(" not in source:
        return file
    parts = evaluate(lambda _: parse_substitution(source), context)
    return file_of_text(file, source, text_of(parts, context), place, context)


def file_of_text(file: str, source: str, text: str, place: Any, context: RecordingContext) -> str:
    """Return a placeholder path for the file that launch writes after substitutions.

    Raises:
        FailedError: if it contains the output of a command.
    """
    if files_in(with_files(text)):
        raise FailedError(f"{relative(file)} takes what a command makes of a file")
    unknown = set(re.findall(rf"{PACKAGE}\w+", text)) - set(re.findall(rf"{PACKAGE}\w+", source))
    for name in sorted(unknown):
        context.todo(place, f"{relative(file)} names the package {name}, which was not found")
    return context.file_of_text(file, text)


def _flat(
    params: Mapping[Any, Any], context: RecordingContext, above: str, place: Any
) -> Iterator[tuple[str, Any]]:
    """Yield parameters by their full names; report those that cannot be resolved."""
    for key, value in params.items():
        name = f"{above}{text_of(key, context)}"
        if isinstance(value, Mapping):
            yield from _flat(value, context, f"{name}.", place)
            continue
        try:
            yield name, parameter_value(value, context)
        except FailedError as error:
            context.todo(place, f"the parameter {name}: {error}")


def parameter_value(value: Any, context: RecordingContext) -> Any:
    """Return a parameter's value as launch passes it to the node.

    launch parses the result of a substitution as YAML.

    Raises:
        FailedError: if launch would reject it.
    """
    if isinstance(value, ParameterValue):
        return _describe(arguments_of(value), context)
    if isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, launch.Substitution):
        return _read_as_yaml(value, context)
    if isinstance(value, (list, tuple)):
        if any(isinstance(item, launch.Substitution) for item in value):
            return _read_as_yaml(value, context)
        items = [parameter_value(item, context) for item in value]
        numbers = all(
            isinstance(item, (int, float)) and not isinstance(item, bool) for item in items
        )
        if numbers and any(isinstance(item, float) for item in items):
            return [float(item) for item in items]
        return items
    return text_of(value, context)


def _describe(made_of: Mapping[str, Any], context: RecordingContext) -> Any:
    """Return the value of launch's ``ParameterValue``, with its type."""
    value, value_type = made_of["value"], made_of.get("value_type")
    if isinstance(value, (int, float)) and value_type in (None, type(value)):
        return value
    if isinstance(value, list) and not any(
        isinstance(item, launch.Substitution) for item in value
    ):
        kind = (*getattr(value_type, "__args__", ()), None)[0]
        return [_item(item, kind, context) for item in value]
    if value_type is None:
        return _read_as_yaml(value, context)
    kept = _keep_with_type(value, value_type, context)
    if kept is not None:
        return kept
    if value_type is str:
        return with_files(text_of(value, context))
    return evaluate(lambda _: _type_by_launch(value, value_type, context), context)


def _item(item: Any, kind: Any, context: RecordingContext) -> Any:
    value_type = str if isinstance(item, str) else kind
    return _describe({"value": item, "value_type": value_type}, context)


def _type_by_launch(value: Any, value_type: Any, context: RecordingContext) -> Any:
    normalized = normalize_typed_substitution(value, value_type)
    return perform_typed_substitution(context, normalized, value_type)


def _keep_with_type(value: Any, value_type: Any, context: RecordingContext) -> str | None:
    """Return the text with references to arguments, if the arguments have the value's type."""
    text = _parameter_text(value, context)
    argument = argument_of(text)
    if argument and context.declared.get(argument.name) == _KINDS.get(value_type):
        return text
    names = arguments_in(text)
    if names and not argument and value_type is str:
        return text
    context.decided |= names
    return None


def _parameter_text(value: Any, context: RecordingContext) -> str:
    text = keep_text(value, context, typed=True)
    if argument_of(text) or not arguments_in(text):
        return text
    return keep_text(value, context)


def _read_as_yaml(value: Any, context: RecordingContext) -> Any:
    """Parse a text as YAML and return the value.

    References to arguments remain if the text then has the same value.
    """
    text = _parameter_text(value, context)
    if files_in(text):
        return fill(text, Argument)
    names = arguments_in(text)
    typed = _convert(str(text))
    if not names:
        return typed
    expected = scalar_of(str(text)) if argument_of(text) else str(text)
    if typed == expected and isinstance(typed, (bool, int, float, str)):
        return text
    context.decided |= names
    return typed


def _convert(text: str) -> Any:
    try:
        value = yaml.safe_load(text) if text else ""
    except yaml.YAMLError:
        raise FailedError(f"the value {text!r} of a parameter is not YAML") from None
    return value if isinstance(value, (bool, int, float, str, list)) else text


# Conditions


def when_of(condition: Any, context: RecordingContext) -> str | None:
    """Return a condition as an expression of a robot file, or None if that is impossible."""
    arguments = arguments_of(condition)
    if isinstance(condition, IfCondition):
        inner = expression_of(arguments["predicate_expression"], context)
        return inner and f"not ({inner})" if isinstance(condition, UnlessCondition) else inner
    if isinstance(condition, LaunchConfigurationEquals):
        sign = "!=" if class_name(condition) == "LaunchConfigurationNotEquals" else "=="
        name = describe(arguments["launch_configuration_name"])
        return _comparison(name, sign, arguments["expected_value"], context)
    return None


def describe_condition(condition: Any) -> str:
    """Return a readable text for a condition."""
    arguments = arguments_of(condition)
    if isinstance(condition, UnlessCondition):
        return f"not {describe(arguments['predicate_expression'])}"
    if isinstance(condition, IfCondition):
        return describe(arguments["predicate_expression"])
    if isinstance(condition, LaunchConfigurationEquals):
        sign = "!=" if class_name(condition) == "LaunchConfigurationNotEquals" else "=="
        name = describe(arguments["launch_configuration_name"])
        return f"{name} {sign} {describe(arguments['expected_value'])}"
    return "a condition"


def expression_of(value: Any, context: RecordingContext) -> str | None:
    """Return a truth value as an expression of a robot file, or None."""
    only = _alone(value)
    if not isinstance(only, launch.Substitution):
        return None
    arguments = arguments_of(only)
    match class_name(only):
        case "LaunchConfiguration":
            name = describe(arguments["variable_name"])
            return f"args.{name}" if context.declared.get(name) == "bool" else None
        case "NotSubstitution":
            inner = expression_of(arguments["value"], context)
            return inner and f"not ({inner})"
        case "AndSubstitution" | "AllSubstitution":
            return conjunction(
                (expression_of(arg, context) for arg in _operands(arguments)), " and "
            )
        case "OrSubstitution" | "AnySubstitution":
            return conjunction(
                (expression_of(arg, context) for arg in _operands(arguments)), " or "
            )
        case "EqualsSubstitution" | "NotEqualsSubstitution" as name:
            left = _alone(arguments["left"])
            if isinstance(left, LaunchConfiguration):
                sign = "==" if name == "EqualsSubstitution" else "!="
                return _comparison(describe(left), sign, arguments["right"], context)
        case "PythonExpression":
            return _of_python_expression(only, context)
    return None


def _alone(value: Any) -> Any:
    """Return the only item of a list, because launch's frontends put each value into a list."""
    only = value[0] if isinstance(value, (list, tuple)) and len(value) == 1 else value
    return str(only.text) if isinstance(only, TextSubstitution) else only


_SIGNS: dict[type[ast.cmpop], str] = {
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
}


def _of_python_expression(value: PythonExpression, context: RecordingContext) -> str | None:
    """Return a Python condition as an expression of a robot file, or None."""
    pieces = arguments_of(value)["expression"]
    text = _PythonText(context)
    for piece in pieces if isinstance(pieces, (list, tuple)) else [pieces]:
        if isinstance(piece, LaunchConfiguration):
            text.add_argument(describe(piece))
        elif isinstance(piece, (str, TextSubstitution)):
            text.add(piece if isinstance(piece, str) else str(piece.text))
        else:
            return None
    return text.expression()


class _PythonText:
    """Parses a Python condition in which names replace launch arguments."""

    def __init__(self, context: RecordingContext) -> None:
        self._context = context
        self._text = ""
        #: The arguments by the names that replace them. Inside quotes, such a name is part of a
        #: text.
        self._arguments: dict[str, str] = {}

    def add(self, text: str) -> None:
        self._text += text

    def add_argument(self, name: str) -> None:
        stands_for = f"argument_{len(self._arguments)}"
        self._arguments[stands_for] = name
        self._text += stands_for

    def expression(self) -> str | None:
        """Return the condition as an expression of a robot file, or None if that is impossible."""
        try:
            return self._of(ast.parse(self._text.strip(), mode="eval").body)
        except (SyntaxError, ValueError):
            return None

    def _of(self, node: ast.expr) -> str | None:
        match node:
            case ast.BoolOp(op=op, values=values):
                operator = " and " if isinstance(op, ast.And) else " or "
                return conjunction(map(self._of, values), operator)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                inner = self._of(operand)
                return inner and f"not ({inner})"
            case ast.Name(id=variable) if variable in self._arguments:
                name = self._arguments[variable]
                return f"args.{name}" if self._context.declared.get(name) == "bool" else None
            case ast.Compare(left=left, ops=[op], comparators=[ast.Constant(value=value)]) if (
                type(op) in _SIGNS
            ):
                return self._of_comparison(left, _SIGNS[type(op)], value)
        return None

    def _of_comparison(self, left: ast.expr, sign: str, value: Any) -> str | None:
        match left:
            case ast.Call(func=ast.Attribute(value=inner, attr="lower"), args=[]):
                left = inner
        is_equality = sign in {"==", "!="}
        match left:
            case ast.Constant(value=str(name)) if name in self._arguments and is_equality:
                if not isinstance(value, str):
                    return None
                return _comparison(self._arguments[name], sign, value, self._context)
            case ast.Name(id=variable) if variable in self._arguments:
                name = self._arguments[variable]
            case _:
                return None
        if isinstance(value, bool):
            if not is_equality:
                return None
            return _comparison(name, sign, str(value).lower(), self._context)
        is_known = self._context.declared.get(name) in {"int", "float"}
        return (
            f"args.{name} {sign} {value}" if isinstance(value, (int, float)) and is_known else None
        )


def _comparison(name: str, sign: str, value: Any, context: RecordingContext) -> str | None:
    kind, expected = context.declared.get(name), _alone(value)
    if kind is None or not isinstance(expected, str) or "'" in expected:
        return None
    if kind == "string":
        return f"args.{name} {sign} '{expected}'"
    typed = scalar_of(expected)
    if kind == "bool" and isinstance(typed, bool):
        return f"args.{name}" if typed is (sign == "==") else f"not args.{name}"
    is_number = isinstance(typed, (int, float)) and not isinstance(typed, bool)
    return f"args.{name} {sign} {expected}" if is_number and kind in {"int", "float"} else None
