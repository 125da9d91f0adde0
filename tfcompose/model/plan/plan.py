"""Contents of a plan: enumerations, edges, processes, shared settings, guard policy.

Each enumeration of the plan and of the language is a Literal here; ``get_args`` gives its words.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from msgspec import Meta

from tfcompose.foundation.geometry import Pose
from tfcompose.model.fields import documented

#: Who moves an edge: nobody, joint states, or its owner.
EdgeKind = Literal["static", "joint", "dynamic"]
#: How a joint moves; of planar and floating ones joint states say nothing.
JointType = Literal["revolute", "continuous", "prismatic", "planar", "floating"]

#: What a process is: one of tfcompose's own, one that is started elsewhere, a program, or a node
#: in a container.
ProcessKind = Literal["static", "joints", "guard", "simulate", "external", "run", "component"]
#: After which ends a process is started again.
RestartPolicy = Literal["no", "on-failure", "always"]
#: The first signal that ends a process.
StopSignal = Literal["SIGINT", "SIGTERM", "SIGQUIT", "SIGHUP", "SIGKILL", "SIGUSR1", "SIGUSR2"]
#: What makes a process ready.
ReadyKind = Literal["edges", "topic", "service", "lifecycle", "log", "exit", "time"]
#: What must have happened to another process before one is started.
StartCondition = Literal["started", "ready", "done"]
#: The states of a lifecycle node that it can be brought into, or be waited for in.
LifecycleState = Literal["inactive", "active"]
#: How much a node's loggers write.
LogLevel = Literal["debug", "info", "warn", "error", "fatal"]
#: What a stand-in does.
SimulationKind = Literal["circle", "fixed", "joints"]
#: Where a process's output goes: to the terminal of up and into its log, or to one of them.
OutputPlace = Literal["both", "log", "screen"]
#: How the kernel schedules a process (sched(7)); fifo and rr are real-time policies.
SchedulingPolicy = Literal["other", "batch", "idle", "fifo", "rr"]
#: How well the pose of a frame is known that a driver publishes.
PoseKnowledge = Literal["exact", "nominal", "unknown"]

#: Whose time the whole plan runs by.
Clock = Literal["wall", "sim"]
#: How far ROS looks for other nodes; None in a plan: as far as the environment says.
Discovery = Literal["localhost", "subnet", "off"]
#: The middleware that all processes use.
Rmw = Literal["fastdds", "cyclonedds", "zenoh"]
#: The release of ROS that all processes are from.
Distro = Literal["jazzy", "kilted"]
#: What keeps several robots in one domain apart: topics below their namespaces, or frames with a
#: prefix.
Isolation = Literal["none", "topics", "frames", "both"]
#: Who publishes what is ours below the base.
StatePublisher = Literal["tfcompose", "stock"]
#: Who publishes the frames inside a sensor.
SensorPublisher = Literal["driver", "tfcompose"]

#: What the guard does with what a process sends and does not own: nothing, report it, or hold it
#: back.
GuardMode = Literal["off", "watch", "strict"]
#: What an edge is that nobody declared.
UnknownEdges = Literal["ignore", "warn", "error"]
#: What follows a violation: words, the end of the process that surely did it, or the end of
#: everything.
OnViolation = Literal["report", "stop-offender", "stop"]
#: How a strict guard fences processes off; auto: by partition where their rmw is Fast DDS, else by
#: remapping.
FenceWay = Literal["auto", "partition", "remap"]


#: An edge is silent after four periods, and never before this: what a loaded machine can delay.
_SILENT_AT_LEAST_S = 0.6
_SILENT_PERIODS = 4.0
#: It is too slow below this part of the rate that is declared, and from then on up to that one.
_SLOW_BELOW, _SLOW_UP_TO = 0.8, 0.9
#: How often a process is started again in a row, unless it says so itself.
MAX_RESTARTS = 5


def silent_after_s(period_s: float) -> float:
    """Return how long an edge that comes every ``period_s`` seconds may be quiet."""
    return max(_SILENT_AT_LEAST_S, _SILENT_PERIODS * period_s)


#: A time or rate.
AboveZero = Annotated[float, Meta(gt=0)]


class SourceLine(NamedTuple):
    """A line of a robot file; the file is relative to the robot's."""

    file: str
    line: int


@dataclass(frozen=True, slots=True)
class EdgePattern:
    """Edges by the names of their frames, in which ``*`` and ``?`` are wildcards."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    parent: str = documented("*", "the parent frame", "camera_color_optical_frame")
    child: str = documented("*", "the child frame", "tag36h11:*")


@dataclass(frozen=True, slots=True)
class PlanJoint:
    """A moving joint: the edge's ``pose`` followed by motion along ``axis`` gives the pose.

    ``axis`` is a unit vector in the child's frame at q = 0. With ``mimic`` the position is
    ``multiplier`` · q(mimic) + ``offset``. Positions are radians, or metres for a prismatic joint.
    """

    name: str
    type: JointType
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    mimic: str | None = None
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class PlanEdge:
    """One TF edge and the process that publishes it. ``node`` is the publishing node's full name.

    ``switched`` holds the further parents between which the owner may change the child; ``parent``
    is the nominal one. ``pose_known`` is False where only the owner knows where the child is;
    ``pose`` is the identity then.
    """

    parent: str
    child: str
    kind: EdgeKind
    owner: str
    node: str
    pose: Pose
    rate: float | None
    source: SourceLine
    joint: PlanJoint | None = None
    switched: tuple[str, ...] = ()
    pose_known: bool = True

    @property
    def name(self) -> str:
        """The edge as people read it."""
        return f"{self.parent} → {self.child}"

    @property
    def silent_after_s(self) -> float | None:
        """How long a moving edge may be quiet, in seconds, or None if it says no rate."""
        if not self.rate or self.kind == "static":
            return None
        return silent_after_s(1 / self.rate)

    def is_slow(self, rate: float, speed: float, *, was_slow: bool = False) -> bool:
        """Return whether it comes too seldom, at ``rate`` in hertz.

        Time goes by ``speed`` times as fast as the time of day, as in a simulation.
        """
        share = _SLOW_UP_TO if was_slow else _SLOW_BELOW
        return rate < share * speed * (self.rate or 0.0)

    def may_hang_on(self, parent: str) -> bool:
        """Return whether the owner may publish the child below this parent."""
        return parent == self.parent or parent in self.switched


#: In an ``argv``, ``${plan}``, ``${build_dir}`` and ``${params_file}`` stand for what only the
#: starting machine knows. As its first word ``${tfcompose}`` is this program,
#: ``${executable:PACKAGE/NAME}`` a package's, and ``${launch:PACKAGE/FILE}`` a package's launch
#: file; the words after that are the launch file's arguments, ``name:=value``.
PROGRAM = "${tfcompose}"
_AT_START = re.compile(r"\$\{(?:file:|build_dir\}|params_file\})")


@dataclass(frozen=True, slots=True)
class Sweep:
    """How a simulated joint moves.

    To and fro between two positions (rad or m) once in ``period_s``.

    Without them it turns round and round, once in that time.
    """

    period_s: AboveZero
    lower: float | None = None
    upper: float | None = None

    def __post_init__(self) -> None:
        if (self.lower is None) != (self.upper is None):
            raise ValueError("has one of lower and upper without the other")


@dataclass(frozen=True, slots=True)
class Simulation:
    """A stand-in for an owner: a body on a circle, one that stays, or joint states.

    ``joints`` are where joints begin (rad or m), and stay unless ``sweep`` says how they move.
    """

    kind: SimulationKind
    rate: AboveZero
    radius: float = 0.0
    speed: float = 0.0
    joints: dict[str, float] = field(default_factory=dict)
    sweep: dict[str, Sweep] = field(default_factory=dict)
    pose: Pose = field(default_factory=Pose)


@dataclass(frozen=True, slots=True)
class Ready:
    """When a process counts as ready.

    ``text`` is the full name of the topic or the service, the lifecycle state of the process's
    nodes, or the regular expression that a line of the output holds; ``number`` the exit code, or
    the seconds after the start. Without ``timeout_s`` the launcher's own time holds.
    """

    kind: ReadyKind
    text: str = ""
    number: float = 0.0
    timeout_s: float | None = None


@dataclass(frozen=True, slots=True)
class StopRule:
    """How a process is ended: the first signal, and the time until a firmer one.

    None: the launcher's own.

    ``kill_timeout_s`` is the time between SIGTERM and SIGKILL; None: ``timeout_s``.
    """

    signal: StopSignal = "SIGINT"
    timeout_s: float | None = None
    kill_timeout_s: float | None = None


@dataclass(frozen=True, slots=True)
class Schedule:
    """How the kernel schedules a process.

    On which processors (empty: any), and by which policy (sched(7)).

    ``priority`` is that of the real-time policies, 1 to 99, and 0 for the others.
    """

    cpus: tuple[int, ...] = ()
    policy: SchedulingPolicy = "other"
    priority: int = 0


#: A node's parameter that is not a list.
ParameterValue = str | int | float | bool


@dataclass(frozen=True, slots=True)
class Driven:
    """A sensor that a process drives.

    ``publishes`` says that the frames inside the sensor are the driver's.

    ``switch`` holds the parameters, or arguments, that keep the driver from publishing what is not
    its own. ``frames`` says of the frames that the driver publishes inside the sensor whether
    their poses are exact, nominal or unknown.
    """

    sensor: str
    preset: str
    publishes: bool
    switch: dict[str, ParameterValue] = field(default_factory=dict)
    frames: dict[str, PoseKnowledge] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Component:
    """A node that a container loads: it has no operating system's process of its own.

    ``container`` is the process that loads it, ``plugin`` the class, of ``package``. ``params``
    are by their full names, with dots; a value is true or false, a number, a text, or a list of
    one kind, as ``components.json_value`` has them. ``extra_arguments`` are for the container:
    ``use_intra_process_comms``.
    """

    container: str
    package: str
    plugin: str
    params: dict[str, Any] = field(default_factory=dict)
    extra_arguments: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class PlanProcess:
    """What is started, or, with kind ``external``, expected to run.

    Of kind ``component``, what a container loads.

    ``nodes`` are full names; ``lifecycle`` says of some of them into which state they are brought
    after the start. ``required`` says what ends the plan: True, this process's end; None, its
    failure; False, neither. ``max_restarts`` None is the default, as is ``ready`` None: the edges
    that the process owns, or that it was started. ``drives`` are the sensors that it is the driver
    of, by their presets. ``switches`` holds, by the full names of its nodes, the parameters that
    were written for them and decide what they publish. ``description`` is the file beside the plan
    that a publisher sends as ``robot_description``; None: the plan's. ``namespace`` is that of its
    nodes, without a leading slash; None: the plan's. ``restart_delay`` is how long after its end
    it is started again, in seconds; None: longer each time. ``prefix`` are the words before its
    command, a program that runs it. ``emulate_tty`` says that it writes to a pseudo-terminal.
    ``oom_score_adj`` is as in proc_pid_oom_score_adj(5), ``open_files`` the soft and the hard
    RLIMIT_NOFILE of getrlimit(2); None: the launcher's own.
    """

    name: str
    kind: ProcessKind
    argv: tuple[str, ...] = ()
    env: dict[str, str] = field(default_factory=dict)
    cwd: str | None = None
    params_file: str | None = None
    remap: dict[str, str] = field(default_factory=dict)
    nodes: tuple[str, ...] = ()
    restart: RestartPolicy = "no"
    max_restarts: int | None = None
    required: bool | None = None
    stop: StopRule = field(default_factory=StopRule)
    log_level: LogLevel | None = None
    lifecycle: dict[str, LifecycleState] = field(default_factory=dict)
    after: dict[str, StartCondition] = field(default_factory=dict)
    ready: Ready | None = None
    host: str | None = None
    owns: tuple[tuple[str, str], ...] = ()
    description: str | None = None
    drives: tuple[Driven, ...] = ()
    switches: dict[str, dict[str, ParameterValue]] = field(default_factory=dict)
    namespace: str | None = None
    simulate: Simulation | None = None
    restart_delay: float | None = None
    prefix: tuple[str, ...] = ()
    schedule: Schedule | None = None
    component: Component | None = None
    output: OutputPlace = "both"
    emulate_tty: bool = False
    oom_score_adj: int | None = None
    open_files: int | None = None

    @property
    def texts(self) -> tuple[str, ...]:
        """The texts in which places of files can stand: its command, variables and folder."""
        return (*self.argv, *self.env.values(), self.cwd or "")

    @property
    def is_state_publisher(self) -> bool:
        """Whether it is ROS's own robot_state_publisher, which the plan starts."""
        return self.argv[:1] == (_STATE_PUBLISHER,)

    @property
    def topics(self) -> tuple[str, str]:
        """The topics (moving, fixed) on which it publishes TF."""
        return self.remap.get("/tf", "/tf"), self.remap.get("/tf_static", "/tf_static")

    @property
    def restart_limit(self) -> int:
        """How often it is started again in a row."""
        return MAX_RESTARTS if self.max_restarts is None else self.max_restarts


def known_at_launch(value: Any) -> bool:
    """Return whether a value holds a path that only the launcher knows."""
    if isinstance(value, str):
        return bool(_AT_START.search(value))
    items = (
        value.values()
        if isinstance(value, dict)
        else value
        if isinstance(value, (list, tuple))
        else ()
    )
    return any(known_at_launch(item) for item in items)


@dataclass(frozen=True, slots=True)
class RosSettings:
    """What all processes share."""

    namespace: str = documented(
        "", "the namespace of nodes and topics without a leading slash", "robot1"
    )
    domain_id: int | None = documented(None, "the ROS domain; default: the environment's", 7)
    discovery: Discovery | None = documented(
        None, "how far discovery reaches; default: the environment's"
    )
    rmw: Rmw | None = documented(
        None, "the middleware of all processes; default: the environment's", "zenoh"
    )
    distro: Distro | None = documented(
        None,
        "the release of ROS that they are from; default: the environment's",
        "kilted",
    )
    router: str | None = documented(
        None,
        "with rmw: zenoh, where every process reaches the router; default: port 7447 of its own"
        " computer",
        "tcp/10.0.0.2:7447",
    )
    clock: Clock = documented("wall", "one clock for the whole plan; sim: the time of /clock")
    frame_prefix: str = documented(
        "", "written in front of every frame as it is, with its slash", "robot1/"
    )
    shared_frames: tuple[str, ...] = documented((), "frames that never get the prefix", ["map"])


@dataclass(frozen=True, slots=True)
class PlanHost:
    """A computer that processes run on: how ssh reaches it, and what runs tfcompose there.

    ``ssh`` is user@address, or a name that ssh knows; ``python`` is a program or its path,
    ``setup`` are files that are sourced before it. ``node_selector`` are the labels of its node in
    Kubernetes; empty: its host name is the host's.
    """

    ssh: str
    port: int | None = None
    python: str | None = None
    setup: tuple[str, ...] = ()
    node_selector: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class GuardPolicy:
    """What watches the live tree."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    mode: GuardMode = documented(
        "watch", "strict: what a process of the plan sends and does not own is held back"
    )
    unknown_edges: UnknownEdges = documented(
        "warn", "what to do about an edge that nobody declared"
    )
    on_violation: OnViolation = documented(
        "report",
        "stop-offender: stop the plan's own process that is proven to have done it; stop: stop"
        " everything",
    )
    allow: tuple[EdgePattern, ...] = documented(
        (), "edges that need no declaration", [{"child": "tag36h11:*"}]
    )
    fence: FenceWay = documented(
        "auto",
        "how strict fences processes off: by a DDS partition, which needs Fast DDS, or by"
        " remapping /tf and /tf_static",
    )


@dataclass(frozen=True, slots=True)
class PlanClaim:
    """An edge that a node publishes by default and another process owns.

    ``switch`` stops it, empty: nothing does.
    """

    node: str
    parent: str
    child: str
    switch: str


def switch_text(switch: dict[str, Any]) -> str:
    """Return parameters as they are written in YAML."""
    return ", ".join(
        f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in switch.items()
    )


VERSION: Literal[3] = 3

#: The file beside the plan that holds the whole robot's description.
DESCRIPTION = "robot.urdf"
#: The file beside it that holds what a stock robot_state_publisher is given.
STOCK_DESCRIPTION = "robot.state_publisher.urdf"
_NOWHERE = SourceLine("", 0)
_STATE_PUBLISHER = "${executable:robot_state_publisher/robot_state_publisher}"
#: What no name of a node may hold.
_NO_NAME = re.compile(r"\W")


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything that ``tfcompose up`` needs, and nothing that it has to compile.

    ``host`` is the machine whose share of the processes this is: it starts those that are not
    ``external``. None is the whole plan, and empty the share of the machine that the plan does not
    name. ``args`` are the values of the robot file's arguments that it was built with,
    ``environment`` those of the variables that the file names. ``hosts`` are the computers that
    processes may name; empty: the file does not say how they are reached. ``sections`` are
    those of tools, by the names of their keys.
    """

    version: Literal[3] = field(default=VERSION, kw_only=True)
    robot: str
    spec_digest: str
    description: str = field(default=DESCRIPTION, kw_only=True)
    base: str | None
    host: str | None = field(default=None, kw_only=True)
    ros: RosSettings
    edges: tuple[PlanEdge, ...]
    processes: tuple[PlanProcess, ...]
    claims: tuple[PlanClaim, ...] = field(default=(), kw_only=True)
    guard: GuardPolicy = field(default_factory=GuardPolicy)
    args: dict[str, ParameterValue] = field(default_factory=dict, kw_only=True)
    environment: dict[str, str] = field(default_factory=dict, kw_only=True)
    hosts: dict[str, PlanHost] = field(default_factory=dict, kw_only=True)
    sections: dict[str, Any] = field(default_factory=dict, kw_only=True)

    def process(self, name: str) -> PlanProcess:
        """Return the process of that name.

        Raises:
            KeyError: if there is none.
        """
        for process in self.processes:
            if process.name == name:
                return process
        raise KeyError(name)

    @property
    def started(self) -> tuple[PlanProcess, ...]:
        """The processes that are started, in the plan's order.

        All but external ones, and what containers load.
        """
        return tuple(
            process for process in self.processes if process.kind not in ("external", "component")
        )

    @property
    def managed(self) -> tuple[PlanProcess, ...]:
        """What is started or loaded, in the plan's order: all but external processes."""
        return tuple(process for process in self.processes if process.kind != "external")

    @property
    def components(self) -> tuple[PlanProcess, ...]:
        """What containers load, in the plan's order."""
        return tuple(process for process in self.processes if process.component)

    def guards_of(self, host: str | None) -> tuple[str, ...]:
        """Return the nodes of the guard of a host's share.

        None or empty: of the machine that has no name here.
        """
        own = [
            node for process in self.processes if process.kind == "guard" for node in process.nodes
        ]
        # No two nodes have one name.
        return tuple(node.removesuffix(_name_end(self.host)) + _name_end(host) for node in own)

    def claim_on(self, nodes: tuple[str, ...], parent: str, child: str) -> PlanClaim | None:
        """Return what is known of one of the nodes publishing the edge by default, or None."""
        ends = (parent, child)
        return next(
            (
                claim
                for claim in self.claims
                if claim.node in nodes and (claim.parent, claim.child) == ends
            ),
            None,
        )

    def may_be_undeclared(self, parent: str, child: str) -> bool:
        """Whether nobody needs to have declared the edge.

        By policy, or because it is another robot's.
        """
        policy, ros = self.guard, self.ros
        if (
            ros.frame_prefix
            and not child.startswith(ros.frame_prefix)
            and child not in ros.shared_frames
        ):
            return True
        return policy.unknown_edges == "ignore" or any(
            fnmatchcase(parent, pattern.parent) and fnmatchcase(child, pattern.child)
            for pattern in policy.allow
        )

    def edges_of(self, owner: str) -> tuple[PlanEdge, ...]:
        """Return the edges that the process publishes, in the plan's order."""
        return tuple(edge for edge in self.edges if edge.owner == owner)

    def started_with(self, process: PlanProcess) -> tuple[Any, ...]:
        """Return all of the plan that decides how the process runs.

        An edge's place in the robot file does not, nor the pose of an edge of the stock
        robot_state_publisher, which takes another description while it runs, nor for the guard
        that of one which ``static`` publishes.
        """
        guards = process.kind == "guard"
        edges = self.edges if guards else self.edges_of(process.name)
        fence = (self.robot, self.guard.fence) if self.guard.mode == "strict" else None
        unplaced = {
            other.name
            for other in self.processes
            if other.is_state_publisher or (guards and other.kind == "static")
        }
        anywhere = [
            *(replace(edge, source=_NOWHERE) for edge in edges if edge.owner not in unplaced),
            *(
                replace(edge, source=_NOWHERE, pose=Pose())
                for edge in edges
                if edge.owner in unplaced
            ),
        ]
        describes = self.describes(process)
        return process, self.ros, fence, anywhere, self.guard if guards else None, describes

    def describes(self, process: PlanProcess) -> bool:
        """Return whether the process publishes a robot's description.

        ``static`` does, and ``joints`` where there is no ``static`` beside it.
        """
        static = f"{process.name.removesuffix('joints')}static"
        return process.kind == "static" or (
            process.kind == "joints" and all(process.name != static for process in self.processes)
        )


def _name_end(host: str | None) -> str:
    return f"_{_NO_NAME.sub('_', host)}" if host else ""
