"""``vars`` and ``${…}``: computed before the keys are read, so that a computed value is checked like a written one."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from tfcompose.findings import did_you_mean
from tfcompose.language.expressions import IDENTIFIER, RESERVED, ExpressionError, Value, fill, names_in
from tfcompose.language.reading import Refusal
from tfcompose.units import NUMBER, Quantity, UnitError, quantity, shown

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.load import Path


def compute(data: dict[str, Any]) -> tuple[dict[str, Any], list[Refusal], list[Path]]:
    """Return the data with every ``${…}`` computed, what was refused, and the paths of what could not be computed.

    What is one expression becomes a ``Quantity`` or a string. What could not be computed stays as it is; there is no
    second refusal of what only needs a variable that was refused.
    """
    variables = _Variables(data.get("vars"))
    variables.read_all()
    filled = {key: _filled(value, (key,), variables) for key, value in data.items() if key != "vars"}
    filled |= {"vars": data["vars"]} if "vars" in data else {}
    return filled, variables.refusals, variables.uncomputed


def unused(data: dict[str, Any], aside: Any = None) -> tuple[str, ...]:
    """Return the variables that no ``${…}`` names, in ``data`` or in ``aside``."""
    declared = data.get("vars")
    used = set(_names(data)) | set(_names(aside)) if isinstance(declared, dict) and declared else set()
    return tuple(name for name in declared if name not in used) if isinstance(declared, dict) else ()


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


def _call(functions: str) -> str:
    return rf"\$\{{\s*({functions})\(\s*([^(){{}}]*?)\s*\)\s*\}}"


#: What is known only when frames are named: a function, and its argument.
CALLS = re.compile(_call("frame|file"))
#: What a process is told, and what is known then, or when it is started.
LATER = re.compile(rf"{CALLS.pattern}|\$\{{\s*(?:params_file|build_dir)\s*\}}")
#: In what a xacro file is given: a file beside the robot file, which xacro would look for beside its own.
OF_FILES = re.compile(_call("file"))


#: A block may hold what is for another program to fill in.
_LITERALLY = """what others fill in: ${dollar}{…}, with vars: {dollar: "$"}"""


def _is_of_a_process(path: Path) -> bool:
    return path[0] == "processes" or (path[0] == "sensors" and path[2:3] == ("driver",))


def _is_for_xacro(path: Path) -> bool:
    return path[0] == "parts" and path[2:3] in {("args",), ("params",)}


class _NothingNewError(ExpressionError):
    """A variable has been refused already; what needs it is broken too, and that is not said again."""


class _Variables:
    def __init__(self, given: Any) -> None:
        self.given: dict[str, Any] = given if isinstance(given, dict) else {}
        self.refusals: list[Refusal] = []
        self.uncomputed: list[Path] = []
        self.known: dict[str, Value | None] = {}  # None: it was refused
        self.open: list[str] = []

    def read_all(self) -> None:
        """Compute every variable, first those that it needs; without recursion, however long the chain."""
        for first in self.given:
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
        value = self.given[name]
        names = names_in(value) if isinstance(value, str) else []
        return iter([other for other in names if other in self.given])

    def _read(self, name: str) -> None:
        if name in self.known:
            return
        if self.given[name] is None:  # a null is refused as such
            self.known[name] = None
            return
        try:
            self.known[name] = self._value(name, self.given[name])
        except ExpressionError as error:
            self.known[name] = None
            self._refuse(error, ("vars", name))

    def fill(self, text: str, path: Path) -> Any:
        try:
            later = LATER if _is_of_a_process(path) else OF_FILES if _is_for_xacro(path) else None
            return fill(text, self.lookup, later)
        except ExpressionError as error:
            self._refuse(error, path)
            return text

    def _refuse(self, error: ExpressionError, path: Path) -> None:
        self.uncomputed.append(path)
        if not isinstance(error, _NothingNewError):
            advice = f"{error.advice}; {_LITERALLY}" if path[0] == "xml" else error.advice
            self.refusals.append(Refusal("TF105", path, str(error), advice))

    def lookup(self, name: str) -> Value:
        if name in self.known:
            value = self.known[name]
            if value is None:
                raise _NothingNewError(name)
            return value
        if name in self.open:
            circle = " → ".join([*self.open[self.open.index(name) :], name])
            raise ExpressionError(f"the variable {self.open[-1]} depends on itself: {circle}")
        there = f"vars has {', '.join(self.given)}" if self.given else "the file has no vars"
        raise ExpressionError(f"unknown variable {name}", did_you_mean(name, self.given, there))

    def _value(self, name: str, given: Any) -> Value:
        if name in RESERVED:
            raise ExpressionError(f"{name} is {RESERVED[name]}", "give the variable another name")
        if not IDENTIFIER.fullmatch(name):
            raise ExpressionError(f"{name!r} cannot name a variable", "letters, digits and _: for example mast_height")
        if isinstance(given, bool) or not isinstance(given, (int, float, str)):
            raise ExpressionError(f"the variable {name} is {shown(given)}", "a number, a quantity or a string")
        if not isinstance(given, str):
            return Quantity(given)
        value = fill(given, self.lookup) if "${" in given else given
        if not isinstance(value, str):
            return value
        try:
            read = quantity(value)
        except UnitError as error:
            if error.unit:
                raise ExpressionError(f"{error} in the variable {name}", error.advice) from None
            return value
        return value if read.dimension == NUMBER else read  # a number in quotes is a text, such as a serial number
