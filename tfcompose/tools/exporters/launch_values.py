"""Values that an exported launch file decides at its start: arguments, environment, conditions.

A plan has the values of its build. A launch file can keep the arguments that only decide whether
processes start and which texts they get.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from functools import reduce
from typing import TYPE_CHECKING

from tfcompose.spec.language.expressions import constant, parse
from tfcompose.tools.exporters.code import CodeBlock, call, items

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.plan import PlanProcess
    from tfcompose.spec.language.expressions import Expression

#: launch's substitutions for the signs of expressions; others are left to Python.
_EQUALITY = {ast.Eq: "EqualsSubstitution", ast.NotEq: "NotEqualsSubstitution"}
_ORDER: dict[type[ast.cmpop], str] = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">="}
_FLIPPED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.Gt,
    ast.LtE: ast.GtE,
    ast.Gt: ast.Lt,
    ast.GtE: ast.LtE,
}
_TYPES = {"bool": "bool", "int": "int", "float": "float", "string": "str"}
_TRUTHS = ("true", "false")


@dataclass(frozen=True, slots=True)
class LaunchArgument:
    """A launch argument."""

    name: str
    #: bool, int, float or string.
    kind: str
    default: str
    choices: tuple[str, ...] = ()
    description: str = ""
    #: An environment variable that gives the default.
    env: str | None = None

    def code(self) -> CodeBlock:
        """Return the code that declares it."""
        default: CodeBlock | str = repr(self.default)
        if self.env:
            default = call(
                "EnvironmentVariable", repr(self.env), f"default_value={self.default!r}"
            )
        parts: list[CodeBlock | str] = [repr(self.name), f"default_value={default}"]
        parts += [items(map(repr, self.choices), "choices")] if self.choices else []
        parts += [f"description={self.description!r}"] if self.description else []
        return call("DeclareLaunchArgument", *parts)


@dataclass(frozen=True, slots=True)
class ArgumentValue:
    """The value of an argument, as a part of a text or as all of it."""

    name: str
    kind: str


@dataclass(frozen=True, slots=True)
class VariableValue:
    """The value of an environment variable, or its default."""

    name: str
    default: str | None


#: A text with what it inserts, in order.
Text = tuple[str | ArgumentValue | VariableValue, ...]


@dataclass(frozen=True, slots=True)
class LaunchValues:
    """Values that a launch file decides at its start."""

    arguments: tuple[LaunchArgument, ...] = ()
    #: Expressions, by process.
    conditions: Mapping[str, str] = field(default_factory=dict)
    #: Texts by process and then by place: ``args.0``, ``env.NAME``, ``params.NAME`` or
    #: ``remap.NAME``.
    texts: Mapping[str, Mapping[str, Text]] = field(default_factory=dict)
    #: Processes that exist only for other values of the arguments. Their parameter files are next
    #: to the launch file.
    more: tuple[PlanProcess, ...] = ()

    @property
    def kinds(self) -> dict[str, str]:
        """The arguments' kinds, by name."""
        return {argument.name: argument.kind for argument in self.arguments}


def text_code(text: Text) -> CodeBlock | str:
    """Return the substitutions for a text."""
    parts = [_part(part) for part in text]
    return parts[0] if len(parts) == 1 else items(parts)


def parameter_code(text: Text) -> CodeBlock | str:
    """Return the substitutions for a parameter's value, with its type."""
    only, *rest = text
    kind = _TYPES[only.kind] if not rest and isinstance(only, ArgumentValue) else "str"
    return call("ParameterValue", text_code(text), f"value_type={kind}")


def _part(part: str | ArgumentValue | VariableValue) -> CodeBlock | str:
    if isinstance(part, str):
        return repr(part)
    if isinstance(part, ArgumentValue):
        return call("LaunchConfiguration", repr(part.name))
    default = [] if part.default is None else [f"default_value={part.default!r}"]
    return call("EnvironmentVariable", repr(part.name), *default)


def condition_code(expression: str, kinds: Mapping[str, str]) -> CodeBlock:
    """Return launch's condition for an expression of a robot file.

    Raises:
        ValueError: if launch has none.
    """
    parsed = parse(expression)
    match parsed.body:
        case ast.UnaryOp(op=ast.Not(), operand=inner):
            return call("UnlessCondition", _truth(inner, parsed, kinds))
    return call("IfCondition", _truth(parsed.body, parsed, kinds))


def _truth(node: ast.expr, expression: Expression, kinds: Mapping[str, str]) -> CodeBlock | str:
    match node:
        case ast.BoolOp(op=op, values=values):
            name = "AndSubstitution" if isinstance(op, ast.And) else "OrSubstitution"
            conditions = [_truth(value, expression, kinds) for value in values]
            return reduce(lambda left, right: call(name, left, right), conditions)
        case ast.UnaryOp(op=ast.Not(), operand=inner):
            return call("NotSubstitution", _truth(inner, expression, kinds))
        case ast.Compare(left=left, ops=[op], comparators=[right]):
            return _comparison(expression.operand(left), op, expression.operand(right), kinds)
    operand = expression.operand(node)
    if operand in _TRUTHS:
        return repr(operand)
    name = operand.removeprefix("args.")
    if kinds.get(name) != "bool" or name == operand:
        raise ValueError(expression.text)
    return call("LaunchConfiguration", repr(name))


def _comparison(left: str, op: ast.cmpop, right: str, kinds: Mapping[str, str]) -> CodeBlock:
    if not left.startswith("args."):
        left, right, op = right, left, _FLIPPED.get(type(op), type(op))()
    name, value = left.removeprefix("args."), constant(right)
    if name not in kinds or name == left or value is None:
        raise ValueError(left)
    configuration = call("LaunchConfiguration", repr(name))
    if type(op) in _EQUALITY:
        return call(_EQUALITY[type(op)], configuration, repr(value))
    if type(op) not in _ORDER or kinds[name] not in {"int", "float"}:
        raise ValueError(left)
    return call("PythonExpression", items([configuration, repr(f" {_ORDER[type(op)]} {value}")]))
