"""A stand-in for launch's conditions.

Whether they hold, and what they are as ``when`` of a robot file.

How each behaves was read in launch's sources. Launch files import it in a process of its own
(``launch_process``).
"""

# ruff: noqa: D101, D102, ARG002, FBT002 - the classes, methods and their parameters are launch's

from __future__ import annotations

import ast
import re
from typing import Any

from tfcompose.tools.importers.launch_substitutions import (
    BEGIN,
    END,
    AndSubstitution,
    Context,
    EqualsSubstitution,
    LaunchConfigAsBool,
    LaunchConfiguration,
    NotEqualsSubstitution,
    NotSubstitution,
    OrSubstitution,
    PythonExpression,
    TextSubstitution,
    place,
    plain,
    scalar_of,
    text_of,
    truth,
)


class Condition:
    def __init__(self, predicate: Any = True, *args: Any, **kwargs: Any) -> None:
        self.at, self.predicate, self.args, self.kwargs = place(), predicate, args, kwargs

    def evaluate(self, context: Context) -> bool:
        """Return whether the condition holds."""
        return (
            bool(self.predicate(context))
            if callable(self.predicate)
            else truth(self.predicate, context)
        )

    def describe(self) -> str:
        """Return it for people."""
        return plain([self.predicate])

    def when(self, context: Context) -> str | None:
        """Return it as an expression of a robot file, or None where it cannot be one."""
        return None


class IfCondition(Condition):
    def __init__(self, predicate_expression: Any) -> None:
        super().__init__(predicate_expression)

    def when(self, context: Context) -> str | None:
        return expression_of(self.predicate, context)


class UnlessCondition(IfCondition):
    def evaluate(self, context: Context) -> bool:
        return not truth(self.predicate, context)

    def describe(self) -> str:
        return f"not {plain([self.predicate])}"

    def when(self, context: Context) -> str | None:
        inner = expression_of(self.predicate, context)
        return inner and f"not ({inner})"


class LaunchConfigurationEquals(Condition):
    def __init__(self, launch_configuration_name: Any, expected_value: Any) -> None:
        super().__init__(launch_configuration_name)
        self.expected = expected_value

    WORD = "=="

    def when(self, context: Context) -> str | None:
        return _comparison(plain([self.predicate]), self.WORD, self.expected, context)

    def evaluate(self, context: Context) -> bool:
        name = text_of(self.predicate, context)
        context.decided |= {name} & context.declared.keys()
        value = context.configurations.get(name)
        return value is None if self.expected is None else value == text_of(self.expected, context)

    def describe(self) -> str:
        return f"{plain([self.predicate])} == {plain([self.expected])}"


class LaunchConfigurationNotEquals(LaunchConfigurationEquals):
    WORD = "!="

    def evaluate(self, context: Context) -> bool:
        return not super().evaluate(context)

    def describe(self) -> str:
        return f"{plain([self.predicate])} != {plain([self.expected])}"


def expression_of(value: Any, context: Context) -> str | None:
    """Return a truth value as an expression of a robot file, or None."""
    one = _alone(value)
    if isinstance(one, (LaunchConfiguration, LaunchConfigAsBool)):
        name = plain([one.variable_name])
        return f"args.{name}" if context.declared.get(name) == "bool" else None
    if isinstance(one, NotSubstitution):
        inner = expression_of(one.args[0], context)
        return inner and f"not ({inner})"
    if isinstance(one, (AndSubstitution, OrSubstitution)):
        several = [expression_of(arg, context) for arg in one.args]
        word = " and " if isinstance(one, AndSubstitution) else " or "
        return word.join(f"({inner})" for inner in several) if all(several) else None
    if isinstance(one, EqualsSubstitution) and isinstance(
        left := _alone(one.args[0]), LaunchConfiguration
    ):
        word = "!=" if isinstance(one, NotEqualsSubstitution) else "=="
        return _comparison(plain([left.variable_name]), word, one.args[1], context)
    return _python_expression(one, context) if isinstance(one, PythonExpression) else None


def _alone(value: Any) -> Any:
    """Return the only one of a list, as the frontends write a value; a text as such."""
    one = value[0] if isinstance(value, (list, tuple)) and len(value) == 1 else value
    return str(one.text) if isinstance(one, TextSubstitution) else one


#: What stands for an argument in an expression: within quotes, and without.
_QUOTED, _BARE = "quoted_", "bare_"
_SIGNS: dict[type[ast.cmpop], str] = {
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
}


def _python_expression(given: PythonExpression, context: Context) -> str | None:
    """Return a Python condition as an expression of a robot file, or None."""
    pieces = (
        given.expression if isinstance(given.expression, (list, tuple)) else [given.expression]
    )
    text = ""
    for piece in pieces:
        if isinstance(piece, (LaunchConfiguration, LaunchConfigAsBool)):
            text += f"{BEGIN}{plain([piece.variable_name])}{END}"
        elif isinstance(piece, (str, TextSubstitution)):
            text += piece if isinstance(piece, str) else str(piece.text)
        else:
            return None
    text = re.sub(rf"(['\"]){BEGIN}(\w+){END}\1", rf"{_QUOTED}\2", text)
    text = re.sub(rf"{BEGIN}(\w+){END}", rf"{_BARE}\1", text)
    try:
        return _of_python(ast.parse(text.strip(), mode="eval").body, context)
    except (SyntaxError, ValueError):
        return None


def _of_python(node: ast.expr, context: Context) -> str | None:
    match node:
        case ast.BoolOp(op=op, values=values):
            several = [_of_python(one, context) for one in values]
            word = " and " if isinstance(op, ast.And) else " or "
            return word.join(f"({inner})" for inner in several) if all(several) else None
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            inner = _of_python(operand, context)
            return inner and f"not ({inner})"
        case ast.Name(id=word) if word.startswith(_BARE):
            name = word.removeprefix(_BARE)
            return f"args.{name}" if context.declared.get(name) == "bool" else None
        case ast.Compare(left=left, ops=[op], comparators=[ast.Constant(value=value)]) if (
            type(op) in _SIGNS
        ):
            return _python_comparison(left, _SIGNS[type(op)], value, context)
    return None


def _python_comparison(left: ast.expr, sign: str, value: Any, context: Context) -> str | None:
    match left:
        case ast.Call(func=ast.Attribute(value=ast.Name() as inner, attr="lower"), args=[]):
            left = inner
    if not isinstance(left, ast.Name):
        return None
    if left.id.startswith(_QUOTED) and isinstance(value, str) and sign in {"==", "!="}:
        return _comparison(left.id.removeprefix(_QUOTED), sign, value, context)
    name = left.id.removeprefix(_BARE)
    if left.id.startswith(_BARE) and isinstance(value, bool) and sign in {"==", "!="}:
        return _comparison(name, sign, str(value).lower(), context)
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    known = context.declared.get(name) in {"int", "float"}
    return (
        f"args.{name} {sign} {value}"
        if left.id.startswith(_BARE) and is_number and known
        else None
    )


def _comparison(name: str, word: str, expected: Any, context: Context) -> str | None:
    kind, expected = context.declared.get(name), _alone(expected)
    if kind is None or not isinstance(expected, str) or "'" in expected:
        return None
    if kind == "string":
        return f"args.{name} {word} '{expected}'"
    typed = scalar_of(expected)
    if kind == "bool" and isinstance(typed, bool):
        return f"args.{name}" if typed is (word == "==") else f"not args.{name}"
    is_number = isinstance(typed, (int, float)) and not isinstance(typed, bool)
    return f"args.{name} {word} {expected}" if is_number and kind in {"int", "float"} else None


def evaluate_condition_expression(context: Context, expression: Any) -> bool:
    """Return what launch takes an expression for."""
    return truth(expression, context)
