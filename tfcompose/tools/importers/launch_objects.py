"""Recording of the constructor arguments and the locations of launch's objects.

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

#: The module name with which launch runs each Python launch file.
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
#: The lines of XML elements and of YAML mappings and lists, by Python's ``id``. These objects
#: exist until the process ends, so their ids stay valid.
_LINES: dict[int, int] = {}
_ALIVE: list[Any] = []
#: A stack of the files and lines of the entities that are being parsed.
_PLACES: list[tuple[str, int]] = []


def attach() -> None:
    """Make each new object of launch record its constructor arguments and its location."""
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
    """Return the constructor arguments of an object, by parameter name.

    If the object's class is derived from a class of launch, return the arguments for the class of
    launch.
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
    """Return the file and line at which the launch file creates an object."""
    place: tuple[str, int] = vars(made).get("_made_at", ("", 1))
    return place


def id_of(action: Any) -> int:
    """Return the number that identifies an action in records."""
    number: int = vars(action).setdefault("_recorded_as", next(IDS))
    return number


def reason(error: BaseException) -> str:
    """Return an exception's message as a single line, with the line of the launch file."""
    trace, line = error.__traceback__, 0
    while trace is not None:
        if trace.tb_frame.f_globals.get("__name__") == _MODULE:
            line = trace.tb_lineno
        trace = trace.tb_next
    text = " ".join(f"{type(error).__name__}: {error}".split())
    return f"it stopped at line {line}: {text}" if line else text


def line_of(error: BaseException, path: str) -> int:
    """Return the line at which an exception stopped a file; 0 if unknown."""
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
    """Return the file and line of the launch file that is running or being parsed.

    The file is empty if there is none.
    """
    frame: Any = sys._getframe(1)  # noqa: SLF001 (CPython's only way)
    while frame is not None and frame.f_globals.get("__name__") != _MODULE:
        frame = frame.f_back
    if frame is not None:
        return frame.f_code.co_filename, frame.f_lineno
    return _PLACES[-1] if _PLACES else ("", 1)


@contextlib.contextmanager
def parsing(path: str) -> Iterator[None]:
    """Set the file that is being parsed, for a ``with`` block.

    New objects get their locations in this file.
    """
    _PLACES.append((path, 1))
    try:
        yield
    finally:
        _PLACES.pop()


def _classes() -> Iterator[type]:
    readers = {
        launch.Action: None,
        launch.Substitution: None,
        launch.Condition: None,
        LaunchDescriptionSource: None,
    }
    for name in _MODULES:
        try:
            module = importlib.import_module(name)
        except ImportError:  # this version of launch does not have it
            continue
        for kind in vars(module).values():
            if isinstance(kind, type) and kind.__module__.partition(".")[0] in {
                "launch",
                "launch_ros",
            }:
                readers[kind] = None
    yield from readers


def _keep(kind: type) -> None:
    """Make new objects of a class keep their constructor arguments and their location."""
    init = kind.__init__  # type: ignore[misc]
    signature = inspect.signature(init)

    @functools.wraps(init)
    def keep(self: Any, *args: Any, **kwargs: Any) -> None:
        vars(self).setdefault("_made_of", (kind.__name__, (signature, args, kwargs)))
        vars(self).setdefault("_made_at", here())
        init(self, *args, **kwargs)

    kind.__init__ = keep  # type: ignore[misc]


def _with_line(parse: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a parsing method so that its result has the line of the parsed entity.

    The entity is the last argument of the method.
    """

    @functools.wraps(parse)
    def parsed(*args: Any) -> Any:
        with _located_at(args[-1]):
            return parse(*args)

    return parsed


def _component_with_line(parse: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap the parsing method of components like ``_with_line``.

    This method returns the class and the constructor arguments instead of an object.
    """

    @functools.wraps(parse)
    def parsed(*args: Any) -> Any:
        with _located_at(args[-1]):
            kind, kwargs = parse(*args)

        def make(**kwargs: Any) -> Any:
            with _located_at(args[-1]):
                return kind(**kwargs)

        return make, kwargs

    return parsed


@contextlib.contextmanager
def _located_at(entity: Any) -> Iterator[None]:
    """Set the entity that is being parsed, for a ``with`` block.

    New objects and exceptions get the line of this entity.
    """
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
    """Return the tree of an XML file, after recording the lines of its elements."""
    text = file.read()
    root = ET.fromstring(text)  # noqa: S314 (as launch does; this process is confined)
    with contextlib.suppress(RejectedError):  # launch then reads the file without lines
        lines = _lines_of(read_xml(text, getattr(file, "name", "")))
        _LINES.update(zip(map(id, root.iter()), lines, strict=False))
    _ALIVE.append(root)
    return ET.ElementTree(root)


def _lines_of(element: Any) -> Iterator[int]:
    yield element.span.line
    for child in element.children:
        yield from _lines_of(child)


class _Loader(yaml.SafeLoader):
    """A YAML loader that records the lines of mappings and lists."""


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
    """Return the data of a YAML file, after recording the lines of its mappings and lists."""
    data = yaml.load(file, Loader=_Loader)  # noqa: S506 (it is a safe one)
    _ALIVE.append(data)
    return data
