"""``${…}`` in strings: arithmetic and conditions with quantities, vars, args and pi.

No Python is run, and of the environment only what ``env`` names is read. The grammar::

    choice     = either ["if" either "else" choice]
    either     = both {"or" both}
    both       = negation {"and" negation}
    negation   = "not" negation | comparison
    comparison = sum [("==" | "!=" | "<" | "<=" | ">" | ">=") sum]
    sum        = product {("+" | "-") product}
    product    = sign {("*" | "/") sign}
    sign       = ["+" | "-"] value
    value      = NUMBER [UNIT] | NAME | TEXT | "true" | "false" | NAME "(" choice ")"
               | "(" choice ")" | "env" "(" NAME ["," DEFAULT] ")"

TEXT is in single or double quotes. DEFAULT is a text up to the bracket, as it stands there. The
items of a loop are a list, or one ``range(sum [, sum])``.
"""

from __future__ import annotations

import math
import operator
import re
from typing import TYPE_CHECKING, NoReturn

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
    from collections.abc import Callable

Value = Quantity | str | bool

LONGEST_QUOTED = 60
DEEPEST = 20

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?)"
    r"|(?P<env>env\s*\([^()]*\))"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*(?:\.[A-Za-z_][A-Za-z0-9_]*)*)"
    r"|(?P<text>'[^']*'|\"[^\"]*\")|(?P<sign>[=!<>]=|[-+*/()<>,]))"
)
_ENV = re.compile(
    r"env\s*\(\s*(?P<name>[A-Za-z_][A-Za-z0-9_]*)\s*(?:,\s*(?P<default>.*?)\s*)?\)", re.DOTALL
)


LONGEST_EXPRESSION = 500
LONGEST_TEXT = 100_000

_HOLE = re.compile(r"\$\{([^{}]*)\}")
IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


#: A ``${…}`` in the brackets of another one, which is computed first.
_NESTED = re.compile(r"(\$\{\s*(?:frame|file)\([^(){}]*)\$\{([^{}]*)\}")
_DEFERRED = re.compile(r"\$\{\s*(frame|file)\s*\(")
_DEFERRED_EXAMPLES = {"frame": "base_link", "file": "maps/a.yaml"}

_WHERE = {
    "frame": "it is allowed in run, params, remap and env",
    "file": "it is allowed in run, params, remap and env, and in args and params of a xacro part",
}

#: What an expression takes for something else.
RESERVED = {
    "pi": "a number already",
    "params_file": "for the arguments of a process",
    "build_dir": "for the arguments of a process",
    **dict.fromkeys(("and", "or", "not", "if", "else", "true", "false"), "a word of conditions"),
}
#: What may be meant by a path that only a process knows.
A_FILE = "${file(PATH)} is the path of a file beside this one"
_CONNECTIVES = ("and", "or", "not", "if", "else")


class ExpressionError(ValueError):
    """An expression cannot be computed; ``advice`` says what to write instead."""

    def __init__(self, message: str, advice: str = "") -> None:
        super().__init__(message)
        self.advice = advice


class EnvironmentText(str):
    """What a variable of the environment holds.

    A text among others, and alone the number or condition that it says.
    """

    __slots__ = ()

    @property
    def value(self) -> Value:
        """What it says."""
        if self in {"true", "false"}:
            return self == "true"
        try:
            return quantity(self)
        except UnitError:
            return str(self)


def _fill_around(text: str, lookup: Callable[[str], Value], later: re.Pattern[str]) -> str:
    """Return ``text`` with what is before, between and after the matches of ``later`` filled."""
    parts, end = [], 0
    for match in later.finditer(text):
        parts += [inserted(fill(text[end : match.start()], lookup, later)), match[0]]
        end = match.end()
    return "".join([*parts, inserted(fill(text[end:], lookup, later))])


def fill(text: str, lookup: Callable[[str], Value], later: re.Pattern[str] | None = None) -> Value:
    """Return ``text`` with each ``${…}`` computed; one that is the whole text keeps its type.

    What matches ``later`` is left as it is. ``lookup`` is as for ``evaluate``.

    Raises:
        ExpressionError: if an expression is malformed, too long or not computable.
    """
    while later and (nested := _NESTED.search(text)):
        text = (
            text[: nested.start()]
            + nested[1]
            + inserted(evaluate(nested[2], lookup))
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
        parts += [text[end : hole.start()], inserted(evaluate(hole[1], lookup))]
        end = hole.end()
        length += len(parts[-1])
        if length > LONGEST_TEXT:
            raise ExpressionError(f"a string of more than {LONGEST_TEXT:,} characters")
    return "".join([*parts, text[end:]])


def evaluate(text: str, lookup: Callable[[str], Value]) -> Value:
    """Return the value of an expression.

    ``lookup`` gives the value of a variable, and of ``env(NAME, default)``.

    Raises:
        ExpressionError: if it is malformed, too long or not computable.
    """
    if len(text) > LONGEST_EXPRESSION:
        raise ExpressionError(
            f"an expression of {len(text)} characters; at most {LONGEST_EXPRESSION} are read"
        )
    try:
        return Arithmetic(text, lookup).parse()
    except OverflowError:  # from whole numbers, which Python does not bound
        raise ExpressionError(f"${{{text[:LONGEST_QUOTED]}}} is not finite") from None


def items(text: str, lookup: Callable[[str], Value]) -> list[Value]:
    """Return the whole numbers of a loop ``${range(end)}`` or ``${range(first, end)}``.

    Raises:
        ExpressionError: if it is no such text, or its ends are no whole numbers, or more than
            ``MOST_ITEMS`` apart.
    """
    match = _HOLE.fullmatch(text.strip())
    call = _RANGE.fullmatch(match[1]) if match else None
    if not call:
        advice = "a list, or ${range(3)}, or ${range(1, 4)}"
        if match:
            evaluate(match[1], lookup)  # it may hold an unknown name
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
    """Return the variable and default of ``env(NAME, default)``, or None for other texts."""
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

    Variables, and also units and functions.
    """
    return [
        name for hole in _HOLE.findall(text) for name in _DOTTED.findall(_QUOTED.sub("", hole))
    ]


_DOTTED = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(?:\.[A-Za-z_][A-Za-z0-9_]*)*")
_QUOTED = re.compile(r"'[^']*'|\"[^\"]*\"")


def inserted(value: Value) -> str:
    """Return a value as it is written in a text: a quantity is its number, in SI units."""
    if isinstance(value, str):
        return str(value)
    if isinstance(value, bool):
        return str(value).lower()
    number = value.value
    return str(int(number)) if number == int(number) and abs(number) < _EXACT else repr(number)


_EXACT = 2**53
"""Up to here every whole number is a float."""


class Arithmetic:
    """One expression, read from left to right; ``parse`` is its value."""

    def __init__(self, text: str, lookup: Callable[[str], Value]) -> None:
        self.text = text
        self.quoted = text if len(text) < LONGEST_QUOTED else f"{text[:LONGEST_QUOTED]}…"
        self.lookup = lookup
        self.depth = 0
        self.tokens = self._tokens()
        self.index = 0

    def _tokens(self) -> list[tuple[str, str]]:
        tokens, at = [], 0
        while self.text[at:].strip():
            match = _TOKEN.match(self.text, at)
            if not match or not match.lastgroup:
                raise ExpressionError(
                    f"{self.text[at:].strip()[0]!r} has no meaning in ${{{self.quoted}}}"
                )
            tokens.append((match.lastgroup, match[match.lastgroup]))
            at = match.end()
        return tokens

    def parse(self) -> Value:
        """Return the value.

        Raises:
            ExpressionError: if it is malformed or not computable.
            OverflowError: if a whole number is too large to be a float.
        """
        if not self.tokens:
            raise ExpressionError("an empty expression", "name a variable: ${name}")
        value = self._choice()
        if self.index < len(self.tokens):
            self._unexpected()
        if isinstance(value, Quantity) and not math.isfinite(value.value):
            raise ExpressionError(f"${{{self.quoted}}} is not finite")
        return value

    def _peek(self) -> str:
        return self.tokens[self.index][1] if self.index < len(self.tokens) else ""

    def _next(self) -> tuple[str, str]:
        if self.index >= len(self.tokens):
            raise ExpressionError(f"${{{self.quoted}}} ends too early")
        self.index += 1
        return self.tokens[self.index - 1]

    def _unexpected(self) -> NoReturn:
        raise ExpressionError(f"{self._peek()!r} is not expected in ${{{self.quoted}}}")

    def _choice(self) -> Value:
        value = self._either()
        if self._peek() != "if":
            return value
        self.index += 1
        start = self.index
        is_chosen = self._condition(self._either(), start)
        if self._peek() != "else":
            raise ExpressionError(
                f"if without else in ${{{self.quoted}}}", "${A if CONDITION else B}"
            )
        self.index += 1
        other = self._choice()
        return value if is_chosen else other

    def _either(self) -> Value:
        start = self.index
        value = self._both()
        while self._peek() == "or":
            self.index += 1
            after = self.index
            other = self._condition(self._both(), after)
            value = self._condition(value, start) or other
        return value

    def _both(self) -> Value:
        start = self.index
        value = self._negation()
        while self._peek() == "and":
            self.index += 1
            after = self.index
            other = self._condition(self._negation(), after)
            value = self._condition(value, start) and other
        return value

    def _negation(self) -> Value:
        negations = 0
        while self._peek() == "not":
            self.index += 1
            negations += 1
        start = self.index
        value = self._comparison()
        return value if not negations else self._condition(value, start) != bool(negations % 2)

    def _comparison(self) -> Value:
        start = self.index
        left = self._sum()
        if self._peek() not in _COMPARISONS:
            return left
        sign = self._next()[1]
        right = self._sum()
        left = left.value if isinstance(left, EnvironmentText) else left
        right = right.value if isinstance(right, EnvironmentText) else right
        if sign in {"==", "!="} and not (
            isinstance(left, Quantity) and isinstance(right, Quantity)
        ):
            self._same_kind(left, right)
            return (left == right) == (sign == "==")
        a, b = self._operand(left, start), self._operand(right, self.index - 1)
        self._same_dimension(a, b, "compared")
        return _COMPARISONS[sign](a.value, b.value)

    def _same_kind(self, left: Value, right: Value) -> None:
        kinds = [_kind(left), _kind(right)]
        if kinds[0] != kinds[1]:
            raise ExpressionError(
                f"{kinds[0]} and {kinds[1]} cannot be compared in ${{{self.quoted}}}"
            )

    def _same_dimension(self, a: Quantity, b: Quantity, what: str) -> None:
        if NUMBER not in {a.dimension, b.dimension} and a.dimension != b.dimension:
            names = f"{dimension_name(a.dimension)} and {dimension_name(b.dimension)}"
            raise ExpressionError(f"{names} cannot be {what} in ${{{self.quoted}}}")

    def _condition(self, value: Value, start: int) -> bool:
        """Return the value that begins at a token, which has to be true or false."""
        value = value.value if isinstance(value, EnvironmentText) else value
        if isinstance(value, bool):
            return value
        raise ExpressionError(
            f"{self.tokens[start][1]} is {_kind(value)}, and ${{{self.quoted}}} needs true or"
            " false"
        )

    def _operand(self, value: Value, start: int) -> Quantity:
        """Return the value that begins at a token, which has to be a number."""
        value = value.value if isinstance(value, EnvironmentText) else value
        if isinstance(value, Quantity):
            return value
        raise ExpressionError(
            f"{self.tokens[start][1]} is {_kind(value)}, and ${{{self.quoted}}} needs a number"
        )

    def _sum(self) -> Value:
        start = self.index
        value = self._product()
        while self._peek() in {"+", "-"}:
            sign = 1 if self._next()[1] == "+" else -1
            after = self.index
            a, b = self._operand(value, start), self._operand(self._product(), after)
            self._same_dimension(a, b, "added")
            dimension = a.dimension if a.dimension != NUMBER else b.dimension
            value = Quantity(a.value + sign * b.value, dimension)
        return value

    def _product(self) -> Value:
        start = self.index
        value = self._sign()
        while self._peek() in {"*", "/"}:
            sign = 1 if self._next()[1] == "*" else -1
            after = self.index
            left, right = self._operand(value, start), self._operand(self._sign(), after)
            if sign < 0 and right.value == 0:
                raise ExpressionError(f"${{{self.quoted}}} divides by zero")
            a, b = left.dimension, right.dimension
            dimension = (
                a[0] + sign * b[0],
                a[1] + sign * b[1],
                a[2] + sign * b[2],
                a[3] + sign * b[3],
            )
            value = Quantity(
                left.value * right.value if sign > 0 else left.value / right.value, dimension
            )
        return value

    def _sign(self) -> Value:
        signs = []
        while self._peek() in {"+", "-"}:
            signs.append(self._next()[1])
        start = self.index
        value = self._value()
        if not signs:
            return value
        number = self._operand(value, start)
        return Quantity(-number.value, number.dimension) if signs.count("-") % 2 else number

    def _value(self) -> Value:
        kind, word = self._next()
        if kind == "number":
            return self._number(int(word) if word.isdigit() else float(word))
        if kind == "text":
            return word[1:-1]
        if kind == "env":
            if environment_in(word) is None:
                raise ExpressionError(
                    f"{word} does not name a variable", "for example ${env(ROBOT, rover)}"
                )
            return self.lookup(word)
        if kind == "name" and word in {"true", "false"}:
            return word == "true"
        if kind == "name" and word not in _CONNECTIVES:
            return self._call(word) if self._peek() == "(" else self._variable(word)
        if word != "(":
            self.index -= 1
            self._unexpected()
        return self._in_brackets()

    def _in_brackets(self) -> Value:
        self.depth += 1
        if self.depth > DEEPEST:
            raise ExpressionError(f"more than {DEEPEST} brackets inside each other")
        value = self._choice()
        if self._peek() != ")":
            raise ExpressionError(f"a bracket is not closed in ${{{self.quoted}}}")
        self.index += 1
        self.depth -= 1
        return value

    def _number(self, number: float) -> Quantity:
        if (
            self.index >= len(self.tokens)
            or self.tokens[self.index][0] != "name"
            or self._peek() in _CONNECTIVES
        ):
            return Quantity(number)
        unit = self._next()[1]
        following = "".join(word for _, word in self.tokens[self.index : self.index + 2])
        if unit + following in UNITS:
            unit += following
            self.index += 2
        try:
            return in_unit(number, unit)
        except UnitError as error:
            raise ExpressionError(str(error), error.advice) from None

    def _variable(self, name: str) -> Value:
        return Quantity(math.pi) if name == "pi" else self.lookup(name)

    def _call(self, name: str) -> Quantity:
        if name in RESERVED:
            raise ExpressionError(f"{name} is {RESERVED[name]}", A_FILE)
        if name not in _FUNCTIONS:
            known = ", ".join(_FUNCTIONS)
            raise ExpressionError(
                f"unknown function {name}", did_you_mean(name, _FUNCTIONS, f"there is {known}")
            )
        self.index += 1
        start = self.index
        argument = self._operand(self._in_brackets(), start)
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


def _kind(value: Value) -> str:
    return (
        "true or false"
        if isinstance(value, bool)
        else "a number"
        if isinstance(value, Quantity)
        else "a text"
    )


_COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_FUNCTIONS: dict[str, tuple[tuple[Dimension, ...], Callable[[float], float], Dimension]] = {
    "sin": ((NUMBER, ANGLE), math.sin, NUMBER),
    "cos": ((NUMBER, ANGLE), math.cos, NUMBER),
    "tan": ((NUMBER, ANGLE), math.tan, NUMBER),
    "sqrt": ((NUMBER,), math.sqrt, NUMBER),
    "radians": ((NUMBER,), math.radians, ANGLE),
    "degrees": ((NUMBER, ANGLE), math.degrees, NUMBER),
}
