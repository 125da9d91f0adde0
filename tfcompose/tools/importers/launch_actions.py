"""A stand-in for launch's actions that starts nothing.

They know where they were made, and are recorded.

Launch files import it under the names of ``launch`` and ``launch_ros`` in a process of its own
(``launch_process``). How each action behaves was read in those packages' sources.
"""

# ruff: noqa: D101, D102, ARG002, PLR0913 - the classes, methods and their parameters are launch's

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Callable, Mapping
from typing import Any

from tfcompose.model.process_keys import KeywordKind, launch_keywords
from tfcompose.tools.importers.launch_substitutions import (
    MODULE,
    PACKAGE,
    Context,
    EnvironmentVariable,
    FailedError,
    Missing,
    parameter_value,
    parameters_of,
    place,
    plain,
    scalar_of,
    shown,
    symbolic_text,
    text_of,
    truth,
    with_package,
)

#: What tells actions apart in records; Python's ``id`` is given again to another one once an
#: action is gone.
_IDS = itertools.count(1)


class Action:
    """What a launch description consists of; one that is not known is named."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self.at = place()
        self.id = next(_IDS)
        self.condition = kwargs.pop("condition", None)
        self.args, self.kwargs = args, kwargs

    def visit(self, context: Context) -> None:
        """Do what it does, if its condition holds."""
        context.at = self.at
        if self.condition is None:
            self._visited(context)
            return
        when = (
            self.condition.when(context)
            if context.every_branch and hasattr(self.condition, "when")
            else None
        )
        if when:
            context.whens.append(f"({when})" if " or " in when or " and " in when else when)
            try:
                self._visited(context)
            finally:
                context.whens.pop()
            return
        text = self.condition.describe() if hasattr(self.condition, "describe") else "a condition"
        try:
            holds = self.condition.evaluate(context)
        except FailedError as error:
            context.todo(self.at, f"{self.described(context)} if {text}: {error}")
            return
        if not holds and not context.every_branch:
            context.record("skipped", self.at, text=f"{self.described(context)} only if {text}")
            return
        if context.every_branch:
            context.todo(self.at, f"the condition of {self.described(context)}: {text}")
        context.conditions.append(text if holds else f"{text}, which does not hold")
        try:
            self._visited(context)
        finally:
            context.conditions.pop()

    def _visited(self, context: Context) -> None:
        try:
            self.execute(context)
        except FailedError as error:
            context.todo(self.at, f"{self.described(context)}: {error}")
        except (
            TypeError,
            ValueError,
            AttributeError,
            LookupError,
        ) as error:  # what it was given is of another kind
            context.todo(self.at, f"{self.described(context)}: {type(error).__name__}: {error}")

    def execute(self, context: Context) -> None:
        """Do what it does.

        Raises:
            FailedError: if something of it cannot be resolved.
        """
        context.todo(self.at, self.described(context))

    def described(self, context: Context) -> str:
        """Return what it is, for people."""
        return type(self).__name__


class LaunchDescription:
    def __init__(self, initial_entities: Any = None, **kwargs: Any) -> None:
        self.entities = list(initial_entities or ())

    def add_action(self, action: Any) -> None:
        self.entities.append(action)

    add_entity = add_action

    def visit(self, context: Context) -> None:
        visit_all(self.entities, context)


def visit_all(entities: Any, context: Context) -> None:
    """Do what several actions do, in order."""
    if entities is None or isinstance(entities, Missing):
        return
    for one in entities if isinstance(entities, (list, tuple)) else [entities]:
        if isinstance(one, (list, tuple)):
            visit_all(one, context)
        elif hasattr(one, "visit"):
            visit_all(
                one.visit(context), context
            )  # launch's own descriptions return what is in them
        elif one is not None:
            context.todo(
                [context.file, 1], f"{type(one).__name__} is no action that is known here"
            )


class DeclareLaunchArgument(Action):
    def __init__(
        self,
        name: Any,
        *,
        default_value: Any = None,
        description: Any = "",
        choices: Any = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        self.name, self.default_value, self.description, self.choices = (
            name,
            default_value,
            description,
            choices,
        )

    def execute(self, context: Context) -> None:
        name = text_of(self.name, context)
        known = context.configurations.get(name)
        default = None if self.default_value is None else text_of(self.default_value, context)
        if known is None:
            if default is None:
                raise FailedError(f"it has no default: give {name}:=…")
            context.configurations[name] = known = default
        choices = list(self.choices or ())
        if choices and known not in choices:
            raise FailedError(f"{known} is none of {', '.join(choices)}")
        if context.depth == 0:
            kinds = {bool: "bool", int: "int", float: "float", str: "string"}
            if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
                context.declared[name] = kinds[type(scalar_of(known))]
            context.record(
                "argument",
                self.at,
                name=name,
                default=default,
                value=known,
                choices=choices,
                description=plain([self.description or ""]),
                env=self._variable(context),
            )

    def _variable(self, context: Context) -> str:
        """Return the environment variable that is its default, or nothing."""
        value = self.default_value
        value = value[0] if isinstance(value, (list, tuple)) and len(value) == 1 else value
        is_variable = isinstance(value, EnvironmentVariable) and value.default_value is not None
        return text_of(value.name, context) if is_variable else ""

    def described(self, context: Context) -> str:
        return f"the launch argument {plain([self.name])}"


class SetLaunchConfiguration(Action):
    def __init__(self, name: Any, value: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.name, self.value = name, value

    def execute(self, context: Context) -> None:
        name = text_of(self.name, context)
        context.declared.pop(name, None)
        context.configurations[name] = text_of(self.value, context)


class UnsetLaunchConfiguration(Action):
    def execute(self, context: Context) -> None:
        context.configurations.pop(text_of(self.args[0], context), None)


class SetEnvironmentVariable(Action):
    def __init__(self, name: Any, value: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.name, self.value = name, value

    def execute(self, context: Context) -> None:
        context.variables[text_of(self.name, context)] = with_package(text_of(self.value, context))


class UnsetEnvironmentVariable(Action):
    def __init__(self, name: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.name = name

    def execute(self, context: Context) -> None:
        name = text_of(self.name, context)
        if context.variables.pop(name, None) is None:
            context.todo(self.at, f"the environment variable {name} is unset")


class AppendEnvironmentVariable(SetEnvironmentVariable):
    def __init__(
        self,
        name: Any,
        value: Any,
        *,
        prepend: Any = False,
        separator: Any = os.pathsep,
        **kwargs: Any,
    ) -> None:
        super().__init__(name, value, **kwargs)
        self.prepend, self.separator = prepend, separator

    def execute(self, context: Context) -> None:
        name, value = text_of(self.name, context), with_package(text_of(self.value, context))
        before = context.variables.get(name)
        if before is None:
            context.todo(self.at, f"{shown(value)} is appended to the environment's {name}")
            return
        first, second = (value, before) if self.prepend else (before, value)
        context.variables[name] = f"{first}{text_of(self.separator, context)}{second}"


class GroupAction(Action):
    def __init__(
        self,
        actions: Any,
        *,
        scoped: Any = True,
        forwarding: Any = True,
        launch_configurations: Any = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        self.actions, self.scoped, self.forwarding = actions, scoped, forwarding
        self.own = launch_configurations or {}

    def execute(self, context: Context) -> None:
        scope = context.scope()
        own = {text_of(name, context): text_of(value, context) for name, value in self.own.items()}
        scoped = self.scoped if isinstance(self.scoped, bool) else truth(self.scoped, context)
        if scoped and self.forwarding is False:
            context.configurations.clear()
            context.variables, context.namespace, context.params, context.remaps = {}, None, [], []
        context.configurations |= own
        try:
            visit_all(list(self.actions), context)
        finally:
            if scoped:
                context.restore(scope)

    def described(self, context: Context) -> str:
        return f"a group of {len(list(self.actions))}"


class PushRosNamespace(Action):
    def __init__(self, namespace: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.pushed = namespace

    def execute(self, context: Context) -> None:
        context.namespace = below(context.namespace, text_of(self.pushed, context))


def below(base: str | None, namespace: str | None) -> str | None:
    """Return a namespace below another one, absolute; None where neither is given."""
    if base is None and namespace is None:
        return None
    if namespace is None:
        full = base or ""
    elif not base or namespace.startswith("/"):
        full = namespace
    else:
        full = f"{'' if base == '/' else base}/{namespace}"
    return "/" + full.strip("/")


class SetRemap(Action):
    def __init__(self, src: Any, dst: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.src, self.dst = src, dst

    def execute(self, context: Context) -> None:
        context.remaps.append((text_of(self.src, context), text_of(self.dst, context)))


class SetParameter(Action):
    def __init__(self, name: Any, value: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.name, self.value = name, value

    def execute(self, context: Context) -> None:
        context.params.append({text_of(self.name, context): parameter_value(self.value, context)})


class SetUseSimTime(Action):
    def execute(self, context: Context) -> None:
        context.params.append({"use_sim_time": truth(self.args[0], context)})


class SetParametersFromFile(Action):
    def execute(self, context: Context) -> None:
        file = self.args[0] if self.args else self.kwargs.get("filename")
        context.params.append(with_package(text_of(file, context)))


class LogInfo(Action):
    def execute(self, context: Context) -> None:
        """Nothing is logged."""


class Shutdown(Action):
    pass


class EmitEvent(Action):
    def __init__(self, *, event: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.event = event

    def execute(self, context: Context) -> None:
        event = self.event
        if isinstance(event, ChangeState):
            node = event.node
            if node is not None and event.transition in {1, 3}:
                context.record("lifecycle", self.at, node=node.id, state=_STATES[event.transition])
                return
        context.todo(self.at, self.described(context))

    def described(self, context: Context) -> str:
        return f"the event {type(self.event).__name__}"


_STATES = {1: "inactive", 3: "active"}


class ChangeState:
    """The event that changes a lifecycle node's state."""

    def __init__(
        self, *, lifecycle_node_matcher: Any = None, transition_id: Any = None, **kwargs: Any
    ) -> None:
        self.node = getattr(lifecycle_node_matcher, "action", None)
        self.transition = transition_id if isinstance(transition_id, int) else None


class Matcher:
    """Matches events of one action."""

    def __init__(self, action: Any = None) -> None:
        self.action = action


def matches_action(action: Any = None) -> Matcher:
    """Return what matches the events of an action."""
    return Matcher(action)


class TimerAction(Action):
    def __init__(self, *, period: Any, actions: Any = (), **kwargs: Any) -> None:
        kwargs.pop("cancel_on_shutdown", None)
        super().__init__(**kwargs)
        self.period, self.actions = period, actions

    def execute(self, context: Context) -> None:
        text = (
            text_of(self.period, context)
            if not isinstance(self.period, (int, float))
            else str(self.period)
        )
        try:
            period_s = float(text)
        except ValueError:
            raise FailedError(f"{text!r} is no time") from None
        before = context.period_s
        context.period_s += period_s
        try:
            visit_all(list(self.actions), context)
        finally:
            context.period_s = before

    def described(self, context: Context) -> str:
        return f"a timer with {len(list(self.actions))} actions"


class OpaqueFunction(Action):
    def __init__(
        self, *, function: Any, args: Any = None, kwargs: Any = None, **more: Any
    ) -> None:
        super().__init__(**more)
        self.function, self.given, self.named = function, args or (), kwargs or {}

    def execute(self, context: Context) -> None:
        try:
            made = self.function(context, *self.given, **self.named)
        except FailedError:
            raise
        except Exception as error:  # noqa: BLE001 (a function of the launch file: any can come out of it)
            raise FailedError(
                f"it stopped{_line_of(error)}: {type(error).__name__}: {error}"
            ) from None
        visit_all(made, context)

    def described(self, context: Context) -> str:
        return f"the function {getattr(self.function, '__name__', '')}"


def _line_of(error: BaseException) -> str:
    trace, found = error.__traceback__, ""
    while trace is not None:
        if str(trace.tb_frame.f_globals.get("__name__", "")).startswith(MODULE):
            found = f" at line {trace.tb_lineno}"
        trace = trace.tb_next
    return found


class RegisterEventHandler(Action):
    def __init__(self, event_handler: Any, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.handler = event_handler

    def execute(self, context: Context) -> None:
        if isinstance(self.handler, EventHandler):
            self.handler.registered(context, self.at)
        else:
            context.todo(self.at, "an event handler")


class EventHandler:
    """What happens after an event of a process.

    ``AFTER`` is the language's word for it, empty without one.
    """

    AFTER = ""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self.at = place()
        self.target = (
            kwargs.get("target_action")
            or kwargs.get("target_lifecycle_node")
            or kwargs.get("matcher")
        )
        self.goal = kwargs.get("goal_state")
        several = [
            kwargs[key]
            for key in ("on_exit", "on_start", "on_completion", "entities")
            if key in kwargs
        ]
        self.entities = several[0] if several else (args[0] if args else None)

    def registered(self, context: Context, at: Any) -> None:
        """Record what happens then."""
        several = self.entities if isinstance(self.entities, (list, tuple)) else [self.entities]
        if (
            not isinstance(self.target, Action)
            or not self.AFTER
            or any(callable(one) for one in several)
        ):
            context.todo(at, f"what happens {type(self).__name__}")
            return
        for one in several:
            ends = isinstance(one, Shutdown) or (
                isinstance(one, EmitEvent) and isinstance(one.event, ShutdownEvent)
            )
            if ends and self.AFTER == "done":
                context.record("required", at, node=self.target.id)
            else:
                before = dict(context.after)
                context.after[str(self.target.id)] = self.AFTER
                try:
                    visit_all([one], context)
                finally:
                    context.after = before


class ShutdownEvent:
    """The event that ends the launch."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self.args = args


class OnProcessExit(EventHandler):
    AFTER = "done"


class OnExecutionComplete(EventHandler):
    AFTER = "done"


class OnProcessStart(EventHandler):
    AFTER = "started"


class OnProcessIO(EventHandler):
    pass


class OnShutdown(EventHandler):
    pass


class OnStateTransition(EventHandler):
    AFTER = "ready"


class IncludeLaunchDescription(Action):
    def __init__(
        self, launch_description_source: Any, *, launch_arguments: Any = None, **kwargs: Any
    ) -> None:
        super().__init__(**kwargs)
        self.source = launch_description_source
        if isinstance(launch_arguments, Mapping):
            launch_arguments = launch_arguments.items()
        self.launch_arguments = list(launch_arguments or ())

    def execute(self, context: Context) -> None:
        source = self.source
        location = source.location if isinstance(source, LaunchDescriptionSource) else source
        path = with_package(text_of(location, context))
        given: dict[str, str] = {}
        for name, value in self.launch_arguments:
            try:
                given[text_of(name, context)] = text_of(value, context)
            except (
                FailedError
            ) as error:  # the file has a default for it, or says what it cannot do without
                context.todo(
                    self.at, f"the argument {plain([name])} of {self.described(context)}: {error}"
                )
        context.configurations |= given
        if path.startswith(PACKAGE):
            symbolic = {
                text_of(name, context): symbolic_text(value, context)
                for name, value in self.launch_arguments
                if text_of(name, context) in given
            }
            context.record(
                "include",
                self.at,
                file=path,
                args=symbolic,
                namespace=context.namespace,
                env=dict(context.variables),
                period=context.period_s,
                after=dict(context.after),
            )
            return
        include(path, context)

    def described(self, context: Context) -> str:
        location = (
            self.source.location
            if isinstance(self.source, LaunchDescriptionSource)
            else self.source
        )
        several = location if isinstance(location, (list, tuple)) else [location]
        return f"the included {shown(''.join(plain([one]) for one in several))}"


#: Reads a launch file of any kind; ``launch_process`` puts it here.
LOADERS: list[Callable[[str, Context], Any]] = []
_DEEPEST = 30


def include(path: str, context: Context) -> None:
    """Do what another launch file says.

    Raises:
        FailedError: if it cannot be read.
    """
    if context.depth >= _DEEPEST:
        raise FailedError("launch files include each other")
    before = context.file
    context.file, context.depth = path, context.depth + 1
    try:
        visit_all([LOADERS[0](path, context)], context)
    finally:
        context.file, context.depth = before, context.depth - 1


class LaunchDescriptionSource:
    def __init__(self, launch_file_path: Any = "", *args: Any, **kwargs: Any) -> None:
        self.location = launch_file_path


class ExecuteProcess(Action):
    def __init__(self, *, cmd: Any = (), name: Any = None, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.cmd, self.name = cmd, name

    def execute(self, context: Context) -> None:
        cmd = [symbolic_text(one, context) for one in self.cmd]
        context.record(
            "process",
            self.at,
            argv=cmd,
            label=_optional(self.name, context),
            **self.common(context),
        )

    def common(self, context: Context) -> dict[str, Any]:
        """Return what any process can be told."""
        given = self.kwargs
        variables = [given.get(keyword.name) for keyword in launch_keywords("variables")]
        env = dict(context.variables)
        for values in variables:
            env |= _texts(values, context)
        what: dict[str, Any] = {
            "id": self.id,
            "env": env,
            "period": context.period_s,
            "after": dict(context.after),
        }
        if variables[-1] is not None:
            what["only_env"] = True
        kinds = {keyword.name: keyword.kind for keyword in launch_keywords(*_READERS)}
        kinds["shell"] = "switch"
        for name, kind in kinds.items():
            if given.get(name) is not None:
                what[name] = _READERS[kind](given[name], context)
        for keyword in launch_keywords("shutdown"):
            what[keyword.name] = self._ends_all(keyword.name, context)
        return what

    def _ends_all(self, keyword: str, context: Context) -> bool:
        """Return whether the process's end shuts everything down; name what else follows it."""
        actions = self.kwargs.get(keyword)
        actions = actions if isinstance(actions, (list, tuple)) else [actions]
        if any(action is not None and not isinstance(action, Shutdown) for action in actions):
            context.todo(self.at, f"{keyword} of a process")
        return any(isinstance(action, Shutdown) for action in actions)

    def described(self, context: Context) -> str:
        return f"the process {plain(self.cmd)}"


class ExecuteLocal(Action):
    pass


_OUTPUTS = frozenset({"screen", "log", "both", "own_log", "full"})


def _output(given: Any, context: Context) -> str | list[str]:
    """Return launch's word for where the output goes.

    The places where the word is not one of launch's but a mapping.

    Raises:
        FailedError: if launch has no such word.
    """
    if isinstance(given, Mapping):
        outputs: set[str] = set()
        for places in given.values():
            outputs.update([places] if isinstance(places, str) else places)
        return sorted(outputs)
    word = text_of(given, context)
    if word not in _OUTPUTS:
        raise FailedError(f"output={word!r}")
    return word


def _switch(value: Any, context: Context) -> bool:
    return value if isinstance(value, bool) else truth(value, context)


def _number(value: Any, context: Context) -> float:
    return float(text_of(value, context))


#: What reads a keyword's value, by its kind.
_READERS: dict[KeywordKind, Callable[[Any, Context], Any]] = {
    "text": text_of,
    "switch": _switch,
    "number": _number,
    "output": _output,
}


def _optional(value: Any, context: Context) -> str | None:
    return None if value is None else text_of(value, context)


def _texts(values: Any, context: Context) -> dict[str, str]:
    items = values.items() if isinstance(values, Mapping) else values or ()
    return {text_of(key, context): symbolic_text(value, context) for key, value in items}


class Node(ExecuteProcess):
    def __init__(
        self,
        *,
        executable: Any = None,
        package: Any = None,
        name: Any = None,
        namespace: Any = None,
        exec_name: Any = None,
        parameters: Any = None,
        remappings: Any = None,
        ros_arguments: Any = None,
        arguments: Any = None,
        **kwargs: Any,
    ) -> None:
        for old in ("node_executable", "node_name", "node_namespace"):
            value = kwargs.pop(old, None)
            if value is not None:
                executable = value if old == "node_executable" else executable
                name = value if old == "node_name" else name
                namespace = value if old == "node_namespace" else namespace
        super().__init__(name=exec_name, **kwargs)
        self.executable, self.package, self.node, self.node_namespace = (
            executable,
            package,
            name,
            namespace,
        )
        self.parameters, self.remappings = parameters, remappings
        self.ros_arguments, self.arguments = ros_arguments, arguments

    def execute(self, context: Context) -> None:
        self.record(context, "node")

    def record(self, context: Context, kind: str, **more: Any) -> None:
        """Record the node with all that it is told."""
        words = self.arguments if isinstance(self.arguments, (list, tuple)) else [self.arguments]
        argv = [symbolic_text(one, context) for one in words if one is not None]
        ros_argv = [text_of(one, context) for one in self.ros_arguments or ()]
        context.record(
            kind,
            self.at,
            package=_optional(self.package, context),
            executable=text_of(self.executable, context),
            name=_optional(self.node, context),
            label=_optional(self.name, context),
            namespace=below(context.namespace, _optional(self.node_namespace, context)),
            argv=argv + (["--ros-args", *ros_argv] if ros_argv else []),
            params=[*context.params, *parameters_of(self.parameters, context, self.at)],
            remap=[*context.remaps, *rules_of(self.remappings, context)],
            **self.common(context),
            **more,
        )

    def described(self, context: Context) -> str:
        return f"the node {plain([self.package])}/{plain([self.executable])}"


def rules_of(given: Any, context: Context) -> list[tuple[str, str]]:
    """Return remappings as pairs of texts."""
    return [(text_of(old, context), symbolic_text(new, context)) for old, new in given or ()]


class LifecycleNode(Node):
    def execute(self, context: Context) -> None:
        automatic = self.kwargs.get("autostart") in (True, "true", "True")
        self.record(context, "node", lifecycle="active" if automatic else None)


class LifecycleTransition(Action):
    pass


class ComposableNode(Action):
    """A node that a container loads; ``context.container`` is that, while it is visited."""

    def __init__(
        self,
        *,
        package: Any,
        plugin: Any = None,
        name: Any = None,
        namespace: Any = None,
        parameters: Any = None,
        remappings: Any = None,
        **kwargs: Any,
    ) -> None:
        plugin = kwargs.pop("node_plugin", plugin)
        name, namespace = kwargs.pop("node_name", name), kwargs.pop("node_namespace", namespace)
        super().__init__(**kwargs)
        self.package, self.plugin, self.name, self.namespace = package, plugin, name, namespace
        self.parameters, self.remappings = parameters, remappings

    def execute(self, context: Context) -> None:
        if context.container is None:
            raise FailedError("no container loads it")
        more = {
            keyword.name: parameters_of(self.kwargs.get(keyword.name), context, self.at)
            for keyword in launch_keywords("parameters")
        }
        context.record(
            "component",
            self.at,
            id=self.id,
            container=context.container,
            package=text_of(self.package, context),
            plugin=text_of(self.plugin, context),
            name=_optional(self.name, context),
            namespace=below(context.namespace, _optional(self.namespace, context)),
            params=[*context.params, *parameters_of(self.parameters, context, self.at)],
            remap=[*context.remaps, *rules_of(self.remappings, context)],
            period=context.period_s,
            after=dict(context.after),
            **more,
        )

    def described(self, context: Context) -> str:
        return f"the component {plain([self.plugin])}"


def _visit_components(several: Any, container: str, context: Context) -> None:
    """Record components; ``container`` is their action's id or its node's full name."""
    before, context.container = context.container, container
    try:
        visit_all(list(several or ()), context)
    finally:
        context.container = before


class ComposableNodeContainer(Node):
    def __init__(self, *, composable_node_descriptions: Any = None, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.components = composable_node_descriptions

    def execute(self, context: Context) -> None:
        self.record(context, "container")
        _visit_components(self.components, str(self.id), context)


class LoadComposableNodes(Action):
    def __init__(
        self,
        *,
        composable_node_descriptions: Any = (),
        target_container: Any = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(**kwargs)
        self.components, self.container = composable_node_descriptions, target_container

    def execute(self, context: Context) -> None:
        container = self.container
        target = (
            str(container.id)
            if isinstance(container, Node)
            else f"/{text_of(container, context).strip('/')}"
        )
        if target == "/":
            raise FailedError("it names no container")
        _visit_components(self.components, target, context)

    def described(self, context: Context) -> str:
        container = self.container.node if isinstance(self.container, Node) else self.container
        count = len(list(self.components or ()))
        return f"{count} component{'' if count == 1 else 's'} for {plain([container])}"


class Unknown(Action):
    """An action or substitution of a launch file that is not known here."""

    NAME = ""

    def described(self, context: Context) -> str:
        return self.NAME

    def perform(self, context: Context) -> str:
        raise FailedError(f"{self.NAME} is not known here")

    def evaluate(self, context: Context) -> bool:
        raise FailedError(f"{self.NAME} is not known here")
