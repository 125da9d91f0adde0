"""Records what ROS's own ``launch`` would start, where it is installed, without starting anything.

Launch parses the file, checks what its actions are given, and evaluates its substitutions,
conditions and groups, those of other packages included. Each of its objects keeps what it was made
of, and the line; when one is visited that starts something, its counterpart of the stand-in
records it. So both readers give the same records.

This runs in the process that reads launch files (``launch_process``).
"""

from __future__ import annotations

import contextlib
import functools
import importlib
import logging
import os
import sys
import tempfile
import types
from collections.abc import Callable, Iterator, Mapping
from typing import Any
from xml.etree import ElementTree as ET

import launch
import launch.frontend
import launch.logging
import launch_ros.descriptions
import launch_xml.parser
import launch_yaml.parser
import yaml
from launch.events import Shutdown, matches_action
from launch.launch_description_source import LaunchDescriptionSource

from tfcompose.tools.importers import launch_actions as actions
from tfcompose.tools.importers import launch_conditions as conditions
from tfcompose.tools.importers import launch_substitutions as substitutions
from tfcompose.tools.importers.launch_substitutions import Context, FailedError, place, text_of
from tfcompose.tools.importers.launch_texts import Entity, of_xml

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
#: What launch evaluates or does itself, though the stand-in has a counterpart.
_OWN_WORK = frozenset({"GroupAction", "ParameterSubstitution", "LocalSubstitution"})
#: Substitutions whose result is not launch's: packages that are not found, commands that are not
#: run, arguments.
_REPLACED = frozenset(
    {
        "LaunchConfiguration",
        "LaunchConfigAsBool",
        "EnvironmentVariable",
        "PathJoinSubstitution",
        "FindPackageShare",
        "FindPackagePrefix",
        "FindPackage",
        "FindExecutable",
        "ExecutableInPackage",
        "Command",
        "FileContent",
        "AnonName",
        "LaunchLogDir",
        "ThisLaunchFile",
        "ThisLaunchFileDir",
    }
)
_ALIASES = {
    "PushROSNamespace": "PushRosNamespace",
    "RosTimer": "TimerAction",
    "FindPackage": "FindPackageShare",
}
_STAND_INS: dict[str, Any] = {
    name: one
    for module in (substitutions, conditions, actions)
    for name, one in vars(module).items()
    if isinstance(one, type) and one.__module__ == module.__name__
}
#: The lines of elements of XML and of mappings and lists of YAML, by their ids; they live as long
#: as this process.
_LINES: dict[int, int] = {}
_ALIVE: list[Any] = []
#: The files and lines of the entities that are being parsed.
_PLACES: list[tuple[str, int]] = []


class RecordingContext(launch.LaunchContext, Context):  # type: ignore[misc]
    """Launch's context, with what the stand-in records beside it."""

    def __init__(self, find: Callable[[str, str], str | None], *, every_branch: bool) -> None:
        launch.LaunchContext.__init__(self, noninteractive=True)
        Context.__init__(self, find, every_branch=every_branch)
        self._scopes: list[tuple[Any, ...]] = []

    @property
    def configurations(self) -> dict[str, str]:
        """The launch configurations, which groups of launch replace."""
        values: dict[str, str] = self.launch_configurations
        return values

    @configurations.setter
    def configurations(self, values: dict[str, str]) -> None:
        kept = dict(values)
        self.launch_configurations.clear()
        self.launch_configurations.update(kept)

    def perform_substitution(self, substitution: Any) -> str:
        """Return the text of a substitution."""
        return text_of(converted(substitution), self)

    def _push_launch_configurations(self) -> None:
        super()._push_launch_configurations()
        self._scopes.append((self.namespace, list(self.params), list(self.remaps)))

    def _pop_launch_configurations(self) -> None:
        super()._pop_launch_configurations()
        self.namespace, self.params, self.remaps = self._scopes.pop()

    def _push_environment(self) -> None:
        super()._push_environment()
        self._scopes.append((dict(self.variables),))

    def _pop_environment(self) -> None:
        super()._pop_environment()
        (self.variables,) = self._scopes.pop()

    def _reset_environment(self) -> None:
        super()._reset_environment()
        self.variables = {}


# What launch's objects are made of


def _here() -> tuple[str, int]:
    """Return where a launch file makes something.

    The line of a program, or that of the entity that is parsed.
    """
    return place() if not _PLACES or place()[0] else _PLACES[-1]


def _keep(kind: type) -> None:
    """Let the objects of a class keep what they were made of, and where."""
    init = kind.__init__  # type: ignore[misc]

    @functools.wraps(init)
    def kept(self: Any, *args: Any, **kwargs: Any) -> None:
        vars(self).setdefault("_made_of", []).append((kind.__name__, args, kwargs))
        vars(self).setdefault("_made_at", _here())
        init(self, *args, **kwargs)

    kind.__init__ = kept  # type: ignore[misc]


def _replace(kind: type) -> None:
    """Let the counterpart give the text of a substitution."""
    performed = kind.perform  # type: ignore[attr-defined]

    def perform(self: Any, context: Any) -> Any:
        if type(self) is kind and isinstance(context, RecordingContext):
            return text_of(converted(self), context)
        return performed(self, context)

    kind.perform = perform  # type: ignore[attr-defined]


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
        for one in vars(module).values():
            if isinstance(one, type) and one.__module__.partition(".")[0] in {
                "launch",
                "launch_ros",
            }:
                known[one] = None
    yield from known


def attach() -> None:
    """Let launch's classes keep what the recorder needs, and record instead of starting anything.

    Nothing is logged: launch would make a folder for its log, which it may not.
    """
    config = launch.logging.launch_config
    config.log_dir = tempfile.gettempdir()
    config.log_handler_factory = lambda *_args, **_kwargs: logging.NullHandler()
    for kind in _classes():
        if kind.__init__ is not object.__init__:  # type: ignore[misc]
            _keep(kind)
        if kind.__name__ in _REPLACED and issubclass(kind, launch.Substitution):
            _replace(kind)
    launch.Action.visit = lambda self, context: converted(self).visit(context)
    launch.frontend.Parser.parse_action = _placed(launch.frontend.Parser.parse_action)
    component = launch_ros.descriptions.ComposableNode
    component.parse = classmethod(_placed_component(component.parse.__func__))
    launch.frontend.Parser.load_parser_implementations()
    launch.frontend.Parser.load_launch_extensions()
    launch_xml.parser.ET = types.SimpleNamespace(
        parse=_xml_with_lines, **_names_of(launch_xml.parser.ET)
    )
    launch_yaml.parser.yaml = types.SimpleNamespace(safe_load=_yaml_with_lines)

    def matching(target_action: Any) -> Any:
        matches = matches_action(target_action)
        vars(matches)["action"] = target_action
        return matches

    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] in {"launch", "launch_ros"} and hasattr(
            module, "matches_action"
        ):
            vars(module)["matches_action"] = matching


def _placed(parse: Callable[..., Any]) -> Callable[..., Any]:
    """Return a method that parses its last argument, an entity, whose line what it makes has."""

    @functools.wraps(parse)
    def parsed(*args: Any) -> Any:
        with _at(args[-1]):
            return parse(*args)

    return parsed


def _placed_component(parse: Callable[..., Any]) -> Callable[..., Any]:
    """Return the same for components, of which parsing gives the class and what one is made of."""

    @functools.wraps(parse)
    def parsed(*args: Any) -> Any:
        kind, kwargs = parse(*args)

        def make(**kwargs: Any) -> Any:
            with _at(args[-1]):
                return kind(**kwargs)

        return make, kwargs

    return parsed


@contextlib.contextmanager
def _at(entity: Any) -> Iterator[None]:
    """Let what is made meanwhile have the line of an entity."""
    element = vars(entity).get("_Entity__xml_element", vars(entity).get("_Entity__element"))
    file, line = _PLACES[-1] if _PLACES else ("", 1)
    _PLACES.append((file, _LINES.get(id(element), line)))
    try:
        yield
    finally:
        _PLACES.pop()


def _names_of(module: Any) -> dict[str, Any]:
    return {
        name: one
        for name, one in vars(module).items()
        if name != "parse" and not name.startswith("__")
    }


def _xml_with_lines(file: Any) -> Any:
    """Return the tree of an XML file whose elements have lines."""
    text = file.read()
    root = ET.fromstring(text)  # noqa: S314 (as launch does; this process is confined)

    def walk(entities: list[Entity]) -> Iterator[Entity]:
        for one in entities:
            yield one
            yield from walk(one.children)

    if root.tag == "launch":
        several = walk(of_xml(text, getattr(file, "name", "")))
        _LINES.update(
            zip(map(id, list(root.iter())[1:]), (one.at[1] for one in several), strict=False)
        )
    _ALIVE.append(root)
    return ET.ElementTree(root)


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


def parsed_text(path: str) -> Any:
    """Return the launch description of an XML or YAML file.

    Raises:
        FailedError: if launch refuses it.
    """
    _PLACES.append((path, 1))
    try:
        root, parser = launch.frontend.Parser.load(path)
        return parser.parse_description(root)
    except FailedError:
        raise
    except Exception as error:  # noqa: BLE001 (launch raises what it likes)
        raise FailedError(_reason(error)) from None
    finally:
        _PLACES.pop()


def _reason(error: BaseException) -> str:
    """Return what an exception of launch's says, in one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())


# Counterparts


def converted(value: Any) -> Any:
    """Return the stand-in's counterpart of what launch was given.

    Of objects, and of lists and mappings of them.
    """
    if isinstance(value, (str, int, float, bool, os.PathLike)) or value is None:
        return value
    if isinstance(value, Mapping):
        return {converted(key): converted(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return (
            type(value)(map(converted, value))
            if type(value) in {list, tuple}
            else list(map(converted, value))
        )
    if isinstance(value, substitutions.Substitution | actions.Action):
        return value
    attributes = getattr(value, "__dict__", {})
    if "_counterpart" not in attributes:
        if "_made_of" not in attributes and not isinstance(
            value, launch.Action | launch.Substitution
        ):
            return _other(value)
        attributes["_counterpart"] = _counterpart(value)
    return attributes["_counterpart"]


def _other(value: Any) -> Any:
    """Return what has no counterpart; of a matcher of an action, the action's."""
    action = getattr(value, "action", None)
    return actions.Matcher(converted(action)) if isinstance(action, launch.Action) else value


def _counterpart(value: Any) -> Any:
    made_of = getattr(value, "_made_of", [])
    if stand_in := getattr(type(value), "STAND_IN", None):
        made = stand_in(*converted(made_of[0][1]), **converted(made_of[0][2]))
        made.at = value._made_at  # noqa: SLF001 (the recorder's own)
        return made
    name, args, kwargs = next(
        (one for one in made_of if _name(one[0]) in _STAND_INS and one[0] not in _OWN_WORK),
        ("", (), {}),
    )
    if isinstance(value, launch.Event):
        return _event(value, name, args, kwargs)
    if isinstance(value, launch.Substitution):
        return _substitution(value, name, args, kwargs)
    if isinstance(value, launch.Condition):
        return _condition(value, name, args, kwargs)
    if isinstance(value, LaunchDescriptionSource):
        _, args, kwargs = next(one for one in made_of if one[0] != "LaunchDescriptionSource")
        return actions.LaunchDescriptionSource(*converted(args), **converted(kwargs))
    is_base = _STAND_INS.get(_name(name)) in {None, actions.Action}
    if is_base:
        made = _Own(value)
    elif name == "OpaqueFunction":  # what its function is given, it gives to launch
        made = actions.OpaqueFunction(*args, **kwargs)
    else:
        made = _STAND_INS[_name(name)](*converted(args), **converted(kwargs))
    made.at = getattr(value, "_made_at", ("", 1))
    if isinstance(value, launch.Action):
        made.condition = converted(value.condition)
    return made


def _name(name: str) -> str:
    return _ALIASES.get(name, name)


class _Own(actions.Action):
    """An action that launch does itself, or that is another package's.

    What it gives is visited.
    """

    def __init__(self, action: Any) -> None:
        super().__init__()
        self.action = action

    def execute(self, context: Context) -> None:
        if isinstance(self.action, launch.actions.ExecuteLocal):
            raise FailedError("it starts a process in a way that is not known here")
        if isinstance(self.action, launch.actions.ResetLaunchConfigurations):
            context.namespace, context.params, context.remaps = None, [], []
        try:
            made = self.action.execute(context)
        except FailedError:
            raise
        except Exception as error:  # noqa: BLE001 (an action of any package)
            raise FailedError(_reason(error)) from None
        actions.visit_all(made, context)

    def described(self, context: Context) -> str:
        for name, args, kwargs in getattr(self.action, "_made_of", ()):
            if name == "GroupAction":
                return actions.GroupAction(*converted(args), **converted(kwargs)).described(
                    context
                )
        return type(self.action).__name__


def _substitution(value: Any, name: str, args: Any, kwargs: Any) -> Any:
    stand_in = _STAND_INS.get(_name(name), substitutions.Substitution)
    if (
        stand_in.__init__ is substitutions.Substitution.__init__
    ):  # which has what it is made of in order
        args, kwargs = (*args, *kwargs.values()), {}
    made = stand_in(*converted(args), **converted(kwargs))
    made.at = getattr(value, "_made_at", ("", 1))
    if stand_in.__name__ in _REPLACED:
        return made
    made.perform = functools.partial(_evaluated, value.perform)
    if stand_in is substitutions.Substitution:
        made.describe = value.describe
    return made


def _evaluated(evaluate: Callable[[Any], Any], context: Any) -> Any:
    try:
        return evaluate(context)
    except FailedError:
        raise
    except Exception as error:  # noqa: BLE001 (launch's, or another package's)
        raise FailedError(_reason(error)) from None


def _condition(value: Any, name: str, args: Any, kwargs: Any) -> Any:
    stand_in = _STAND_INS.get(name, conditions.Condition)
    made = (
        stand_in(*converted(args), **converted(kwargs)) if name else stand_in(type(value).__name__)
    )
    if stand_in in {conditions.IfCondition, conditions.UnlessCondition, conditions.Condition}:
        made.evaluate = functools.partial(_evaluated, value.evaluate)
    return made


def _event(value: Any, name: str, args: Any, kwargs: Any) -> Any:
    if isinstance(value, Shutdown):
        return actions.ShutdownEvent()
    if name == "ChangeState":
        return actions.ChangeState(*converted(args), **converted(kwargs))
    return type(type(value).__name__, (), {})()


def as_substitution(stand_in: type) -> type:
    """Return a substitution of launch's whose counterpart is that one.

    For packages that are not installed.
    """
    kind = type(
        stand_in.__name__,
        (launch.Substitution,),
        {"STAND_IN": stand_in, "__init__": _no_arguments},
    )
    _keep(kind)
    kind.perform = lambda self, context: text_of(converted(self), context)  # type: ignore[attr-defined]
    return kind


def _no_arguments(self: Any, *_args: Any, **_kwargs: Any) -> None:
    launch.Substitution.__init__(self)
