"""Recorder of the actions that ROS's own ``launch`` would execute.

Launch parses the file, checks the arguments of its actions, and evaluates substitutions,
conditions and groups, including classes of other packages. The recorder visits each action. If the
action would start a process, the recorder adds a record instead. This module runs in the process
that reads launch files (``launch_process``).
"""

from __future__ import annotations

import logging
import os
import posixpath
import re
import shlex
import sys
import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import launch
import launch.actions
import launch.frontend
import launch.logging
import launch_ros.actions
import launch_ros.descriptions
import yaml
from launch import event_handlers, substitutions
from launch.events import Shutdown, matches_action
from launch.launch_description_source import LaunchDescriptionSource
from launch.launch_description_sources import get_launch_description_from_python_launch_file
from launch_ros.event_handlers import OnStateTransition
from launch_ros.events.lifecycle import ChangeState
from launch_ros.substitutions import ExecutableInPackage
from launch_ros.utilities import make_namespace_absolute, prefix_namespace

from tfcompose.model.process_keys import Keyword, KeywordKind, launch_keywords
from tfcompose.tools.importers import launch_objects as objects
from tfcompose.tools.importers.launch_context import RecordingContext
from tfcompose.tools.importers.launch_objects import arguments_of, id_of, place_of
from tfcompose.tools.importers.launch_parameters import (
    describe,
    describe_condition,
    evaluate,
    is_true,
    keep_text,
    optional_text,
    parameter_value,
    parameters_of,
    text_of,
    when_of,
)
from tfcompose.tools.importers.launch_records import (
    PACKAGE,
    FailedError,
    of_command,
    relative,
    with_package,
)
from tfcompose.tools.importers.texts import Text, argument_of


def attach() -> None:
    """Make launch record actions instead of executing them.

    This also turns launch's logging off, because launch would create a log folder, which the
    sandbox forbids.
    """
    config = launch.logging.launch_config
    config.log_dir = tempfile.gettempdir()
    config.log_handler_factory = lambda *_args, **_kwargs: logging.NullHandler()
    objects.attach()
    launch.Action.visit = _visit
    for kind, perform in _PERFORMED.items():
        kind.perform = perform
    _note_decisions(substitutions.LaunchConfiguration)

    def matching(target_action: Any) -> Any:
        matches = matches_action(target_action)
        vars(matches)["action"] = target_action
        return matches

    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] in {"launch", "launch_ros"} and hasattr(
            module, "matches_action"
        ):
            vars(module)["matches_action"] = matching


def description_of(path: str) -> Any:
    """Return the launch description of a file.

    Raises:
        FailedError: if launch refuses it.
    """
    try:
        if path.endswith(".py"):
            return get_launch_description_from_python_launch_file(path)
        with objects.parsing(path):
            root, parser = _parse(path)
            return parser.parse_description(root)
    except (FailedError, MemoryError):
        raise
    except SyntaxError as error:
        # an error of the XML parser has no lineno
        line = error.lineno or objects.line_of(error, path)
        raise FailedError(str(error.msg), line) from None
    except BaseException as error:  # noqa: BLE001 (any can come out of it)
        text = " ".join(f"{type(error).__name__}: {error}".split())
        raise FailedError(text, objects.line_of(error, path)) from None


def _parse(path: str) -> tuple[Any, Any]:
    """Return the root entity of an XML or YAML launch file, and its parser.

    Launch itself tries all parsers and reports the errors of all. This function uses only the
    parser for the file's format, so that the error is about this format.
    """
    parsers = launch.frontend.Parser.get_parsers_from_filename(path)
    with Path(path).open(encoding="utf-8-sig") as file:
        if len(parsers) != 1:
            kind = "xml" if file.read().lstrip().startswith("<") else "yaml"
            file.seek(0)
            parsers = [launch.frontend.Parser.frontend_parsers[kind]]
        loaded: tuple[Any, Any] = parsers[0].load(file)
        return loaded


# Substitutions whose text depends on this machine or on the output of a program


def _command(self: Any, context: Any) -> str:
    text = text_of(self.command, context)
    try:
        argv = shlex.split(text)
    except ValueError as error:
        raise FailedError(f"the command {text}: {error}") from None
    return of_command(argv, text)


_PERFORMED: dict[Any, Callable[[Any, Any], str]] = {
    substitutions.Command: _command,
    substitutions.FindExecutable: lambda self, context: text_of(self.name, context),
    substitutions.AnonName: lambda self, context: text_of(arguments_of(self)["name"], context),
    substitutions.LaunchLogDir: lambda _self, _context: "~/.ros/log",
    ExecutableInPackage: lambda self, context: text_of(self.executable, context),
}


def _note_decisions(kind: Any) -> None:
    """Make a substitution record the launch argument whose value it reads.

    The value of such an argument is fixed in the robot file.
    """
    performed = kind.perform

    def perform(self: Any, context: Any) -> Any:
        value = performed(self, context)
        if isinstance(context, RecordingContext):
            name = text_of(self.variable_name, context)
            context.decided |= {name} & context.declared.keys()
        return value

    kind.perform = perform


# Visiting


def visit_all(entities: Any, context: RecordingContext) -> None:
    """Visit the entities in the order in which launch would execute them."""
    if entities is None:
        return
    for entity in entities if isinstance(entities, (list, tuple)) else [entities]:
        if isinstance(entity, (list, tuple)):
            visit_all(entity, context)
        elif hasattr(entity, "visit"):
            visit_all(entity.visit(context), context)
        elif entity is not None:
            context.todo(context.place, f"{type(entity).__name__} is not an action")


def _visit(action: Any, context: RecordingContext) -> None:
    """Visit an action if its condition is true."""
    handler = next((_HANDLERS[kind] for kind in type(action).__mro__ if kind in _HANDLERS), None)
    condition = getattr(action, "condition", None)
    _if_holds(action, condition, lambda: (handler or _let_launch)(action, context), context)


def _if_holds(
    made: Any, condition: Any, execute: Callable[[], None], context: RecordingContext
) -> None:
    """Call ``execute`` if the condition is true.

    If the import reads all branches, call it in any case.
    """
    place = context.place = place_of(made)
    if condition is None:
        _execute(made, execute, context)
        return
    when = when_of(condition, context) if context.every_branch else None
    if when:
        context.whens.append(f"({when})" if " or " in when or " and " in when else when)
        try:
            _execute(made, execute, context)
        finally:
            context.whens.pop()
        return
    text = describe_condition(condition)
    try:
        holds = bool(evaluate(condition.evaluate, context))
        if isinstance(condition, launch.conditions.LaunchConfigurationEquals):
            name = describe(arguments_of(condition)["launch_configuration_name"])
            context.decided |= {name} & context.declared.keys()
    except FailedError as error:
        context.todo(place, f"{describe_action(made)} if {text}: {error}")
        return
    if not holds and not context.every_branch:
        context.record("skipped", place, text=f"{describe_action(made)} only if {text}")
        return
    if context.every_branch:
        context.todo(place, f"the condition of {describe_action(made)}: {text}")
    context.conditions.append(text if holds else f"{text}, which does not hold")
    try:
        _execute(made, execute, context)
    finally:
        context.conditions.pop()


def _execute(made: Any, execute: Callable[[], None], context: RecordingContext) -> None:
    place = place_of(made)
    try:
        execute()
    except FailedError as error:
        context.todo(place, f"{describe_action(made)}: {error}")
    except (TypeError, ValueError, AttributeError, LookupError) as error:
        # an argument of the action has the wrong type
        context.todo(place, f"{describe_action(made)}: {type(error).__name__}: {error}")


def _let_launch(action: Any, context: RecordingContext) -> None:
    """Let launch execute an action, and visit the entities that it returns."""
    if isinstance(action, launch.actions.ExecuteLocal):
        raise FailedError("it starts a process in an unknown way")
    visit_all(evaluate(action.execute, context), context)


def describe_action(made: Any) -> str:
    """Return a readable description of an action."""
    for kind, describe_it in _DESCRIBED:
        if isinstance(made, kind):
            return describe_it(arguments_of(made))
    if isinstance(made, launch.actions.IncludeLaunchDescription):
        return f"the included {_describe_location(made)}"
    if isinstance(made, launch.actions.EmitEvent):
        return f"the event {type(made.event).__name__}"
    return str(getattr(made, "NAME", type(made).__name__))


def _describe_components(arguments: Mapping[str, Any]) -> str:
    container = arguments["target_container"]
    if isinstance(container, launch.Action):
        container = arguments_of(container).get("name")
    count = len(list(arguments["composable_node_descriptions"] or ()))
    return f"{count} component{'' if count == 1 else 's'} for {describe(container)}"


def _describe_node(arguments: Mapping[str, Any]) -> str:
    return f"the node {describe(arguments.get('package'))}/{describe(arguments['executable'])}"


#: Functions that return a readable description of an action, by class. A derived class comes
#: before its base class.
_DESCRIBED: tuple[tuple[type, Callable[[Mapping[str, Any]], str]], ...] = (
    (
        launch.actions.DeclareLaunchArgument,
        lambda arguments: f"the launch argument {describe(arguments['name'])}",
    ),
    (
        launch.actions.GroupAction,
        lambda arguments: f"a group of {len(list(arguments['actions']))}",
    ),
    (
        launch.actions.TimerAction,
        lambda arguments: f"a timer with {len(list(arguments['actions']))} actions",
    ),
    (
        launch.actions.OpaqueFunction,
        lambda arguments: f"the function {getattr(arguments['function'], '__name__', '')}",
    ),
    (launch_ros.actions.Node, _describe_node),
    (launch.actions.ExecuteProcess, lambda arguments: f"the process {describe(arguments['cmd'])}"),
    (launch_ros.actions.LoadComposableNodes, _describe_components),
    (
        launch_ros.descriptions.ComposableNode,
        lambda arguments: f"the component {describe(arguments['plugin'])}",
    ),
)


# Arguments and settings


def _declare(action: Any, context: RecordingContext) -> None:
    evaluate(action.execute, context)
    if context.depth > 1:
        return
    arguments, name = arguments_of(action), str(action.name)
    value = str(context.launch_configurations[name])
    context.declare(name, value)
    context.record(
        "argument",
        place_of(action),
        name=name,
        default=optional_text(arguments.get("default_value"), context),
        value=value,
        choices=list(action.choices or ()),
        description=str(arguments.get("description") or ""),
        variable=_variable_of(arguments.get("default_value"), context),
    )


def _variable_of(default: Any, context: RecordingContext) -> str:
    """Return the environment variable that sets an argument's default; empty if none does."""
    only = default[0] if isinstance(default, (list, tuple)) and len(default) == 1 else default
    if not isinstance(only, substitutions.EnvironmentVariable):
        return ""
    arguments = arguments_of(only)
    return (
        text_of(arguments["name"], context) if arguments.get("default_value") is not None else ""
    )


def _set_configuration(action: Any, context: RecordingContext) -> None:
    evaluate(action.execute, context)
    arguments = arguments_of(action)
    context.declared.pop(text_of(arguments.get("name", ""), context), None)


def _unset_variable(action: Any, context: RecordingContext) -> None:
    name = text_of(arguments_of(action)["name"], context)
    if context.is_inherited(name) or name not in os.environ:
        context.todo(place_of(action), f"the environment variable {name} is unset")
    evaluate(action.execute, context)


def _append_variable(action: Any, context: RecordingContext) -> None:
    arguments = arguments_of(action)
    name = text_of(arguments["name"], context)
    if name in context.variables:
        evaluate(action.execute, context)
        return
    value = relative(with_package(text_of(arguments["value"], context)))
    context.todo(place_of(action), f"{value} is appended to the environment's {name}")


def _set_parameter(action: Any, context: RecordingContext) -> None:
    arguments = arguments_of(action)
    evaluate(action.execute, context)
    name, value = text_of(arguments["name"], context), parameter_value(arguments["value"], context)
    if isinstance(value, str) and not isinstance(value, Text):
        value = yaml.safe_load(value)  # the value is part of a command line
    context.params.append({name: value})


def _set_sim_time(action: Any, context: RecordingContext) -> None:
    evaluate(action.execute, context)
    context.params.append({"use_sim_time": is_true(arguments_of(action)["value"], context)})


def _set_parameter_file(action: Any, context: RecordingContext) -> None:
    context.params.append(with_package(text_of(arguments_of(action)["filename"], context)))


def _reset_configurations(action: Any, context: RecordingContext) -> None:
    context.params = []
    _let_launch(action, context)


# Events


_STATES = {1: "inactive", 3: "active"}


def _emit(action: Any, context: RecordingContext) -> None:
    if isinstance(action.event, ChangeState):
        arguments = arguments_of(action.event)
        node = getattr(arguments.get("lifecycle_node_matcher"), "action", None)
        state = _STATES.get(int(arguments.get("transition_id") or 0))
        if isinstance(node, launch.Action) and state:
            context.record("lifecycle", place_of(action), node=id_of(node), state=state)
            return
    _leave_out(action, context)


def _leave_out(action: Any, context: RecordingContext) -> None:
    context.todo(place_of(action), describe_action(action))


def _ignore(_action: Any, _context: RecordingContext) -> None:
    pass


#: Event handlers that a robot file can express. Each has the names of two parameters, which
#: contain the awaited action and the actions that follow, and the event.
_AFTER: dict[type, tuple[str, str, str]] = {
    event_handlers.OnProcessExit: ("done", "target_action", "on_exit"),
    event_handlers.OnExecutionComplete: ("done", "target_action", "on_completion"),
    event_handlers.OnProcessStart: ("started", "target_action", "on_start"),
    OnStateTransition: ("ready", "target_lifecycle_node", "entities"),
}


def _register(action: Any, context: RecordingContext) -> None:
    handler = arguments_of(action)["event_handler"]
    arguments, place = arguments_of(handler), place_of(action)
    event, of_target, of_entities = _AFTER.get(type(handler), ("", "", ""))
    target, entities = arguments.get(of_target), arguments.get(of_entities)
    entities = entities if isinstance(entities, (list, tuple)) else [entities]
    if not isinstance(target, launch.Action) or any(map(callable, entities)):
        context.todo(place, f"what happens {type(handler).__name__}")
        return
    for entity in entities:
        if event == "done" and _ends_all(entity):
            context.record("required", place, node=id_of(target))
            continue
        before = dict(context.after)
        context.after[str(id_of(target))] = event
        context.visit_later(partial(visit_all, [entity], context))
        context.after = before


def _ends_all(action: Any) -> bool:
    return isinstance(action, launch.actions.EmitEvent) and isinstance(action.event, Shutdown)


def _wait(action: Any, context: RecordingContext) -> None:
    arguments = arguments_of(action)
    text = text_of(arguments["period"], context)
    try:
        period_s = float(text)
    except ValueError:
        raise FailedError(f"{text!r} is not a time") from None
    context.period_s += period_s
    context.visit_later(partial(visit_all, list(arguments["actions"]), context))
    context.period_s -= period_s


# Included files


def _location_of(action: Any) -> Any:
    """Return the path of an included file, or the launch description that replaces the file."""
    source = arguments_of(action)["launch_description_source"]
    if not isinstance(source, LaunchDescriptionSource):
        return source
    arguments = arguments_of(source)
    return arguments.get("launch_file_path") or arguments.get("launch_description") or source


def _describe_location(action: Any) -> str:
    location = _location_of(action)
    parts = location if isinstance(location, (list, tuple)) else [location]
    return relative("".join(map(describe, parts)))


def _include(action: Any, context: RecordingContext) -> None:
    location = _location_of(action)
    if isinstance(location, LaunchDescriptionSource):
        raise FailedError("its source is unknown")
    arguments = _set_arguments(action, context)
    if isinstance(location, launch.LaunchDescription):
        visit_all([location], context)
        return
    path = with_package(text_of(location, context))
    if path.startswith(PACKAGE):
        context.record(
            "include",
            place_of(action),
            file=path,
            args=arguments,
            namespace=_namespace(None, context),
            env=context.variables,
            period=context.period_s,
            after=dict(context.after),
        )
        return
    include(os.path.abspath(path), context)  # noqa: PTH100 (pathlib keeps ..)


def _set_arguments(action: Any, context: RecordingContext) -> dict[str, str]:
    """Set the arguments of an included file, and return their texts with references."""
    values: dict[str, str] = {}
    pairs = arguments_of(action).get("launch_arguments") or ()
    for name, value in pairs.items() if isinstance(pairs, Mapping) else pairs:
        try:
            argument, kept = text_of(name, context), keep_text(value, context)
            text = text_of(value, context)
        except FailedError as error:
            # the included file has a default, or launch reports that it is required
            context.todo(
                place_of(action),
                f"the argument {describe(name)} of {describe_action(action)}: {error}",
            )
            continue
        values[argument] = kept
        context.launch_configurations[argument] = text
        same = argument_of(kept)
        if not same or same.name != argument:
            context.declared.pop(argument, None)
    return values


def include(path: str, context: RecordingContext) -> None:
    """Visit the description of a launch file.

    After the outermost file, also make the delayed visits.

    Raises:
        FailedError: if launch refuses it.
    """
    with context.within(path):
        visit_all([description_of(path)], context)
    while context.later and not context.depth:
        context.later.popleft()()


# Processes


def _process(action: Any, context: RecordingContext) -> None:
    arguments = arguments_of(action)
    program, *argv = arguments["cmd"]
    is_of_package = isinstance(program, ExecutableInPackage)
    of_package = {}
    if is_of_package:
        of_package["package"] = text_of(program.package, context)
        of_package["executable"] = text_of(program.executable, context)
    context.record(
        "process",
        place_of(action),
        argv=[
            keep_text(argument, context)
            for argument in (argv if is_of_package else arguments["cmd"])
        ],
        label=optional_text(arguments.get("name"), context),
        **of_package,
        **_common(action, arguments, context),
    )


def _node(action: Any, context: RecordingContext) -> None:
    _record_node(action, "node", context)


def _lifecycle_node(action: Any, context: RecordingContext) -> None:
    automatic = arguments_of(action).get("autostart") in (True, "true", "True")
    _record_node(action, "node", context, lifecycle="active" if automatic else None)


def _container(action: Any, context: RecordingContext) -> None:
    _record_node(action, "container", context)
    components = arguments_of(action).get("composable_node_descriptions")
    _load(action, components, str(id_of(action)), context)


def _record_node(action: Any, kind: str, context: RecordingContext, **more: Any) -> None:
    """Record a node with all its settings."""
    arguments = arguments_of(action)
    argv = [keep_text(argument, context) for argument in arguments.get("arguments") or ()]
    ros_argv = [text_of(argument, context) for argument in arguments.get("ros_arguments") or ()]
    context.record(
        kind,
        place_of(action),
        executable=text_of(arguments["executable"], context),
        label=optional_text(arguments.get("exec_name"), context),
        argv=argv + (["--ros-args", *ros_argv] if ros_argv else []),
        **_of_node(action, arguments, context),
        **_common(action, arguments, context),
        **more,
    )


def _of_node(
    action: Any, arguments: Mapping[str, Any], context: RecordingContext
) -> dict[str, Any]:
    """Return the settings of a node or component."""
    global_rules = context.launch_configurations.get("ros_remaps", ())
    rules = [
        (text_of(old, context), keep_text(new, context))
        for old, new in arguments.get("remappings") or ()
    ]
    params = parameters_of(arguments.get("parameters"), context, place_of(action))
    return {
        "package": optional_text(arguments.get("package"), context),
        "name": optional_text(arguments.get("name"), context),
        "namespace": _namespace(arguments.get("namespace"), context),
        "params": [*context.params, *params],
        "common": len(context.params),
        "remap": [*global_rules, *rules],
    }


def _namespace(namespace: Any, context: RecordingContext) -> str | None:
    """Return the absolute namespace of a node; None if the launch file sets none."""
    base = context.launch_configurations.get("ros_namespace")
    full: str | None = make_namespace_absolute(
        prefix_namespace(base, optional_text(namespace, context))
    )
    return full


def _common(
    action: Any, arguments: Mapping[str, Any], context: RecordingContext
) -> dict[str, Any]:
    """Return the settings that every process can have."""
    variables = [arguments.get(keyword.name) for keyword in launch_keywords("variables")]
    env = context.variables
    for values in variables:
        env |= _texts(values, context)
    what: dict[str, Any] = {
        "id": id_of(action),
        "env": env,
        "period": context.period_s,
        "after": dict(context.after),
    }
    if variables[-1] is not None:
        what["only_env"] = True
    for keyword in (*launch_keywords(*_READERS), Keyword("shell", "switch")):
        if arguments.get(keyword.name) is not None:
            what[keyword.name] = _READERS[keyword.kind](arguments[keyword.name], context)
    for keyword in launch_keywords("text"):
        if keyword.name == _PREFIX and arguments.get(keyword.name) is None:
            what |= _global_prefix(keyword.attribute, arguments, context)
    for keyword in launch_keywords("shutdown"):
        follows = arguments.get(keyword.name)
        follows = follows if isinstance(follows, (list, tuple)) else [follows]
        follows = [entity for entity in follows if entity is not None]
        if not all(map(_ends_all, follows)):
            context.todo(place_of(action), f"{keyword.name} of a process")
        what[keyword.name] = any(map(_ends_all, follows))
    return what


#: The keyword ``prefix``. Its default is the launch configuration with the name of its attribute.
_PREFIX = "prefix"


def _global_prefix(
    name: str, arguments: Mapping[str, Any], context: RecordingContext
) -> dict[str, str]:
    """Return the prefix from launch configurations, if the program matches their filter."""
    configured = context.launch_configurations
    program = text_of(arguments.get("executable") or arguments["cmd"][0], context)
    is_meant = re.match(configured.get(f"{name}-filter", ""), posixpath.basename(program))
    return {_PREFIX: configured[name]} if name in configured and is_meant else {}


def _texts(values: Any, context: RecordingContext) -> dict[str, str]:
    items = values.items() if isinstance(values, Mapping) else values or ()
    return {text_of(key, context): keep_text(value, context) for key, value in items}


_OUTPUTS = frozenset({"screen", "log", "both", "own_log", "full"})


def _output(value: Any, context: RecordingContext) -> str | list[str]:
    """Return launch's value for ``output``.

    If the value is a mapping of streams, return the list of its destinations.

    Raises:
        FailedError: if launch does not know the value.
    """
    if isinstance(value, Mapping):
        outputs: set[str] = set()
        for places in value.values():
            outputs.update([places] if isinstance(places, str) else places)
        return sorted(outputs)
    place = text_of(value, context)
    if place not in _OUTPUTS:
        raise FailedError(f"output={place!r}")
    return place


#: Functions that read a keyword's value, by kind.
_READERS: dict[KeywordKind, Callable[[Any, RecordingContext], Any]] = {
    "text": text_of,
    "switch": is_true,
    "number": lambda value, context: float(text_of(value, context)),
    "output": _output,
}


# Components


def _load_into(action: Any, context: RecordingContext) -> None:
    arguments = arguments_of(action)
    container = arguments["target_container"]
    if isinstance(container, launch.Action):
        target = str(id_of(container))
    else:
        target = f"/{text_of(container, context).strip('/')}"
    if target == "/":
        raise FailedError("it names no container")
    _load(action, arguments["composable_node_descriptions"], target, context)


def _load(action: Any, components: Any, container: str, context: RecordingContext) -> None:
    """Record components.

    ``container`` is the id of the container's action, or the full name of its node.
    """
    for component in components or ():
        if not isinstance(component, launch_ros.descriptions.ComposableNode):
            context.todo(place_of(action), f"{type(component).__name__} is not a component")
            continue
        condition = arguments_of(component).get("condition")
        _if_holds(
            component,
            condition,
            lambda component=component: _component(component, container, context),  # type: ignore[misc]
            context,
        )


def _component(component: Any, container: str, context: RecordingContext) -> None:
    arguments = arguments_of(component)
    place = place_of(component)
    more = {
        keyword.name: parameters_of(arguments.get(keyword.name), context, place)
        for keyword in launch_keywords("parameters")
    }
    context.record(
        "component",
        place,
        id=id_of(component),
        container=container,
        plugin=text_of(arguments["plugin"], context),
        period=context.period_s,
        after=dict(context.after),
        **_of_node(component, arguments, context),
        **more,
    )


#: Functions that record an action, by its class or the nearest base class.
_HANDLERS: dict[type, Callable[[Any, RecordingContext], None]] = {
    launch.actions.DeclareLaunchArgument: _declare,
    launch.actions.SetLaunchConfiguration: _set_configuration,
    launch.actions.ResetLaunchConfigurations: _reset_configurations,
    launch.actions.UnsetEnvironmentVariable: _unset_variable,
    launch.actions.AppendEnvironmentVariable: _append_variable,
    launch.actions.EmitEvent: _emit,
    launch.actions.RegisterEventHandler: _register,
    launch.actions.TimerAction: _wait,
    launch.actions.IncludeLaunchDescription: _include,
    launch.actions.ExecuteProcess: _process,
    launch.actions.LogInfo: _ignore,
    launch_ros.actions.Node: _node,
    launch_ros.actions.LifecycleNode: _lifecycle_node,
    launch_ros.actions.ComposableNodeContainer: _container,
    launch_ros.actions.LoadComposableNodes: _load_into,
    launch_ros.actions.LifecycleTransition: _leave_out,
    launch_ros.actions.SetParameter: _set_parameter,
    launch_ros.actions.SetUseSimTime: _set_sim_time,
    launch_ros.actions.SetParametersFromFile: _set_parameter_file,
}
