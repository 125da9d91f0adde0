"""``${…}`` in strings: arithmetic and conditions with quantities, vars, args and pi.

The syntax follows Python for ``and or not if else``, comparisons, ``+ - * /``, brackets and calls.
An operand is one of these::

    NUMBER [UNIT] | NAME | TEXT | "true" | "false" | "env" "(" NAME ["," DEFAULT] ")"

TEXT is in single or double quotes, without escapes. DEFAULT is literal text up to the bracket. The
items of a loop are a list, or a single ``range(first, end)``. No Python code is run. Only the
environment variables that ``env`` names are read.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.findings import did_you_mean
from tfcompose.foundation.units import (
    ANGLE,
    NUMBER,
    UNITS,
    Dimension,
    Quantity,
    UnitError,
    dimension_name,
    in_unit,
    quantity,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

Value = Quantity | str | bool

LONGEST_QUOTED = 60
DEEPEST = 20

_NAME = r"[A-Za-z_][A-Za-z0-9_]*(?:\.[A-Za-z_][A-Za-z0-9_]*)*"
_CONNECTIVES = r"(?:and|or|not|if|else)(?![\w.])"
#: Pattern of units with a slash, with optional spaces around it.
_FRACTIONS = "|".join(rf"{unit.replace('/', ' */ *')}\b" for unit in UNITS if unit.count("/") == 1)
_QUANTITY = re.compile(
    r"(?P<number>(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?)"
    rf"(?:\s*(?P<unit>(?!{_CONNECTIVES})(?:{_FRACTIONS}|{_NAME})))?"
)
_SYMBOL = re.compile(
    rf"\s*(?:(?P<operand>{_QUANTITY.pattern}|env\s*\([^()]*\)|'[^']*'|\"[^\"]*\""
    rf"|(?!{_CONNECTIVES}){_NAME})"
    rf"|(?P<sign>{_CONNECTIVES}|[=!<>]=|[-+*/()<>,]))"
)
_ENV = re.compile(
    r"env\s*\(\s*(?P<name>[A-Za-z_][A-Za-z0-9_]*)\s*(?:,\s*(?P<default>.*?)\s*)?\)", re.DOTALL
)


LONGEST_EXPRESSION = 500
LONGEST_TEXT = 100_000

_HOLE = re.compile(r"\$\{([^{}]*)\}")
IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


#: A ``${…}`` inside the brackets of another. It is computed first.
_NESTED = re.compile(r"(\$\{\s*(?:frame|file)\([^(){}]*)\$\{([^{}]*)\}")
_DEFERRED = re.compile(r"\$\{\s*(frame|file)\s*\(")
_DEFERRED_EXAMPLES = {"frame": "base_link", "file": "maps/a.yaml"}

_WHERE = {
    "frame": "it is allowed in run, params, remap and env",
    "file": "it is allowed in run, params, remap and env, and in args and params of a xacro part",
}

#: Words with a fixed meaning in expressions, and that meaning.
RESERVED = {
    "pi": "a number already",
    "params_file": "reserved for the arguments of a process",
    "build_dir": "reserved for the arguments of a process",
    **dict.fromkeys(("and", "or", "not", "if", "else", "true", "false"), "a word of conditions"),
}
#: Advice for a path that only a process knows.
A_FILE = "${file(PATH)} is the path of a file beside this one"


class ExpressionError(ValueError):
    """An expression cannot be computed; ``advice`` tells what to write instead."""

    def __init__(self, message: str, advice: str = "") -> None:
        super().__init__(message)
        self.advice = advice


class EnvironmentText(str):
    """The value of an environment variable.

    Inside other text it is text. Alone, it is the number or boolean that it contains.
    """

    __slots__ = ()

    @property
    def value(self) -> Value:
        """The number or boolean in the text, otherwise the text."""
        if self in {"true", "false"}:
            return self == "true"
        try:
            return quantity(self)
        except UnitError:
            return str(self)


def _fill_around(text: str, lookup: Callable[[str], Value], later: re.Pattern[str]) -> str:
    """Return ``text`` with expressions computed, except matches of ``later``."""
    parts, end = [], 0
    for match in later.finditer(text):
        parts += [insertable_text(fill(text[end : match.start()], lookup, later)), match[0]]
        end = match.end()
    return "".join([*parts, insertable_text(fill(text[end:], lookup, later))])


def fill(text: str, lookup: Callable[[str], Value], later: re.Pattern[str] | None = None) -> Value:
    """Return ``text`` with each ``${…}`` computed. If it is a single ``${…}``, the type is kept.

    Matches of ``later`` are left unchanged. ``lookup`` is as in ``evaluate``.

    Raises:
        ExpressionError: if an expression is malformed, too long or cannot be computed.
    """
    while later and (nested := _NESTED.search(text)):
        text = (
            text[: nested.start()]
            + nested[1]
            + insertable_text(evaluate(nested[2], lookup))
            + text[nested.end() :]
        )
    if later and later.search(text):
        return _fill_around(text, lookup, later)
    deferred = _DEFERRED.search(text)
    if deferred:
        what = f"{deferred[1]}(…)"
        example = f"${{{deferred[1]}({_DEFERRED_EXAMPLES[deferred[1]]})}}"
        if later and later.fullmatch(example):
            raise ExpressionError(f"{what} must be the whole expression, with one name", example)
        raise ExpressionError(f"${{{what}}} is for processes only", _WHERE[deferred[1]])
    match = _HOLE.fullmatch(text.strip())
    if match:
        value = evaluate(match[1], lookup)
        return value.value if isinstance(value, EnvironmentText) else value
    if "${" in _HOLE.sub("", text):
        raise ExpressionError("${ without its }", "close the expression: ${name}")
    parts, length, end = [], 0, 0
    for hole in _HOLE.finditer(text):
        parts += [text[end : hole.start()], insertable_text(evaluate(hole[1], lookup))]
        end = hole.end()
        length += len(parts[-1])
        if length > LONGEST_TEXT:
            raise ExpressionError(f"a string of more than {LONGEST_TEXT:,} characters")
    return "".join([*parts, text[end:]])


def evaluate(text: str, lookup: Callable[[str], Value]) -> Value:
    """Return the value of an expression.

    ``lookup`` returns the value of a variable or of ``env(NAME, default)``.

    Raises:
        ExpressionError: if the expression is malformed, too long or cannot be computed.
    """
    expression = parse(text)
    try:
        value = _Evaluation(expression, lookup).value(expression.body)
        is_finite = not isinstance(value, Quantity) or math.isfinite(value.value)
    except OverflowError:  # Python's integers are unbounded
        is_finite = False
    except RecursionError:
        raise ExpressionError(f"{expression} is too deep") from None
    if not is_finite:
        raise ExpressionError(f"{expression} is not finite")
    return value


def items(text: str, lookup: Callable[[str], Value]) -> list[Value]:
    """Return the integers of a loop ``${range(end)}`` or ``${range(first, end)}``.

    Raises:
        ExpressionError: if the text has another form, or the ends are not integers or more than
            ``MOST_ITEMS`` apart.
    """
    match = _HOLE.fullmatch(text.strip())
    call = _RANGE.fullmatch(match[1]) if match else None
    if not call:
        advice = "a list, or ${range(3)}, or ${range(1, 4)}"
        if match:
            evaluate(match[1], lookup)  # reports an unknown name
            advice = f"${{range({match[1].strip()})}}"
        raise ExpressionError(f"{text} is not a list of items", advice)
    ends = [evaluate(end, lookup) for end in call[1].split(",")]
    numbers = [
        int(end.value)
        for end in ends
        if isinstance(end, Quantity) and end == Quantity(int(end.value))
    ]
    if len(numbers) != len(ends) or len(ends) not in {1, 2}:
        raise ExpressionError(
            f"{text} needs whole numbers", "${range(3)} is 0, 1, 2, and ${range(1, 4)} is 1, 2, 3"
        )
    first, end = (0, *numbers)[-2:]
    if end - first > MOST_ITEMS:
        raise ExpressionError(f"{text} has {end - first:,} items; at most {MOST_ITEMS:,}")
    return [Quantity(number) for number in range(first, end)]


_RANGE = re.compile(r"\s*range\s*\((.*)\)\s*")
MOST_ITEMS = 1000


def environment_in(text: str) -> tuple[str, str | None] | None:
    """Return variable and default of ``env(NAME, default)``, None for other text."""
    match = _ENV.fullmatch(text)
    if not match:
        return None
    default = match["default"]
    if (
        default is not None
        and len(default) > 1
        and default[0] == default[-1]
        and default[0] in "'\""
    ):
        default = default[1:-1]
    return match["name"], default


def names_in(text: str) -> list[str]:
    """Return the names in the text's expressions, in order.

    These are names of variables, units and functions.
    """
    return [
        name for hole in _HOLE.findall(text) for name in _DOTTED.findall(_QUOTED.sub("", hole))
    ]


_DOTTED = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(?:\.[A-Za-z_][A-Za-z0-9_]*)*")
_QUOTED = re.compile(r"'[^']*'|\"[^\"]*\"")


def insertable_text(value: Value) -> str:
    """Return a value as it is inserted into text. A quantity is its number in SI units."""
    if isinstance(value, str):
        return str(value)
    if isinstance(value, bool):
        return str(value).lower()
    number = value.value
    return str(int(number)) if number == int(number) and abs(number) < _EXACT else repr(number)


_EXACT = 2**53
"""Up to here every whole number is a float."""


@dataclass(frozen=True, slots=True)
class Expression:
    """An expression as Python's syntax tree, in which a name stands for each operand.

    Expressions that differ only in units, texts and names have the same tree.
    """

    text: str
    body: ast.expr
    operands: Mapping[str, str]

    def __str__(self) -> str:
        return _quote(self.text)

    def operand(self, node: ast.expr) -> str:
        """Return the operand that a node stands for, "" for other nodes.

        An operand is a number with its unit, a text or a name.
        """
        return self.operands[node.id] if isinstance(node, ast.Name) else ""

    def first(self, node: ast.expr) -> str:
        """Return the first operand or function below a node."""
        names = [below for below in ast.walk(node) if isinstance(below, ast.Name)]
        return self.operands[min(names, key=lambda name: name.col_offset).id]


@lru_cache(maxsize=1024)
def parse(text: str) -> Expression:
    """Return the syntax tree of an expression without computing it.

    Raises:
        ExpressionError: if the expression is malformed or too long.
    """
    if len(text) > LONGEST_EXPRESSION:
        raise ExpressionError(
            f"an expression of {len(text)} characters; at most {LONGEST_EXPRESSION} are read"
        )
    symbols, operands = _with_names(text)
    depths = accumulate({"(": 1, ")": -1}.get(symbol, 0) for symbol in symbols)
    if max(depths, default=0) > DEEPEST:
        raise ExpressionError(f"brackets are nested more than {DEEPEST} deep")
    python = " ".join(symbols)
    try:
        return Expression(text, ast.parse(python, mode="eval").body, operands)
    except SyntaxError as error:
        symbol = python[(error.offset or 1) - 1 :].split(" ")[0]
        is_open = bool(symbols) and symbols[-1] not in {*operands, ")"}
        raise _refusal(text, symbols, "" if is_open else operands.get(symbol, symbol)) from None
    except (MemoryError, RecursionError):
        raise ExpressionError(f"{_quote(text)} is too deep") from None


def _with_names(text: str) -> tuple[list[str], dict[str, str]]:
    """Return the symbols of an expression, with a name for each operand, and the operands."""
    symbols: list[str] = []
    operands: dict[str, str] = {}
    end = 0
    while text[end:].strip():
        match = _SYMBOL.match(text, end)
        if not match:
            sign = text[end:].strip()[0]
            raise ExpressionError(f"{sign!r} has no meaning in {_quote(text)}")
        symbol = match["sign"] or f"_{len(operands)}"
        if match["operand"]:
            operands[symbol] = match["operand"]
        symbols.append(symbol)
        end = match.end()
    return symbols, operands


def _refusal(text: str, symbols: Sequence[str], symbol: str) -> ExpressionError:
    """Return why Python stops at a symbol; an empty symbol means the end."""
    quoted = _quote(text)
    if not symbols:
        return ExpressionError("an empty expression", "name a variable: ${name}")
    if not symbol:
        return ExpressionError(f"{quoted} ends too early")
    if symbols.count("(") > symbols.count(")"):
        return ExpressionError(f"a bracket is not closed in {quoted}")
    if symbols.count("if") > symbols.count("else"):
        return ExpressionError(f"if without else in {quoted}", "${A if CONDITION else B}")
    return ExpressionError(f"{symbol!r} is not expected in {quoted}")


def _quote(text: str) -> str:
    if len(text) >= LONGEST_QUOTED:
        text = f"{text[:LONGEST_QUOTED]}…"
    return f"${{{text}}}"


@dataclass(frozen=True, slots=True)
class _Evaluation:
    """Computes the nodes of an expression."""

    expression: Expression
    lookup: Callable[[str], Value]

    def value(self, node: ast.expr) -> Value:
        """Return the value of a node, after computing all nodes below it in order."""
        match node:
            case ast.IfExp():
                value, is_chosen = self.value(node.body), self.condition(node.test)
                alternative = self.value(node.orelse)
                return value if is_chosen else alternative
            case ast.BoolOp():
                conditions = [self.condition(condition) for condition in node.values]
                return all(conditions) if isinstance(node.op, ast.And) else any(conditions)
            case ast.UnaryOp(op=ast.Not()):
                return not self.condition(node.operand)
            case ast.UnaryOp():
                number = self.number(node.operand)
                if isinstance(node.op, ast.USub):
                    return Quantity(-number.value, number.dimension)
                return number
            case ast.Compare(ops=[operator], comparators=[right]):
                return self._compare(node.left, _COMPARISONS[type(operator)], right)
            case ast.BinOp():
                return self._compute(node.op, self.number(node.left), self.number(node.right))
            case ast.Call(func=ast.Name(), args=[argument]):
                return self._call(self.expression.operand(node.func), argument)
            case ast.Name():
                return self._operand(self.expression.operand(node))
        raise ExpressionError(f"{self.expression} cannot be computed")

    def condition(self, node: ast.expr) -> bool:
        """Return the value of a node that must be a boolean."""
        value = _value_of_word(self.value(node))
        if isinstance(value, bool):
            return value
        raise self._refusal(node, value, "true or false")

    def number(self, node: ast.expr) -> Quantity:
        """Return the value of a node that must be a number."""
        return self._as_number(node, _value_of_word(self.value(node)))

    def _as_number(self, node: ast.expr, value: Value) -> Quantity:
        if isinstance(value, Quantity):
            return value
        raise self._refusal(node, value, "a number")

    def _refusal(self, node: ast.expr, value: Value, needed: str) -> ExpressionError:
        first = self.expression.first(node)
        return ExpressionError(f"{first} is {_kind(value)}, and {self.expression} needs {needed}")

    def _compare(self, left: ast.expr, sign: _Comparison, right: ast.expr) -> bool:
        a, b = _value_of_word(self.value(left)), _value_of_word(self.value(right))
        is_equality = sign in {operator.eq, operator.ne}
        if is_equality and not (isinstance(a, Quantity) and isinstance(b, Quantity)):
            if _kind(a) != _kind(b):
                kinds = f"{_kind(a)} and {_kind(b)}"
                raise ExpressionError(f"{kinds} cannot be compared in {self.expression}")
            return sign(a, b)
        x, y = self._as_number(left, a), self._as_number(right, b)
        self._same_dimension(x, y, "compared")
        return sign(x.value, y.value)

    def _same_dimension(self, a: Quantity, b: Quantity, what: str) -> None:
        if NUMBER not in {a.dimension, b.dimension} and a.dimension != b.dimension:
            names = f"{dimension_name(a.dimension)} and {dimension_name(b.dimension)}"
            raise ExpressionError(f"{names} cannot be {what} in {self.expression}")

    def _compute(self, sign: ast.operator, a: Quantity, b: Quantity) -> Quantity:
        if isinstance(sign, (ast.Mult, ast.Div)):
            return self._multiply(a, b, 1 if isinstance(sign, ast.Mult) else -1)
        self._same_dimension(a, b, "added")
        value = a.value + b.value if isinstance(sign, ast.Add) else a.value - b.value
        return Quantity(value, a.dimension if a.dimension != NUMBER else b.dimension)

    def _multiply(self, a: Quantity, b: Quantity, power: int) -> Quantity:
        if power < 0 and b.value == 0:
            raise ExpressionError(f"{self.expression} divides by zero")
        value = a.value * b.value if power > 0 else a.value / b.value
        m, kg, s, rad = (x + power * y for x, y in zip(a.dimension, b.dimension, strict=True))
        return Quantity(value, (m, kg, s, rad))

    def _operand(self, operand: str) -> Value:
        if match := _QUANTITY.fullmatch(operand):
            value, unit = _number(match["number"]), match["unit"]
            try:
                return in_unit(value, "".join(unit.split())) if unit else Quantity(value)
            except UnitError as error:
                raise ExpressionError(str(error), error.advice) from None
        if operand[0] in "'\"":
            return operand[1:-1]
        if operand in {"true", "false"}:
            return operand == "true"
        if operand.endswith(")") and environment_in(operand) is None:
            raise ExpressionError(
                f"{operand} does not name a variable", "for example ${env(ROBOT, rover)}"
            )
        return Quantity(math.pi) if operand == "pi" else self.lookup(operand)

    def _call(self, name: str, node: ast.expr) -> Quantity:
        if name in RESERVED:
            raise ExpressionError(f"{name} is {RESERVED[name]}", A_FILE)
        if name not in _FUNCTIONS:
            functions = ", ".join(_FUNCTIONS)
            raise ExpressionError(
                f"unknown function {name}",
                did_you_mean(name, _FUNCTIONS, f"functions: {functions}"),
            )
        argument = self.number(node)
        accepted, compute, gives = _FUNCTIONS[name]
        if name == "sqrt" and all(power % 2 == 0 for power in argument.dimension):
            m, kg, s, rad = argument.dimension
            accepted, gives = (argument.dimension,), (m // 2, kg // 2, s // 2, rad // 2)
        if argument.dimension not in accepted:
            raise ExpressionError(f"{name} of a {dimension_name(argument.dimension)}")
        try:
            return Quantity(compute(argument.value), gives)
        except ValueError:
            raise ExpressionError(f"{name}({argument.value!r}) is not defined") from None


def constant(operand: str) -> str | None:
    """Return a literal in the form of the command line, None for names and units."""
    if operand[:1] in {"'", '"'}:
        return operand[1:-1]
    if (match := _QUANTITY.fullmatch(operand)) and not match["unit"]:
        return str(_number(match["number"]))
    return operand if operand in {"true", "false"} else None


def _number(text: str) -> float:
    return int(text) if text.isdigit() else float(text)


def _value_of_word(value: Value) -> Value:
    return value.value if isinstance(value, EnvironmentText) else value


def _kind(value: Value) -> str:
    return (
        "true or false"
        if isinstance(value, bool)
        else "a number"
        if isinstance(value, Quantity)
        else "a text"
    )


_Comparison = Callable[[Any, Any], bool]
_COMPARISONS: dict[type[ast.cmpop], _Comparison] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_FUNCTIONS: dict[str, tuple[tuple[Dimension, ...], Callable[[float], float], Dimension]] = {
    "sin": ((NUMBER, ANGLE), math.sin, NUMBER),
    "cos": ((NUMBER, ANGLE), math.cos, NUMBER),
    "tan": ((NUMBER, ANGLE), math.tan, NUMBER),
    "sqrt": ((NUMBER,), math.sqrt, NUMBER),
    "radians": ((NUMBER,), math.radians, ANGLE),
    "degrees": ((NUMBER, ANGLE), math.degrees, NUMBER),
}
