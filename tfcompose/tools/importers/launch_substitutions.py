"""A stand-in for launch's substitutions and parameters, and the context that they are resolved in.

Launch files import it under the names of ``launch`` and ``launch_ros`` in a process of its own
(``launch_process``). How each behaves was read in those packages' sources. Whatever launch would
resolve at its start is resolved with the arguments that the import is given.
"""

# ruff: noqa: D101, D102, ARG002 - the classes, methods and their parameters are launch's

from __future__ import annotations

import json
import math
import os
import re
import shlex
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import yaml

from tfcompose.foundation.shape import fits
from tfcompose.tools.importers.yaml_text import argument, arguments_in, with_values

#: What stands for the text of a file, or for what xacro makes of one: JSON between two characters
#: that no text has.
BEGIN, END = "\x02", "\x03"
_MARK = re.compile(f"{BEGIN}([^{END}]*){END}")
#: As what the folder of a package begins that is not found.
PACKAGE = "package://"


class FailedError(Exception):
    """Something of a launch file cannot be resolved.

    ``line`` is set where it is about a whole file, else 0.
    """

    def __init__(self, reason: str, line: int = 0) -> None:
        super().__init__(f"line {line}: {reason}" if line else reason)
        self.reason, self.line = reason, line


def marked(**what: Any) -> str:
    """Return the text that stands for a description."""
    return f"{BEGIN}{json.dumps(what)}{END}"


def marks(text: str) -> list[dict[str, Any]]:
    """Return what stands in a text for descriptions."""
    return [mark for found in _MARK.finditer(text) if (mark := _mark_in(found[1]))]


def _mark_in(text: str) -> dict[str, Any]:
    """Return a file and its arguments, or nothing if a text of somebody else's only looks so."""
    try:
        mark = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return mark if fits(mark, {"file": str, "args": {"*": str}}) else {}


def symbolic_text(value: Any, context: Context) -> str:
    """Return a value's text in which launch arguments stand for themselves."""
    before, context.symbolic = context.symbolic, True
    try:
        return with_package(text_of(value, context))
    finally:
        context.symbolic = before


def _parameter_text(value: Any, context: Context) -> str:
    """Return the same for a parameter.

    An argument that is all of it has a type, and may be 10.0, which texts lose.
    """
    context.typed = True
    try:
        text = symbolic_text(value, context)
    finally:
        context.typed = False
    names = arguments_in(text)
    is_one = any(text == argument(name, with_values(text)) for name in names)
    return text if is_one or not names else symbolic_text(value, context)


def scalar_of(text: str) -> Any:
    """Return what a launch argument is: true or false, a number as it is written, or the text."""
    if text.lower() in {"true", "false"}:
        return text.lower() == "true"
    if re.fullmatch(r"-?(0|[1-9][0-9]{0,15})", text) and text != "-0":
        return int(text)
    if re.fullmatch(r"-?(0|[1-9][0-9]*)\.[0-9]+", text) and repr(float(text)) == text:
        return float(text)
    return text


def with_package(path: str) -> str:
    """Return a path below a package that is not found as an address.

    Pathlib takes one slash for two.
    """
    is_path = "package:/" in path and BEGIN not in path
    return re.sub(r"^.*?package:/+", PACKAGE, path) if is_path else path


class Context:
    """State changed by actions: configurations, environment, and group settings.

    ``records`` is what came of it, in order; ``todo`` what could not be resolved.
    """

    def __init__(
        self,
        find: Callable[[str, str], str | None] = lambda _name, _file: None,
        *,
        every_branch: bool = False,
    ) -> None:
        self.find, self.every_branch = find, every_branch
        self.configurations: dict[str, str] = {}
        self.variables: dict[str, str] = {}
        self.namespace: str | None = None
        self.params: list[Any] = []
        self.remaps: list[tuple[str, str]] = []
        self.records: list[dict[str, Any]] = []
        self.period_s = 0.0
        self.after: dict[str, str] = {}
        #: What loads the components that are visited: the id of its action, or the full name of
        #: its node.
        self.container: str | None = None
        self.conditions: list[str] = []
        self.file = ""
        self.depth = 0
        self.at: Any = ("", 1)
        #: The types of launch arguments that a robot file can have as its own, by name.
        self.declared: dict[str, str] = {}
        #: Those whose value decided something that stands in the robot file as it is now.
        self.decided: set[str] = set()
        self.symbolic = False
        #: Whether what is asked for is a parameter, and has a type.
        self.typed = False
        self.whens: list[str] = []

    @property
    def launch_configurations(self) -> dict[str, str]:
        """What launch files with an OpaqueFunction ask for."""
        return self.configurations

    @property
    def locals(self) -> Any:
        """Nothing that a launch file needs."""
        return Missing("context.locals")

    def perform_substitution(self, substitution: Any) -> str:
        """Return the text of a substitution."""
        return text_of(substitution, self)

    def scope(self) -> tuple[Any, ...]:
        """Return what a group restores at its end."""
        return (
            dict(self.configurations),
            dict(self.variables),
            self.namespace,
            list(self.params),
            list(self.remaps),
        )

    def restore(self, scope: tuple[Any, ...]) -> None:
        """Take back what was changed in a group."""
        self.configurations, self.variables, self.namespace, self.params, self.remaps = scope

    def record(self, kind: str, at: Any, **what: Any) -> None:
        """Keep what an action does."""
        more: dict[str, Any] = {"when": list(self.conditions)} if self.conditions else {}
        more |= {"only_when": " and ".join(dict.fromkeys(self.whens))} if self.whens else {}
        self.records.append({"kind": kind, "at": at, **more, **what})

    def todo(self, at: Any, text: str) -> None:
        """Say what of a launch file is not resolved."""
        self.record("todo", at, text=text)


#: Modules that a launch file is run as have names that begin so.
MODULE = "launch_file_"


def place() -> tuple[str, int]:
    """Return the file and line of a launch file that is being run, or no file."""
    frame: Any = sys._getframe(1)  # noqa: SLF001 (CPython's only way)
    while frame is not None and not str(frame.f_globals.get("__name__", "")).startswith(MODULE):
        frame = frame.f_back
    return (frame.f_code.co_filename, frame.f_lineno) if frame else ("", 1)


# Substitutions


class Substitution:
    """A text that is resolved at the start."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self.at = place()
        self.args, self.kwargs = args, kwargs

    def perform(self, context: Context) -> str:
        """Return the text."""
        raise FailedError(f"the substitution {type(self).__name__}")

    def describe(self) -> str:
        """Return it for people."""
        return f"{type(self).__name__}({', '.join(map(plain, self.args))})"


def _parts(value: Any) -> Any:
    return value if isinstance(value, (list, tuple)) else [value]


def plain(value: Any) -> str:
    """Return a value that may have substitutions in it, for people."""
    if isinstance(value, Substitution):
        return value.describe()
    if isinstance(value, (list, tuple)):
        return " ".join(map(plain, value))
    return str(getattr(value, "NAME", value))


def without_marks(text: str) -> tuple[str, list[str]]:
    """Return a text with the names of files for what stands for their texts, and these names."""
    plain_text = _MARK.sub(lambda found: _mark_in(found[1]).get("file", found[0]), text)
    return plain_text, [mark["file"] for mark in marks(text)]


def shown(text: str) -> str:
    """Return a text for people, with paths relative to the folder of the import."""
    return os.path.relpath(text) if os.path.isabs(text) and os.path.exists(text) else text  # noqa: PTH110, PTH117


def text_of(value: Any, context: Context) -> str:
    """Return the text of a value, substitution or list of them."""
    if isinstance(value, (Substitution, ParameterValue)):
        if context.symbolic and not isinstance(
            value, (LaunchConfiguration, TextSubstitution, PathJoinSubstitution)
        ):
            return _plain_text(value, context)
        return str(value.perform(context))
    if isinstance(value, (list, tuple)):
        return "".join(text_of(one, context) for one in value)
    if isinstance(value, Missing) or hasattr(value, "perform"):
        return str(value.perform(context))  # which says what is not known
    return with_package(str(value)) if isinstance(value, os.PathLike) else str(value)


def _plain_text(value: Any, context: Context) -> str:
    """Return the text of a substitution that computes with values."""
    before, context.symbolic = context.symbolic, False
    try:
        return str(value.perform(context))
    finally:
        context.symbolic = before


def truth(value: Any, context: Context) -> bool:
    """Return what launch takes for true or false.

    Raises:
        FailedError: for another text.
    """
    text = text_of(value, context).strip().lower()
    if text in {"true", "1"}:
        return True
    if text in {"false", "0"}:
        return False
    raise FailedError(f"{text!r} is neither true nor false")


class TextSubstitution(Substitution):
    def __init__(self, *, text: Any) -> None:
        super().__init__(text)
        self.text = text

    def perform(self, context: Context) -> str:
        return str(self.text)

    def describe(self) -> str:
        return str(self.text)


class LaunchConfiguration(Substitution):
    def __init__(self, variable_name: Any, *, default: Any = None) -> None:
        super().__init__(variable_name)
        self.variable_name, self.default = variable_name, default

    def perform(self, context: Context) -> str:
        name = text_of(self.variable_name, context)
        if name in context.configurations:
            value = context.configurations[name]
            if name not in context.declared:
                return value
            typed = scalar_of(value)
            is_kept = str(typed).lower() == value  # True would become true
            if isinstance(typed, float) and typed.is_integer() and not context.typed:
                is_kept = False  # 10.0 would become 10
            if context.symbolic and (is_kept or context.declared[name] == "string"):
                return argument(name, value)
            context.decided.add(name)
            return value
        if self.default is not None:
            return text_of(self.default, context)
        raise FailedError(f"the launch argument {name} has no value: give {name}:=…")

    def describe(self) -> str:
        return plain(self.variable_name)


class LaunchConfigAsBool(Substitution):
    """nav2_common's: an argument as True or False, however it is written."""

    def __init__(self, name: Any) -> None:
        super().__init__(name)
        self.variable_name = name

    def perform(self, context: Context) -> str:
        text = LaunchConfiguration(self.variable_name).perform(context)
        return str(text.strip().lower() in {"true", "1", "yes", "on", "y", "t"})

    def describe(self) -> str:
        return plain(self.variable_name)


class EnvironmentVariable(Substitution):
    def __init__(self, name: Any, *, default_value: Any = None) -> None:
        super().__init__(name)
        self.name, self.default_value = name, default_value

    def perform(self, context: Context) -> str:
        name = text_of(self.name, context)
        value = context.variables.get(name, os.environ.get(name))
        if value is None and self.default_value is not None:
            value = text_of(self.default_value, context)
        if value is None:
            raise FailedError(f"the environment variable {name} is not set")
        return value


class FindPackageShare(Substitution):
    def __init__(self, package: Any) -> None:
        super().__init__(package)
        self.package = package

    def perform(self, context: Context) -> str:
        name = text_of(self.package, context)
        return context.find(name, context.file) or f"{PACKAGE}{name}"

    find = perform

    def describe(self) -> str:
        return plain([self.package])


class FindPackagePrefix(FindPackageShare):
    def perform(self, context: Context) -> str:
        name = text_of(self.package, context)
        found = context.find(name, context.file)
        return str(Path(found).parents[1]) if found else f"{PACKAGE}{name}"


class ExecutableInPackage(Substitution):
    def __init__(self, executable: Any, package: Any) -> None:
        super().__init__(executable, package)

    def perform(self, context: Context) -> str:
        return text_of(self.args[0], context)


class FindExecutable(Substitution):
    def __init__(self, *, name: Any) -> None:
        super().__init__(name)

    def perform(self, context: Context) -> str:
        return text_of(self.args[0], context)


class PathJoinSubstitution(Substitution):
    def describe(self) -> str:
        return "/".join("".join(plain([part]) for part in _parts(one)) for one in self.args[0])

    def perform(self, context: Context) -> str:
        return os.path.join(*(text_of(one, context) for one in self.args[0]))  # noqa: PTH118 (as launch does)


class ThisLaunchFile(Substitution):
    def perform(self, context: Context) -> str:
        return context.file


class ThisLaunchFileDir(Substitution):
    def perform(self, context: Context) -> str:
        return str(Path(context.file).parent)


class LaunchLogDir(Substitution):
    def perform(self, context: Context) -> str:
        return os.path.join("~", ".ros", "log")  # noqa: PTH118 (no path of this machine)


class AnonName(Substitution):
    def perform(self, context: Context) -> str:
        return text_of(self.args[0], context)


class LocalSubstitution(Substitution):
    pass


class PythonExpression(Substitution):
    def __init__(self, expression: Any, python_modules: Any = ("math",)) -> None:
        super().__init__(expression)
        self.expression, self.modules = expression, python_modules

    def describe(self) -> str:
        return " ".join(plain([self.expression]).split())

    def perform(self, context: Context) -> str:
        text = text_of(self.expression, context)
        names: dict[str, Any] = {"math": math, **vars(math)}
        for module in self.modules if isinstance(self.modules, (list, tuple)) else [self.modules]:
            for name in text_of(module, context).split(","):
                names[name.strip()] = __import__(name.strip())
        try:
            return str(eval(text, {}, names))  # noqa: S307 (that is what launch does; this process is confined)
        except Exception as error:  # noqa: BLE001 (any can come out of it)
            raise FailedError(f"the expression {text}: {type(error).__name__}: {error}") from None


class Command(Substitution):
    def __init__(self, command: Any, *, on_stderr: Any = None) -> None:
        super().__init__(command)
        self.command = command

    def perform(self, context: Context) -> str:
        text = text_of(self.command, context)
        try:
            words = shlex.split(text)
        except ValueError as error:
            raise FailedError(f"the command {text}: {error}") from None
        return of_command(words, text)


def of_command(words: list[str], text: str) -> str:
    """Return what stands for the output of a command that makes a robot's description.

    Raises:
        FailedError: for any other command: none is run.
    """
    program = Path(words[0]).name if words else ""
    rest = [with_package(word) for word in words[1:]]
    if program.startswith("xacro") or words[:3] == ["ros2", "run", "xacro"]:
        rest = rest[3:] if program == "ros2" else rest
        files = [word for word in rest if ":=" not in word and not word.startswith("-")]
        args = dict(word.split(":=", 1) for word in rest if ":=" in word)
        if files:
            return marked(file=files[0], args=args)
    if program == "cat" and len(rest) == 1:
        return file_text(rest[0])
    raise FailedError(f"the command {text.strip()} is not run")


def file_text(path: str) -> str:
    """Return the text of a file, or what stands for it where its package is not found."""
    if path.startswith(PACKAGE):
        return marked(file=path, args={})
    try:
        return Path(path).read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise FailedError(f"{path} cannot be read: {error}") from None


class FileContent(Substitution):
    def perform(self, context: Context) -> str:
        return file_text(text_of(self.args[0], context))


class IfElseSubstitution(Substitution):
    def __init__(self, condition: Any, if_value: Any = "", else_value: Any = "") -> None:
        super().__init__(condition, if_value, else_value)

    def perform(self, context: Context) -> str:
        return text_of(self.args[1] if truth(self.args[0], context) else self.args[2], context)


class EqualsSubstitution(Substitution):
    WORD = "=="

    def describe(self) -> str:
        return f" {self.WORD} ".join(plain([one]) or "''" for one in self.args)

    def perform(self, context: Context) -> str:
        left, right = (text_of(one, context) for one in self.args)
        return str(left == right or _same_number(left, right)).lower()


def _same_number(left: str, right: str) -> bool:
    truths = {"true": 1.0, "false": 0.0}
    try:
        numbers = [float(truths.get(text.lower(), text)) for text in (left, right)]
    except ValueError:
        return False
    return numbers[0] == numbers[1]


class NotEqualsSubstitution(EqualsSubstitution):
    WORD = "!="

    def perform(self, context: Context) -> str:
        return "false" if super().perform(context) == "true" else "true"


class NotSubstitution(Substitution):
    def describe(self) -> str:
        return f"not {plain(self.args)}"

    def perform(self, context: Context) -> str:
        return str(not truth(self.args[0], context)).lower()


class AndSubstitution(Substitution):
    def describe(self) -> str:
        return " and ".join(plain([one]) for one in self.args)

    def perform(self, context: Context) -> str:
        return str(all(truth(one, context) for one in self.args)).lower()


class OrSubstitution(Substitution):
    def describe(self) -> str:
        return " or ".join(plain([one]) for one in self.args)

    def perform(self, context: Context) -> str:
        return str(any(truth(one, context) for one in self.args)).lower()


class AnySubstitution(OrSubstitution):
    pass


class AllSubstitution(AndSubstitution):
    pass


class ParameterSubstitution(Substitution):
    pass


# Parameters


class ParameterValue:
    def __init__(self, value: Any, *, value_type: Any = None) -> None:
        self.value, self.value_type = value, value_type

    def perform(self, context: Context) -> Any:
        """Return the value with its type."""
        if isinstance(self.value, (int, float)) and self.value_type in (None, type(self.value)):
            return self.value
        if isinstance(self.value, list) and not any(
            isinstance(one, Substitution) for one in self.value
        ):
            # The values of a list, one by one.
            kind = (*getattr(self.value_type, "__args__", ()), None)[0]
            values = []
            for item in self.value:
                item_type = str if isinstance(item, str) else kind
                values.append(ParameterValue(item, value_type=item_type).perform(context))
            return values
        if self.value_type is None:
            return _typed_or_symbolic(self.value, context)
        if (symbolic := self._symbolic(context)) is not None:
            return symbolic
        text = text_of(self.value, context)
        if self.value_type is str or marks(text):
            return text
        return _typed(text)

    evaluate = perform

    def _symbolic(self, context: Context) -> str | None:
        """Return the text with arguments as themselves, if they have the value's type."""
        text = _parameter_text(self.value, context)
        names = arguments_in(text)
        alone = [name for name in names if text == argument(name, with_values(text))]
        kinds = {bool: "bool", int: "int", float: "float", str: "string"}
        if alone and context.declared.get(alone[0]) == kinds.get(self.value_type):
            return text
        if names and not alone and self.value_type is str:
            return text
        context.decided |= names
        return None


class ParameterFile:
    def __init__(self, param_file: Any, *, allow_substs: Any = False) -> None:
        self.param_file, self.allow_substs = param_file, allow_substs


class Parameter(ParameterValue):
    def __init__(self, name: Any, value: Any, *, value_type: Any = None) -> None:
        super().__init__(value, value_type=value_type)
        self.name = name


def _typed(text: str) -> Any:
    try:
        value = yaml.safe_load(text) if text else ""
    except yaml.YAMLError:
        raise FailedError(f"the value {text!r} of a parameter is no YAML") from None
    return value if isinstance(value, (bool, int, float, str, list)) else text


def _typed_or_symbolic(value: Any, context: Context) -> Any:
    """Return the value that YAML reads in a text.

    Arguments stand for themselves where they are read alike.
    """
    text = _parameter_text(value, context)
    plain_value, names = with_values(text), arguments_in(text)
    if marks(plain_value) or plain_value == text:
        return plain_value if marks(plain_value) else _typed(plain_value)
    typed = _typed(plain_value)
    alone = any(text == argument(name, plain_value) for name in names)
    if typed == (scalar_of(plain_value) if alone else plain_value) and isinstance(
        typed, (bool, int, float, str)
    ):
        return text
    context.decided |= names
    return typed


def parameters_of(given: Any, context: Context, at: Any) -> list[Any]:
    """Return parameters as mappings and names of files, in order.

    What cannot be resolved is said.
    """
    several: list[Any] = []
    for one in given or ():
        try:
            several.append(
                dict(_flat(one, context, "", at))
                if isinstance(one, Mapping)
                else _parameters(one, context)
            )
        except FailedError as error:
            context.todo(at, f"parameters: {error}")
    return several


def _parameters(one: Any, context: Context) -> Any:
    if isinstance(one, Parameter):
        return {text_of(one.name, context): one.perform(context)}
    if isinstance(one, ParameterFile):
        return with_package(text_of(one.param_file, context))
    return with_package(text_of(one, context))


def _flat(
    params: Mapping[Any, Any], context: Context, above: str, at: Any
) -> Iterable[tuple[str, Any]]:
    """Yield parameters by full name, without those that cannot be resolved."""
    for key, value in params.items():
        name = f"{above}{text_of(key, context)}"
        if isinstance(value, Mapping):
            yield from _flat(value, context, f"{name}.", at)
            continue
        try:
            yield name, parameter_value(value, context)
        except FailedError as error:
            context.todo(at, f"the parameter {name}: {error}")


def parameter_value(value: Any, context: Context) -> Any:
    """Return a parameter's value as launch hands it on.

    What a substitution gives is read as YAML.
    """
    if isinstance(value, ParameterValue):
        return value.perform(context)
    if isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, Substitution):
        return _typed_or_symbolic(value, context)
    if isinstance(value, (list, tuple)):
        if any(isinstance(one, Substitution) for one in value):
            return _typed_or_symbolic(value, context)
        items = [parameter_value(one, context) for one in value]
        numbers = all(isinstance(one, (int, float)) and not isinstance(one, bool) for one in items)
        return (
            [float(one) for one in items]
            if numbers and any(isinstance(one, float) for one in items)
            else items
        )
    return text_of(value, context)


class Missing:
    """What a module that is not installed here would give.

    Whatever is done with it gives the same.
    """

    def __init__(self, name: str) -> None:
        self.name = name

    def __getattr__(self, name: str) -> Missing:
        if name.startswith("__"):
            raise AttributeError(name)
        return Missing(f"{self.name}.{name}")

    def __call__(self, *_args: Any, **_kwargs: Any) -> Missing:
        return self

    def __getitem__(self, key: Any) -> Missing:
        return self

    def __iter__(self) -> Any:
        return iter(())

    def __len__(self) -> int:
        return 0

    def __str__(self) -> str:
        return ""

    def visit(self, context: Context) -> None:
        """Say that it is not known."""
        context.todo([context.file, 1], f"{self.name} is not known here")

    def perform(self, context: Context) -> str:
        raise FailedError(f"{self.name} is not known here")
