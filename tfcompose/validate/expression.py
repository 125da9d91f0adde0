"""``${…}``: arithmetic with quantities, ``vars`` and ``pi``; nothing else.

No Python is run and no environment is read. Grammar::

    sum     = product {("+" | "-") product}
    product = sign {("*" | "/") sign}
    sign    = ["+" | "-"] value
    value   = NUMBER [UNIT] | NAME | NAME "(" sum ")" | "(" sum ")"
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, NoReturn

from tfcompose.diagnostic import did_you_mean
from tfcompose.validate.quantity import ANGLE, NUMBER, UNITS, Dimension, Quantity, UnitError, dimension_name, in_unit

if TYPE_CHECKING:
    from collections.abc import Callable

Value = Quantity | str

LONGEST = 500
LONGEST_TEXT = 100_000
_LONGEST_SAID = 60
DEEPEST = 20

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<sign>[-+*/()]))"
)
_HOLE = re.compile(r"\$\{([^{}]*)\}")
IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


_TOLD = re.compile(r"\$\{\s*(frame|file)\s*\(")
_TOLD_EXAMPLES = {"frame": "base_link", "file": "maps/a.yaml"}

#: What an expression takes for something else.
RESERVED = {"pi": "a number already", "params_file": "for launch arguments", "build_dir": "for launch arguments"}


class ExpressionError(ValueError):
    """An expression cannot be computed; ``advice`` says what to write instead."""

    def __init__(self, message: str, advice: str = "") -> None:
        super().__init__(message)
        self.advice = advice


def fill(text: str, lookup: Callable[[str], Value], later: re.Pattern[str] | None = None) -> Value:
    """Return ``text`` with each ``${…}`` computed; one that is the whole text keeps its type.

    What matches ``later`` is left as it is.

    Raises:
        ExpressionError: if an expression is malformed, too long or not computable.
    """
    if later and later.search(text):
        kept = [*later.finditer(text)]
        pieces = [
            text[a:b]
            for a, b in zip([0, *(k.end() for k in kept)], [*(k.start() for k in kept), len(text)], strict=True)
        ]
        filled = [inserted(fill(piece, lookup, later)) if "${" in piece else piece for piece in pieces]
        return "".join(part for pair in zip(filled, [*(k[0] for k in kept), ""], strict=True) for part in pair)
    told = _TOLD.search(text)
    if told:
        what = f"{told[1]}(…)"
        if later:
            raise ExpressionError(f"{what} stands alone, with one name", f"${{{told[1]}({_TOLD_EXAMPLES[told[1]]})}}")
        raise ExpressionError(f"${{{what}}} is for processes only", "it can stand in run, params, remap and env")
    whole = _HOLE.fullmatch(text.strip())
    if whole:
        return evaluate(whole[1], lookup)
    if "${" in _HOLE.sub("", text):
        raise ExpressionError("${ without its }", "close the expression: ${name}")
    parts, length, end = [], 0, 0
    for hole in _HOLE.finditer(text):
        parts += [text[end : hole.start()], inserted(evaluate(hole[1], lookup))]
        end = hole.end()
        length += len(parts[-1])
        if length > LONGEST_TEXT:
            raise ExpressionError(f"a text of more than {LONGEST_TEXT:,} characters")
    return "".join([*parts, text[end:]])


def evaluate(text: str, lookup: Callable[[str], Value]) -> Value:
    """Return the value of an expression; ``lookup`` gives the value of a variable.

    Raises:
        ExpressionError: if it is malformed, too long or not computable.
    """
    if len(text) > LONGEST:
        raise ExpressionError(f"an expression of {len(text)} characters; at most {LONGEST} are read")
    try:
        return _Parser(text, lookup).parse()
    except OverflowError:  # from whole numbers, which Python does not bound
        raise ExpressionError(f"${{{text[:_LONGEST_SAID]}}} is not finite") from None


def names_in(text: str) -> list[str]:
    """Return the names in the text's expressions, in order: variables, and also units and functions."""
    return [name for hole in _HOLE.findall(text) for name in IDENTIFIER.findall(hole)]


def inserted(value: Value) -> str:
    """Return a value as it is written in a text: a quantity is its number, in SI units."""
    if isinstance(value, str):
        return value
    number = value.value
    return str(int(number)) if number == int(number) and abs(number) < _EXACT else repr(number)


_EXACT = 2**53
"""Up to here every whole number is a float."""


class _Parser:
    def __init__(self, text: str, lookup: Callable[[str], Value]) -> None:
        self.text = text
        self.said = text if len(text) < _LONGEST_SAID else f"{text[:_LONGEST_SAID]}…"
        self.lookup = lookup
        self.depth = 0
        self.tokens = self._tokens()
        self.index = 0

    def _tokens(self) -> list[tuple[str, str]]:
        tokens, at = [], 0
        while self.text[at:].strip():
            match = _TOKEN.match(self.text, at)
            if not match or not match.lastgroup:
                raise ExpressionError(f"{self.text[at:].strip()[0]!r} has no meaning in ${{{self.said}}}")
            tokens.append((match.lastgroup, match[match.lastgroup]))
            at = match.end()
        return tokens

    def parse(self) -> Value:
        if not self.tokens:
            raise ExpressionError("an empty expression", "name a variable: ${name}")
        if len(self.tokens) == 1 and self.tokens[0][0] == "name" and self.tokens[0][1] != "pi":
            return self.lookup(self.tokens[0][1])
        value = self._sum()
        if self.index < len(self.tokens):
            self._unexpected()
        if not math.isfinite(value.value):
            raise ExpressionError(f"${{{self.said}}} is not finite")
        return value

    def _peek(self) -> str:
        return self.tokens[self.index][1] if self.index < len(self.tokens) else ""

    def _next(self) -> tuple[str, str]:
        if self.index >= len(self.tokens):
            raise ExpressionError(f"${{{self.said}}} ends too early")
        self.index += 1
        return self.tokens[self.index - 1]

    def _unexpected(self) -> NoReturn:
        raise ExpressionError(f"{self._peek()!r} is not expected in ${{{self.said}}}")

    def _sum(self) -> Quantity:
        value = self._product()
        while self._peek() in {"+", "-"}:
            sign = 1 if self._next()[1] == "+" else -1
            other = self._product()
            if NUMBER not in {value.dimension, other.dimension} and value.dimension != other.dimension:
                names = f"{dimension_name(value.dimension)} and {dimension_name(other.dimension)}"
                raise ExpressionError(f"{names} cannot be added in ${{{self.said}}}")
            dimension = value.dimension if value.dimension != NUMBER else other.dimension
            value = Quantity(value.value + sign * other.value, dimension)
        return value

    def _product(self) -> Quantity:
        value = self._sign()
        while self._peek() in {"*", "/"}:
            sign = 1 if self._next()[1] == "*" else -1
            other = self._sign()
            if sign < 0 and other.value == 0:
                raise ExpressionError(f"${{{self.said}}} divides by zero")
            a, b = value.dimension, other.dimension
            dimension = (a[0] + sign * b[0], a[1] + sign * b[1], a[2] + sign * b[2], a[3] + sign * b[3])
            value = Quantity(value.value * other.value if sign > 0 else value.value / other.value, dimension)
        return value

    def _sign(self) -> Quantity:
        negative = False
        while self._peek() in {"+", "-"}:
            negative ^= self._next()[1] == "-"
        value = self._value()
        return Quantity(-value.value, value.dimension) if negative else value

    def _value(self) -> Quantity:
        kind, word = self._next()
        if kind == "number":
            return self._number(int(word) if word.isdigit() else float(word))
        if kind == "name":
            return self._call(word) if self._peek() == "(" else self._variable(word)
        if word != "(":
            self.index -= 1
            self._unexpected()
        return self._in_brackets()

    def _in_brackets(self) -> Quantity:
        self.depth += 1
        if self.depth > DEEPEST:
            raise ExpressionError(f"more than {DEEPEST} brackets inside each other")
        value = self._sum()
        if self._peek() != ")":
            raise ExpressionError(f"a bracket is not closed in ${{{self.said}}}")
        self.index += 1
        self.depth -= 1
        return value

    def _number(self, number: float) -> Quantity:
        if self.index >= len(self.tokens) or self.tokens[self.index][0] != "name":
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

    def _variable(self, name: str) -> Quantity:
        if name == "pi":
            return Quantity(math.pi)
        value = self.lookup(name)
        if isinstance(value, str):
            raise ExpressionError(f"{name} is a text, and ${{{self.said}}} needs a number")
        return value

    def _call(self, name: str) -> Quantity:
        if name not in _FUNCTIONS:
            known = ", ".join(_FUNCTIONS)
            raise ExpressionError(f"unknown function {name}", did_you_mean(name, _FUNCTIONS, f"there is {known}"))
        self.index += 1
        argument = self._in_brackets()
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


_FUNCTIONS: dict[str, tuple[tuple[Dimension, ...], Callable[[float], float], Dimension]] = {
    "sin": ((NUMBER, ANGLE), math.sin, NUMBER),
    "cos": ((NUMBER, ANGLE), math.cos, NUMBER),
    "tan": ((NUMBER, ANGLE), math.tan, NUMBER),
    "sqrt": ((NUMBER,), math.sqrt, NUMBER),
    "radians": ((NUMBER,), math.radians, ANGLE),
    "degrees": ((NUMBER, ANGLE), math.degrees, NUMBER),
}
