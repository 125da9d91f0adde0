"""Launch's objects, with their constructor arguments and places recorded.

This runs in the process that reads launch files (``launch_process``), with ROS's own ``launch``.
"""

from __future__ import annotations

import contextlib
import functools
import importlib
import inspect
import sys
import types
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import launch
import launch.frontend
import launch_ros.descriptions
import launch_xml.parser
import launch_yaml.parser
import yaml
from launch.launch_description_source import LaunchDescriptionSource

from tfcompose.compiler.urdf.read import read_xml
from tfcompose.foundation.findings import RejectedError
from tfcompose.tools.importers.launch_records import IDS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

#: As what launch runs each launch file in Python.
_MODULE = "python_launch_file"
_MODULES = (
    "launch.actions",
    "launch.conditions",
    "launch.event_handlers",
    "launch.events",
    "launch.events.process",
    "launch.launch_description_sources",
    "launch.substitutions",
    "launch_ros.actions",
    "launch_ros.descriptions",
    "launch_ros.event_handlers",
    "launch_ros.events.lifecycle",
    "launch_ros.parameter_descriptions",
    "launch_ros.substitutions",
)
#: The lines of elements of XML and of mappings and lists of YAML, by their ids; they live as long
#: as this process.
_LINES: dict[int, int] = {}
_ALIVE: list[Any] = []
#: The files and lines of the entities that are being parsed.
_PLACES: list[tuple[str, int]] = []


def attach() -> None:
    """Make launch's objects record their arguments and their lines."""
    for kind in _classes():
        if kind.__init__ is not object.__init__:  # type: ignore[misc]
            _keep(kind)
    launch.frontend.Parser.parse_action = _with_line(launch.frontend.Parser.parse_action)
    component = launch_ros.descriptions.ComposableNode
    component.parse = classmethod(_component_with_line(component.parse.__func__))
    launch.frontend.Parser.load_parser_implementations()
    launch.frontend.Parser.load_launch_extensions()
    launch_xml.parser.ET = types.SimpleNamespace(
        parse=_xml_with_lines, **_names_of(launch_xml.parser.ET)
    )
    launch_yaml.parser.yaml = types.SimpleNamespace(safe_load=_yaml_with_lines)


def arguments_of(made: Any) -> Mapping[str, Any]:
    """Return an object's constructor arguments, by parameter name.

    For an object of a derived class, the arguments that it passes to launch's class.
    """
    if "_made_of" not in vars(made):
        return {}
    signature, args, kwargs = vars(made)["_made_of"][1]
    bound = signature.bind_partial(made, *args, **kwargs)
    arguments: dict[str, Any] = {}
    for name, value in bound.arguments.items():
        if signature.parameters[name].kind is inspect.Parameter.VAR_KEYWORD:
            arguments |= value
        else:
            arguments[name] = value
    return arguments


def class_name(made: Any) -> str:
    """Return the name of the launch class that an object is an instance of."""
    name: str = vars(made).get("_made_of", (type(made).__name__,))[0]
    return name


def place_of(made: Any) -> tuple[str, int]:
    """Return the file and line that created an object."""
    place: tuple[str, int] = vars(made).get("_made_at", ("", 1))
    return place


def id_of(action: Any) -> int:
    """Return the number that identifies an action in records."""
    number: int = vars(action).setdefault("_recorded_as", next(IDS))
    return number


def reason(error: BaseException) -> str:
    """Return an exception's message on one line, with the line of the launch file."""
    trace, line = error.__traceback__, 0
    while trace is not None:
        if trace.tb_frame.f_globals.get("__name__") == _MODULE:
            line = trace.tb_lineno
        trace = trace.tb_next
    text = " ".join(f"{type(error).__name__}: {error}".split())
    return f"it stopped at line {line}: {text}" if line else text


def line_of(error: BaseException, path: str) -> int:
    """Return the line of a file at which an exception stopped it, 0 if unknown."""
    if isinstance(error, ET.ParseError):
        return int(error.position[0])
    if mark := getattr(error, "problem_mark", None):
        return int(mark.line) + 1
    if parsed := vars(error).get("_parsed_at"):
        return int(parsed[1])
    trace, line = error.__traceback__, 0
    while trace is not None:
        line = trace.tb_lineno if trace.tb_frame.f_code.co_filename == path else line
        trace = trace.tb_next
    return line


def here() -> tuple[str, int]:
    """Return the file and line of the launch file being run or parsed, or no file."""
    frame: Any = sys._getframe(1)  # noqa: SLF001 (CPython's only way)
    while frame is not None and frame.f_globals.get("__name__") != _MODULE:
        frame = frame.f_back
    if frame is not None:
        return frame.f_code.co_filename, frame.f_lineno
    return _PLACES[-1] if _PLACES else ("", 1)


@contextlib.contextmanager
def parsing(path: str) -> Iterator[None]:
    """Give objects made meanwhile their places in a file that is being parsed."""
    _PLACES.append((path, 1))
    try:
        yield
    finally:
        _PLACES.pop()


def _classes() -> Iterator[type]:
    known = {
        launch.Action: None,
        launch.Substitution: None,
        launch.Condition: None,
        LaunchDescriptionSource: None,
    }
    for name in _MODULES:
        try:
            module = importlib.import_module(name)
        except ImportError:  # of another version
            continue
        for kind in vars(module).values():
            if isinstance(kind, type) and kind.__module__.partition(".")[0] in {
                "launch",
                "launch_ros",
            }:
                known[kind] = None
    yield from known


def _keep(kind: type) -> None:
    """Let the objects of a class keep what they were made of, and where."""
    init = kind.__init__  # type: ignore[misc]
    signature = inspect.signature(init)

    @functools.wraps(init)
    def keep(self: Any, *args: Any, **kwargs: Any) -> None:
        vars(self).setdefault("_made_of", (kind.__name__, (signature, args, kwargs)))
        vars(self).setdefault("_made_at", here())
        init(self, *args, **kwargs)

    kind.__init__ = keep  # type: ignore[misc]


def _with_line(parse: Callable[..., Any]) -> Callable[..., Any]:
    """Return a method that parses its last argument, an entity, whose line what it makes has."""

    @functools.wraps(parse)
    def parsed(*args: Any) -> Any:
        with _at(args[-1]):
            return parse(*args)

    return parsed


def _component_with_line(parse: Callable[..., Any]) -> Callable[..., Any]:
    """Return the same for components, of which parsing gives the class and what one is made of."""

    @functools.wraps(parse)
    def parsed(*args: Any) -> Any:
        with _at(args[-1]):
            kind, kwargs = parse(*args)

        def make(**kwargs: Any) -> Any:
            with _at(args[-1]):
                return kind(**kwargs)

        return make, kwargs

    return parsed


@contextlib.contextmanager
def _at(entity: Any) -> Iterator[None]:
    """Let what is made meanwhile have the line of an entity, and what is raised."""
    element = vars(entity).get("_Entity__xml_element", vars(entity).get("_Entity__element"))
    file, line = _PLACES[-1] if _PLACES else ("", 1)
    _PLACES.append((file, _LINES.get(id(element), line)))
    try:
        yield
    except Exception as error:
        vars(error).setdefault("_parsed_at", _PLACES[-1])
        raise
    finally:
        _PLACES.pop()


def _names_of(module: Any) -> dict[str, Any]:
    return {
        name: value
        for name, value in vars(module).items()
        if name != "parse" and not name.startswith("__")
    }


def _xml_with_lines(file: Any) -> Any:
    """Return the tree of an XML file whose elements have lines."""
    text = file.read()
    root = ET.fromstring(text)  # noqa: S314 (as launch does; this process is confined)
    with contextlib.suppress(RejectedError):  # launch reads what has no lines then
        lines = _lines_of(read_xml(text, getattr(file, "name", "")))
        _LINES.update(zip(map(id, root.iter()), lines, strict=False))
    _ALIVE.append(root)
    return ET.ElementTree(root)


def _lines_of(element: Any) -> Iterator[int]:
    yield element.span.line
    for child in element.children:
        yield from _lines_of(child)


class _Loader(yaml.SafeLoader):
    """Keeps the lines of what stands under a key."""


def _mapping(loader: _Loader, node: Any) -> Any:
    made = loader.construct_mapping(node, deep=True)
    _LINES[id(made)] = node.start_mark.line + 1
    for key, _ in node.value:
        value = made.get(loader.construct_object(key))
        if isinstance(value, (dict, list)):
            _LINES[id(value)] = key.start_mark.line + 1
    return made


_Loader.add_constructor("tag:yaml.org,2002:map", _mapping)


def _yaml_with_lines(file: Any) -> Any:
    """Return the data of a YAML file whose mappings and lists have lines."""
    data = yaml.load(file, Loader=_Loader)  # noqa: S506 (it is a safe one)
    _ALIVE.append(data)
    return data
