"""``vars``, ``args`` and ``${…}``.

They are computed before validation, so computed values are checked like literal values.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from tfcompose.foundation.findings import Finding, Note, Span, did_you_mean, finding
from tfcompose.foundation.units import NUMBER, Quantity, Truth, UnitError, format_value, quantity
from tfcompose.spec.language.args import ArgError, ArgSpec, ArgValue, BuildInputs, full
from tfcompose.spec.language.expressions import (
    A_FILE,
    IDENTIFIER,
    RESERVED,
    EnvironmentText,
    ExpressionError,
    Value,
    environment_in,
    fill,
    names_in,
)
from tfcompose.spec.language.reading import SpecRefusal

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from tfcompose.spec.load import Path, Source


def unused_variables(data: dict[str, Any], profiles: Any = None) -> tuple[tuple[str, str], ...]:
    """Return variables and arguments that no ``${…}`` in ``data`` or ``profiles`` names."""
    declared: dict[str, tuple[str, str]] = {}
    for section, prefix in (("vars", ""), ("args", "args.")):
        names = data.get(section)
        declared |= (
            {f"{prefix}{name}": (section, name) for name in names}
            if isinstance(names, dict)
            else {}
        )
    used = set(_names(data)) | set(_names(profiles)) if declared else set()
    return tuple(path for name, path in declared.items() if name not in used)


def _names(value: Any) -> Iterator[str]:
    if isinstance(value, str) and "${" in value:
        yield from names_in(value)
    elif isinstance(value, dict):
        for key, item in value.items():
            if "${" in key:
                yield from names_in(key)
            yield from _names(item)
    elif isinstance(value, list):
        for item in value:
            yield from _names(item)


def _fill_value(value: Any, path: Path, variables: Variables) -> Any:
    """Return the value with expressions computed.

    A value without expressions is returned as the same object, so that aliases stay identical.
    """
    if isinstance(value, str):
        return variables.fill(value, path) if "${" in value else value
    if not isinstance(value, (dict, list)):
        return value
    filled: dict[Any, Any] = {}
    for step, item in value.items() if isinstance(value, dict) else enumerate(value):
        kind = type(item)
        if kind is not float and (kind is dict or kind is list or (kind is str and "${" in item)):
            new = _fill_value(item, (*path, step), variables)
            if new is not item:
                filled[step] = new
    if not filled:
        return value
    return (
        value | filled
        if isinstance(value, dict)
        else [filled.get(index, item) for index, item in enumerate(value)]
    )


def _call(functions: str) -> str:
    return rf"\$\{{\s*({functions})\(\s*([^(){{}}]*?)\s*\)\s*\}}"


#: Calls of functions whose result is known only later, with their arguments.
CALLS = re.compile(_call("frame|file"))
#: Expressions in texts for a process that are computed when names are final or the process starts.
LATER = re.compile(rf"{CALLS.pattern}|\$\{{\s*(?:params_file|build_dir)\s*\}}")
#: In arguments of a xacro file: a path relative to the robot file. xacro would search relative to
#: its own file.
OF_FILES = re.compile(_call("file"))


#: Advice for a raw block with ``${…}`` for another program.
_LITERALLY = """what others fill in: ${dollar}{…}, with vars: {dollar: "$"}"""


def _is_of_a_process(path: Path) -> bool:
    return path[0] in {"processes", "containers"} or (
        path[0] == "sensors" and path[2:3] == ("driver",)
    )


def _is_for_xacro(path: Path) -> bool:
    return path[0] == "parts" and path[2:3] in {("args",), ("params",)}


class NothingNewError(ExpressionError):
    """A variable has already been rejected.

    Values that need it are also broken, which is not reported again.
    """


class Variables:
    """The variables and arguments of a robot file, and the computation of expressions.

    ``refusals`` are rejected values, ``findings`` are about values of arguments, and
    ``uncomputed`` are paths of values that could not be computed. ``args`` holds the arguments'
    values, None for a rejected argument. ``environment`` holds the values of variables that
    ``env`` names, or their defaults.
    """

    def __init__(self, source: Source, inputs: BuildInputs) -> None:
        self.source = source
        self.declared = source.mapping("vars")
        self.outside = inputs
        self.refusals: list[SpecRefusal] = []
        self.findings: list[Finding] = []
        self.uncomputed: list[Path] = []
        self.values: dict[str, Value | None] = {}  # None for a rejected variable
        self.args: dict[str, Value | None] = {}
        self.environment: dict[str, str] = {}
        self.open: list[str] = []
        self.scopes: Mapping[Path, Mapping[str, Value]] = {}
        self._read_args()
        self._read_all()

    def compute(
        self, data: dict[str, Any], scopes: Mapping[Path, Mapping[str, Value]]
    ) -> dict[str, Any]:
        """Return the data with every ``${…}`` computed.

        ``scopes`` holds values of loop variables by path; they apply below that path. A value that
        is a single expression becomes a ``Quantity``, a ``Truth`` or a string. A value that cannot
        be computed stays as it is. If it only needs a rejected variable, it is not rejected again.
        """
        self.scopes = scopes
        filled = {
            key: _fill_value(value, (key,), self) for key, value in data.items() if key != "vars"
        }
        return filled | ({"vars": data["vars"]} if "vars" in data else {})

    def _read_args(self) -> None:
        """Read the arguments in order.

        The default of an argument may use earlier arguments and ``env``.
        """
        declared = self.source.mapping("args")
        for name, raw in declared.items():
            self.args[name] = self._arg(name, raw) if raw is not None else None
        for name, supplied in self.outside.args.items():
            if name not in declared:
                otherwise = (
                    f"its args are {', '.join(declared)}"
                    if declared
                    else f"{self.source.file} has no args"
                )
                advice = did_you_mean(name, declared, otherwise)
                self.findings.append(
                    finding("TF016", f"unknown argument {name}", supplied.span, help=advice)
                )

    def _arg(self, name: str, raw: Any) -> Value | None:
        """Return the argument's value, None after recording why it has none."""
        path: Path = ("args", name)
        declared = dict(full(raw))
        default = declared.get("default")
        if isinstance(default, str) and "${" in default:
            place = (*path, "default") if isinstance(raw, dict) else path
            if (filled := self.fill(default, place)) is default:
                return None
            declared["default"] = filled
        try:
            spec = ArgSpec.model_validate(declared)
        except ValidationError:
            return None  # validation of the file rejects it
        supplied = self._supplied_arg(name, spec)
        notes = [Note(f"args.{name} is declared here", self.source.key_span(path))]
        if supplied is None and spec.default is None:
            message, advice = (
                f"the argument {name} has no value",
                f"give {name}:=VALUE, or a default",
            )
            self.findings.append(
                finding("TF102", message, self.source.key_span(path), help=advice)
            )
            return None
        try:
            return spec.value(spec.default if supplied is None else supplied.value)
        except ArgError as error:
            if supplied:  # otherwise validation rejects the default
                self.findings.append(
                    finding(
                        error.code,
                        f"{name}: {error}",
                        supplied.span,
                        help=error.advice,
                        notes=notes,
                    )
                )
            return None

    def _supplied_arg(self, name: str, spec: ArgSpec) -> ArgValue | None:
        if name in self.outside.args:
            return self.outside.args[name]
        value = self.outside.environment.get(spec.env) if spec.env else None
        if value is None:
            return None
        self.environment[str(spec.env)] = value
        return ArgValue(value, Span(f"{spec.env}={value}"))

    def _read_all(self) -> None:
        """Compute every variable after the variables that it needs.

        The computation does not recurse, so chains may be long.
        """
        for first in self.declared:
            self.open = [first]
            waiting = [self._names_in(first)]
            while waiting:
                needed = next(
                    (
                        name
                        for name in waiting[-1]
                        if name not in self.values and name not in self.open
                    ),
                    None,
                )
                if needed is not None:
                    self.open.append(needed)
                    waiting.append(self._names_in(needed))
                    continue
                waiting.pop()
                self._read(self.open[-1])
                self.open.pop()

    def _names_in(self, name: str) -> Iterator[str]:
        value = self.declared[name]
        names = names_in(value) if isinstance(value, str) else []
        return iter([variable for variable in names if variable in self.declared])

    def _read(self, name: str) -> None:
        if name in self.values:
            return
        if self.declared[name] is None:  # another check rejects a null
            self.values[name] = None
            return
        try:
            self.values[name] = self._value(name, self.declared[name])
        except ExpressionError as error:
            self.values[name] = None
            self._refuse(error, ("vars", name))

    def fill(self, text: str, path: Path, lookup: Callable[[str], Value] | None = None) -> Any:
        """Return the text with every ``${…}`` computed; on failure record why and return the text.

        ``path`` is the path of the text.
        """
        try:
            later = LATER if _is_of_a_process(path) else OF_FILES if _is_for_xacro(path) else None
            value = fill(text, lookup or self._lookup_at(path), later)
            return Truth(value) if isinstance(value, bool) else value
        except ExpressionError as error:
            self._refuse(error, path)
            return text

    def _refuse(self, error: ExpressionError, path: Path) -> None:
        self.uncomputed.append(path)
        if not isinstance(error, NothingNewError):
            advice = f"{error.advice}; {_LITERALLY}" if path[0] == "xml" else error.advice
            self.refusals.append(SpecRefusal("TF105", path, str(error), advice))

    def _lookup_at(self, path: Path) -> Callable[[str], Value]:
        scope = self.scopes.get(path[:2])
        return self.within(scope) if scope else self.lookup

    def value_in(self, text: str, scope: Mapping[str, Value]) -> Value:
        """Return a text with every ``${…}`` computed. Names are looked up in ``scope`` first.

        Raises:
            ExpressionError: if it cannot be computed.
        """
        return fill(text, self.within(scope))

    def within(self, scope: Mapping[str, Value]) -> Callable[[str], Value]:
        """Return a lookup function that searches ``scope`` first."""
        return lambda name: scope[name] if name in scope else self.lookup(name)

    def lookup(self, name: str) -> Value:
        """Return the value of a variable, of ``args.NAME``, or of ``env(NAME, default)``.

        Raises:
            ExpressionError: if there is no such value.
        """
        if name.startswith("args."):
            return self._lookup_arg(name.removeprefix("args."))
        if (named := environment_in(name)) is not None:
            return self._lookup_environment(*named)
        if name in self.values:
            value = self.values[name]
            if value is None:
                raise NothingNewError(name)
            return value
        if name in self.open:
            circle = " → ".join([*self.open[self.open.index(name) :], name])
            raise ExpressionError(f"the variable {self.open[-1]} depends on itself: {circle}")
        if name in RESERVED:
            raise ExpressionError(f"{name} is {RESERVED[name]}", A_FILE)
        if name == "math.pi":
            raise ExpressionError(f"unknown variable {name}", "write pi")
        otherwise = (
            f"vars has {', '.join(self.declared)}" if self.declared else "the file has no vars"
        )
        raise ExpressionError(
            f"unknown variable {name}", did_you_mean(name, self.declared, otherwise)
        )

    def _lookup_arg(self, name: str) -> Value:
        if name in self.args:
            value = self.args[name]
            if value is None:
                raise NothingNewError(name)
            return value
        if name in self.source.mapping("args"):
            raise ExpressionError(
                f"the argument {name} is declared further down", f"declare {name} first"
            )
        otherwise = f"args has {', '.join(self.args)}" if self.args else "the file has no args"
        raise ExpressionError(f"unknown argument {name}", did_you_mean(name, self.args, otherwise))

    def _lookup_environment(self, name: str, default: str | None) -> Value:
        value = self.outside.environment.get(name, default)
        if value is None:
            raise ExpressionError(
                f"{name} is not in the environment",
                f"set it, or give a default: ${{env({name}, …)}}",
            )
        self.environment[name] = value
        return EnvironmentText(value)

    def _value(self, name: str, raw: Any) -> Value:
        if name in RESERVED:
            raise ExpressionError(f"{name} is {RESERVED[name]}", "give the variable another name")
        if not IDENTIFIER.fullmatch(name):
            raise ExpressionError(
                f"{name!r} cannot name a variable",
                "a letter or _, then letters, digits and _: for example mast_height",
            )
        if isinstance(raw, bool) or not isinstance(raw, (int, float, str)):
            raise ExpressionError(
                f"the variable {name} is {format_value(raw)}", "a number, a quantity or a string"
            )
        if not isinstance(raw, str):
            return Quantity(raw)
        value = fill(raw, self.lookup) if "${" in raw else raw
        if not isinstance(value, str):
            return value
        try:
            read = quantity(value)
        except UnitError as error:
            if error.unit:
                raise ExpressionError(f"{error} in the variable {name}", error.advice) from None
            return value
        return (
            value if read.dimension == NUMBER else read
        )  # a quoted number is a string, such as a serial number
