"""``vars`` and ``${…}``: computed before the keys are read, so that a computed value is checked like a written one."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from tfcompose.findings import did_you_mean
from tfcompose.validate.arithmetic import ExpressionError, Value
from tfcompose.validate.expression import IDENTIFIER, RESERVED, fill, names_in
from tfcompose.validate.quantity import NUMBER, Quantity, UnitError, quantity
from tfcompose.validate.schema import BROKEN, Problems, shown

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.load import Path


def compute(data: dict[str, Any], problems: Problems) -> dict[str, Any]:
    """Return the data with every ``${…}`` replaced by its value: a ``Quantity`` where it is the whole text.

    What cannot be computed becomes ``BROKEN``, and a problem.
    """
    variables = _Variables(data.get("vars"), problems)
    variables.read_all()
    filled = {key: _filled(value, (key,), variables) for key, value in data.items() if key != "vars"}
    return filled | ({"vars": data["vars"]} if "vars" in data else {})


def unused(data: dict[str, Any], aside: Any = None) -> tuple[str, ...]:
    """Return the variables that no ``${…}`` names, in ``data`` or in ``aside``."""
    written = data.get("vars")
    used = set(_names(data)) | set(_names(aside)) if isinstance(written, dict) and written else set()
    return tuple(name for name in written if name not in used) if isinstance(written, dict) else ()


def _names(value: Any) -> Iterator[str]:
    if isinstance(value, str) and "${" in value:
        yield from names_in(value)
    elif isinstance(value, (dict, list)):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _names(item)


def _filled(value: Any, path: Path, variables: _Variables) -> Any:
    """Return the value with expressions computed; the same object where it holds none, so that aliases stay one."""
    if isinstance(value, str):
        return variables.fill(value, path) if "${" in value else value
    if not isinstance(value, (dict, list)):
        return value
    filled: dict[Any, Any] = {}
    for step, item in value.items() if isinstance(value, dict) else enumerate(value):
        kind = type(item)
        if kind is not float and (kind is dict or kind is list or (kind is str and "${" in item)):
            new = _filled(item, (*path, step), variables)
            if new is not item:
                filled[step] = new
    if not filled:
        return value
    return value | filled if isinstance(value, dict) else [filled.get(index, item) for index, item in enumerate(value)]


#: What a process is told, and what is known only when frames are named, or when it is started.
LATER = re.compile(r"\$\{\s*(?:(?:frame|file)\([^(){}]*\)|params_file|build_dir)\s*\}")


#: A block may hold what is for another program to fill in.
_LITERALLY = """what others fill in: ${dollar}{…}, with vars: {dollar: "$"}"""


def _is_of_a_process(path: Path) -> bool:
    return path[0] == "processes" or (path[0] == "sensors" and path[2:3] == ("driver",))


class _NothingNewError(ExpressionError):
    """A variable has been refused already; what needs it is broken too, and that is not said again."""


class _Variables:
    def __init__(self, written: Any, problems: Problems) -> None:
        self.written: dict[str, Any] = written if isinstance(written, dict) else {}
        self.problems = problems
        self.known: dict[str, Value] = {}
        self.open: list[str] = []

    def read_all(self) -> None:
        """Compute every variable, first those that it needs; without recursion, however long the chain."""
        for first in self.written:
            self.open = [first]
            waiting = [self._names_in(first)]
            while waiting:
                needed = next((name for name in waiting[-1] if name not in self.known and name not in self.open), None)
                if needed is not None:
                    self.open.append(needed)
                    waiting.append(self._names_in(needed))
                    continue
                waiting.pop()
                self._read(self.open[-1])
                self.open.pop()

    def _names_in(self, name: str) -> Iterator[str]:
        written = self.written[name]
        names = names_in(written) if isinstance(written, str) else []
        return iter([other for other in names if other in self.written])

    def _read(self, name: str) -> None:
        if name in self.known:
            return
        try:
            self.known[name] = self._value(name, self.written[name])
        except ExpressionError as error:
            self.known[name] = self._refuse(error, ("vars", name))

    def fill(self, text: str, path: Path) -> Any:
        try:
            return fill(text, self.lookup, LATER if _is_of_a_process(path) else None)
        except ExpressionError as error:
            return self._refuse(error, path)

    def _refuse(self, error: ExpressionError, path: Path) -> Any:
        if not isinstance(error, _NothingNewError):
            advice = f"{error.advice}; {_LITERALLY}" if path[0] == "xml" else error.advice
            self.problems.refuse("TF105", path, str(error), advice)
        return BROKEN

    def lookup(self, name: str) -> Value:
        if name in self.known:
            if self.known[name] is BROKEN:
                raise _NothingNewError(name)
            return self.known[name]
        if name in self.open:
            circle = " → ".join([*self.open[self.open.index(name) :], name])
            raise ExpressionError(f"the variable {self.open[-1]} needs itself: {circle}")
        there = f"vars has {', '.join(self.written)}" if self.written else "the file has no vars"
        raise ExpressionError(f"unknown variable {name}", did_you_mean(name, self.written, there))

    def _value(self, name: str, written: Any) -> Value:
        if name in RESERVED:
            raise ExpressionError(f"{name} is {RESERVED[name]}", "give the variable another name")
        if not IDENTIFIER.fullmatch(name):
            raise ExpressionError(f"{name!r} cannot name a variable", "letters, digits and _: for example mast_height")
        if isinstance(written, bool) or not isinstance(written, (int, float, str)):
            raise ExpressionError(f"the variable {name} is {shown(written)}", "a number, a quantity or a text")
        if not isinstance(written, str):
            return Quantity(written)
        value = fill(written, self.lookup) if "${" in written else written
        if not isinstance(value, str):
            return value
        try:
            read = quantity(value)
        except UnitError as error:
            if error.unit:
                raise ExpressionError(f"{error} in the variable {name}", error.advice) from None
            return value
        return value if read.dimension == NUMBER else read  # a number in quotes is a text, such as a serial number
