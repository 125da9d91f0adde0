"""Actions of a launch file as data, from which each writer makes Python, XML or YAML."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.model.process_keys import Setting
    from tfcompose.tools.exporters.launch_texts import FilePath, Text
    from tfcompose.tools.exporters.launch_values import Condition


@dataclass(frozen=True, slots=True, kw_only=True)
class Action:
    """An action, which may have a condition."""

    #: The process that the action starts. Empty if it starts a stock node.
    process: str = ""
    condition: Condition | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SetVariable(Action):
    """Sets an environment variable for all later actions."""

    name: str
    value: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadedComponent:
    """A component that a container loads."""

    package: str
    plugin: str
    name: str
    namespace: str
    remap: Mapping[str, Text]
    #: Parameter values by name. A value that the launch file computes is a ``TypedText``.
    params: Mapping[str, Any]
    settings: tuple[Setting, ...] = ()
    condition: Condition | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class StartNode(Action):
    """Starts a node of a package: a plain node, a container, or a lifecycle node."""

    package: str
    executable: str
    name: str
    #: The node's namespace. If empty, the node is in the namespace of the launch file.
    namespace: str = ""
    exec_name: str = ""
    remap: Mapping[str, Text] = field(default_factory=dict)
    arguments: tuple[Text, ...] = ()
    ros_arguments: tuple[Text, ...] = ()
    params_file: FilePath | None = None
    #: Parameters by name: plain values, ``TypedText`` or ``FileContent``.
    params: Mapping[str, Any] = field(default_factory=dict)
    #: Settings of the process. Their values contain ``Text`` instead of str.
    settings: tuple[Setting, ...] = ()
    #: The components that a container loads. None if the node is not a container.
    components: tuple[LoadedComponent, ...] | None = None
    #: The lifecycle state that launch sets: ``inactive``, ``active``, or empty for none.
    lifecycle_state: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadComponents(Action):
    """Loads components into a running container."""

    container: str
    components: tuple[LoadedComponent, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedEdge(Action):
    """Starts a stock publisher of a single fixed edge."""

    name: str
    parent: str
    child: str
    #: The pose of the child in the parent, in metres.
    xyz: tuple[float, float, float]
    quat_xyzw: tuple[float, float, float, float]
    namespace: str
    remap: Mapping[str, Text]


@dataclass(frozen=True, slots=True, kw_only=True)
class StartCommand(Action):
    """Starts a command."""

    argv: tuple[Text, ...]
    settings: tuple[Setting, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class StartFromPlan(Action):
    """Starts a process of the plan with ``tfcompose exec``."""

    settings: tuple[Setting, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Include(Action):
    """Includes a package's launch file, with settings for all of its nodes."""

    package: str
    file: str
    arguments: tuple[tuple[str, Text], ...]
    env: Mapping[str, Text]
    namespace: str
    remap: Mapping[str, Text]
    use_sim_time: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Delayed(Action):
    """Starts an action later."""

    action: Action
    delay_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AfterExit(Action):
    """Starts an action when another process has exited."""

    action: Action
    awaited: str


def nested(action: Action) -> Iterator[Action]:
    """Yield the action and all actions inside it."""
    yield action
    if isinstance(action, Delayed | AfterExit):
        yield from nested(action.action)
