"""Processes as users describe them: programs to start, or processes expected to run."""

import re
import shlex
from collections.abc import Iterable, Iterator
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, get_args

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    Strict,
    Tag,
    create_model,
)
from pydantic_core import PydanticCustomError
from typing_extensions import TypeAliasType

from tfcompose.foundation.units import (
    AngularVelocity,
    Duration,
    JointPosition,
    Quantity,
    Rate,
    Size,
    Truth,
    format_value,
    invalid,
)
from tfcompose.model.plan import (
    LifecycleState,
    ReadyKind,
    Schedule,
    SchedulingPolicy,
    SimulationKind,
    StartCondition,
    StopRule,
    StopSignal,
)
from tfcompose.model.process_keys import (
    ALL,
    EXTRA_ARGUMENTS,
    LOADED,
    NODE_KEYS,
    NOT_OWN,
    NOT_SIMULATED,
    OF_NODES,
    OWN,
    REMAPPED,
    SUPERVISION_KEYS,
    SURROUNDING_KEYS,
    Folder,
    Integer,
    ProcessKey,
    Seconds,
    Way,
)
from tfcompose.spec.language.expressions import insertable_text
from tfcompose.spec.language.node_preset import ClaimSpec
from tfcompose.spec.language.pose import Posed
from tfcompose.spec.language.spec import Checked, Entry, Spec, fields_of, key, more_of, several
from tfcompose.spec.language.values import (
    Boolean,
    Integral,
    Matches,
    Namespace,
    NodeName,
    OnlyTrue,
    Parameters,
    RosName,
    Text,
    TopicName,
    VariableName,
    short,
)
from tfcompose.spec.load import Path


def _insert(value: Any) -> Any:
    computed = isinstance(value, (Quantity, Truth))
    value = value.value if isinstance(value, Truth) else value
    return insertable_text(value) if computed else value


#: A string. A computed number is converted to a string.
Word = Annotated[Text, BeforeValidator(_insert)]
Words = tuple[Word, ...]


def _split(value: Any) -> Any:
    """Return the words of a text, split like a shell does."""
    try:
        return shlex.split(value) if isinstance(value, str) else value
    except ValueError as error:
        raise invalid(
            "TF106",
            f"{format_value(value)} cannot be split into words: {error}",
            "a list of words",
        ) from None


#: A wrapper command, as a list of words or a text.
Prefix = Annotated[Words, BeforeValidator(_split, Text | Words)]


def _arguments(value: Any) -> Any:
    """Return a command's arguments as a list; arguments of a launch file are given by name."""
    if not isinstance(value, dict):
        return value
    wrong = [name for name, item in value.items() if isinstance(item, (dict, list))]
    if wrong:
        raise several(
            *(
                (
                    (name,),
                    invalid(
                        "TF103", f"expected a string or a number, got {format_value(value[name])}"
                    ),
                )
                for name in wrong
            )
        )
    return [f"{name}:={_argument(item)}" for name, item in value.items()]


def _argument(value: Any) -> str:
    if isinstance(value, Quantity):
        value = int(value.value) if value.value == int(value.value) else value.value
    return value if isinstance(value, str) else format_value(value)


Arguments = Annotated[Words, BeforeValidator(_arguments, Words | dict[str, Any])]

COMMANDS = (
    *(frozenset({"argv", name}) for name in ("package", "executable", "args", "launch")),
    *(frozenset({"launch", name}) for name in ("package", "executable")),
)


class Run(Checked):
    """An installed executable, a launch file, or a command as a list."""

    EXCLUSIVE: ClassVar[tuple[frozenset[str], ...]] = COMMANDS

    package: Text | None = key(None, "the package of an executable", "slam_toolbox")
    executable: Text | None = key(None, "an executable of the package", "async_slam_toolbox_node")
    launch: Annotated[Text, Matches(r"[^/]+/[^/]+(/[^/]+)*", "package/file.launch.py")] | None = (
        key(
            None,
            "a package's launch file, run as one process",
            "nav2_bringup/navigation_launch.py",
        )
    )
    args: Arguments = key(
        (), "arguments; those of a launch file by name", ["--verbose"], {"use_composition": False}
    )
    argv: Words = key(
        (),
        "the whole command, instead of package and executable",
        ["python3", "-m", "my_robot.drive"],
    )

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[tuple[str], PydanticCustomError]]:
        """Yield a fault if ``executable`` names a launch file."""
        yield from super().check(data)  # type: ignore[misc]
        file = data.get("executable")
        if isinstance(file, str) and re.search(r"[._]launch\.(py|xml|yaml|yml)$", file):
            advice = f"a launch file is run: {{launch: {data.get('package', 'PACKAGE')}/{file}}}"
            yield (
                ("executable",),
                invalid("TF106", f"{file} is a launch file, not an executable", advice),
            )

    @property
    def is_startable(self) -> bool:
        """Whether it defines a program to start."""
        return bool(self.argv or self.launch or (self.package and self.executable))


def _command(value: Any) -> Any:
    return (
        {"argv": value if isinstance(value, list) else [value]}
        if isinstance(value, (list, str))
        else value
    )


Command = TypeAliasType(
    "Command",
    Annotated[
        Run,
        BeforeValidator(
            _command,
            Annotated[Words, Field(min_length=1)]
            | Annotated[Text, Field(description="with shell: true")]
            | Run,
        ),
    ],
)


class Circle(Spec):
    """A body that drives on a circle, counter-clockwise."""

    radius: Size = key(1.0, "the circle's radius")
    speed: AngularVelocity = key(0.5, "the angular velocity")


SWEEP = "sweep"


def _form(value: Any) -> str:
    return "[word]" if isinstance(value, str) and value.isalpha() else "[other]"


SimulatedJoint = Annotated[
    Annotated[Literal["sweep"], Tag("[word]")] | Annotated[JointPosition, Tag("[other]")],
    Discriminator(_form),
]
SimulatedJoints = Annotated[
    Annotated[Literal["zero", "sweep"], Tag("[word]")]
    | Annotated[dict[str, SimulatedJoint], Tag("[other]")],
    Discriminator(lambda value: "[word]" if isinstance(value, str) else "[other]"),
]
SIMULATIONS = frozenset[str](get_args(SimulationKind))


class Simulate(Checked):
    """A simulation of an owner: on a circle, at a fixed pose, or a publisher of joint states."""

    EXCLUSIVE: ClassVar[tuple[frozenset[str], ...]] = (SIMULATIONS,)

    circle: Circle | None = key(
        None, "the child frame moves on a circle", {"radius": "1 m", "speed": "0.5 rad/s"}
    )
    fixed: Posed | None = key(None, "the child frame stays at this pose", {"xyz": [1, 0, 0]})
    joints: SimulatedJoints | None = key(
        None,
        "joint states: zero, sweep, or a position or sweep for each joint; other joints are at 0",
        "zero",
        {"lift": 0.2},
    )
    rate: Rate | None = key(None, "its rate; default: the rate of its edges, or 20 Hz", "50 Hz")


class ScheduleSpec(Checked):
    """How the kernel schedules a process."""

    cpus: tuple[Annotated[int, Strict(), Field(ge=0, le=4095), Integral], ...] = key(
        (), "the CPUs that it may use, counted from 0; default: all", [2, 3]
    )
    policy: SchedulingPolicy | None = key(
        None,
        "a policy of sched(7); fifo and rr are real-time policies; default: fifo with a "
        "priority, otherwise other",
    )
    priority: Annotated[int, Strict(), Field(ge=1, le=99), Integral] | None = key(
        None, "the priority of fifo and rr, 1 to 99", 80
    )

    def to_plan(self) -> Schedule:
        """Return the schedule in the form of the plan."""
        usual: SchedulingPolicy = "fifo" if self.priority else "other"
        return Schedule(self.cpus, self.policy or usual, self.priority or 0)

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Also yield a priority for a policy without priorities, and a missing priority."""
        yield from super().check(data)
        policy, is_given = data.get("policy"), "priority" in data
        if is_given and policy in {"other", "batch", "idle"}:
            message = f"the policy {policy} has no priority"
            yield (
                ("priority",),
                invalid(
                    "TF107", message, "policy: fifo, or rr", on_key=True, conflicts_with="policy"
                ),
            )
        elif not is_given and policy in {"fifo", "rr"}:
            yield (
                (),
                invalid(
                    "TF102",
                    f"the policy {policy} needs a priority",
                    "for example priority: 80",
                    on_key=True,
                ),
            )


class StopSpec(Spec):
    """How to stop a process: a first signal to its process group, then SIGTERM and SIGKILL."""

    signal: StopSignal = key(StopRule().signal, "the first signal")
    timeout: Duration | None = key(None, "time from the first signal to SIGTERM", "5 s")
    kill_timeout: Duration | None = key(
        None, "time from SIGTERM to SIGKILL; default: timeout", "10 s"
    )

    def to_plan(self) -> StopRule:
        """Return the rule in the form of the plan."""
        return StopRule(self.signal, self.timeout, self.kill_timeout)


def _is_regular(value: str) -> str:
    try:
        re.compile(value)
    except (re.error, RecursionError, OverflowError) as error:
        raise invalid(
            "TF106", f"{format_value(value)} is not a regular expression: {error}"
        ) from None
    return value


READY_WAYS = frozenset[str](get_args(ReadyKind))


class ReadySpec(Checked):
    """When a process is ready; by default, when all edges that it owns are live."""

    EXCLUSIVE: ClassVar[tuple[frozenset[str], ...]] = (READY_WAYS,)

    edges: OnlyTrue | None = key(None, "true: when all edges that it owns are live", True)
    topic: TopicName | None = key(
        None,
        "when this topic has a publisher; relative to the process's namespace unless it begins "
        "with /",
        "scan",
    )
    service: TopicName | None = key(
        None,
        "when this service exists; relative to the process's namespace unless it begins with /",
        "map_server/load_map",
    )
    lifecycle: LifecycleState | None = key(None, "when its nodes are in this lifecycle state")
    log: Annotated[Text, AfterValidator(_is_regular)] | None = key(
        None, "when a line of its output matches this regular expression", "server started"
    )
    exit: Annotated[int, Strict(), Field(ge=0, le=255), Integral] | None = key(
        None, "when it has exited with this code", 0
    )
    time: Duration | None = key(None, "this long after its start", "2 s")
    timeout: Duration | None = key(
        None, "the longest time to wait; then tfcompose reports the actual state", "30 s"
    )

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Also yield a fault if no condition is given."""
        yield from super().check(data)
        if not READY_WAYS & data.keys():
            advice = f"one of: {', '.join(sorted(READY_WAYS))}"
            yield (), invalid("TF102", "ready does not say what to wait for", advice, on_key=True)


Ready = TypeAliasType(
    "Ready",
    Annotated[
        ReadySpec,
        BeforeValidator(
            lambda value: {"edges": True} if value == "edges" else value,
            Literal["edges"] | ReadySpec,
        ),
    ],
)

_PARAMS = (
    "the node's parameters, unchanged; file: parameter files that the other parameters are "
    "merged over"
)
_PUBLISHES = (
    "edges that the node publishes by default, with the parameters that turn them off; not "
    "needed with a preset"
)
_PRESET = "the node preset, with its edges and parameters"


class NodeSpec(Spec):
    """One node of a process."""

    preset: Text | None = key(None, _PRESET, "slam_toolbox")
    publishes: tuple[ClaimSpec, ...] = key(
        (), _PUBLISHES, [{"parent": "map", "child": "odom", "off": "none"}]
    )
    params: Parameters = key({}, _PARAMS, {"use_sim_time": False})
    lifecycle: LifecycleState | None = key(
        None, "the state that the guard brings the lifecycle node to"
    )


class NamedNode(Spec):
    """The only node of a process: its name and its preset."""

    name: NodeName | None = key(
        None,
        "its name; default: the name of the process or, if tfcompose does not start it, the "
        "usual name",
        "slam_toolbox",
    )
    preset: Text | None = key(None, _PRESET, "slam_toolbox")


#: Whether components share an executor; number of threads of an executor.
Isolation = Literal["shared", "isolated"]
Executor = Literal["single", "multi"]

RUNNING = frozenset({"run", "simulate", "external", "component"})
#: Annotations for rows whose value in the language is not of the row's type.
_ANNOTATIONS: dict[Any, Any] = {
    bool: Boolean,
    Seconds: Duration,
    Folder: Text,
    dict[str, str]: dict[VariableName, Word],
    dict[str, Any]: Parameters,
    tuple[str, ...]: Prefix,
    Schedule: ScheduleSpec,
    StopRule: StopSpec,
}


def _annotation_of(row: ProcessKey) -> Any:
    """Return the annotation of a row's key."""
    kind = row.type
    if isinstance(kind, Integer):
        bounds = Field(ge=kind.lowest, le=kind.highest)
        annotation: Any = Annotated[int, Strict(), bounds, Integral]
    else:
        annotation = _ANNOTATIONS.get(kind, kind)
    return annotation | None if row.default is None else annotation


def _key(row: ProcessKey) -> Any:
    return key(row.default, row.help, *row.examples, to=row.to)


def _keys(rows: Iterable[ProcessKey]) -> dict[str, Any]:
    """Return the keys of the rows in the form that ``create_model`` requires."""
    return {row.name: (_annotation_of(row), _key(row)) for row in rows}


if TYPE_CHECKING:

    class Supervised(Checked):
        """What the compiler reads by its name of what every process has."""

        params: Parameters
        env: dict[str, str]
        host: Text | None
        required: bool | None

else:
    Supervised = create_model(
        "Supervised",
        __base__=Checked,
        __module__=__name__,
        __doc__="What every process has: its place, its start, and what follows its end.",
        params=(Parameters, key({}, _PARAMS, {"use_sim_time": False}, to=NOT_SIMULATED)),
        **_keys(NODE_KEYS),
        remap=(
            dict[RosName, RosName],
            key(
                {},
                "remappings of topics, services and actions",
                {"scan": "front/scan"},
                to=REMAPPED,
            ),
        ),
        **_keys(SURROUNDING_KEYS),
        host=(Text | None, key(None, "the computer that it runs on", "jetson", to=ALL)),
        **_keys(SUPERVISION_KEYS),
        ready=(
            Ready | None,
            key(None, "when it is ready", {"topic": "scan"}, to=NOT_SIMULATED),
        ),
        after=(
            dict[str, StartCondition],
            key(
                {},
                "processes to wait for before it starts",
                {"base_drive": "ready"},
                to=ALL,
            ),
        ),
    )


#: A component: its package and its class.
Plugin = Annotated[
    Text,
    Matches(
        r"[A-Za-z][A-Za-z0-9_]*/[A-Za-z_][A-Za-z0-9_:]*",
        "package/class, such as image_proc/ns::RectifyNode",
    ),
]


class StartedSpec(Supervised):
    """A process to start, to simulate, or to expect."""

    EXCLUSIVE: ClassVar[tuple[frozenset[str], ...]] = (RUNNING,)

    run: Command | None = key(
        None,
        "{package, executable, args}, {launch, args}, or a command as a list",
        {"package": "slam_toolbox", "executable": "async_slam_toolbox_node"},
    )
    simulate: Simulate | None = key(
        None, "a simulation of this process", {"circle": {"radius": "1 m"}, "rate": "50 Hz"}
    )
    external: OnlyTrue | None = key(None, "true: tfcompose does not start it", True)
    component: Plugin | None = key(
        None,
        "a node that a container loads, as package/class",
        "image_proc/image_proc::RectifyNode",
    )
    container: Text | None = key(
        None, "the container that loads the component", "perception", to=LOADED
    )
    extra_arguments: Parameters = _key(EXTRA_ARGUMENTS)
    shell: OnlyTrue | None = key(None, "true: run is a command for /bin/sh", True)
    node: Annotated[NamedNode, short("name", NamedNode)] | None = key(
        None,
        "the name of its node, or {preset, name}; relative to its namespace, unless it begins "
        "with /",
        "slam_toolbox",
        {"preset": "slam_toolbox"},
        to=NOT_OWN,
    )
    namespace: Namespace | None = key(
        None,
        "the namespace of its nodes, relative to ros.namespace unless it begins with /; /: no "
        "namespace",
        "front",
        to=NOT_OWN,
    )
    publishes: tuple[ClaimSpec, ...] = key(
        (), _PUBLISHES, [{"parent": "map", "child": "odom", "off": "none"}], to=OF_NODES
    )
    lifecycle: LifecycleState | None = key(
        None, "the state that the guard brings its lifecycle node to", to=OF_NODES
    )
    rate: Rate | None = key(
        None, "for the process joints only: the rate of joint states", "50 Hz", to=OWN
    )

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Yield a string command without ``shell``, and ``shell`` without a string command."""
        yield from super().check(data)
        run, shell = data.get("run"), data.get("shell") is True
        if isinstance(run, str) and not shell:
            advice = (
                "write a list, one item a word; or {package: …, executable: …}; or add shell: true"
            )
            yield (
                ("run",),
                invalid("TF103", "the command is one string, which only a shell reads", advice),
            )
        elif shell and run is not None and not isinstance(run, str):
            advice = "run: one string, for example 'zcat log.gz | player'"
            yield (
                ("shell",),
                invalid(
                    "TF107",
                    "shell: true, but run is not a string",
                    advice,
                    on_key=True,
                    keeps=True,
                ),
            )
        if "component" in data and "container" not in data:
            yield (
                ("component",),
                invalid(
                    "TF102", "a component without a container", "container: NAME", on_key=True
                ),
            )
        for name in ("container", EXTRA_ARGUMENTS.name) if "component" not in data else ():
            if name in data:
                advice = "component: PACKAGE/CLASS"
                yield (
                    (name,),
                    invalid(
                        "TF102", f"{name} without a component", advice, on_key=True, keeps=True
                    ),
                )


class ProcessSpec(StartedSpec, Entry):
    """A process to start, to simulate, or to expect."""

    EXCLUSIVE: ClassVar[tuple[frozenset[str], ...]] = (
        *StartedSpec.EXCLUSIVE,
        *(frozenset({"nodes", name}) for name in ("node", "lifecycle", "component")),
    )

    nodes: dict[NodeName, NodeSpec] = key(
        {},
        "the nodes of a process by name, for several nodes, or for one whose name tfcompose must "
        "not change; the process's params apply to all its nodes, listed or not; for a single "
        "node, use node, params and lifecycle",
        {"planner_server": {"lifecycle": "active"}, "controller_server": {"lifecycle": "active"}},
        to=NOT_OWN,
    )


@cache
def keys_of(way: Way) -> frozenset[str]:
    """Return the keys that apply to processes that run in this way.

    Keys that define how a process runs are not included.
    """
    field = fields_of(ProcessSpec).items()
    return (
        frozenset(name for name, field in field if way in more_of(field, "to", ("run",))) - RUNNING
    )


class ContainerSpec(Supervised, Entry):
    """A process that loads components.

    One of rclcpp_components' containers, or one that is already running.
    """

    isolation: Isolation = key(
        "shared",
        "isolated: one executor for each component; shared: one executor for all",
    )
    executor: Executor = key("single", "the number of threads of each executor")
    package: Text = key(
        "rclcpp_components", "the package of the container's executable", "my_containers"
    )
    executable: Text | None = key(
        None,
        "the container's executable; default: the component_container for isolation and executor",
        "my_container",
    )
    args: Words = key((), "more arguments for the executable", ["--verbose"])
    external: OnlyTrue | None = key(
        None, "true: tfcompose does not start it, but loads components into it", True
    )
    node: NodeName | None = key(
        None, "the name of its node; default: the container's", "perception_container"
    )
    namespace: Namespace | None = key(
        None,
        "the namespace of its node, relative to ros.namespace unless it begins with /",
        "front",
    )


class DriverSpec(StartedSpec):
    """Changes to the preset's driver.

    Instead of this mapping: the name of the process that drives this sensor, or none.
    """

    process: Text | None = key(None, "the process that drives this sensor, or none", "camera_rig")


Driver = Annotated[DriverSpec, short("process", DriverSpec)]
