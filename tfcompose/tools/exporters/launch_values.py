"""Arguments, texts and conditions that an exported launch file evaluates when it starts.

A plan contains fixed values from its build. A launch file can keep an argument of the robot file
if the argument affects only conditions and texts of processes.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.spec.language.expressions import constant, parse

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.plan import PlanProcess
    from tfcompose.spec.language.expressions import Expression
    from tfcompose.tools.exporters.launch_texts import Text


_EQUALITY = {ast.Eq: "==", ast.NotEq: "!="}
_ORDER: dict[type[ast.cmpop], str] = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">="}
_FLIPPED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.Gt,
    ast.LtE: ast.GtE,
    ast.Gt: ast.Lt,
    ast.GtE: ast.LtE,
}
_TRUTHS = ("true", "false")


@dataclass(frozen=True, slots=True)
class LaunchArgument:
    """A launch argument."""

    name: str
    #: The type of the argument: bool, int, float or string.
    kind: str
    default: str
    choices: tuple[str, ...] = ()
    description: str = ""
    #: The environment variable that sets the default, if any.
    env: str | None = None


@dataclass(frozen=True, slots=True)
class TruthValue:
    """The value of a bool argument, or a constant."""

    #: The argument's name, or ``true`` or ``false``.
    text: str

    @property
    def is_constant(self) -> bool:
        """Whether the text is ``true`` or ``false`` instead of an argument."""
        return self.text in _TRUTHS


@dataclass(frozen=True, slots=True)
class Negation:
    """True if the condition is false."""

    condition: Condition


@dataclass(frozen=True, slots=True)
class Junction:
    """Two conditions, joined by an operator."""

    #: ``and`` or ``or``.
    operator: str
    left: Condition
    right: Condition


@dataclass(frozen=True, slots=True)
class Comparison:
    """An argument's value, compared with a constant."""

    name: str
    #: ``==``, ``!=``, ``<``, ``<=``, ``>`` or ``>=``.
    sign: str
    value: str

    @property
    def is_of_order(self) -> bool:
        """Whether the sign is an inequality of numbers, such as ``<``."""
        return self.sign in _ORDER.values()


Condition = TruthValue | Negation | Junction | Comparison


@dataclass(frozen=True, slots=True)
class LaunchValues:
    """Values that a launch file evaluates when it starts."""

    arguments: tuple[LaunchArgument, ...] = ()
    #: Conditions of processes as expressions of the robot file, by process.
    conditions: Mapping[str, str] = field(default_factory=dict)
    #: Texts by process and then by key: ``args.0``, ``env.NAME``, ``params.NAME`` or
    #: ``remap.NAME``.
    texts: Mapping[str, Mapping[str, Text]] = field(default_factory=dict)
    #: Processes that exist only for other values of the arguments. Their parameter files are next
    #: to the launch file.
    more: tuple[PlanProcess, ...] = ()

    @property
    def kinds(self) -> dict[str, str]:
        """The types of the arguments, by name."""
        return {argument.name: argument.kind for argument in self.arguments}


def condition_of(expression: str, kinds: Mapping[str, str]) -> Condition:
    """Return launch's condition for an expression of a robot file.

    Raises:
        ValueError: if launch cannot express the condition.
    """
    parsed = parse(expression)
    return _condition(parsed.body, parsed, kinds)


def _condition(node: ast.expr, expression: Expression, kinds: Mapping[str, str]) -> Condition:
    match node:
        case ast.BoolOp(op=op, values=[first, *rest]):
            operator = "and" if isinstance(op, ast.And) else "or"
            condition = _condition(first, expression, kinds)
            for value in rest:
                condition = Junction(operator, condition, _condition(value, expression, kinds))
            return condition
        case ast.UnaryOp(op=ast.Not(), operand=inner):
            return Negation(_condition(inner, expression, kinds))
        case ast.Compare(left=left, ops=[op], comparators=[right]):
            return _comparison(expression.operand(left), op, expression.operand(right), kinds)
    operand = expression.operand(node)
    name = operand.removeprefix("args.")
    if operand not in _TRUTHS and (kinds.get(name) != "bool" or name == operand):
        raise ValueError(expression.text)
    return TruthValue(name)


def _comparison(left: str, op: ast.cmpop, right: str, kinds: Mapping[str, str]) -> Condition:
    if not left.startswith("args."):
        left, right, op = right, left, _FLIPPED.get(type(op), type(op))()
    name, value = left.removeprefix("args."), constant(right)
    if name not in kinds or name == left or value is None:
        raise ValueError(left)
    if type(op) in _EQUALITY:
        return Comparison(name, _EQUALITY[type(op)], value)
    if type(op) not in _ORDER or kinds[name] not in {"int", "float"}:
        raise ValueError(left)
    return Comparison(name, _ORDER[type(op)], value)
